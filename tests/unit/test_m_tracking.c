/* M from the flux: by hand, in its limits, and where nothing may move. */
#include "m_tracking.h"

#include <math.h>

#include "exact.h"
#include "unity.h"

static const m_tracking_config_t simple = {
    .gain = 0.25f, .min_rad_s = 90.0f, .inv_M_per_H = 8.0f, .tau_per_s = 4.0f};
/* .625 Wb from 4 A: M is .15625 H instead of .125, a quarter more. */
static const m_tracking_in_t more = {
    .lambda_hat_Wb = 0.625f, .i_d_A = 4.0f, .omega_s_hat_rad_s = 90.0f};

static motor_model_t motor;
static m_tracking_config_t cfg;
static m_tracking_state_t st;

void setUp(void)
{
    motor = (motor_model_t){.M_H = 0.125f, .tau_per_s = 4.0f};
    cfg = simple;
    st = (m_tracking_state_t){0};
}

void tearDown(void)
{
}

static void test_off_nothing_is_looked_at(void)
{
    const m_tracking_params_t off = {.min_rad_s = -1.0f};
    TEST_ASSERT_TRUE(m_tracking_init(&cfg, &off, &motor, 0.0f));
    TEST_ASSERT_FALSE(m_tracking_on(&cfg));
}

static void test_init_derives_its_coefficients(void)
{
    const m_tracking_params_t on = {.on = true, .min_rad_s = 90.0f};
    TEST_ASSERT_TRUE(m_tracking_init(&cfg, &on, &motor, 0.5f));
    TEST_ASSERT_TRUE(m_tracking_on(&cfg));
    ASSERT_SAME_FLOAT(0.2f, cfg.gain);
    ASSERT_SAME_FLOAT(90.0f, cfg.min_rad_s);
    ASSERT_SAME_FLOAT(8.0f, cfg.inv_M_per_H);
    ASSERT_SAME_FLOAT(4.0f, cfg.tau_per_s);
}

static void test_init_refuses_what_is_not_positive(void)
{
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        const m_tracking_params_t bad = {.on = true, .min_rad_s = not_positive(k)};
        const m_tracking_params_t on = {.on = true, .min_rad_s = 90.0f};
        TEST_ASSERT_FALSE(m_tracking_init(&cfg, &bad, &motor, 0.5f));
        TEST_ASSERT_FALSE(m_tracking_init(&cfg, &on, &motor, not_positive(k)));
        motor.M_H = not_positive(k);
        TEST_ASSERT_FALSE(m_tracking_init(&cfg, &on, &motor, 0.5f));
        motor.M_H = 0.125f;
        motor.tau_per_s = not_positive(k);
        TEST_ASSERT_FALSE(m_tracking_init(&cfg, &on, &motor, 0.5f));
        motor.tau_per_s = 4.0f;
    }
}

/* A quarter of the way; Rr/Lr falls as M rises. */
static void test_a_step_by_hand(void)
{
    m_tracking_step(&cfg, &st, &more);
    ASSERT_SAME_FLOAT(0.0625f, st.extra_pu);
    ASSERT_NEAR(1e-7, 4.0 / 1.0625 - 4.0, st.tau_extra_per_s);
    for (int k = 0; k < 100; k++) {
        m_tracking_step(&cfg, &st, &more);
    }
    ASSERT_NEAR(1e-6, 0.25, st.extra_pu);
    ASSERT_NEAR(1e-6, 3.2 - 4.0, st.tau_extra_per_s);
}

static void test_the_direction_of_turning_is_no_matter(void)
{
    m_tracking_in_t in = more;
    in.omega_s_hat_rad_s = -90.0f;
    m_tracking_step(&cfg, &st, &in);
    ASSERT_SAME_FLOAT(0.0625f, st.extra_pu);
}

/* What was found holds. */
static void test_slow_or_without_magnetising_current_nothing_moves(void)
{
    const float speeds[] = {89.9f, -89.9f, 0.0f, NAN};
    const float currents[] = {0.0f, -4.0f, NAN};
    const m_tracking_state_t before = {.extra_pu = 0.125f, .tau_extra_per_s = -0.5f};
    st = before;
    for (int k = 0; k < 4; k++) {
        m_tracking_in_t in = more;
        in.omega_s_hat_rad_s = speeds[k];
        m_tracking_step(&cfg, &st, &in);
        TEST_ASSERT_EQUAL_MEMORY(&before, &st, sizeof st);
    }
    for (int k = 0; k < 3; k++) {
        m_tracking_in_t in = more;
        in.i_d_A = currents[k];
        m_tracking_step(&cfg, &st, &in);
        TEST_ASSERT_EQUAL_MEMORY(&before, &st, sizeof st);
    }
}

static void test_no_flux_makes_an_m_that_no_motor_has(void)
{
    const float flux_Wb[] = {0.0f, 30.0f, INFINITY, NAN};
    const double ends[] = {-0.3, 0.3, 0.3, -0.3};
    for (int n = 0; n < 4; n++) {
        st = (m_tracking_state_t){0};
        m_tracking_in_t in = more;
        in.lambda_hat_Wb = flux_Wb[n];
        for (int k = 0; k < 100; k++) {
            m_tracking_step(&cfg, &st, &in);
        }
        ASSERT_NEAR(1e-6, ends[n], st.extra_pu);
        ASSERT_NEAR(1e-5, 4.0 / (1.0 + ends[n]) - 4.0, st.tau_extra_per_s);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_off_nothing_is_looked_at);
    RUN_TEST(test_init_derives_its_coefficients);
    RUN_TEST(test_init_refuses_what_is_not_positive);
    RUN_TEST(test_a_step_by_hand);
    RUN_TEST(test_the_direction_of_turning_is_no_matter);
    RUN_TEST(test_slow_or_without_magnetising_current_nothing_moves);
    RUN_TEST(test_no_flux_makes_an_m_that_no_motor_has);
    return UNITY_END();
}
