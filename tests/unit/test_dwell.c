/* The law alone: what begins and ends a dwell, and a modulation that comes and goes without a step.
 */
#include "dwell.h"

#include <math.h>

#include "exact.h"
#include "reference_machine.h"
#include "unity.h"

#define PERIOD_S 0.0032f
#define PI       3.14159265358979323846

static const dwell_params_t good = {.kind = DWELL_SPEED,
                                    .amplitude_pu = 0.2f,
                                    .window_rad_s = 1.9f,
                                    .wait_s = 0.5f,
                                    .filter_s = 0.3f,
                                    .fade_s = 0.5f,
                                    .settle_s = 3.0f,
                                    .slew_rad_s2 = 0.3f,
                                    .load_A = 1.0f};

/* Braking at 30 min^-1 with two pole pairs: the field stands. */
static const dwell_in_t standing = {
    .omega_s_hat_rad_s = 0.0f, .i_q_A = -6.0f, .omega_ref_rad_s = 6.28f};

static dwell_config_t cfg;
static dwell_state_t st;
static motor_model_t table1;

void setUp(void)
{
    table1 = reference_derived(0);
    TEST_ASSERT_TRUE(dwell_init(&cfg, &good, &table1, PERIOD_S));
    st = (dwell_state_t){0};
}

void tearDown(void)
{
}

static void steps(int count, dwell_in_t in)
{
    for (int k = 0; k < count; k++) {
        dwell_step(&cfg, &st, &in);
    }
}

static int steps_in(float seconds)
{
    return (int)lroundf(seconds / PERIOD_S);
}

static void test_init_derives_the_coefficients(void)
{
    ASSERT_NEAR(1e-6, 1.67 * (double)table1.tau_per_s, cfg.omega_rad_s);
    ASSERT_NEAR(1e-8, 1.67 * (double)table1.tau_per_s * 0.0032 / (2.0 * PI), cfg.turns);
    ASSERT_NEAR(1e-8, 0.0032 / 0.3032, cfg.filter_gain);
    ASSERT_NEAR(1e-8, 0.0032 / 3.0032, cfg.settle_gain);
    ASSERT_NEAR(1e-8, 0.0064, cfg.share_step);
    ASSERT_NEAR(1e-8, 0.3 * 0.0032, cfg.moved_rad_s);
    TEST_ASSERT_EQUAL_UINT32(156u, cfg.wait_steps);
    TEST_ASSERT_TRUE(dwell_on(&cfg));
}

#define ASSERT_REFUSED(field, value)                                                               \
    do {                                                                                           \
        dwell_params_t bad = good;                                                                 \
        bad.field = (value);                                                                       \
        TEST_ASSERT_FALSE_MESSAGE(dwell_init(&cfg, &bad, &table1, PERIOD_S), #field);              \
    } while (0)

static void test_init_refuses_every_bad_number(void)
{
    for (int i = 0; i < NOT_POSITIVE_COUNT; i++) {
        const float x = not_positive(i);
        ASSERT_REFUSED(amplitude_pu, x);
        ASSERT_REFUSED(window_rad_s, x);
        ASSERT_REFUSED(wait_s, x);
        ASSERT_REFUSED(filter_s, x);
        ASSERT_REFUSED(fade_s, x);
        ASSERT_REFUSED(settle_s, x);
        ASSERT_REFUSED(slew_rad_s2, x);
        ASSERT_REFUSED(load_A, x);
        TEST_ASSERT_FALSE(dwell_init(&cfg, &good, &table1, x));
        motor_model_t bad = table1;
        bad.tau_per_s = x;
        TEST_ASSERT_FALSE(dwell_init(&cfg, &good, &bad, PERIOD_S));
    }
    ASSERT_REFUSED(kind, (dwell_kind_t)3);
    ASSERT_REFUSED(amplitude_pu, 0.3f);
    ASSERT_REFUSED(wait_s, 3200.1f); /* more than a million steps */
}

static void test_a_rotor_too_fast_for_the_steps_gets_a_slower_modulation(void)
{
    TEST_ASSERT_TRUE(dwell_init(&cfg, &good, &table1, 0.32f));
    ASSERT_SAME_FLOAT(0.1f, cfg.turns);
    ASSERT_NEAR(1e-6, 0.2 * PI / 0.32, cfg.omega_rad_s);
}

static void test_off_nothing_is_looked_at(void)
{
    const dwell_params_t off = {.kind = DWELL_OFF, .wait_s = NAN};
    TEST_ASSERT_TRUE(dwell_init(&cfg, &off, &table1, NAN));
    TEST_ASSERT_FALSE(dwell_on(&cfg));
}

static void test_flux_can_be_asked_for(void)
{
    dwell_params_t p = good;
    p.kind = DWELL_FLUX;
    TEST_ASSERT_TRUE(dwell_init(&cfg, &p, &table1, PERIOD_S));
    TEST_ASSERT_TRUE(dwell_on(&cfg));
}

/* The first step sees the reference move from 0. */
static void test_it_begins_after_the_wait_and_not_before(void)
{
    steps(1 + 156, standing);
    TEST_ASSERT_FALSE(st.standing);
    TEST_ASSERT_TRUE(dwell_idle(&st));
    steps(1, standing);
    TEST_ASSERT_TRUE(st.standing);
    TEST_ASSERT_TRUE(st.active);
    ASSERT_NEAR(1e-7, 0.0064, st.share);
}

/* Rs is found without a load too; what is modulated waits for one. */
static void test_a_field_that_stands_without_load_is_not_modulated(void)
{
    dwell_in_t in = standing;
    in.i_q_A = 0.9f;
    steps(steps_in(5.0f), in);
    TEST_ASSERT_TRUE(st.standing);
    TEST_ASSERT_TRUE(dwell_idle(&st));
    in.omega_s_hat_rad_s = 3.7f; /* less than two windows */
    steps(steps_in(5.0f), in);
    TEST_ASSERT_TRUE(st.standing);
    in.omega_s_hat_rad_s = 3.9f;
    steps(steps_in(5.0f), in);
    TEST_ASSERT_FALSE(st.standing);
}

static void assert_never_begins(dwell_in_t in)
{
    st = (dwell_state_t){.omega_s_rad_s = in.omega_s_hat_rad_s};
    steps(steps_in(60.0f), in);
    TEST_ASSERT_FALSE(st.active);
    TEST_ASSERT_TRUE(dwell_idle(&st));
    ASSERT_SAME_FLOAT(0.0f, st.speed_rad_s);
    ASSERT_SAME_FLOAT(0.0f, st.reduction_pu);
}

static void test_outside_the_window_without_load_or_steered_it_never_begins(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        dwell_in_t in = standing;
        in.omega_s_hat_rad_s = 1.95f * (float)sign;
        assert_never_begins(in);
        in = standing;
        in.i_q_A = 0.95f * (float)sign;
        assert_never_begins(in);
        in = standing;
        in.steered = true;
        assert_never_begins(in);
    }
    dwell_in_t in = standing;
    in.omega_s_hat_rad_s = NAN;
    st = (dwell_state_t){.omega_s_rad_s = 3.0f}; /* as it was before */
    steps(steps_in(10.0f), in);
    TEST_ASSERT_FALSE(st.active);
}

/* 2 min^-1/s and two pole pairs: .42 rad/s^2; slower than .3 it is no crossing. */
static void test_a_crossing_by_the_reference_never_begins_it(void)
{
    for (int slow = 0; slow < 2; slow++) {
        st = (dwell_state_t){0};
        bool began = false;
        dwell_in_t in = {.i_q_A = -6.0f};
        for (int k = 0; k < steps_in(30.0f); k++) {
            const float rate_rad_s2 = (slow != 0) ? 0.28f : 0.42f;
            in.omega_s_hat_rad_s = rate_rad_s2 * ((float)k * PERIOD_S - 15.0f);
            in.omega_ref_rad_s = 6.28f + in.omega_s_hat_rad_s;
            dwell_step(&cfg, &st, &in);
            began = began || st.active;
        }
        TEST_ASSERT_EQUAL(slow != 0, began);
    }
}

static void test_steering_ends_it(void)
{
    dwell_in_t in = standing;
    steps(steps_in(5.0f), in);
    TEST_ASSERT_TRUE(st.active);
    in.steered = true;
    steps(1, in);
    TEST_ASSERT_FALSE(st.standing);
    TEST_ASSERT_FALSE(st.active);
    in.steered = false; /* and it waits again */
    steps(155, in);
    TEST_ASSERT_FALSE(st.standing);
}

static void test_it_stays_while_inside_twice_the_window_and_loaded_by_half(void)
{
    dwell_in_t in = standing;
    steps(steps_in(5.0f), in);
    in.omega_s_hat_rad_s = 3.7f;
    in.i_q_A = -0.55f;
    for (int k = 0; k < steps_in(5.0f); k++) {
        dwell_in_t modulated = in; /* as an estimate sees it */
        modulated.omega_s_hat_rad_s += st.speed_rad_s;
        dwell_step(&cfg, &st, &modulated);
    }
    TEST_ASSERT_TRUE(st.active);
    ASSERT_NEAR(0.01, 3.7, st.omega_s_rad_s); /* the modulation is not in it */
    in.i_q_A = -0.45f;
    steps(steps_in(5.0f), in);
    TEST_ASSERT_FALSE(st.active);
    TEST_ASSERT_TRUE(dwell_idle(&st));
}

static void test_half_of_any_load_is_enough_to_stay(void)
{
    dwell_params_t p = good;
    p.load_A = 4.0f;
    TEST_ASSERT_TRUE(dwell_init(&cfg, &p, &table1, PERIOD_S));
    dwell_in_t in = standing;
    steps(steps_in(5.0f), in);
    TEST_ASSERT_TRUE(st.active);
    in.i_q_A = -2.1f;
    steps(steps_in(5.0f), in);
    TEST_ASSERT_TRUE(st.active);
    in.i_q_A = -1.9f;
    steps(steps_in(5.0f), in);
    TEST_ASSERT_FALSE(st.active);
}

/* The phase is a part of a turn: a whole one is none. */
static void test_the_phase_stays_between_0_and_1(void)
{
    for (int k = 0; k < steps_in(10.0f); k++) {
        steps(1, standing);
        TEST_ASSERT_TRUE((st.turns >= 0.0f) && (st.turns < 1.0f));
    }
}

static void test_a_whole_turn_begins_the_next(void)
{
    steps(steps_in(5.0f), standing);
    TEST_ASSERT_TRUE(st.active);
    cfg.turns = 0.0625f;
    st.turns = 0.9375f;
    steps(1, standing);
    ASSERT_SAME_FLOAT(0.0f, st.turns);
    ASSERT_SAME_FLOAT(0.0f, st.speed_rad_s);
}

/* Every difference of what is modulated is that of a sine of its size, from first to last. */
static void test_it_comes_and_goes_without_a_step(void)
{
    const float largest_rad_s = 1.8f * 0.2f * standing.omega_ref_rad_s;
    const float steepest_rad_s = largest_rad_s * (cfg.omega_rad_s * PERIOD_S + cfg.share_step);
    dwell_in_t in = standing;
    float peak_rad_s = 0.0f;
    for (int k = 0; k < steps_in(20.0f); k++) {
        const float before_rad_s = st.speed_rad_s;
        in.omega_s_hat_rad_s = st.speed_rad_s + ((k < steps_in(15.0f)) ? 0.0f : 9.0f);
        dwell_step(&cfg, &st, &in);
        TEST_ASSERT_TRUE(fabsf(st.speed_rad_s - before_rad_s) <= steepest_rad_s);
        peak_rad_s = fmaxf(peak_rad_s, fabsf(st.speed_rad_s));
    }
    TEST_ASSERT_TRUE(peak_rad_s > 0.75f * largest_rad_s);
    TEST_ASSERT_TRUE(peak_rad_s < largest_rad_s);
    TEST_ASSERT_TRUE(dwell_idle(&st));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.speed_rad_s);
    ASSERT_SAME_FLOAT(0.0f, st.swing_rad_s);
}

/* After half a minute: amplitude k max(|w|, tau), against the sine in double precision. */
static void test_the_modulation_is_a_sine_over_speed_or_tau(void)
{
    const double base[3] = {(double)table1.tau_per_s, 6.28f, 12.56f};
    const float reference[3] = {3.14f, -6.28f, 12.56f};
    for (int v = 0; v < 3; v++) {
        st = (dwell_state_t){0};
        dwell_in_t in = standing;
        in.omega_ref_rad_s = reference[v];
        steps(steps_in(40.0f), in);
        for (int k = 0; k < 300; k++) {
            const double turns = (double)st.turns + (double)cfg.turns;
            steps(1, in);
            const double expected = 0.2 * base[v] * sin(2.0 * PI * turns);
            ASSERT_NEAR(1e-3, expected, st.speed_rad_s); /* what is left of the beginning */
        }
        ASSERT_SAME_FLOAT(0.0f, st.reduction_pu);
        ASSERT_NEAR(1e-3, 0.2 * base[v], st.swing_rad_s);
    }
}

static void assert_flux_swings(dwell_in_t in)
{
    st = (dwell_state_t){0};
    steps(steps_in(40.0f), in);
    double most_pu = 0.0;
    for (int k = 0; k < 300; k++) {
        const double before_pu = (double)st.reduction_pu;
        const double rate_per_s = (double)st.rate_pu_per_s;
        steps(1, in);
        most_pu = fmax(most_pu, (double)st.reduction_pu);
        TEST_ASSERT_TRUE(st.reduction_pu >= 0.0f);
        ASSERT_SAME_FLOAT(0.0f, st.speed_rad_s);
        /* The trapezoidal rule: off by h^2/12 of the third derivative. */
        const double mean_per_s = ((double)st.reduction_pu - before_pu) / (double)PERIOD_S;
        ASSERT_NEAR(2e-4, mean_per_s, 0.5 * ((double)st.rate_pu_per_s + rate_per_s));
    }
    ASSERT_NEAR(1e-3, 0.4, most_pu); /* twice the amplitude */
    ASSERT_NEAR(1e-5, 0.2 * (double)cfg.omega_rad_s, st.swing_rad_s);
}

static void test_the_flux_swings_where_it_is_asked_for_and_in_torque_mode(void)
{
    dwell_in_t in = standing;
    in.speed_free = true;
    assert_flux_swings(in);
    cfg.kind = DWELL_FLUX;
    assert_flux_swings(standing);
}

/* A torque is asked for in the dwell: the speed's modulation fades out, then the flux's comes. */
static void test_one_modulation_fades_out_before_the_other_comes(void)
{
    dwell_in_t in = standing;
    steps(steps_in(20.0f), in);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, st.share);
    in.speed_free = true;
    float before_rad_s = st.speed_rad_s;
    for (int k = 0; k < steps_in(0.49f); k++) {
        steps(1, in);
        TEST_ASSERT_TRUE(fabsf(st.speed_rad_s - before_rad_s) < 0.05f);
        ASSERT_SAME_FLOAT(0.0f, st.reduction_pu);
        before_rad_s = st.speed_rad_s;
    }
    steps(steps_in(0.02f), in);
    TEST_ASSERT_TRUE(st.flux);
    TEST_ASSERT_TRUE(st.reduction_pu < 1e-3f);
    steps(steps_in(5.0f), in);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, st.share);
    ASSERT_SAME_FLOAT(0.0f, st.speed_rad_s);
}

static void test_what_is_no_number_is_not_remembered(void)
{
    steps(steps_in(5.0f), standing);
    for (int i = 0; i < NOT_FINITE_COUNT; i++) {
        dwell_in_t in = standing;
        in.omega_s_hat_rad_s = not_finite(i);
        in.i_q_A = not_finite(i);
        const float turned_rad_s = st.omega_s_rad_s;
        steps(1, in);
        ASSERT_SAME_FLOAT(turned_rad_s, st.omega_s_rad_s);
        TEST_ASSERT_TRUE(st.active);
    }
    dwell_in_t in = standing;
    in.omega_ref_rad_s = NAN;
    steps(1, in);
    TEST_ASSERT_FALSE(st.active); /* a reference that is none moves */
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_derives_the_coefficients);
    RUN_TEST(test_init_refuses_every_bad_number);
    RUN_TEST(test_a_rotor_too_fast_for_the_steps_gets_a_slower_modulation);
    RUN_TEST(test_off_nothing_is_looked_at);
    RUN_TEST(test_flux_can_be_asked_for);
    RUN_TEST(test_it_begins_after_the_wait_and_not_before);
    RUN_TEST(test_a_field_that_stands_without_load_is_not_modulated);
    RUN_TEST(test_outside_the_window_without_load_or_steered_it_never_begins);
    RUN_TEST(test_a_crossing_by_the_reference_never_begins_it);
    RUN_TEST(test_steering_ends_it);
    RUN_TEST(test_it_stays_while_inside_twice_the_window_and_loaded_by_half);
    RUN_TEST(test_half_of_any_load_is_enough_to_stay);
    RUN_TEST(test_the_phase_stays_between_0_and_1);
    RUN_TEST(test_a_whole_turn_begins_the_next);
    RUN_TEST(test_it_comes_and_goes_without_a_step);
    RUN_TEST(test_the_modulation_is_a_sine_over_speed_or_tau);
    RUN_TEST(test_the_flux_swings_where_it_is_asked_for_and_in_torque_mode);
    RUN_TEST(test_one_modulation_fades_out_before_the_other_comes);
    RUN_TEST(test_what_is_no_number_is_not_remembered);
    return UNITY_END();
}
