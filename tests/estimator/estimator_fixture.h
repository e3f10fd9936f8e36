/* What the unit tests of the rivals share: a motor in steady operation as equations in double
 * precision, and the tests that the contract (estimator.h) sets for every estimator.
 */
#ifndef ESTIMATOR_FIXTURE_H
#define ESTIMATOR_FIXTURE_H

#include "estimator.h"

#include "exact.h"
#include "reference_machine.h"

#define PERIOD_S 200e-6

static params_t list;
static motor_model_t motor;
static estimator_config_t cfg;
static estimator_state_t st;

/* How far a rival may be off in the tests of its contract (estimator_contract.h). */
typedef struct {
    double flux_pu;
    double speed_rad_s;
    double held_rad_s;
    double extra_slip_rad_s;
} tolerance_t;

/* A motor in steady operation: the speeds, the length of its flux, and time. */
typedef struct {
    int machine;
    double omega_e_rad_s;
    double slip_rad_s;
    double lambda_Wb;
    double t_s;
} operation_t;

static inline double complex of(ab_t x)
{
    return (double)x.alpha + I * (double)x.beta;
}

static inline ab_t ab_of(double complex x)
{
    return (ab_t){(float)creal(x), (float)cimag(x)};
}

static inline void assert_ab(double tolerance, double complex expected, ab_t actual)
{
    ASSERT_NEAR(tolerance, creal(expected), actual.alpha);
    ASSERT_NEAR(tolerance, cimag(expected), actual.beta);
}

static inline void list_of(int machine)
{
    const motor_t *m = &reference_machine[machine];
    params_default(&list);
    list.Rs_ohm = m->Rs_ohm;
    list.Rr_ohm = m->Rr_ohm;
    list.Ls_H = m->Ls_H;
    list.Lr_H = m->Lr_H;
    list.M_H = m->M_H;
    list.i_d_A = 5.0f;
    list.period_s = (float)PERIOD_S;
    list.lambda_max_Wb = 3.0f;
    list.omega_max_rad_s = 600.0f;
    motor = reference_derived(machine);
}

static inline void configure(int machine)
{
    list_of(machine);
    TEST_ASSERT_TRUE(estimator_init(&cfg, &list, &motor, NULL));
    st = (estimator_state_t){0};
}

/* Flux of the rotor at time t. */
static inline double complex true_flux(const operation_t *o, double t_s)
{
    return o->lambda_Wb * cexp(I * (o->omega_e_rad_s + o->slip_rad_s) * t_s);
}

/* Eq. (1), flux row: 0 = M/Tr i - (1/Tr + j w_slip) lambda in the frame of the flux. */
static inline double complex true_current(const operation_t *o, double t_s)
{
    const reference_model_t m = reference_model(&reference_machine[o->machine], o->omega_e_rad_s);
    return (m.tau + I * o->slip_rad_s) / m.a21 * true_flux(o, t_s);
}

/* Mean voltage over the interval that ends at t: Rs mean(i) + change of the stator flux over T. */
static inline double complex true_voltage(const operation_t *o, double t_s)
{
    const reference_model_t m = reference_model(&reference_machine[o->machine], o->omega_e_rad_s);
    const double kr = m.sigma_Ls / m.eps;
    const double Rs_ohm = (double)reference_machine[o->machine].Rs_ohm;
    const double omega_s_rad_s = o->omega_e_rad_s + o->slip_rad_s;
    const double complex di_A = true_current(o, t_s) - true_current(o, t_s - PERIOD_S);
    const double complex dl_Wb = true_flux(o, t_s) - true_flux(o, t_s - PERIOD_S);
    const double complex charge_As =
        (omega_s_rad_s == 0.0) ? PERIOD_S * true_current(o, t_s) : di_A / (I * omega_s_rad_s);
    return (Rs_ohm * charge_As + m.sigma_Ls * di_A + kr * dl_Wb) / PERIOD_S;
}

static inline void seed_as(const operation_t *o, double omega_error_rad_s)
{
    const estimator_seed_t seed = {.i_s_A = ab_of(true_current(o, o->t_s)),
                                   .lambda_r_Wb = ab_of(true_flux(o, o->t_s)),
                                   .omega_e_rad_s = (float)(o->omega_e_rad_s + omega_error_rad_s)};
    estimator_seed(&cfg, &st, &seed);
}

static inline estimator_in_t sample_of(operation_t *o)
{
    o->t_s += PERIOD_S;
    return (estimator_in_t){.u_s_V = ab_of(true_voltage(o, o->t_s)),
                            .i_s_A = ab_of(true_current(o, o->t_s))};
}

static inline void run_steps(operation_t *o, int steps)
{
    for (int k = 0; k < steps; k++) {
        const estimator_in_t in = sample_of(o);
        estimator_step(&cfg, &st, &in);
    }
}

/* The estimate is that of the motor: flux to a share of its length, speeds in rad/s. */
static inline void assert_estimate(const operation_t *o, double flux_pu, double speed_rad_s)
{
    const estimate_t *e = &st.estimate;
    assert_ab(flux_pu * o->lambda_Wb, true_flux(o, o->t_s), e->lambda_r_hat_Wb);
    ASSERT_NEAR(flux_pu * o->lambda_Wb, o->lambda_Wb, e->lambda_Wb);
    ASSERT_NEAR(speed_rad_s, o->omega_e_rad_s, e->omega_e_rad_s);
    ASSERT_NEAR(speed_rad_s, o->omega_e_rad_s + o->slip_rad_s, e->omega_s_rad_s);
}

/* Motoring, generating and without load, in both directions. */
#define OPERATIONS 6
static inline operation_t operation(int machine, int k)
{
    static const double speed_and_slip[OPERATIONS][2] = {
        {60.0, 0.0}, {60.0, 5.0}, {300.0, -5.0}, {-300.0, 0.0}, {-60.0, -5.0}, {-150.0, 5.0}};
    return (operation_t){.machine = machine,
                         .omega_e_rad_s = speed_and_slip[k][0],
                         .slip_rad_s = speed_and_slip[k][1],
                         .lambda_Wb = 0.5};
}

static inline void check_stays_with_the_motor(double flux_pu, double speed_rad_s)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        configure(machine);
        for (int k = 0; k < OPERATIONS; k++) {
            operation_t o = operation(machine, k);
            seed_as(&o, 0.0);
            run_steps(&o, 10000);
            assert_estimate(&o, flux_pu, speed_rad_s);
        }
    }
}

static inline void check_finds_the_speed(double error_rad_s, double flux_pu, double speed_rad_s)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        configure(machine);
        for (int k = 0; k < OPERATIONS; k++) {
            operation_t o = operation(machine, k);
            seed_as(&o, error_rad_s);
            run_steps(&o, 25000);
            assert_estimate(&o, flux_pu, speed_rad_s);
        }
    }
}

/* What the drive knows of a warmer rotor: the model's slips more, the motor's speed is that less.
 */
static inline void check_takes_off_the_extra_slip(double speed_rad_s)
{
    operation_t o = {.machine = 1, .omega_e_rad_s = 100.0, .slip_rad_s = 4.0, .lambda_Wb = 0.5};
    configure(o.machine);
    seed_as(&o, 0.0);
    for (int k = 0; k < 20000; k++) {
        estimator_in_t in = sample_of(&o);
        in.slip_extra_rad_s = 1.5f;
        estimator_step(&cfg, &st, &in);
    }
    ASSERT_NEAR(speed_rad_s, 98.5, st.estimate.omega_e_rad_s);
    ASSERT_NEAR(speed_rad_s, 104.0, st.estimate.omega_s_rad_s);
}

static inline void check_takes_the_imposed_frame(void)
{
    configure(0);
    operation_t o = operation(0, 1);
    seed_as(&o, 0.0);
    estimator_in_t in = sample_of(&o);
    in.frame_imposed = true;
    in.omega_frame_rad_s = 11.0f;
    estimator_step(&cfg, &st, &in);
    TEST_ASSERT_EQUAL_FLOAT(11.0f, st.estimate.omega_s_rad_s);
}

/* An imposed speed: the flux is estimated with it, and estimation goes on from there. */
static inline void check_hold(double flux_pu, double speed_rad_s)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        configure(machine);
        operation_t o = operation(machine, 1);
        seed_as(&o, 7.0);
        for (int k = 0; k < 25000; k++) {
            const estimator_in_t in = sample_of(&o);
            estimator_hold(&cfg, &st, &in, (float)o.omega_e_rad_s);
        }
        TEST_ASSERT_EQUAL_FLOAT((float)o.omega_e_rad_s, st.estimate.omega_s_rad_s);
        assert_ab(flux_pu * o.lambda_Wb, true_flux(&o, o.t_s), st.estimate.lambda_r_hat_Wb);
        run_steps(&o, 1);
        assert_estimate(&o, flux_pu, speed_rad_s);
    }
}

/* Direct current into a motor at rest: flux M i, no speed. */
static inline void check_magnetises(double flux_pu, double speed_rad_s)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        configure(machine);
        const double i_A = 4.0;
        const estimator_in_t in = {.u_s_V = {(float)i_A * motor.Rs_ohm, 0.0f},
                                   .i_s_A = {(float)i_A, 0.0f}};
        for (int k = 0; k < 20000; k++) {
            estimator_hold(&cfg, &st, &in, 0.0f);
        }
        const double flux_Wb = (double)motor.M_H * i_A;
        assert_ab(flux_pu * flux_Wb, flux_Wb, st.estimate.lambda_r_hat_Wb);
        for (int k = 0; k < 5000; k++) {
            estimator_step(&cfg, &st, &in);
        }
        assert_ab(flux_pu * flux_Wb, flux_Wb, st.estimate.lambda_r_hat_Wb);
        ASSERT_NEAR(speed_rad_s, 0.0, st.estimate.omega_e_rad_s);
    }
}

static inline void check_off_forgets_the_flux(void)
{
    configure(1);
    operation_t o = operation(1, 1);
    seed_as(&o, 0.0);
    run_steps(&o, 10);
    estimator_off(&st, (ab_t){3.0f, 1.0f}, 12.0f);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.estimate.lambda_Wb);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.estimate.lambda_r_hat_Wb.alpha);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.estimate.lambda_r_hat_Wb.beta);
    TEST_ASSERT_EQUAL_FLOAT(12.0f, st.estimate.omega_e_rad_s);
    TEST_ASSERT_EQUAL_FLOAT(12.0f, st.estimate.omega_s_rad_s);
}

/* Samples that no motor sends: the states stay within their bounds, and finite. */
static inline void check_bounds(void)
{
    uint32_t seed = 5u;
    configure(0);
    for (int k = 0; k < 20000; k++) {
        const estimator_in_t in = {.u_s_V = {4e3f * noise(&seed), 4e3f * noise(&seed)},
                                   .i_s_A = {4e3f * noise(&seed), 4e3f * noise(&seed)}};
        estimator_step(&cfg, &st, &in);
        TEST_ASSERT_TRUE(is_finite(estimator_sum(&st)));
        TEST_ASSERT_TRUE(st.estimate.lambda_Wb <= 1.001f * list.lambda_max_Wb);
        TEST_ASSERT_TRUE(absf(st.estimate.omega_e_rad_s) <= list.omega_max_rad_s);
    }
}

/* Turned by an eighth and mirrored, the estimates turn and mirror with the motor. */
static inline void check_mirror(void)
{
    estimator_state_t first;
    configure(1);
    operation_t o = operation(1, 1);
    seed_as(&o, 3.0);
    run_steps(&o, 200);
    first = st;
    configure(1);
    operation_t m = operation(1, 1);
    m.omega_e_rad_s = -m.omega_e_rad_s;
    m.slip_rad_s = -m.slip_rad_s;
    seed_as(&m, -3.0);
    run_steps(&m, 200);
    ASSERT_NEAR(1e-3, -(double)first.estimate.omega_e_rad_s, st.estimate.omega_e_rad_s);
    assert_ab(1e-5, conj(of(first.estimate.lambda_r_hat_Wb)), st.estimate.lambda_r_hat_Wb);
}

static inline void check_sum(float *const *word, size_t count)
{
    for (size_t k = 0u; k < count; k++) {
        for (int n = 0; n < NOT_FINITE_COUNT; n++) {
            const float good = *word[k];
            *word[k] = not_finite(n);
            TEST_ASSERT_FALSE(is_finite(estimator_sum(&st)));
            *word[k] = good;
        }
    }
    TEST_ASSERT_TRUE(is_finite(estimator_sum(&st)));
}

/* Each of these parameters, when it is no positive number, is refused. */
static inline void check_refuses(float *const *parameter, size_t count)
{
    for (size_t k = 0u; k < count; k++) {
        for (int n = 0; n < NOT_POSITIVE_COUNT; n++) {
            const float good = *parameter[k];
            *parameter[k] = not_positive(n);
            TEST_ASSERT_FALSE(estimator_init(&cfg, &list, &motor, NULL));
            *parameter[k] = good;
        }
    }
    TEST_ASSERT_TRUE(estimator_init(&cfg, &list, &motor, NULL));
}

#endif
