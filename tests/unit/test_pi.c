#include "pi.h"

#include <float.h>
#include <math.h>

#include "exact.h"
#include "unity.h"

#define PERIOD_S 0.0002f

/* All values powers of two or short sums of them: expected results are exact. */
static const pi_config_t simple = {.kp = 3.0f, .ki_T = 0.25f, .tracking = 0.125f, .x_max = 10.0f};

void setUp(void)
{
}

void tearDown(void)
{
}

static void test_init_derives_the_coefficients(void)
{
    pi_config_t cfg = {0};
    TEST_ASSERT_TRUE(pi_init(&cfg, 4.0f, 32.0f, 15.0f, 0.0078125f));
    ASSERT_SAME_FLOAT(4.0f, cfg.kp);
    ASSERT_SAME_FLOAT(0.25f, cfg.ki_T);
    ASSERT_SAME_FLOAT(0.0625f, cfg.tracking);
    ASSERT_SAME_FLOAT(15.0f, cfg.x_max);
}

static void test_init_refuses_every_bad_number_and_leaves_the_config(void)
{
    pi_config_t cfg = {.kp = 77.0f};

    for (int i = 0; i < NOT_POSITIVE_COUNT; i++) {
        TEST_ASSERT_FALSE_MESSAGE(pi_init(&cfg, not_positive(i), 1.0f, 1.0f, PERIOD_S), "kp");
        TEST_ASSERT_FALSE_MESSAGE(pi_init(&cfg, 1.0f, 1.0f, not_positive(i), PERIOD_S), "x_max");
        TEST_ASSERT_FALSE_MESSAGE(pi_init(&cfg, 1.0f, 1.0f, 1.0f, not_positive(i)), "period");
    }
    TEST_ASSERT_FALSE(pi_init(&cfg, 1.0f, -1.0f, 1.0f, PERIOD_S));
    TEST_ASSERT_FALSE(pi_init(&cfg, 1.0f, NAN, 1.0f, PERIOD_S));
    TEST_ASSERT_FALSE(pi_init(&cfg, 1.0f, INFINITY, 1.0f, PERIOD_S));
    /* Finite factors, infinite product. */
    TEST_ASSERT_FALSE(pi_init(&cfg, 1.0f, FLT_MAX, 1.0f, 2.0f));
    ASSERT_SAME_FLOAT(77.0f, cfg.kp);
}

static void test_init_accepts_a_controller_without_integral_action(void)
{
    pi_config_t cfg = {0};
    pi_state_t st = {.x = 0.5f};
    TEST_ASSERT_TRUE(pi_init(&cfg, 2.0f, 0.0f, 1.0f, PERIOD_S));
    ASSERT_SAME_FLOAT(0.0f, cfg.tracking);
    pi_update(&cfg, &st, 3.0f, -4.0f);
    ASSERT_SAME_FLOAT(0.5f, st.x);
}

static void test_output_adds_the_integrator_to_the_proportional_part(void)
{
    const pi_state_t st = {.x = 0.5f};
    ASSERT_SAME_FLOAT(-5.5f, pi_output(&simple, &st, -2.0f));
}

static void test_update_holds_without_error_and_without_limit(void)
{
    pi_state_t st = {.x = 1.75f};
    pi_update(&simple, &st, 0.0f, 0.0f);
    ASSERT_SAME_FLOAT(1.75f, st.x);
}

static void test_update_integrates_the_error(void)
{
    pi_state_t st = {.x = 1.0f};
    pi_update(&simple, &st, 2.0f, 0.0f);
    ASSERT_SAME_FLOAT(1.5f, st.x);
}

static void test_update_follows_what_was_realised(void)
{
    pi_state_t st = {.x = 1.0f};
    pi_update(&simple, &st, 0.0f, -4.0f);
    ASSERT_SAME_FLOAT(0.5f, st.x);
}

static void test_update_agrees_with_double_arithmetic(void)
{
    pi_config_t cfg;
    pi_state_t st = {.x = -3.21f};
    TEST_ASSERT_TRUE(pi_init(&cfg, 3.2f, 480.0f, 163.0f, PERIOD_S));
    pi_update(&cfg, &st, 1.37f, -7.9f);
    /* One rounding per operation: 4 ulp of the largest term. */
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, -3.21 + 480.0 * 2e-4 * 1.37 - 480.0 * 2e-4 / 3.2 * 7.9,
                              (double)st.x);
}

static void test_update_is_odd(void)
{
    pi_state_t plus = {.x = 1.1f};
    pi_state_t minus = {.x = -1.1f};
    pi_update(&simple, &plus, 0.7f, -0.3f);
    pi_update(&simple, &minus, -0.7f, 0.3f);
    ASSERT_SAME_FLOAT(-plus.x, minus.x);
}

static void test_update_holds_the_integrator_inside_its_bound_on_both_sides(void)
{
    pi_state_t st = {.x = 9.5f};
    pi_update(&simple, &st, 100.0f, 0.0f);
    ASSERT_SAME_FLOAT(10.0f, st.x);
    pi_update(&simple, &st, -1000.0f, 0.0f);
    ASSERT_SAME_FLOAT(-10.0f, st.x);
}

static void test_update_keeps_no_nan_and_no_infinity(void)
{
    for (int i = 0; i < NOT_FINITE_COUNT; i++) {
        pi_state_t st = {.x = 1.0f};
        pi_update(&simple, &st, not_finite(i), 0.0f);
        TEST_ASSERT_TRUE(fabsf(st.x) <= 10.0f);
        pi_update(&simple, &st, 0.0f, not_finite(i));
        TEST_ASSERT_TRUE(fabsf(st.x) <= 10.0f);
    }
}

static void test_tracking_does_not_chatter_when_the_integral_is_faster_than_the_period(void)
{
    pi_config_t cfg;
    pi_state_t st = {0};
    /* T Ki/Kp = 3: used as it is, the integrator would swing about the limit and grow. */
    TEST_ASSERT_TRUE(pi_init(&cfg, 1.0f, 3.0f, 100.0f, 1.0f));
    ASSERT_SAME_FLOAT(1.0f, cfg.tracking);
    for (int k = 0; k < 20; k++) {
        const float asked = pi_output(&cfg, &st, 2.0f);
        pi_update(&cfg, &st, 2.0f, fminf(asked, 1.0f) - asked);
        /* x = limit - Kp e + T Ki e, at once and for good. */
        ASSERT_SAME_FLOAT(5.0f, st.x);
    }
}

/* Highest current of an R-L load whose reference steps by 8 A while the voltage is limited. */
static double overshoot_A(bool told)
{
    const double R_ohm = 0.93, L_H = 0.008, bw_rad_s = 400.0, limit_V = 9.0;
    pi_config_t cfg;
    pi_state_t st = {0};
    double i_A = 0.0, highest_A = 0.0;

    TEST_ASSERT_TRUE(
        pi_init(&cfg, (float)(bw_rad_s * L_H), (float)(bw_rad_s * R_ohm), 400.0f, PERIOD_S));
    for (int k = 0; k < 2000; k++) {
        const float error_A = (float)(8.0 - i_A);
        const float asked_V = pi_output(&cfg, &st, error_A);
        const float u_V = fminf(asked_V, (float)limit_V);
        pi_update(&cfg, &st, error_A, told ? (u_V - asked_V) : 0.0f);
        i_A += (double)PERIOD_S / L_H * ((double)u_V - R_ohm * i_A);
        highest_A = fmax(highest_A, i_A);
    }
    TEST_ASSERT_DOUBLE_WITHIN(told ? 0.01 : 1.0, 8.0, i_A);
    return highest_A - 8.0;
}

static void test_saturated_loop_recovers_without_overshoot_only_when_told(void)
{
    TEST_ASSERT_TRUE(overshoot_A(true) < 0.001);
    TEST_ASSERT_TRUE(overshoot_A(false) > 0.5);
}

static void test_two_controllers_share_a_config_and_nothing_else(void)
{
    pi_state_t a = {0};
    pi_state_t b = {0};
    pi_update(&simple, &a, 4.0f, 0.0f);
    ASSERT_SAME_FLOAT(1.0f, a.x);
    ASSERT_SAME_FLOAT(0.0f, b.x);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_derives_the_coefficients);
    RUN_TEST(test_init_refuses_every_bad_number_and_leaves_the_config);
    RUN_TEST(test_init_accepts_a_controller_without_integral_action);
    RUN_TEST(test_output_adds_the_integrator_to_the_proportional_part);
    RUN_TEST(test_update_holds_without_error_and_without_limit);
    RUN_TEST(test_update_integrates_the_error);
    RUN_TEST(test_update_follows_what_was_realised);
    RUN_TEST(test_update_agrees_with_double_arithmetic);
    RUN_TEST(test_update_is_odd);
    RUN_TEST(test_update_holds_the_integrator_inside_its_bound_on_both_sides);
    RUN_TEST(test_update_keeps_no_nan_and_no_infinity);
    RUN_TEST(test_tracking_does_not_chatter_when_the_integral_is_faster_than_the_period);
    RUN_TEST(test_saturated_loop_recovers_without_overshoot_only_when_told);
    RUN_TEST(test_two_controllers_share_a_config_and_nothing_else);
    return UNITY_END();
}
