#include "observer.h"

#include "exact.h"
#include "reference_machine.h"

#define PERIOD_S      2e-4f
#define I_MAX_A       60.0f
#define LAMBDA_MAX_WB 3.0f
#define METHODS       2

static const observer_method_t method[METHODS] = {OBSERVER_EULER, OBSERVER_SECOND_ORDER};
static const observer_gain_t no_gain = {0.0f, 0.0f, 0.0f, 0.0f};
static const observer_gain_t some_gain = {-720.0f, 35.0f, -3.2f, 1.7f};

void setUp(void)
{
}

void tearDown(void)
{
}

static double complex complex_of(ab_t x)
{
    return (double)x.alpha + I * (double)x.beta;
}

static ab_t ab_of(double complex x)
{
    return (ab_t){(float)creal(x), (float)cimag(x)};
}

static void assert_ab(double tolerance, double complex expected, ab_t actual)
{
    ASSERT_NEAR(tolerance, creal(expected), actual.alpha);
    ASSERT_NEAR(tolerance, cimag(expected), actual.beta);
}

static void assert_same_ab(ab_t expected, ab_t actual)
{
    ASSERT_SAME_FLOAT(expected.alpha, actual.alpha);
    ASSERT_SAME_FLOAT(expected.beta, actual.beta);
}

static observer_config_t config(int machine, observer_method_t m)
{
    observer_config_t cfg = {0};
    const motor_model_t motor = reference_derived(machine);
    const observer_params_t params = {I_MAX_A, LAMBDA_MAX_WB, m};
    TEST_ASSERT_TRUE(observer_init(&cfg, &params, &motor, PERIOD_S));
    return cfg;
}

/* Eq. (3) with its two rows. */
typedef struct {
    double complex i;
    double complex lambda;
} truth_t;

static truth_t times_a(const reference_model_t *m, truth_t x)
{
    return (truth_t){m->a11 * x.i + m->a12 * x.lambda, m->a21 * x.i + m->a22 * x.lambda};
}

static truth_t plus(truth_t x, double k, truth_t y)
{
    return (truth_t){x.i + k * y.i, x.lambda + k * y.lambda};
}

/* x over one interval with a constant voltage: Taylor series of the exact solution, terms 1..order,
 * and T L e1 beside it. */
static truth_t advanced(int machine, const observer_state_t *st, const observer_in_t *in, int order)
{
    const double T = (double)PERIOD_S;
    const reference_model_t m =
        reference_model(&reference_machine[machine], (double)in->omega_e_hat_rad_s);
    truth_t x = {complex_of(st->i_s_hat_A), complex_of(st->lambda_r_hat_Wb)};
    truth_t term = times_a(&m, x);
    term.i += m.b * complex_of(in->u_s_V);
    double weight = T;
    for (int n = 1; n <= order; n++) {
        x = plus(x, weight, term);
        term = times_a(&m, term);
        weight *= T / (n + 1);
    }
    const double complex e1 = complex_of(st->e1_A);
    x.i += T * ((double)in->gain.l1_re_per_s + I * (double)in->gain.l1_im_per_s) * e1;
    x.lambda += T * ((double)in->gain.l2_re_ohm + I * (double)in->gain.l2_im_ohm) * e1;
    return x;
}

static observer_state_t random_state(uint32_t *seed)
{
    return (observer_state_t){.i_s_hat_A = {15.0f * noise(seed), 15.0f * noise(seed)},
                              .lambda_r_hat_Wb = {0.7f * noise(seed), 0.7f * noise(seed)},
                              .e1_A = {4.0f * noise(seed), 4.0f * noise(seed)}};
}

static observer_in_t random_in(uint32_t *seed)
{
    return (observer_in_t){.u_s_V = {200.0f * noise(seed), 200.0f * noise(seed)},
                           .i_s_A = {15.0f * noise(seed), 15.0f * noise(seed)},
                           .omega_e_hat_rad_s = 380.0f * noise(seed),
                           .gain = {700.0f * noise(seed), 100.0f * noise(seed), 6.0f * noise(seed),
                                    3.0f * noise(seed)}};
}

/* Rounding: a few parts in 2^24 of terms of up to 25 A and 1 Wb. */
#define I_TOLERANCE_A       1e-5
#define LAMBDA_TOLERANCE_WB 3e-7

static void assert_step_is_series_of_order(observer_method_t m, int order)
{
    uint32_t seed = 11u;
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        const observer_config_t cfg = config(machine, m);
        for (int k = 0; k < 500; k++) {
            observer_state_t st = random_state(&seed);
            const observer_in_t in = random_in(&seed);
            const truth_t expected = advanced(machine, &st, &in, order);
            observer_step(&cfg, &st, &in);
            assert_ab(I_TOLERANCE_A, expected.i, st.i_s_hat_A);
            assert_ab(LAMBDA_TOLERANCE_WB, expected.lambda, st.lambda_r_hat_Wb);
            assert_ab(I_TOLERANCE_A, expected.i - complex_of(in.i_s_A), st.e1_A);
        }
    }
}

static void test_euler_step_is_eq_3_in_double_precision(void)
{
    assert_step_is_series_of_order(OBSERVER_EULER, 1);
}

static void test_second_order_step_keeps_the_gain_outside(void)
{
    assert_step_is_series_of_order(OBSERVER_SECOND_ORDER, 2);
}

static void test_zeroed_state_stays_at_rest(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        for (int m = 0; m < METHODS; m++) {
            const observer_config_t cfg = config(machine, method[m]);
            observer_state_t st = {0};
            const observer_in_t in = {.gain = some_gain, .omega_e_hat_rad_s = 100.0f};
            for (int k = 0; k < 100; k++) {
                observer_step(&cfg, &st, &in);
            }
            assert_ab(0.0, 0.0, st.i_s_hat_A);
            assert_ab(0.0, 0.0, st.lambda_r_hat_Wb);
            assert_ab(0.0, 0.0, st.e1_A);
        }
    }
}

/* At standstill i = u/Rs, lambda = M i: 1 s is five rotor time constants of drift, if any. */
static void test_step_holds_the_dc_equilibrium(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        const motor_t *motor = &reference_machine[machine];
        for (int m = 0; m < METHODS; m++) {
            const observer_config_t cfg = config(machine, method[m]);
            const double complex i = 4.0 - 2.0 * I;
            observer_state_t st = {.i_s_hat_A = ab_of(i),
                                   .lambda_r_hat_Wb = ab_of((double)motor->M_H * i)};
            const observer_in_t in = {
                .u_s_V = ab_of((double)motor->Rs_ohm * i), .i_s_A = ab_of(i), .gain = some_gain};
            for (int k = 0; k < 5000; k++) {
                observer_step(&cfg, &st, &in);
            }
            assert_ab(1e-4, i, st.i_s_hat_A);
            assert_ab(1e-5, (double)motor->M_H * i, st.lambda_r_hat_Wb);
        }
    }
}

/* With dc in the stator and the rotor turning: A x + B u = 0, a fixed point of both methods. */
static void test_step_holds_the_braking_equilibrium(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        const reference_model_t m = reference_model(&reference_machine[machine], 30.0);
        const double complex lambda = 0.4 + 0.1 * I;
        const double complex i = -m.a22 * lambda / m.a21;
        const double complex u = -(m.a11 * i + m.a12 * lambda) / m.b;
        for (int k = 0; k < METHODS; k++) {
            const observer_config_t cfg = config(machine, method[k]);
            observer_state_t st = {.i_s_hat_A = ab_of(i), .lambda_r_hat_Wb = ab_of(lambda)};
            const observer_in_t in = {
                .u_s_V = ab_of(u), .i_s_A = ab_of(i), .omega_e_hat_rad_s = 30.0f};
            observer_step(&cfg, &st, &in);
            assert_ab(2e-5, i, st.i_s_hat_A);
            assert_ab(2e-7, lambda, st.lambda_r_hat_Wb);
        }
    }
}

/* THEORY 4: Euler's bias at rated speed is what the second order is for. */
static void test_second_order_is_closer_to_the_exact_solution(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        double error[METHODS];
        for (int m = 0; m < METHODS; m++) {
            const observer_config_t cfg = config(machine, method[m]);
            observer_state_t st = {.i_s_hat_A = {5.0f, 2.0f}, .lambda_r_hat_Wb = {0.5f, -0.1f}};
            const observer_in_t in = {
                .u_s_V = {100.0f, 150.0f}, .omega_e_hat_rad_s = 370.0f, .gain = no_gain};
            const truth_t exact = advanced(machine, &st, &in, 12);
            observer_step(&cfg, &st, &in);
            error[m] = cabs(complex_of(st.lambda_r_hat_Wb) - exact.lambda);
        }
        TEST_ASSERT_TRUE(error[1] < 0.1 * error[0]);
    }
}

static void test_error_is_estimate_minus_measurement_of_the_same_sample(void)
{
    const observer_config_t cfg = config(0, OBSERVER_EULER);
    observer_state_t st = {.i_s_hat_A = {5.0f, 2.0f}};
    observer_in_t in = {.i_s_A = {1.0f, -3.0f}};
    observer_step(&cfg, &st, &in);
    ASSERT_SAME_FLOAT(st.i_s_hat_A.alpha - 1.0f, st.e1_A.alpha);
    ASSERT_SAME_FLOAT(st.i_s_hat_A.beta + 3.0f, st.e1_A.beta);
}

static void test_gain_acts_on_the_error_of_the_intervals_start(void)
{
    const observer_config_t cfg = config(0, OBSERVER_EULER);
    observer_state_t with_gain = {0};
    observer_state_t without = {0};
    observer_in_t in = {.i_s_A = {3.0f, 1.0f}, .gain = some_gain};
    observer_in_t plain = in;
    plain.gain = no_gain;
    observer_step(&cfg, &with_gain, &in);
    observer_step(&cfg, &without, &plain);
    assert_same_ab(without.i_s_hat_A, with_gain.i_s_hat_A);
    observer_step(&cfg, &with_gain, &in);
    observer_step(&cfg, &without, &plain);
    TEST_ASSERT_TRUE(with_gain.i_s_hat_A.alpha > without.i_s_hat_A.alpha + 0.1f);
}

/* State and input turned by an angle give the state turned by that angle. */
static void test_step_turns_with_its_inputs(void)
{
    const double complex turn = cexp(0.9 * I);
    uint32_t seed = 5u;
    for (int m = 0; m < METHODS; m++) {
        const observer_config_t cfg = config(1, method[m]);
        observer_state_t st = random_state(&seed);
        observer_in_t in = random_in(&seed);
        observer_state_t turned = {ab_of(turn * complex_of(st.i_s_hat_A)),
                                   ab_of(turn * complex_of(st.lambda_r_hat_Wb)),
                                   ab_of(turn * complex_of(st.e1_A))};
        observer_in_t in_turned = in;
        in_turned.u_s_V = ab_of(turn * complex_of(in.u_s_V));
        in_turned.i_s_A = ab_of(turn * complex_of(in.i_s_A));
        observer_step(&cfg, &st, &in);
        observer_step(&cfg, &turned, &in_turned);
        assert_ab(2e-5, turn * complex_of(st.i_s_hat_A), turned.i_s_hat_A);
        assert_ab(5e-7, turn * complex_of(st.lambda_r_hat_Wb), turned.lambda_r_hat_Wb);
        assert_ab(2e-5, turn * complex_of(st.e1_A), turned.e1_A);
    }
}

/* The other sense of rotation: everything conjugate, speed negative. */
static void test_step_mirrors_bit_for_bit(void)
{
    uint32_t seed = 6u;
    for (int m = 0; m < METHODS; m++) {
        const observer_config_t cfg = config(1, method[m]);
        observer_state_t st = random_state(&seed);
        const observer_in_t in = random_in(&seed);
        observer_state_t mirror = {ab_conj(st.i_s_hat_A), ab_conj(st.lambda_r_hat_Wb),
                                   ab_conj(st.e1_A)};
        observer_in_t in_mirror = {.u_s_V = ab_conj(in.u_s_V),
                                   .i_s_A = ab_conj(in.i_s_A),
                                   .omega_e_hat_rad_s = -in.omega_e_hat_rad_s,
                                   .gain = in.gain};
        in_mirror.gain.l1_im_per_s = -in.gain.l1_im_per_s;
        in_mirror.gain.l2_im_ohm = -in.gain.l2_im_ohm;
        observer_step(&cfg, &st, &in);
        observer_step(&cfg, &mirror, &in_mirror);
        assert_same_ab(ab_conj(st.i_s_hat_A), mirror.i_s_hat_A);
        assert_same_ab(ab_conj(st.lambda_r_hat_Wb), mirror.lambda_r_hat_Wb);
        assert_same_ab(ab_conj(st.e1_A), mirror.e1_A);
    }
}

static void test_step_is_linear_in_state_and_input(void)
{
    uint32_t seed = 7u;
    for (int m = 0; m < METHODS; m++) {
        const observer_config_t cfg = config(0, method[m]);
        observer_state_t st = random_state(&seed);
        const observer_in_t in = random_in(&seed);
        observer_state_t twice = {ab_scale(st.i_s_hat_A, 2.0f), ab_scale(st.lambda_r_hat_Wb, 2.0f),
                                  ab_scale(st.e1_A, 2.0f)};
        observer_in_t in_twice = in;
        in_twice.u_s_V = ab_scale(in.u_s_V, 2.0f);
        in_twice.i_s_A = ab_scale(in.i_s_A, 2.0f);
        observer_step(&cfg, &st, &in);
        observer_step(&cfg, &twice, &in_twice);
        assert_same_ab(ab_scale(st.i_s_hat_A, 2.0f), twice.i_s_hat_A);
        assert_same_ab(ab_scale(st.lambda_r_hat_Wb, 2.0f), twice.lambda_r_hat_Wb);
        assert_same_ab(ab_scale(st.e1_A, 2.0f), twice.e1_A);
    }
}

static void assert_vector(double complex expected, ab_t actual)
{
    TEST_ASSERT_DOUBLE_WITHIN(1e-5 * cabs(expected), creal(expected), (double)actual.alpha);
    TEST_ASSERT_DOUBLE_WITHIN(1e-5 * cabs(expected), cimag(expected), (double)actual.beta);
}

/* A limit per component would be a square whose corners hold the field angle (Fig. 16 once locked
 * into one): at every angle the magnitude is the limit, and the angle stays. */
static void test_states_are_held_inside_a_circle_with_their_angle_kept(void)
{
    const observer_config_t cfg = config(0, OBSERVER_EULER);
    for (int k = 0; k < 24; k++) {
        const double complex direction = cexp(I * 0.2617993878 * k);
        /* Beyond the limit at any angle, yet no component beyond the box at most of them. */
        observer_state_t st = {.i_s_hat_A = {0.0f, 0.0f}};
        const double volts =
            1.3 * (double)I_MAX_A / ((double)cfg.period_s * (double)cfg.inv_sigma_Ls_per_H);
        observer_in_t in = {
            .u_s_V = {(float)(volts * creal(direction)), (float)(volts * cimag(direction))}};
        observer_step(&cfg, &st, &in);
        const double box = fmax(fabs(creal(direction)), fabs(cimag(direction)));
        if (1.3 * box < 1.0) {
            assert_vector((double)I_MAX_A * direction, st.i_s_hat_A);
        } else {
            TEST_ASSERT_FLOAT_WITHIN(1e-4f * I_MAX_A, I_MAX_A, sqrtf(ab_norm2(st.i_s_hat_A)));
        }
        st = (observer_state_t){0};
        st.lambda_r_hat_Wb = (ab_t){(float)(1.2 * (double)LAMBDA_MAX_WB * creal(direction)),
                                    (float)(1.2 * (double)LAMBDA_MAX_WB * cimag(direction))};
        in = (observer_in_t){0};
        observer_step(&cfg, &st, &in);
        TEST_ASSERT_FLOAT_WITHIN(1e-5f * LAMBDA_MAX_WB, LAMBDA_MAX_WB,
                                 sqrtf(ab_norm2(st.lambda_r_hat_Wb)));
        if (1.2 * box < 1.0) {
            assert_vector((double)LAMBDA_MAX_WB * direction, st.lambda_r_hat_Wb);
        }
    }
}

static void test_a_state_at_its_limit_is_left_alone(void)
{
    const observer_config_t cfg = config(0, OBSERVER_EULER);
    observer_state_t st = {0};
    const observer_in_t in = {.u_s_V = {1e6f, 0.0f}, .i_s_A = {-1e3f, 1e3f}};
    observer_step(&cfg, &st, &in);
    assert_same_ab((ab_t){I_MAX_A, 0.0f}, st.i_s_hat_A);
    assert_same_ab((ab_t){2.0f * I_MAX_A, -2.0f * I_MAX_A}, st.e1_A);
}

static void assert_bounded(const observer_state_t *st)
{
    TEST_ASSERT_TRUE(ab_finite(st->i_s_hat_A) && ab_finite(st->lambda_r_hat_Wb));
    TEST_ASSERT_TRUE(fabsf(st->i_s_hat_A.alpha) <= I_MAX_A);
    TEST_ASSERT_TRUE(fabsf(st->i_s_hat_A.beta) <= I_MAX_A);
    TEST_ASSERT_TRUE(fabsf(st->lambda_r_hat_Wb.alpha) <= LAMBDA_MAX_WB);
    TEST_ASSERT_TRUE(fabsf(st->lambda_r_hat_Wb.beta) <= LAMBDA_MAX_WB);
    TEST_ASSERT_TRUE(fabsf(st->e1_A.alpha) <= 2.0f * I_MAX_A);
    TEST_ASSERT_TRUE(fabsf(st->e1_A.beta) <= 2.0f * I_MAX_A);
}

static void test_no_input_makes_a_state_non_finite(void)
{
    for (int m = 0; m < METHODS; m++) {
        const observer_config_t cfg = config(1, method[m]);
        for (int bad = 0; bad < NOT_FINITE_COUNT; bad++) {
            observer_in_t in[9];
            for (int k = 0; k < 9; k++) {
                in[k] = (observer_in_t){.i_s_A = {1.0f, 1.0f}, .gain = some_gain};
            }
            in[0].u_s_V.alpha = not_finite(bad);
            in[1].u_s_V.beta = not_finite(bad);
            in[2].i_s_A.alpha = not_finite(bad);
            in[3].i_s_A.beta = not_finite(bad);
            in[4].omega_e_hat_rad_s = not_finite(bad);
            in[5].gain.l1_re_per_s = not_finite(bad);
            in[6].gain.l1_im_per_s = not_finite(bad);
            in[7].gain.l2_re_ohm = not_finite(bad);
            in[8].gain.l2_im_ohm = not_finite(bad);
            for (int k = 0; k < 9; k++) {
                uint32_t seed = 8u;
                observer_state_t st = random_state(&seed);
                observer_step(&cfg, &st, &in[k]);
                assert_bounded(&st);
                observer_step(&cfg, &st, &in[k]);
                assert_bounded(&st);
            }
        }
    }
}

static void test_two_observers_do_not_know_of_each_other(void)
{
    uint32_t seed = 9u;
    const observer_config_t cfg = config(0, OBSERVER_EULER);
    const observer_config_t other_cfg = config(1, OBSERVER_SECOND_ORDER);
    observer_state_t alone = random_state(&seed);
    observer_state_t beside = alone;
    observer_state_t other = random_state(&seed);
    for (int k = 0; k < 50; k++) {
        const observer_in_t in = random_in(&seed);
        const observer_in_t other_in = random_in(&seed);
        observer_step(&cfg, &alone, &in);
        observer_step(&cfg, &beside, &in);
        observer_step(&other_cfg, &other, &other_in);
    }
    TEST_ASSERT_EQUAL_MEMORY(&alone, &beside, sizeof alone);
}

static void test_tracked_resistance_is_that_of_a_warm_machine(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        motor_t warm = reference_machine[machine];
        warm.Rs_ohm *= 1.25f;
        motor_model_t warm_model;
        TEST_ASSERT_TRUE(motor_derive(&warm_model, &warm));
        const motor_model_t cold_model = reference_derived(machine);
        observer_config_t expected = config(machine, OBSERVER_EULER);
        const observer_params_t params = {I_MAX_A, LAMBDA_MAX_WB, OBSERVER_EULER};
        TEST_ASSERT_TRUE(observer_init(&expected, &params, &warm_model, PERIOD_S));
        observer_config_t actual = config(machine, OBSERVER_EULER);
        observer_set_rs(&actual, &cold_model, warm.Rs_ohm);
        TEST_ASSERT_EQUAL_MEMORY(&expected, &actual, sizeof expected);
    }
}

/* Another M: the flux decays as in a machine of that Rr/Lr, and M Rr/Lr stays. */
static void test_extra_decay_is_that_of_another_m(void)
{
    uint32_t seed = 21u;
    for (int n = 0; n < METHODS; n++) {
        const observer_config_t cfg = config(1, method[n]);
        observer_config_t other = cfg;
        other.tau_per_s += 0.5f;
        observer_state_t expected = random_state(&seed);
        observer_state_t actual = expected;
        observer_in_t in = random_in(&seed);
        observer_step(&other, &expected, &in);
        in.tau_extra_per_s = 0.5f;
        observer_step(&cfg, &actual, &in);
        TEST_ASSERT_EQUAL_MEMORY(&expected, &actual, sizeof actual);
    }
}

static void test_senseless_tracked_resistance_is_ignored(void)
{
    const motor_model_t model = reference_derived(0);
    const observer_config_t before = config(0, OBSERVER_EULER);
    observer_config_t cfg = before;
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        observer_set_rs(&cfg, &model, not_positive(k));
        TEST_ASSERT_EQUAL_MEMORY(&before, &cfg, sizeof cfg);
    }
}

static bool accepted(const motor_model_t *motor, float period_s, float i_max_A, float lambda_max_Wb)
{
    observer_config_t cfg;
    const observer_params_t params = {i_max_A, lambda_max_Wb, OBSERVER_EULER};
    return observer_init(&cfg, &params, motor, period_s);
}

static void test_init_refuses_senseless_machine_data(void)
{
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        for (int field = 0; field < 7; field++) {
            motor_model_t m = reference_derived(0);
            float *const fields[7] = {&m.Rs_ohm,    &m.M_H, &m.sigma_Ls_H, &m.eps_H,
                                      &m.tau_per_s, &m.kr,  &m.a11_per_s};
            *fields[field] = not_positive(k);
            TEST_ASSERT_FALSE(accepted(&m, PERIOD_S, I_MAX_A, LAMBDA_MAX_WB));
        }
    }
}

static void test_init_refuses_senseless_period_and_limits(void)
{
    const motor_model_t m = reference_derived(0);
    TEST_ASSERT_TRUE(accepted(&m, PERIOD_S, I_MAX_A, LAMBDA_MAX_WB));
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        TEST_ASSERT_FALSE(accepted(&m, not_positive(k), I_MAX_A, LAMBDA_MAX_WB));
        TEST_ASSERT_FALSE(accepted(&m, PERIOD_S, not_positive(k), LAMBDA_MAX_WB));
        TEST_ASSERT_FALSE(accepted(&m, PERIOD_S, I_MAX_A, not_positive(k)));
    }
}

static void test_init_refuses_a_period_in_which_the_current_decays(void)
{
    motor_model_t m = reference_derived(0);
    m.a11_per_s = 128.0f;
    const float limit_s = 0.0078125f;
    TEST_ASSERT_FALSE(accepted(&m, limit_s, I_MAX_A, LAMBDA_MAX_WB));
    TEST_ASSERT_TRUE(accepted(&m, nextafterf(limit_s, 0.0f), I_MAX_A, LAMBDA_MAX_WB));
}

static void test_init_refuses_an_unknown_method(void)
{
    const motor_model_t m = reference_derived(0);
    observer_config_t cfg;
    const observer_params_t params = {I_MAX_A, LAMBDA_MAX_WB, (observer_method_t)2};
    TEST_ASSERT_FALSE(observer_init(&cfg, &params, &m, PERIOD_S));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_euler_step_is_eq_3_in_double_precision);
    RUN_TEST(test_second_order_step_keeps_the_gain_outside);
    RUN_TEST(test_zeroed_state_stays_at_rest);
    RUN_TEST(test_step_holds_the_dc_equilibrium);
    RUN_TEST(test_step_holds_the_braking_equilibrium);
    RUN_TEST(test_second_order_is_closer_to_the_exact_solution);
    RUN_TEST(test_error_is_estimate_minus_measurement_of_the_same_sample);
    RUN_TEST(test_gain_acts_on_the_error_of_the_intervals_start);
    RUN_TEST(test_step_turns_with_its_inputs);
    RUN_TEST(test_step_mirrors_bit_for_bit);
    RUN_TEST(test_step_is_linear_in_state_and_input);
    RUN_TEST(test_states_are_held_inside_a_circle_with_their_angle_kept);
    RUN_TEST(test_a_state_at_its_limit_is_left_alone);
    RUN_TEST(test_no_input_makes_a_state_non_finite);
    RUN_TEST(test_two_observers_do_not_know_of_each_other);
    RUN_TEST(test_tracked_resistance_is_that_of_a_warm_machine);
    RUN_TEST(test_extra_decay_is_that_of_another_m);
    RUN_TEST(test_senseless_tracked_resistance_is_ignored);
    RUN_TEST(test_init_refuses_senseless_machine_data);
    RUN_TEST(test_init_refuses_senseless_period_and_limits);
    RUN_TEST(test_init_refuses_a_period_in_which_the_current_decays);
    RUN_TEST(test_init_refuses_an_unknown_method);
    return UNITY_END();
}
