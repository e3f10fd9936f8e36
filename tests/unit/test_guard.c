/* Each question of the guard: its slot, its conditions, and what it is told. */
#include "guard.h"

#include <math.h>

#include "exact.h"

#define VOLTAGE_TURNS  8
#define PHASES_TURNS   6
#define ESTIMATE_TURNS 60

static guard_config_t cfg;
static guard_state_t st;
static guard_look_t in;
static guard_in_t every_period;
static measured_t meas;
static estimate_t estimate;
static monitor_config_t monitor;
static plausibility_params_t plausibility;
static guard_sensor_params_t sensors;

static void configure(void)
{
    cfg = (guard_config_t){.i_q_max2_A2 = 144.0f, .i_max2_A2 = 225.0f, .kr = 0.9f};
    TEST_ASSERT_TRUE(guard_init(&cfg, &monitor, &plausibility, &sensors));
    st = (guard_state_t){0};
}

/* All well: 4 A along alpha, magnetising 0.4 Wb; every question is put. */
void setUp(void)
{
    monitor = (monitor_config_t){.i_trip_A = 20.0f,
                                 .u_dc_max_V = 700.0f,
                                 .u_dc_min_V = 100.0f,
                                 .omega_max_rad_s = 700.0f,
                                 .plausibility_periods = 50u};
    plausibility = (plausibility_params_t){.u_V = 30.0f,
                                           .open_A = 1.2f,
                                           .e1_A = 0.5f,
                                           .rate_rad_s2 = 1e4f,
                                           .power_W = 150.0f,
                                           .stall_s = 0.032f};
    sensors = (guard_sensor_params_t){.period_s = 2e-4f,
                                      .Rs_ohm = 1.5f,
                                      .sigma_Ls_H = 0.015f,
                                      .flux_Wb = 0.4f,
                                      .M_H = 0.09f,
                                      .A_per_count = 0.003f};
    configure();
    meas = (measured_t){.i_A = {3.266f, -1.633f, -1.633f}, .i_s_A = {4.0f, 0.0f}, .u_dc_V = 540.0f};
    estimate = (estimate_t){.lambda_r_hat_Wb = {0.4f, 0.0f}, .lambda_Wb = 0.4f};
    every_period = (guard_in_t){.meas = &meas};
    in = (guard_look_t){.meas = &meas,
                        .estimate = &estimate,
                        .controlled = true,
                        .sensed = true,
                        .oriented = true,
                        .u_duty_V = {6.0f, 0.0f},
                        .u_s_V = {6.0f, 0.0f},
                        .axis = {1.0f, 0.0f},
                        .i_ref_A = {4.0f, 0.0f},
                        .lambda_ref_Wb = 0.4f,
                        .Rs_ohm = 1.5f};
}

void tearDown(void)
{
}

/* As the drive does: limits in every period, the second look where it is due. */
static uint32_t period(void)
{
    every_period.omega_e_hat_rad_s = estimate.omega_e_rad_s;
    uint32_t faults = guard_step(&cfg, &st, &every_period);
    if (guard_look_is_due(in.slot)) {
        faults |= guard_look(&cfg, &st, &in);
    }
    return faults;
}

/* Turns of all slots; the faults of the last one. *slots gets those in which a bit came. */
static uint32_t turns(int count, uint32_t *slots)
{
    uint32_t faults = 0u;
    for (int n = 0; n < count; n++) {
        faults = 0u;
        *slots = 0u;
        for (in.slot = 0u; in.slot < SLOT_COUNT; in.slot++) {
            const uint32_t now = period();
            faults |= now;
            *slots |= (now != 0u) ? (1u << in.slot) : 0u;
        }
    }
    return faults;
}

/* The bit comes in its slot, after so many turns and not before. */
static void assert_comes(uint32_t bit, uint32_t slot, int after)
{
    uint32_t slots;
    TEST_ASSERT_EQUAL_HEX32(0u, turns(after - 1, &slots));
    TEST_ASSERT_EQUAL_HEX32(bit, turns(1, &slots));
    TEST_ASSERT_EQUAL_HEX32(1u << slot, slots);
}

static void assert_never_comes(void)
{
    uint32_t slots;
    for (int n = 0; n < 2 * ESTIMATE_TURNS; n++) {
        TEST_ASSERT_EQUAL_HEX32(0u, turns(1, &slots));
    }
}

static void test_init_refuses_what_a_part_refuses(void)
{
    monitor.i_trip_A = 0.0f;
    TEST_ASSERT_FALSE(guard_init(&cfg, &monitor, &plausibility, &sensors));
    setUp();
    plausibility.e1_A = NAN;
    TEST_ASSERT_FALSE(guard_init(&cfg, &monitor, &plausibility, &sensors));
    setUp();
    sensors.A_per_count = 0.0f;
    TEST_ASSERT_FALSE(guard_init(&cfg, &monitor, &plausibility, &sensors));
    setUp();
    sensors.flux_Wb = 0.0f;
    TEST_ASSERT_FALSE(guard_init(&cfg, &monitor, &plausibility, &sensors));
    setUp();
    sensors.period_s = 0.0f;
    TEST_ASSERT_FALSE(guard_init(&cfg, &monitor, &plausibility, &sensors));
}

static void test_nothing_is_said_of_a_healthy_drive(void)
{
    assert_never_comes();
    for (int k = 0; k < 100; k++) {
        TEST_ASSERT_EQUAL_HEX32(0u, guard_standing(&cfg, &st, meas.i_s_A, estimate.i_residual_A));
    }
}

/* Limits are judged in every period, whatever the slot and the mode. */
static void test_limits_are_judged_in_every_slot_of_every_mode(void)
{
    for (in.slot = 0u; in.slot < SLOT_COUNT; in.slot++) {
        in.sensed = (in.slot % 2u) == 0u;
        in.oriented = in.sensed;
        meas.i_A.u = 20.1f;
        TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_CURRENT, period());
        meas.i_A.u = 3.266f;
        estimate.omega_e_rad_s = -701.0f;
        TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_SPEED, period() & FAULT_OVER_SPEED);
        estimate.omega_e_rad_s = 0.0f;
        every_period.state_sum = NAN;
        TEST_ASSERT_EQUAL_HEX32(FAULT_NON_FINITE, period());
        every_period.state_sum = 0.0f;
    }
}

static void test_a_voltage_that_the_duties_do_not_explain(void)
{
    in.oriented = false;
    in.u_s_V.beta = 40.0f;
    assert_comes(FAULT_VOLTAGE_SENSOR, SLOT_GUARD_VOLTAGE, VOLTAGE_TURNS);
    setUp();
    in.u_s_V.beta = 40.0f;
    in.sensed = false; /* nothing was sensed */
    in.oriented = false;
    assert_never_comes();
    in.sensed = true;
    in.controlled = false;
    assert_never_comes();
}

/* Twice as much is allowed beside a leg whose loss nobody knows: up to 60 V. */
static void test_a_leg_without_current_allows_more_voltage(void)
{
    in.oriented = false;
    in.i_ref_A = (dq_t){1.0f, 0.0f}; /* too little for an open phase */
    in.u_s_V.beta = 40.0f;
    meas.i_A.v = 0.29f;
    assert_never_comes();
    meas.i_A.v = 0.31f;
    assert_comes(FAULT_VOLTAGE_SENSOR, SLOT_GUARD_VOLTAGE, VOLTAGE_TURNS);
}

/* In whatever mode: of a word that flickered before. Three looks a turn; the first only sees it. */
static void test_one_word_that_stands(void)
{
    in.controlled = false;
    in.oriented = false;
    st.liveness.noise.jumps[0] = 64u;
    assert_comes(FAULT_ADC_FROZEN, SLOT_GUARD_ESTIMATE, 27);
}

/* Phase u carries all of it, as asked; what flows is told by the phases' own sensors. */
static void test_a_phase_without_the_current_that_is_asked_for(void)
{
    meas.i_A.u = 0.29f;
    assert_comes(FAULT_OPEN_PHASE, SLOT_GUARD_PHASES, PHASES_TURNS);
    setUp();
    meas.i_A.u = 0.31f;
    assert_never_comes();
    setUp();
    meas.i_A.u = 0.29f;
    in.controlled = false; /* nobody asks for a current */
    in.oriented = false;
    assert_never_comes();
}

/* The request is one of its frame: along beta nothing is asked of u. */
static void test_the_current_asked_for_is_turned_into_the_phases(void)
{
    meas.i_A.u = 0.0f;
    in.axis = (ab_t){0.0f, 1.0f};
    assert_never_comes();
    in.i_ref_A = (dq_t){0.0f, -4.0f}; /* along alpha again */
    in.oriented = false;              /* or it would be a stall as well */
    assert_comes(FAULT_OPEN_PHASE, SLOT_GUARD_PHASES, PHASES_TURNS);
}

static void test_a_residual_that_no_current_explains(void)
{
    estimate.i_residual_A = (ab_t){0.4f, -0.4f};
    assert_comes(FAULT_OBSERVER, SLOT_GUARD_ESTIMATE, ESTIMATE_TURNS);
    setUp();
    estimate.i_residual_A = (ab_t){0.4f, -0.4f};
    in.oriented = false;
    assert_never_comes();
}

static void test_a_flux_far_below_its_reference(void)
{
    estimate.lambda_Wb = 0.099f;
    assert_comes(FAULT_OBSERVER, SLOT_GUARD_ESTIMATE, ESTIMATE_TURNS);
    setUp();
    estimate.lambda_Wb = 0.099f;
    in.lambda_ref_Wb = 0.39f; /* steered or weakened */
    assert_never_comes();
}

/* 360 V allow 216/600 = .36 Wb. Half of that is enough, whatever is asked for. */
static void test_no_more_flux_is_expected_than_the_voltage_allows(void)
{
    for (int way = -1; way <= 1; way += 2) {
        setUp();
        estimate.omega_e_rad_s = (float)way * 600.0f;
        meas.u_dc_V = 360.0f;
        estimate.lambda_Wb = 0.181f;
        in.lambda_ref_Wb = 0.6f;
        assert_never_comes();
        setUp();
        estimate.omega_e_rad_s = (float)way * 600.0f;
        meas.u_dc_V = 360.0f;
        estimate.lambda_Wb = 0.179f;
        in.lambda_ref_Wb = 0.6f;
        assert_comes(FAULT_OBSERVER, SLOT_GUARD_ESTIMATE, ESTIMATE_TURNS);
    }
}

/* A word of the dc link that is no number is no excuse. */
static void test_a_flux_beside_a_link_that_is_no_number(void)
{
    estimate.omega_e_rad_s = 600.0f;
    estimate.lambda_Wb = 0.179f;
    in.lambda_ref_Wb = 0.36f;
    meas.u_dc_V = NAN;
    uint32_t slots;
    TEST_ASSERT_TRUE((turns(ESTIMATE_TURNS, &slots) & FAULT_OBSERVER) != 0u);
}

/* (u - Rs i) . i against (M/Lr) lambda x i w_s: 1.2 A across .4 Wb at 400 rad/s are 172.8 W. */
static void test_power_that_the_torque_does_not_explain(void)
{
    meas.i_s_A = (ab_t){4.0f, 1.2f};
    in.u_s_V = (ab_t){1.5f * 4.0f, 1.5f * 1.2f}; /* heat alone */
    in.u_duty_V = in.u_s_V;
    estimate.omega_s_rad_s = 400.0f;
    assert_comes(FAULT_OBSERVER, SLOT_GUARD_ESTIMATE, ESTIMATE_TURNS);
    in.u_s_V.beta += 172.8f / 1.2f; /* and there it is */
    in.u_duty_V = in.u_s_V;
    st = (guard_state_t){0};
    assert_never_comes();
    in.u_s_V.beta -= 172.8f / 1.2f;
    in.u_duty_V = in.u_s_V;
    in.Rs_ohm = 1.5f - 172.8f / (16.0f + 1.44f); /* or as heat that is none */
    assert_never_comes();
}

/* A speed that jumps from turn to turn; one jump is forgotten. */
static void test_a_speed_that_no_shaft_follows(void)
{
    uint32_t slots;
    uint32_t faults = 0u;
    for (int n = 1; n <= ESTIMATE_TURNS; n++) {
        TEST_ASSERT_EQUAL_HEX32(0u, faults);
        estimate.omega_e_rad_s = (n % 2 == 0) ? 20.0f : -20.0f; /* 32 rad/s per turn allowed */
        faults = turns(1, &slots);
        if (n == 1) {
            TEST_ASSERT_EQUAL_UINT32(0u, st.plausibility.estimate);
        }
    }
    TEST_ASSERT_EQUAL_HEX32(0u, faults); /* the first was within */
    estimate.omega_e_rad_s = -estimate.omega_e_rad_s;
    TEST_ASSERT_EQUAL_HEX32(FAULT_OBSERVER, turns(1, &slots));
}

/* .95 of the limit, a speed wanted, none there. The limit is i_q's own, or what i_d leaves. */
static void test_all_torque_without_speed(void)
{
    plausibility.open_A = 0.0f;
    configure();
    in.omega_ref_rad_s = -100.0f;
    in.i_ref_A = (dq_t){4.0f, -11.4f}; /* of 12 */
    assert_comes(FAULT_STALL, SLOT_GUARD_ESTIMATE, 10);
    const dq_t within_A[] = {{4.0f, 11.3f}, {12.0f, 8.4f}};
    for (int n = 0; n < 2; n++) {
        st = (guard_state_t){0};
        in.i_ref_A = within_A[n];
        assert_never_comes();
    }
    in.i_ref_A = (dq_t){12.0f, 8.6f}; /* of 9 */
    assert_comes(FAULT_STALL, SLOT_GUARD_ESTIMATE, 10);
    st = (guard_state_t){0};
    in.omega_ref_rad_s = 0.0f;
    assert_never_comes();
    in.omega_ref_rad_s = 100.0f;
    estimate.omega_e_rad_s = 20.0f;
    assert_never_comes();
    estimate.omega_e_rad_s = 0.0f;
    in.oriented = false;
    assert_never_comes();
}

/* v and w exchanged: the conjugate of the estimate, longer than the trip. */
static void test_exchanged_sensors_are_told_in_every_period_while_it_stands(void)
{
    ab_t residual_A = {0.0f, 39.0f};
    for (int k = 1; k <= 6; k++) {
        TEST_ASSERT_EQUAL_HEX32((k < 5) ? 0u : FAULT_CURRENT_SENSOR,
                                guard_standing(&cfg, &st, (ab_t){8.0f, -19.5f}, residual_A));
    }
    residual_A.beta = 36.0f; /* 19.7 A: below the trip */
    TEST_ASSERT_EQUAL_HEX32(0u, guard_standing(&cfg, &st, (ab_t){8.0f, -18.0f}, residual_A));
    /* Nobody else asks. */
    in.oriented = false;
    meas.i_s_A = (ab_t){8.0f, -19.5f};
    estimate.i_residual_A = (ab_t){0.0f, 39.0f};
    assert_never_comes();
}

/* In each something is counted, and in no other is it due. */
static void test_only_its_slots_are_due(void)
{
    in.u_s_V.beta = 80.0f; /* beyond the 60 V beside a leg without current */
    meas.i_A.u = 0.0f;
    estimate.lambda_Wb = 0.0f;
    const guard_state_t before = st;
    for (in.slot = 0u; in.slot < SLOT_COUNT; in.slot++) {
        const bool due = (in.slot == 3u) || (in.slot == 7u) || (in.slot == 11u);
        TEST_ASSERT_EQUAL(due, guard_look_is_due(in.slot));
        if (!due) {
            continue;
        }
        st = before;
        TEST_ASSERT_EQUAL_HEX32(0u, guard_look(&cfg, &st, &in));
        TEST_ASSERT_EQUAL(in.slot == SLOT_GUARD_VOLTAGE, st.plausibility.voltage > 0u);
        TEST_ASSERT_EQUAL(in.slot == SLOT_GUARD_PHASES, st.plausibility.phase[0] > 0u);
        TEST_ASSERT_EQUAL(in.slot == SLOT_GUARD_ESTIMATE, st.plausibility.estimate > 0u);
    }
}

static void test_at_rest_the_limits_go_on_counting(void)
{
    meas.flags = MEASUREMENT_CURRENT_SUM;
    meas.i_A.u = 0.0f;
    in.u_s_V.beta = 80.0f;
    uint32_t slots;
    (void)turns(1, &slots);
    TEST_ASSERT_TRUE(st.plausibility.voltage > 0u);
    guard_look_at_noise(&cfg, &st, &meas);
    const guard_kept_t kept = guard_kept(&st);
    guard_state_t rested = {0};
    guard_restore(&rested, &kept);
    TEST_ASSERT_EQUAL_MEMORY(&meas.i_A, rested.liveness.noise.i_A, sizeof meas.i_A);
    const plausibility_state_t none = {0};
    TEST_ASSERT_EQUAL_MEMORY(&st.monitor, &rested.monitor, sizeof rested.monitor);
    TEST_ASSERT_TRUE(rested.monitor.sum_periods > 0u);
    TEST_ASSERT_EQUAL_MEMORY(&none, &rested.plausibility, sizeof none);
}

/* Turns of the sensors' judgement: 4 A along alpha and this voltage. */
static uint32_t sensor_turns(int count, ab_t u_V, bool frozen)
{
    guard_sensors_t sample = {.meas = &meas, .u_V = u_V, .motor_known = true};
    uint32_t faults = 0u;
    for (int k = 0; k < count * (int)SLOT_COUNT; k++) {
        sample.window_ended = ((uint32_t)k % SLOT_COUNT) == SLOT_GUARD_CURRENT;
        meas.i_A.u += (!frozen && ((k % 2) == 0)) ? 0.01f : 0.0f;
        faults |= guard_sensors(&cfg, &st, &sample);
    }
    return faults;
}

static void test_sensors_are_judged_whatever_the_mode(void)
{
    st.current_fit.i_A = meas.i_s_A;
    TEST_ASSERT_EQUAL_HEX32(0u, sensor_turns(100, (ab_t){6.0f, 0.0f}, false));
    TEST_ASSERT_EQUAL_HEX32(0u, sensor_turns(100, (ab_t){6.0f, 0.0f}, true));
    TEST_ASSERT_EQUAL_HEX32(FAULT_ADC_FROZEN, sensor_turns(1, (ab_t){200.0f, 0.0f}, true));
}

/* 100 V too much for 4 A. */
static void test_a_voltage_that_the_currents_do_not_explain(void)
{
    st.current_fit.i_A = meas.i_s_A;
    TEST_ASSERT_EQUAL_HEX32(FAULT_CURRENT_SENSOR, sensor_turns(20, (ab_t){106.0f, 0.0f}, false));
}

/* Half of 4 A from one sample to the next: a jump is .08 of 24 A. */
static void test_current_words_that_jump(void)
{
    const uint32_t sum[] = {0u, MEASUREMENT_CURRENT_SUM, 0u};
    for (int k = 0; k < 3; k++) {
        setUp();
        monitor.i_trip_A = 24.0f;
        configure();
        st.current_fit.i_A = meas.i_s_A;
        TEST_ASSERT_EQUAL_HEX32(0u, sensor_turns(1, (ab_t){6.0f, 0.0f}, false));
        meas.i_s_A.alpha = 2.0f;
        meas.flags = sum[k];
        guard_sensors_t sample = {.meas = &meas, .u_V = {6.0f, 0.0f}, .motor_known = k < 2};
        TEST_ASSERT_EQUAL_HEX32(0u, guard_sensors(&cfg, &st, &sample));
        meas.i_A.u += 0.01f;
        TEST_ASSERT_EQUAL_HEX32((k == 0) ? FAULT_CURRENT_SENSOR : 0u,
                                guard_sensors(&cfg, &st, &sample));
    }
}

/* 540 V are the peak of 382 V; of 200 V they are too much, where 24 W are taken from the link. */
static void test_a_link_that_does_not_fit_its_mains(void)
{
    plausibility.mains_V = 382.0f;
    configure();
    in.slot = SLOT_GUARD_VOLTAGE;
    for (int k = 0; k < 2000; k++) {
        TEST_ASSERT_EQUAL_HEX32(0u, guard_look(&cfg, &st, &in));
    }
    plausibility.mains_V = 200.0f;
    configure();
    in.controlled = false;
    for (int k = 0; k < 1250; k++) {
        TEST_ASSERT_EQUAL_HEX32(0u, guard_look(&cfg, &st, &in));
    }
    TEST_ASSERT_EQUAL_HEX32(FAULT_VOLTAGE_SENSOR, guard_look(&cfg, &st, &in));
    in.u_duty_V.alpha = -6.0f;
    TEST_ASSERT_EQUAL_HEX32(0u, guard_look(&cfg, &st, &in));
    plausibility.mains_V = -1.0f;
    TEST_ASSERT_FALSE(guard_init(&cfg, &monitor, &plausibility, &sensors));
}

/* 24 W come back: with a brake resistor from 200 V on and a trip of 20 A, 20 W count. */
static void test_a_link_that_stays_as_it_is_while_the_motor_brakes(void)
{
    in.slot = SLOT_GUARD_VOLTAGE;
    in.controlled = false;
    in.u_duty_V.alpha = -6.0f;
    for (int k = 0; k < 100; k++) {
        TEST_ASSERT_EQUAL_HEX32(0u, guard_look(&cfg, &st, &in));
    }
    plausibility.chopper_on_V = 200.0f;
    configure();
    for (int k = 0; k < 16; k++) {
        TEST_ASSERT_EQUAL_HEX32(0u, guard_look(&cfg, &st, &in));
    }
    TEST_ASSERT_EQUAL_HEX32(FAULT_VOLTAGE_SENSOR, guard_look(&cfg, &st, &in));
    in.brake_on = true;
    TEST_ASSERT_EQUAL_HEX32(0u, guard_look(&cfg, &st, &in));
}

static void test_a_link_that_drops_is_told_in_each_slot(void)
{
    static const uint32_t slots[] = {SLOT_GUARD_VOLTAGE, SLOT_GUARD_PHASES, SLOT_GUARD_ESTIMATE};
    for (size_t k = 0; k < 3u; k++) {
        st = (guard_state_t){0};
        meas.u_dc_V = 300.0f;
        in.slot = slots[k];
        TEST_ASSERT_EQUAL_HEX32(0u, guard_look(&cfg, &st, &in));
        meas.u_dc_V = 150.0f;
        TEST_ASSERT_EQUAL_HEX32(0u, guard_look(&cfg, &st, &in));
        in.slot = slots[(k + 1u) % 3u];
        TEST_ASSERT_EQUAL_HEX32(FAULT_VOLTAGE_SENSOR, guard_look(&cfg, &st, &in));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_what_a_part_refuses);
    RUN_TEST(test_nothing_is_said_of_a_healthy_drive);
    RUN_TEST(test_limits_are_judged_in_every_slot_of_every_mode);
    RUN_TEST(test_a_voltage_that_the_duties_do_not_explain);
    RUN_TEST(test_a_leg_without_current_allows_more_voltage);
    RUN_TEST(test_one_word_that_stands);
    RUN_TEST(test_a_phase_without_the_current_that_is_asked_for);
    RUN_TEST(test_the_current_asked_for_is_turned_into_the_phases);
    RUN_TEST(test_a_residual_that_no_current_explains);
    RUN_TEST(test_a_flux_far_below_its_reference);
    RUN_TEST(test_no_more_flux_is_expected_than_the_voltage_allows);
    RUN_TEST(test_a_flux_beside_a_link_that_is_no_number);
    RUN_TEST(test_power_that_the_torque_does_not_explain);
    RUN_TEST(test_a_speed_that_no_shaft_follows);
    RUN_TEST(test_all_torque_without_speed);
    RUN_TEST(test_exchanged_sensors_are_told_in_every_period_while_it_stands);
    RUN_TEST(test_only_its_slots_are_due);
    RUN_TEST(test_at_rest_the_limits_go_on_counting);
    RUN_TEST(test_sensors_are_judged_whatever_the_mode);
    RUN_TEST(test_a_voltage_that_the_currents_do_not_explain);
    RUN_TEST(test_current_words_that_jump);
    RUN_TEST(test_a_link_that_does_not_fit_its_mains);
    RUN_TEST(test_a_link_that_stays_as_it_is_while_the_motor_brakes);
    RUN_TEST(test_a_link_that_drops_is_told_in_each_slot);
    return UNITY_END();
}
