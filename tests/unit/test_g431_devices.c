/* The small devices of the STM32G431 port on register blocks in RAM: converters, amplifiers, pins
 * of both boards, serial port, window watchdog, flash pages. */
#define _DEFAULT_SOURCE /* setitimer */
#include "g431_adc.h"
#include "g431_analog.h"
#include "g431_board.h"
#include "g431_slots.h"
#include "stm32_usart.h"
#include "g431_window.h"

#include <math.h>
#include <signal.h>
#include <sys/time.h>

#include "unity.h"

#define CLOCK_HZ 170000000u
#define POLLS    10u
#define FOREVER  UINT32_MAX

static stm32_adc_t adc1;
static stm32_adc_t adc2;
static stm32_adc_common_t common;
static g431_adcs_t adcs = {&adc1, &adc2, &common, &g431_esc.channels};
static stm32_rcc_t rcc;
static stm32_gpio_t port[3];
static g431_board_t board = {&rcc, {&port[0], &port[1], &port[2]}, &g431_esc};
static stm32_usart_t usart;
static stm32_wwdg_t wwdg;
static stm32_flash_t flash;
static uint32_t cells[2u * G431_SLOTS_BYTES / 4u];
static g431_slots_t slots;

void setUp(void)
{
    adc1 = (stm32_adc_t){.CR = ADC_CR_RESET, .CFGR = ADC_CFGR_RESET};
    adc2 = adc1;
    common = (stm32_adc_common_t){0};
    adcs.channels = &g431_esc.channels;
    rcc = (stm32_rcc_t){0};
    port[0] = (stm32_gpio_t){.MODER = GPIOA_MODER_RESET};
    port[1] = (stm32_gpio_t){.MODER = GPIOB_MODER_RESET};
    port[2] = (stm32_gpio_t){.MODER = GPIOC_MODER_RESET};
    board.wiring = &g431_esc;
    usart = (stm32_usart_t){0};
    wwdg = (stm32_wwdg_t){.CR = WWDG_CR_RESET, .CFR = WWDG_CFR_RESET};
    flash = (stm32_flash_t){.ACR = FLASH_ACR_DCEN | FLASH_ACR_ICEN | 4u}; /* opened by the keys */
    slots = (g431_slots_t){&flash, cells, POLLS};
    for (uint32_t n = 0u; n < 2u * G431_SLOTS_BYTES / 4u; n++) {
        cells[n] = UINT32_MAX;
    }
}

void tearDown(void)
{
}

/* What a converter does by itself: ends its calibration, gets ready. RAM does it once a
 * millisecond. */
static void converters_work(int number)
{
    (void)number;
    stm32_adc_t *const adc[2] = {&adc1, &adc2};
    for (int n = 0; n < 2; n++) {
        adc[n]->CR &= ~ADC_CR_ADCAL;
        if ((adc[n]->CR & ADC_CR_ADEN) != 0u) {
            adc[n]->ISR |= ADC_ISR_ADRDY;
        }
    }
}

static bool start_working_converters(void)
{
    const struct sigaction action = {.sa_handler = converters_work};
    const struct itimerval often = {{0, 1000}, {0, 1000}};
    const struct itimerval never = {{0, 0}, {0, 0}};
    TEST_ASSERT_EQUAL_INT(0, sigaction(SIGALRM, &action, NULL));
    TEST_ASSERT_EQUAL_INT(0, setitimer(ITIMER_REAL, &often, NULL));
    const bool started = g431_adc_start(&adcs, FOREVER);
    TEST_ASSERT_EQUAL_INT(0, setitimer(ITIMER_REAL, &never, NULL));
    return started;
}

/* Two ranks each, JL 1: u (IN3) then w (IN12); v (IN3) then the dc link (IN1). */
static void test_converters_take_two_shunts_then_the_third_and_the_dc_link(void)
{
    TEST_ASSERT_TRUE(start_working_converters());
    TEST_ASSERT_EQUAL_HEX32(1u | (3u << 9) | (12u << 15), adc1.JSQR);
    TEST_ASSERT_EQUAL_HEX32(1u | (3u << 9) | (1u << 15), adc2.JSQR);
    TEST_ASSERT_EQUAL_HEX32(5u | (3u << 16), common.CCR); /* injected simultaneous, bus / 4 */
    TEST_ASSERT_EQUAL_HEX32(2u << 9, adc1.SMPR1);         /* IN3: 12.5 cycles */
    TEST_ASSERT_EQUAL_HEX32(4u << 6, adc1.SMPR2);         /* IN12: 47.5 */
    TEST_ASSERT_EQUAL_HEX32((2u << 9) | (4u << 3), adc2.SMPR1);
    TEST_ASSERT_EQUAL_HEX32(ADC_CFGR_JQDIS, adc1.CFGR);
    TEST_ASSERT_EQUAL_HEX32(ADC_CR_ADVREGEN | ADC_CR_ADEN, adc1.CR);
    TEST_ASSERT_EQUAL_HEX32(0u, adc1.IER | adc2.IER);
}

/* The times of one rank are the same in both, or the second would be read before it is there. */
static void test_both_converters_of_the_other_board_take_the_same_time(void)
{
    adcs.channels = &g431_ihm08m1.channels;
    TEST_ASSERT_TRUE(start_working_converters());
    TEST_ASSERT_EQUAL_HEX32(1u | (1u << 9) | (6u << 15), adc1.JSQR);
    TEST_ASSERT_EQUAL_HEX32(1u | (7u << 9) | (2u << 15), adc2.JSQR);
    TEST_ASSERT_EQUAL_HEX32((2u << 3) | (4u << 18), adc1.SMPR1);
    TEST_ASSERT_EQUAL_HEX32((2u << 21) | (4u << 6), adc2.SMPR1);
}

static void test_a_converter_that_does_not_calibrate_is_given_up(void)
{
    TEST_ASSERT_FALSE(g431_adc_start(&adcs, POLLS));
    TEST_ASSERT_EQUAL_HEX32(0u, adc1.JSQR);
}

/* TIM1's TRGO is number 0; rising edge. The slave follows the master. */
static void test_only_the_master_is_triggered_and_interrupts(void)
{
    g431_adc_follow_carrier(&adcs);
    TEST_ASSERT_EQUAL_HEX32(1u << 7, adc1.JSQR);
    TEST_ASSERT_EQUAL_HEX32(1u << 6, adc1.IER);
    TEST_ASSERT_EQUAL_HEX32(ADC_CR_ADVREGEN | ADC_CR_JADSTART, adc1.CR);
    TEST_ASSERT_EQUAL_HEX32(0u, adc2.JSQR);
    TEST_ASSERT_EQUAL_HEX32(0u, adc2.IER);
    TEST_ASSERT_EQUAL_HEX32(ADC_CR_RESET, adc2.CR);
}

static void test_words_land_with_their_names_and_flags_are_cleared(void)
{
    g431_words_t words;
    adc1.JDR1 = 0xF001u;
    adc2.JDR1 = 0x102u;
    adc1.JDR2 = 0x203u;
    adc2.JDR2 = 0xFFFF0304u; /* the upper half is no data */
    g431_adc_read(&adcs, &words);
    TEST_ASSERT_EQUAL_HEX16(0xF001u, words.u);
    TEST_ASSERT_EQUAL_HEX16(0x102u, words.v);
    TEST_ASSERT_EQUAL_HEX16(0x203u, words.w);
    TEST_ASSERT_EQUAL_HEX16(0x304u, words.dc);
    TEST_ASSERT_EQUAL_HEX32(ADC_ISR_JEOS | ADC_ISR_JEOC, adc1.ISR);
}

static void test_a_conversion_by_software_ends_or_is_told(void)
{
    g431_words_t words;
    adc2.JDR2 = 77u;
    TEST_ASSERT_TRUE(
        g431_adc_convert(&adcs, &words, POLLS)); /* RAM keeps the flag it is to clear */
    TEST_ASSERT_EQUAL_UINT16(77u, words.dc);
    TEST_ASSERT_EQUAL_HEX32(ADC_CR_ADVREGEN | ADC_CR_JADSTART, adc1.CR);
    TEST_ASSERT_FALSE(g431_adc_convert(&adcs, &words, 0u));
}

/* High speed, ladder with its foot at VINM0, x16. */
static void test_amplifiers_have_gain_16(void)
{
    stm32_opamp_t opamp = {0};
    g431_analog_amplify(&opamp);
    const uint32_t mode = 1u | (2u << 5) | (1u << 7) | (11u << 14);
    TEST_ASSERT_EQUAL_HEX32(mode, opamp.OPAMP1_CSR);
    TEST_ASSERT_EQUAL_HEX32(mode, opamp.OPAMP2_CSR);
    TEST_ASSERT_EQUAL_HEX32(mode, opamp.OPAMP3_CSR);
}

static void test_comparators_watch_three_shunts_and_are_locked(void)
{
    stm32_dac_t dac = {0};
    stm32_comp_t comp = {0};
    g431_analog_watch(&dac, &comp, 287u);
    TEST_ASSERT_EQUAL_HEX32((1u << 16) | 1u, dac.CR);
    TEST_ASSERT_EQUAL_HEX32(3u | (3u << 16) | (2u << 14), dac.MCR);
    TEST_ASSERT_EQUAL_UINT32(287u, dac.DHR12R1);
    TEST_ASSERT_EQUAL_UINT32(287u, dac.DHR12R2);
    const uint32_t mode = 1u | (4u << 4) | (1u << 16) | (1u << 31);
    TEST_ASSERT_EQUAL_HEX32(mode, comp.C1CSR);
    TEST_ASSERT_EQUAL_HEX32(mode, comp.C2CSR);
    TEST_ASSERT_EQUAL_HEX32(0u, comp.C3CSR);
    TEST_ASSERT_EQUAL_HEX32(mode, comp.C4CSR);
}

static uint32_t mode_of(uint32_t p, uint32_t pin)
{
    return (port[p].MODER >> (2u * pin)) & 3u;
}

static uint32_t function_of(uint32_t p, uint32_t pin)
{
    return (((pin < 8u) ? port[p].AFRL : port[p].AFRH) >> (4u * (pin % 8u))) & 15u;
}

/* PA8..10; PC13 and PB15 have another function number than PA12. */
static void test_gates_of_the_esc_are_driven_low_before_the_timer_has_them(void)
{
    g431_board_gates_off(&board);
    const uint32_t gate[6][3] = {{0, 8, 6},  {0, 9, 6},  {0, 10, 6},
                                 {2, 13, 4}, {0, 12, 6}, {1, 15, 4}};
    for (int n = 0; n < 6; n++) {
        TEST_ASSERT_EQUAL_UINT32(1u, mode_of(gate[n][0], gate[n][1]));
    }
    TEST_ASSERT_EQUAL_HEX32(7u, rcc.AHB2ENR);
    TEST_ASSERT_EQUAL_HEX32(1u << (15u + 16u), port[1].BSRR); /* the last write: low */
    TEST_ASSERT_EQUAL_HEX32(1u << (13u + 16u), port[2].BSRR);
    g431_board_gates_to_timer(&board);
    for (int n = 0; n < 6; n++) {
        TEST_ASSERT_EQUAL_UINT32(2u, mode_of(gate[n][0], gate[n][1]));
        TEST_ASSERT_EQUAL_UINT32(gate[n][2], function_of(gate[n][0], gate[n][1]));
    }
}

/* L6398: a low level closes the lower switch. High, pulled up as well, is off. */
static void test_lower_gates_of_the_other_board_are_driven_high(void)
{
    board.wiring = &g431_ihm08m1;
    g431_board_gates_off(&board);
    TEST_ASSERT_EQUAL_UINT32(1u, mode_of(0u, 7u));
    TEST_ASSERT_EQUAL_UINT32(1u, mode_of(1u, 0u));
    TEST_ASSERT_EQUAL_UINT32(1u, mode_of(1u, 1u));
    TEST_ASSERT_EQUAL_HEX32(1u << 1, port[1].BSRR);                /* the last write: PB1 high */
    TEST_ASSERT_EQUAL_HEX32(1u << 14, port[0].PUPDR & (3u << 14)); /* PA7 up */
    TEST_ASSERT_EQUAL_HEX32(2u << 16, port[0].PUPDR & (3u << 16)); /* PA8 down */
    g431_board_gates_to_timer(&board);
    TEST_ASSERT_EQUAL_UINT32(6u, function_of(0u, 7u));
    TEST_ASSERT_EQUAL_UINT32(6u, function_of(1u, 0u));
    TEST_ASSERT_EQUAL_UINT32(6u, function_of(1u, 1u));
}

/* What a board does not name stays as the part woke up: SWD above all. */
static void test_pins_of_the_esc(void)
{
    g431_board_pins(&board);
    TEST_ASSERT_EQUAL_UINT32(3u, mode_of(0u, 2u)); /* OPAMP1's output */
    TEST_ASSERT_EQUAL_UINT32(2u, mode_of(1u, 3u));
    TEST_ASSERT_EQUAL_UINT32(7u, function_of(1u, 3u));
    TEST_ASSERT_EQUAL_UINT32(7u, function_of(1u, 4u));
    TEST_ASSERT_EQUAL_UINT32(1u, mode_of(2u, 6u));
    TEST_ASSERT_EQUAL_UINT32(2u, mode_of(0u, 13u));
    TEST_ASSERT_EQUAL_UINT32(2u, mode_of(0u, 14u));
    g431_board_led(&board, true);
    TEST_ASSERT_EQUAL_HEX32(1u << 6, port[2].BSRR);
}

static void test_pins_of_the_nucleo(void)
{
    board.wiring = &g431_ihm08m1;
    g431_board_pins(&board);
    TEST_ASSERT_EQUAL_UINT32(2u, mode_of(0u, 6u));
    TEST_ASSERT_EQUAL_UINT32(6u, function_of(0u, 6u)); /* break */
    TEST_ASSERT_EQUAL_UINT32(7u, function_of(0u, 2u));
    TEST_ASSERT_EQUAL_UINT32(7u, function_of(0u, 3u));
    TEST_ASSERT_EQUAL_UINT32(3u, mode_of(2u, 1u));
    TEST_ASSERT_EQUAL_UINT32(1u, mode_of(0u, 5u));
    g431_board_led(&board, false);
    TEST_ASSERT_EQUAL_HEX32(1u << (5u + 16u), port[0].BSRR);
}

static void test_devices_get_their_clocks(void)
{
    g431_board_clocks(&board);
    TEST_ASSERT_EQUAL_HEX32((1u << 13) | (1u << 18) | (1u << 26), rcc.AHB2ENR);
    TEST_ASSERT_EQUAL_HEX32(1u | (1u << 5) | (1u << 11) | (1u << 17), rcc.APB1ENR1);
    TEST_ASSERT_EQUAL_HEX32(1u | (1u << 11), rcc.APB2ENR);
}

/* ESC: comparators 1, 2 and 4. Nucleo: the pin, inverted, as low says too much current. */
static void test_what_opens_the_gates_by_itself(void)
{
    stm32_tim_t tim = {.AF1 = TIM_AF1_BKINE};
    stm32_syscfg_t syscfg = {0};
    g431_board_break(&board, &tim, &syscfg);
    TEST_ASSERT_EQUAL_HEX32((1u << 1) | (1u << 2) | (1u << 4), tim.AF1);
    TEST_ASSERT_EQUAL_HEX32(1u | (1u << 3), syscfg.CFGR2);
    TEST_ASSERT_EQUAL_HEX32((1u << 13) | (15u << 16), g431_esc.break_bits);
    board.wiring = &g431_ihm08m1;
    g431_board_break(&board, &tim, &syscfg);
    TEST_ASSERT_EQUAL_HEX32(1u | (1u << 9), tim.AF1);
    TEST_ASSERT_EQUAL_HEX32((1u << 13) | (4u << 16), g431_ihm08m1.break_bits);
}

static void test_baud_rate_is_the_nearest_divider(void)
{
    TEST_ASSERT_TRUE(stm32_usart_start(&usart, CLOCK_HZ, 115200u));
    TEST_ASSERT_EQUAL_UINT32(1476u, usart.BRR); /* 115 176 baud, .02 % low */
    TEST_ASSERT_EQUAL_HEX32(1u | (3u << 2), usart.CR1);
    TEST_ASSERT_FALSE(stm32_usart_start(&usart, CLOCK_HZ, 0u));
    TEST_ASSERT_FALSE(stm32_usart_start(&usart, 1000000u, 115200u));
    TEST_ASSERT_FALSE(stm32_usart_start(&usart, CLOCK_HZ, 1200u));
    TEST_ASSERT_EQUAL_UINT32(1476u, usart.BRR);
    stm32_usart_interrupt(&usart);
    TEST_ASSERT_EQUAL_HEX32(1u | (3u << 2) | (1u << 5), usart.CR1);
}

static void test_text_is_sent_and_a_stuck_transmitter_is_told(void)
{
    usart.ISR = USART_ISR_TXE;
    TEST_ASSERT_TRUE(stm32_usart_send(&usart, "ab"));
    TEST_ASSERT_EQUAL_HEX32('b', usart.TDR);
    usart.ISR = 0u;
    TEST_ASSERT_FALSE(stm32_usart_send(&usart, "c"));
    TEST_ASSERT_FALSE(stm32_usart_put(&usart, 'd'));
    TEST_ASSERT_EQUAL_HEX32('b', usart.TDR);
}

static void test_a_byte_is_received_when_there_is_one(void)
{
    uint8_t byte = 'x';
    usart.RDR = 0xF2u; /* all eight bits are data */
    TEST_ASSERT_FALSE(stm32_usart_receive(&usart, &byte));
    TEST_ASSERT_EQUAL_HEX8('x', byte);
    usart.ISR = USART_ISR_RXNE;
    TEST_ASSERT_TRUE(stm32_usart_receive(&usart, &byte));
    TEST_ASSERT_EQUAL_HEX8(0xF2u, byte);
    TEST_ASSERT_EQUAL_HEX32(0u, usart.ICR);
}

/* An error left standing would raise the interrupt for ever. */
static void test_line_errors_drop_the_byte_and_are_cleared(void)
{
    const uint32_t error[] = {USART_ISR_PE, USART_ISR_FE, USART_ISR_NF};
    usart.RDR = 'r';
    for (int k = 0; k < 3; k++) {
        uint8_t byte = 'x';
        usart.ICR = 0u;
        usart.ISR = USART_ISR_RXNE | error[k];
        TEST_ASSERT_FALSE(stm32_usart_receive(&usart, &byte));
        TEST_ASSERT_EQUAL_HEX8('x', byte);
        TEST_ASSERT_EQUAL_HEX32(15u, usart.ICR);
    }
}

static void test_an_overrun_is_cleared_and_the_byte_in_front_of_it_kept(void)
{
    uint8_t byte = 'x';
    usart.RDR = 'r';
    usart.ISR = USART_ISR_ORE;
    TEST_ASSERT_FALSE(stm32_usart_receive(&usart, &byte));
    TEST_ASSERT_EQUAL_HEX32(15u, usart.ICR);
    usart.ISR = USART_ISR_ORE | USART_ISR_RXNE;
    TEST_ASSERT_TRUE(stm32_usart_receive(&usart, &byte));
    TEST_ASSERT_EQUAL_HEX8('r', byte);
}

/* 200 us are 8.3 counts of 24.1 us: open from the sixth on, over behind the 64th (1.54 ms). */
static void test_the_window_opens_at_three_quarters_of_a_period(void)
{
    TEST_ASSERT_TRUE(g431_window_start(&wwdg, CLOCK_HZ, 200e-6f));
    TEST_ASSERT_EQUAL_HEX32(0x7Fu - 6u, wwdg.CFR);
    TEST_ASSERT_EQUAL_HEX32(0xFFu, wwdg.CR);
}

static void test_periods_that_the_window_cannot_watch_are_refused(void)
{
    const float bad[] = {90e-6f, 800e-6f, 0.0f, -1.0f, NAN, INFINITY};
    for (int k = 0; k < 6; k++) {
        TEST_ASSERT_FALSE(g431_window_start(&wwdg, CLOCK_HZ, bad[k]));
        TEST_ASSERT_EQUAL_HEX32(WWDG_CR_RESET, wwdg.CR);
    }
    TEST_ASSERT_TRUE(g431_window_start(&wwdg, CLOCK_HZ, 100e-6f));
    TEST_ASSERT_TRUE(g431_window_start(&wwdg, CLOCK_HZ, 770e-6f));
}

static void test_a_page_of_the_parameters_is_erased_and_the_flash_locked_again(void)
{
    TEST_ASSERT_EQUAL(G431_FLASH_OK, g431_flash_erase(&flash, G431_FLASH_PAGE_LAST, POLLS));
    TEST_ASSERT_EQUAL_HEX32(FLASH_CR_LOCK, flash.CR);
    TEST_ASSERT_EQUAL_HEX32(FLASH_ACR_DCEN | FLASH_ACR_ICEN | 4u, flash.ACR);
}

/* A closed flash ignores what it is told and raises no flag. */
static void test_a_flash_that_does_not_open_is_told_and_not_written(void)
{
    const uint32_t words[2] = {1u, 2u};
    flash.CR = FLASH_CR_RESET;
    TEST_ASSERT_EQUAL(G431_FLASH_FAILED, g431_flash_erase(&flash, G431_FLASH_PAGE_FIRST, POLLS));
    TEST_ASSERT_EQUAL_HEX32(0xCDEF89ABu, flash.KEYR);
    TEST_ASSERT_EQUAL(G431_FLASH_FAILED,
                      g431_flash_program(&flash, G431_FLASH_START, cells, words, POLLS));
    TEST_ASSERT_EQUAL_HEX32(UINT32_MAX, cells[0]);
}

static void test_no_other_page_can_be_erased(void)
{
    for (uint32_t page = 0u; page < 256u; page++) {
        if ((page < G431_FLASH_PAGE_FIRST) || (page > G431_FLASH_PAGE_LAST)) {
            TEST_ASSERT_EQUAL(G431_FLASH_REFUSED, g431_flash_erase(&flash, page, POLLS));
        }
    }
    TEST_ASSERT_EQUAL_HEX32(0u, flash.KEYR);
}

static void test_a_double_word_is_programmed_inside_the_parameters_only(void)
{
    const uint32_t words[2] = {1u, 2u};
    TEST_ASSERT_EQUAL(G431_FLASH_OK,
                      g431_flash_program(&flash, G431_FLASH_START, cells, words, POLLS));
    TEST_ASSERT_EQUAL_UINT32(1u, cells[0]);
    TEST_ASSERT_EQUAL_UINT32(2u, cells[1]);
    const uint32_t outside[] = {G431_FLASH_START - 8u, G431_FLASH_END, G431_FLASH_START + 4u,
                                0x08000000u, 0x1FFF7800u};
    for (int k = 0; k < 5; k++) {
        TEST_ASSERT_EQUAL(G431_FLASH_REFUSED,
                          g431_flash_program(&flash, outside[k], &cells[2], words, POLLS));
    }
    TEST_ASSERT_EQUAL_HEX32(UINT32_MAX, cells[2]);
}

/* The control register stands for a cell: it does not keep what is written. */
static void test_words_that_read_back_otherwise_are_told(void)
{
    const uint32_t words[2] = {FLASH_SR_BSY << 1, 2u};
    volatile uint32_t *const to = &flash.CR - 1; /* SR and CR */
    TEST_ASSERT_EQUAL(G431_FLASH_FAILED,
                      g431_flash_program(&flash, G431_FLASH_START, to, words, POLLS));
}

static void test_a_flash_that_stays_busy_is_told_and_left_alone(void)
{
    const uint32_t words[2] = {1u, 2u};
    flash.SR = FLASH_SR_BSY;
    TEST_ASSERT_EQUAL(G431_FLASH_TIMEOUT, g431_flash_erase(&flash, G431_FLASH_PAGE_FIRST, POLLS));
    TEST_ASSERT_EQUAL(G431_FLASH_TIMEOUT,
                      g431_flash_program(&flash, G431_FLASH_START, cells, words, POLLS));
    TEST_ASSERT_EQUAL_HEX32(0u, flash.KEYR);
    TEST_ASSERT_EQUAL_HEX32(UINT32_MAX, cells[0]);
}

static void test_a_failure_of_the_flash_is_told(void)
{
    const uint32_t words[2] = {1u, 2u};
    const uint32_t failure[] = {FLASH_SR_OPERR,  FLASH_SR_PROGERR, FLASH_SR_WRPERR,
                                FLASH_SR_PGAERR, FLASH_SR_SIZERR,  FLASH_SR_PGSERR,
                                FLASH_SR_MISERR, FLASH_SR_FASTERR};
    for (int k = 0; k < 8; k++) {
        flash.SR = failure[k]; /* RAM keeps what is written to be cleared: as if it came again */
        flash.CR = 0u;
        TEST_ASSERT_EQUAL(G431_FLASH_FAILED,
                          g431_flash_program(&flash, G431_FLASH_START, cells, words, POLLS));
    }
}

/* A power cut while a double word was programmed: reading it raises the NMI. Anywhere else the
 * image is damaged. */
static void test_a_torn_word_of_the_parameters_is_forgiven_and_no_other(void)
{
    TEST_ASSERT_FALSE(g431_flash_forgive(&flash));
    flash.ECCR = (1u << 31) | 0x1E7F8u;
    TEST_ASSERT_FALSE(g431_flash_forgive(&flash));
    flash.ECCR = 0x1E800u;
    TEST_ASSERT_FALSE(g431_flash_forgive(&flash));
    flash.ECCR = (1u << 31) | 0x1E800u;
    TEST_ASSERT_TRUE(g431_flash_forgive(&flash));
    TEST_ASSERT_EQUAL_HEX32(1u << 31, flash.ECCR);
}

static void test_a_slot_is_a_page(void)
{
    TEST_ASSERT_EQUAL_UINT32(G431_FLASH_PAGE_FIRST, g431_slots_page(0u));
    TEST_ASSERT_EQUAL_UINT32(G431_FLASH_PAGE_LAST, g431_slots_page(1u));
    TEST_ASSERT_EQUAL(HAL_FLASH_DONE, g431_slots_erase(&slots, 1u));
    flash.CR = 0u;
    TEST_ASSERT_EQUAL(HAL_FLASH_DONE, g431_slots_erase(&slots, 0u));
    flash.CR = 0u;
    TEST_ASSERT_EQUAL(HAL_FLASH_FAILED, g431_slots_erase(&slots, 2u));
    flash.SR = FLASH_SR_BSY;
    TEST_ASSERT_EQUAL(HAL_FLASH_FAILED, g431_slots_erase(&slots, 0u));
}

static void test_slots_are_read_and_written_inside_alone(void)
{
    const uint32_t words[2] = {42u, 43u};
    TEST_ASSERT_EQUAL(HAL_FLASH_DONE, g431_slots_program(&slots, 1u, 8u, words));
    TEST_ASSERT_EQUAL_UINT32(42u, cells[G431_SLOTS_BYTES / 4u + 2u]);
    TEST_ASSERT_EQUAL_UINT32(43u, g431_slots_read(&slots, 1u, 12u));
    TEST_ASSERT_EQUAL_HEX32(UINT32_MAX, g431_slots_read(&slots, 0u, 12u));
    const uint32_t beyond[] = {G431_SLOTS_BYTES, UINT32_MAX - 7u, 2u};
    for (int k = 0; k < 3; k++) {
        TEST_ASSERT_EQUAL(HAL_FLASH_FAILED, g431_slots_program(&slots, 0u, beyond[k], words));
        TEST_ASSERT_EQUAL_UINT32(0u, g431_slots_read(&slots, 0u, beyond[k]));
    }
    TEST_ASSERT_EQUAL(HAL_FLASH_FAILED, g431_slots_program(&slots, 0u, 4u, words));
    TEST_ASSERT_EQUAL(HAL_FLASH_FAILED, g431_slots_program(&slots, 2u, 0u, words));
    TEST_ASSERT_EQUAL_UINT32(0u, g431_slots_read(&slots, 2u, 0u));
    flash.SR = FLASH_SR_BSY;
    TEST_ASSERT_EQUAL(HAL_FLASH_FAILED, g431_slots_program(&slots, 0u, 0u, words));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_converters_take_two_shunts_then_the_third_and_the_dc_link);
    RUN_TEST(test_both_converters_of_the_other_board_take_the_same_time);
    RUN_TEST(test_a_converter_that_does_not_calibrate_is_given_up);
    RUN_TEST(test_only_the_master_is_triggered_and_interrupts);
    RUN_TEST(test_words_land_with_their_names_and_flags_are_cleared);
    RUN_TEST(test_a_conversion_by_software_ends_or_is_told);
    RUN_TEST(test_amplifiers_have_gain_16);
    RUN_TEST(test_comparators_watch_three_shunts_and_are_locked);
    RUN_TEST(test_gates_of_the_esc_are_driven_low_before_the_timer_has_them);
    RUN_TEST(test_lower_gates_of_the_other_board_are_driven_high);
    RUN_TEST(test_pins_of_the_esc);
    RUN_TEST(test_pins_of_the_nucleo);
    RUN_TEST(test_devices_get_their_clocks);
    RUN_TEST(test_what_opens_the_gates_by_itself);
    RUN_TEST(test_baud_rate_is_the_nearest_divider);
    RUN_TEST(test_text_is_sent_and_a_stuck_transmitter_is_told);
    RUN_TEST(test_a_byte_is_received_when_there_is_one);
    RUN_TEST(test_line_errors_drop_the_byte_and_are_cleared);
    RUN_TEST(test_an_overrun_is_cleared_and_the_byte_in_front_of_it_kept);
    RUN_TEST(test_the_window_opens_at_three_quarters_of_a_period);
    RUN_TEST(test_periods_that_the_window_cannot_watch_are_refused);
    RUN_TEST(test_a_page_of_the_parameters_is_erased_and_the_flash_locked_again);
    RUN_TEST(test_a_flash_that_does_not_open_is_told_and_not_written);
    RUN_TEST(test_no_other_page_can_be_erased);
    RUN_TEST(test_a_double_word_is_programmed_inside_the_parameters_only);
    RUN_TEST(test_words_that_read_back_otherwise_are_told);
    RUN_TEST(test_a_flash_that_stays_busy_is_told_and_left_alone);
    RUN_TEST(test_a_failure_of_the_flash_is_told);
    RUN_TEST(test_a_torn_word_of_the_parameters_is_forgiven_and_no_other);
    RUN_TEST(test_a_slot_is_a_page);
    RUN_TEST(test_slots_are_read_and_written_inside_alone);
    return UNITY_END();
}
