#include "stm32_board.h"

#include "num.h"
#include "stm32_gpio.h"

#define PIN_LED_RUN   6u /* of port C; 13 to 15 must not source a current (data sheet) */
#define PIN_LED_FAULT 7u

/* PA8..10 and PB13..15. */
COLD static void gate_pins(const stm32_board_t *board, stm32_gpio_mode_t mode)
{
    for (uint32_t pin = 0u; pin < 3u; pin++) {
        stm32_gpio_configure(board->port_a, 8u + pin, mode, STM32_GPIO_PULL_DOWN, 1u);
        stm32_gpio_configure(board->port_b, 13u + pin, mode, STM32_GPIO_PULL_DOWN, 1u);
    }
}

COLD void stm32_board_gates_low(const stm32_board_t *board)
{
    board->rcc->AHB1ENR |= RCC_AHB1ENR_GPIOAEN | RCC_AHB1ENR_GPIOBEN | RCC_AHB1ENR_GPIOCEN;
    (void)board->rcc->AHB1ENR; /* a device answers some clocks after it got one */
    gate_pins(board, STM32_GPIO_OUTPUT);
}

COLD void stm32_board_gates_to_timer(const stm32_board_t *board)
{
    gate_pins(board, STM32_GPIO_ALTERNATE);
}

COLD void stm32_board_clocks(const stm32_board_t *board)
{
    board->rcc->AHB2ENR |= RCC_AHB2ENR_RNGEN;
    board->rcc->APB1ENR |= RCC_APB1ENR_TIM5EN | RCC_APB1ENR_TIM7EN | RCC_APB1ENR_USART3EN;
    board->rcc->APB2ENR |=
        RCC_APB2ENR_TIM1EN | RCC_APB2ENR_ADC1EN | RCC_APB2ENR_ADC2EN | RCC_APB2ENR_ADC3EN;
    (void)board->rcc->APB2ENR; /* a device answers some clocks after it got one */
}

COLD void stm32_board_pins(const stm32_board_t *board)
{
    for (uint32_t pin = 0u; pin < 3u; pin++) {
        stm32_gpio_configure(board->port_a, pin, STM32_GPIO_ANALOG, STM32_GPIO_FLOATING, 0u);
        stm32_gpio_configure(board->port_c, pin, STM32_GPIO_ANALOG, STM32_GPIO_FLOATING, 0u);
    }
    stm32_gpio_configure(board->port_b, 12u, STM32_GPIO_ALTERNATE, STM32_GPIO_PULL_DOWN, 1u);
    stm32_gpio_configure(board->port_b, 10u, STM32_GPIO_ALTERNATE, STM32_GPIO_FLOATING, 7u);
    stm32_gpio_configure(board->port_b, 11u, STM32_GPIO_ALTERNATE, STM32_GPIO_PULL_UP, 7u);
    stm32_gpio_configure(board->port_c, PIN_LED_RUN, STM32_GPIO_OUTPUT, STM32_GPIO_FLOATING, 0u);
    stm32_gpio_configure(board->port_c, PIN_LED_FAULT, STM32_GPIO_OUTPUT, STM32_GPIO_FLOATING, 0u);
}

COLD void stm32_board_bus(const stm32_board_t *board)
{
    board->rcc->APB1ENR |= RCC_APB1ENR_UART4EN | RCC_APB1ENR_CAN1EN;
    (void)board->rcc->APB1ENR; /* a device answers some clocks after it got one */
    stm32_gpio_write(board->port_c, STM32_BOARD_DRIVER_ENABLE, false);
    stm32_gpio_configure(board->port_c, STM32_BOARD_DRIVER_ENABLE, STM32_GPIO_OUTPUT,
                         STM32_GPIO_FLOATING, 0u);
    stm32_gpio_configure(board->port_c, 10u, STM32_GPIO_ALTERNATE, STM32_GPIO_FLOATING, 8u);
    stm32_gpio_configure(board->port_c, 11u, STM32_GPIO_ALTERNATE, STM32_GPIO_PULL_UP, 8u);
    stm32_gpio_configure(board->port_b, 8u, STM32_GPIO_ALTERNATE, STM32_GPIO_PULL_UP, 9u);
    stm32_gpio_configure(board->port_b, 9u, STM32_GPIO_ALTERNATE, STM32_GPIO_FLOATING, 9u);
}

void stm32_board_led_run(const stm32_board_t *board, bool on)
{
    stm32_gpio_write(board->port_c, PIN_LED_RUN, on);
}

void stm32_board_led_fault(const stm32_board_t *board, bool on)
{
    stm32_gpio_write(board->port_c, PIN_LED_FAULT, on);
}
