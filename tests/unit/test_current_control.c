#include "current_control.h"

#include <complex.h>
#include <math.h>

#include "exact.h"
#include "reference_machine.h"
#include "unity.h"

#define PERIOD_S 0.0002f

static const current_control_params_t good = {
    .bandwidth_rad_s = 400.0f, .ki_factor = 0.3f, .decoupling = 0.8f, .u_max_V = 200.0f};

/* Coefficients of short binary fractions: expected results are exact. */
static const current_control_config_t simple = {
    .pi = {.kp = 4.0f, .ki_T = 0.25f, .tracking = 0.125f, .x_max = 200.0f},
    .sigma_Ls_H = 0.0078125f,
    .kr = 0.75f,
    .decoupling = 0.5f};

static const current_control_in_t operating_point = {.i_ref_A = {5.0f, 7.0f},
                                                     .i_A = {4.75f, 7.5f},
                                                     .omega_s_rad_s = 128.0f,
                                                     .omega_e_rad_s = 112.0f,
                                                     .lambda_Wb = 0.5f};

void setUp(void)
{
}

void tearDown(void)
{
}

static double complex complex_of(dq_t x)
{
    return (double)x.d + I * (double)x.q;
}

static void test_init_derives_the_gains_of_both_machines(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        const reference_model_t exact = reference_model(&reference_machine[m], 0.0);
        const double kp = 400.0 * exact.sigma_Ls;
        current_control_config_t cfg = {0};

        TEST_ASSERT_TRUE(current_control_init(&cfg, &good, &model, PERIOD_S));
        /* sigma Ls is a small difference of large numbers: 1e-5 of it is lost in float. */
        ASSERT_NEAR(2e-5 * kp, kp, cfg.pi.kp);
        ASSERT_NEAR(2e-5 * kp, 0.3 * 400.0 * kp * 2e-4, cfg.pi.ki_T);
        ASSERT_NEAR(1e-8, 0.3 * 400.0 * 2e-4, cfg.pi.tracking);
        ASSERT_SAME_FLOAT(200.0f, cfg.pi.x_max);
        ASSERT_SAME_FLOAT(model.sigma_Ls_H, cfg.sigma_Ls_H);
        ASSERT_SAME_FLOAT(model.kr, cfg.kr);
        ASSERT_SAME_FLOAT(0.8f, cfg.decoupling);
    }
}

#define ASSERT_REFUSED(field, value)                                                               \
    do {                                                                                           \
        current_control_params_t bad = good;                                                       \
        bad.field = (value);                                                                       \
        TEST_ASSERT_FALSE_MESSAGE(current_control_init(&untouched, &bad, &model, PERIOD_S),        \
                                  #field);                                                         \
    } while (0)

static void test_init_refuses_every_bad_number_and_leaves_the_config(void)
{
    const motor_model_t model = reference_derived(0);
    current_control_config_t untouched = {.kr = 77.0f};

    for (int i = 0; i < NOT_POSITIVE_COUNT; i++) {
        motor_model_t bad_motor = model;
        const float x = not_positive(i);
        ASSERT_REFUSED(bandwidth_rad_s, x);
        ASSERT_REFUSED(u_max_V, x);
        TEST_ASSERT_FALSE(current_control_init(&untouched, &good, &model, x));
        bad_motor.sigma_Ls_H = x;
        TEST_ASSERT_FALSE(current_control_init(&untouched, &good, &bad_motor, PERIOD_S));
        bad_motor = model;
        bad_motor.kr = x;
        TEST_ASSERT_FALSE(current_control_init(&untouched, &good, &bad_motor, PERIOD_S));
    }
    for (int i = 0; i < NOT_FINITE_COUNT; i++) {
        ASSERT_REFUSED(ki_factor, not_finite(i));
        ASSERT_REFUSED(decoupling, not_finite(i));
    }
    ASSERT_REFUSED(ki_factor, -0.1f);
    ASSERT_REFUSED(decoupling, -0.01f);
    ASSERT_REFUSED(decoupling, 1.01f);
    ASSERT_SAME_FLOAT(77.0f, untouched.kr);
}

static void test_init_refuses_wrong_signs_that_cancel(void)
{
    current_control_config_t cfg = {0};
    current_control_params_t bad = good;
    motor_model_t motor = reference_derived(0);
    motor.sigma_Ls_H = -motor.sigma_Ls_H;
    bad.bandwidth_rad_s = -400.0f;
    bad.ki_factor = 0.0f;
    TEST_ASSERT_FALSE(current_control_init(&cfg, &bad, &motor, PERIOD_S));
}

static void test_init_refuses_a_bandwidth_that_the_delay_makes_unstable(void)
{
    const motor_model_t model = reference_derived(0);
    current_control_config_t cfg = {0};
    current_control_params_t p = good;
    p.bandwidth_rad_s = 1024.0f;
    TEST_ASSERT_FALSE(current_control_init(&cfg, &p, &model, 1.0f / 1024.0f));
    p.bandwidth_rad_s = 1023.0f;
    TEST_ASSERT_TRUE(current_control_init(&cfg, &p, &model, 1.0f / 1024.0f));
}

static void test_init_accepts_no_and_full_decoupling_and_no_integral_action(void)
{
    const motor_model_t model = reference_derived(1);
    current_control_config_t cfg = {0};
    current_control_params_t p = good;
    p.ki_factor = 0.0f;
    p.decoupling = 0.0f;
    TEST_ASSERT_TRUE(current_control_init(&cfg, &p, &model, PERIOD_S));
    p.decoupling = 1.0f;
    TEST_ASSERT_TRUE(current_control_init(&cfg, &p, &model, PERIOD_S));
}

static void test_output_is_the_sum_of_its_parts(void)
{
    const current_control_state_t st = {.d = {.x = 3.0f}, .q = {.x = 11.0f}};
    const dq_t u_V = current_control_output(&simple, &st, &operating_point);
    /* Half of: w_s sigmaLs = 1 ohm, kr w_e lambda = 42 V. */
    ASSERT_SAME_FLOAT(1.0f + 3.0f - 0.5f * 7.5f, u_V.d);
    ASSERT_SAME_FLOAT(-2.0f + 11.0f + 0.5f * (4.75f + 42.0f), u_V.q);
}

static void test_output_agrees_with_double_complex_arithmetic_on_both_machines(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        const reference_model_t exact = reference_model(&reference_machine[m], 0.0);
        const double kr = (double)reference_machine[m].M_H / (double)reference_machine[m].Lr_H;
        const current_control_state_t st = {.d = {.x = 6.1f}, .q = {.x = -4.3f}};
        const current_control_in_t in = {.i_ref_A = {5.0f, -7.0f},
                                         .i_A = {4.6f, -6.5f},
                                         .omega_s_rad_s = 117.0f,
                                         .omega_e_rad_s = 125.0f,
                                         .lambda_Wb = 0.47f};
        current_control_config_t cfg;
        TEST_ASSERT_TRUE(current_control_init(&cfg, &good, &model, PERIOD_S));

        const double complex i_A = 4.6 - 6.5 * I;
        const double complex u_V = 400.0 * exact.sigma_Ls * ((5.0 - 7.0 * I) - i_A) +
                                   (6.1 - 4.3 * I) +
                                   0.8 * I * (117.0 * exact.sigma_Ls * i_A + kr * 125.0 * 0.47);
        const dq_t got_V = current_control_output(&cfg, &st, &in);
        /* 1e-5 of the 6 V on the leakage, roundings of 60 V. */
        ASSERT_NEAR(1e-4, creal(u_V), got_V.d);
        ASSERT_NEAR(1e-4, cimag(u_V), got_V.q);
    }
}

static void test_turning_currents_and_integrators_turns_the_voltage(void)
{
    /* Without the rotor's EMF the controller does not know d from q: u(j x) = j u(x). */
    current_control_in_t in = operating_point;
    in.lambda_Wb = 0.0f;
    const current_control_state_t st = {.d = {.x = 3.0f}, .q = {.x = 11.0f}};
    const current_control_state_t turned_st = {.d = {.x = -11.0f}, .q = {.x = 3.0f}};
    current_control_in_t turned = in;
    turned.i_A = (dq_t){-in.i_A.q, in.i_A.d};
    turned.i_ref_A = (dq_t){-in.i_ref_A.q, in.i_ref_A.d};
    const dq_t u_V = current_control_output(&simple, &st, &in);
    const dq_t turned_V = current_control_output(&simple, &turned_st, &turned);
    ASSERT_SAME_FLOAT(-u_V.q, turned_V.d);
    ASSERT_SAME_FLOAT(u_V.d, turned_V.q);
}

static void test_the_mirrored_machine_gets_the_mirrored_voltage(void)
{
    /* q axis, speeds and q integrator reversed: u_q reverses, u_d stays. */
    const current_control_state_t st = {.d = {.x = 3.0f}, .q = {.x = 11.0f}};
    const current_control_state_t mirrored_st = {.d = {.x = 3.0f}, .q = {.x = -11.0f}};
    current_control_in_t mirrored = operating_point;
    mirrored.i_A.q = -mirrored.i_A.q;
    mirrored.i_ref_A.q = -mirrored.i_ref_A.q;
    mirrored.omega_s_rad_s = -mirrored.omega_s_rad_s;
    mirrored.omega_e_rad_s = -mirrored.omega_e_rad_s;
    const dq_t u_V = current_control_output(&simple, &st, &operating_point);
    const dq_t mirrored_V = current_control_output(&simple, &mirrored_st, &mirrored);
    ASSERT_SAME_FLOAT(u_V.d, mirrored_V.d);
    ASSERT_SAME_FLOAT(-u_V.q, mirrored_V.q);
}

static void test_update_holds_at_the_reference(void)
{
    current_control_in_t in = operating_point;
    in.i_A = in.i_ref_A;
    current_control_state_t st = {.d = {.x = 3.0f}, .q = {.x = 11.0f}};
    current_control_update(&simple, &st, &in, NULL);
    ASSERT_SAME_FLOAT(3.0f, st.d.x);
    ASSERT_SAME_FLOAT(11.0f, st.q.x);
}

static void test_update_integrates_error_and_lost_voltage_of_each_axis(void)
{
    current_control_state_t st = {.d = {.x = 3.0f}, .q = {.x = 11.0f}};
    current_control_update(&simple, &st, &operating_point, &(dq_t){-8.0f, 4.0f});
    ASSERT_SAME_FLOAT(3.0f + 0.25f * 0.25f - 0.125f * 8.0f, st.d.x);
    ASSERT_SAME_FLOAT(11.0f - 0.25f * 0.5f + 0.125f * 4.0f, st.q.x);
}

static void test_update_keeps_the_integrators_inside_their_bound(void)
{
    current_control_state_t st = {.d = {.x = 199.0f}, .q = {.x = -199.0f}};
    current_control_in_t in = operating_point;
    in.i_ref_A = (dq_t){1000.0f, -1000.0f};
    current_control_update(&simple, &st, &in, NULL);
    ASSERT_SAME_FLOAT(200.0f, st.d.x);
    ASSERT_SAME_FLOAT(-200.0f, st.q.x);
}

static void test_update_keeps_no_nan_and_no_infinity(void)
{
    for (int i = 0; i < NOT_FINITE_COUNT; i++) {
        const float x = not_finite(i);
        current_control_state_t st = {.d = {.x = 3.0f}, .q = {.x = 11.0f}};
        current_control_in_t in = operating_point;
        in.i_A = (dq_t){x, x};
        const dq_t u_V = current_control_output(&simple, &st, &in);
        current_control_update(&simple, &st, &in, &(dq_t){-u_V.d, -u_V.q});
        TEST_ASSERT_TRUE((fabsf(st.d.x) <= 200.0f) && (fabsf(st.q.x) <= 200.0f));
        in.i_A = in.i_ref_A;
        current_control_update(&simple, &st, &in, &(dq_t){x, x});
        TEST_ASSERT_TRUE((fabsf(st.d.x) <= 200.0f) && (fabsf(st.q.x) <= 200.0f));
    }
}

typedef struct {
    double complex i_A;
    double cross_A;     /* largest deviation of i_d while i_q moves */
    double overshoot_A; /* of i_q */
    double u_V;         /* length of the last voltage */
} loop_t;

/* The machine at constant flux and speed, sampled currents, duty one period later: i_q* steps from
 * 0 to 6 A. sigmaLs di/dt = u - (Rs + kr M tau) i - j w_s sigmaLs i + kr (tau - j w) lambda. */
static loop_t closed_loop(int machine, const current_control_config_t *cfg, double u_max_V,
                          int periods)
{
    const motor_t *motor = &reference_machine[machine];
    const double omega_rad_s = 150.0, lambda_Wb = 0.5;
    const reference_model_t exact = reference_model(motor, omega_rad_s);
    const double M_H = (double)motor->M_H;
    const double i_d_A = lambda_Wb / M_H;
    const double slip_rad_s = exact.tau * M_H * 6.0 / lambda_Wb;
    const double omega_s_rad_s = omega_rad_s + slip_rad_s;
    const double complex a = exact.a11 - I * omega_s_rad_s;
    const double complex settled_V =
        -(a * i_d_A + exact.a12 * lambda_Wb) / exact.b; /* holds i_d at i_q = 0 */
    const int substeps = 50;
    const double dt_s = (double)PERIOD_S / substeps;
    loop_t r = {.i_A = i_d_A};
    current_control_in_t in = {.i_ref_A = {(float)i_d_A, 6.0f},
                               .omega_s_rad_s = (float)omega_s_rad_s,
                               .omega_e_rad_s = (float)omega_rad_s,
                               .lambda_Wb = (float)lambda_Wb};
    current_control_state_t st = {0};
    double complex acting_V = settled_V;

    /* The integrators start where they hold i_q = 0. */
    in.i_A = (dq_t){(float)i_d_A, 0.0f};
    in.i_ref_A.q = 0.0f;
    const double complex rest_V = settled_V - complex_of(current_control_output(cfg, &st, &in));
    st = (current_control_state_t){.d = {.x = (float)creal(rest_V)},
                                   .q = {.x = (float)cimag(rest_V)}};
    in.i_ref_A.q = 6.0f;

    for (int k = 0; k < periods; k++) {
        in.i_A = (dq_t){(float)creal(r.i_A), (float)cimag(r.i_A)};
        const dq_t asked_V = current_control_output(cfg, &st, &in);
        const double length_V = cabs(complex_of(asked_V));
        const float scale = (float)fmin(1.0, u_max_V / length_V);
        const dq_t realised_V = {scale * asked_V.d, scale * asked_V.q};
        const dq_t added_V = {realised_V.d - asked_V.d, realised_V.q - asked_V.q};
        current_control_update(cfg, &st, &in, &added_V);
        for (int s = 0; s < substeps; s++) {
            r.i_A += dt_s * (a * r.i_A + exact.a12 * lambda_Wb + exact.b * acting_V);
        }
        acting_V = complex_of(realised_V);
        r.u_V = cabs(acting_V);
        r.cross_A = fmax(r.cross_A, fabs(creal(r.i_A) - i_d_A));
        r.overshoot_A = fmax(r.overshoot_A, cimag(r.i_A) - 6.0);
    }
    return r;
}

static void test_the_current_follows_with_the_bandwidth_on_both_machines(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        current_control_params_t p = good;
        current_control_config_t cfg;
        p.decoupling = 1.0f;
        /* Ki/Kp on the pole of the windings: what is left is bw/s and the delay. */
        p.ki_factor = model.a11_per_s / p.bandwidth_rad_s;
        TEST_ASSERT_TRUE(current_control_init(&cfg, &p, &model, PERIOD_S));

        double before_pu = 0.0;
        double now_pu = 0.0; /* i[k+1] = i[k] + bw T (1 - i[k-1]) */
        for (int k = 1; k <= 40; k++) {
            const double next_pu = now_pu + 0.08 * (1.0 - before_pu);
            before_pu = now_pu;
            now_pu = (k == 1) ? 0.0 : next_pu; /* the first period still has the old duty */
            /* The resistance acts within a period, the integrator from one to the next: 2 %. */
            ASSERT_NEAR(0.02 * 6.0, now_pu * 6.0, cimag(closed_loop(m, &cfg, 1e9, k).i_A));
        }
        const loop_t end = closed_loop(m, &cfg, 1e9, 2000);
        ASSERT_NEAR(0.001, 6.0, cimag(end.i_A));
        TEST_ASSERT_TRUE(end.overshoot_A < 0.01 * 6.0);
    }
}

static void test_decoupling_keeps_the_other_axis_still(void)
{
    current_control_params_t p = good;
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        current_control_config_t with;
        current_control_config_t without;
        p.decoupling = 1.0f;
        TEST_ASSERT_TRUE(current_control_init(&with, &p, &model, PERIOD_S));
        p.decoupling = 0.0f;
        TEST_ASSERT_TRUE(current_control_init(&without, &p, &model, PERIOD_S));
        const double with_A = closed_loop(m, &with, 1e9, 500).cross_A;
        const double without_A = closed_loop(m, &without, 1e9, 500).cross_A;
        TEST_ASSERT_TRUE(with_A < 0.25 * without_A);
    }
}

static void test_a_limited_voltage_winds_nothing_up(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        current_control_params_t p = good;
        current_control_config_t told;
        p.decoupling = 1.0f;
        p.ki_factor = model.a11_per_s / p.bandwidth_rad_s;
        TEST_ASSERT_TRUE(current_control_init(&told, &p, &model, PERIOD_S));
        current_control_config_t untold = told;
        untold.pi.tracking = 0.0f;
        /* 2 % above what 6 A need: the step is limited for most of its time. */
        const double u_max_V = 1.02 * closed_loop(m, &told, 1e9, 2000).u_V;
        const loop_t a = closed_loop(m, &told, u_max_V, 2000);
        const loop_t b = closed_loop(m, &untold, u_max_V, 2000);
        ASSERT_NEAR(0.001, 6.0, cimag(a.i_A));
        TEST_ASSERT_TRUE(a.overshoot_A < 0.001 * 6.0);
        TEST_ASSERT_TRUE(b.overshoot_A > 10.0 * a.overshoot_A);
    }
}

static void test_mirrored_the_voltage_along_d_is_reversed(void)
{
    current_control_state_t st = {.d = {.x = 7.0f}, .q = {.x = -3.0f}};
    current_control_mirror(&st);
    ASSERT_SAME_FLOAT(-7.0f, st.d.x);
    ASSERT_SAME_FLOAT(-3.0f, st.q.x);
}

static void test_two_controllers_share_a_config_and_nothing_else(void)
{
    current_control_state_t a = {0};
    current_control_state_t b = {0};
    const dq_t none_V = {0.0f, 0.0f};
    current_control_update(&simple, &a, &operating_point, &none_V);
    ASSERT_SAME_FLOAT(0.0f, b.d.x);
    current_control_update(&simple, &b, &operating_point, NULL);
    TEST_ASSERT_EQUAL_MEMORY(&a, &b, sizeof a);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_derives_the_gains_of_both_machines);
    RUN_TEST(test_init_refuses_every_bad_number_and_leaves_the_config);
    RUN_TEST(test_init_refuses_wrong_signs_that_cancel);
    RUN_TEST(test_init_refuses_a_bandwidth_that_the_delay_makes_unstable);
    RUN_TEST(test_init_accepts_no_and_full_decoupling_and_no_integral_action);
    RUN_TEST(test_output_is_the_sum_of_its_parts);
    RUN_TEST(test_output_agrees_with_double_complex_arithmetic_on_both_machines);
    RUN_TEST(test_turning_currents_and_integrators_turns_the_voltage);
    RUN_TEST(test_the_mirrored_machine_gets_the_mirrored_voltage);
    RUN_TEST(test_update_holds_at_the_reference);
    RUN_TEST(test_update_integrates_error_and_lost_voltage_of_each_axis);
    RUN_TEST(test_update_keeps_the_integrators_inside_their_bound);
    RUN_TEST(test_update_keeps_no_nan_and_no_infinity);
    RUN_TEST(test_the_current_follows_with_the_bandwidth_on_both_machines);
    RUN_TEST(test_decoupling_keeps_the_other_axis_still);
    RUN_TEST(test_a_limited_voltage_winds_nothing_up);
    RUN_TEST(test_mirrored_the_voltage_along_d_is_reversed);
    RUN_TEST(test_two_controllers_share_a_config_and_nothing_else);
    return UNITY_END();
}
