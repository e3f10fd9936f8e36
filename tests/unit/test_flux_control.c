/* Flux reference -> magnetising current. */
#include "flux_control.h"

#include <math.h>

#include "exact.h"
#include "reference_machine.h"
#include "unity.h"

#define PERIOD_S 0.0002

static const flux_control_params_t good = {.i_d_A = 4.9f, .i_d_max_A = 7.5f};

/* Coefficients of short binary fractions: expected results are exact. */
static const flux_control_config_t simple = {.i_d_A = 4.0f,
                                             .lambda_ref_Wb = 0.5f,
                                             .i_d_max_A = 8.0f,
                                             .inv_M_per_H = 8.0f,
                                             .inv_tau_s = 0.25f};

void setUp(void)
{
}

void tearDown(void)
{
}

static void test_init_derives_the_reference_of_both_machines(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        const reference_model_t exact = reference_model(&reference_machine[m], 0.0);
        const double M_H = (double)reference_machine[m].M_H;
        flux_control_config_t cfg = {0};

        TEST_ASSERT_TRUE(flux_control_init(&cfg, &good, &model));
        ASSERT_SAME_FLOAT(4.9f, cfg.i_d_A);
        ASSERT_SAME_FLOAT(7.5f, cfg.i_d_max_A);
        ASSERT_NEAR(1e-6, M_H * 4.9, cfg.lambda_ref_Wb);
        ASSERT_NEAR(1e-5, 1.0 / M_H, cfg.inv_M_per_H);
        ASSERT_NEAR(1e-7, 1.0 / exact.tau, cfg.inv_tau_s);
    }
}

#define ASSERT_REFUSED(field, value)                                                               \
    do {                                                                                           \
        flux_control_params_t bad = good;                                                          \
        bad.field = (value);                                                                       \
        TEST_ASSERT_FALSE_MESSAGE(flux_control_init(&untouched, &bad, &model), #field);            \
    } while (0)

static void test_init_refuses_every_bad_number_and_leaves_the_config(void)
{
    const motor_model_t model = reference_derived(0);
    flux_control_config_t untouched = {.i_d_A = 77.0f};

    for (int i = 0; i < NOT_POSITIVE_COUNT; i++) {
        motor_model_t bad_motor = model;
        const float x = not_positive(i);
        ASSERT_REFUSED(i_d_A, x);
        ASSERT_REFUSED(i_d_max_A, x);
        bad_motor.M_H = x;
        TEST_ASSERT_FALSE(flux_control_init(&untouched, &good, &bad_motor));
        bad_motor = model;
        bad_motor.tau_per_s = x;
        TEST_ASSERT_FALSE(flux_control_init(&untouched, &good, &bad_motor));
    }
    ASSERT_REFUSED(i_d_max_A, 4.8f);
    ASSERT_SAME_FLOAT(77.0f, untouched.i_d_A);
}

static void test_init_accepts_a_current_at_the_limit(void)
{
    const motor_model_t model = reference_derived(0);
    flux_control_params_t p = good;
    flux_control_config_t cfg = {0};
    p.i_d_A = p.i_d_max_A;
    TEST_ASSERT_TRUE(flux_control_init(&cfg, &p, &model));
}

/* 1/16 Wb below: .5 A less; moving up with 1 Wb/s: 1/4 Wb times 8 A/Wb = 2 A more. */
static void test_a_lowered_reference_takes_its_current_and_its_rate(void)
{
    ASSERT_SAME_FLOAT(0.5f, flux_control_reduction_A(&simple, 0.0625f, 0.0f));
    ASSERT_SAME_FLOAT(-1.5f, flux_control_reduction_A(&simple, 0.0625f, 1.0f));
    ASSERT_SAME_FLOAT(2.5f, flux_control_reduction_A(&simple, 0.0625f, -1.0f));
    /* Would take -.5 A, and 8.5 A of 0..8; NaN leaves a current that is allowed. */
    ASSERT_SAME_FLOAT(4.0f, flux_control_reduction_A(&simple, 0.0625f, -2.0f));
    ASSERT_SAME_FLOAT(-4.0f, flux_control_reduction_A(&simple, 0.0625f, 2.5f));
    ASSERT_SAME_FLOAT(-4.0f, flux_control_reduction_A(&simple, 0.0625f, NAN));
}

/* A ramp of the reference from nominal down to half, at a rate that leaves the current room. */
static void test_the_flux_follows_a_ramp_without_lag_on_both_machines(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        const reference_model_t exact = reference_model(&reference_machine[m], 0.0);
        const double M_H = (double)reference_machine[m].M_H, nominal_Wb = 4.9 * M_H;
        const double decay = exp(-exact.tau * PERIOD_S);
        double lambda_Wb = nominal_Wb, reduction_Wb = 0.0;
        flux_control_config_t cfg;
        TEST_ASSERT_TRUE(flux_control_init(&cfg, &good, &model));
        for (int k = 0; k < 2500; k++) {
            reduction_Wb += 0.5 * PERIOD_S;
            const float i_d_A =
                cfg.i_d_A - flux_control_reduction_A(&cfg, (float)reduction_Wb, -0.5f);
            lambda_Wb = decay * lambda_Wb + (1.0 - decay) * M_H * (double)i_d_A;
            /* Half a period of the ramp; without the rate it would lag by .5/tau, 64 mWb and more.
             */
            ASSERT_NEAR(1e-4, nominal_Wb - reduction_Wb, lambda_Wb);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_derives_the_reference_of_both_machines);
    RUN_TEST(test_init_refuses_every_bad_number_and_leaves_the_config);
    RUN_TEST(test_init_accepts_a_current_at_the_limit);
    RUN_TEST(test_a_lowered_reference_takes_its_current_and_its_rate);
    RUN_TEST(test_the_flux_follows_a_ramp_without_lag_on_both_machines);
    return UNITY_END();
}
