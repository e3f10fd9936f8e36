#include "g431_board.h"

#include "num.h"

#define A 0u
#define B 1u
#define C 2u

#define CAN_FROM_BUS 2u /* RCC_CCIPR: the clock of APB1 */
#define TIMER_1      6u
#define TIMER_1_ALSO 4u /* of PC13 and PB15 */
#define SERIAL       7u
#define UPPER_FIRST  8u

/* 8 samples at 170 MHz / 32: 1.5 us. Six at 170 MHz / 2: 70 ns behind an external comparator. */
#define FILTER_LONG  (15u << TIM_BDTR_BKF_Pos)
#define FILTER_SHORT (4u << TIM_BDTR_BKF_Pos)

const g431_wiring_t g431_esc = {
    .crystal_text = "clock: 170 MHz from 8 MHz crystal\r\n",
    .crystal_MHz = 8u,
    .lower = {{C, 13u, TIMER_1_ALSO}, {A, 12u, TIMER_1}, {B, 15u, TIMER_1_ALSO}},
    .analog = {{A, 0u, 0u},
               {A, 1u, 0u},
               {A, 2u, 0u},
               {A, 3u, 0u},
               {A, 5u, 0u},
               {A, 6u, 0u},
               {A, 7u, 0u},
               {B, 0u, 0u},
               {B, 1u, 0u},
               {B, 2u, 0u}},
    .analogs = 10u,
    .channels = {.u = 3u, .w = 12u, .v = 3u, .dc = 1u},
    .idle_counts = 2542u, /* .128 V x 16 */
    .amplifiers = true,
    .trip_code = 287u, /* .128 V + 60 A x 1.714 mV/A */
    .break_sources = TIM_AF1_BKCMP1E | TIM_AF1_BKCMP2E | TIM_AF1_BKCMP4E,
    .break_bits = TIM_BDTR_BKP | FILTER_LONG,
    .tx = {B, 3u, SERIAL},
    .rx = {B, 4u, SERIAL},
    .led = {C, 6u, 0u},
    .can_off = {C, 11u, 0u},
    .has_can_off = true,
};

const g431_wiring_t g431_ihm08m1 = {
    .crystal_text = "clock: 170 MHz from 24 MHz crystal\r\n",
    .crystal_MHz = 24u,
    .lower = {{A, 7u, TIMER_1}, {B, 0u, TIMER_1}, {B, 1u, TIMER_1}},
    .lower_inverted = true,
    .analog = {{A, 0u, 0u}, {A, 1u, 0u}, {C, 0u, 0u}, {C, 1u, 0u}},
    .analogs = 4u,
    .channels = {.u = 1u, .w = 6u, .v = 7u, .dc = 2u},
    .idle_counts = 2122u,                           /* 1.71 V */
    .break_sources = TIM_AF1_BKINE | TIM_AF1_BKINP, /* low: too much current */
    .break_bits = TIM_BDTR_BKP | FILTER_SHORT,
    .break_pin = {A, 6u, TIMER_1},
    .has_break_pin = true,
    .tx = {A, 2u, SERIAL},
    .rx = {A, 3u, SERIAL},
    .led = {A, 5u, 0u},
};

COLD static void configure(const g431_board_t *board, g431_pin_t pin, stm32_gpio_mode_t mode,
                           stm32_gpio_pull_t pull)
{
    stm32_gpio_configure(board->port[pin.port], pin.pin, mode, pull, pin.function);
}

COLD static void gate_pins(const g431_board_t *board, stm32_gpio_mode_t mode)
{
    const g431_wiring_t *const wiring = board->wiring;
    const stm32_gpio_pull_t off =
        wiring->lower_inverted ? STM32_GPIO_PULL_UP : STM32_GPIO_PULL_DOWN;
    for (uint32_t leg = 0u; leg < 3u; leg++) {
        stm32_gpio_configure(board->port[A], UPPER_FIRST + leg, mode, STM32_GPIO_PULL_DOWN,
                             TIMER_1);
        configure(board, wiring->lower[leg], mode, off);
    }
}

COLD void g431_board_gates_off(const g431_board_t *board)
{
    const g431_wiring_t *const wiring = board->wiring;
    board->rcc->AHB2ENR |= RCC_AHB2ENR_GPIOAEN | RCC_AHB2ENR_GPIOBEN | RCC_AHB2ENR_GPIOCEN;
    (void)board->rcc->AHB2ENR; /* a device answers some clocks after it got one */
    for (uint32_t leg = 0u; leg < 3u; leg++) {
        const g431_pin_t lower = wiring->lower[leg];
        stm32_gpio_write(board->port[A], UPPER_FIRST + leg, false);
        stm32_gpio_write(board->port[lower.port], lower.pin, wiring->lower_inverted);
    }
    gate_pins(board, STM32_GPIO_OUTPUT);
}

COLD void g431_board_gates_to_timer(const g431_board_t *board)
{
    gate_pins(board, STM32_GPIO_ALTERNATE);
}

COLD void g431_board_clocks(const g431_board_t *board)
{
    stm32_rcc_t *const rcc = board->rcc;
    rcc->AHB2ENR |= RCC_AHB2ENR_ADC12EN | RCC_AHB2ENR_DAC3EN | RCC_AHB2ENR_RNGEN;
    rcc->APB1ENR1 |=
        RCC_APB1ENR1_TIM2EN | RCC_APB1ENR1_TIM7EN | RCC_APB1ENR1_WWDGEN | RCC_APB1ENR1_USART2EN;
    rcc->APB2ENR |= RCC_APB2ENR_SYSCFGEN | RCC_APB2ENR_TIM1EN;
    (void)rcc->APB2ENR; /* a device answers some clocks after it got one */
}

COLD void g431_board_pins(const g431_board_t *board)
{
    const g431_wiring_t *const wiring = board->wiring;
    for (uint32_t n = 0u; n < wiring->analogs; n++) {
        configure(board, wiring->analog[n], STM32_GPIO_ANALOG, STM32_GPIO_FLOATING);
    }
    if (wiring->has_break_pin) {
        configure(board, wiring->break_pin, STM32_GPIO_ALTERNATE, STM32_GPIO_FLOATING);
    }
    configure(board, wiring->tx, STM32_GPIO_ALTERNATE, STM32_GPIO_FLOATING);
    configure(board, wiring->rx, STM32_GPIO_ALTERNATE, STM32_GPIO_PULL_UP);
    configure(board, wiring->led, STM32_GPIO_OUTPUT, STM32_GPIO_FLOATING);
}

COLD void g431_board_bus(const g431_board_t *board)
{
    static const g431_pin_t sent[] = {{B, 6u, 7u}, {B, 9u, 9u}};
    static const g431_pin_t received[] = {{B, 7u, 7u}, {A, 11u, 9u}};
    const g431_wiring_t *const wiring = board->wiring;
    stm32_rcc_t *const rcc = board->rcc;
    rcc->CCIPR = (rcc->CCIPR & ~RCC_CCIPR_FDCANSEL_Msk) | (CAN_FROM_BUS << RCC_CCIPR_FDCANSEL_Pos);
    rcc->APB1ENR1 |= RCC_APB1ENR1_FDCANEN;
    rcc->APB2ENR |= RCC_APB2ENR_USART1EN;
    (void)rcc->APB2ENR; /* a device answers some clocks after it got one */
    stm32_gpio_write(board->port[B], G431_BOARD_DRIVER_ENABLE, false);
    stm32_gpio_configure(board->port[B], G431_BOARD_DRIVER_ENABLE, STM32_GPIO_OUTPUT,
                         STM32_GPIO_FLOATING, 0u);
    for (uint32_t k = 0u; k < 2u; k++) {
        configure(board, sent[k], STM32_GPIO_ALTERNATE, STM32_GPIO_FLOATING);
        configure(board, received[k], STM32_GPIO_ALTERNATE, STM32_GPIO_PULL_UP);
    }
    if (wiring->has_can_off) {
        stm32_gpio_write(board->port[wiring->can_off.port], wiring->can_off.pin, false);
        configure(board, wiring->can_off, STM32_GPIO_OUTPUT, STM32_GPIO_FLOATING);
    }
}

COLD void g431_board_break(const g431_board_t *board, stm32_tim_t *tim, stm32_syscfg_t *syscfg)
{
    tim->AF1 = board->wiring->break_sources;
    syscfg->CFGR2 = SYSCFG_CFGR2_CLL | SYSCFG_CFGR2_ECCL;
}

COLD void g431_board_led(const g431_board_t *board, bool on)
{
    const g431_pin_t led = board->wiring->led;
    stm32_gpio_write(board->port[led.port], led.pin, on);
}
