/* The two boards: what each pin does, and which devices of the controller get a clock. README.md
 * has the pin tables.
 */
#ifndef G431_BOARD_H
#define G431_BOARD_H

#include <stdbool.h>
#include <stdint.h>

#include "g431_adc.h"
#include "stm32_gpio.h"
#include "stm32_registers.h"

#define G431_BOARD_ANALOG_MAX 10u

typedef struct {
    uint8_t port; /* 0: A, 1: B, 2: C */
    uint8_t pin;
    uint8_t function;
} g431_pin_t;

/* What differs from board to board. */
typedef struct {
    const char *crystal_text;
    uint32_t crystal_MHz;
    g431_pin_t lower[3]; /* gates of the lower switches; the upper ones are PA8, PA9, PA10 */
    bool lower_inverted; /* their driver switches on at a low level */
    g431_pin_t analog[G431_BOARD_ANALOG_MAX];
    uint32_t analogs;
    g431_channels_t channels;
    uint16_t idle_counts; /* of a shunt's word without current */
    bool amplifiers;      /* the part's own amplifiers and comparators */
    uint32_t trip_code;   /* their threshold: g431_analog.h */
    uint32_t break_sources;
    uint32_t break_bits; /* of TIM1's BDTR */
    g431_pin_t break_pin;
    bool has_break_pin;
    g431_pin_t tx, rx; /* of the programmer's serial port, USART2 */
    g431_pin_t led;
    g431_pin_t can_off; /* high: the board's CAN transceiver sleeps */
    bool has_can_off;
} g431_wiring_t;

typedef struct {
    stm32_rcc_t *rcc;
    stm32_gpio_t *port[3]; /* A, B, C */
    const g431_wiring_t *wiring;
} g431_board_t;

extern const g431_wiring_t g431_esc;     /* B-G431B-ESC1 */
extern const g431_wiring_t g431_ihm08m1; /* NUCLEO-G431RB with X-NUCLEO-IHM08M1 */

/* The first act after reset: every gate line driven to its inactive level. */
void g431_board_gates_off(const g431_board_t *board);

/* Not before stm32_pwm_start has made "off" a driven level of the timer too. */
void g431_board_gates_to_timer(const g431_board_t *board);

void g431_board_clocks(const g431_board_t *board);

/* All pins but the gates'. */
void g431_board_pins(const g431_board_t *board);

/* What opens the gates by itself, before stm32_pwm_start locks it; beside that the part's own:
 * lock-up of the core, a flash word beyond repair, failure of the crystal. */
void g431_board_break(const g431_board_t *board, stm32_tim_t *tim, stm32_syscfg_t *syscfg);

/* Pins and clocks of a fieldbus, the same on both: USART1 on PB6 and PB7, its driver enable, FDCAN1
 * on PA11 and PB9. */
#define G431_BOARD_DRIVER_ENABLE 8u /* of port B */
void g431_board_bus(const g431_board_t *board);

void g431_board_led(const g431_board_t *board, bool on);

#endif
