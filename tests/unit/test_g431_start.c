/* The start of measurement and carrier on register blocks in RAM. */
#include "g431_start.h"

#include <string.h>

#include "unity.h"

static stm32_opamp_t opamp;
static stm32_dac_t dac;
static stm32_comp_t comp;
static stm32_syscfg_t syscfg;
static stm32_tim_t tim1;
static stm32_wwdg_t wwdg;
static stm32_adc_t adc1;
static stm32_adc_t adc2;
static stm32_adc_common_t common;
static stm32_rcc_t rcc;
static stm32_gpio_t port[3];
static const g431_part_t part = {&opamp, &dac, &comp, &syscfg, &tim1, &wwdg};
static const g431_adcs_t adcs = {&adc1, &adc2, &common, &g431_esc.channels};
static const g431_board_t esc = {&rcc, {&port[0], &port[1], &port[2]}, &g431_esc};
static const g431_board_t ihm08m1 = {&rcc, {&port[0], &port[1], &port[2]}, &g431_ihm08m1};
static const g431_timing_t timing = {170000000u, 200e-6f, 1e-6f, 10u};
static g431_shunts_t shunts;

void setUp(void)
{
    opamp = (stm32_opamp_t){0};
    comp = (stm32_comp_t){0};
    tim1 = (stm32_tim_t){0};
    wwdg = (stm32_wwdg_t){.CR = WWDG_CR_RESET, .CFR = WWDG_CFR_RESET};
    adc1 = (stm32_adc_t){.ISR = ADC_ISR_ADRDY};
    adc2 = adc1;
    for (int n = 0; n < 3; n++) {
        port[n] = (stm32_gpio_t){0};
    }
    shunts = (g431_shunts_t){0};
}

void tearDown(void)
{
}

static void test_the_carrier_starts_before_the_pins_are_its_own(void)
{
    TEST_ASSERT_EQUAL_STRING("", g431_start_carrier(&part, &esc, &timing));
    TEST_ASSERT_EQUAL_UINT32(17000u, tim1.ARR);
    TEST_ASSERT_EQUAL_HEX32(TIM_CR1_CEN, tim1.CR1 & TIM_CR1_CEN);
    TEST_ASSERT_EQUAL_HEX32(0u, tim1.BDTR & TIM_BDTR_MOE);
    TEST_ASSERT_EQUAL_HEX32(0x80u + 170u / 2u - 64u, tim1.BDTR & 0xFFu); /* 1 us: 170 ticks */
    TEST_ASSERT_EQUAL_HEX32(TIM_BDTR_BKP | (15u << 16), tim1.BDTR & (TIM_BDTR_BKP | (15u << 16)));
    TEST_ASSERT_EQUAL_HEX32(0x555u, tim1.CCER);
    TEST_ASSERT_EQUAL_HEX32(0xFFu, wwdg.CR);
    TEST_ASSERT_EQUAL_HEX32(0x2Au << 16, port[0].MODER & (0x3Fu << 16));
}

static void test_the_other_board_has_its_lower_gates_inverted(void)
{
    TEST_ASSERT_EQUAL_STRING("", g431_start_carrier(&part, &ihm08m1, &timing));
    TEST_ASSERT_EQUAL_HEX32(0xDDDu, tim1.CCER);
    TEST_ASSERT_EQUAL_HEX32(TIM_AF1_BKINE | TIM_AF1_BKINP, tim1.AF1);
}

static void test_a_period_beyond_timer_or_window_keeps_the_pins(void)
{
    g431_timing_t bad = timing;
    bad.dead_time_s = 0.0f;
    TEST_ASSERT_NOT_NULL(strstr(g431_start_carrier(&part, &esc, &bad), "beyond the timer"));
    TEST_ASSERT_EQUAL_HEX32(WWDG_CR_RESET, wwdg.CR);
    bad = timing;
    bad.period_s = 80e-6f;
    TEST_ASSERT_NOT_NULL(strstr(g431_start_carrier(&part, &esc, &bad), "window watchdog"));
    TEST_ASSERT_EQUAL_HEX32(WWDG_CR_RESET, wwdg.CR);
    TEST_ASSERT_EQUAL_HEX32(0u, port[0].MODER);
}

/* RAM does not end a calibration. */
static void test_converters_that_do_not_start_are_told(void)
{
    TEST_ASSERT_FALSE(g431_start_measurement(&part, &esc, &adcs, &timing, &shunts));
    TEST_ASSERT_EQUAL_HEX32(OPAMP_OPAMP1_CSR_OPAEN, opamp.OPAMP1_CSR & 1u);
    TEST_ASSERT_EQUAL_HEX32(COMP_C1CSR_LOCK, comp.C1CSR & COMP_C1CSR_LOCK);
    TEST_ASSERT_EQUAL_HEX32(0u, adc1.IER);
}

static void test_amplifiers_of_the_part_are_left_alone_where_the_board_has_its_own(void)
{
    TEST_ASSERT_FALSE(g431_start_measurement(&part, &ihm08m1, &adcs, &timing, &shunts));
    TEST_ASSERT_EQUAL_HEX32(0u, opamp.OPAMP1_CSR);
    TEST_ASSERT_EQUAL_HEX32(0u, comp.C1CSR);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_carrier_starts_before_the_pins_are_its_own);
    RUN_TEST(test_the_other_board_has_its_lower_gates_inverted);
    RUN_TEST(test_a_period_beyond_timer_or_window_keeps_the_pins);
    RUN_TEST(test_converters_that_do_not_start_are_told);
    RUN_TEST(test_amplifiers_of_the_part_are_left_alone_where_the_board_has_its_own);
    return UNITY_END();
}
