/* TIM1 on a register block in RAM: configuration, dead time, duties, gates, break. */
#define _DEFAULT_SOURCE /* mmap */
#include "stm32_pwm.h"

#include <math.h>
#include <sys/mman.h>

#include "unity.h"

#define CLOCK_HZ   168000000u
#define HALF_TICKS 16800u /* half of 200 us */
#define PWM(period, dead)                                                                          \
    {                                                                                              \
        .clock_Hz = CLOCK_HZ, .period_s = (period), .dead_time_s = (dead)                          \
    }

static stm32_tim_t tim;
static const stm32_pwm_params_t board = PWM(200e-6f, 2e-6f);

void setUp(void)
{
    tim = (stm32_tim_t){0};
}

void tearDown(void)
{
}

static hal_output_t duties(float u, float v, float w, bool gates_on)
{
    return (hal_output_t){.duty_u = u, .duty_v = v, .duty_w = w, .gates_on = gates_on};
}

static bool gates_on(void)
{
    return (tim.BDTR & TIM_BDTR_MOE) != 0u;
}

static void test_start_gives_5_kHz_centre_aligned_with_preload_and_outputs_off(void)
{
    TEST_ASSERT_TRUE(stm32_pwm_start(&tim, &board));
    TEST_ASSERT_EQUAL_UINT32(HALF_TICKS, tim.ARR);
    TEST_ASSERT_EQUAL_UINT32(0u, tim.PSC);
    TEST_ASSERT_EQUAL_HEX32(TIM_CR1_CEN | TIM_CR1_ARPE | (1u << 5), tim.CR1);
    TEST_ASSERT_EQUAL_HEX32(2u << 4, tim.CR2); /* TRGO is the update */
    TEST_ASSERT_EQUAL_HEX32(0x6868u, tim.CCMR1_Output);
    TEST_ASSERT_EQUAL_HEX32(0x0068u, tim.CCMR2_Output);
    TEST_ASSERT_EQUAL_HEX32(0x0555u, tim.CCER); /* three pairs, all active high */
    TEST_ASSERT_EQUAL_UINT32(1u, tim.RCR);
    TEST_ASSERT_EQUAL_HEX32(TIM_EGR_UG, tim.EGR);
    TEST_ASSERT_FALSE(gates_on());
}

/* Break enabled and active low, no automatic output enable, off-state driven, locked. */
static void test_start_arms_the_break_input(void)
{
    TEST_ASSERT_TRUE(stm32_pwm_start(&tim, &board));
    TEST_ASSERT_EQUAL_HEX32(TIM_BDTR_BKE | TIM_BDTR_OSSI | TIM_BDTR_OSSR | (1u << 8),
                            tim.BDTR & ~TIM_BDTR_DTG_Msk);
}

/* Lower switches that a low level closes: off is high, from the first moment on (OISxN, CCxNP). */
static void test_a_driver_that_inverts_the_lower_gates_gets_them_inverted(void)
{
    stm32_pwm_params_t inverted = board;
    inverted.lower_inverted = true;
    TEST_ASSERT_TRUE(stm32_pwm_start(&tim, &inverted));
    TEST_ASSERT_EQUAL_HEX32(0x0DDDu, tim.CCER);
    TEST_ASSERT_EQUAL_HEX32((2u << 4) | (1u << 9) | (1u << 11) | (1u << 13), tim.CR2);
}

static void test_a_break_may_be_high_and_filtered(void)
{
    stm32_pwm_params_t other = board;
    other.break_bits = TIM_BDTR_BKP | (15u << 16);
    TEST_ASSERT_TRUE(stm32_pwm_start(&tim, &other));
    TEST_ASSERT_EQUAL_HEX32(TIM_BDTR_BKP | (15u << 16) | TIM_BDTR_BKE | TIM_BDTR_OSSI |
                                TIM_BDTR_OSSR | (1u << 8),
                            tim.BDTR & ~TIM_BDTR_DTG_Msk);
}

/* Ticks that a DTG field means: RM0090, TIMx_BDTR. */
static uint32_t ticks_of(uint32_t code)
{
    if (code < 0x80u) {
        return code;
    }
    if (code < 0xC0u) {
        return (64u + (code & 0x3Fu)) * 2u;
    }
    return (32u + (code & 0x1Fu)) * ((code < 0xE0u) ? 8u : 16u);
}

/* Over the whole range: the shortest of all 256 fields that is not shorter than what was asked. */
static void test_dead_time_is_the_shortest_that_is_long_enough(void)
{
    for (uint32_t ticks = 0u; ticks <= 1008u; ticks++) {
        uint32_t best = UINT32_MAX;
        for (uint32_t code = 0u; code < 256u; code++) {
            const uint32_t found = ticks_of(code);
            best = ((found >= ticks) && (found < best)) ? found : best;
        }
        uint32_t code = 0u;
        TEST_ASSERT_TRUE(stm32_pwm_dead_time_code(ticks, &code));
        TEST_ASSERT_TRUE(code < 256u);
        TEST_ASSERT_EQUAL_UINT32(best, ticks_of(code));
    }
    uint32_t code = 0u;
    TEST_ASSERT_FALSE(stm32_pwm_dead_time_code(1009u, &code));
}

static void test_two_microseconds_are_336_ticks(void)
{
    TEST_ASSERT_TRUE(stm32_pwm_start(&tim, &board));
    TEST_ASSERT_EQUAL_UINT32(336u, ticks_of(tim.BDTR & TIM_BDTR_DTG_Msk));
}

static void test_what_the_timer_cannot_do_is_refused_and_nothing_starts(void)
{
    const stm32_pwm_params_t bad[] = {
        PWM(200e-6f, 7e-6f), /* 1176 ticks */
        PWM(1e-3f, 2e-6f),   /* 84 000 */
        PWM(1e-6f, 0.1e-6f), /* 84 */
        PWM(200e-6f, 0.0f),  /* a short circuit at every edge */
        PWM(NAN, 2e-6f),     PWM(200e-6f, NAN), PWM(200e-6f, -1e-6f), PWM(200e-6f, INFINITY),
    };
    for (size_t k = 0u; k < sizeof bad / sizeof bad[0]; k++) {
        tim = (stm32_tim_t){.BDTR = TIM_BDTR_MOE};
        TEST_ASSERT_FALSE(stm32_pwm_start(&tim, &bad[k]));
        TEST_ASSERT_FALSE(gates_on());
        TEST_ASSERT_EQUAL_HEX32(0u, tim.CR1);
    }
}

static void test_duties_go_to_the_legs_in_their_order(void)
{
    tim.ARR = HALF_TICKS;
    const hal_output_t output = duties(0.25f, 0.5f, 0.75f, true);
    stm32_pwm_write(&tim, &output);
    TEST_ASSERT_EQUAL_UINT32(4200u, tim.CCR1);
    TEST_ASSERT_EQUAL_UINT32(8400u, tim.CCR2);
    TEST_ASSERT_EQUAL_UINT32(12600u, tim.CCR3);
    TEST_ASSERT_TRUE(gates_on());
}

/* Compare 0 is never on, ARR always: RM0090, figure "centre-aligned PWM waveforms (ARR = 8)". */
static void test_duty_0_is_never_on_and_1_always(void)
{
    tim.ARR = HALF_TICKS;
    const hal_output_t output = duties(0.0f, 1.0f, 1.0f, true);
    stm32_pwm_write(&tim, &output);
    TEST_ASSERT_EQUAL_UINT32(0u, tim.CCR1);
    TEST_ASSERT_EQUAL_UINT32(HALF_TICKS, tim.CCR2);
    TEST_ASSERT_EQUAL_UINT32(HALF_TICKS, tim.CCR3);
}

/* CCR has 16 bits: one more than the longest period would be a duty of 0. */
static void test_duty_1_fits_the_register_at_the_longest_period(void)
{
    tim.ARR = 65535u;
    const hal_output_t output = duties(1.0f, 0.0f, 0.0f, true);
    stm32_pwm_write(&tim, &output);
    TEST_ASSERT_EQUAL_UINT32(65535u, tim.CCR1);
}

static void test_compare_is_the_nearest_to_the_duty(void)
{
    tim.ARR = HALF_TICKS;
    for (uint32_t c = 1u; c < HALF_TICKS; c++) {
        const float below = ((float)c - 0.4f) / (float)HALF_TICKS;
        const float above = ((float)c + 0.4f) / (float)HALF_TICKS;
        const hal_output_t output = duties(below, (float)c / (float)HALF_TICKS, above, true);
        stm32_pwm_write(&tim, &output);
        TEST_ASSERT_EQUAL_UINT32(c, tim.CCR1);
        TEST_ASSERT_EQUAL_UINT32(c, tim.CCR2);
        TEST_ASSERT_EQUAL_UINT32(c, tim.CCR3);
    }
}

static void test_gates_off_acts_at_once_and_duties_are_still_taken(void)
{
    tim = (stm32_tim_t){.ARR = HALF_TICKS, .BDTR = TIM_BDTR_MOE | TIM_BDTR_BKE};
    const hal_output_t output = duties(0.5f, 0.5f, 0.5f, false);
    stm32_pwm_write(&tim, &output);
    TEST_ASSERT_EQUAL_HEX32(TIM_BDTR_BKE, tim.BDTR);
    TEST_ASSERT_EQUAL_UINT32(8400u, tim.CCR1);
}

static void test_a_duty_that_is_none_opens_the_gates_and_is_not_written(void)
{
    const float bad[] = {-0.001f, 1.001f, NAN, INFINITY, -INFINITY};
    for (size_t k = 0u; k < sizeof bad / sizeof bad[0]; k++) {
        for (uint32_t leg = 0u; leg < 3u; leg++) {
            tim = (stm32_tim_t){.ARR = HALF_TICKS, .BDTR = TIM_BDTR_MOE};
            const hal_output_t output =
                duties((leg == 0u) ? bad[k] : 0.5f, (leg == 1u) ? bad[k] : 0.5f,
                       (leg == 2u) ? bad[k] : 0.5f, true);
            stm32_pwm_write(&tim, &output);
            TEST_ASSERT_FALSE(gates_on());
            TEST_ASSERT_EQUAL_UINT32(0u, tim.CCR1 + tim.CCR2 + tim.CCR3);
        }
    }
}

static void test_a_latched_break_keeps_the_gates_off_until_it_is_cleared(void)
{
    tim = (stm32_tim_t){.ARR = HALF_TICKS, .SR = TIM_SR_BIF};
    const hal_output_t output = duties(0.5f, 0.5f, 0.5f, true);
    TEST_ASSERT_TRUE(stm32_pwm_broken(&tim));
    stm32_pwm_write(&tim, &output);
    TEST_ASSERT_FALSE(gates_on());

    stm32_pwm_clear_break(&tim);
    TEST_ASSERT_EQUAL_HEX32(~TIM_SR_BIF, tim.SR); /* no other flag is cleared by that */
    tim.SR = 0u;
    stm32_pwm_write(&tim, &output);
    TEST_ASSERT_TRUE(gates_on());
}

/* Where the core took MOE for set a moment before the break cleared it, and wrote it again. */
static void test_gates_that_are_on_in_spite_of_a_latched_break_are_opened(void)
{
    tim = (stm32_tim_t){.ARR = HALF_TICKS, .SR = TIM_SR_BIF, .BDTR = TIM_BDTR_MOE | TIM_BDTR_BKE};
    const hal_output_t output = duties(0.5f, 0.5f, 0.5f, true);
    stm32_pwm_write(&tim, &output);
    TEST_ASSERT_EQUAL_HEX32(TIM_BDTR_BKE, tim.BDTR);
}

/* LOCK is frozen by the first write to BDTR after a reset: a write of nothing would cost the lock.
 * On a read-only page any write ends this test. */
static void test_gates_off_with_the_gates_off_writes_nothing(void)
{
    stm32_tim_t *locked = mmap(NULL, sizeof *locked, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    TEST_ASSERT_TRUE(locked != MAP_FAILED);
    stm32_pwm_gates_off(locked);
    TEST_ASSERT_EQUAL_INT(0, munmap(locked, sizeof *locked));
}

static void test_gates_off_leaves_the_rest_of_the_register(void)
{
    tim.BDTR = UINT32_MAX;
    stm32_pwm_gates_off(&tim);
    TEST_ASSERT_EQUAL_HEX32(~TIM_BDTR_MOE, tim.BDTR);
}

static void test_counting_down_means_past_the_crest(void)
{
    TEST_ASSERT_FALSE(stm32_pwm_past_crest(&tim));
    tim.CR1 = TIM_CR1_DIR;
    TEST_ASSERT_TRUE(stm32_pwm_past_crest(&tim));
}

static void test_a_crest_is_remembered_until_it_is_forgotten(void)
{
    TEST_ASSERT_FALSE(stm32_pwm_crest_passed(&tim));
    tim.SR = TIM_SR_UIF | TIM_SR_BIF;
    TEST_ASSERT_TRUE(stm32_pwm_crest_passed(&tim));
    stm32_pwm_forget_crest(&tim);
    TEST_ASSERT_EQUAL_HEX32(~TIM_SR_UIF, tim.SR); /* a latched break stays */
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_start_gives_5_kHz_centre_aligned_with_preload_and_outputs_off);
    RUN_TEST(test_start_arms_the_break_input);
    RUN_TEST(test_a_driver_that_inverts_the_lower_gates_gets_them_inverted);
    RUN_TEST(test_a_break_may_be_high_and_filtered);
    RUN_TEST(test_dead_time_is_the_shortest_that_is_long_enough);
    RUN_TEST(test_two_microseconds_are_336_ticks);
    RUN_TEST(test_what_the_timer_cannot_do_is_refused_and_nothing_starts);
    RUN_TEST(test_duties_go_to_the_legs_in_their_order);
    RUN_TEST(test_duty_0_is_never_on_and_1_always);
    RUN_TEST(test_duty_1_fits_the_register_at_the_longest_period);
    RUN_TEST(test_compare_is_the_nearest_to_the_duty);
    RUN_TEST(test_gates_off_acts_at_once_and_duties_are_still_taken);
    RUN_TEST(test_a_duty_that_is_none_opens_the_gates_and_is_not_written);
    RUN_TEST(test_a_latched_break_keeps_the_gates_off_until_it_is_cleared);
    RUN_TEST(test_gates_that_are_on_in_spite_of_a_latched_break_are_opened);
    RUN_TEST(test_gates_off_with_the_gates_off_writes_nothing);
    RUN_TEST(test_gates_off_leaves_the_rest_of_the_register);
    RUN_TEST(test_counting_down_means_past_the_crest);
    RUN_TEST(test_a_crest_is_remembered_until_it_is_forgotten);
    return UNITY_END();
}
