/* The inverter board: what each pin does, and which devices of the controller get a clock.
 * README.md has the pin table. */
#ifndef STM32_BOARD_H
#define STM32_BOARD_H

#include <stdbool.h>

#include "stm32_registers.h"

typedef struct {
    stm32_rcc_t *rcc;
    stm32_gpio_t *port_a;
    stm32_gpio_t *port_b;
    stm32_gpio_t *port_c;
} stm32_board_t;

/* The first act after reset: driven lows on the gates. */
void stm32_board_gates_low(const stm32_board_t *board);

/* Not before stm32_pwm_start has made "off" a driven low of the timer too. */
void stm32_board_gates_to_timer(const stm32_board_t *board);

void stm32_board_clocks(const stm32_board_t *board);

/* All pins but the gates'. */
void stm32_board_pins(const stm32_board_t *board);

/* Pins and clocks of a fieldbus: UART4, its driver enable, CAN1. */
#define STM32_BOARD_DRIVER_ENABLE 12u /* of port C */
void stm32_board_bus(const stm32_board_t *board);

void stm32_board_led_run(const stm32_board_t *board, bool on);
void stm32_board_led_fault(const stm32_board_t *board, bool on);

#endif
