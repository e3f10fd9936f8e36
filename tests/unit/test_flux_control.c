#include "flux_control.h"

#include <math.h>

#include "exact.h"
#include "reference_machine.h"
#include "unity.h"

#define PERIOD_S 0.0002f

static const flux_control_params_t good = {
    .mode = FLUX_CONTROL_PI, .i_d_A = 4.9f, .bandwidth_rad_s = 40.0f, .i_d_max_A = 7.5f};

/* Coefficients of short binary fractions: expected results are exact. */
static const flux_control_config_t simple = {
    .mode = FLUX_CONTROL_PI,
    .i_d_A = 4.0f,
    .lambda_ref_Wb = 0.5f,
    .i_d_max_A = 8.0f,
    .inv_M_per_H = 8.0f,
    .inv_tau_s = 0.25f,
    .pi = {.kp = 64.0f, .ki_T = 0.125f, .tracking = 0.25f, .x_max = 8.0f}};

static float step_at(const flux_control_config_t *cfg, flux_control_state_t *st, float lambda_Wb)
{
    const flux_control_in_t in = {.lambda_hat_Wb = lambda_Wb};
    return flux_control_step(cfg, st, &in);
}

void setUp(void)
{
}

void tearDown(void)
{
}

static void test_init_derives_the_gains_of_both_machines(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        const reference_model_t exact = reference_model(&reference_machine[m], 0.0);
        const double M_H = (double)reference_machine[m].M_H;
        flux_control_config_t cfg = {0};

        TEST_ASSERT_TRUE(flux_control_init(&cfg, &good, &model, PERIOD_S));
        TEST_ASSERT_EQUAL_INT(FLUX_CONTROL_PI, cfg.mode);
        ASSERT_SAME_FLOAT(4.9f, cfg.i_d_A);
        ASSERT_SAME_FLOAT(7.5f, cfg.i_d_max_A);
        ASSERT_NEAR(1e-6, M_H * 4.9, cfg.lambda_ref_Wb);
        ASSERT_NEAR(1e-5, 1.0 / M_H, cfg.inv_M_per_H);
        ASSERT_NEAR(1e-7, 1.0 / exact.tau, cfg.inv_tau_s);
        ASSERT_NEAR(1e-4, 40.0 / (exact.tau * M_H), cfg.pi.kp);
        ASSERT_NEAR(1e-7, 40.0 / M_H * 2e-4, cfg.pi.ki_T);
        ASSERT_NEAR(1e-8, exact.tau * 2e-4, cfg.pi.tracking);
        ASSERT_SAME_FLOAT(7.5f, cfg.pi.x_max);
    }
}

#define ASSERT_REFUSED(field, value)                                                               \
    do {                                                                                           \
        flux_control_params_t bad = good;                                                          \
        bad.field = (value);                                                                       \
        TEST_ASSERT_FALSE_MESSAGE(flux_control_init(&untouched, &bad, &model, PERIOD_S), #field);  \
    } while (0)

static void test_init_refuses_every_bad_number_and_leaves_the_config(void)
{
    const motor_model_t model = reference_derived(0);
    flux_control_config_t untouched = {.i_d_A = 77.0f};

    for (int i = 0; i < NOT_POSITIVE_COUNT; i++) {
        motor_model_t bad_motor = model;
        const float x = not_positive(i);
        ASSERT_REFUSED(i_d_A, x);
        ASSERT_REFUSED(bandwidth_rad_s, x);
        ASSERT_REFUSED(i_d_max_A, x);
        TEST_ASSERT_FALSE(flux_control_init(&untouched, &good, &model, x));
        bad_motor.M_H = x;
        TEST_ASSERT_FALSE(flux_control_init(&untouched, &good, &bad_motor, PERIOD_S));
        bad_motor = model;
        bad_motor.tau_per_s = x;
        TEST_ASSERT_FALSE(flux_control_init(&untouched, &good, &bad_motor, PERIOD_S));
    }
    ASSERT_REFUSED(i_d_max_A, 4.8f);
    ASSERT_REFUSED(mode, (flux_control_mode_t)2);
    ASSERT_SAME_FLOAT(77.0f, untouched.i_d_A);
}

static void test_init_refuses_wrong_signs_that_cancel(void)
{
    flux_control_config_t cfg = {0};
    flux_control_params_t bad = good;
    motor_model_t motor = reference_derived(0);
    bad.bandwidth_rad_s = -bad.bandwidth_rad_s;
    motor.M_H = -motor.M_H;
    TEST_ASSERT_FALSE(flux_control_init(&cfg, &bad, &motor, PERIOD_S));
}

static void test_init_accepts_both_modes_and_a_current_at_the_limit(void)
{
    const motor_model_t model = reference_derived(0);
    flux_control_params_t p = good;
    flux_control_config_t cfg = {0};
    p.i_d_A = p.i_d_max_A;
    TEST_ASSERT_TRUE(flux_control_init(&cfg, &p, &model, PERIOD_S));
    p.mode = FLUX_CONTROL_CONSTANT;
    TEST_ASSERT_TRUE(flux_control_init(&cfg, &p, &model, PERIOD_S));
    TEST_ASSERT_EQUAL_INT(FLUX_CONTROL_CONSTANT, cfg.mode);
}

static void test_constant_mode_ignores_the_estimate(void)
{
    const float lambda_Wb[] = {0.0f, 0.5f, 3.0f, NAN, INFINITY};
    flux_control_config_t cfg = simple;
    flux_control_state_t st = {0};
    cfg.mode = FLUX_CONTROL_CONSTANT;
    for (unsigned i = 0; i < 5u; i++) {
        ASSERT_SAME_FLOAT(4.0f, step_at(&cfg, &st, lambda_Wb[i]));
        ASSERT_SAME_FLOAT(0.0f, st.pi.x);
    }
}

static void test_step_holds_the_flux_at_its_reference(void)
{
    flux_control_state_t st = {.pi = {.x = 4.25f}};
    ASSERT_SAME_FLOAT(4.25f, step_at(&simple, &st, 0.5f));
    ASSERT_SAME_FLOAT(4.25f, st.pi.x);
}

static void test_one_step_agrees_with_double_arithmetic_on_both_machines(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        const reference_model_t exact = reference_model(&reference_machine[m], 0.0);
        const double M_H = (double)reference_machine[m].M_H;
        flux_control_config_t cfg;
        flux_control_state_t st = {.pi = {.x = 4.7f}};
        TEST_ASSERT_TRUE(flux_control_init(&cfg, &good, &model, PERIOD_S));

        const double error_Wb = 0.003;
        const float lambda_Wb = (float)(4.9 * M_H - error_Wb);
        /* The error is the difference of two numbers rounded to 6e-8 Wb; Kp is up to 80 A/Wb. */
        ASSERT_NEAR(1e-5, 40.0 / (exact.tau * M_H) * error_Wb + 4.7, step_at(&cfg, &st, lambda_Wb));
        ASSERT_NEAR(1e-6, 4.7 + 40.0 / M_H * 2e-4 * error_Wb, st.pi.x);
    }
}

static void test_twice_the_error_asks_for_twice_the_current(void)
{
    flux_control_state_t once = {0};
    flux_control_state_t twice = {0};
    ASSERT_SAME_FLOAT(2.0f, step_at(&simple, &once, 0.46875f));
    ASSERT_SAME_FLOAT(4.0f, step_at(&simple, &twice, 0.4375f));
    ASSERT_SAME_FLOAT(2.0f * once.pi.x, twice.pi.x);
}

static void test_the_current_stays_between_zero_and_its_limit(void)
{
    flux_control_state_t st = {.pi = {.x = 4.0f}};
    /* Asked 4 + 32 A, realised 8: 4 + .0625 - 28/4. */
    ASSERT_SAME_FLOAT(8.0f, step_at(&simple, &st, 0.0f));
    ASSERT_SAME_FLOAT(-2.9375f, st.pi.x);
    /* Asked 4 - 32 A, realised 0: 4 - .0625 + 28/4, held at 8. */
    st.pi.x = 4.0f;
    ASSERT_NEAR(0.0, 0.0, step_at(&simple, &st, 1.0f));
    ASSERT_SAME_FLOAT(8.0f, st.pi.x);
}

/* 1/16 Wb below: .5 A less; moving up with 1 Wb/s: 1/4 Wb times 8 A/Wb = 2 A more. */
static void test_constant_mode_feeds_a_lowered_reference_forward(void)
{
    flux_control_config_t cfg = simple;
    flux_control_state_t st = {0};
    cfg.mode = FLUX_CONTROL_CONSTANT;
    ASSERT_SAME_FLOAT(0.5f, flux_control_reduction_A(&cfg, 0.0625f, 0.0f));
    ASSERT_SAME_FLOAT(-1.5f, flux_control_reduction_A(&cfg, 0.0625f, 1.0f));
    ASSERT_SAME_FLOAT(2.5f, flux_control_reduction_A(&cfg, 0.0625f, -1.0f));
    /* Would take -.5 A, and 8.5 A of 0..8; NaN leaves a current that is allowed. */
    ASSERT_SAME_FLOAT(4.0f, flux_control_reduction_A(&cfg, 0.0625f, -2.0f));
    ASSERT_SAME_FLOAT(-4.0f, flux_control_reduction_A(&cfg, 0.0625f, 2.5f));
    ASSERT_SAME_FLOAT(-4.0f, flux_control_reduction_A(&cfg, 0.0625f, NAN));

    const flux_control_in_t in = {.lambda_hat_Wb = 0.3f, .reduction_A = 2.5f};
    ASSERT_SAME_FLOAT(1.5f, flux_control_step(&cfg, &st, &in));
    ASSERT_SAME_FLOAT(0.0f, st.pi.x);
}

static void test_the_pi_controls_to_the_lowered_reference_and_needs_no_feed_forward(void)
{
    flux_control_state_t st = {.pi = {.x = 4.25f}};
    const flux_control_in_t in = {
        .lambda_hat_Wb = 0.375f, .reduction_Wb = 0.125f, .reduction_A = 3.0f};
    ASSERT_SAME_FLOAT(4.25f, flux_control_step(&simple, &st, &in));
    ASSERT_SAME_FLOAT(4.25f, st.pi.x);
}

/* lambda' = tau (M i_d - lambda) for some periods; peak and final flux. */
static void magnetise(int machine, const flux_control_config_t *cfg, flux_control_state_t *st,
                      int periods, double *lambda_Wb, double *peak_Wb)
{
    const reference_model_t exact = reference_model(&reference_machine[machine], 0.0);
    const double M_H = (double)reference_machine[machine].M_H;
    const double decay = exp(-exact.tau * (double)PERIOD_S);

    *peak_Wb = 0.0;
    for (int k = 0; k < periods; k++) {
        const float i_d_A = step_at(cfg, st, (float)*lambda_Wb);
        *lambda_Wb = decay * *lambda_Wb + (1.0 - decay) * M_H * (double)i_d_A;
        *peak_Wb = fmax(*peak_Wb, *lambda_Wb);
    }
}

static void test_the_flux_follows_with_the_bandwidth_on_both_machines(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        const double reference_Wb = 4.9 * (double)reference_machine[m].M_H;
        double lambda_Wb = 0.98 * reference_Wb;
        double peak_Wb;
        flux_control_config_t cfg;
        flux_control_state_t st = {.pi = {.x = 0.98f * 4.9f}}; /* at rest at 98 % */
        TEST_ASSERT_TRUE(flux_control_init(&cfg, &good, &model, PERIOD_S));
        /* 125 periods = one time constant; 1 % for the sampling. */
        magnetise(m, &cfg, &st, 125, &lambda_Wb, &peak_Wb);
        ASSERT_NEAR(2e-4 * reference_Wb, reference_Wb * (1.0 - 0.02 * exp(-1.0)), lambda_Wb);
    }
}

static void test_the_flux_builds_up_from_zero_at_the_limit_and_does_not_overshoot(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        const double reference_Wb = 4.9 * (double)reference_machine[m].M_H;
        double lambda_Wb = 0.0;
        double peak_Wb;
        flux_control_config_t cfg;
        flux_control_state_t st = {0};
        TEST_ASSERT_TRUE(flux_control_init(&cfg, &good, &model, PERIOD_S));
        magnetise(m, &cfg, &st, 10000, &lambda_Wb, &peak_Wb);
        ASSERT_NEAR(1e-5, reference_Wb, lambda_Wb);
        TEST_ASSERT_TRUE(peak_Wb < 1.0005 * reference_Wb);

        /* Not told, it would. */
        cfg.pi.tracking = 0.0f;
        st = (flux_control_state_t){0};
        lambda_Wb = 0.0;
        magnetise(m, &cfg, &st, 10000, &lambda_Wb, &peak_Wb);
        TEST_ASSERT_TRUE(peak_Wb > 1.02 * reference_Wb);
    }
}

/* A ramp of the reference from nominal down to half, at a rate that leaves the current room. */
static void test_the_flux_follows_a_ramp_without_lag_on_both_machines(void)
{
    flux_control_params_t p = good;
    p.mode = FLUX_CONTROL_CONSTANT;
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        const reference_model_t exact = reference_model(&reference_machine[m], 0.0);
        const double M_H = (double)reference_machine[m].M_H, nominal_Wb = 4.9 * M_H;
        const double decay = exp(-exact.tau * (double)PERIOD_S);
        double lambda_Wb = nominal_Wb, reduction_Wb = 0.0;
        flux_control_config_t cfg;
        flux_control_state_t st = {0};
        TEST_ASSERT_TRUE(flux_control_init(&cfg, &p, &model, PERIOD_S));
        for (int k = 0; k < 2500; k++) {
            reduction_Wb += 0.5 * (double)PERIOD_S;
            const flux_control_in_t in = {
                .lambda_hat_Wb = NAN,
                .reduction_Wb = (float)reduction_Wb,
                .reduction_A = flux_control_reduction_A(&cfg, (float)reduction_Wb, -0.5f)};
            const float i_d_A = flux_control_step(&cfg, &st, &in);
            lambda_Wb = decay * lambda_Wb + (1.0 - decay) * M_H * (double)i_d_A;
            /* Half a period of the ramp; without the rate it would lag by .5/tau, 64 mWb and more.
             */
            ASSERT_NEAR(1e-4, nominal_Wb - reduction_Wb, lambda_Wb);
        }
    }
}

static void test_an_estimate_that_is_no_number_keeps_current_and_state_in_their_limits(void)
{
    for (int i = 0; i < NOT_FINITE_COUNT; i++) {
        flux_control_state_t st = {.pi = {.x = 4.0f}};
        const float i_d_A = step_at(&simple, &st, not_finite(i));
        TEST_ASSERT_TRUE((i_d_A >= 0.0f) && (i_d_A <= 8.0f));
        TEST_ASSERT_TRUE(fabsf(st.pi.x) <= 8.0f);
    }
}

static void test_two_controllers_share_a_config_and_nothing_else(void)
{
    flux_control_state_t a = {0};
    flux_control_state_t b = {0};
    const float first_A = step_at(&simple, &a, 0.45f);
    ASSERT_SAME_FLOAT(first_A, step_at(&simple, &b, 0.45f));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_derives_the_gains_of_both_machines);
    RUN_TEST(test_init_refuses_every_bad_number_and_leaves_the_config);
    RUN_TEST(test_init_refuses_wrong_signs_that_cancel);
    RUN_TEST(test_init_accepts_both_modes_and_a_current_at_the_limit);
    RUN_TEST(test_constant_mode_ignores_the_estimate);
    RUN_TEST(test_constant_mode_feeds_a_lowered_reference_forward);
    RUN_TEST(test_the_pi_controls_to_the_lowered_reference_and_needs_no_feed_forward);
    RUN_TEST(test_step_holds_the_flux_at_its_reference);
    RUN_TEST(test_one_step_agrees_with_double_arithmetic_on_both_machines);
    RUN_TEST(test_twice_the_error_asks_for_twice_the_current);
    RUN_TEST(test_the_current_stays_between_zero_and_its_limit);
    RUN_TEST(test_the_flux_follows_with_the_bandwidth_on_both_machines);
    RUN_TEST(test_the_flux_builds_up_from_zero_at_the_limit_and_does_not_overshoot);
    RUN_TEST(test_the_flux_follows_a_ramp_without_lag_on_both_machines);
    RUN_TEST(test_an_estimate_that_is_no_number_keeps_current_and_state_in_their_limits);
    RUN_TEST(test_two_controllers_share_a_config_and_nothing_else);
    return UNITY_END();
}
