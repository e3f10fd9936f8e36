/* The flux the voltage allows and the torque needs: the controllers alone, and what init refuses.
 */
#include "flux_reference.h"

#include <math.h>

#include "exact.h"
#include "reference_machine.h"
#include "unity.h"

#define TURN_S 0.0032f

static const flux_reference_params_t good = {.voltage_share = 0.9f,
                                             .bandwidth_rad_s = 20.0f,
                                             .pull_out_share = 0.8f,
                                             .economy_min_pu = 0.3f,
                                             .economy_from_rad_s = 30.0f,
                                             .economy_filter_s = 0.5f,
                                             .economy_slew_Wb_per_s = 0.4f,
                                             .lambda_nominal_Wb = 0.52f,
                                             .lambda_min_Wb = 0.05f,
                                             .i_q_max_A = 15.0f};

static flux_reference_config_t cfg;
static flux_reference_state_t st;
static motor_model_t table1;
static float lambda_hat_Wb;
static float full_pu;

void setUp(void)
{
    table1 = reference_derived(0);
    TEST_ASSERT_TRUE(flux_reference_init(&cfg, &good, &table1, TURN_S));
    st = (flux_reference_state_t){0};
    lambda_hat_Wb = 0.0f;
    full_pu = 0.0f;
}

void tearDown(void)
{
}

static void step(float u_V, float u_dc_V, float omega_s_rad_s, float torque_Nm)
{
    const flux_reference_in_t in = {.u_V = u_V,
                                    .u_dc_V = u_dc_V,
                                    .omega_s_rad_s = omega_s_rad_s,
                                    .torque_Nm = torque_Nm,
                                    .lambda_Wb = lambda_hat_Wb,
                                    .full_pu = full_pu};
    flux_reference_step(&cfg, &st, &in);
}

static void test_init_derives_the_coefficients_of_both_machines(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        const motor_t *motor = &reference_machine[m];
        const double kr = (double)motor->M_H / (double)motor->Lr_H;
        const double ratio = kr * kr * (double)motor->Rr_ohm / (double)motor->Rs_ohm;
        const double sigma_Ls = (double)motor->Ls_H - kr * (double)motor->M_H;
        TEST_ASSERT_TRUE(flux_reference_init(&cfg, &good, &model, TURN_S));
        TEST_ASSERT_TRUE(flux_reference_on(&cfg));
        ASSERT_NEAR(1e-6, 0.9 / sqrt(2.0), cfg.voltage_share);
        ASSERT_NEAR(1e-6, (double)motor->M_H / ((double)motor->pole_pairs * kr) * sqrt(1.0 + ratio),
                    cfg.economy_Wb2_per_Nm);
        ASSERT_NEAR(1e-6, 20.0 * 0.0032 / kr, cfg.gain_Wb_rad_s_per_V);
        ASSERT_NEAR(0.01, 0.8 * (double)motor->Ls_H / (sigma_Ls * (double)motor->M_H),
                    cfg.i_q_per_Wb_A);
        ASSERT_NEAR(1e-6, 0.47, cfg.reduction_max_Wb);
    }
}

static void test_both_off_takes_anything_and_does_nothing(void)
{
    const flux_reference_params_t off = {.bandwidth_rad_s = NAN};
    TEST_ASSERT_TRUE(flux_reference_init(&cfg, &off, &table1, TURN_S));
    TEST_ASSERT_FALSE(flux_reference_on(&cfg));
    step(300.0f, 100.0f, 700.0f, 0.0f);
    ASSERT_SAME_FLOAT(0.0f, st.reduction_Wb);
    flux_reference_start(&cfg, &st, 700.0f, 283.0f);
    ASSERT_SAME_FLOAT(0.0f, st.weakened_Wb);
    ASSERT_SAME_FLOAT(0.0f, st.reduction_Wb);
}

static bool refused(flux_reference_params_t p)
{
    return !flux_reference_init(&cfg, &p, &table1, TURN_S);
}

static void test_init_refuses_each_bad_number(void)
{
    const size_t positive[] = {offsetof(flux_reference_params_t, bandwidth_rad_s),
                               offsetof(flux_reference_params_t, pull_out_share),
                               offsetof(flux_reference_params_t, economy_filter_s),
                               offsetof(flux_reference_params_t, economy_slew_Wb_per_s),
                               offsetof(flux_reference_params_t, lambda_nominal_Wb),
                               offsetof(flux_reference_params_t, lambda_min_Wb),
                               offsetof(flux_reference_params_t, i_q_max_A)};
    for (size_t n = 0; n < sizeof positive / sizeof positive[0]; n++) {
        for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
            flux_reference_params_t p = good;
            const float bad = not_positive(k);
            memcpy((char *)&p + positive[n], &bad, sizeof bad);
            TEST_ASSERT_TRUE(refused(p));
        }
    }
    flux_reference_params_t p = good;
    p.voltage_share = NAN;
    TEST_ASSERT_TRUE(refused(p));
    p.voltage_share = 1.01f;
    TEST_ASSERT_TRUE(refused(p));
    p.voltage_share = 1.0f;
    TEST_ASSERT_FALSE(refused(p));
    p = good;
    p.pull_out_share = 1.01f;
    TEST_ASSERT_TRUE(refused(p));
    p.pull_out_share = 1.0f;
    TEST_ASSERT_FALSE(refused(p));
    p = good;
    p.economy_min_pu = -0.1f;
    TEST_ASSERT_TRUE(refused(p));
    p.economy_min_pu = 1.1f;
    TEST_ASSERT_TRUE(refused(p));
    p.economy_min_pu = NAN;
    TEST_ASSERT_TRUE(refused(p));
    p.economy_min_pu = 0.09f; /* below what weakening may leave, .096 */
    TEST_ASSERT_TRUE(refused(p));
    p.economy_min_pu = 0.1f;
    TEST_ASSERT_FALSE(refused(p));
    p = good;
    p.economy_from_rad_s = -1.0f;
    TEST_ASSERT_TRUE(refused(p));
    p = good;
    p.economy_min_pu = 0.0f;
    p.lambda_min_Wb = 0.53f;
    TEST_ASSERT_TRUE(refused(p));
    TEST_ASSERT_FALSE(flux_reference_init(&cfg, &good, &table1, 0.0f));
    motor_model_t motor = table1;
    motor.kr = 0.0f;
    TEST_ASSERT_FALSE(flux_reference_init(&cfg, &good, &motor, TURN_S));
}

/* The plant of the controller: |u| = kr w lambda at no load. Converges to the margin. */
static void test_weakening_settles_with_the_voltage_at_its_share(void)
{
    flux_reference_params_t p = good;
    p.economy_min_pu = 0.0f;
    TEST_ASSERT_TRUE(flux_reference_init(&cfg, &p, &table1, TURN_S));
    const float speeds[] = {716.0f, -716.0f};
    for (int n = 0; n < 2; n++) {
        st = (flux_reference_state_t){0};
        for (int k = 0; k < 300; k++) {
            step(716.0f * (0.52f - st.reduction_Wb), 283.0f, speeds[n], 0.0f);
        }
        const double u_max = 0.9 / sqrt(2.0) * 283.0;
        ASSERT_NEAR(1e-3, u_max / 716.0, 0.52 - (double)st.reduction_Wb);
        ASSERT_NEAR(1e-2, 0.0, st.rate_Wb_per_s);
    }
}

static void test_one_step_of_the_voltage_controller_by_hand(void)
{
    flux_reference_params_t p = good;
    p.economy_min_pu = 0.0f;
    TEST_ASSERT_TRUE(flux_reference_init(&cfg, &p, &table1, TURN_S));
    step(200.0f, 283.0f, 500.0f, 0.0f);
    const double u_max = 0.9 / sqrt(2.0) * 283.0;
    const double below = 20.0 * 0.0032 * (200.0 - u_max) / 500.0;
    ASSERT_NEAR(1e-7, below, st.reduction_Wb);
    ASSERT_NEAR(1e-4, -below / 0.0032, st.rate_Wb_per_s);
    /* Back at once, never above nominal, never below the least flux. */
    step(0.0f, 283.0f, 500.0f, 0.0f);
    ASSERT_SAME_FLOAT(0.0f, st.reduction_Wb);
    ASSERT_SAME_FLOAT(0.0f, st.weakened_Wb); /* and no credit for later */
    for (int k = 0; k < 10000; k++) {
        step(500.0f, 283.0f, 500.0f, 0.0f);
    }
    ASSERT_NEAR(1e-6, 0.47, st.reduction_Wb);
}

/* The flux at which the voltage is at its share of what the link leaves. */
static double settled_Wb(int steps)
{
    for (int k = 0; k < steps; k++) {
        step(716.0f * (0.52f - st.reduction_Wb), 283.0f, 716.0f, 0.0f);
    }
    return 0.52 - (double)st.reduction_Wb;
}

/* Half of the voltage at most. 625 steps are 2 s: exp(-1) is left of a link that was full. */
static void test_a_full_link_takes_flux_at_once_and_gives_it_back_within_seconds(void)
{
    flux_reference_params_t p = good;
    p.economy_min_pu = 0.0f;
    TEST_ASSERT_TRUE(flux_reference_init(&cfg, &p, &table1, TURN_S));
    const double free_Wb = settled_Wb(300);
    full_pu = 0.2f;
    step(200.0f, 283.0f, 716.0f, 0.0f);
    ASSERT_SAME_FLOAT(0.2f, st.full_pu);
    ASSERT_NEAR(1e-4, 0.8 * free_Wb, settled_Wb(300));
    full_pu = 0.9f;
    ASSERT_NEAR(1e-4, 0.5 * free_Wb, settled_Wb(300));
    full_pu = 0.0f;
    (void)settled_Wb(625);
    ASSERT_NEAR(1e-3, 0.5 * exp(-1.0), st.full_pu);
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        st.full_pu = not_finite(k);
        step(200.0f, 283.0f, 716.0f, 0.0f);
        TEST_ASSERT_TRUE(st.full_pu <= 0.5f);
    }
    ASSERT_NEAR(1e-3, free_Wb, settled_Wb(6000));
}

/* Near zero speed the division has a floor: half the speed at which weakening could begin. */
static void test_floor_of_the_frequency(void)
{
    st.weakened_Wb = 0.4f;
    step(0.0f, 283.0f, 0.0f, 100.0f);
    const double u_max = 0.9 / sqrt(2.0) * 283.0;
    const double less = 20.0 * 0.0032 * u_max / (0.5 * u_max / 0.52);
    ASSERT_NEAR(1e-6, 0.4 - less, st.weakened_Wb);
}

static void test_a_number_that_is_none_changes_nothing(void)
{
    step(220.0f, 283.0f, 500.0f, 100.0f);
    const float before_Wb = st.weakened_Wb;
    TEST_ASSERT_TRUE(before_Wb > 0.0f);
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        step(not_finite(k), 283.0f, 500.0f, 100.0f);
        step(220.0f, NAN, 500.0f, 100.0f);
        ASSERT_SAME_FLOAT(before_Wb, st.weakened_Wb);
    }
    st = (flux_reference_state_t){.weakened_Wb = 0.42f};
    step(0.9f * NUM_SQRT_1_2 * 283.0f, 283.0f, 700.0f, 100.0f);
    const float asked_A = st.i_q_reduction_A;
    TEST_ASSERT_TRUE(asked_A > 0.0f);
    lambda_hat_Wb = NAN;
    st = (flux_reference_state_t){.weakened_Wb = 0.42f};
    step(0.9f * NUM_SQRT_1_2 * 283.0f, 283.0f, 700.0f, 100.0f);
    ASSERT_SAME_FLOAT(asked_A, st.i_q_reduction_A);
    st = (flux_reference_state_t){.weakened_Wb = before_Wb};
    lambda_hat_Wb = 0.0f;
    step(220.0f, 283.0f, 500.0f, 0.0f);
    const float economy_Wb = st.economy_Wb;
    TEST_ASSERT_TRUE(economy_Wb > 0.0f);
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        step(220.0f, 283.0f, 500.0f, not_finite(k));
        step(220.0f, 283.0f, not_finite(k), 0.0f);
        ASSERT_SAME_FLOAT(economy_Wb, st.economy_Wb);
    }
}

/* A parameter may be changed while it acts. */
static void test_what_is_switched_off_gives_its_flux_back(void)
{
    st = (flux_reference_state_t){.weakened_Wb = 0.1f, .economy_Wb = 0.2f};
    flux_reference_params_t p = good;
    p.economy_min_pu = 0.0f;
    TEST_ASSERT_TRUE(flux_reference_init(&cfg, &p, &table1, TURN_S));
    step(0.9f * NUM_SQRT_1_2 * 283.0f, 283.0f, 400.0f, 0.0f);
    ASSERT_SAME_FLOAT(0.0f, st.economy_Wb);
    ASSERT_NEAR(1e-4, 0.1, st.reduction_Wb);
    p = good;
    p.voltage_share = 0.0f;
    TEST_ASSERT_TRUE(flux_reference_init(&cfg, &p, &table1, TURN_S));
    step(300.0f, 283.0f, 400.0f, 100.0f);
    ASSERT_SAME_FLOAT(0.0f, st.reduction_Wb);
    st = (flux_reference_state_t){.weakened_Wb = 0.4f, .economy_Wb = 0.2f, .i_q_reduction_A = 2.0f};
    p.economy_min_pu = 0.0f;
    TEST_ASSERT_TRUE(flux_reference_init(&cfg, &p, &table1, TURN_S));
    step(300.0f, 283.0f, 400.0f, 100.0f);
    ASSERT_SAME_FLOAT(0.0f, st.reduction_Wb);
    ASSERT_SAME_FLOAT(0.0f, st.i_q_reduction_A);
}

/* Slip below pull-out: sigma Ls i_q <= share Ls i_d. Takes nothing while i_q_max is lower. */
static void test_torque_current_keeps_away_from_pull_out(void)
{
    st.weakened_Wb = 0.42f;
    step(0.9f * NUM_SQRT_1_2 * 283.0f, 283.0f, 1500.0f, 100.0f);
    const double i_q = 0.8 * 0.110 / 0.008 * (0.10 / 0.102);
    ASSERT_NEAR(0.05, 15.0 - i_q, st.i_q_reduction_A);
    /* The flux that is there: less than is asked for changes nothing, more takes more current, up
     * to half of what 180 V allow at 700 rad/s. */
    const double of_Wb[][2] = {{0.099, 0.10}, {0.12, 0.12}, {0.2, 180.1 / 1400.0}};
    for (int k = 0; k < 3; k++) {
        st.weakened_Wb = 0.42f;
        lambda_hat_Wb = (float)of_Wb[k][0];
        step(0.9f * NUM_SQRT_1_2 * 283.0f, 283.0f, 700.0f, 100.0f);
        ASSERT_NEAR(0.06, 15.0 - i_q * of_Wb[k][1] / 0.10, st.i_q_reduction_A);
    }
    lambda_hat_Wb = 0.0f;
    st.weakened_Wb = 0.30f;
    step(0.9f * NUM_SQRT_1_2 * 283.0f, 283.0f, 900.0f, 100.0f);
    ASSERT_SAME_FLOAT(0.0f, st.i_q_reduction_A);
}

/* Least copper loss of a torque, found by search over the flux. */
static void test_economy_is_the_least_copper_loss(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        const motor_t *motor = &reference_machine[m];
        const double kr = (double)motor->M_H / (double)motor->Lr_H;
        const double pairs = (double)motor->pole_pairs;
        flux_reference_params_t p = good;
        p.lambda_nominal_Wb = 2.0f;
        p.economy_min_pu = 0.05f;
        p.voltage_share = 0.0f;
        TEST_ASSERT_TRUE(flux_reference_init(&cfg, &p, &model, TURN_S));
        TEST_ASSERT_TRUE(flux_reference_on(&cfg));
        st = (flux_reference_state_t){0};
        for (int k = 0; k < 5000; k++) {
            step(0.0f, 283.0f, 200.0f, -3.0f);
        }
        double best_Wb = 0.0, least = INFINITY;
        for (double lambda = 0.1; lambda < 2.0; lambda += 1e-4) {
            const double d = lambda / (double)motor->M_H, q = 3.0 / (pairs * kr * lambda);
            const double loss =
                (double)motor->Rs_ohm * (d * d + q * q) + kr * kr * (double)motor->Rr_ohm * q * q;
            if (loss < least) {
                least = loss;
                best_Wb = lambda;
            }
        }
        ASSERT_NEAR(1e-3, best_Wb, 2.0 - (double)st.reduction_Wb);
    }
}

static void test_economy_is_slow_down_quick_up_and_bounded(void)
{
    step(0.0f, 283.0f, 200.0f, 0.0f);
    const double gain = 0.0032 / 0.5032;
    ASSERT_NEAR(1e-6, gain * 0.7 * 0.52, st.economy_Wb);
    for (int k = 0; k < 5000; k++) {
        step(0.0f, 283.0f, 200.0f, 0.0f);
    }
    ASSERT_NEAR(1e-5, 0.7 * 0.52, st.economy_Wb);
    step(0.0f, 283.0f, 200.0f, 100.0f);
    ASSERT_NEAR(1e-5, 0.7 * 0.52 - 0.4 * 0.0032, st.economy_Wb);
    /* Near zero frequency nominal flux, whatever the torque: steering's domain. */
    for (int k = 0; k < 5000; k++) {
        step(0.0f, 283.0f, 29.0f, 0.0f);
    }
    ASSERT_NEAR(1e-6, 0.0, st.economy_Wb);
    /* A tenth of nominal may be noise: as slow as downward. */
    st.economy_Wb = 0.09f * 0.52f;
    step(0.0f, 283.0f, 200.0f, 100.0f);
    ASSERT_NEAR(1e-6, (1.0 - gain) * 0.09 * 0.52, st.economy_Wb);
    st.economy_Wb = 0.11f * 0.52f;
    step(0.0f, 283.0f, 200.0f, 100.0f);
    ASSERT_NEAR(1e-6, 0.11 * 0.52 - 0.4 * 0.0032, st.economy_Wb);
}

static void test_the_lower_flux_counts(void)
{
    st = (flux_reference_state_t){.weakened_Wb = 0.1f, .economy_Wb = 0.2f};
    step(0.9f * NUM_SQRT_1_2 * 283.0f, 283.0f, 400.0f, 0.0f);
    ASSERT_SAME_FLOAT(st.economy_Wb, st.reduction_Wb);
    TEST_ASSERT_TRUE(st.economy_Wb > 0.2f);
    st.weakened_Wb = 0.4f;
    step(0.9f * NUM_SQRT_1_2 * 283.0f, 283.0f, 400.0f, 0.0f);
    ASSERT_NEAR(1e-4, 0.4, st.reduction_Wb);
}

/* Beside a lower flux of economy the voltage controller stays where the voltage would end: at half
 * the flux it allows, half the voltage is its limit. */
static void test_weakening_waits_for_the_flux_that_economy_gives_back(void)
{
    st = (flux_reference_state_t){.weakened_Wb = 0.22f, .economy_Wb = 0.37f}; /* .3 and .15 Wb */
    const float u_max_V = 0.9f * NUM_SQRT_1_2 * 283.0f;
    step(0.5f * u_max_V, 283.0f, 600.0f, 0.0f);
    ASSERT_NEAR(1e-3, 0.22, st.weakened_Wb);
    for (int k = 0; k < 1000; k++) {
        step(600.0f * (0.52f - st.reduction_Wb), 283.0f, 600.0f, 0.0f);
    }
    ASSERT_NEAR(2e-3, (double)u_max_V / 600.0, 0.52 - (double)st.weakened_Wb);
    ASSERT_NEAR(1e-3, 0.7 * 0.52, st.reduction_Wb);
}

static void test_start_at_speed_is_weakened_at_once(void)
{
    flux_reference_start(&cfg, &st, -700.0f, 283.0f);
    ASSERT_NEAR(1e-5, 0.52 - 0.9 / sqrt(2.0) * 283.0 / 700.0, st.reduction_Wb);
    flux_reference_start(&cfg, &st, 0.0f, 283.0f);
    ASSERT_SAME_FLOAT(0.0f, st.reduction_Wb);
    flux_reference_params_t economy = good;
    economy.voltage_share = 0.0f;
    TEST_ASSERT_TRUE(flux_reference_init(&cfg, &economy, &table1, TURN_S));
    flux_reference_start(&cfg, &st, 700.0f, 283.0f);
    ASSERT_SAME_FLOAT(0.0f, st.reduction_Wb);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_derives_the_coefficients_of_both_machines);
    RUN_TEST(test_both_off_takes_anything_and_does_nothing);
    RUN_TEST(test_init_refuses_each_bad_number);
    RUN_TEST(test_weakening_settles_with_the_voltage_at_its_share);
    RUN_TEST(test_one_step_of_the_voltage_controller_by_hand);
    RUN_TEST(test_a_full_link_takes_flux_at_once_and_gives_it_back_within_seconds);
    RUN_TEST(test_floor_of_the_frequency);
    RUN_TEST(test_a_number_that_is_none_changes_nothing);
    RUN_TEST(test_what_is_switched_off_gives_its_flux_back);
    RUN_TEST(test_torque_current_keeps_away_from_pull_out);
    RUN_TEST(test_economy_is_the_least_copper_loss);
    RUN_TEST(test_economy_is_slow_down_quick_up_and_bounded);
    RUN_TEST(test_the_lower_flux_counts);
    RUN_TEST(test_weakening_waits_for_the_flux_that_economy_gives_back);
    RUN_TEST(test_start_at_speed_is_weakened_at_once);
    return UNITY_END();
}
