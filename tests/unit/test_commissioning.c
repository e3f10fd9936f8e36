/* The whole sequence on a motor in double precision: one axis at standstill, legs that lose
 * voltage, noise, a current controller of the test's own. Two machines; and everything that is
 * refused. */
#include "commissioning.h"

#include <math.h>

#include "exact.h"
#include "reference_machine.h"
#include "unity.h"

#define PERIOD_S    200e-6
#define SUBSTEPS    8
#define RATED_A     10.7f
#define LOST_V      3.9
#define THRESHOLD_A 0.2
#define KP_ohm      4.0
#define KI_ohm_s    300.0

/* What is connected, and what is wrong with it. */
typedef struct {
    double Rs_ohm;
    double sigma_Ls_H;
    double Rr_ohm; /* inverse-Gamma: (M/Lr)^2 Rr, M^2/Lr */
    double M_H;
    double supply;    /* share of the voltage that arrives */
    double across;    /* current across the axis, over that along it */
    double flux_sign; /* -1: the flux weakens what makes it */
} bench_t;

static commissioning_config_t cfg;
static commissioning_state_t st;
static bench_t bench;

static params_t params(void)
{
    return (params_t){.com_rated_A = RATED_A,
                      .rs_level_s = 1.7f,
                      .com_slip_Hz = 3.0f,
                      .Rs_ohm = 1.5f,
                      .period_s = (float)PERIOD_S};
}

void setUp(void)
{
    st = (commissioning_state_t){0};
    const params_t p = params();
    TEST_ASSERT_TRUE(commissioning_init(&cfg, &p));
}

void tearDown(void)
{
}

/* Twice the rated slip: a turn of 6 Hz. */
static void test_the_slow_tone_is_twice_the_rated_slip(void)
{
    TEST_ASSERT_EQUAL_UINT32((uint32_t)lround(1.0 / (6.0 * (double)PERIOD_S)),
                             cfg.slow.turn_periods);
}

static void connect(int machine)
{
    const motor_t *m = &reference_machine[machine];
    const double kr = (double)m->M_H / (double)m->Lr_H;
    bench = (bench_t){.Rs_ohm = (double)m->Rs_ohm,
                      .sigma_Ls_H = (double)m->Ls_H - kr * (double)m->M_H,
                      .Rr_ohm = kr * kr * (double)m->Rr_ohm,
                      .M_H = kr * (double)m->M_H,
                      .supply = 1.0,
                      .flux_sign = 1.0};
}

static double sat(double x)
{
    return fmax(-1.0, fmin(1.0, x));
}

/* Along the axis: phase u carries sqrt(2/3) i, v and w half of it back. */
static double lost_V(double i_A)
{
    const double i_u_A = sqrt(2.0 / 3.0) * i_A;
    return sqrt(2.0 / 3.0) * LOST_V * (sat(i_u_A / THRESHOLD_A) + sat(0.5 * i_u_A / THRESHOLD_A));
}

/* Until it ends; false when it does not. */
static bool commission(commissioning_out_t *out)
{
    double i_A = 0.0;
    double flux_Wb = 0.0;
    double integral_V = 0.0;
    double acting_V = 0.0;
    uint32_t seed = 7u;
    for (long k = 0; k < 400000; k++) {
        const double sampled_A = i_A + 0.003 * (double)noise(&seed);
        const commissioning_in_t in = {.i_A = {(float)sampled_A, (float)(bench.across * sampled_A)},
                                       .u_coming_V = (float)acting_V};
        *out = commissioning_step(&cfg, &st, &in);
        if (out->status != COMMISSIONING_BUSY) {
            return true;
        }
        const double error_A = (double)out->i_ref_A - sampled_A;
        integral_V = fmax(-60.0, fmin(60.0, integral_V + KI_ohm_s * PERIOD_S * error_A));
        const double next_V = fmax(-120.0, fmin(120.0, KP_ohm * error_A + integral_V));
        for (int n = 0; n < SUBSTEPS; n++) {
            const double emf_V = bench.flux_sign * bench.Rr_ohm * (i_A - flux_Wb / bench.M_H);
            const double u_V = bench.supply * (acting_V - lost_V(i_A));
            i_A += PERIOD_S / SUBSTEPS * (u_V - bench.Rs_ohm * i_A - emf_V) / bench.sigma_Ls_H;
            flux_Wb += PERIOD_S / SUBSTEPS * bench.Rr_ohm * (i_A - flux_Wb / bench.M_H);
        }
        acting_V = next_V;
    }
    return false;
}

static void test_the_circuit_is_found(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        setUp();
        connect(machine);
        commissioning_out_t out;
        TEST_ASSERT_TRUE(commission(&out));
        TEST_ASSERT_EQUAL_INT(COMMISSIONING_NOT_REFUSED, st.refusal);
        TEST_ASSERT_EQUAL_INT(COMMISSIONING_DONE, out.status);
        ASSERT_SAME_FLOAT(0.0f, out.i_ref_A);
        const commissioning_result_t *r = &st.result;
        /* Noise of 3 mA leaves a tenth of a percent; a term forgotten costs several percent. */
        ASSERT_NEAR(0.002 * bench.Rs_ohm, bench.Rs_ohm, r->Rs_ohm);
        ASSERT_NEAR(0.01 * LOST_V, LOST_V, r->lost_V);
        ASSERT_NEAR(0.005 * bench.sigma_Ls_H, bench.sigma_Ls_H, r->sigma_Ls_H);
        ASSERT_NEAR(0.005 * bench.Rr_ohm, bench.Rr_ohm, r->Rr_gamma_ohm);
        ASSERT_NEAR(0.005 * bench.M_H, bench.M_H, r->M_gamma_H);
        ASSERT_NEAR(1e-5, 0.4f * RATED_A, r->bias_A);
        const double Ls_H = bench.sigma_Ls_H + bench.M_H;
        for (uint32_t n = 0u; n < COMMISSIONING_LEVELS; n++) {
            const double i_A = (double)RATED_A * (n + 1u) / 8.0;
            ASSERT_NEAR(0.01 * i_A, i_A, r->level_A[n]);
            ASSERT_NEAR(0.01 * Ls_H * i_A, Ls_H * i_A, r->flux_Wb[n]);
            ASSERT_NEAR(0.02, lost_V(i_A), r->error_V[n]);
        }
    }
}

static void test_it_stays_ended(void)
{
    connect(0);
    commissioning_out_t out;
    TEST_ASSERT_TRUE(commission(&out));
    const commissioning_in_t in = {.i_A = {0.0f, 0.0f}, .u_coming_V = 0.0f};
    TEST_ASSERT_EQUAL_INT(COMMISSIONING_DONE, commissioning_step(&cfg, &st, &in).status);
    ASSERT_SAME_FLOAT(0.0f, commissioning_step(&cfg, &st, &in).i_ref_A);
}

static void assert_refused(commissioning_refusal_t why)
{
    commissioning_out_t out;
    TEST_ASSERT_TRUE(commission(&out));
    TEST_ASSERT_EQUAL_INT(COMMISSIONING_REFUSED, out.status);
    TEST_ASSERT_EQUAL_INT(why, st.refusal);
    ASSERT_SAME_FLOAT(0.0f, out.i_ref_A);
    const commissioning_in_t in = {.i_A = {1.0f, 0.0f}, .u_coming_V = 1.0f};
    TEST_ASSERT_EQUAL_INT(COMMISSIONING_REFUSED, commissioning_step(&cfg, &st, &in).status);
}

static void test_no_motor_is_refused(void)
{
    connect(0);
    bench.supply = 0.0;
    assert_refused(COMMISSIONING_NO_CURRENT);
}

static void test_current_across_the_axis_is_an_open_phase(void)
{
    connect(0);
    bench.across = -0.58; /* w open: i_v = -i_u */
    assert_refused(COMMISSIONING_OPEN_PHASE);
}

static void test_a_resistance_of_another_size_is_refused(void)
{
    connect(0);
    bench.Rs_ohm = 0.14;
    assert_refused(COMMISSIONING_RS);
    setUp();
    connect(0);
    const params_t p = {.com_rated_A = RATED_A,
                        .rs_level_s = 1.7f,
                        .com_slip_Hz = 3.0f,
                        .Rs_ohm = 0.09f,
                        .period_s = (float)PERIOD_S};
    TEST_ASSERT_TRUE(commissioning_init(&cfg, &p));
    assert_refused(COMMISSIONING_RS);
}

static void test_a_flux_that_has_not_settled_is_refused(void)
{
    connect(0);
    params_t p = params();
    p.rs_level_s = 0.9f; /* four and a half rotor time constants */
    p.Rs_ohm = 1.0f;
    TEST_ASSERT_TRUE(commissioning_init(&cfg, &p));
    assert_refused(COMMISSIONING_UNSETTLED);
}

static void test_flux_against_the_current_is_refused(void)
{
    connect(0);
    bench.flux_sign = -1.0;
    bench.sigma_Ls_H = 0.003;
    assert_refused(COMMISSIONING_CURVE);
}

static void test_a_filter_in_the_line_is_no_leakage(void)
{
    connect(0);
    bench.sigma_Ls_H = 0.3; /* three times M */
    assert_refused(COMMISSIONING_LEAKAGE);
}

static void test_a_winding_without_a_rotor_is_refused(void)
{
    connect(0);
    bench.Rr_ohm = 40.0; /* over 10 Rs: nothing answers at slip frequency */
    assert_refused(COMMISSIONING_ROTOR);
}

/* The last period of a stage, brought about by hand: what it is refused for. */
static void assert_last_period_refuses(commissioning_refusal_t why)
{
    const commissioning_in_t in = {.i_A = {0.0f, 0.0f}, .u_coming_V = 0.0f};
    TEST_ASSERT_EQUAL_INT(COMMISSIONING_BUSY, commissioning_step(&cfg, &st, &in).status);
    TEST_ASSERT_EQUAL_INT(why, st.refusal);
    TEST_ASSERT_EQUAL_INT(COMMISSIONING_REFUSED, commissioning_step(&cfg, &st, &in).status);
}

static void test_a_current_that_stops_following_is_refused_on_the_curve_too(void)
{
    st.stage = COMMISSIONING_STAGE_CURVE;
    st.periods = cfg.level_periods - 1u;
    st.result.Rs_ohm = 1.5f;
    assert_last_period_refuses(COMMISSIONING_NO_CURRENT);
}

/* The last level of the curve as it ends; half of its current was there before. */
static commissioning_refusal_t end_of_curve(float mean_A, float across_A)
{
    setUp();
    const float n = (float)cfg.average_periods;
    const float before_A = 0.5f * RATED_A;
    st.stage = COMMISSIONING_STAGE_CURVE;
    st.level = COMMISSIONING_LEVELS - 1u;
    st.periods = cfg.level_periods - 1u;
    st.settled_A = before_A;
    st.i_before_A = before_A;
    st.i_end_A = (mean_A - before_A) * n;
    st.across_A = across_A;
    st.sum_V = 1.0f;
    const commissioning_in_t in = {.i_A = {before_A, 0.0f}, .u_coming_V = 0.0f};
    (void)commissioning_step(&cfg, &st, &in);
    return st.refusal;
}

static void test_a_tenth_of_the_current_may_be_missing_or_flow_across(void)
{
    TEST_ASSERT_EQUAL_INT(COMMISSIONING_NOT_REFUSED, end_of_curve(RATED_A, 0.0f));
    TEST_ASSERT_EQUAL_INT(COMMISSIONING_STAGE_BIAS, st.stage);
    TEST_ASSERT_EQUAL_INT(COMMISSIONING_NOT_REFUSED, end_of_curve(0.91f * RATED_A, 0.0f));
    TEST_ASSERT_EQUAL_INT(COMMISSIONING_NO_CURRENT, end_of_curve(0.89f * RATED_A, 0.0f));
    TEST_ASSERT_EQUAL_INT(COMMISSIONING_NOT_REFUSED, end_of_curve(1.09f * RATED_A, 0.0f));
    TEST_ASSERT_EQUAL_INT(COMMISSIONING_NO_CURRENT, end_of_curve(1.11f * RATED_A, 0.0f));
    /* Just a tenth is not more than it. */
    const float tenth_A = (float)cfg.average_periods * 0.1f * (8.0f * cfg.level_step_A);
    TEST_ASSERT_EQUAL_INT(COMMISSIONING_NOT_REFUSED, end_of_curve(RATED_A, tenth_A));
    TEST_ASSERT_EQUAL_INT(COMMISSIONING_NOT_REFUSED, end_of_curve(RATED_A, -tenth_A));
    TEST_ASSERT_EQUAL_INT(COMMISSIONING_OPEN_PHASE, end_of_curve(RATED_A, 1.001f * tenth_A));
}

/* As many periods as the mean is divided by, the level's last ones. */
static void test_the_average_begins_with_its_first_period(void)
{
    for (uint32_t early = 0u; early < 2u; early++) {
        setUp();
        st.stage = COMMISSIONING_STAGE_CURVE;
        st.periods = cfg.level_periods - cfg.average_periods - early;
        st.u_coming_V = 2.0f;
        st.i_before_A = 1.0f;
        const commissioning_in_t in = {.i_A = {1.0f, 0.5f}, .u_coming_V = 0.0f};
        (void)commissioning_step(&cfg, &st, &in);
        const float counts = (early == 0u) ? 1.0f : 0.0f;
        ASSERT_SAME_FLOAT(2.0f * counts, st.first_V);
        ASSERT_SAME_FLOAT(0.0f, st.last_V);
        ASSERT_SAME_FLOAT(counts, st.i_end_A);
        ASSERT_SAME_FLOAT(0.5f * counts, st.across_A);
    }
}

static void test_the_fast_tone_turns_once_in_sixteen_periods(void)
{
    TEST_ASSERT_EQUAL_UINT32(16u, cfg.fast.turn_periods);
    TEST_ASSERT_EQUAL_UINT32(64u * 16u, cfg.fast.quiet_periods);
    TEST_ASSERT_EQUAL_UINT32((64u + 512u) * 16u, cfg.fast.periods);
}

/* A tone as it ends: impedance u/i, over the current of its sums. */
static void end_of_tone(commissioning_stage_t stage, const tone_config_t *tone, ab_t impedance_ohm)
{
    setUp();
    st.stage = stage;
    st.result.Rs_ohm = 1.0f;
    st.result.sigma_Ls_H = 0.01f;
    st.result.flux_Wb[0] = 0.1f;
    st.result.level_A[0] = 1.0f;
    st.tone = (tone_state_t){.periods = tone->periods - 1u,
                             .in_turn = 1u,
                             .unit = {1.0f, 0.0f},
                             .i_A = {1.0f, 0.0f},
                             .u_V = impedance_ohm};
}

/* Of what was summed before, nothing is left. */
static void test_a_stage_begins_with_empty_sums(void)
{
    st.stage = COMMISSIONING_STAGE_BIAS;
    st.periods = cfg.level_periods - 1u;
    float *const sums[] = {&st.sum_V,   &st.first_V,  &st.last_V,        &st.i_sum_A,
                           &st.i_end_A, &st.across_A, &st.tone.i_A.alpha};
    for (size_t n = 0u; n < sizeof sums / sizeof sums[0]; n++) {
        *sums[n] = 5.0f;
    }
    const commissioning_in_t in = {.i_A = {0.0f, 0.0f}, .u_coming_V = 0.0f};
    (void)commissioning_step(&cfg, &st, &in);
    TEST_ASSERT_EQUAL_INT(COMMISSIONING_STAGE_FAST, st.stage);
    TEST_ASSERT_EQUAL_UINT32(0u, st.periods);
    for (size_t n = 0u; n < sizeof sums / sizeof sums[0]; n++) {
        ASSERT_SAME_FLOAT(0.0f, *sums[n]);
    }
}

/* Real part: as much above Rs as below; imaginary part: a capacitor. */
static void test_impedances_that_no_motor_has_are_refused(void)
{
    end_of_tone(COMMISSIONING_STAGE_FAST, &cfg.fast, (ab_t){1.0f, -5.0f});
    assert_last_period_refuses(COMMISSIONING_LEAKAGE);
    const float leakage_ohm = 0.01f * cfg.slow.omega_rad_s;
    end_of_tone(COMMISSIONING_STAGE_SLOW, &cfg.slow, (ab_t){0.5f, leakage_ohm + 1.0f});
    assert_last_period_refuses(COMMISSIONING_ROTOR); /* Rr < 0 */
    end_of_tone(COMMISSIONING_STAGE_SLOW, &cfg.slow, (ab_t){1.5f, leakage_ohm - 1.0f});
    assert_last_period_refuses(COMMISSIONING_ROTOR); /* M < 0 */
    end_of_tone(COMMISSIONING_STAGE_SLOW, &cfg.slow, (ab_t){12.0f, leakage_ohm + 1.0f});
    assert_last_period_refuses(COMMISSIONING_ROTOR); /* Rr over 10 Rs */
    /* Rr 3 ohm; M 9.25/(.5 w) = .49 H, more than twice the first level's .1 H. */
    end_of_tone(COMMISSIONING_STAGE_SLOW, &cfg.slow, (ab_t){4.0f, leakage_ohm + 0.5f});
    assert_last_period_refuses(COMMISSIONING_ROTOR); /* M too large */
    /* Rr of 10 Rs exactly is just one: |5 + 5j|^2 / 5. */
    end_of_tone(COMMISSIONING_STAGE_SLOW, &cfg.slow, (ab_t){6.0f, 5.0f});
    st.result.sigma_Ls_H = 0.0f;
    st.result.flux_Wb[0] = 1.0f;
    const commissioning_in_t in = {.i_A = {0.0f, 0.0f}, .u_coming_V = 0.0f};
    (void)commissioning_step(&cfg, &st, &in);
    TEST_ASSERT_EQUAL_INT(COMMISSIONING_STAGE_END, st.stage);
    ASSERT_SAME_FLOAT(10.0f, st.result.Rr_gamma_ohm);
}

static void test_init_refuses_what_cannot_be(void)
{
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        for (int field = 0; field < 5; field++) {
            params_t p = params();
            float *const value[5] = {&p.com_rated_A, &p.rs_level_s, &p.com_slip_Hz, &p.Rs_ohm,
                                     &p.period_s};
            *value[field] = not_positive(k);
            TEST_ASSERT_FALSE(commissioning_init(&cfg, &p));
        }
    }
    params_t p = params();
    p.rs_level_s = 0.0199f;
    TEST_ASSERT_FALSE(commissioning_init(&cfg, &p));
    p.rs_level_s = 201.0f;
    TEST_ASSERT_FALSE(commissioning_init(&cfg, &p));
    p.rs_level_s = 100.0f; /* the average is what floats can add up */
    TEST_ASSERT_TRUE(commissioning_init(&cfg, &p));
    TEST_ASSERT_EQUAL_UINT32(8192u, cfg.average_periods);
    /* A period whose sixteenth of a frequency is no number any more. */
    p.period_s = 1e-40f;
    p.rs_level_s = 1e-37f;
    TEST_ASSERT_FALSE(commissioning_init(&cfg, &p));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_slow_tone_is_twice_the_rated_slip);
    RUN_TEST(test_the_circuit_is_found);
    RUN_TEST(test_it_stays_ended);
    RUN_TEST(test_no_motor_is_refused);
    RUN_TEST(test_current_across_the_axis_is_an_open_phase);
    RUN_TEST(test_a_resistance_of_another_size_is_refused);
    RUN_TEST(test_a_flux_that_has_not_settled_is_refused);
    RUN_TEST(test_flux_against_the_current_is_refused);
    RUN_TEST(test_a_filter_in_the_line_is_no_leakage);
    RUN_TEST(test_a_winding_without_a_rotor_is_refused);
    RUN_TEST(test_a_current_that_stops_following_is_refused_on_the_curve_too);
    RUN_TEST(test_a_tenth_of_the_current_may_be_missing_or_flow_across);
    RUN_TEST(test_the_average_begins_with_its_first_period);
    RUN_TEST(test_the_fast_tone_turns_once_in_sixteen_periods);
    RUN_TEST(test_a_stage_begins_with_empty_sums);
    RUN_TEST(test_impedances_that_no_motor_has_are_refused);
    RUN_TEST(test_init_refuses_what_cannot_be);
    return UNITY_END();
}
