/* The small devices of the STM32F405 port on register blocks in RAM: ADC, pins, serial port,
 * watchdog, time base, flash sectors. */
#include "stm32_adc.h"
#include "stm32_board.h"
#include "stm32_flash.h"
#include "stm32_rng.h"
#include "stm32_slots.h"
#include "stm32_gpio.h"
#include "stm32_hang.h"
#include "stm32_inbox.h"
#include "stm32_timebase.h"
#include "stm32_usart.h"
#include "stm32_watchdog.h"

#include "unity.h"

#define POLLS 10u

static stm32_adc_t adc1;
static stm32_adc_t adc2;
static stm32_adc_t adc3;
static stm32_adc_common_t common;
static const stm32_adcs_t adcs = {&adc1, &adc2, &adc3, &common};
static stm32_gpio_t port;
static stm32_usart_t usart;
static stm32_iwdg_t iwdg;
static stm32_tim_t tim;
static stm32_flash_t flash;
static volatile uint32_t word;

void setUp(void)
{
    adc1 = (stm32_adc_t){0};
    adc2 = (stm32_adc_t){0};
    adc3 = (stm32_adc_t){0};
    common = (stm32_adc_common_t){0};
    port = (stm32_gpio_t){0};
    usart = (stm32_usart_t){0};
    iwdg = (stm32_iwdg_t){0};
    tim = (stm32_tim_t){0};
    flash = (stm32_flash_t){.ACR = FLASH_ACR_DCEN | FLASH_ACR_ICEN | 5u}; /* opened by the keys */
    word = UINT32_MAX;
}

void tearDown(void)
{
}

/* Two ranks in JSQ3 and JSQ4, JL 1; the channels of the table in stm32_adc.h. */
static void test_adcs_convert_currents_first_then_voltages(void)
{
    stm32_adc_start(&adcs);
    TEST_ASSERT_EQUAL_HEX32((1u << 20) | (0u << 10) | (10u << 15), adc1.JSQR);
    TEST_ASSERT_EQUAL_HEX32((1u << 20) | (1u << 10) | (11u << 15), adc2.JSQR);
    TEST_ASSERT_EQUAL_HEX32((1u << 20) | (2u << 10) | (12u << 15), adc3.JSQR);
    TEST_ASSERT_EQUAL_HEX32(0x49u, adc1.SMPR1);              /* 15 cycles for each of 10, 11, 12 */
    TEST_ASSERT_EQUAL_HEX32(0x49u, adc1.SMPR2);              /* and of 0, 1, 2 */
    TEST_ASSERT_EQUAL_HEX32((1u << 16) | 0x15u, common.CCR); /* APB2/4, injected simultaneous */
}

/* The slaves follow the master: only it has trigger (TIM1 TRGO, rising) and interrupt. */
static void test_only_the_master_is_triggered_and_interrupts(void)
{
    stm32_adc_start(&adcs);
    TEST_ASSERT_EQUAL_HEX32(ADC_CR2_ADON | (1u << 16) | (1u << 20), adc1.CR2);
    TEST_ASSERT_EQUAL_HEX32(ADC_CR1_SCAN | ADC_CR1_JEOCIE, adc1.CR1);
    TEST_ASSERT_EQUAL_HEX32(ADC_CR2_ADON, adc2.CR2);
    TEST_ASSERT_EQUAL_HEX32(ADC_CR2_ADON, adc3.CR2);
    TEST_ASSERT_EQUAL_HEX32(ADC_CR1_SCAN, adc2.CR1);
    TEST_ASSERT_EQUAL_HEX32(ADC_CR1_SCAN, adc3.CR1);
}

static void test_samples_land_where_the_contract_says(void)
{
    adc1.JDR1 = 0xF001u; /* beyond 12 bits: handed over as it is, the measurement will say so */
    adc2.JDR1 = 0x002u;
    adc3.JDR1 = 0x003u;
    adc1.JDR2 = 0x104u;
    adc2.JDR2 = 0x205u;
    adc3.JDR2 = 0xFFFFFFFFu; /* the upper half is no data */
    hal_sample_t sample = {.late_periods = 7u};
    stm32_adc_read(&adcs, &sample);
    TEST_ASSERT_EQUAL_HEX16(0xF001u, sample.i_u_counts);
    TEST_ASSERT_EQUAL_HEX16(0x002u, sample.i_v_counts);
    TEST_ASSERT_EQUAL_HEX16(0x003u, sample.i_w_counts);
    TEST_ASSERT_EQUAL_HEX16(0x104u, sample.u_uv_counts);
    TEST_ASSERT_EQUAL_HEX16(0x205u, sample.u_vw_counts);
    TEST_ASSERT_EQUAL_HEX16(0xFFFFu, sample.u_dc_counts);
    TEST_ASSERT_EQUAL_UINT16(7u, sample.late_periods);
}

static void test_reading_takes_the_flag_and_no_other(void)
{
    adc1.SR = ADC_SR_JEOC;
    TEST_ASSERT_TRUE(stm32_adc_ready(&adcs));
    hal_sample_t sample;
    stm32_adc_read(&adcs, &sample);
    TEST_ASSERT_EQUAL_HEX32(~ADC_SR_JEOC, adc1.SR);
    TEST_ASSERT_FALSE(stm32_adc_ready(&adcs));
}

static void test_a_pin_is_configured_and_its_neighbours_stay(void)
{
    port = (stm32_gpio_t){
        .MODER = UINT32_MAX, .PUPDR = UINT32_MAX, .AFRL = UINT32_MAX, .AFRH = UINT32_MAX};
    stm32_gpio_configure(&port, 9u, STM32_GPIO_ALTERNATE, STM32_GPIO_PULL_UP, 7u);
    TEST_ASSERT_EQUAL_HEX32(~(3u << 18) | (2u << 18), port.MODER);
    TEST_ASSERT_EQUAL_HEX32(~(3u << 18) | (1u << 18), port.PUPDR);
    TEST_ASSERT_EQUAL_HEX32(UINT32_MAX, port.AFRL);
    TEST_ASSERT_EQUAL_HEX32(~(15u << 4) | (7u << 4), port.AFRH);
    stm32_gpio_configure(&port, 0u, STM32_GPIO_INPUT, STM32_GPIO_FLOATING, 0u);
    TEST_ASSERT_EQUAL_HEX32(0u, port.MODER & 3u);
    TEST_ASSERT_EQUAL_HEX32(~15u, port.AFRL);
}

static void test_a_pin_is_written_in_one_store_and_read(void)
{
    stm32_gpio_write(&port, 5u, true);
    TEST_ASSERT_EQUAL_HEX32(1u << 5, port.BSRR);
    stm32_gpio_write(&port, 5u, false);
    TEST_ASSERT_EQUAL_HEX32(1u << 21, port.BSRR);
    port.IDR = 1u << 3;
    TEST_ASSERT_TRUE(stm32_gpio_read(&port, 3u));
    TEST_ASSERT_FALSE(stm32_gpio_read(&port, 4u));
}

static void test_baud_rate_is_the_nearest_divider(void)
{
    TEST_ASSERT_TRUE(stm32_usart_start(&usart, 42000000u, 115200u));
    TEST_ASSERT_EQUAL_UINT32(365u, usart.BRR); /* 115 068 baud, .11 % low */
    TEST_ASSERT_EQUAL_HEX32((1u << 13) | (3u << 2), usart.CR1);
}

static void test_a_baud_rate_the_clock_cannot_give_is_refused(void)
{
    TEST_ASSERT_FALSE(stm32_usart_start(&usart, 42000000u, 0u));
    TEST_ASSERT_FALSE(stm32_usart_start(&usart, 1000000u, 115200u));
    TEST_ASSERT_FALSE(stm32_usart_start(&usart, 42000000u, 600u));
    TEST_ASSERT_EQUAL_HEX32(0u, usart.CR1);
}

static void test_text_is_sent_and_a_stuck_transmitter_is_told(void)
{
    usart.SR = USART_SR_TXE;
    TEST_ASSERT_TRUE(stm32_usart_send(&usart, "ab"));
    TEST_ASSERT_EQUAL_HEX32('b', usart.DR);
    usart.SR = 0u;
    TEST_ASSERT_FALSE(stm32_usart_send(&usart, "c"));
    TEST_ASSERT_EQUAL_HEX32('b', usart.DR);
    TEST_ASSERT_TRUE(stm32_usart_send(&usart, ""));
}

static void test_a_byte_is_received_when_there_is_one(void)
{
    uint8_t byte = 'x';
    usart.DR = 0xF2u; /* all eight bits are data */
    TEST_ASSERT_FALSE(stm32_usart_receive(&usart, &byte));
    TEST_ASSERT_EQUAL_HEX8('x', byte);
    usart.SR = USART_SR_RXNE;
    TEST_ASSERT_TRUE(stm32_usart_receive(&usart, &byte));
    TEST_ASSERT_EQUAL_HEX8(0xF2u, byte);
}

static void test_a_byte_goes_out_when_there_is_room(void)
{
    TEST_ASSERT_FALSE(stm32_usart_put(&usart, 0x80u));
    TEST_ASSERT_EQUAL_HEX32(0u, usart.DR);
    usart.SR = USART_SR_TXE;
    TEST_ASSERT_TRUE(stm32_usart_put(&usart, 0x80u));
    TEST_ASSERT_EQUAL_HEX32(0x80u, usart.DR);
}

static void test_the_receive_interrupt_is_its_one_bit(void)
{
    usart.CR1 = 1u << 13;
    stm32_usart_interrupt(&usart);
    TEST_ASSERT_EQUAL_HEX32((1u << 13) | (1u << 5), usart.CR1);
}

static void test_a_byte_with_noise_or_without_its_end_is_dropped(void)
{
    const uint32_t error[] = {USART_SR_PE, USART_SR_FE, USART_SR_NF};
    usart.DR = 'r';
    for (size_t k = 0u; k < sizeof error / sizeof error[0]; k++) {
        uint8_t byte = 'x';
        usart.SR = USART_SR_RXNE | error[k];
        TEST_ASSERT_FALSE(stm32_usart_receive(&usart, &byte));
        TEST_ASSERT_EQUAL_HEX8('x', byte);
    }
}

static void test_watchdog_counts_milliseconds_and_is_served_at_start(void)
{
    TEST_ASSERT_TRUE(stm32_watchdog_start(&iwdg, 100u));
    TEST_ASSERT_EQUAL_UINT32(3u, iwdg.PR); /* 32 kHz / 32 */
    TEST_ASSERT_EQUAL_UINT32(99u, iwdg.RLR);
    TEST_ASSERT_EQUAL_HEX32(0xAAAAu, iwdg.KR);
}

static void test_a_watchdog_that_does_not_take_its_time_is_told(void)
{
    iwdg.SR = IWDG_SR_PVU;
    TEST_ASSERT_FALSE(stm32_watchdog_start(&iwdg, 100u));
    iwdg.SR = IWDG_SR_RVU;
    TEST_ASSERT_FALSE(stm32_watchdog_start(&iwdg, 100u));
}

static void test_watchdog_times_beyond_reach_are_refused_untouched(void)
{
    TEST_ASSERT_FALSE(stm32_watchdog_start(&iwdg, 0u));
    TEST_ASSERT_FALSE(stm32_watchdog_start(&iwdg, STM32_WATCHDOG_MAX_MS + 1u));
    TEST_ASSERT_EQUAL_HEX32(0u, iwdg.KR);
    TEST_ASSERT_TRUE(stm32_watchdog_start(&iwdg, STM32_WATCHDOG_MAX_MS));
    TEST_ASSERT_EQUAL_HEX32(0xFFFu, iwdg.RLR); /* all twelve bits */
}

static void test_time_base_counts_microseconds(void)
{
    stm32_timebase_start(&tim, 84000000u);
    TEST_ASSERT_EQUAL_UINT32(83u, tim.PSC);
    TEST_ASSERT_EQUAL_HEX32(UINT32_MAX, tim.ARR);
    TEST_ASSERT_EQUAL_HEX32(TIM_EGR_UG, tim.EGR);
    TEST_ASSERT_EQUAL_HEX32(TIM_CR1_CEN, tim.CR1);
    tim.CNT = 1234u;
    TEST_ASSERT_EQUAL_UINT32(1234u, stm32_timebase_us(&tim));
}

static void test_the_hang_timer_interrupts_unless_it_is_served(void)
{
    stm32_hang_start(&tim, 84000000u, 500u);
    TEST_ASSERT_EQUAL_UINT32(83u, tim.PSC);
    TEST_ASSERT_EQUAL_UINT32(500u, tim.ARR);
    TEST_ASSERT_EQUAL_HEX32(TIM_EGR_UG, tim.EGR);
    TEST_ASSERT_EQUAL_HEX32(TIM_DIER_UIE, tim.DIER);
    TEST_ASSERT_EQUAL_HEX32(TIM_CR1_URS | TIM_CR1_CEN, tim.CR1);
    tim.CNT = 499u;
    stm32_hang_serve(&tim);
    TEST_ASSERT_EQUAL_UINT32(0u, tim.CNT);
    tim.SR = TIM_SR_UIF;
    stm32_hang_seen(&tim);
    TEST_ASSERT_EQUAL_HEX32(0u, tim.SR);
}

static void test_the_hang_timer_waits_while_the_core_stands_still(void)
{
    stm32_hang_start(&tim, 84000000u, 500u);
    stm32_hang_pause(&tim);
    TEST_ASSERT_EQUAL_HEX32(0u, tim.CR1 & TIM_CR1_CEN);
    tim.CNT = 300u;
    stm32_hang_resume(&tim);
    TEST_ASSERT_EQUAL_UINT32(0u, tim.CNT);
    TEST_ASSERT_EQUAL_HEX32(TIM_CR1_URS | TIM_CR1_CEN, tim.CR1);
}

static void test_a_sector_of_the_parameters_is_erased_and_the_flash_locked_again(void)
{
    TEST_ASSERT_EQUAL(STM32_FLASH_OK, stm32_flash_erase(&flash, STM32_FLASH_SECTOR_B, POLLS));
    TEST_ASSERT_EQUAL_HEX32(FLASH_CR_LOCK, flash.CR);
    /* The data cache was emptied and is on again, the rest as before. */
    TEST_ASSERT_EQUAL_HEX32(FLASH_ACR_DCEN | FLASH_ACR_ICEN | 5u, flash.ACR);
}

/* A closed flash ignores what it is told and raises no flag. */
static void test_a_flash_that_does_not_open_is_told_and_not_written(void)
{
    flash.CR = FLASH_CR_LOCK;
    TEST_ASSERT_EQUAL(STM32_FLASH_FAILED, stm32_flash_erase(&flash, STM32_FLASH_SECTOR_A, POLLS));
    TEST_ASSERT_EQUAL_HEX32(0xCDEF89ABu, flash.KEYR);
    TEST_ASSERT_EQUAL_HEX32(FLASH_CR_LOCK, flash.CR);
    TEST_ASSERT_EQUAL(STM32_FLASH_FAILED,
                      stm32_flash_program(&flash, STM32_FLASH_START, &word, 42u, POLLS));
    TEST_ASSERT_EQUAL_HEX32(UINT32_MAX, word);
}

/* The control register stands for a cell: it does not keep what is written either. */
static void test_a_word_that_reads_back_otherwise_is_told(void)
{
    TEST_ASSERT_EQUAL(STM32_FLASH_FAILED,
                      stm32_flash_program(&flash, STM32_FLASH_START, &flash.CR, 42u, POLLS));
}

static void test_no_other_sector_can_be_erased(void)
{
    for (uint32_t sector = 0u; sector < 32u; sector++) {
        if ((sector != STM32_FLASH_SECTOR_A) && (sector != STM32_FLASH_SECTOR_B)) {
            TEST_ASSERT_EQUAL(STM32_FLASH_REFUSED, stm32_flash_erase(&flash, sector, POLLS));
        }
    }
    TEST_ASSERT_EQUAL_HEX32(0u, flash.KEYR);
}

static void test_a_word_is_programmed_inside_the_parameters_only(void)
{
    TEST_ASSERT_EQUAL(STM32_FLASH_OK,
                      stm32_flash_program(&flash, STM32_FLASH_START, &word, 42u, POLLS));
    TEST_ASSERT_EQUAL_UINT32(42u, word);
    TEST_ASSERT_EQUAL_HEX32(FLASH_CR_LOCK, flash.CR);
    const uint32_t outside[] = {STM32_FLASH_START - 4u, STM32_FLASH_END, STM32_FLASH_START + 2u,
                                0x08000000u, 0x1FFFC000u};
    for (size_t k = 0u; k < sizeof outside / sizeof outside[0]; k++) {
        TEST_ASSERT_EQUAL(STM32_FLASH_REFUSED,
                          stm32_flash_program(&flash, outside[k], &word, 1u, POLLS));
    }
    TEST_ASSERT_EQUAL_UINT32(42u, word);
}

static void test_a_flash_that_stays_busy_is_told_and_left_alone(void)
{
    flash.SR = FLASH_SR_BSY;
    TEST_ASSERT_EQUAL(STM32_FLASH_TIMEOUT, stm32_flash_erase(&flash, STM32_FLASH_SECTOR_A, POLLS));
    TEST_ASSERT_EQUAL(STM32_FLASH_TIMEOUT,
                      stm32_flash_program(&flash, STM32_FLASH_START, &word, 1u, POLLS));
    TEST_ASSERT_EQUAL_HEX32(0u, flash.KEYR);
    TEST_ASSERT_EQUAL_HEX32(UINT32_MAX, word);
}

/* In RAM the failure bits that are written to be cleared stay: as if the operation set them. */
static void test_slots_are_the_two_sectors_and_nothing_else(void)
{
    uint32_t cells[2][4] = {{0u}};
    const stm32_slots_t slots = {&flash, {cells[0], cells[1]}, POLLS};
    TEST_ASSERT_EQUAL(HAL_FLASH_DONE, stm32_slots_erase(&slots, 0u));
    flash.CR = 0u; /* memory does not open by the keys */
    TEST_ASSERT_EQUAL(HAL_FLASH_DONE, stm32_slots_erase(&slots, 1u));
    TEST_ASSERT_EQUAL(HAL_FLASH_FAILED, stm32_slots_erase(&slots, 2u));
    flash.CR = 0u;
    TEST_ASSERT_EQUAL(HAL_FLASH_DONE, stm32_slots_program(&slots, 1u, 8u, 42u));
    TEST_ASSERT_EQUAL_UINT32(42u, cells[1][2]);
    TEST_ASSERT_EQUAL_UINT32(42u, stm32_slots_read(&slots, 1u, 8u));
    TEST_ASSERT_EQUAL_UINT32(0u, stm32_slots_read(&slots, 0u, 8u));
    const uint32_t beyond[] = {STM32_SLOTS_BYTES, UINT32_MAX - 3u, 2u};
    for (int k = 0; k < 3; k++) {
        TEST_ASSERT_EQUAL(HAL_FLASH_FAILED, stm32_slots_program(&slots, 0u, beyond[k], 1u));
        TEST_ASSERT_EQUAL_UINT32(0u, stm32_slots_read(&slots, 0u, beyond[k]));
    }
    TEST_ASSERT_EQUAL(HAL_FLASH_FAILED, stm32_slots_program(&slots, 2u, 0u, 1u));
    TEST_ASSERT_EQUAL_UINT32(0u, stm32_slots_read(&slots, 2u, 0u));
    flash.SR = FLASH_SR_BSY;
    TEST_ASSERT_EQUAL(HAL_FLASH_FAILED, stm32_slots_erase(&slots, 0u));
    TEST_ASSERT_EQUAL(HAL_FLASH_FAILED, stm32_slots_program(&slots, 0u, 0u, 1u));
}

/* The same word comes twice from a block in RAM, as from a generator that stands. */
static void test_a_generator_that_stands_or_fails_gives_nothing(void)
{
    stm32_rng_t rng = {0};
    uint64_t bits = 7u;
    stm32_rng_start(&rng);
    TEST_ASSERT_EQUAL_HEX32(RNG_CR_RNGEN, rng.CR);
    TEST_ASSERT_FALSE(stm32_rng_draw(&rng, &bits)); /* no word in time */
    rng.SR = RNG_SR_DRDY;
    rng.DR = 0x12345678u;
    TEST_ASSERT_FALSE(stm32_rng_draw(&rng, &bits));
    const uint32_t wrong[] = {RNG_SR_CECS, RNG_SR_SECS, RNG_SR_CEIS, RNG_SR_SEIS};
    for (int k = 0; k < 4; k++) {
        rng.SR = RNG_SR_DRDY | wrong[k];
        TEST_ASSERT_FALSE(stm32_rng_draw(&rng, &bits));
    }
    TEST_ASSERT_TRUE(bits == 7u);
}

static void test_a_failure_of_the_flash_is_told(void)
{
    const uint32_t failure[] = {FLASH_SR_WRPERR, FLASH_SR_PGAERR, FLASH_SR_PGPERR, FLASH_SR_PGSERR};
    for (size_t k = 0u; k < sizeof failure / sizeof failure[0]; k++) {
        flash.SR = failure[k];
        TEST_ASSERT_EQUAL(STM32_FLASH_FAILED,
                          stm32_flash_program(&flash, STM32_FLASH_START, &word, 1u, POLLS));
    }
    flash.KEYR = 0u;
    flash.CR = 0u; /* unlocked already: the keys are not written twice */
    TEST_ASSERT_EQUAL(STM32_FLASH_FAILED, stm32_flash_erase(&flash, STM32_FLASH_SECTOR_A, POLLS));
    TEST_ASSERT_EQUAL_HEX32(0u, flash.KEYR);
    TEST_ASSERT_EQUAL_HEX32(FLASH_CR_LOCK, flash.CR);
}

static void test_the_inbox_hands_on_in_order_and_drops_what_does_not_fit(void)
{
    stm32_inbox_t inbox = {.in = UINT32_MAX - 7u, .out = UINT32_MAX - 7u}; /* the counters wrap */
    uint8_t byte = 0u;
    TEST_ASSERT_FALSE(stm32_inbox_take(&inbox, &byte));
    for (uint32_t i = 0u; i <= STM32_INBOX_BYTES; i++) {
        stm32_inbox_put(&inbox, (uint8_t)(i + 1u));
    }
    for (uint32_t i = 0u; i < STM32_INBOX_BYTES; i++) {
        TEST_ASSERT_TRUE(stm32_inbox_take(&inbox, &byte));
        TEST_ASSERT_EQUAL_UINT8((uint8_t)(i + 1u), byte);
    }
    TEST_ASSERT_FALSE(stm32_inbox_take(&inbox, &byte));
}

/* PA8..10 and PB13..15: outputs, which are low after reset, then pins of the timer (function 1). */
static void test_gates_are_driven_low_before_the_timer_has_them(void)
{
    stm32_rcc_t rcc = {0};
    stm32_gpio_t a = {0};
    stm32_gpio_t b = {0};
    stm32_gpio_t c = {0};
    const stm32_board_t board = {&rcc, &a, &b, &c};
    stm32_board_gates_low(&board);
    TEST_ASSERT_EQUAL_HEX32(0x15u << 16, a.MODER);
    TEST_ASSERT_EQUAL_HEX32(0x15u << 26, b.MODER);
    TEST_ASSERT_EQUAL_HEX32(0x2au << 16, a.PUPDR);
    TEST_ASSERT_EQUAL_HEX32(0u, a.ODR | b.ODR);
    TEST_ASSERT_EQUAL_HEX32(0x7u, rcc.AHB1ENR);
    stm32_board_gates_to_timer(&board);
    TEST_ASSERT_EQUAL_HEX32(0x2au << 16, a.MODER);
    TEST_ASSERT_EQUAL_HEX32(0x2au << 26, b.MODER);
    TEST_ASSERT_EQUAL_HEX32(0x111u, a.AFRH);
    TEST_ASSERT_EQUAL_HEX32(0x11100000u, b.AFRH);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_adcs_convert_currents_first_then_voltages);
    RUN_TEST(test_only_the_master_is_triggered_and_interrupts);
    RUN_TEST(test_samples_land_where_the_contract_says);
    RUN_TEST(test_reading_takes_the_flag_and_no_other);
    RUN_TEST(test_a_pin_is_configured_and_its_neighbours_stay);
    RUN_TEST(test_a_pin_is_written_in_one_store_and_read);
    RUN_TEST(test_baud_rate_is_the_nearest_divider);
    RUN_TEST(test_a_baud_rate_the_clock_cannot_give_is_refused);
    RUN_TEST(test_text_is_sent_and_a_stuck_transmitter_is_told);
    RUN_TEST(test_a_byte_is_received_when_there_is_one);
    RUN_TEST(test_a_byte_goes_out_when_there_is_room);
    RUN_TEST(test_the_receive_interrupt_is_its_one_bit);
    RUN_TEST(test_a_byte_with_noise_or_without_its_end_is_dropped);
    RUN_TEST(test_watchdog_counts_milliseconds_and_is_served_at_start);
    RUN_TEST(test_a_watchdog_that_does_not_take_its_time_is_told);
    RUN_TEST(test_watchdog_times_beyond_reach_are_refused_untouched);
    RUN_TEST(test_time_base_counts_microseconds);
    RUN_TEST(test_the_hang_timer_interrupts_unless_it_is_served);
    RUN_TEST(test_the_hang_timer_waits_while_the_core_stands_still);
    RUN_TEST(test_a_sector_of_the_parameters_is_erased_and_the_flash_locked_again);
    RUN_TEST(test_a_flash_that_does_not_open_is_told_and_not_written);
    RUN_TEST(test_a_word_that_reads_back_otherwise_is_told);
    RUN_TEST(test_no_other_sector_can_be_erased);
    RUN_TEST(test_a_word_is_programmed_inside_the_parameters_only);
    RUN_TEST(test_a_flash_that_stays_busy_is_told_and_left_alone);
    RUN_TEST(test_slots_are_the_two_sectors_and_nothing_else);
    RUN_TEST(test_a_generator_that_stands_or_fails_gives_nothing);
    RUN_TEST(test_a_failure_of_the_flash_is_told);
    RUN_TEST(test_the_inbox_hands_on_in_order_and_drops_what_does_not_fit);
    RUN_TEST(test_gates_are_driven_low_before_the_timer_has_them);
    return UNITY_END();
}
