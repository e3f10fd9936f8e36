/* The estimator's contract: step, hold, off and seed, against its parts called by hand. */
#include "estimator.h"

#include <complex.h>
#include <string.h>

#include "drive_fixture.h"
#include "exact.h"

#define STEPS 60

static estimator_config_t cfg;
static estimator_state_t st;
static motor_model_t motor;

static void configure(int machine, observer_method_t method)
{
    (void)both_machines(machine); /* sets the list */
    motor = reference_derived(machine);
    estimator_list.observer_method = (uint32_t)method;
    TEST_ASSERT_TRUE(estimator_init(&cfg, &estimator_list, &motor, &test_table));
    st = (estimator_state_t){0};
}

void setUp(void)
{
    configure(1, OBSERVER_EULER);
}

void tearDown(void)
{
}

/* A motor in operation, and samples that no motor would send. */
static void in_operation(float omega_rad_s)
{
    const estimator_seed_t seed = {
        .i_s_A = {3.0f, 1.0f}, .lambda_r_Wb = {0.3f, 0.2f}, .omega_e_rad_s = omega_rad_s};
    estimator_seed(&cfg, &st, &seed);
}

static estimator_in_t sample(uint32_t *seed)
{
    return (estimator_in_t){.u_s_V = {40.0f * noise(seed), 40.0f * noise(seed)},
                            .i_s_A = {5.0f * noise(seed), 5.0f * noise(seed)},
                            .expected_step_rad_s = 0.2f * noise(seed)};
}

static cplx of(ab_t x)
{
    return (double)x.alpha + I * (double)x.beta;
}

static void assert_same_ab(ab_t expected, ab_t actual)
{
    ASSERT_SAME_FLOAT(expected.alpha, actual.alpha);
    ASSERT_SAME_FLOAT(expected.beta, actual.beta);
}

static void test_init_refuses_what_a_part_refuses(void)
{
    const params_t good = estimator_list;
#define REFUSE_WITH(field, value)                                                                  \
    estimator_list = good;                                                                         \
    estimator_list.field = (value);                                                                \
    TEST_ASSERT_FALSE(estimator_init(&cfg, &estimator_list, &motor, &test_table))
    REFUSE_WITH(period_s, 0.0f);
    REFUSE_WITH(current_full_scale_A, NAN);
    REFUSE_WITH(lambda_max_Wb, -1.0f);
    REFUSE_WITH(observer_method, 2u);
    REFUSE_WITH(omega_max_rad_s, 0.0f);
#undef REFUSE_WITH
    gain_table_t broken = test_table;
    broken.magic = 0u;
    TEST_ASSERT_FALSE(estimator_init(&cfg, &good, &motor, &broken));
    TEST_ASSERT_FALSE(estimator_init(&cfg, &good, &motor, NULL));
}

/* The paper's eps1 in its three readings; frequencies in Hz become speeds. */
static void test_init_turns_parameters_into_a_configuration(void)
{
    const float leaks[] = {0.5f, 0.5f * 30.0f, 0.5f / 200e-6f};
    estimator_list.eps1 = 0.5f;
    for (uint32_t unit = 0u; unit < 3u; unit++) {
        estimator_list.eps1_unit = unit;
        TEST_ASSERT_TRUE(estimator_init(&cfg, &estimator_list, &motor, &test_table));
        TEST_ASSERT_EQUAL_FLOAT(leaks[unit], cfg.adaptation.p.leak_per_s_Wb_A);
    }
    const speed_adaptation_params_t *p = &cfg.adaptation.p;
    TEST_ASSERT_EQUAL_FLOAT(NUM_TWO_PI * 1.6f, p->near_zero_on_rad_s);
    TEST_ASSERT_EQUAL_FLOAT(NUM_TWO_PI * 1.9f, p->near_zero_off_rad_s);
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, 0.563f * motor.tau_per_s, p->phi_ramp_rad_s);
    TEST_ASSERT_EQUAL_FLOAT(0.05f * motor.M_H * 4.0f, cfg.lambda_min_Wb);
    TEST_ASSERT_EQUAL_FLOAT(50.0f, cfg.observer.i_max_A); /* twice the ADC's full scale */
    TEST_ASSERT_EQUAL_PTR(&test_table, estimator_table(&cfg));
}

/* state_sum.h judges the whole law by it. */
static void test_sum_is_no_number_when_one_of_them_is_none(void)
{
    in_operation(20.0f);
    TEST_ASSERT_TRUE(is_finite(estimator_sum(&st)));
    float *const word[] = {&st.observer.i_s_hat_A.alpha,
                           &st.observer.i_s_hat_A.beta,
                           &st.observer.lambda_r_hat_Wb.alpha,
                           &st.observer.lambda_r_hat_Wb.beta,
                           &st.observer.e1_A.alpha,
                           &st.observer.e1_A.beta,
                           &st.residual_slow_A.alpha,
                           &st.residual_slow_A.beta,
                           &st.adaptation.x_rad_s,
                           &st.estimate.omega_e_rad_s,
                           &st.estimate.omega_s_rad_s};
    for (size_t k = 0u; k < sizeof word / sizeof word[0]; k++) {
        for (int n = 0; n < NOT_FINITE_COUNT; n++) {
            const float good = *word[k];
            *word[k] = not_finite(n);
            TEST_ASSERT_FALSE(is_finite(estimator_sum(&st)));
            *word[k] = good;
        }
    }
}

static void test_init_without_gain_needs_no_table(void)
{
    estimator_list.observer_gain_enable = 0u;
    TEST_ASSERT_TRUE(estimator_init(&cfg, &estimator_list, &motor, NULL));
    TEST_ASSERT_NULL(cfg.table);
    in_operation(20.0f);
    uint32_t seed = 3u;
    const estimator_in_t in = sample(&seed);
    estimator_step(&cfg, &st, &in);
    const observer_gain_t none = {0};
    TEST_ASSERT_EQUAL_MEMORY(&none, &st.gain, sizeof none);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.estimate.flux_correction_V.alpha);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.estimate.flux_correction_V.beta);
}

/* Observer, then adaptation, at the speed the interval began with; the stator frequency in double
 * precision, by the flux row of eq. (3). */
static void compare_by_hand(int machine)
{
    const double m_tau_ohm = (double)reference_machine[machine].M_H *
                             (double)reference_machine[machine].Rr_ohm /
                             (double)reference_machine[machine].Lr_H;
    const estimate_t *e = &st.estimate;
    observer_state_t o = st.observer;
    speed_adaptation_state_t a = st.adaptation;
    float omega_rad_s = e->omega_e_rad_s;
    uint32_t seed = 7u;
    for (int k = 0; k < STEPS; k++) {
        const float omega_s_rad_s = e->omega_s_rad_s;
        const estimator_in_t in = sample(&seed);
        const observer_in_t observer_in = {.u_s_V = in.u_s_V,
                                           .i_s_A = in.i_s_A,
                                           .omega_e_hat_rad_s = omega_rad_s,
                                           .gain = gain_table_at(&test_table, omega_rad_s)};
        observer_step(&cfg.observer, &o, &observer_in);
        const speed_adaptation_in_t adaptation_in = {.lambda_r_hat_Wb = o.lambda_r_hat_Wb,
                                                     .e1_A = o.e1_A,
                                                     .omega_s_hat_rad_s = omega_s_rad_s,
                                                     .omega_e_hat_rad_s = omega_rad_s,
                                                     .expected_step_rad_s = in.expected_step_rad_s,
                                                     .gain = observer_in.gain};
        omega_rad_s = speed_adaptation_step(&cfg.adaptation, &a, &adaptation_in).omega_e_hat_rad_s;
        estimator_step(&cfg, &st, &in);
        TEST_ASSERT_EQUAL_MEMORY(&o, &st.observer, sizeof o);
        ASSERT_SAME_FLOAT(a.x_rad_s, st.adaptation.x_rad_s);
        assert_same_ab(o.lambda_r_hat_Wb, e->lambda_r_hat_Wb);
        assert_same_ab(o.e1_A, e->i_residual_A);
        ASSERT_SAME_FLOAT(omega_rad_s, e->omega_e_rad_s);
        const cplx lambda_Wb = of(o.lambda_r_hat_Wb);
        const cplx l2_ohm =
            (double)observer_in.gain.l2_re_ohm + I * (double)observer_in.gain.l2_im_ohm;
        const cplx pull_V = m_tau_ohm * of(o.i_s_hat_A) + l2_ohm * of(o.e1_A);
        const double slip_rad_s = cimag(pull_V / lambda_Wb);
        ASSERT_NEAR(1e-6, cabs(lambda_Wb), e->lambda_Wb);
        ASSERT_NEAR(1e-5, 0.0, cabs(of(e->flux_correction_V) - l2_ohm * of(o.e1_A)));
        /* Some 1e-7 of each of the sums. */
        ASSERT_NEAR(1e-5 * (fabs((double)omega_rad_s) + cabs(pull_V) / cabs(lambda_Wb)),
                    (double)omega_rad_s + slip_rad_s, e->omega_s_rad_s);
    }
}

static void test_step_is_observer_and_adaptation_called_by_hand(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        for (int method = 0; method < 2; method++) {
            configure(machine, (observer_method_t)method);
            in_operation(11.0f);
            compare_by_hand(machine);
            configure(machine, (observer_method_t)method);
            in_operation(-11.0f);
            compare_by_hand(machine);
        }
    }
}

/* Direct current in balance: u = Rs i, lambda = M i, no speed. */
static void test_step_holds_the_dc_equilibrium(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        configure(machine, OBSERVER_SECOND_ORDER);
        const motor_t *m = &reference_machine[machine];
        const ab_t i_A = {3.0f, -4.0f};
        const estimator_seed_t seed = {.i_s_A = i_A, .lambda_r_Wb = ab_scale(i_A, m->M_H)};
        estimator_seed(&cfg, &st, &seed);
        const estimator_in_t in = {.u_s_V = ab_scale(i_A, m->Rs_ohm), .i_s_A = i_A};
        for (int k = 0; k < STEPS; k++) {
            estimator_step(&cfg, &st, &in);
        }
        /* Roundings of 5 A, each corrected by the next period. */
        ASSERT_NEAR(2e-5, 0.0, cabs(of(st.observer.i_s_hat_A) - of(i_A)));
        ASSERT_NEAR(1e-5, 0.0, cabs(of(st.estimate.lambda_r_hat_Wb) - (double)m->M_H * of(i_A)));
        ASSERT_NEAR(1e-4, 0.0, st.estimate.omega_e_rad_s);
        ASSERT_NEAR(1e-3, 0.0, st.estimate.omega_s_rad_s);
    }
}

/* v and w exchanged: the same machine turning the other way, to the last bit. */
static void test_the_mirror_image_turns_the_speed_round(void)
{
    in_operation(20.0f);
    estimator_state_t mirrored = st;
    mirrored.observer.i_s_hat_A = ab_conj(st.observer.i_s_hat_A);
    mirrored.observer.lambda_r_hat_Wb = ab_conj(st.observer.lambda_r_hat_Wb);
    mirrored.adaptation.x_rad_s = -20.0f;
    mirrored.estimate.omega_e_rad_s = -20.0f;
    mirrored.estimate.omega_s_rad_s = -20.0f;
    uint32_t seed = 5u;
    for (int k = 0; k < STEPS; k++) {
        estimator_in_t in = sample(&seed);
        estimator_step(&cfg, &st, &in);
        in.u_s_V = ab_conj(in.u_s_V);
        in.i_s_A = ab_conj(in.i_s_A);
        in.expected_step_rad_s = -in.expected_step_rad_s;
        estimator_step(&cfg, &mirrored, &in);
        assert_same_ab(ab_conj(st.estimate.lambda_r_hat_Wb), mirrored.estimate.lambda_r_hat_Wb);
        ASSERT_SAME_FLOAT(-st.estimate.omega_e_rad_s, mirrored.estimate.omega_e_rad_s);
        ASSERT_SAME_FLOAT(-st.estimate.omega_s_rad_s, mirrored.estimate.omega_s_rad_s);
    }
}

static void test_what_is_no_number_leaves_numbers(void)
{
    for (int k = 0; k < 2 * NOT_FINITE_COUNT; k++) {
        in_operation(20.0f);
        uint32_t seed = 9u;
        estimator_in_t in = sample(&seed);
        *((k % 2 == 0) ? &in.u_s_V.alpha : &in.i_s_A.beta) = not_finite(k / 2);
        estimator_step(&cfg, &st, &in);
        const estimate_t *e = &st.estimate;
        TEST_ASSERT_TRUE(ab_finite(e->lambda_r_hat_Wb) && ab_finite(e->i_residual_A) &&
                         ab_finite(e->flux_correction_V));
        TEST_ASSERT_TRUE(is_finite(e->lambda_Wb) && is_finite(e->omega_e_rad_s) &&
                         is_finite(e->omega_s_rad_s));
        TEST_ASSERT_TRUE(e->lambda_Wb <= 1.0001f * estimator_list.lambda_max_Wb);
    }
}

static observer_gain_t gain_of_a_step_at(float omega_rad_s)
{
    const estimator_in_t in = {0};
    in_operation(omega_rad_s);
    estimator_step(&cfg, &st, &in);
    return st.gain;
}

/* Real parts hold, imaginary ones grow with the speed: without a step, and no more than threefold.
 * Without weakening the last entry holds. */
static void test_beyond_the_tables_end_its_gain_grows_with_the_speed(void)
{
    const observer_gain_t *last = &test_gain[3];
    const float end_rad_s = 3.0f * test_table.step_rad_s;
    const float growth[] = {1.0f, 1.5f, -2.0f, 3.0f, -3.0f};
    const float speeds[] = {1.0f, 1.5f, -2.0f, 4.0f, -5.0f};
    estimator_list.weaken_share = 0.9f;
    TEST_ASSERT_TRUE(estimator_init(&cfg, &estimator_list, &motor, &test_table));
    ASSERT_SAME_FLOAT(end_rad_s, cfg.table_end_rad_s);
    for (int n = 0; n < 5; n++) {
        const observer_gain_t gain = gain_of_a_step_at(speeds[n] * end_rad_s);
        ASSERT_SAME_FLOAT(last->l1_re_per_s, gain.l1_re_per_s);
        ASSERT_SAME_FLOAT(last->l2_re_ohm, gain.l2_re_ohm);
        ASSERT_NEAR(1e-4, growth[n] * last->l1_im_per_s, gain.l1_im_per_s);
        ASSERT_NEAR(1e-6, growth[n] * last->l2_im_ohm, gain.l2_im_ohm);
    }
    estimator_list.weaken_share = 0.0f;
    TEST_ASSERT_TRUE(estimator_init(&cfg, &estimator_list, &motor, &test_table));
    const observer_gain_t held = gain_of_a_step_at(2.0f * end_rad_s);
    ASSERT_SAME_FLOAT(last->l1_im_per_s, held.l1_im_per_s);
    ASSERT_SAME_FLOAT(last->l2_im_ohm, held.l2_im_ohm);
}

static void test_a_speed_that_is_no_number_reads_the_first_entry(void)
{
    const observer_gain_t first = gain_of_a_step_at(NAN);
    TEST_ASSERT_EQUAL_MEMORY(&test_table.entry[0], &first, sizeof first);
}

/* The frequency is told; flux and speed are estimated as without. */
static void test_an_imposed_frame_gives_the_frequency_and_nothing_else(void)
{
    in_operation(20.0f);
    estimator_state_t imposed = st;
    uint32_t seed = 11u;
    estimator_in_t in = sample(&seed);
    estimator_step(&cfg, &st, &in);
    in.frame_imposed = true;
    in.omega_frame_rad_s = -47.0f;
    estimator_step(&cfg, &imposed, &in);
    ASSERT_SAME_FLOAT(-47.0f, imposed.estimate.omega_s_rad_s);
    ASSERT_SAME_FLOAT(st.estimate.omega_e_rad_s, imposed.estimate.omega_e_rad_s);
    imposed.estimate.omega_s_rad_s = st.estimate.omega_s_rad_s;
    TEST_ASSERT_EQUAL_MEMORY(&st.estimate, &imposed.estimate, sizeof st.estimate);
}

/* What is hardly there is not divided by: the divisor is the least flux. */
static void test_the_frequency_of_next_to_no_flux_is_finite(void)
{
    estimator_list.observer_gain_enable = 0u;
    const float floors_Wb[] = {0.05f, 0.5f};
    for (int n = 0; n < 2; n++) {
        estimator_list.i_d_A = floors_Wb[n] / (0.05f * estimator_list.M_H);
        TEST_ASSERT_TRUE(estimator_init(&cfg, &estimator_list, &motor, NULL));
        const estimator_seed_t seed = {.i_s_A = {0.0f, 5.0f}, .lambda_r_Wb = {0.001f, 0.0f}};
        estimator_seed(&cfg, &st, &seed);
        const estimator_in_t in = {.i_s_A = {0.0f, 5.0f}};
        estimator_step(&cfg, &st, &in);
        const double m_tau_ohm = (double)(motor.M_H * motor.tau_per_s);
        const double pull_Wb_V =
            cimag(conj(of(st.estimate.lambda_r_hat_Wb)) * m_tau_ohm * of(st.observer.i_s_hat_A));
        ASSERT_NEAR(1e-4, pull_Wb_V / ((double)floors_Wb[n] * (double)floors_Wb[n]),
                    st.estimate.omega_s_rad_s - st.estimate.omega_e_rad_s);
    }
}

/* A rotor that slips more turns slower at the same signals, and nothing else differs. */
static void test_extra_slip_is_taken_from_the_speed_alone(void)
{
    in_operation(20.0f);
    estimator_state_t warm = st;
    warm.estimate.omega_e_rad_s = 18.5f;
    uint32_t seed = 11u;
    for (int k = 0; k < STEPS; k++) {
        estimator_in_t in = sample(&seed);
        estimator_step(&cfg, &st, &in);
        in.slip_extra_rad_s = 1.5f;
        estimator_step(&cfg, &warm, &in);
        ASSERT_NEAR(1e-4, st.estimate.omega_e_rad_s - 1.5f, warm.estimate.omega_e_rad_s);
        ASSERT_NEAR(1e-3, st.estimate.omega_s_rad_s, warm.estimate.omega_s_rad_s);
        ASSERT_NEAR(1e-5, 0.0,
                    cabs(of(warm.estimate.lambda_r_hat_Wb) - of(st.estimate.lambda_r_hat_Wb)));
    }
    estimator_in_t in = sample(&seed);
    estimator_state_t held = warm;
    in.slip_extra_rad_s = 1.5f;
    estimator_hold(&cfg, &warm, &in, 30.0f);
    ASSERT_SAME_FLOAT(31.5f, warm.adaptation.x_rad_s); /* a step goes on from there */
    ASSERT_SAME_FLOAT(30.0f, warm.estimate.omega_e_rad_s);
    held.estimate.omega_e_rad_s += 1.5f;
    in.slip_extra_rad_s = 0.0f;
    estimator_hold(&cfg, &held, &in, 30.0f);
    TEST_ASSERT_EQUAL_MEMORY(&held.observer, &warm.observer, sizeof warm.observer);
}

static void test_the_observer_is_given_the_extra_decay(void)
{
    in_operation(20.0f);
    estimator_state_t other = st;
    estimator_config_t longer = cfg;
    longer.observer.tau_per_s += 0.5f;
    uint32_t seed = 23u;
    estimator_in_t in = sample(&seed);
    estimator_step(&longer, &other, &in);
    in.tau_extra_per_s = 0.5f;
    estimator_step(&cfg, &st, &in);
    TEST_ASSERT_EQUAL_MEMORY(&other.observer, &st.observer, sizeof st.observer);
}

/* The interval that ended ran at the speed of then; from now on it is the imposed one. */
static void test_hold_estimates_the_flux_at_a_speed_that_is_told(void)
{
    in_operation(20.0f);
    observer_state_t o = st.observer;
    uint32_t seed = 13u;
    const float told_rad_s[] = {30.0f, -8.0f, 0.0f};
    float omega_rad_s = 20.0f;
    for (int k = 0; k < 3; k++) {
        const estimator_in_t in = sample(&seed);
        const observer_in_t observer_in = {.u_s_V = in.u_s_V,
                                           .i_s_A = in.i_s_A,
                                           .omega_e_hat_rad_s = omega_rad_s,
                                           .gain = gain_table_at(&test_table, omega_rad_s)};
        observer_step(&cfg.observer, &o, &observer_in);
        omega_rad_s = told_rad_s[k];
        estimator_hold(&cfg, &st, &in, omega_rad_s);
        TEST_ASSERT_EQUAL_MEMORY(&o, &st.observer, sizeof o);
        assert_same_ab(o.lambda_r_hat_Wb, st.estimate.lambda_r_hat_Wb);
        assert_same_ab(o.e1_A, st.estimate.i_residual_A);
        ASSERT_NEAR(1e-6, cabs(of(o.lambda_r_hat_Wb)), st.estimate.lambda_Wb);
        ASSERT_SAME_FLOAT(omega_rad_s, st.estimate.omega_e_rad_s);
        ASSERT_SAME_FLOAT(omega_rad_s, st.estimate.omega_s_rad_s);
        ASSERT_SAME_FLOAT(omega_rad_s, st.adaptation.x_rad_s); /* a step goes on from there */
    }
}

static void test_off_knows_the_current_and_what_it_is_told(void)
{
    in_operation(20.0f);
    uint32_t seed = 17u;
    const estimator_in_t in = sample(&seed);
    estimator_step(&cfg, &st, &in);
    estimator_off(&st, (ab_t){1.0f, -2.0f}, 33.0f);
    const estimate_t nothing = {.omega_e_rad_s = 33.0f, .omega_s_rad_s = 33.0f};
    const observer_state_t rest = {.i_s_hat_A = {1.0f, -2.0f}};
    const observer_gain_t none = {0};
    TEST_ASSERT_EQUAL_MEMORY(&nothing, &st.estimate, sizeof nothing);
    TEST_ASSERT_EQUAL_MEMORY(&rest, &st.observer, sizeof rest);
    TEST_ASSERT_EQUAL_MEMORY(&none, &st.gain, sizeof none);
}

static void test_seed_starts_from_what_is_known(void)
{
    in_operation(20.0f);
    st.observer.e1_A = (ab_t){1.0f, 1.0f};
    st.adaptation.near_zero = true;
    const estimator_seed_t seed = {
        .i_s_A = {2.0f, 3.0f}, .lambda_r_Wb = {-0.3f, 0.4f}, .omega_e_rad_s = -25.0f};
    estimator_seed(&cfg, &st, &seed);
    const observer_state_t o = {.i_s_hat_A = {2.0f, 3.0f}, .lambda_r_hat_Wb = {-0.3f, 0.4f}};
    TEST_ASSERT_EQUAL_MEMORY(&o, &st.observer, sizeof o);
    ASSERT_SAME_FLOAT(-25.0f, st.adaptation.x_rad_s);
    TEST_ASSERT_FALSE(st.adaptation.near_zero);
    assert_same_ab(seed.lambda_r_Wb, st.estimate.lambda_r_hat_Wb);
    ASSERT_NEAR(1e-7, 0.5, st.estimate.lambda_Wb);
    assert_same_ab((ab_t){0.0f, 0.0f}, st.estimate.i_residual_A);
    assert_same_ab((ab_t){0.0f, 0.0f}, st.estimate.flux_correction_V);
    ASSERT_SAME_FLOAT(-25.0f, st.estimate.omega_e_rad_s);
    ASSERT_SAME_FLOAT(-25.0f, st.estimate.omega_s_rad_s);
}

/* More flux than there can be is shortened, its angle kept; one that is no number ends inside. */
static void test_seed_limits_the_flux(void)
{
    estimator_seed_t seed = {.lambda_r_Wb = {-2.0f, 2.9f}};
    estimator_seed(&cfg, &st, &seed);
    ASSERT_NEAR(1e-6, 3.0, st.estimate.lambda_Wb);
    const cplx along = (-2.0 + 2.9 * I) / cabs(-2.0 + 2.9 * I);
    ASSERT_NEAR(1e-6, 0.0, cabs(of(st.observer.lambda_r_hat_Wb) - 3.0 * along));
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        seed.lambda_r_Wb.beta = not_finite(k);
        estimator_seed(&cfg, &st, &seed);
        TEST_ASSERT_TRUE(st.estimate.lambda_Wb <= 3.00001f);
        assert_same_ab(st.estimate.lambda_r_hat_Wb, st.observer.lambda_r_hat_Wb);
    }
}

/* While dwelling the adaptation is given e1 less the share of its low-pass, corner .16 tau, and all
 * of phi: by hand. Without, nothing of it moves. */
static void test_dwelling_takes_what_does_not_move_from_the_residual(void)
{
    configure(1, OBSERVER_EULER);
    in_operation(11.0f);
    uint32_t seed = 11u;
    estimator_in_t in = sample(&seed);
    estimator_step(&cfg, &st, &in);
    ASSERT_SAME_FLOAT(0.0f, st.residual_slow_A.alpha);
    ASSERT_SAME_FLOAT(0.0f, st.residual_slow_A.beta);
    const double gain = 0.16 * (double)motor.tau_per_s * (double)estimator_list.period_s;
    cplx slow_A = 0.0;
    for (int k = 0; k < STEPS; k++) {
        in = sample(&seed);
        in.dwell = 0.75f;
        const float omega_rad_s = st.estimate.omega_e_rad_s;
        const float omega_s_rad_s = st.estimate.omega_s_rad_s;
        speed_adaptation_state_t a = st.adaptation;
        estimator_step(&cfg, &st, &in);
        const cplx e1_A = of(st.observer.e1_A);
        slow_A += gain * (e1_A - slow_A);
        ASSERT_NEAR(1e-5, 0.0, cabs(slow_A - of(st.residual_slow_A)));
        const cplx moving_A = e1_A - 0.75 * slow_A;
        const speed_adaptation_in_t adaptation_in = {
            .lambda_r_hat_Wb = st.observer.lambda_r_hat_Wb,
            .e1_A = {(float)creal(moving_A), (float)cimag(moving_A)},
            .omega_s_hat_rad_s = omega_s_rad_s,
            .omega_e_hat_rad_s = omega_rad_s,
            .expected_step_rad_s = in.expected_step_rad_s,
            .gain = st.gain,
            .dwell = 0.75f};
        const float expected =
            speed_adaptation_step(&cfg.adaptation, &a, &adaptation_in).omega_e_hat_rad_s;
        ASSERT_NEAR(1e-2, expected, st.estimate.omega_e_rad_s);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_what_a_part_refuses);
    RUN_TEST(test_init_turns_parameters_into_a_configuration);
    RUN_TEST(test_sum_is_no_number_when_one_of_them_is_none);
    RUN_TEST(test_init_without_gain_needs_no_table);
    RUN_TEST(test_step_is_observer_and_adaptation_called_by_hand);
    RUN_TEST(test_step_holds_the_dc_equilibrium);
    RUN_TEST(test_the_mirror_image_turns_the_speed_round);
    RUN_TEST(test_what_is_no_number_leaves_numbers);
    RUN_TEST(test_beyond_the_tables_end_its_gain_grows_with_the_speed);
    RUN_TEST(test_a_speed_that_is_no_number_reads_the_first_entry);
    RUN_TEST(test_an_imposed_frame_gives_the_frequency_and_nothing_else);
    RUN_TEST(test_the_frequency_of_next_to_no_flux_is_finite);
    RUN_TEST(test_extra_slip_is_taken_from_the_speed_alone);
    RUN_TEST(test_the_observer_is_given_the_extra_decay);
    RUN_TEST(test_hold_estimates_the_flux_at_a_speed_that_is_told);
    RUN_TEST(test_off_knows_the_current_and_what_it_is_told);
    RUN_TEST(test_seed_starts_from_what_is_known);
    RUN_TEST(test_seed_limits_the_flux);
    RUN_TEST(test_dwelling_takes_what_does_not_move_from_the_residual);
    return UNITY_END();
}
