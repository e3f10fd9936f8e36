/* Who may open the gates: every state with every event, and the path from start to RUN. */
#include "drive_state.h"

#include <math.h>

#include "unity.h"

#define RUN   DRIVE_STATE_CMD_RUN
#define RESET DRIVE_STATE_CMD_FAULT_RESET
#define OFF   DRIVE_STATE_CMD_TORQUE_OFF

static drive_state_config_t cfg;
static drive_machine_t st;

static drive_state_out_t step(uint32_t command, uint32_t faults)
{
    const drive_state_in_t in = {
        .command = command, .faults = faults, .i_raw_A = {0.1f, -0.2f, 0.3f}};
    return drive_state_step(&cfg, &st, &in);
}

void setUp(void)
{
    st = (drive_machine_t){0};
    cfg = (drive_state_config_t){
        .offset_periods = 3u, .premagnetise_periods = 2u, .offset_max_A = 0.5f};
}

void tearDown(void)
{
}

static void go_ready(void)
{
    for (int k = 0; k < 10; k++) {
        (void)step(0u, 0u);
    }
    TEST_ASSERT_EQUAL(DRIVE_STATE_READY, st.id);
}

static void go_run(void)
{
    go_ready();
    for (int k = 0; k < 10; k++) {
        (void)step(RUN, 0u);
    }
    TEST_ASSERT_EQUAL(DRIVE_STATE_RUN, st.id);
}

static void test_start_averages_offsets_and_waits_for_the_run_command(void)
{
    (void)step(0u, 0u);
    TEST_ASSERT_EQUAL(DRIVE_STATE_SELF_TEST, st.id);
    for (int k = 0; k < 3; k++) {
        TEST_ASSERT_FALSE(step(0u, 0u).offsets_ready);
        TEST_ASSERT_EQUAL(DRIVE_STATE_SELF_TEST, st.id);
    }
    const drive_state_out_t out = step(0u, 0u);
    TEST_ASSERT_TRUE(out.offsets_ready);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 0.1f, st.offset_A.u);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, -0.2f, st.offset_A.v);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 0.3f, st.offset_A.w);
    TEST_ASSERT_EQUAL(DRIVE_STATE_READY, st.id);
    TEST_ASSERT_FALSE(out.gates_on);
    TEST_ASSERT_FALSE(step(0u, 0u).offsets_ready); /* once */
}

static void test_no_averaging_leaves_the_offsets_alone(void)
{
    cfg.offset_periods = 0u;
    (void)step(0u, 0u);
    const drive_state_out_t out = step(0u, 0u);
    TEST_ASSERT_FALSE(out.offsets_ready);
    TEST_ASSERT_EQUAL(DRIVE_STATE_READY, st.id);
}

static void test_an_impossible_offset_is_a_fault(void)
{
    const uvw_t bad[4] = {
        {0.6f, 0.0f, 0.0f}, {0.0f, -0.6f, 0.0f}, {0.0f, 0.0f, 0.6f}, {NAN, 0.0f, 0.0f}};
    for (int n = 0; n < 4; n++) {
        setUp();
        for (int k = 0; k < 6; k++) {
            const drive_state_in_t in = {.i_raw_A = bad[n]};
            TEST_ASSERT_FALSE(drive_state_step(&cfg, &st, &in).offsets_ready);
        }
        TEST_ASSERT_EQUAL(DRIVE_STATE_FAULT, st.id);
        TEST_ASSERT_EQUAL_UINT32(MONITOR_CURRENT_OFFSET, st.faults);
    }
}

static void test_run_builds_flux_first(void)
{
    go_ready();
    drive_state_out_t out = step(RUN, 0u);
    TEST_ASSERT_EQUAL(DRIVE_STATE_PREMAGNETISE, st.id);
    TEST_ASSERT_EQUAL(DRIVE_PREMAGNETISE, out.mode);
    TEST_ASSERT_TRUE(out.gates_on);
    (void)step(RUN, 0u);
    (void)step(RUN, 0u);
    TEST_ASSERT_EQUAL(DRIVE_STATE_PREMAGNETISE, st.id);
    out = step(RUN, 0u);
    TEST_ASSERT_EQUAL(DRIVE_STATE_RUN, st.id);
    TEST_ASSERT_EQUAL(DRIVE_RUN, out.mode);
    TEST_ASSERT_TRUE(out.gates_on);
}

static void test_releasing_run_closes_the_gates_in_both_states(void)
{
    go_ready();
    (void)step(RUN, 0u);
    TEST_ASSERT_FALSE(step(0u, 0u).gates_on);
    TEST_ASSERT_EQUAL(DRIVE_STATE_READY, st.id);
    setUp();
    go_run();
    TEST_ASSERT_FALSE(step(0u, 0u).gates_on);
    TEST_ASSERT_EQUAL(DRIVE_STATE_READY, st.id);
}

/* run is a level: held from the first period on, the drive starts once its self-test is done. */
static void test_a_run_command_standing_at_start_runs_after_the_self_test(void)
{
    for (int k = 0; k < 5; k++) {
        TEST_ASSERT_FALSE(step(RUN, 0u).gates_on);
    }
    TEST_ASSERT_EQUAL(DRIVE_STATE_READY, st.id);
    TEST_ASSERT_TRUE(step(RUN, 0u).gates_on);
}

static void test_a_fault_closes_the_gates_in_the_same_period_and_latches(void)
{
    go_run();
    TEST_ASSERT_FALSE(step(RUN, MONITOR_OVER_CURRENT).gates_on);
    TEST_ASSERT_EQUAL(DRIVE_STATE_FAULT, st.id);
    (void)step(RUN, MONITOR_DC_OVER_VOLTAGE);
    TEST_ASSERT_EQUAL_UINT32(MONITOR_OVER_CURRENT | MONITOR_DC_OVER_VOLTAGE, st.faults);
    for (int k = 0; k < 20; k++) {
        TEST_ASSERT_FALSE(step(RUN, 0u).gates_on);
    }
    TEST_ASSERT_EQUAL(DRIVE_STATE_FAULT, st.id);
}

static void test_a_warning_is_latched_and_leaves_the_gates_on_until_it_is_reset(void)
{
    go_run();
    TEST_ASSERT_TRUE(step(RUN, MONITOR_PERIOD_LATE).gates_on);
    TEST_ASSERT_TRUE(step(RUN, 0u).gates_on);
    TEST_ASSERT_EQUAL_UINT32(MONITOR_PERIOD_LATE, st.faults);
    TEST_ASSERT_TRUE(step(RUN | RESET, 0u).gates_on);
    TEST_ASSERT_EQUAL_UINT32(0u, st.faults);
    TEST_ASSERT_EQUAL(DRIVE_STATE_RUN, st.id);
}

static void test_a_warning_stands_beside_the_fault_that_follows(void)
{
    go_run();
    (void)step(RUN, MONITOR_PERIOD_LATE);
    TEST_ASSERT_FALSE(step(RUN, MONITOR_PERIOD_LATE | MONITOR_PERIOD_OVERRUN).gates_on);
    TEST_ASSERT_EQUAL(DRIVE_STATE_FAULT, st.id);
    TEST_ASSERT_EQUAL_UINT32(MONITOR_PERIOD_LATE | MONITOR_PERIOD_OVERRUN, st.faults);
}

static void test_reset_needs_an_edge_and_the_cause_gone(void)
{
    go_run();
    (void)step(RESET, MONITOR_OVER_CURRENT); /* the edge comes with the fault still there */
    (void)step(RESET, 0u);                   /* level only */
    TEST_ASSERT_EQUAL(DRIVE_STATE_FAULT, st.id);
    (void)step(0u, 0u);
    (void)step(RESET, MONITOR_OVER_CURRENT);
    TEST_ASSERT_EQUAL(DRIVE_STATE_FAULT, st.id);
    (void)step(0u, 0u);
    (void)step(RESET, 0u);
    TEST_ASSERT_EQUAL(DRIVE_STATE_SELF_TEST, st.id);
    TEST_ASSERT_EQUAL_UINT32(0u, st.faults);
    /* The offsets are averaged anew, not added to the old sum. */
    drive_state_out_t out = {0};
    for (int k = 0; k < 4; k++) {
        out = step(0u, 0u);
    }
    TEST_ASSERT_TRUE(out.offsets_ready);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 0.1f, st.offset_A.u);
}

static void test_a_refused_configuration_cannot_be_reset(void)
{
    go_ready();
    (void)step(0u, MONITOR_CONFIG);
    (void)step(RESET, 0u);
    TEST_ASSERT_EQUAL(DRIVE_STATE_FAULT, st.id);
}

static void test_torque_off_wins_over_run_and_needs_run_again(void)
{
    go_run();
    TEST_ASSERT_FALSE(step(RUN | OFF, 0u).gates_on);
    TEST_ASSERT_EQUAL(DRIVE_STATE_TORQUE_OFF, st.id);
    (void)step(RUN, 0u);
    for (int k = 0; k < 5; k++) {
        TEST_ASSERT_FALSE(step(RUN, 0u).gates_on);
    }
    TEST_ASSERT_EQUAL(DRIVE_STATE_READY, st.id);
    (void)step(0u, 0u);
    TEST_ASSERT_TRUE(step(RUN, 0u).gates_on);
}

static void test_torque_off_does_not_skip_the_self_test(void)
{
    (void)step(OFF, 0u);
    TEST_ASSERT_EQUAL(DRIVE_STATE_SELF_TEST, st.id);
    (void)step(OFF, 0u);
    TEST_ASSERT_EQUAL(DRIVE_STATE_SELF_TEST, st.id);
    for (int k = 0; k < 6; k++) {
        (void)step(OFF, 0u);
    }
    TEST_ASSERT_EQUAL(DRIVE_STATE_TORQUE_OFF, st.id);
}

static void test_a_steady_run_changes_nothing(void)
{
    go_run();
    const drive_machine_t before = st;
    const drive_state_out_t out = step(RUN, 0u);
    TEST_ASSERT_EQUAL(DRIVE_RUN, out.mode);
    TEST_ASSERT_TRUE(out.gates_on);
    TEST_ASSERT_FALSE(out.offsets_ready);
    TEST_ASSERT_EQUAL_MEMORY(&before, &st, sizeof st);
}

/* A state no transition leads to: the short way through a steady run must not keep it alive. */
static void test_a_blocked_run_ends(void)
{
    go_run();
    st.run_blocked = true;
    TEST_ASSERT_FALSE(step(RUN, 0u).gates_on);
    TEST_ASSERT_EQUAL(DRIVE_STATE_READY, st.id);
}

/* Closure: from every number a state can hold, no event but run in READY turns the gates on. */
static void test_only_ready_with_run_turns_the_gates_on(void)
{
    for (uint32_t id = 0u; id < 16u; id++) {
        for (uint32_t command = 0u; command < 8u; command++) {
            for (uint32_t faults = 0u; faults < 2u; faults++) {
                for (int armed = 0; armed < 2; armed++) {
                    st = (drive_machine_t){.id = (drive_state_id_t)id, .run_blocked = armed == 0};
                    const bool was_on = (id == 3u) || (id == 4u);
                    const drive_state_out_t out = step(command, faults);
                    const bool may = (id == 2u) && (armed != 0) &&
                                     ((command & (RUN | OFF)) == RUN) && (faults == 0u);
                    if (!was_on) {
                        TEST_ASSERT_EQUAL(may, out.gates_on);
                    }
                    if (((command & OFF) != 0u) || (faults != 0u)) {
                        TEST_ASSERT_FALSE(out.gates_on);
                    }
                    TEST_ASSERT_EQUAL(out.gates_on, out.mode != DRIVE_OFF);
                    if (((id >= 5u) && (id != 8u) && (id != 9u)) && ((command & OFF) == 0u)) {
                        TEST_ASSERT_EQUAL(DRIVE_STATE_FAULT, st.id);
                    }
                }
            }
        }
    }
}

static const drive_state_params_t good = {.offset_s = 0.1f,
                                          .premagnetise_s = 1.0f,
                                          .offset_max_A = 0.5f,
                                          .offset_max_V = 8.0f,
                                          .period_s = 200e-6f};

#define ASSERT_REFUSED(field, value)                                                               \
    do {                                                                                           \
        drive_state_params_t bad = good;                                                           \
        bad.field = (value);                                                                       \
        TEST_ASSERT_FALSE_MESSAGE(drive_state_init(&c, &bad), #field " " #value);                  \
    } while (0)

static void test_init_counts_periods_and_refuses_senseless_times(void)
{
    drive_state_config_t c;
    TEST_ASSERT_TRUE(drive_state_init(&c, &good));
    TEST_ASSERT_EQUAL_UINT32(500u, c.offset_periods);
    TEST_ASSERT_EQUAL_UINT32(5000u, c.premagnetise_periods);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, c.offset_max_A);
    TEST_ASSERT_EQUAL_FLOAT(8.0f, c.offset_max_V);
    ASSERT_REFUSED(offset_s, -0.1f);
    ASSERT_REFUSED(premagnetise_s, NAN);
    ASSERT_REFUSED(premagnetise_s, 1e9f);
    ASSERT_REFUSED(offset_max_A, 0.0f);
    ASSERT_REFUSED(offset_max_V, NAN);
    ASSERT_REFUSED(period_s, 0.0f);
}

static void test_voltage_offsets_are_averaged_too(void)
{
    cfg.offset_max_V = 4.0f;
    for (int k = 0; k < 5; k++) {
        const drive_state_in_t in = {.u_raw_V = {(float)k, -2.0f}};
        (void)drive_state_step(&cfg, &st, &in);
    }
    /* Periods 1, 2, 3 are averaged; 0 leaves BOOT. */
    TEST_ASSERT_EQUAL(DRIVE_STATE_READY, st.id);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 2.0f, st.offset_V.alpha);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, -2.0f, st.offset_V.beta);
}

static void test_the_voltage_of_a_turning_motor_is_no_offset(void)
{
    const ab_t turning[3] = {{5.0f, 0.0f}, {0.0f, -5.0f}, {NAN, 0.0f}};
    cfg.offset_max_V = 4.0f;
    for (int n = 0; n < 3; n++) {
        st = (drive_machine_t){0};
        for (int k = 0; k < 5; k++) {
            const drive_state_in_t in = {.u_raw_V = turning[n]};
            (void)drive_state_step(&cfg, &st, &in);
        }
        TEST_ASSERT_EQUAL(DRIVE_STATE_READY, st.id);
        TEST_ASSERT_EQUAL_FLOAT(0.0f, st.offset_V.alpha);
        TEST_ASSERT_EQUAL_FLOAT(0.0f, st.offset_V.beta);
    }
}

static void test_flux_is_built_after_the_measurement_only(void)
{
    go_ready();
    (void)step(RUN, 0u);
    for (int k = 0; k < 20; k++) {
        const drive_state_in_t in = {.command = RUN, .premagnetising = true};
        (void)drive_state_step(&cfg, &st, &in);
        TEST_ASSERT_EQUAL(DRIVE_STATE_PREMAGNETISE, st.id);
    }
    (void)step(RUN, 0u);
    (void)step(RUN, 0u);
    TEST_ASSERT_EQUAL(DRIVE_STATE_PREMAGNETISE, st.id);
    (void)step(RUN, 0u);
    TEST_ASSERT_EQUAL(DRIVE_STATE_RUN, st.id);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_start_averages_offsets_and_waits_for_the_run_command);
    RUN_TEST(test_no_averaging_leaves_the_offsets_alone);
    RUN_TEST(test_an_impossible_offset_is_a_fault);
    RUN_TEST(test_run_builds_flux_first);
    RUN_TEST(test_releasing_run_closes_the_gates_in_both_states);
    RUN_TEST(test_a_run_command_standing_at_start_runs_after_the_self_test);
    RUN_TEST(test_a_fault_closes_the_gates_in_the_same_period_and_latches);
    RUN_TEST(test_a_warning_is_latched_and_leaves_the_gates_on_until_it_is_reset);
    RUN_TEST(test_a_warning_stands_beside_the_fault_that_follows);
    RUN_TEST(test_reset_needs_an_edge_and_the_cause_gone);
    RUN_TEST(test_a_refused_configuration_cannot_be_reset);
    RUN_TEST(test_torque_off_wins_over_run_and_needs_run_again);
    RUN_TEST(test_torque_off_does_not_skip_the_self_test);
    RUN_TEST(test_a_steady_run_changes_nothing);
    RUN_TEST(test_a_blocked_run_ends);
    RUN_TEST(test_only_ready_with_run_turns_the_gates_on);
    RUN_TEST(test_init_counts_periods_and_refuses_senseless_times);
    RUN_TEST(test_voltage_offsets_are_averaged_too);
    RUN_TEST(test_the_voltage_of_a_turning_motor_is_no_offset);
    RUN_TEST(test_flux_is_built_after_the_measurement_only);
    return UNITY_END();
}
