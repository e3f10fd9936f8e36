#include "supervisor.h"

#include <complex.h>
#include <math.h>

#include "exact.h"
#include "reference_machine.h"
#include "unity.h"

#define PERIOD_S 200e-6f
#define TURN     ((int)SLOT_COUNT)    /* periods per judgement */
#define QUARTER  ((int)SLOT_QUARTERS) /* periods per tie to the estimate */

typedef double complex cplx;

static const supervisor_params_t params = {.corner_rad_s = 3.0f,
                                           .Rs_uncertainty_pu = 0.05f,
                                           .Rr_uncertainty_pu = 0.3f,
                                           .i_uncertainty_pu = 0.02f,
                                           .u_uncertainty_V = 0.1f,
                                           .residual_pu = 0.43f,
                                           .lost_pu = 0.6f,
                                           .confirm_s = 0.016f, /* 5 turns */
                                           .return_s = 0.032f,  /* 10 turns */
                                           .lambda_nominal_Wb = 0.5f,
                                           .omega_max_rad_s = 600.0f};

static motor_model_t motor;
static supervisor_config_t cfg;
static supervisor_state_t st;
static supervisor_in_t in;
static ab_t u_s_V;
static uint32_t slot;

static void configure(int machine, const supervisor_params_t *p)
{
    motor = reference_derived(machine);
    TEST_ASSERT_TRUE(supervisor_init(&cfg, p, &motor, PERIOD_S));
}

void setUp(void)
{
    configure(0, &params);
    st = (supervisor_state_t){0};
    u_s_V = (ab_t){0.0f, 0.0f};
    slot = 0u;
    in = (supervisor_in_t){.lambda_r_hat_Wb = {0.5f, 0.0f},
                           .Rs_ohm = 0.93f,
                           .omega_e_hat_rad_s = 50.0f,
                           .omega_s_hat_rad_s = 50.0f};
}

void tearDown(void)
{
}

/* One period, as the drive does: the EMF in each of them, the rest where it is due. */
static void step_with(supervisor_state_t *state, const supervisor_in_t *with, ab_t u_V)
{
    supervisor_add(state, u_V, with->i_s_A, with->Rs_ohm);
    if (supervisor_is_due(slot)) {
        supervisor_step(&cfg, state, with, slot);
    }
}

static void step(void)
{
    slot = slot_next(slot);
    step_with(&st, &in, u_s_V);
}

/* One judgement with |d| = residual_pu of the flux and the frequency given, no current, no voltage.
 * dV is then U Lr/M alone. Its parts: measure, weigh, decide, bound. */
static void judge_with(float residual_pu, float omega_s_rad_s)
{
    st.started = true;
    st.omega_s_rad_s = omega_s_rad_s;
    in.omega_s_hat_rad_s = omega_s_rad_s;
    const float lambda_Wb = in.lambda_r_hat_Wb.alpha;
    st.s_Wb = (ab_t){lambda_Wb * (1.0f - residual_pu), 0.0f};
    st.emf_sum_V = (ab_t){0.0f, 0.0f};
    slot = SLOT_SUPERVISOR_MEASURE - 1u;
    do {
        step();
    } while (slot != SLOT_SUPERVISOR_BOUND);
}

static void judge_times(int n, float residual_pu, float omega_s_rad_s)
{
    for (int k = 0; k < n; k++) {
        judge_with(residual_pu, omega_s_rad_s);
    }
}

static cplx c(ab_t x)
{
    return (double)x.alpha + I * (double)x.beta;
}

static ab_t ab(cplx x)
{
    return (ab_t){(float)creal(x), (float)cimag(x)};
}

#define ASSERT_REFUSED(field, value)                                                               \
    do {                                                                                           \
        supervisor_params_t bad = params;                                                          \
        bad.field = (value);                                                                       \
        TEST_ASSERT_FALSE_MESSAGE(supervisor_init(&cfg, &bad, &motor, PERIOD_S),                   \
                                  #field " = " #value);                                            \
    } while (0)

#define ASSERT_ACCEPTED(field, value)                                                              \
    do {                                                                                           \
        supervisor_params_t good = params;                                                         \
        good.field = (value);                                                                      \
        TEST_ASSERT_TRUE_MESSAGE(supervisor_init(&cfg, &good, &motor, PERIOD_S),                   \
                                 #field " = " #value);                                             \
    } while (0)

#define ASSERT_NOT_NEGATIVE(field)                                                                 \
    ASSERT_REFUSED(field, -1e-3f);                                                                 \
    ASSERT_REFUSED(field, NAN);                                                                    \
    ASSERT_REFUSED(field, INFINITY);                                                               \
    ASSERT_ACCEPTED(field, 0.0f)

static void test_init_refuses_every_bad_parameter(void)
{
    ASSERT_NOT_NEGATIVE(Rs_uncertainty_pu);
    ASSERT_NOT_NEGATIVE(Rr_uncertainty_pu);
    ASSERT_NOT_NEGATIVE(i_uncertainty_pu);
    ASSERT_NOT_NEGATIVE(u_uncertainty_V);
    ASSERT_NOT_NEGATIVE(confirm_s);
    ASSERT_NOT_NEGATIVE(return_s);
    ASSERT_NOT_NEGATIVE(still_rad_s);
    ASSERT_NOT_NEGATIVE(still_A);
    ASSERT_NOT_NEGATIVE(still_s);
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        ASSERT_REFUSED(corner_rad_s, not_positive(k));
        ASSERT_REFUSED(residual_pu, not_positive(k));
        ASSERT_REFUSED(lost_pu, not_positive(k));
        ASSERT_REFUSED(lambda_nominal_Wb, not_positive(k));
        ASSERT_REFUSED(omega_max_rad_s, not_positive(k));
    }
    ASSERT_REFUSED(lost_pu, 0.42f); /* below residual_pu */
    ASSERT_ACCEPTED(lost_pu, 0.43f);
    ASSERT_REFUSED(corner_rad_s, 1250.0f); /* not slow against four periods */
    ASSERT_ACCEPTED(corner_rad_s, 1247.5f);
    ASSERT_REFUSED(confirm_s, 3.3e6f); /* more turns than a counter takes */
    ASSERT_REFUSED(return_s, 3.3e6f);
    ASSERT_REFUSED(still_s, 6.6e5f);
    ASSERT_ACCEPTED(confirm_s, 3.1e6f);
    ASSERT_ACCEPTED(return_s, 3.1e6f);
}

static void test_init_refuses_a_senseless_motor_or_period(void)
{
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        float *const field[] = {&motor.kr, &motor.eps_H, &motor.tau_per_s, &motor.M_H};
        for (unsigned f = 0; f < sizeof field / sizeof field[0]; f++) {
            const float before = *field[f];
            *field[f] = not_positive(k);
            TEST_ASSERT_FALSE(supervisor_init(&cfg, &params, &motor, PERIOD_S));
            *field[f] = before;
        }
        TEST_ASSERT_FALSE(supervisor_init(&cfg, &params, &motor, not_positive(k)));
    }
}

static void test_init_rounds_times_to_whole_judgements(void)
{
    ASSERT_ACCEPTED(confirm_s, 0.01755f); /* 5.48 */
    TEST_ASSERT_EQUAL_UINT32(5u, cfg.confirm_schedules);
    ASSERT_ACCEPTED(confirm_s, 0.01765f); /* 5.52 */
    TEST_ASSERT_EQUAL_UINT32(6u, cfg.confirm_schedules);
    ASSERT_ACCEPTED(return_s, 0.01755f);
    TEST_ASSERT_EQUAL_UINT32(5u, cfg.return_schedules);
    ASSERT_ACCEPTED(return_s, 0.01765f);
    TEST_ASSERT_EQUAL_UINT32(6u, cfg.return_schedules);
    ASSERT_ACCEPTED(still_s, 0.01765f);
    TEST_ASSERT_EQUAL_UINT32(30u, cfg.still_units);
}

static void test_a_threshold_itself_is_no_reason(void)
{
    supervisor_params_t p = params;
    p.u_uncertainty_V = 0.0f;
    p.residual_pu = 0.5f;
    p.lost_pu = 0.5f;
    configure(0, &p);
    judge_with(0.5f, 50.0f);
    TEST_ASSERT_EQUAL_UINT32(SUPERVISOR_UNSURE, st.reasons);
    in.lambda_r_hat_Wb.alpha = 0.75f;
    judge_with(0.0f, 50.0f);
    TEST_ASSERT_EQUAL_UINT32(0u, st.reasons);
    /* From the corner itself on, the residual counts. */
    judge_with(0.875f, 3.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_IMPRESSED, st.confidence);
}

static void test_reasons_and_states_are_the_numbers_of_the_fault_log(void)
{
    TEST_ASSERT_EQUAL_UINT32(1u, SUPERVISOR_UNSURE);
    TEST_ASSERT_EQUAL_UINT32(2u, SUPERVISOR_RESIDUAL);
    TEST_ASSERT_EQUAL_UINT32(4u, SUPERVISOR_FLUX);
    TEST_ASSERT_EQUAL_UINT32(8u, SUPERVISOR_LOST);
    TEST_ASSERT_EQUAL(0, SUPERVISOR_CLOSED);
    TEST_ASSERT_EQUAL(1, SUPERVISOR_DEGRADED);
    TEST_ASSERT_EQUAL(2, SUPERVISOR_IMPRESSED);
}

/* A machine turning at w_s that obeys its own equations, and an estimate `error` times its flux. */
static void turn_machine(int periods, double omega_s_rad_s, cplx i_A, cplx error)
{
    const double kr = (double)motor.kr;
    const double eps_H = (double)motor.eps_H;
    const double Rs_ohm = (double)in.Rs_ohm;
    const cplx per_period = cexp(I * omega_s_rad_s * (double)PERIOD_S);
    cplx turned = 1.0;
    in.omega_s_hat_rad_s = (float)omega_s_rad_s;
    for (int k = 0; k < periods; k++) {
        const cplx s_before_Wb = turned * (0.5 + eps_H * i_A);
        turned *= per_period;
        const cplx s_Wb = turned * (0.5 + eps_H * i_A);
        u_s_V = ab(kr * (s_Wb - s_before_Wb) / (double)PERIOD_S + Rs_ohm * turned * i_A);
        in.i_s_A = ab(turned * i_A);
        in.lambda_r_hat_Wb = ab(turned * 0.5 * error);
        step();
    }
}

static void test_an_estimate_that_agrees_with_the_stator_equation_stays_closed(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        configure(machine, &params);
        st = (supervisor_state_t){0};
        in.Rs_ohm = motor.Rs_ohm;
        in.omega_e_hat_rad_s = 55.0f;
        turn_machine(50 * TURN, 63.0, 4.9 + 8.0 * I, 1.0);
        TEST_ASSERT_EQUAL(SUPERVISOR_CLOSED, st.confidence);
        TEST_ASSERT_EQUAL_UINT32(0u, st.reasons);
        /* What is left is the uncertainty: dV/|w_s| over the flux. */
        const double dV_V = 0.05 * (double)in.Rs_ohm * cabs(4.9 + 8.0 * I) + 0.1;
        ASSERT_NEAR(2e-3, dV_V / (double)motor.kr / 63.0 / 0.5, st.flux_error_bound_pu);
    }
}

static void test_the_second_flux_sees_the_error_above_its_corner_in_full(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        configure(machine, &params);
        st = (supervisor_state_t){0};
        in.Rs_ohm = motor.Rs_ohm;
        turn_machine(2000 * TURN, 10.0, 4.9 + 3.0 * I, 1.2);
        const double dV_V = 0.05 * (double)in.Rs_ohm * cabs(4.9 + 3.0 * I) + 0.1;
        /* d = error w/(w + w_c) is undone: the bound holds the whole .2 of .5 Wb, over .6 Wb. */
        ASSERT_NEAR(3e-3, (0.1 + dV_V / (double)motor.kr / 10.0) / 0.6, st.flux_error_bound_pu);
    }
}

/* Everything a judgement computes, in double precision. */
typedef struct {
    cplx s, d, emf_sum;
    bool started;
    double omega_s;
    double lambda;
    double i_s;
    double error_bound_pu;
    double residual_pu;
} ref_t;

/* Every period adds; every fourth ties; one of sixteen measures, the next one weighs. */
static void ref_step(ref_t *r)
{
    const double kr = (double)motor.kr;
    const cplx i_A = c(in.i_s_A);
    r->emf_sum += c(u_s_V) - (double)in.Rs_ohm * i_A;
    if (slot % 4u == 2u) {
        const cplx target = c(in.lambda_r_hat_Wb) + (double)motor.eps_H * i_A;
        const cplx s = r->started ? r->s + (double)PERIOD_S / kr * r->emf_sum : target;
        r->started = true;
        r->emf_sum = 0.0;
        r->d = target - s;
        r->s = s + 3.0 * 4.0 * (double)PERIOD_S * r->d;
    }
    if (slot == 14u) {
        r->omega_s += 0.25 * ((double)in.omega_s_hat_rad_s - r->omega_s);
        r->lambda = cabs(c(in.lambda_r_hat_Wb));
        r->i_s = cabs(i_A);
        r->residual_pu = cabs(r->d) / r->lambda;
    }
    if (slot == 15u) {
        const double dV = (0.05 * (double)in.Rs_ohm * r->i_s + 0.1) / kr / r->lambda;
        r->error_bound_pu = (r->residual_pu * hypot(r->omega_s, 3.0) + dV) / fabs(r->omega_s);
    }
}

static void draw_inputs(uint32_t *seed)
{
    u_s_V = (ab_t){20.0f * noise(seed), 20.0f * noise(seed)};
    in.i_s_A = (ab_t){8.0f * noise(seed), 8.0f * noise(seed)};
    in.e1_A = (ab_t){noise(seed), noise(seed)};
    in.lambda_r_hat_Wb = (ab_t){0.4f + 0.1f * noise(seed), 0.2f * noise(seed)};
    in.omega_s_hat_rad_s = -60.0f + 5.0f * noise(seed);
    in.omega_e_hat_rad_s = -50.0f + 5.0f * noise(seed);
}

static void test_a_judgement_equals_the_double_one_on_both_machines(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        configure(machine, &params);
        st = (supervisor_state_t){0};
        ref_t ref = {0};
        uint32_t seed = 7u;
        slot = 0u;
        for (int k = 0; k < 40 * TURN; k++) {
            draw_inputs(&seed);
            step();
            ref_step(&ref);
            ASSERT_NEAR(2e-5, creal(ref.s), st.s_Wb.alpha);
            ASSERT_NEAR(2e-5, cimag(ref.s), st.s_Wb.beta);
            ASSERT_NEAR(2e-4 * (1.0 + fabs(ref.error_bound_pu)), ref.error_bound_pu,
                        st.flux_error_bound_pu);
            ASSERT_NEAR(1e-3, ref.omega_s, st.omega_s_rad_s);
        }
        TEST_ASSERT_TRUE(ref.residual_pu > 0.01);
    }
}

static void test_the_speed_bound_equals_the_double_one_while_closed(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        configure(machine, &params);
        const reference_model_t ref = reference_model(&reference_machine[machine], 0.0);
        st = (supervisor_state_t){0};
        in.e1_A = (ab_t){0.3f, -0.4f};
        const cplx l2_ohm = -1.2 + 0.7 * I;
        in.correction_V = ab(l2_ohm * c(in.e1_A));
        in.omega_e_hat_rad_s = 62.0f;
        judge_with(0.05f, 50.0f);
        TEST_ASSERT_EQUAL(SUPERVISOR_CLOSED, st.confidence);
        const double flux_pu = (double)st.flux_error_bound_pu;
        const double pull_rad_s = cabs(ref.a21 + l2_ohm) * 0.5 / 0.5; /* |e1| over the flux */
        const double estimate_rad_s =
            (hypot(ref.tau, 12.0) * flux_pu + pull_rad_s) / (1.0 - flux_pu);
        ASSERT_NEAR(1e-4, estimate_rad_s + 0.3 * 12.0 + 0.02 * 50.0, st.omega_bound_rad_s);
    }
}

/* Backwards the current's error widens the bound as it does forwards. */
static void test_the_speed_bound_is_that_of_the_other_direction(void)
{
    in.omega_e_hat_rad_s = 62.0f;
    judge_with(0.05f, 50.0f);
    const float forwards_rad_s = st.omega_bound_rad_s;
    st = (supervisor_state_t){0};
    in.omega_e_hat_rad_s = -62.0f;
    judge_with(0.05f, -50.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_CLOSED, st.confidence);
    ASSERT_SAME_FLOAT(forwards_rad_s, st.omega_bound_rad_s);
}

/* Steady states of machine and observer, by the flux rows of eq. (1) and (3): a flux error of 5 %
 * in any direction and a speed error of 3 rad/s make the e1 that the bound has to cover. */
static void test_no_steady_speed_error_is_beyond_the_bound(void)
{
    supervisor_params_t p = params;
    p.Rr_uncertainty_pu = 0.0f;
    p.i_uncertainty_pu = 0.0f;
    configure(0, &p);
    const reference_model_t ref = reference_model(&reference_machine[0], 0.0);
    const double omega_s_rad_s = 50.0;
    const double omega_hat_rad_s = 45.0;
    in.omega_e_hat_rad_s = (float)omega_hat_rad_s;
    const cplx l2_ohm = 0.9 - 1.4 * I;
    for (int k = 0; k < 32; k++) {
        const double err_rad_s = ((k % 2) == 0) ? 3.0 : -3.0;
        const cplx lambda_hat_Wb = 0.5;
        const cplx lambda_Wb = lambda_hat_Wb * (1.0 - 0.05 * cexp(0.4 * k * I));
        const cplx slip = ref.tau + I * (omega_s_rad_s - (omega_hat_rad_s - err_rad_s));
        const cplx slip_hat = ref.tau + I * (omega_s_rad_s - omega_hat_rad_s);
        const cplx e1_A = (slip_hat * lambda_hat_Wb - slip * lambda_Wb) / (ref.a21 + l2_ohm);
        in.e1_A = ab(e1_A);
        in.correction_V = ab(l2_ohm * e1_A);
        st = (supervisor_state_t){0};
        judge_with(0.05f, (float)omega_s_rad_s);
        TEST_ASSERT_EQUAL(SUPERVISOR_CLOSED, st.confidence);
        TEST_ASSERT_TRUE((double)st.omega_bound_rad_s >= fabs(err_rad_s));
    }
}

static void test_no_speed_bound_is_stated_without_orientation(void)
{
    judge_with(0.3f, 50.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_DEGRADED, st.confidence);
    ASSERT_SAME_FLOAT(600.0f, st.omega_bound_rad_s);
    /* Nor a larger one than the speed may be. */
    st = (supervisor_state_t){0};
    in.e1_A = (ab_t){1e4f, 0.0f};
    judge_with(0.05f, 50.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_CLOSED, st.confidence);
    ASSERT_SAME_FLOAT(600.0f, st.omega_bound_rad_s);
}

/* All vectors turned, or mirrored with the speeds' signs: the same judgement. */
static void test_a_judgement_knows_no_direction(void)
{
    const cplx turn = cexp(2.1 * I);
    supervisor_state_t turned = {0};
    supervisor_state_t mirrored = {0};
    uint32_t seed = 3u;
    for (int k = 0; k < 20 * TURN; k++) {
        draw_inputs(&seed);
        supervisor_in_t rotated = in;
        rotated.i_s_A = ab(turn * c(in.i_s_A));
        rotated.lambda_r_hat_Wb = ab(turn * c(in.lambda_r_hat_Wb));
        rotated.e1_A = ab(turn * c(in.e1_A));
        supervisor_in_t mirror = in;
        mirror.i_s_A = ab_conj(in.i_s_A);
        mirror.lambda_r_hat_Wb = ab_conj(in.lambda_r_hat_Wb);
        mirror.omega_e_hat_rad_s = -in.omega_e_hat_rad_s;
        mirror.omega_s_hat_rad_s = -in.omega_s_hat_rad_s;
        step();
        step_with(&turned, &rotated, ab(turn * c(u_s_V)));
        step_with(&mirrored, &mirror, ab_conj(u_s_V));
        ASSERT_NEAR(1e-4, st.flux_error_bound_pu, turned.flux_error_bound_pu);
        ASSERT_SAME_FLOAT(st.flux_error_bound_pu, mirrored.flux_error_bound_pu);
        ASSERT_SAME_FLOAT(st.omega_bound_rad_s, mirrored.omega_bound_rad_s);
        TEST_ASSERT_EQUAL(st.confidence, mirrored.confidence);
    }
}

/* The parts of a judgement follow one another from its measurement on: the first one after three
 * quarters of the first turn, and then one in every turn. */
static void test_one_slot_of_sixteen_judges(void)
{
    in.lambda_r_hat_Wb = (ab_t){0.0f, 0.0f};
    for (int k = 1; k <= 3 * TURN; k++) {
        st.reasons = 0x80u;
        step();
        TEST_ASSERT_EQUAL((k > TURN - 1) && (slot == SLOT_SUPERVISOR_DECIDE), st.reasons != 0x80u);
    }
}

/* Started in the middle of one: no part of a judgement without those before it. */
static void test_a_judgement_begins_with_its_measurement(void)
{
    slot = SLOT_SUPERVISOR_MEASURE; /* the next one weighs */
    const supervisor_findings_t none = {0};
    for (int k = 0; k < 3; k++) {
        step();
        TEST_ASSERT_FALSE(st.judged);
        TEST_ASSERT_EQUAL_MEMORY(&none, &st.found, sizeof none);
        ASSERT_SAME_FLOAT(0.0f, st.flux_error_bound_pu);
        ASSERT_SAME_FLOAT(0.0f, st.omega_bound_rad_s);
        TEST_ASSERT_EQUAL_UINT32(0u, st.reasons);
    }
    do {
        step();
    } while (slot != SLOT_SUPERVISOR_MEASURE);
    TEST_ASSERT_TRUE(st.judged);
    ASSERT_NEAR(1e-6, 0.5, st.found.lambda_Wb);
}

/* Each slot does its own part and nothing else's. */
static void test_each_part_has_a_slot_of_its_own(void)
{
    in.lambda_r_hat_Wb = (ab_t){0.5f, 0.1f};
    in.i_s_A = (ab_t){3.0f, 1.0f};
    u_s_V = (ab_t){7.0f, -2.0f};
    for (int k = 0; k < 2 * TURN; k++) {
        step();
    }
    for (int k = 0; k < TURN; k++) {
        const supervisor_state_t before = st;
        st.found.residual_pu += 0.3f;
        const supervisor_state_t marked = st;
        step();
        const bool ties = slot_is_quarter(slot, SLOT_QUARTER_SUPERVISOR);
        TEST_ASSERT_EQUAL(ties, memcmp(&marked.s_Wb, &st.s_Wb, sizeof st.s_Wb) != 0);
        const bool finds = (slot == SLOT_SUPERVISOR_MEASURE) || (slot == SLOT_SUPERVISOR_WEIGH);
        TEST_ASSERT_EQUAL(finds, memcmp(&marked.found, &st.found, sizeof st.found) != 0);
        TEST_ASSERT_EQUAL(slot == SLOT_SUPERVISOR_WEIGH, exact_bits(marked.flux_error_bound_pu) !=
                                                             exact_bits(st.flux_error_bound_pu));
        if (!supervisor_is_due(slot)) {
            supervisor_state_t expected = marked;
            supervisor_add(&expected, u_s_V, in.i_s_A, in.Rs_ohm);
            TEST_ASSERT_EQUAL_MEMORY(&expected, &st, sizeof st);
        }
        st.found = before.found;
    }
    uint32_t due = 0u;
    for (uint32_t n = 0u; n < SLOT_COUNT; n++) {
        due |= supervisor_is_due(n) ? (1u << n) : 0u;
    }
    TEST_ASSERT_EQUAL_HEX32((1u << 2) | (1u << 6) | (1u << 10) | (1u << 14) | (1u << 15) | 3u, due);
}

/* The EMF of all periods since the last tie counts, whatever the slots in between did. */
static void test_the_flux_is_tied_every_fourth_period_and_misses_no_emf(void)
{
    in.lambda_r_hat_Wb = (ab_t){0.4f, 0.0f};
    for (int k = 0; k < TURN; k++) {
        step();
    }
    cplx s_Wb = c(st.s_Wb);
    cplx sum_V = c(st.emf_sum_V);
    for (int k = 0; k < 2 * TURN; k++) {
        u_s_V = (ab_t){10.0f * (float)(k + 1), -5.0f * (float)k};
        in.i_s_A = (ab_t){0.25f * (float)k, 1.0f};
        sum_V += c(u_s_V) - (double)in.Rs_ohm * c(in.i_s_A);
        step();
        if (slot % (uint32_t)QUARTER == 2u) {
            s_Wb += (double)PERIOD_S / (double)motor.kr * sum_V;
            sum_V = 0.0;
            const cplx target_Wb = 0.4 + (double)motor.eps_H * c(in.i_s_A);
            ASSERT_NEAR(1e-5, 0.0, cabs(target_Wb - s_Wb - c(st.d_Wb)));
            s_Wb += 3.0 * 4.0 * (double)PERIOD_S * (target_Wb - s_Wb);
        }
        ASSERT_NEAR(1e-5, 0.0, cabs(s_Wb - c(st.s_Wb)));
        ASSERT_NEAR(1e-3, 0.0, cabs(sum_V - c(st.emf_sum_V)));
    }
}

/* In the first slot that ties, whatever was summed before it. */
static void test_the_first_tie_takes_the_estimate_for_the_flux(void)
{
    in.i_s_A = (ab_t){4.0f, 2.0f};
    u_s_V = (ab_t){300.0f, 200.0f};
    do {
        TEST_ASSERT_FALSE(st.started);
        step();
    } while (slot != SLOT_QUARTER_SUPERVISOR);
    TEST_ASSERT_TRUE(st.started);
    ASSERT_NEAR(1e-6, 0.5 + (double)motor.eps_H * 4.0, st.s_Wb.alpha);
    ASSERT_NEAR(1e-6, (double)motor.eps_H * 2.0, st.s_Wb.beta);
}

/* dV = .1 V: at 50 rad/s and .5 Wb that is .004 of bound; d counts hypot(50, 3)/50 = 1.0018. */
static void test_a_flux_error_of_a_quarter_is_degraded_and_less_is_not(void)
{
    judge_with(0.244f, 50.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_CLOSED, st.confidence);
    judge_with(0.247f, 50.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_DEGRADED, st.confidence);
    TEST_ASSERT_EQUAL_UINT32(SUPERVISOR_UNSURE, st.reasons);
}

static void test_the_wedge_under_load_is_degraded_and_its_edge_grows_with_the_current(void)
{
    /* .1 V + 5 % of .93 ohm and 10 A = .565 V: a quarter of .5 Wb at 4.52 rad/s. */
    const float omega_rad_s[] = {4.4f, 4.6f};
    for (int k = 0; k < 2; k++) {
        st = (supervisor_state_t){0};
        turn_machine(20 * TURN, (double)omega_rad_s[k], 5.0 + 8.66 * I, 1.0);
        TEST_ASSERT_EQUAL(k == 0, (st.reasons & SUPERVISOR_UNSURE) != 0u);
    }
    /* Without load the same frequency is safe. */
    st = (supervisor_state_t){0};
    turn_machine(20 * TURN, 4.4, 5.0, 1.0);
    TEST_ASSERT_EQUAL_UINT32(0u, st.reasons);
}

static void test_closed_comes_back_after_a_time_below_the_lower_threshold(void)
{
    judge_with(0.3f, 50.0f);
    /* Between the thresholds: no reason left, no return either. */
    judge_times(50, 0.178f, 50.0f);
    TEST_ASSERT_EQUAL_UINT32(0u, st.reasons);
    TEST_ASSERT_EQUAL(SUPERVISOR_DEGRADED, st.confidence);
    judge_times(9, 0.17f, 50.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_DEGRADED, st.confidence);
    judge_with(0.178f, 50.0f); /* not on end: counted anew */
    judge_times(9, 0.17f, 50.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_DEGRADED, st.confidence);
    judge_with(0.17f, 50.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_CLOSED, st.confidence);
}

/* The chord of 25 degrees is .43; dV/hypot(50, 3) = .004 on top is explained. */
static void test_a_residual_beyond_the_uncertainty_is_a_loss_indicator(void)
{
    judge_with(0.432f, 50.0f);
    TEST_ASSERT_EQUAL_UINT32(SUPERVISOR_UNSURE, st.reasons);
    judge_with(0.436f, 50.0f);
    TEST_ASSERT_EQUAL_UINT32(SUPERVISOR_UNSURE | SUPERVISOR_RESIDUAL, st.reasons);
    TEST_ASSERT_EQUAL(SUPERVISOR_DEGRADED, st.confidence);
}

static void test_a_large_residual_asks_for_impressed_current_at_once(void)
{
    judge_with(0.602f, 50.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_DEGRADED, st.confidence);
    judge_with(0.606f, 50.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_IMPRESSED, st.confidence);
    TEST_ASSERT_EQUAL_UINT32(SUPERVISOR_UNSURE | SUPERVISOR_RESIDUAL | SUPERVISOR_LOST, st.reasons);
}

static void test_a_lasting_residual_asks_for_impressed_current(void)
{
    judge_times(5, 0.5f, 50.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_DEGRADED, st.confidence);
    judge_with(0.4f, 50.0f); /* not on end */
    judge_times(5, 0.5f, 50.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_DEGRADED, st.confidence);
    judge_with(0.5f, 50.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_IMPRESSED, st.confidence);
    /* Asked for until everything is quiet, not only until it is less bad. */
    judge_times(50, 0.3f, 50.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_IMPRESSED, st.confidence);
    judge_times(9, 0.1f, 50.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_IMPRESSED, st.confidence);
    judge_with(0.1f, 50.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_CLOSED, st.confidence);
}

static void test_counters_stop_at_their_limit(void)
{
    judge_times(100, 0.5f, 50.0f);
    TEST_ASSERT_EQUAL_UINT32(5u, st.suspect_schedules);
    judge_times(100, 0.1f, 50.0f);
    TEST_ASSERT_EQUAL_UINT32(10u, st.quiet_schedules);
    TEST_ASSERT_EQUAL_UINT32(0u, st.suspect_schedules);
}

/* Below the corner a residual is Rs: a standing shaft with a wrong Rs asks for nothing. */
static void test_a_residual_below_the_corner_is_no_loss(void)
{
    judge_times(100, 0.9f, 2.99f);
    TEST_ASSERT_EQUAL_UINT32(SUPERVISOR_UNSURE, st.reasons);
    TEST_ASSERT_EQUAL(SUPERVISOR_DEGRADED, st.confidence);
    judge_with(0.9f, -3.01f);
    TEST_ASSERT_EQUAL(SUPERVISOR_IMPRESSED, st.confidence);
}

static void test_at_zero_frequency_nothing_is_sure_and_the_bound_is_finite(void)
{
    judge_with(0.0f, 0.0f);
    TEST_ASSERT_EQUAL_UINT32(SUPERVISOR_UNSURE, st.reasons);
    /* .1 V over .5 Wb and the floor of 1e-3 rad/s. */
    ASSERT_NEAR(0.1, 200.0 / (double)motor.kr, st.flux_error_bound_pu);
}

static void test_more_flux_than_one_and_a_half_times_nominal_is_a_loss_indicator(void)
{
    in.lambda_r_hat_Wb.alpha = 0.749f;
    judge_with(0.0f, 50.0f);
    TEST_ASSERT_EQUAL_UINT32(0u, st.reasons);
    in.lambda_r_hat_Wb.alpha = 0.751f;
    judge_times(5, 0.0f, 50.0f);
    TEST_ASSERT_EQUAL_UINT32(SUPERVISOR_FLUX, st.reasons);
    TEST_ASSERT_EQUAL(SUPERVISOR_DEGRADED, st.confidence);
    TEST_ASSERT_EQUAL_UINT32(0u, st.quiet_schedules);
    judge_with(0.0f, 50.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_IMPRESSED, st.confidence);
}

/* At the limit of the torque, and within twice the corner of zero, .85 of that is enough. */
static void test_less_flux_is_one_under_all_torque_near_zero_frequency(void)
{
    const float near_rad_s = 1.9f * cfg.p.corner_rad_s, far_rad_s = 2.1f * cfg.p.corner_rad_s;
    in.at_limit = true;
    const struct {
        float lambda_Wb, omega_rad_s;
        bool at_limit, high;
    } cases[] = {
        {0.637f, near_rad_s, true, false}, {0.638f, near_rad_s, true, true},
        {0.638f, -near_rad_s, true, true}, {0.638f, near_rad_s, false, false},
        {0.638f, far_rad_s, true, false},  {0.751f, far_rad_s, true, true},
    };
    for (unsigned k = 0; k < 6u; k++) {
        in.lambda_r_hat_Wb.alpha = cases[k].lambda_Wb;
        in.at_limit = cases[k].at_limit;
        judge_with(0.0f, cases[k].omega_rad_s);
        TEST_ASSERT_EQUAL_MESSAGE(cases[k].high, (st.reasons & SUPERVISOR_FLUX) != 0u,
                                  cases[k].high ? "high" : "not high");
    }
}

/* Steered away from zero, and yet a field that stands under torque: it is not where it is believed
 * to be. */
static void configure_steered(void)
{
    supervisor_params_t p = params;
    p.still_rad_s = 2.0f;
    p.still_A = 3.0f;
    p.still_s = 0.016f; /* 5 turns */
    configure(0, &p);
    in.i_s_A = (ab_t){0.0f, 3.01f};
}

static void test_a_field_that_stands_under_torque_is_a_loss(void)
{
    configure_steered();
    judge_times(5, 0.0f, -1.99f);
    TEST_ASSERT_EQUAL_UINT32(SUPERVISOR_UNSURE | SUPERVISOR_STILL, st.reasons);
    TEST_ASSERT_EQUAL(SUPERVISOR_DEGRADED, st.confidence);
    judge_with(0.0f, 1.99f);
    TEST_ASSERT_EQUAL_UINT32(SUPERVISOR_UNSURE | SUPERVISOR_STILL | SUPERVISOR_LOST, st.reasons);
    TEST_ASSERT_EQUAL(SUPERVISOR_IMPRESSED, st.confidence);
    /* I-f turns the field itself, through zero too. */
    judge_times(100, 0.0f, 0.0f);
    TEST_ASSERT_EQUAL_UINT32(SUPERVISOR_UNSURE, st.reasons);
    TEST_ASSERT_EQUAL_UINT32(0u, st.still_units);
}

/* An estimate that jumps out of the band now and then only takes back what it was out. */
static void test_a_field_that_mostly_stands_is_a_loss_too(void)
{
    configure_steered();
    judge_times(4, 0.0f, 1.0f);
    judge_times(2, 0.0f, 10.0f); /* the low-pass is behind by a schedule */
    TEST_ASSERT_TRUE((st.still_units > 0u) && (st.still_units < 25u));
    judge_times(20, 0.0f, 10.0f);
    TEST_ASSERT_EQUAL_UINT32(0u, st.still_units);
    judge_times(100, 0.0f, 10.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_CLOSED, st.confidence);
}

/* A torque that grows by a fifth: the flux it rests on may be going. A field that stands is given
 * its time all the same. */
static void test_a_torque_that_grows_is_seen(void)
{
    configure_steered();
    st.torque_Wb_A = 0.5f * 3.01f / 1.19f;
    judge_with(0.0f, 1.0f);
    TEST_ASSERT_FALSE(st.surges);
    for (int k = 0; k < 4; k++) {
        st.torque_Wb_A = 0.5f * 3.01f / 1.21f;
        judge_with(0.0f, 1.0f);
        TEST_ASSERT_TRUE(st.surges);
    }
    TEST_ASSERT_EQUAL(SUPERVISOR_DEGRADED, st.confidence);
    judge_with(0.0f, 1.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_IMPRESSED, st.confidence);
}

static void test_a_torque_grows_near_zero_frequency_and_under_load_alone(void)
{
    configure_steered();
    const struct {
        float omega_s_rad_s;
        float i_q_A;
        bool told;
        bool surges;
    } as[] = {{-3.99f, 3.01f, false, true},
              {4.01f, 3.01f, false, false},
              {1.0f, 1.43f, false, false},
              {1.0f, 3.01f, true, false}, /* torque mode: it grows as it is told */
              {1.0f, 1.45f, false, true}};
    for (size_t k = 0; k < sizeof as / sizeof as[0]; k++) {
        st = (supervisor_state_t){0};
        in.i_s_A = (ab_t){0.0f, -as[k].i_q_A};
        in.told_torque = as[k].told;
        judge_with(0.0f, as[k].omega_s_rad_s);
        TEST_ASSERT_EQUAL(as[k].surges, st.surges);
    }
    /* The mean follows within .3 s: 94 turns of 3.2 ms. */
    judge_times(94, 0.0f, 1.0f);
    ASSERT_NEAR(0.01, (1.0 - exp(-1.0)) * 0.5 * 1.45, st.torque_Wb_A);
}

static void test_a_residual_under_a_torque_that_grows_is_a_loss_sooner(void)
{
    configure_steered();
    st.torque_Wb_A = 0.5f * 3.01f;
    judge_with(0.6f, 3.9f);
    judge_with(0.6f, 3.9f);
    TEST_ASSERT_EQUAL_UINT32(SUPERVISOR_UNSURE | SUPERVISOR_RESIDUAL, st.reasons);
    st.torque_Wb_A = 0.0f;
    judge_with(0.6f, 3.9f);
    TEST_ASSERT_EQUAL_UINT32(SUPERVISOR_UNSURE | SUPERVISOR_RESIDUAL | SUPERVISOR_LOST, st.reasons);
}

/* Five times as long. */
static void test_a_field_that_stands_under_little_torque_is_a_loss_later(void)
{
    configure_steered();
    in.i_s_A = (ab_t){0.0f, 1.21f};
    judge_times(25, 0.0f, 1.0f);
    TEST_ASSERT_EQUAL_UINT32(SUPERVISOR_UNSURE | SUPERVISOR_STILL, st.reasons);
    TEST_ASSERT_EQUAL(SUPERVISOR_DEGRADED, st.confidence);
    judge_with(0.0f, 1.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_IMPRESSED, st.confidence);
}

/* All torque in use, and yet the field hardly turns: 1.8 times as fast still stands. */
static void test_a_slow_field_at_the_limit_of_the_torque_is_a_loss_too(void)
{
    configure_steered();
    in.at_limit = true;
    judge_times(50, 0.0f, 3.61f);
    TEST_ASSERT_EQUAL_UINT32(0u, st.still_units);
    TEST_ASSERT_EQUAL(SUPERVISOR_CLOSED, st.confidence);
    judge_times(6, 0.0f, -3.59f);
    TEST_ASSERT_EQUAL(SUPERVISOR_IMPRESSED, st.confidence);
}

/* Little torque current may be all there is. */
static void test_at_the_limit_little_torque_counts_as_long_as_ever(void)
{
    configure_steered();
    in.at_limit = true;
    in.i_s_A = (ab_t){0.0f, 1.21f};
    judge_times(25, 0.0f, 3.5f);
    TEST_ASSERT_EQUAL(SUPERVISOR_DEGRADED, st.confidence);
    judge_with(0.0f, 3.5f);
    TEST_ASSERT_EQUAL(SUPERVISOR_IMPRESSED, st.confidence);
}

/* A dwell at the limit of the torque is a standing field where there is STILL, a swing where not.
 */
static void test_without_steering_a_dwell_at_the_limit_is_judged_by_its_swing(void)
{
    in.swing_rad_s = 2.0f;
    in.swing_omega_rad_s = 8.0f;
    in.at_limit = true;
    judge_with(0.9f, 0.0f);
    TEST_ASSERT_TRUE((st.reasons & SUPERVISOR_LOST) != 0u);
    setUp();
    configure_steered();
    in.swing_rad_s = 2.0f;
    in.swing_omega_rad_s = 8.0f;
    in.at_limit = true;
    judge_with(0.0f, 0.0f);
    TEST_ASSERT_TRUE((st.reasons & SUPERVISOR_STILL) != 0u);
    /* Over between two parts of a judgement: it is not divided by. */
    in.at_limit = false;
    judge_with(0.0f, 0.0f);
    slot = SLOT_SUPERVISOR_WEIGH - 1u;
    in.swing_rad_s = 0.0f;
    step();
    TEST_ASSERT_TRUE(isfinite(st.found.excess_pu));
}

/* The mean of .3 s is half after .3 s ln 2 = .21 s, 66 judgements, whether the field should swing
 * or not. */
static void test_beside_a_field_that_stands_under_torque_no_speed_is_known(void)
{
    const float swing_rad_s[] = {0.0f, 0.8f};
    for (int k = 0; k < 2; k++) {
        setUp();
        configure_steered();
        in.i_s_A = (ab_t){0.0f, 1.21f};
        in.swing_rad_s = swing_rad_s[k];
        in.swing_omega_rad_s = 8.0f;
        cfg.still_units = 1000u; /* no take-over meanwhile */
        judge_times(65, 0.0f, 1.0f);
        TEST_ASSERT_EQUAL(SUPERVISOR_DEGRADED, st.confidence);
        TEST_ASSERT_FALSE(supervisor_speed_unknown(&st));
        judge_with(0.0f, 1.0f);
        TEST_ASSERT_TRUE(supervisor_speed_unknown(&st));
        st.confidence = SUPERVISOR_CLOSED;
        TEST_ASSERT_FALSE(supervisor_speed_unknown(&st));
        st.confidence = SUPERVISOR_IMPRESSED; /* lost, and only told */
        TEST_ASSERT_TRUE(supervisor_speed_unknown(&st));
    }
    st = (supervisor_state_t){0};
    in.i_s_A = (ab_t){8.0f, 0.59f}; /* without torque */
    judge_times(200, 0.0f, 1.0f);
    ASSERT_SAME_FLOAT(0.0f, st.standing_pu);
}

/* Beside a reaction that only warns a lost drive goes on by its estimate, whatever the field does.
 */
static void test_the_speed_of_a_lost_drive_is_unknown(void)
{
    st.confidence = SUPERVISOR_DEGRADED;
    TEST_ASSERT_FALSE(supervisor_speed_unknown(&st));
    st.confidence = SUPERVISOR_IMPRESSED;
    TEST_ASSERT_TRUE(supervisor_speed_unknown(&st));
}

/* A flux error of so much at 5 rad/s: how many judgements until the speed is unknown; 200: never.
 */
static int judgements_until_unknown(float bound_pu)
{
    cfg.eps_H = 0.0f; /* no residual by the leakage */
    cfg.p.Rs_uncertainty_pu = 0.0f;
    cfg.p.u_uncertainty_V = bound_pu * 5.0f * sqrtf(ab_norm2(in.lambda_r_hat_Wb)) / cfg.kr_inv;
    int n = 0;
    while (!supervisor_speed_unknown(&st) && (n < 200)) {
        judge_with(0.0f, -5.0f);
        n++;
    }
    return n;
}

static void test_beside_a_flux_that_may_be_far_aside_no_speed_is_known(void)
{
    for (int k = 0; k < 5; k++) {
        const float bound_pu = (k == 0) ? 0.71f : ((k == 1) ? 0.69f : 0.9f);
        setUp();
        configure_steered();
        /* Half the torque from which a field that stands counts. */
        in.i_s_A = (k == 2) ? (ab_t){8.0f, 0.59f} : (ab_t){0.0f, 0.61f};
        cfg.p.still_rad_s = (k == 3) ? 0.0f : cfg.p.still_rad_s;
        in.omega_s_hat_rad_s = -5.0f;
        const int n = judgements_until_unknown(bound_pu);
        if ((k == 0) || (k == 4)) { /* the low-pass of w_s is behind for a few */
            TEST_ASSERT_INT_WITHIN(2, 68, n);
            TEST_ASSERT_EQUAL_UINT32(SUPERVISOR_UNSURE,
                                     st.reasons); /* the field turns: not STILL */
            judge_times(132, 0.0f, -5.0f);
            TEST_ASSERT_TRUE(st.standing_pu > 0.87f); /* and a doubt that goes on rises as before */
            st.flux_error_bound_pu = 0.7f;            /* not beyond the limit */
            st.standing_pu = 0.0f;
            slot = SLOT_SUPERVISOR_MEASURE - 1u;
            step();
            ASSERT_SAME_FLOAT(0.0f, st.standing_pu);
            st.flux_error_bound_pu = NAN;
            slot = SLOT_SUPERVISOR_MEASURE - 1u;
            step();
            TEST_ASSERT_TRUE(st.standing_pu > 0.0f); /* no number is no knowledge */
        } else {                                     /* .69; without torque; without steering */
            TEST_ASSERT_EQUAL_INT(200, n);
            TEST_ASSERT_EQUAL(SUPERVISOR_DEGRADED, st.confidence);
        }
    }
}

/* Once told the share falls to half in 3 s ln 2, 656 judgements; in a tenth of that once the
 * estimate is good again. */
static void test_a_doubt_about_the_speed_stays_while_a_lost_field_turns(void)
{
    configure_steered();
    in.i_s_A = (ab_t){0.0f, 1.21f};
    cfg.return_schedules = 100000u;
    st.standing_pu = 1.0f;
    st.confidence = SUPERVISOR_DEGRADED;
    judge_times(650, 0.0f, 50.0f);
    TEST_ASSERT_TRUE(supervisor_speed_unknown(&st));
    judge_times(15, 0.0f, 50.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_DEGRADED, st.confidence);
    TEST_ASSERT_FALSE(supervisor_speed_unknown(&st));
    st.standing_pu = 1.0f;
    st.confidence = SUPERVISOR_CLOSED;
    judge_times(66, 0.0f, 50.0f);
    TEST_ASSERT_TRUE(st.standing_pu < 0.5f);
}

/* It stands in every third judgement, in doubt: a mean like any other until it is told. */
static void test_a_field_that_stands_at_times_raises_no_doubt(void)
{
    configure_steered();
    in.i_s_A = (ab_t){0.0f, 1.21f};
    cfg.still_units = 100000u;
    cfg.return_schedules = 100000u;
    st.confidence = SUPERVISOR_DEGRADED;
    for (int k = 0; k < 3000; k++) {
        judge_with(0.0f, ((k % 3) == 0) ? 1.0f : 50.0f);
        TEST_ASSERT_FALSE(supervisor_speed_unknown(&st));
    }
}

static void test_a_field_may_stand_without_torque_or_steering(void)
{
    configure_steered();
    in.i_s_A = (ab_t){8.0f, 1.19f};
    judge_times(50, 0.0f, 0.0f);
    TEST_ASSERT_EQUAL_UINT32(SUPERVISOR_UNSURE, st.reasons);
    configure(0, &params);
    in.i_s_A = (ab_t){0.0f, 8.0f};
    judge_times(50, 0.0f, 0.0f);
    TEST_ASSERT_EQUAL_UINT32(SUPERVISOR_UNSURE, st.reasons);
    TEST_ASSERT_EQUAL(SUPERVISOR_DEGRADED, st.confidence);
}

/* I-f operation does not control the flux: a large one there does not keep it from ending. */
static void test_flux_is_no_loss_indicator_in_impressed_current(void)
{
    judge_with(0.9f, 50.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_IMPRESSED, st.confidence);
    in.lambda_r_hat_Wb.alpha = 0.751f;
    judge_times(9, 0.0f, 50.0f);
    TEST_ASSERT_EQUAL_UINT32(0u, st.reasons);
    TEST_ASSERT_EQUAL(SUPERVISOR_IMPRESSED, st.confidence);
    judge_with(0.0f, 50.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_CLOSED, st.confidence);
}

/* An estimate that ran away, or is none, does not make its own error small, or infinite. */
static void test_errors_are_measured_by_a_plausible_flux(void)
{
    const float estimate_Wb[] = {20.0f, 1e-6f};
    const double by_Wb[] = {0.75, 0.025};
    for (int k = 0; k < 2; k++) {
        st = (supervisor_state_t){0};
        in.lambda_r_hat_Wb.alpha = estimate_Wb[k];
        judge_with(0.0f, 50.0f);
        ASSERT_NEAR(1e-4, 0.1 / by_Wb[k] / 50.0, st.flux_error_bound_pu);
    }
}

static void test_what_is_not_a_number_never_passes_as_closed(void)
{
    float *const field[] = {&u_s_V.alpha,
                            &u_s_V.beta,
                            &in.i_s_A.alpha,
                            &in.i_s_A.beta,
                            &in.lambda_r_hat_Wb.alpha,
                            &in.lambda_r_hat_Wb.beta,
                            &in.Rs_ohm,
                            &in.omega_s_hat_rad_s};
    for (unsigned f = 0; f < sizeof field / sizeof field[0]; f++) {
        setUp();
        in.i_s_A = (ab_t){5.0f, 1.0f};
        u_s_V = (ab_t){5.0f, 1.0f};
        *field[f] = NAN;
        for (int k = 0; k <= TURN; k++) { /* to the end of the first judgement */
            step();
        }
        TEST_ASSERT_NOT_EQUAL(SUPERVISOR_CLOSED, st.confidence);
        ASSERT_SAME_FLOAT(600.0f, st.omega_bound_rad_s);
        /* And is remembered until the drive, which trips on it, zeroes the state. */
        *field[f] = 0.5f;
        for (int k = 0; k < 20 * TURN; k++) {
            step();
        }
        TEST_ASSERT_NOT_EQUAL(SUPERVISOR_CLOSED, st.confidence);
    }
    /* A speed or an e1 that is none takes the bound away. */
    setUp();
    in.omega_e_hat_rad_s = NAN;
    judge_with(0.05f, 50.0f);
    ASSERT_SAME_FLOAT(600.0f, st.omega_bound_rad_s);
}

static void test_two_supervisors_judge_apart(void)
{
    supervisor_state_t other = {0};
    judge_with(0.7f, 50.0f);
    const supervisor_state_t judged = st;
    slot = SLOT_QUARTER_SUPERVISOR;
    step_with(&other, &in, u_s_V);
    TEST_ASSERT_TRUE(other.started);
    TEST_ASSERT_EQUAL(SUPERVISOR_IMPRESSED, st.confidence);
    TEST_ASSERT_EQUAL(SUPERVISOR_CLOSED, other.confidence);
    TEST_ASSERT_EQUAL_MEMORY(&judged, &st, sizeof st);
}

/* A field at zero frequency that swings by A = 2 rad/s at W = 8 rad/s, on both machines: the bound
 * in double precision, and CLOSED where it says so. */
static void test_a_field_that_swings_about_zero_may_be_closed(void)
{
    for (int machine = 0; machine < 2; machine++) {
        setUp();
        configure(machine, &params);
        in.swing_rad_s = 2.0f;
        in.swing_omega_rad_s = 8.0f;
        in.omega_e_hat_rad_s = 0.0f;
        const motor_t *m = &reference_machine[machine];
        const double hidden =
            0.1 * (double)m->Lr_H / (double)m->M_H * (1.0 / 2.0 + 1.0 / 8.0) / 0.5;
        const double seen = 0.03 * sqrt(64.0 + 9.0) / 8.0;
        judge_times(20, 0.03f, 0.0f);
        ASSERT_NEAR(1e-5, seen + hidden, st.flux_error_bound_pu);
        TEST_ASSERT_EQUAL(SUPERVISOR_CLOSED, st.confidence);
        in.swing_rad_s = 0.8f; /* too little to tell a quarter of the flux */
        judge_with(0.03f, 0.0f);
        TEST_ASSERT_EQUAL(SUPERVISOR_DEGRADED, st.confidence);
        TEST_ASSERT_TRUE(st.found.swings);
        in.swing_rad_s = 0.0f;
        judge_times(20, 0.03f, 0.0f);
        TEST_ASSERT_EQUAL(SUPERVISOR_DEGRADED, st.confidence);
        TEST_ASSERT_TRUE(st.flux_error_bound_pu > 100.0f);
    }
}

/* Unlike a field that stands, one that swings tells when it is lost; and standing is no loss. */
static void test_a_field_that_swings_tells_a_loss_and_is_none_by_standing(void)
{
    configure_steered();
    in.swing_rad_s = 2.0f;
    in.swing_omega_rad_s = 8.0f;
    in.i_s_A = (ab_t){0.0f, 8.0f};
    judge_times(40, 0.0f, 0.0f);
    TEST_ASSERT_EQUAL_UINT32(0u, st.reasons & SUPERVISOR_STILL);
    TEST_ASSERT_NOT_EQUAL(SUPERVISOR_IMPRESSED, st.confidence);
    judge_with(0.8f, 0.0f);
    TEST_ASSERT_EQUAL(SUPERVISOR_IMPRESSED, st.confidence);
}

static void test_the_filter_of_the_frequency_keeps_its_time(void)
{
    TEST_ASSERT_EQUAL_FLOAT(0.25f, cfg.omega_s_gain);
    TEST_ASSERT_TRUE(supervisor_init(&cfg, &params, &motor, 0.5f * PERIOD_S));
    TEST_ASSERT_EQUAL_FLOAT(0.125f, cfg.omega_s_gain);
    TEST_ASSERT_TRUE(supervisor_init(&cfg, &params, &motor, 10.0f * PERIOD_S));
    TEST_ASSERT_EQUAL_FLOAT(1.0f, cfg.omega_s_gain);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_every_bad_parameter);
    RUN_TEST(test_init_refuses_a_senseless_motor_or_period);
    RUN_TEST(test_init_rounds_times_to_whole_judgements);
    RUN_TEST(test_a_threshold_itself_is_no_reason);
    RUN_TEST(test_reasons_and_states_are_the_numbers_of_the_fault_log);
    RUN_TEST(test_an_estimate_that_agrees_with_the_stator_equation_stays_closed);
    RUN_TEST(test_the_second_flux_sees_the_error_above_its_corner_in_full);
    RUN_TEST(test_a_judgement_equals_the_double_one_on_both_machines);
    RUN_TEST(test_the_speed_bound_equals_the_double_one_while_closed);
    RUN_TEST(test_the_speed_bound_is_that_of_the_other_direction);
    RUN_TEST(test_no_steady_speed_error_is_beyond_the_bound);
    RUN_TEST(test_no_speed_bound_is_stated_without_orientation);
    RUN_TEST(test_a_judgement_knows_no_direction);
    RUN_TEST(test_one_slot_of_sixteen_judges);
    RUN_TEST(test_a_judgement_begins_with_its_measurement);
    RUN_TEST(test_each_part_has_a_slot_of_its_own);
    RUN_TEST(test_the_flux_is_tied_every_fourth_period_and_misses_no_emf);
    RUN_TEST(test_the_first_tie_takes_the_estimate_for_the_flux);
    RUN_TEST(test_a_flux_error_of_a_quarter_is_degraded_and_less_is_not);
    RUN_TEST(test_the_wedge_under_load_is_degraded_and_its_edge_grows_with_the_current);
    RUN_TEST(test_closed_comes_back_after_a_time_below_the_lower_threshold);
    RUN_TEST(test_a_residual_beyond_the_uncertainty_is_a_loss_indicator);
    RUN_TEST(test_a_large_residual_asks_for_impressed_current_at_once);
    RUN_TEST(test_a_lasting_residual_asks_for_impressed_current);
    RUN_TEST(test_counters_stop_at_their_limit);
    RUN_TEST(test_a_residual_below_the_corner_is_no_loss);
    RUN_TEST(test_at_zero_frequency_nothing_is_sure_and_the_bound_is_finite);
    RUN_TEST(test_more_flux_than_one_and_a_half_times_nominal_is_a_loss_indicator);
    RUN_TEST(test_less_flux_is_one_under_all_torque_near_zero_frequency);
    RUN_TEST(test_a_field_that_stands_under_torque_is_a_loss);
    RUN_TEST(test_a_field_that_mostly_stands_is_a_loss_too);
    RUN_TEST(test_a_torque_that_grows_is_seen);
    RUN_TEST(test_a_torque_grows_near_zero_frequency_and_under_load_alone);
    RUN_TEST(test_a_residual_under_a_torque_that_grows_is_a_loss_sooner);
    RUN_TEST(test_a_field_that_stands_under_little_torque_is_a_loss_later);
    RUN_TEST(test_a_slow_field_at_the_limit_of_the_torque_is_a_loss_too);
    RUN_TEST(test_at_the_limit_little_torque_counts_as_long_as_ever);
    RUN_TEST(test_without_steering_a_dwell_at_the_limit_is_judged_by_its_swing);
    RUN_TEST(test_beside_a_field_that_stands_under_torque_no_speed_is_known);
    RUN_TEST(test_the_speed_of_a_lost_drive_is_unknown);
    RUN_TEST(test_beside_a_flux_that_may_be_far_aside_no_speed_is_known);
    RUN_TEST(test_a_doubt_about_the_speed_stays_while_a_lost_field_turns);
    RUN_TEST(test_a_field_that_stands_at_times_raises_no_doubt);
    RUN_TEST(test_a_field_may_stand_without_torque_or_steering);
    RUN_TEST(test_flux_is_no_loss_indicator_in_impressed_current);
    RUN_TEST(test_errors_are_measured_by_a_plausible_flux);
    RUN_TEST(test_what_is_not_a_number_never_passes_as_closed);
    RUN_TEST(test_two_supervisors_judge_apart);
    RUN_TEST(test_a_field_that_swings_about_zero_may_be_closed);
    RUN_TEST(test_a_field_that_swings_tells_a_loss_and_is_none_by_standing);
    RUN_TEST(test_the_filter_of_the_frequency_keeps_its_time);
    return UNITY_END();
}
