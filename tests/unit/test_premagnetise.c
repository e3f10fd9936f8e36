/* What direct current tells of the stator before torque, and what becomes of it. */
#include "premagnetise.h"

#include "exact.h"
#include "fault.h"
#include "mode_fixture.h"

#define LEVEL_PERIODS 4u /* the last two are averaged */
#define RS_OHM        1.5f
#define U_DC_V        540.0f /* of the fixture */

static premagnetise_config_t cfg;
static premagnetise_state_t st;
static uint32_t faults;
static uint32_t slot;
static float i_ref_A;

static void configure(bool enable, bool identify)
{
    const rs_measurement_params_t params = {.enable = enable,
                                            .level = {{5.0f, 0.0f, 3.0f, 8.0f}},
                                            .level_s = 800e-6f,
                                            .average_s = 400e-6f,
                                            .bias = 1.25f,
                                            .ratio_max = 2.0f};
    cfg = (premagnetise_config_t){.Rs_ohm = RS_OHM, .identify_leg_loss = identify};
    TEST_ASSERT_TRUE(rs_measurement_init(&cfg.measurement, &params, RS_OHM, 200e-6f));
    cfg.measurement.dither_A = 0.0f; /* its teeth: test_rs_measurement.c */
    st = (premagnetise_state_t){0};
    faults = 0u;
    slot = 0u;
}

void setUp(void)
{
    configure(true, true);
}

void tearDown(void)
{
}

/* One period at a current, with Rs of the motor and what the duties give beyond it. */
static bool step(float i_A, float Rs_ohm, float lost_V)
{
    mode_fixture_start();
    in.slot = slot;
    meas.i_s_A = (ab_t){i_A, 77.0f};
    acting.ended_V = (ab_t){Rs_ohm * i_A + lost_V, 77.0f};
    in.u_s_V = (ab_t){Rs_ohm * i_A, 77.0f};
    return premagnetise_measure(&cfg, &st, &in, &i_ref_A, &faults);
}

static void both_levels(float Rs_ohm, float lost_V)
{
    for (uint32_t k = 0u; k < 2u * LEVEL_PERIODS; k++) {
        const float level_A = (k < LEVEL_PERIODS) ? 8.0f : 5.0f;
        TEST_ASSERT_TRUE(step(level_A, Rs_ohm, lost_V));
        ASSERT_SAME_FLOAT(level_A, i_ref_A);
        ASSERT_SAME_FLOAT(0.0f, st.Rs_delta_ohm);
        TEST_ASSERT_FALSE(st.leg_loss_found);
        TEST_ASSERT_EQUAL_HEX32(0u, faults);
    }
}

static void test_not_wanted_it_asks_for_nothing(void)
{
    configure(false, true);
    i_ref_A = 3.0f;
    TEST_ASSERT_FALSE(step(8.0f, 1.2f, 6.0f));
    ASSERT_SAME_FLOAT(0.0f, i_ref_A);
    ASSERT_SAME_FLOAT(0.0f, st.Rs_delta_ohm);
    TEST_ASSERT_FALSE(st.leg_loss_found);
    TEST_ASSERT_EQUAL_HEX32(0u, faults);
}

/* Rs times its bias less the parameter, and the voltage of a leg over the dc link. */
static void test_resistance_and_loss_are_kept(void)
{
    both_levels(1.2f, 6.0f);
    TEST_ASSERT_FALSE(step(5.0f, 1.2f, 6.0f));
    ASSERT_NEAR(1e-6, 1.25 * 1.2 - 1.5, st.Rs_delta_ohm);
    TEST_ASSERT_TRUE(st.leg_loss_found);
    /* 6 V along u is a leg's loss times 2 sqrt(2/3). */
    ASSERT_NEAR(1e-7, 6.0 / (2.0 * sqrt(2.0 / 3.0)) / (double)U_DC_V, st.leg_loss_pu);
    ASSERT_SAME_FLOAT(0.0f, st.leg_threshold_A);
    TEST_ASSERT_EQUAL_HEX32(0u, faults);
    /* Done: the next periods change nothing. */
    const premagnetise_state_t found = st;
    TEST_ASSERT_FALSE(step(4.0f, 9.0f, 60.0f));
    TEST_ASSERT_EQUAL_MEMORY(&found, &st, sizeof found);
}

/* 6 V less 3 VA/i, and +-2 V at +-.1 A: the line ends where it would touch the tail. Two teeth in
 * an average of 64 periods show the slopes: Rs + 3 VA/i^2 where their amplitude is .5 A. */
static void test_threshold_and_tail_are_kept_too(void)
{
    static const float tooth_A[] = {0.5f, 0.0f, -0.5f, 0.0f};
    static const float mean_A[] = {0.25f, 0.25f, -0.25f, -0.25f};
    const float level_A[RS_LEVELS] = {5.0f, 0.1f, 3.0f, 8.0f};
    const double tail_A = 3.0 / (3.0 * 6.0 / (2.0 * sqrt(2.0 / 3.0)));
    cfg.measurement.curve = true;
    cfg.measurement.level_periods = 96u;
    cfg.measurement.average_periods = 64u;
    cfg.measurement.dither_turns = 1.0f / 32.0f;
    cfg.measurement.level.A[RS_LEVEL_SMALL] = 0.1f;
    for (uint32_t k = 0u; k < RS_LEVELS * 96u; k++) {
        const uint32_t level = k / 96u;
        const float at_A = level_A[level];
        float i_A = at_A + tooth_A[k % 4u];
        float lost_V = 6.0f - 3.0f / at_A - 1.2f * (i_A - at_A) +
                       (1.2f + 3.0f / (at_A * at_A)) * mean_A[k % 4u];
        if (level == RS_LEVEL_SMALL) { /* as asked for before */
            i_A = (k == 96u) ? 0.1f : i_ref_A;
            lost_V = 20.0f * i_A;
        }
        slot = (k + SLOT_GUARD_CURRENT - 1u) % SLOT_COUNT; /* every level begins with a window */
        TEST_ASSERT_TRUE(step(i_A, 1.2f, lost_V));
        const bool reversed = (level == RS_LEVEL_SMALL) && (k >= 96u + 64u);
        ASSERT_SAME_FLOAT(reversed ? -0.1f : at_A, i_ref_A);
    }
    TEST_ASSERT_FALSE(step(5.0f, 1.2f, 6.0f));
    TEST_ASSERT_TRUE(st.leg_loss_found);
    ASSERT_NEAR(1e-4, tail_A, st.leg_tail_A);
    ASSERT_NEAR(2e-4, 2.0 * tail_A, st.leg_threshold_A);
}

static void test_the_loss_is_kept_only_where_it_is_asked_for(void)
{
    configure(true, false);
    both_levels(1.4f, 6.0f);
    TEST_ASSERT_FALSE(step(5.0f, 1.4f, 6.0f));
    ASSERT_NEAR(1e-6, 1.25 * 1.4 - 1.5, st.Rs_delta_ohm);
    TEST_ASSERT_FALSE(st.leg_loss_found);
    ASSERT_SAME_FLOAT(0.0f, st.leg_loss_pu);
}

/* Four times the nameplate: a fault in every period that asks, and no other resistance. */
static void test_a_refusal_is_a_fault_while_it_is_asked_for(void)
{
    both_levels(6.0f, 6.0f);
    for (int k = 0; k < 3; k++) {
        faults = FAULT_OVER_CURRENT; /* of somebody else */
        TEST_ASSERT_FALSE(step(5.0f, 6.0f, 6.0f));
        TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_CURRENT | FAULT_STATOR_RESISTANCE, faults);
        ASSERT_SAME_FLOAT(0.0f, st.Rs_delta_ohm);
        TEST_ASSERT_FALSE(st.leg_loss_found);
    }
}

static void test_what_is_no_number_is_refused(void)
{
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        configure(true, true);
        for (uint32_t n = 0u; n < 2u * LEVEL_PERIODS; n++) {
            TEST_ASSERT_TRUE(step(8.0f, (n == 3u) ? not_finite(k) : 1.2f, 6.0f));
        }
        TEST_ASSERT_FALSE(step(5.0f, 1.2f, 6.0f));
        TEST_ASSERT_EQUAL_HEX32(FAULT_STATOR_RESISTANCE, faults);
        ASSERT_SAME_FLOAT(0.0f, st.Rs_delta_ohm);
    }
}

/* Period k of both levels, with a tooth of half an ampere to and fro in the averaged periods, in
 * which the rotor is a resistance beside Rs. */
static void tooth_period(uint32_t k, float Rr_ohm, float known_pu)
{
    const float off_A[LEVEL_PERIODS] = {0.0f, 0.5f, 0.5f, -1.5f};
    const float mean_A[LEVEL_PERIODS] = {0.0f, 0.0f, 0.5f, -0.5f};
    const float Rs_ohm = 1.2f;
    const float level_A = (k < LEVEL_PERIODS) ? 8.0f : 5.0f;
    const uint32_t n = k % LEVEL_PERIODS;
    mode_fixture_start();
    in.Rr_pu = known_pu;
    meas.i_s_A = (ab_t){level_A + off_A[n], 77.0f};
    in.u_s_V = (ab_t){Rs_ohm * level_A, 77.0f};
    acting.ended_V = (ab_t){Rs_ohm * level_A + (Rs_ohm + Rr_ohm) * mean_A[n] + 6.0f, 77.0f};
    const bool busy = premagnetise_measure(&cfg, &st, &in, &i_ref_A, &faults);
    TEST_ASSERT_EQUAL_INT(k < 2u * LEVEL_PERIODS, busy);
    TEST_ASSERT_EQUAL_HEX32(0u, faults);
}

static void measure_rotor(float Rr_ohm, float known_pu)
{
    st.measurement = (rs_measurement_state_t){0};
    for (uint32_t k = 0u; k <= 2u * LEVEL_PERIODS; k++) {
        tooth_period(k, Rr_ohm, known_pu);
    }
}

static void test_a_rotor_beyond_what_a_start_can_tell_is_kept(void)
{
    const float found_pu[] = {0.6f, 0.84f, 0.86f, 1.14f, 1.16f, 1.7f};
    const float kept_pu[] = {-0.4f, -0.16f, 0.0f, 0.0f, 0.16f, 0.7f};
    for (size_t k = 0; k < sizeof kept_pu / sizeof kept_pu[0]; k++) {
        configure(true, true);
        cfg.Rr_ohm = 0.5f;
        measure_rotor(found_pu[k] * 0.5f, 1.0f);
        ASSERT_NEAR(2e-5, kept_pu[k], st.Rr_extra_pu);
    }
}

/* What the last start found is part of what is known, the heat of the rotor is not: a new start
 * replaces the one and leaves the other. */
static void test_a_new_start_replaces_what_the_last_one_found(void)
{
    cfg.Rr_ohm = 0.5f;
    st.Rr_extra_pu = 0.3f;
    measure_rotor(1.5f * 0.5f, 1.0f + 0.3f + 0.08f);
    ASSERT_NEAR(2e-5, 0.5 - 0.08, st.Rr_extra_pu);
    measure_rotor(1.1f * 0.5f, 1.0f + 0.42f + 0.08f);
    ASSERT_SAME_FLOAT(0.0f, st.Rr_extra_pu);
}

/* The state sum does not look at the sums of the teeth. */
static void test_teeth_that_are_no_number_are_no_rotor(void)
{
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        configure(true, true);
        cfg.Rr_ohm = 0.5f;
        st.Rr_extra_pu = 0.3f;
        for (uint32_t n = 0u; n < 2u * LEVEL_PERIODS; n++) {
            tooth_period(n, 0.8f, 1.3f);
        }
        st.measurement.level[RS_LEVEL_LOW].xu_VA = not_finite(k);
        tooth_period(2u * LEVEL_PERIODS, 0.8f, 1.3f);
        ASSERT_SAME_FLOAT(0.3f, st.Rr_extra_pu);
    }
}

static void test_what_is_no_rotor_is_none(void)
{
    const float found_pu[] = {0.45f, 1.85f, -1.0f};
    for (size_t k = 0; k < sizeof found_pu / sizeof found_pu[0]; k++) {
        configure(true, true);
        cfg.Rr_ohm = 0.5f;
        st.Rr_extra_pu = 0.3f;
        measure_rotor(found_pu[k] * 0.5f, 1.3f);
        ASSERT_SAME_FLOAT(0.3f, st.Rr_extra_pu);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_not_wanted_it_asks_for_nothing);
    RUN_TEST(test_resistance_and_loss_are_kept);
    RUN_TEST(test_threshold_and_tail_are_kept_too);
    RUN_TEST(test_the_loss_is_kept_only_where_it_is_asked_for);
    RUN_TEST(test_a_refusal_is_a_fault_while_it_is_asked_for);
    RUN_TEST(test_what_is_no_number_is_refused);
    RUN_TEST(test_a_rotor_beyond_what_a_start_can_tell_is_kept);
    RUN_TEST(test_a_new_start_replaces_what_the_last_one_found);
    RUN_TEST(test_teeth_that_are_no_number_are_no_rotor);
    RUN_TEST(test_what_is_no_rotor_is_none);
    return UNITY_END();
}
