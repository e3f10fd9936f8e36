/* The law alone, and on the steady state of machine and observer in double precision. */
#include "rs_tracking.h"

#include <complex.h>
#include <math.h>

#include "exact.h"
#include "reference_machine.h"
#include "unity.h"

#define PERIOD_S 0.0002f

typedef double complex cplx;

static const rs_tracking_params_t good = {.gain_ohm_per_rad = 0.03f,
                                          .i_0_A = 1.5f,
                                          .min_rad_s = 1.9f,
                                          .max_rad_s = 38.0f,
                                          .back_rad_s = 2.2f,
                                          .low_pu = 0.98f,
                                          .high_pu = 1.5f,
                                          .quiet_s = 0.5f,
                                          .speed_err_rad_s = 3.0f,
                                          .slew_rad_s2 = 20.0f,
                                          .dwell_gain_ohm_per_s = 1.0f};

/* Coefficients of short binary fractions: expected results are exact. */
static const rs_tracking_config_t simple = {.gain_T_ohm_s_per_rad = 0.0625f,
                                            .i_0_A2 = 4.0f,
                                            .min_rad_s = 2.0f,
                                            .max_rad_s = 32.0f,
                                            .back_rad_s = 16.0f,
                                            .down_pu = -0.5f,
                                            .up_pu = 1.0f,
                                            .speed_err_rad_s = 3.0f,
                                            .moved_rad_s = 0.25f,
                                            .quiet_periods = 2u};

/* 2/(4 + 4) per A: .0625 * .25 A * 8 rad/s * .25 per A = 1/32 ohm a step. */
static const rs_tracking_in_t still = {.Rs_start_ohm = 1.0f,
                                       .e1_d_A = 0.25f,
                                       .i_q_A = 2.0f,
                                       .omega_s_hat_rad_s = 8.0f,
                                       .speed_err_rad_s = 0.0f,
                                       .changing = false};
#define STEP_OHM 0.03125f

static rs_tracking_config_t cfg;
static rs_tracking_state_t quiet;

void setUp(void)
{
    cfg = simple;
    quiet = (rs_tracking_state_t){.periods = 2u};
}

void tearDown(void)
{
}

/* What one step adds after a quiet time. */
static float added_ohm(rs_tracking_in_t in)
{
    rs_tracking_state_t st = quiet;
    rs_tracking_step(&cfg, &st, &in);
    return st.delta_ohm;
}

static void test_init_derives_the_coefficients(void)
{
    TEST_ASSERT_TRUE(rs_tracking_init(&cfg, &good, PERIOD_S));
    ASSERT_NEAR(1e-12, 0.03 * 2e-4, cfg.gain_T_ohm_s_per_rad);
    ASSERT_SAME_FLOAT(2.25f, cfg.i_0_A2);
    ASSERT_SAME_FLOAT(1.9f, cfg.min_rad_s);
    ASSERT_SAME_FLOAT(38.0f, cfg.max_rad_s);
    ASSERT_SAME_FLOAT(0.98f - 1.0f, cfg.down_pu);
    ASSERT_SAME_FLOAT(0.5f, cfg.up_pu);
    ASSERT_SAME_FLOAT(3.0f, cfg.speed_err_rad_s);
    ASSERT_NEAR(1e-9, 20.0 * 2e-4, cfg.moved_rad_s);
    ASSERT_NEAR(1e-9, 2e-4, cfg.dwell_gain_T_ohm);
    TEST_ASSERT_EQUAL_UINT32(2500u, cfg.quiet_periods);
    TEST_ASSERT_TRUE(rs_tracking_on(&cfg));
}

static void test_init_rounds_the_quiet_time_to_whole_periods(void)
{
    rs_tracking_params_t p = good;
    p.quiet_s = 0.625f;
    TEST_ASSERT_TRUE(rs_tracking_init(&cfg, &p, 0.25f));
    TEST_ASSERT_EQUAL_UINT32(3u, cfg.quiet_periods); /* 2.5 */
    p.quiet_s = 0.6175f;
    TEST_ASSERT_TRUE(rs_tracking_init(&cfg, &p, 0.25f));
    TEST_ASSERT_EQUAL_UINT32(2u, cfg.quiet_periods); /* 2.47 */
}

#define ASSERT_REFUSED(field, value)                                                               \
    do {                                                                                           \
        rs_tracking_params_t bad = good;                                                           \
        bad.field = (value);                                                                       \
        TEST_ASSERT_FALSE_MESSAGE(rs_tracking_init(&cfg, &bad, PERIOD_S), #field);                 \
    } while (0)

static void test_init_refuses_every_bad_number(void)
{
    for (int i = 0; i < NOT_POSITIVE_COUNT; i++) {
        const float x = not_positive(i);
        ASSERT_REFUSED(i_0_A, x);
        ASSERT_REFUSED(speed_err_rad_s, x);
        ASSERT_REFUSED(max_rad_s, x);
        ASSERT_REFUSED(low_pu, x);
        ASSERT_REFUSED(high_pu, x);
        TEST_ASSERT_FALSE(rs_tracking_init(&cfg, &good, x));
    }
    for (int i = 0; i < NOT_FINITE_COUNT; i++) {
        ASSERT_REFUSED(gain_ohm_per_rad, not_finite(i));
        ASSERT_REFUSED(min_rad_s, not_finite(i));
        ASSERT_REFUSED(back_rad_s, not_finite(i));
        ASSERT_REFUSED(quiet_s, not_finite(i));
        ASSERT_REFUSED(slew_rad_s2, not_finite(i));
        ASSERT_REFUSED(dwell_gain_ohm_per_s, not_finite(i));
    }
    ASSERT_REFUSED(gain_ohm_per_rad, -0.01f);
    ASSERT_REFUSED(slew_rad_s2, -0.1f);
    ASSERT_REFUSED(dwell_gain_ohm_per_s, -0.1f);
    ASSERT_REFUSED(quiet_s, -0.001f);
    ASSERT_REFUSED(quiet_s, 200.1f); /* more than a million periods */
    ASSERT_REFUSED(i_0_A, 1e-30f);   /* its square is zero: 0/0 without torque */
    ASSERT_REFUSED(i_0_A, 1e20f);    /* its square is infinite */
    TEST_ASSERT_FALSE(rs_tracking_on(&cfg));
}

static void test_init_refuses_bands_the_wrong_way_round(void)
{
    ASSERT_REFUSED(min_rad_s, -0.1f);
    ASSERT_REFUSED(back_rad_s, -0.1f);
    ASSERT_REFUSED(min_rad_s, 38.0f);
    ASSERT_REFUSED(low_pu, 1.001f);
    ASSERT_REFUSED(high_pu, 0.999f);
}

static void test_init_accepts_the_ends_of_the_ranges(void)
{
    rs_tracking_params_t p = good;
    p.min_rad_s = 0.0f;
    p.back_rad_s = 0.0f;
    p.quiet_s = 1000000.0f / 4096.0f;
    p.low_pu = 1.0f;
    p.high_pu = 1.0f;
    TEST_ASSERT_TRUE(rs_tracking_init(&cfg, &p, 1.0f / 4096.0f));
    TEST_ASSERT_EQUAL_UINT32(1000000u, cfg.quiet_periods);
    p.quiet_s = 0.0f;
    TEST_ASSERT_TRUE(rs_tracking_init(&cfg, &p, PERIOD_S));
    TEST_ASSERT_EQUAL_UINT32(0u, cfg.quiet_periods);
}

static void test_with_the_gain_zero_nothing_is_looked_at_and_it_is_off(void)
{
    const rs_tracking_params_t off = {.gain_ohm_per_rad = 0.0f, .i_0_A = NAN, .min_rad_s = -1.0f};
    TEST_ASSERT_TRUE(rs_tracking_init(&cfg, &off, NAN));
    TEST_ASSERT_FALSE(rs_tracking_on(&cfg));
}

static void test_without_an_error_along_the_flux_nothing_moves(void)
{
    rs_tracking_in_t in = still;
    rs_tracking_state_t st = {.delta_ohm = 0.375f, .periods = 2u};
    const rs_tracking_state_t before = st;
    in.e1_d_A = 0.0f;
    rs_tracking_step(&cfg, &st, &in);
    TEST_ASSERT_EQUAL_MEMORY(&before, &st, sizeof st);
}

static void test_one_step_agrees_with_double_arithmetic(void)
{
    uint32_t seed = 5u;
    TEST_ASSERT_TRUE(rs_tracking_init(&cfg, &good, PERIOD_S));
    for (int k = 0; k < 200; k++) {
        rs_tracking_state_t st = {.delta_ohm = 0.2f, .periods = 2500u};
        const rs_tracking_in_t in = {.Rs_start_ohm = 0.93f,
                                     .e1_d_A = 0.5f * noise(&seed),
                                     .i_q_A = 12.0f * noise(&seed),
                                     .omega_s_hat_rad_s = 20.0f + 17.0f * noise(&seed),
                                     .speed_err_rad_s = 2.9f * noise(&seed)};
        const double i_q = (double)in.i_q_A;
        const bool loaded = fabs(i_q) >= 1.5;
        const double step = loaded
                                ? 0.03 * 2e-4 * (double)in.e1_d_A * (double)in.omega_s_hat_rad_s *
                                      i_q / (i_q * i_q + 1.5 * 1.5)
                                : 0.0;
        rs_tracking_step(&cfg, &st, &in);
        ASSERT_NEAR(2e-8, 0.2 + step, st.delta_ohm); /* one rounding of .2 ohm */
    }
}

static void test_the_step_turns_with_each_factor_and_not_with_the_direction_of_rotation(void)
{
    ASSERT_SAME_FLOAT(STEP_OHM, added_ohm(still));
    rs_tracking_in_t in = still;
    in.e1_d_A = -in.e1_d_A;
    ASSERT_SAME_FLOAT(-STEP_OHM, added_ohm(in));
    in.omega_s_hat_rad_s = -in.omega_s_hat_rad_s;
    ASSERT_SAME_FLOAT(STEP_OHM, added_ohm(in));
    in.i_q_A = -in.i_q_A;
    ASSERT_SAME_FLOAT(-STEP_OHM, added_ohm(in));
    /* The mirror image of `still`: frequency and torque turn, the flux axis does not. */
    in.e1_d_A = -in.e1_d_A;
    ASSERT_SAME_FLOAT(STEP_OHM, added_ohm(in));
}

static void test_it_fades_out_without_torque(void)
{
    rs_tracking_in_t in = still;
    in.i_q_A = 0.0f;
    ASSERT_SAME_FLOAT(0.0f, added_ohm(in));
}

static void test_it_is_frozen_outside_its_band_of_frequency_either_way(void)
{
    const float inside_rad_s[] = {2.0f, 32.0f, -2.0f, -32.0f};
    const float outside_rad_s[] = {1.99f, 32.1f, -1.99f, -32.1f, 0.0f, NAN, INFINITY, -INFINITY};
    rs_tracking_in_t in = still;
    for (unsigned k = 0; k < 4u; k++) {
        in.omega_s_hat_rad_s = inside_rad_s[k];
        ASSERT_SAME_FLOAT(STEP_OHM / 8.0f * in.omega_s_hat_rad_s, added_ohm(in));
    }
    for (unsigned k = 0; k < 8u; k++) {
        in.omega_s_hat_rad_s = outside_rad_s[k];
        ASSERT_SAME_FLOAT(0.0f, added_ohm(in));
    }
}

static void test_it_waits_for_the_quiet_time_and_starts_again_after_a_disturbance(void)
{
    const float disturbed_rad_s[] = {3.01f, -3.01f, NAN, INFINITY};
    rs_tracking_state_t st = {0};
    for (unsigned k = 0; k <= 4u; k++) {
        st.delta_ohm = 0.0f;
        rs_tracking_step(&cfg, &st, &still);
        TEST_ASSERT_EQUAL_UINT32(1u, st.periods);
        rs_tracking_step(&cfg, &st, &still);
        TEST_ASSERT_EQUAL_UINT32(2u, st.periods);
        ASSERT_SAME_FLOAT(0.0f, st.delta_ohm);
        rs_tracking_step(&cfg, &st, &still);
        TEST_ASSERT_EQUAL_UINT32(2u, st.periods);
        ASSERT_SAME_FLOAT(STEP_OHM, st.delta_ohm);
        rs_tracking_in_t in = still;
        in.changing = (k == 4u);
        in.speed_err_rad_s = (k < 4u) ? disturbed_rad_s[k] : 0.0f;
        rs_tracking_step(&cfg, &st, &in);
        TEST_ASSERT_EQUAL_UINT32(0u, st.periods);
        ASSERT_SAME_FLOAT(STEP_OHM, st.delta_ohm); /* frozen, not forgotten */
    }
}

/* A slow crossing of zero frequency is when Rs has to be tracked. */
static void test_only_a_reference_that_moves_fast_is_a_disturbance(void)
{
    const float fast_rad_s[] = {0.2500001f, -0.2500001f, INFINITY, NAN};
    for (int sign = -1; sign <= 1; sign += 2) {
        rs_tracking_in_t in = still;
        in.moved_rad_s = 0.25f * (float)sign;
        ASSERT_SAME_FLOAT(STEP_OHM, added_ohm(in));
    }
    for (int k = 0; k < 4; k++) {
        rs_tracking_in_t in = still;
        in.moved_rad_s = fast_rad_s[k];
        rs_tracking_state_t st = quiet;
        rs_tracking_step(&cfg, &st, &in);
        TEST_ASSERT_EQUAL_UINT32(0u, st.periods);
        ASSERT_SAME_FLOAT(0.0f, st.delta_ohm);
    }
}

/* With little torque the residual tells of M and leakage, not of Rs. */
static void test_too_little_torque_moves_nothing(void)
{
    rs_tracking_in_t in = still;
    const float i_q_A[] = {1.999f, -1.999f, 0.0f, NAN};
    for (int k = 0; k < 4; k++) {
        in.i_q_A = i_q_A[k];
        ASSERT_SAME_FLOAT(0.0f, added_ohm(in));
    }
}

static void test_a_speed_error_at_the_limit_is_no_disturbance(void)
{
    rs_tracking_in_t in = still;
    in.speed_err_rad_s = 3.0f;
    ASSERT_SAME_FLOAT(STEP_OHM, added_ohm(in));
    in.speed_err_rad_s = -3.0f;
    ASSERT_SAME_FLOAT(STEP_OHM, added_ohm(in));
}

static void test_the_resistance_stays_within_its_band_around_the_starts(void)
{
    rs_tracking_in_t in = still;
    in.Rs_start_ohm = 4.0f;
    in.e1_d_A = 1e6f;
    ASSERT_SAME_FLOAT(4.0f, added_ohm(in)); /* twice */
    in.e1_d_A = -1e6f;
    ASSERT_SAME_FLOAT(-2.0f, added_ohm(in)); /* half */
}

/* Frozen or not: below back_rad_s Rs comes back to the start's by 3 % of what is missing. */
static void test_while_a_slow_field_generates_rs_does_not_stay_low(void)
{
    const struct {
        float i_q_A, omega_s_rad_s, back_rad_s, delta_ohm, left_ohm;
    } of[] = {
        {-2.0f, 8.0f, 16.0f, -0.03125f, 0.97f * -0.03125f},
        {2.0f, -8.0f, 16.0f, -0.03125f, 0.97f * -0.03125f},
        {-2.0f, 8.0f, 16.0f, -0.0625f, 0.97f * -0.0625f}, /* the end of the band */
        {-2.0f, 8.0f, 16.0f, 0.03125f, 0.03125f},         /* higher is as it was */
        {2.0f, 8.0f, 16.0f, -0.03125f, -0.03125f},        /* drives */
        {-2.0f, -8.0f, 16.0f, -0.03125f, -0.03125f},
        {-2.0f, 0.0f, 16.0f, -0.03125f, -0.03125f},
        {-1.99f, 8.0f, 16.0f, -0.03125f, -0.03125f}, /* no load */
        {-2.0f, 8.0f, 16.0f, -0.07f, -0.07f},        /* found while dwelling */
        {-2.0f, 8.0f, 8.0f, -0.03125f, -0.03125f},   /* a fast field */
        {-2.0f, 8.0f, 0.0f, -0.03125f, -0.03125f},   /* never */
        {-2.0f, NAN, 16.0f, -0.03125f, -0.03125f},
    };
    cfg.down_pu = -0.0625f;
    for (unsigned k = 0; k < sizeof of / sizeof of[0]; k++) {
        cfg.back_rad_s = of[k].back_rad_s;
        rs_tracking_state_t st = {.delta_ohm = of[k].delta_ohm};
        rs_tracking_in_t in = still;
        in.i_q_A = of[k].i_q_A;
        in.omega_s_hat_rad_s = of[k].omega_s_rad_s;
        in.changing = true; /* frozen */
        rs_tracking_step(&cfg, &st, &in);
        ASSERT_SAME_FLOAT(of[k].left_ohm, st.delta_ohm);
    }
    /* Tracking goes on beside it: here down, by less than comes back. */
    cfg.back_rad_s = 16.0f;
    rs_tracking_state_t st = {.delta_ohm = -0.03125f, .periods = 2u};
    rs_tracking_in_t in = still;
    in.i_q_A = -2.0f;
    in.e1_d_A = 0.25f / 64.0f;
    rs_tracking_step(&cfg, &st, &in);
    ASSERT_SAME_FLOAT(0.97f * -0.03125f - STEP_OHM / 64.0f, st.delta_ohm);
}

static void test_no_number_stays_within_the_band(void)
{
    for (int i = 0; i < NOT_FINITE_COUNT; i++) {
        rs_tracking_in_t in = still;
        in.e1_d_A = not_finite(i);
        const float by_error_ohm = added_ohm(in);
        TEST_ASSERT_TRUE((by_error_ohm >= -0.5f) && (by_error_ohm <= 1.0f));
        in = still;
        in.i_q_A = not_finite(i);
        const float by_torque_ohm = added_ohm(in);
        TEST_ASSERT_TRUE((by_torque_ohm >= -0.5f) && (by_torque_ohm <= 1.0f));
    }
}

/* ---- Machine and observer in their common steady state ---- */

typedef struct {
    int machine;
    double omega_s_rad_s;
    double i_d_A;
    double i_q_A;
} point_t;

/* e1 in the frame of the true flux for a speed estimate and a resistance error; lambda_hat too.
 * The observer's poles are those of the designed tables: p1 = -195, p2 = -(.87 tau + .073 |w|). */
static cplx observer_error(const point_t *p, double w_hat, double dRs_ohm, cplx *lambda_hat)
{
    const motor_t *m = &reference_machine[p->machine];
    const double kr = (double)m->M_H / (double)m->Lr_H;
    const reference_model_t x = reference_model(m, w_hat);
    const cplx i = p->i_d_A + I * p->i_q_A, jw = I * p->omega_s_rad_s;
    const double lambda = (double)m->M_H * p->i_d_A;
    const cplx u = ((double)m->Rs_ohm + jw * x.sigma_Ls) * i + kr * jw * lambda - dRs_ohm * i;
    const double p1 = -195.0, p2 = -(0.87 * x.tau + 0.073 * fabs(w_hat));
    const cplx l1 = p1 + p2 - x.a11 - x.a22;
    const cplx l2 = ((x.a11 + l1) * x.a22 - p1 * p2) / x.a12 - x.a21;
    /* (jw - A - [l1; l2] [1 0]) [i_hat; lambda_hat] = [b u - l1 i; -l2 i], by Cramer. */
    const cplx a = jw - x.a11 - l1, b = -x.a12, c = -x.a21 - l2, d = jw - x.a22;
    const cplx r1 = x.b * u - l1 * i, r2 = -l2 * i, det = a * d - b * c;
    *lambda_hat = (a * r2 - c * r1) / det;
    return (r1 * d - b * r2) / det - i;
}

/* e1 along the estimated flux once the adaptation has made the part across it zero. */
static double adapted_e1_d_A(const point_t *p, double dRs_ohm)
{
    const motor_t *m = &reference_machine[p->machine];
    const double slip = (double)m->Rr_ohm / (double)m->Lr_H * p->i_q_A / p->i_d_A;
    double w0 = p->omega_s_rad_s - slip, w1 = w0 + 0.01;
    cplx lambda;
    cplx e1 = observer_error(p, w0, dRs_ohm, &lambda);
    double z0 = cimag(conj(lambda) * e1);
    for (int k = 0; k < 30; k++) {
        e1 = observer_error(p, w1, dRs_ohm, &lambda);
        const double z1 = cimag(conj(lambda) * e1);
        if ((fabs(z1) < 1e-13) || (fabs(z1 - z0) < 1e-16)) {
            break;
        }
        const double next = w1 - z1 * (w1 - w0) / (z1 - z0);
        w0 = w1;
        z0 = z1;
        w1 = next;
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 0.0, cimag(conj(lambda) * e1));
    return creal(conj(lambda) * e1) / cabs(lambda);
}

/* c of e1_d = -c dRs i_q/w_s for a small error. */
static double sensitivity(const point_t *p)
{
    const double dRs_ohm = 1e-4;
    return -adapted_e1_d_A(p, dRs_ohm) * p->omega_s_rad_s / (dRs_ohm * p->i_q_A);
}

static void test_the_error_along_the_flux_has_one_sign_motoring_and_braking(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        for (int k = 0; k < 8; k++) {
            const point_t p = {.machine = m,
                               .omega_s_rad_s = ((k & 1) ? -1.0 : 1.0) * ((k & 2) ? 36.0 : 9.0),
                               .i_d_A = 5.1,
                               .i_q_A = (k & 4) ? -6.0 : 6.0};
            const double c = sensitivity(&p);
            /* The header's number, on the machine it is meant for. */
            TEST_ASSERT_TRUE((c > 2.0) && (c < 9.0));
            if (m == 0) {
                ASSERT_NEAR(0.5, 6.0, c);
            }
        }
    }
}

/* Resistance error after some steps of the law, the observer always settled. */
static double left_ohm(const point_t *p, double dRs_ohm, int steps)
{
    rs_tracking_params_t fast = good;
    fast.gain_ohm_per_rad = 3.0f;
    fast.low_pu = 0.5f;
    fast.quiet_s = 0.0f;
    TEST_ASSERT_TRUE(rs_tracking_init(&cfg, &fast, PERIOD_S));
    rs_tracking_state_t st = {0};
    for (int k = 0; k < steps; k++) {
        const double error_ohm = dRs_ohm + (double)st.delta_ohm;
        const rs_tracking_in_t in = {.Rs_start_ohm = reference_machine[p->machine].Rs_ohm,
                                     .e1_d_A = (float)adapted_e1_d_A(p, error_ohm),
                                     .i_q_A = (float)p->i_q_A,
                                     .omega_s_hat_rad_s = (float)p->omega_s_rad_s};
        rs_tracking_step(&cfg, &st, &in);
    }
    return dRs_ohm + (double)st.delta_ohm;
}

static void test_the_error_dies_exponentially_whatever_speed_load_and_direction(void)
{
    const double speeds_rad_s[] = {8.0, 16.0, 32.0, -12.0}, loads_A[] = {8.0, 3.0, -3.0, -8.0};
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        for (int k = 0; k < 16; k++) {
            const point_t p = {.machine = m,
                               .omega_s_rad_s = speeds_rad_s[k % 4],
                               .i_d_A = 5.1,
                               .i_q_A = loads_A[k / 4]};
            const double q2 = p.i_q_A * p.i_q_A;
            const double rate_per_s = 3.0 * sensitivity(&p) * q2 / (q2 + 2.25);
            TEST_ASSERT_TRUE(rate_per_s > 0.0);
            /* 500 steps are .1 s: one to two time constants; 2 % for the curvature. */
            const double expected = exp(-0.1 * rate_per_s);
            ASSERT_NEAR(0.02, expected, left_ohm(&p, 0.03, 500) / 0.03);
            ASSERT_NEAR(0.02, expected, left_ohm(&p, -0.03, 500) / -0.03);
        }
    }
}

/* The dwell's law: the residual that an Rs off by dRs leaves at zero stator frequency, with
 * closed-form gains (D = p1 p2 real), moves Rs towards the true one at the same rate at any speed
 * and load. */
static void test_a_standing_field_finds_rs_at_any_speed_and_load(void)
{
    const motor_model_t m = reference_derived(0);
    cfg.dwell_gain_T_ohm = 0.001f;
    const double D = 195.0 * 4.6;
    for (int k = -2; k <= 2; k++) {
        const double w = 6.0 * k;
        const cplx pole = (double)m.tau_per_s - I * w;
        const cplx i_A = (5.0 + I * 1.2 * w) * cexp(I * 0.7 * k);
        const double dRs = 0.1;
        const cplx e1_A = dRs * i_A * pole / ((double)m.sigma_Ls_H * D);
        rs_tracking_state_t st = {.periods = 7u};
        const rs_tracking_dwell_in_t in = {.Rs_start_ohm = 1.0f,
                                           .tau_per_s = m.tau_per_s,
                                           .omega_e_hat_rad_s = (float)w,
                                           .i_s_A = {(float)creal(i_A), (float)cimag(i_A)},
                                           .e1_A = {(float)creal(e1_A), (float)cimag(e1_A)}};
        rs_tracking_dwell(&cfg, &st, &in);
        const double expected = 0.001 * dRs * cabs(pole) / ((double)m.sigma_Ls_H * D);
        ASSERT_NEAR(1e-8, expected, st.delta_ohm);
        TEST_ASSERT_EQUAL_UINT32(0u, st.periods); /* the other law waits afterwards */
    }
}

static void test_a_standing_field_follows_rs_down_and_up_within_limits(void)
{
    cfg.dwell_gain_T_ohm = 8.0f;
    rs_tracking_dwell_in_t in = {
        .Rs_start_ohm = 1.0f, .tau_per_s = 4.0f, .i_s_A = {4.0f, 0.0f}, .e1_A = {4.0f, 0.0f}};
    rs_tracking_state_t st = quiet;
    rs_tracking_dwell(&cfg, &st, &in);
    ASSERT_NEAR(1e-6, 1.0, st.delta_ohm); /* high_pu 2 */
    in.e1_A.alpha = -4.0f;
    rs_tracking_dwell(&cfg, &st, &in);
    ASSERT_NEAR(1e-6, -0.4, st.delta_ohm);
    /* What lies below low_pu the usual law takes as it is, and leads back only. */
    rs_tracking_state_t low = {.delta_ohm = -0.625f, .periods = 2u};
    rs_tracking_in_t back = still;
    back.e1_d_A = -back.e1_d_A;
    rs_tracking_step(&cfg, &low, &back);
    ASSERT_SAME_FLOAT(-0.625f, low.delta_ohm);
    rs_tracking_step(&cfg, &low, &still);
    ASSERT_SAME_FLOAT(-0.625f + STEP_OHM, low.delta_ohm);
}

static void test_a_standing_field_without_current_tells_nothing(void)
{
    cfg.dwell_gain_T_ohm = 1.0f;
    rs_tracking_state_t st = {.delta_ohm = 0.125f};
    const rs_tracking_dwell_in_t in = {
        .Rs_start_ohm = 1.0f, .tau_per_s = 4.0f, .i_s_A = {1.9f, 0.0f}, .e1_A = {1.0f, 1.0f}};
    rs_tracking_dwell(&cfg, &st, &in); /* below i_0 = 2 A */
    ASSERT_SAME_FLOAT(0.125f, st.delta_ohm);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_derives_the_coefficients);
    RUN_TEST(test_init_rounds_the_quiet_time_to_whole_periods);
    RUN_TEST(test_init_refuses_every_bad_number);
    RUN_TEST(test_init_refuses_bands_the_wrong_way_round);
    RUN_TEST(test_init_accepts_the_ends_of_the_ranges);
    RUN_TEST(test_with_the_gain_zero_nothing_is_looked_at_and_it_is_off);
    RUN_TEST(test_without_an_error_along_the_flux_nothing_moves);
    RUN_TEST(test_one_step_agrees_with_double_arithmetic);
    RUN_TEST(test_the_step_turns_with_each_factor_and_not_with_the_direction_of_rotation);
    RUN_TEST(test_it_fades_out_without_torque);
    RUN_TEST(test_it_is_frozen_outside_its_band_of_frequency_either_way);
    RUN_TEST(test_it_waits_for_the_quiet_time_and_starts_again_after_a_disturbance);
    RUN_TEST(test_only_a_reference_that_moves_fast_is_a_disturbance);
    RUN_TEST(test_too_little_torque_moves_nothing);
    RUN_TEST(test_a_speed_error_at_the_limit_is_no_disturbance);
    RUN_TEST(test_the_resistance_stays_within_its_band_around_the_starts);
    RUN_TEST(test_while_a_slow_field_generates_rs_does_not_stay_low);
    RUN_TEST(test_no_number_stays_within_the_band);
    RUN_TEST(test_the_error_along_the_flux_has_one_sign_motoring_and_braking);
    RUN_TEST(test_the_error_dies_exponentially_whatever_speed_load_and_direction);
    RUN_TEST(test_a_standing_field_finds_rs_at_any_speed_and_load);
    RUN_TEST(test_a_standing_field_follows_rs_down_and_up_within_limits);
    RUN_TEST(test_a_standing_field_without_current_tells_nothing);
    return UNITY_END();
}
