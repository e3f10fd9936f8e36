/* The guard of the speed: when a deviation, a frequency or an unknown speed becomes a fault. */
#include "speed_guard.h"

#include <math.h>
#include <string.h>

#include "reference_machine.h"
#include "unity.h"

#define SCHEDULE_S 3.2e-3f

static const speed_guard_params_t params = {.deviation_rad_s = 18.0f,
                                            .deviation_s = 2.0f,
                                            .unknown_s = 5.0f,
                                            .over_speed_rad_s = 570.0f,
                                            .lambda_nominal_Wb = 0.45f};
static motor_model_t motor;
static speed_guard_config_t cfg;
static speed_guard_state_t st;
static speed_guard_in_t in;

void setUp(void)
{
    const motor_t data = reference_machine[1];
    TEST_ASSERT_TRUE(motor_derive(&motor, &data));
    TEST_ASSERT_TRUE(speed_guard_init(&cfg, &params, &motor, SCHEDULE_S));
    st = (speed_guard_state_t){0};
    in = (speed_guard_in_t){.basis = SPEED_BASIS_ESTIMATE,
                            .omega_rad_s = 100.0f,
                            .omega_ref_rad_s = 100.0f,
                            .omega_s_rad_s = 103.0f};
}

void tearDown(void)
{
}

/* Seconds until these bits come; negative: not in ten. rate: of the speed. */
static float seconds_to(uint32_t bits, float rate_rad_s2)
{
    for (int k = 1; k <= 3125; k++) {
        in.omega_rad_s += rate_rad_s2 * SCHEDULE_S;
        if ((speed_guard_look(&cfg, &st, &in) & bits) != 0u) {
            return (float)k * SCHEDULE_S;
        }
    }
    return -1.0f;
}

#define ASSERT_REFUSED(field, value)                                                               \
    do {                                                                                           \
        speed_guard_params_t changed = params;                                                     \
        changed.field = (value);                                                                   \
        TEST_ASSERT_FALSE_MESSAGE(speed_guard_init(&cfg, &changed, &motor, SCHEDULE_S), #field);   \
    } while (0)

static void test_init_refuses_what_cannot_protect(void)
{
    static const float bad[] = {0.0f, -1.0f, NAN, INFINITY};
    for (size_t k = 0u; k < 4u; k++) {
        ASSERT_REFUSED(deviation_rad_s, bad[k]);
        ASSERT_REFUSED(deviation_s, bad[k]);
        ASSERT_REFUSED(unknown_s, bad[k]);
        ASSERT_REFUSED(over_speed_rad_s, bad[k]);
        ASSERT_REFUSED(lambda_nominal_Wb, bad[k]);
        TEST_ASSERT_FALSE(speed_guard_init(&cfg, &params, &motor, bad[k]));
    }
    ASSERT_REFUSED(count_V, -0.1f);
    ASSERT_REFUSED(count_V, NAN);
    ASSERT_REFUSED(unknown_s, 3300.0f);
    ASSERT_REFUSED(deviation_s, 3300.0f);
}

static void test_its_own_times_end_at_those_it_is_given(void)
{
    TEST_ASSERT_TRUE(speed_guard_init(&cfg, &params, &motor, SCHEDULE_S));
    TEST_ASSERT_EQUAL_FLOAT(0.8f, cfg.unexplained_s);
    TEST_ASSERT_EQUAL_FLOAT(0.15f, cfg.warning_s);
    TEST_ASSERT_EQUAL_FLOAT(0.9f, cfg.approach_s);
    speed_guard_params_t quick = params;
    quick.deviation_s = 0.04f;
    TEST_ASSERT_TRUE(speed_guard_init(&cfg, &quick, &motor, SCHEDULE_S));
    TEST_ASSERT_EQUAL_FLOAT(0.04f, cfg.unexplained_s);
    TEST_ASSERT_EQUAL_FLOAT(0.04f, cfg.warning_s);
    TEST_ASSERT_EQUAL_FLOAT(0.04f, cfg.approach_s);
}

static void test_a_speed_at_its_reference_is_none_of_its_business(void)
{
    TEST_ASSERT_EQUAL_FLOAT(-1.0f, seconds_to(0xffffffffu, 0.0f));
    in.omega_rad_s = 117.9f; /* as far as it may be */
    TEST_ASSERT_EQUAL_FLOAT(-1.0f, seconds_to(0xffffffffu, 0.0f));
    TEST_ASSERT_FALSE(st.speed_unknown);
}

/* With torque to spare nothing explains it. */
static void test_a_standing_deviation_is_a_fault(void)
{
    in.omega_rad_s = 118.1f;
    TEST_ASSERT_FLOAT_WITHIN(0.02f, 0.8f, seconds_to(FAULT_SPEED_DEVIATION, 0.0f));
    setUp();
    in.omega_rad_s = 82.0f - 18.0f; /* twice as far */
    TEST_ASSERT_FLOAT_WITHIN(0.02f, 0.4f, seconds_to(FAULT_SPEED_DEVIATION, 0.0f));
    TEST_ASSERT_TRUE(st.deviation_s < 1.0f);
}

/* The shaft stays behind by twice the limit. */
static void test_beside_a_ramp_distance_does_not_hurry(void)
{
    const float slew_rad_s2[] = {94.0f, 41.0f, 39.0f, -94.0f};
    const bool ramp[] = {true, true, false, true};
    for (int n = 0; n < 4; n++) {
        setUp();
        in.omega_ref_rad_s = (slew_rad_s2[n] > 0.0f) ? 72.1f : -72.1f;
        st.omega_ref_rad_s = in.omega_ref_rad_s;
        int k = 0;
        uint32_t faults = 0u;
        while (((faults & FAULT_SPEED_DEVIATION) == 0u) && (k < 1000)) {
            in.omega_ref_rad_s += slew_rad_s2[n] * SCHEDULE_S;
            in.omega_rad_s = in.omega_ref_rad_s - ((slew_rad_s2[n] > 0.0f) ? 36.0f : -36.0f);
            st.omega_slow_rad_s = in.omega_rad_s; /* comes no nearer */
            faults = speed_guard_look(&cfg, &st, &in);
            k++;
        }
        TEST_ASSERT_FLOAT_WITHIN(0.01f, ramp[n] ? 0.8f : 0.4f, (float)k * SCHEDULE_S);
    }
    /* The longer time hurries all the same: four times as far. */
    setUp();
    in.omega_rad_s = 0.0f;
    in.omega_ref_rad_s = 72.1f;
    int k = 0;
    while (((speed_guard_look(&cfg, &st, &in) & FAULT_SPEED_DEVIATION) == 0u) && (k < 1000)) {
        in.omega_ref_rad_s += 94.0f * SCHEDULE_S;
        k++;
    }
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 0.5f, (float)k * SCHEDULE_S);
}

static void test_at_the_limit_of_torque_it_is_told_first(void)
{
    in.at_limit = true;
    in.omega_rad_s = 118.1f;
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 0.15f, seconds_to(FAULT_DERATED, 0.0f));
    TEST_ASSERT_FLOAT_WITHIN(0.02f, 2.0f - 0.15f, seconds_to(FAULT_SPEED_DEVIATION, 0.0f));
    /* Far away counts four times at most. */
    setUp();
    in.at_limit = true;
    in.omega_rad_s = 1e4f;
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 0.15f, seconds_to(FAULT_DERATED, 0.0f));
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 0.35f, seconds_to(FAULT_SPEED_DEVIATION, 0.0f));
}

/* A lost drive held a reference it believed to be 14 rad/s away with all its torque for 20 s. */
static void test_all_the_torque_in_vain_is_away_at_half_the_distance(void)
{
    in.at_limit = true;
    in.omega_rad_s = 109.1f;
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 2.0f, seconds_to(FAULT_SPEED_DEVIATION, 0.0f));
    /* The warning does not wait so long: a load may take the shaft away meanwhile. */
    setUp();
    in.at_limit = true;
    in.omega_rad_s = 109.1f;
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 0.15f, seconds_to(FAULT_DERATED, 0.0f));
    /* At high speed, where 7 % of the reference are allowed, it waits for a sag to pass. */
    setUp();
    in.at_limit = true;
    in.omega_ref_rad_s = 400.0f;
    in.omega_rad_s = 400.0f - 14.1f;
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 0.9f, seconds_to(FAULT_DERATED, 0.0f));
    setUp();
    in.at_limit = true;
    in.omega_ref_rad_s = 400.0f;
    in.omega_rad_s = 400.0f - 13.9f;
    TEST_ASSERT_EQUAL_FLOAT(-1.0f, seconds_to(FAULT_DERATED, 0.0f));
    setUp();
    in.at_limit = true;
    in.omega_rad_s = 108.9f;
    TEST_ASSERT_EQUAL_FLOAT(-1.0f, seconds_to(0xffffffffu, 0.0f));
    /* With torque in reserve nothing is wrong yet, nor in V/f. */
    setUp();
    in.omega_rad_s = 117.9f;
    TEST_ASSERT_EQUAL_FLOAT(-1.0f, seconds_to(FAULT_SPEED_DEVIATION, 0.0f));
    setUp();
    in.basis = SPEED_BASIS_VOLTAGE;
    in.at_limit = true;
    in.omega_rad_s = 117.9f;
    TEST_ASSERT_EQUAL_FLOAT(-1.0f, seconds_to(FAULT_DERATED, 0.0f));
}

/* Without a limit as well: a large inertia that only comes nearer for more than .9 s. */
static void test_a_speed_that_stays_behind_is_told_on_its_way(void)
{
    in.omega_rad_s = 60.0f;
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 0.9f, seconds_to(FAULT_DERATED, 8.0f));
    TEST_ASSERT_TRUE(st.deviation_s < 0.05f);
    /* Within the limit after .8 s. */
    setUp();
    in.omega_rad_s = 82.0f - 6.4f;
    for (int k = 0; k < 3125; k++) {
        in.omega_rad_s = (in.omega_rad_s < 99.0f) ? (in.omega_rad_s + 8.0f * SCHEDULE_S) : 99.0f;
        TEST_ASSERT_EQUAL_UINT32(0u, speed_guard_look(&cfg, &st, &in));
    }
}

/* A load of 4 Nm drives the shaft: the work case of the issue, 225 rad/s^2 electrical. */
static void test_a_load_that_runs_away_is_found_within_a_second(void)
{
    in.at_limit = true;
    TEST_ASSERT_TRUE(seconds_to(FAULT_DERATED, 225.0f) < 0.3f);
    TEST_ASSERT_TRUE(seconds_to(FAULT_SPEED_DEVIATION, 225.0f) < 0.5f);
}

static void test_a_speed_that_comes_nearer_is_left_alone(void)
{
    const float ways[] = {1.0f, -1.0f};
    for (int n = 0; n < 2; n++) {
        setUp();
        in.omega_ref_rad_s = ways[n] * 300.0f;
        in.omega_rad_s = ways[n] * 100.0f;
        /* 120 rad/s nearer in 10 s: told, and left alone */
        TEST_ASSERT_EQUAL_FLOAT(-1.0f, seconds_to(~FAULT_DERATED, ways[n] * 12.0f));
    }
}

/* A warning, and only that; an imposed current is always at its limit. */
static void test_all_the_torque_on_a_long_way_is_told(void)
{
    const speed_basis_t basis[] = {SPEED_BASIS_VOLTAGE, SPEED_BASIS_CURRENT, SPEED_BASIS_TAKEN_OVER,
                                   SPEED_BASIS_ESTIMATE};
    const float told_s[] = {0.15f, -1.0f, 0.9f, 0.9f};
    for (int n = 0; n < 4; n++) {
        setUp();
        in.at_limit = true;
        in.basis = basis[n];
        in.omega_ref_rad_s = 300.0f;
        in.omega_rad_s = 100.0f;
        TEST_ASSERT_FLOAT_WITHIN(0.01f, told_s[n], seconds_to(FAULT_DERATED, 12.0f));
    }
}

/* 1 rad/s from the reference, and all the torque in use: counts while the field nearly stands. */
static void test_all_the_torque_in_a_field_that_stands_is_told(void)
{
    const struct {
        float omega_s_rad_s;
        speed_basis_t basis;
        bool at_limit;
        float told_s, fault_s;
    } of[] = {{5.9f, SPEED_BASIS_ESTIMATE, true, 0.15f, 2.0f},
              {-5.9f, SPEED_BASIS_ESTIMATE, true, 0.15f, 2.0f},
              {6.0f, SPEED_BASIS_ESTIMATE, true, -1.0f, -1.0f},
              {-6.0f, SPEED_BASIS_ESTIMATE, true, -1.0f, -1.0f},
              {0.0f, SPEED_BASIS_ESTIMATE, false, -1.0f, -1.0f},
              {0.0f, SPEED_BASIS_STANDING, true, -1.0f, -1.0f},
              {NAN, SPEED_BASIS_ESTIMATE, true, 0.15f, 2.0f}};
    for (size_t k = 0u; k < sizeof of / sizeof of[0]; k++) {
        const uint32_t bits[] = {FAULT_DERATED, FAULT_SPEED_DEVIATION};
        const float expected_s[] = {of[k].told_s, of[k].fault_s};
        for (int n = 0; n < 2; n++) {
            setUp();
            in.omega_rad_s = 1.0f;
            in.omega_ref_rad_s = 0.0f;
            in.omega_s_rad_s = of[k].omega_s_rad_s;
            in.basis = of[k].basis;
            in.at_limit = of[k].at_limit;
            TEST_ASSERT_FLOAT_WITHIN(0.01f, expected_s[n], seconds_to(bits[n], 0.0f));
        }
    }
}

/* On the way there, 200 rad/s away or 5, for so long. */
static bool told_on_the_way(float time_s, bool far)
{
    bool told = false;
    for (float t_s = 0.0f; t_s < time_s; t_s += SCHEDULE_S) {
        in.omega_rad_s += 12.0f * SCHEDULE_S;
        in.omega_ref_rad_s = in.omega_rad_s + (far ? 200.0f : 5.0f);
        told = speed_guard_look(&cfg, &st, &in) != 0u;
    }
    return told;
}

/* Whatever the torque. */
static void test_a_speed_that_is_behind_only_at_times_is_not_told(void)
{
    for (int n = 0; n < 2; n++) {
        setUp();
        in.at_limit = n == 0;
        (void)told_on_the_way(0.1f, false); /* the mean of the speed is behind from here on */
        TEST_ASSERT_FALSE(told_on_the_way(0.8f, true));
        TEST_ASSERT_FALSE(told_on_the_way(0.5f, false));
        TEST_ASSERT_FALSE(told_on_the_way(0.55f, true));
        TEST_ASSERT_TRUE(told_on_the_way(0.1f, true));
        TEST_ASSERT_FALSE(told_on_the_way(SCHEDULE_S, false));
        TEST_ASSERT_TRUE(told_on_the_way(2.0f * SCHEDULE_S, true));
        in.omega_ref_rad_s = in.omega_rad_s; /* there: it is forgotten as fast as it came */
        TEST_ASSERT_EQUAL_HEX32(0u, speed_guard_look(&cfg, &st, &in));
        TEST_ASSERT_EQUAL_FLOAT(-1.0f, seconds_to(FAULT_DERATED, 0.0f));
        TEST_ASSERT_EQUAL_FLOAT(0.0f, st.approach_s);
    }
}

/* 18 rad/s are allowed: a little more is on the way, a little less is there. */
static void test_on_the_way_is_beyond_what_is_allowed(void)
{
    for (int n = 0; n < 2; n++) {
        setUp();
        (void)told_on_the_way(0.1f, false);
        (void)told_on_the_way(0.5f, true);
        const float before_s = st.approach_s;
        in.omega_rad_s += 12.0f * SCHEDULE_S;
        in.omega_ref_rad_s = in.omega_rad_s + ((n == 0) ? 18.5f : 17.5f);
        (void)speed_guard_look(&cfg, &st, &in);
        TEST_ASSERT_EQUAL(n == 0, st.approach_s > before_s);
    }
}

/* What was lost and follows again heals at a twentieth of the time. */
static void test_a_rotor_that_was_lost_heals_slowly(void)
{
    st.basis = SPEED_BASIS_ESTIMATE;
    st.lost_s = 0.4f;
    for (int k = 0; k < 625; k++) {
        TEST_ASSERT_EQUAL_HEX32(0u, speed_guard_look(&cfg, &st, &in));
    }
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, 0.3f, st.lost_s);
}

/* Seen again, the time of an unknown speed is taken back at half the time. */
static void test_an_unknown_speed_heals_at_half_the_time(void)
{
    st.basis = SPEED_BASIS_ESTIMATE;
    st.unknown_s = 3.0f;
    st.speed_unknown = true;
    for (int k = 0; k < 625; k++) {
        TEST_ASSERT_EQUAL_HEX32(0u, speed_guard_look(&cfg, &st, &in));
        TEST_ASSERT_FALSE(st.speed_unknown);
    }
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, 2.0f, st.unknown_s);
    st = (speed_guard_state_t){.basis = SPEED_BASIS_ESTIMATE, .speed_unknown = true};
    TEST_ASSERT_EQUAL_HEX32(0u, speed_guard_look(&cfg, &st, &in));
    TEST_ASSERT_FALSE(st.speed_unknown);
}

/* An estimate in doubt is no fault, for however long, and no help to a rotor that is not seen. */
static void test_doubt_makes_the_speed_unknown_and_no_fault(void)
{
    in.in_doubt = true;
    TEST_ASSERT_EQUAL_FLOAT(-1.0f, seconds_to(0xffffffffu, 0.0f));
    TEST_ASSERT_TRUE(st.speed_unknown);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.unknown_s);
    st.unknown_s = 3.0f;
    (void)speed_guard_look(&cfg, &st, &in);
    TEST_ASSERT_TRUE(st.speed_unknown);
    TEST_ASSERT_TRUE(st.unknown_s < 3.0f);
    in.in_doubt = false;
    (void)speed_guard_look(&cfg, &st, &in);
    TEST_ASSERT_FALSE(st.speed_unknown);
}

/* It does not stand in for a rotor that is not seen, nor hide one. */
static void test_doubt_neither_hurries_nor_hides_an_unseen_rotor(void)
{
    float unknown_s[2];
    for (int n = 0; n < 2; n++) {
        setUp();
        in.basis = SPEED_BASIS_NOBODY;
        in.in_doubt = n == 1;
        unknown_s[n] = seconds_to(FAULT_SPEED_DEVIATION, 0.0f);
        TEST_ASSERT_TRUE(st.speed_unknown);
    }
    TEST_ASSERT_TRUE(unknown_s[0] > 0.0f);
    TEST_ASSERT_EQUAL_FLOAT(unknown_s[0], unknown_s[1]);
}

/* Back at the reference, what was counted is taken back at half the time. */
static void test_a_deviation_that_ended_heals_at_half_the_time(void)
{
    st.basis = SPEED_BASIS_ESTIMATE;
    st.deviation_s = 1.0f;
    st.unexplained_s = 0.7f;
    for (int k = 0; k < 125; k++) {
        TEST_ASSERT_EQUAL_HEX32(0u, speed_guard_look(&cfg, &st, &in));
    }
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, 0.8f, st.deviation_s);
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, 0.5f, st.unexplained_s);
}

/* Of a large reference 7 % are allowed. */
static void test_the_deviation_grows_with_the_reference(void)
{
    in.omega_ref_rad_s = 500.0f;
    in.omega_rad_s = 466.0f;
    TEST_ASSERT_EQUAL_FLOAT(-1.0f, seconds_to(FAULT_SPEED_DEVIATION, 0.0f));
    in.omega_rad_s = 464.0f;
    TEST_ASSERT_FLOAT_WITHIN(0.03f, 0.8f, seconds_to(FAULT_SPEED_DEVIATION, 0.0f));
}

/* As an overlong speed filter makes it: nearer half of the time. */
static void test_a_shaft_that_swings_is_found(void)
{
    float found_s = -1.0f;
    for (int k = 0; (k < 3125) && (found_s < 0.0f); k++) {
        in.omega_rad_s = 100.0f + 300.0f * sinf(6.0f * (float)k * SCHEDULE_S);
        if ((speed_guard_look(&cfg, &st, &in) & FAULT_SPEED_DEVIATION) != 0u) {
            found_s = (float)k * SCHEDULE_S;
        }
    }
    TEST_ASSERT_TRUE((found_s > 0.0f) && (found_s < 1.0f));
}

static void test_no_number_is_a_deviation_and_none_is_remembered(void)
{
    in.omega_rad_s = 99.0f;
    (void)speed_guard_look(&cfg, &st, &in);
    in.omega_rad_s = NAN;
    TEST_ASSERT_FLOAT_WITHIN(0.02f, 0.8f, seconds_to(FAULT_SPEED_DEVIATION, 0.0f));
    in.omega_rad_s = 99.0f;
    (void)speed_guard_look(&cfg, &st, &in);
    TEST_ASSERT_EQUAL_FLOAT(99.0f, st.omega_slow_rad_s);
}

static void test_the_stator_frequency_trips_as_well(void)
{
    in.omega_s_rad_s = -570.0f;
    TEST_ASSERT_EQUAL_FLOAT(-1.0f, seconds_to(FAULT_OVER_SPEED, 0.0f));
    in.omega_s_rad_s = -571.0f;
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 4.0f * SCHEDULE_S, seconds_to(FAULT_OVER_SPEED, 0.0f));
    setUp();
    in.omega_s_rad_s = NAN;
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 4.0f * SCHEDULE_S, seconds_to(FAULT_OVER_SPEED, 0.0f));
}

/* No current, no EMF: a rotor that is gone. At 0 V and 1 A it cannot be one that follows. */
static void impose(speed_basis_t basis, float omega_rad_s)
{
    in.basis = basis;
    in.omega_rad_s = omega_rad_s;
    in.omega_ref_rad_s = omega_rad_s;
    in.omega_s_rad_s = omega_rad_s;
    in.rotor = (rotor_check_in_t){.voltage = basis == SPEED_BASIS_VOLTAGE,
                                  .omega_s_rad_s = omega_rad_s,
                                  .i_A = {9.0f, 0.0f},
                                  .Rs_ohm = motor.Rs_ohm,
                                  .u_V = {9.0f * motor.Rs_ohm, 0.0f}};
}

static void follow(void)
{
    in.rotor.u_V.beta = 9.0f * in.omega_s_rad_s * (motor.kr * motor.M_H + motor.sigma_Ls_H);
}

static void test_a_rotor_that_does_not_follow_is_unknown_and_then_a_fault(void)
{
    for (speed_basis_t b = SPEED_BASIS_TAKEN_OVER; b <= SPEED_BASIS_VOLTAGE; b++) {
        setUp();
        impose(b, 60.0f);
        follow();
        TEST_ASSERT_EQUAL_FLOAT(-1.0f, seconds_to(0xffffffffu, 0.0f));
        TEST_ASSERT_FALSE(st.speed_unknown);
        in.rotor.u_V.beta = 0.0f;
        float unknown_s = 0.0f;
        while (!st.speed_unknown) {
            TEST_ASSERT_EQUAL_HEX32(0u, speed_guard_look(&cfg, &st, &in));
            unknown_s += SCHEDULE_S;
        }
        TEST_ASSERT_TRUE(unknown_s < 0.3f);
        TEST_ASSERT_FLOAT_WITHIN(0.02f, 0.75f, seconds_to(FAULT_SPEED_DEVIATION, 0.0f));
    }
}

static void test_too_slow_to_see_the_rotor_is_unknown_for_a_limited_time(void)
{
    impose(SPEED_BASIS_CURRENT, 0.5f);
    TEST_ASSERT_EQUAL_HEX32(0u, speed_guard_look(&cfg, &st, &in));
    TEST_ASSERT_TRUE(st.speed_unknown);
    TEST_ASSERT_FLOAT_WITHIN(0.02f, 5.0f, seconds_to(FAULT_SPEED_DEVIATION, 0.0f));
    setUp();
    in.basis = SPEED_BASIS_NOBODY;
    TEST_ASSERT_FLOAT_WITHIN(0.02f, 5.0f, seconds_to(FAULT_SPEED_DEVIATION, 0.0f));
    TEST_ASSERT_TRUE(st.speed_unknown);
    in.basis = SPEED_BASIS_ESTIMATE; /* who knows it again clears it */
    in.omega_ref_rad_s = in.omega_rad_s;
    (void)speed_guard_look(&cfg, &st, &in);
    TEST_ASSERT_FALSE(st.speed_unknown);
}

/* 1.2 rad/s^2, as with 88 times the inertia: told in a take-over, whose frequency has no ripple,
 * and left alone. An estimate, or a take-over that stays where it is or goes away, is a fault. */
static void test_a_take_over_may_be_slow_on_its_way(void)
{
    for (float way = -1.0f; way <= 1.0f; way += 2.0f) {
        const struct {
            speed_basis_t basis;
            float rate_rad_s2, fault_s;
        } of[] = {{SPEED_BASIS_TAKEN_OVER, way * 1.2f, -1.0f},
                  {SPEED_BASIS_TAKEN_OVER, way * 0.02f, 0.2f},
                  {SPEED_BASIS_TAKEN_OVER, way * -1.2f, 0.2f},
                  {SPEED_BASIS_ESTIMATE, way * 1.2f, 0.2f}};
        for (size_t k = 0u; k < sizeof of / sizeof of[0]; k++) {
            setUp();
            impose(of[k].basis, way * 60.0f);
            in.omega_ref_rad_s = way * 180.0f;
            follow();
            TEST_ASSERT_FLOAT_WITHIN(0.01f, of[k].fault_s,
                                     seconds_to(~FAULT_DERATED, of[k].rate_rad_s2));
            const bool told = st.approach_s > 0.8f;
            TEST_ASSERT_EQUAL(of[k].fault_s < 0.0f, told);
        }
    }
}

/* Changing to and fro between two bases suspends nothing. */
static void test_a_change_of_basis_keeps_the_time_away(void)
{
    float found_s = 0.0f;
    uint32_t faults = 0u;
    while (((faults & FAULT_SPEED_DEVIATION) == 0u) && (found_s < 3.0f)) {
        const bool imposed = in.basis == SPEED_BASIS_ESTIMATE;
        impose(imposed ? SPEED_BASIS_CURRENT : SPEED_BASIS_ESTIMATE, 60.0f);
        follow();
        in.omega_ref_rad_s = 100.0f;
        faults = speed_guard_look(&cfg, &st, &in);
        found_s += SCHEDULE_S;
    }
    TEST_ASSERT_TRUE(found_s < 0.5f);
    st.rotor.i2_A2 = 81.0f; /* of the current before */
    in.basis = SPEED_BASIS_STANDING;
    (void)speed_guard_look(&cfg, &st, &in);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.rotor.i2_A2);
}

static void test_a_start_on_a_turning_shaft_is_refused(void)
{
    in = (speed_guard_in_t){.basis = SPEED_BASIS_STANDING, .premagnetising = true};
    uint32_t faults = 0u;
    for (int k = 0; k < 12; k++) {
        TEST_ASSERT_EQUAL_HEX32(0u, faults);
        in.rotor.u_V.beta = (((k / 2) % 2) == 0) ? 3.0f : -3.0f;
        faults = speed_guard_look(&cfg, &st, &in);
    }
    TEST_ASSERT_EQUAL_HEX32(FAULT_FLYING_START, faults);
    in.premagnetising = false; /* commissioning's tones are no shaft */
    TEST_ASSERT_EQUAL_HEX32(0u, speed_guard_look(&cfg, &st, &in));
}

static void test_gates_off_forgets(void)
{
    in.omega_rad_s = 500.0f;
    (void)seconds_to(FAULT_SPEED_DEVIATION, 0.0f);
    in.basis = SPEED_BASIS_NONE;
    const speed_guard_state_t none = {0};
    TEST_ASSERT_EQUAL_HEX32(0u, speed_guard_look(&cfg, &st, &in));
    TEST_ASSERT_EQUAL_MEMORY(&none, &st, sizeof st);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_what_cannot_protect);
    RUN_TEST(test_its_own_times_end_at_those_it_is_given);
    RUN_TEST(test_a_speed_at_its_reference_is_none_of_its_business);
    RUN_TEST(test_a_standing_deviation_is_a_fault);
    RUN_TEST(test_beside_a_ramp_distance_does_not_hurry);
    RUN_TEST(test_at_the_limit_of_torque_it_is_told_first);
    RUN_TEST(test_all_the_torque_in_vain_is_away_at_half_the_distance);
    RUN_TEST(test_a_speed_that_stays_behind_is_told_on_its_way);
    RUN_TEST(test_a_load_that_runs_away_is_found_within_a_second);
    RUN_TEST(test_a_speed_that_comes_nearer_is_left_alone);
    RUN_TEST(test_all_the_torque_on_a_long_way_is_told);
    RUN_TEST(test_all_the_torque_in_a_field_that_stands_is_told);
    RUN_TEST(test_a_speed_that_is_behind_only_at_times_is_not_told);
    RUN_TEST(test_on_the_way_is_beyond_what_is_allowed);
    RUN_TEST(test_a_rotor_that_was_lost_heals_slowly);
    RUN_TEST(test_an_unknown_speed_heals_at_half_the_time);
    RUN_TEST(test_doubt_makes_the_speed_unknown_and_no_fault);
    RUN_TEST(test_doubt_neither_hurries_nor_hides_an_unseen_rotor);
    RUN_TEST(test_a_deviation_that_ended_heals_at_half_the_time);
    RUN_TEST(test_the_deviation_grows_with_the_reference);
    RUN_TEST(test_a_shaft_that_swings_is_found);
    RUN_TEST(test_no_number_is_a_deviation_and_none_is_remembered);
    RUN_TEST(test_the_stator_frequency_trips_as_well);
    RUN_TEST(test_a_rotor_that_does_not_follow_is_unknown_and_then_a_fault);
    RUN_TEST(test_too_slow_to_see_the_rotor_is_unknown_for_a_limited_time);
    RUN_TEST(test_a_take_over_may_be_slow_on_its_way);
    RUN_TEST(test_a_change_of_basis_keeps_the_time_away);
    RUN_TEST(test_a_start_on_a_turning_shaft_is_refused);
    RUN_TEST(test_gates_off_forgets);
    return UNITY_END();
}
