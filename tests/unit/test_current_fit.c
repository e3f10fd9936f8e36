/* Voltage against current, window by window. */
#include "current_fit.h"

#include <math.h>

#include "exact.h"
#include "slots.h"

/* A window is 3.2 ms, of .1 s that are remembered: a steady 1 V adds up to .1 Wb. */
static const current_fit_params_t params = {
    .period_s = 2e-4f, .Rs_ohm = 1.0f, .sigma_Ls_H = 0.02f, .flux_Wb = 0.4f, .M_H = 0.09f};
static current_fit_config_t cfg;
static current_fit_state_t st;
static bool motor_known;
static float u_dc_V;

void setUp(void)
{
    TEST_ASSERT_TRUE(current_fit_init(&cfg, &params));
    st = (current_fit_state_t){0};
    motor_known = true;
    u_dc_V = 300.0f;
}

void tearDown(void)
{
}

/* A window of constant voltage; the current jumps to its value at once. */
static bool window(ab_t u_V, ab_t i_A)
{
    for (uint32_t k = 0u; k < SLOT_COUNT; k++) {
        current_fit_add(&st, u_V, i_A);
    }
    return current_fit_holds(&cfg, &st, i_A, u_dc_V, motor_known);
}

/* Windows until it is told; 0: not within 10 s. */
static int told_after(ab_t u_V, ab_t i_A)
{
    for (int k = 1; k < 3125; k++) {
        if (!window(u_V, i_A)) {
            return k;
        }
    }
    return 0;
}

static void test_init_refuses_what_is_no_positive_number(void)
{
    for (int k = 0; k < 5; k++) {
        current_fit_params_t p = params;
        float *const number[] = {&p.period_s, &p.Rs_ohm, &p.sigma_Ls_H, &p.flux_Wb, &p.M_H};
        *number[k] = 0.0f;
        TEST_ASSERT_FALSE(current_fit_init(&cfg, &p));
        *number[k] = INFINITY;
        TEST_ASSERT_FALSE(current_fit_init(&cfg, &p));
    }
}

static void test_init_refuses_a_window_longer_than_the_memory(void)
{
    current_fit_params_t p = params;
    p.period_s = 6e-3f;
    TEST_ASSERT_TRUE(current_fit_init(&cfg, &p));
    p.period_s = 6.3e-3f;
    TEST_ASSERT_FALSE(current_fit_init(&cfg, &p));
}

static void test_the_emf_of_a_window_is_what_resistance_and_leakage_leave(void)
{
    st.i_A = (ab_t){1.0f, -2.0f};
    TEST_ASSERT_TRUE(window((ab_t){30.0f, -5.0f}, (ab_t){2.0f, 3.0f}));
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, 30.0f - 2.0f - 0.02f * 1.0f / 3.2e-3f, st.emf_V.alpha);
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, -5.0f - 3.0f - 0.02f * 5.0f / 3.2e-3f, st.emf_V.beta);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, st.emf_V.alpha * 3.2e-3f, st.psi_Wb.alpha);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, st.emf_V.beta * 3.2e-3f, st.psi_Wb.beta);
    TEST_ASSERT_EQUAL_FLOAT(2.0f, st.i_A.alpha);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.u_sum_V.alpha);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.i_sum_A.beta);
}

/* Rs off by its value, 10 A: 10 V beside; nominal flux, 1 Wb in .1 s: 10 V; that of the current,
 * .9 Wb: 9 V; inverter 15 V. The window makes 1.6 % less of a flux. */
static void test_direct_current_is_explained_up_to_all_that_is_not_known(void)
{
    st.i_A = (ab_t){10.0f, 0.0f};
    TEST_ASSERT_EQUAL_INT(0, told_after((ab_t){53.9f, 0.0f}, (ab_t){10.0f, 0.0f}));
    TEST_ASSERT_NOT_EQUAL(0, told_after((ab_t){54.1f, 0.0f}, (ab_t){10.0f, 0.0f}));
    setUp();
    TEST_ASSERT_EQUAL_INT(0, told_after((ab_t){0.0f, -24.9f}, (ab_t){0.0f, 0.0f}));
    TEST_ASSERT_NOT_EQUAL(0, told_after((ab_t){0.0f, -25.1f}, (ab_t){0.0f, 0.0f}));
    setUp();
    u_dc_V = 400.0f;
    TEST_ASSERT_EQUAL_INT(0, told_after((ab_t){0.0f, 29.9f}, (ab_t){0.0f, 0.0f}));
    TEST_ASSERT_NOT_EQUAL(0, told_after((ab_t){0.0f, 30.1f}, (ab_t){0.0f, 0.0f}));
}

/* 4 us of 62.5 us are 6.4 % of each leg, 10.5 % of the link as a vector, and 1 % of drop: 34.4 V.
 */
static void test_a_short_period_loses_more_in_the_inverter(void)
{
    current_fit_params_t p = params;
    p.period_s = 62.5e-6f;
    TEST_ASSERT_TRUE(current_fit_init(&cfg, &p));
    TEST_ASSERT_EQUAL_INT(0, told_after((ab_t){44.0f, 0.0f}, (ab_t){0.0f, 0.0f}));
    TEST_ASSERT_NOT_EQUAL(0, told_after((ab_t){44.9f, 0.0f}, (ab_t){0.0f, 0.0f}));
}

/* 100 V without a current: 85 V in excess of the inverter's share are 1 Wb after 12 ms. */
static void test_a_voltage_without_any_current_is_told_at_once(void)
{
    TEST_ASSERT_EQUAL_INT(4, told_after((ab_t){100.0f, 0.0f}, (ab_t){0.0f, 0.0f}));
}

static void test_the_leakage_may_be_off_by_three_tenths(void)
{
    setUp();
    TEST_ASSERT_TRUE(window((ab_t){0.0f, 0.0f}, (ab_t){10.0f, 0.0f}));
    const float rs_Wb = 10.0f * 3.2e-3f;
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, rs_Wb + 0.3f * 0.2f + 15.0f * 3.2e-3f, st.b_Wb);
}

/* .5 Wb, from 20 to 800 rad/s. */
static void test_an_emf_that_turns_is_explained_at_any_speed(void)
{
    for (float w = 20.0f; w < 1000.0f; w *= 1.5f) {
        setUp();
        const ab_t none = {0.0f, 0.0f};
        for (int k = 1; k < 16000; k++) {
            const float angle = w * 2e-4f * (float)k;
            current_fit_add(&st, (ab_t){0.5f * w * cosf(angle), 0.5f * w * sinf(angle)}, none);
            TEST_ASSERT_TRUE(((k % (int)SLOT_COUNT) != 0) ||
                             current_fit_holds(&cfg, &st, none, u_dc_V, motor_known));
        }
    }
}

static void test_a_motor_that_is_not_known_may_have_ten_times_the_resistance(void)
{
    motor_known = false;
    st.i_A = (ab_t){5.0f, 0.0f};
    /* 5 V, 50 V beside, 4 times 1.45 Wb in .1 s, inverter 15 V */
    TEST_ASSERT_EQUAL_INT(0, told_after((ab_t){127.5f, 0.0f}, (ab_t){5.0f, 0.0f}));
    TEST_ASSERT_NOT_EQUAL(0, told_after((ab_t){128.5f, 0.0f}, (ab_t){5.0f, 0.0f}));
}

static void test_no_number_does_not_hold(void)
{
    TEST_ASSERT_FALSE(window((ab_t){NAN, 0.0f}, (ab_t){0.0f, 0.0f}));
    setUp();
    st.b_Wb = NAN;
    TEST_ASSERT_FALSE(window((ab_t){0.0f, 0.0f}, (ab_t){0.0f, 0.0f}));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_what_is_no_positive_number);
    RUN_TEST(test_init_refuses_a_window_longer_than_the_memory);
    RUN_TEST(test_the_emf_of_a_window_is_what_resistance_and_leakage_leave);
    RUN_TEST(test_direct_current_is_explained_up_to_all_that_is_not_known);
    RUN_TEST(test_a_short_period_loses_more_in_the_inverter);
    RUN_TEST(test_a_voltage_without_any_current_is_told_at_once);
    RUN_TEST(test_the_leakage_may_be_off_by_three_tenths);
    RUN_TEST(test_an_emf_that_turns_is_explained_at_any_speed);
    RUN_TEST(test_a_motor_that_is_not_known_may_have_ten_times_the_resistance);
    RUN_TEST(test_no_number_does_not_hold);
    return UNITY_END();
}
