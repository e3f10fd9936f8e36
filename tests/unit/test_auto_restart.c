/* The substitute operator alone, then before the real state machine. */
#include "auto_restart.h"

#include <math.h>

#include "exact.h"
#include "unity.h"

#define RUN   SEQUENCE_CMD_RUN
#define RESET SEQUENCE_CMD_FAULT_RESET

static const params_t good = {.restart_count = 2u, .restart_delay_s = 0.001f, .period_s = 0.0002f};

static auto_restart_config_t cfg;
static auto_restart_state_t st;

void setUp(void)
{
    TEST_ASSERT_TRUE(auto_restart_init(&cfg, &good));
    TEST_ASSERT_EQUAL_UINT32(300000u, cfg.forgive_periods); /* a minute */
    cfg.forgive_periods = 10u;
    st = (auto_restart_state_t){.ran = true};
}

void tearDown(void)
{
}

static uint32_t step(sequence_id_t id, uint32_t latched, uint32_t faults)
{
    const auto_restart_in_t in = {RUN, id, latched, faults, true};
    return auto_restart_step(&cfg, &st, &in);
}

static int periods_to_reset(void)
{
    for (int k = 1; k < 100; k++) {
        if (step(SEQUENCE_FAULT, FAULT_DC_UNDER_VOLTAGE, 0u) == RESET) {
            return k;
        }
    }
    return 0;
}

static void test_init_refuses_bad_times(void)
{
    params_t p = good;
    p.restart_delay_s = -1.0f;
    TEST_ASSERT_FALSE(auto_restart_init(&cfg, &p));
    p.restart_delay_s = 1e9f;
    TEST_ASSERT_FALSE(auto_restart_init(&cfg, &p));
    p.restart_delay_s = 2.1e5f; /* 1.05e9 periods */
    TEST_ASSERT_FALSE(auto_restart_init(&cfg, &p));
    p.period_s = 1.0f;
    p.restart_delay_s = 1e9f; /* the first that is too long */
    TEST_ASSERT_FALSE(auto_restart_init(&cfg, &p));
    p.restart_delay_s = NAN;
    TEST_ASSERT_FALSE(auto_restart_init(&cfg, &p));
    p = good;
    p.period_s = 0.0f;
    TEST_ASSERT_FALSE(auto_restart_init(&cfg, &p));
    p.period_s = 50e-9f; /* a minute of running is too long to count */
    TEST_ASSERT_FALSE(auto_restart_init(&cfg, &p));
    p = good;
    p.restart_count = 0u;
    cfg.count = 3u; /* of a configuration before */
    TEST_ASSERT_TRUE(auto_restart_init(&cfg, &p));
    TEST_ASSERT_FALSE(auto_restart_on(&cfg));
}

static void test_off_passes_every_command(void)
{
    cfg = (auto_restart_config_t){0};
    TEST_ASSERT_FALSE(auto_restart_on(&cfg));
    for (uint32_t command = 0u; command < 8u; command++) {
        const auto_restart_in_t in = {command, SEQUENCE_FAULT, FAULT_DC_UNDER_VOLTAGE, 0u, true};
        TEST_ASSERT_EQUAL_HEX32(command, auto_restart_step(&cfg, &st, &in));
    }
}

static void test_resets_once_the_cause_has_been_gone_for_the_delay(void)
{
    TEST_ASSERT_EQUAL_HEX32(RUN, step(SEQUENCE_FAULT, FAULT_DC_UNDER_VOLTAGE, 0u));
    TEST_ASSERT_EQUAL_HEX32(RUN, step(SEQUENCE_FAULT, FAULT_DC_UNDER_VOLTAGE,
                                      FAULT_DC_UNDER_VOLTAGE)); /* back: counted anew */
    TEST_ASSERT_EQUAL(6, periods_to_reset());
    TEST_ASSERT_EQUAL_UINT32(1u, st.used);
}

/* A shaft caught in turning goes to RUN past premagnetisation: that is a run as well. */
static void test_a_run_alone_is_enough_to_begin_anew(void)
{
    st = (auto_restart_state_t){0};
    TEST_ASSERT_EQUAL_INT(0, periods_to_reset());
    st = (auto_restart_state_t){0};
    TEST_ASSERT_EQUAL_HEX32(RUN, step(SEQUENCE_RUN, 0u, 0u));
    TEST_ASSERT_EQUAL_INT(6, periods_to_reset());
}

static void test_only_for_a_dip(void)
{
    const uint32_t others[] = {FAULT_OVER_CURRENT, FAULT_DC_UNDER_VOLTAGE | FAULT_CONFIG};
    for (int n = 0; n < 2; n++) {
        for (int k = 0; k < 100; k++) {
            TEST_ASSERT_EQUAL_HEX32(RUN, step(SEQUENCE_FAULT, others[n], 0u));
        }
    }
    for (int k = 0; k < 5; k++) {
        (void)step(SEQUENCE_FAULT, FAULT_MAINS_LOST | FAULT_PERIOD_LATE, 0u);
    }
    TEST_ASSERT_EQUAL_HEX32(RESET, step(SEQUENCE_FAULT, FAULT_MAINS_LOST | FAULT_PERIOD_LATE, 0u));
}

static void test_a_limited_number_of_times_unless_it_has_run_since(void)
{
    TEST_ASSERT_EQUAL(6, periods_to_reset());
    TEST_ASSERT_EQUAL(6, periods_to_reset());
    TEST_ASSERT_EQUAL(0, periods_to_reset());
    for (int k = 0; k < 11; k++) {
        TEST_ASSERT_EQUAL_HEX32(RUN, step(SEQUENCE_RUN, 0u, 0u));
    }
    TEST_ASSERT_EQUAL(6, periods_to_reset());
    /* As long as it takes is not longer. */
    for (int k = 0; k < 10; k++) {
        (void)step(SEQUENCE_RUN, 0u, 0u);
    }
    TEST_ASSERT_EQUAL_UINT32(1u, st.used);
    (void)step(SEQUENCE_PREMAGNETISE, 0u, 0u);
    /* Not long enough, and interrupted. */
    for (int k = 0; k < 8; k++) {
        (void)step(SEQUENCE_RUN, 0u, 0u);
    }
    (void)step(SEQUENCE_PREMAGNETISE, 0u, 0u);
    for (int k = 0; k < 8; k++) {
        (void)step(SEQUENCE_RUN, 0u, 0u);
    }
    TEST_ASSERT_EQUAL_UINT32(1u, st.used);
    /* The last one that was used is forgiven too. */
    (void)step(SEQUENCE_PREMAGNETISE, 0u, 0u);
    for (int k = 0; k < 11; k++) {
        (void)step(SEQUENCE_RUN, 0u, 0u);
    }
    TEST_ASSERT_EQUAL_UINT32(0u, st.used);
}

static void test_the_operator_wins(void)
{
    (void)periods_to_reset();
    const uint32_t commands[] = {0u, RUN | RESET, RUN | SEQUENCE_CMD_TORQUE_OFF};
    for (int n = 0; n < 3; n++) {
        st.used = 1u;
        const auto_restart_in_t in = {commands[n], SEQUENCE_FAULT, FAULT_DC_UNDER_VOLTAGE, 0u,
                                      true};
        TEST_ASSERT_EQUAL_HEX32(commands[n], auto_restart_step(&cfg, &st, &in));
        TEST_ASSERT_EQUAL_UINT32(0u, st.used);
    }
}

/* A dip in RUN, the dc link back: the machine is in RUN again without the operator. */
static void test_torque_mode_is_restarted_too(void)
{
    const uint32_t torque = RUN | SEQUENCE_CMD_TORQUE_MODE;
    const auto_restart_in_t in = {torque, SEQUENCE_FAULT, FAULT_DC_UNDER_VOLTAGE, 0u, true};
    for (int k = 0; k < 5; k++) {
        TEST_ASSERT_EQUAL_HEX32(torque, auto_restart_step(&cfg, &st, &in));
    }
    TEST_ASSERT_EQUAL_HEX32(RESET, auto_restart_step(&cfg, &st, &in));
    TEST_ASSERT_EQUAL_HEX32(torque, auto_restart_step(&cfg, &st, &in));
}

static void test_the_state_machine_runs_again(void)
{
    const params_t p = {
        .current_full_scale_A = 25.0f, .line_voltage_full_scale_V = 400.0f, .period_s = 2e-4f};
    sequence_config_t machine_cfg;
    TEST_ASSERT_TRUE(sequence_init(&machine_cfg, &p));
    sequence_state_t machine = {0};
    bool was_off = false;
    for (int k = 0; k < 100; k++) {
        const uint32_t faults = ((k >= 20) && (k < 40)) ? FAULT_DC_UNDER_VOLTAGE : 0u;
        const auto_restart_in_t in = {RUN, machine.id, machine.faults, faults, true};
        const sequence_in_t state_in = {.command = auto_restart_step(&cfg, &st, &in),
                                        .faults = faults};
        const sequence_out_t out = sequence_step(&machine_cfg, &machine, &state_in);
        was_off = was_off || ((k >= 20) && !out.gates_on);
        TEST_ASSERT_FALSE((faults != 0u) && out.gates_on);
    }
    TEST_ASSERT_TRUE(was_off);
    TEST_ASSERT_EQUAL(SEQUENCE_RUN, machine.id);
}

/* What the drive was told before the dip decides: a run command that only stands starts nothing. */
/* While the flux is built too: it was on its way. */
static void test_a_dip_with_the_gates_on_is_restarted(void)
{
    const sequence_id_t on[] = {SEQUENCE_PREMAGNETISE, SEQUENCE_RUN};
    for (int n = 0; n < 2; n++) {
        st = (auto_restart_state_t){0};
        TEST_ASSERT_EQUAL_HEX32(RUN, step(on[n], 0u, 0u));
        TEST_ASSERT_EQUAL(6, periods_to_reset());
    }
}

static void test_what_did_not_run_is_not_restarted(void)
{
    st.ran = false;
    TEST_ASSERT_EQUAL(0, periods_to_reset());
    (void)step(SEQUENCE_READY, 0u, 0u);
    TEST_ASSERT_EQUAL(0, periods_to_reset());
    (void)step(SEQUENCE_PREMAGNETISE, 0u, 0u);
    TEST_ASSERT_EQUAL(6, periods_to_reset());
    const auto_restart_in_t off = {.command = RUN | SEQUENCE_CMD_TORQUE_OFF, .id = SEQUENCE_RUN};
    (void)auto_restart_step(&cfg, &st, &off);
    (void)step(SEQUENCE_TORQUE_OFF, 0u, 0u);
    TEST_ASSERT_EQUAL(0, periods_to_reset());
}

/* The dip was one sample long: FAULT is first seen without a cause. */
static void test_the_delay_begins_with_the_fault_not_with_the_run(void)
{
    st.used = 1u;
    for (int k = 0; k < 9; k++) {
        (void)step(SEQUENCE_RUN, 0u, 0u);
    }
    TEST_ASSERT_EQUAL(6, periods_to_reset());
}

/* Held up by nothing but its capacitors the dc link is not back; a warning is no cause. */
static void test_waits_for_the_mains_not_for_warnings(void)
{
    auto_restart_in_t in = {RUN, SEQUENCE_FAULT, FAULT_MAINS_LOST, 0u, false};
    for (int k = 0; k < 100; k++) {
        TEST_ASSERT_EQUAL_HEX32(RUN, auto_restart_step(&cfg, &st, &in));
    }
    in.fed = true;
    in.faults = FAULT_DERATED | FAULT_PERIOD_LATE;
    for (int k = 0; k < 5; k++) {
        TEST_ASSERT_EQUAL_HEX32(RUN, auto_restart_step(&cfg, &st, &in));
    }
    TEST_ASSERT_EQUAL_HEX32(RESET, auto_restart_step(&cfg, &st, &in));
}

/* Torque-off, and the mains goes meanwhile: what was stopped stays stopped. */
static void test_torque_off_is_not_undone_by_a_dip(void)
{
    const params_t p = {
        .current_full_scale_A = 25.0f, .line_voltage_full_scale_V = 400.0f, .period_s = 2e-4f};
    sequence_config_t machine_cfg;
    TEST_ASSERT_TRUE(sequence_init(&machine_cfg, &p));
    sequence_state_t machine = {0};
    bool ran = false;
    for (int k = 0; k < 200; k++) {
        const uint32_t off = ((k >= 20) && (k < 60)) ? SEQUENCE_CMD_TORQUE_OFF : 0u;
        const uint32_t faults = ((k >= 30) && (k < 40)) ? FAULT_DC_UNDER_VOLTAGE : 0u;
        const auto_restart_in_t in = {RUN | off, machine.id, machine.faults, faults, true};
        const sequence_in_t state_in = {.command = auto_restart_step(&cfg, &st, &in),
                                        .faults = faults};
        const sequence_out_t out = sequence_step(&machine_cfg, &machine, &state_in);
        ran = ran || out.gates_on;
        TEST_ASSERT_FALSE((k >= 20) && out.gates_on);
    }
    TEST_ASSERT_TRUE(ran);
    TEST_ASSERT_EQUAL(SEQUENCE_FAULT, machine.id);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_bad_times);
    RUN_TEST(test_off_passes_every_command);
    RUN_TEST(test_resets_once_the_cause_has_been_gone_for_the_delay);
    RUN_TEST(test_a_run_alone_is_enough_to_begin_anew);
    RUN_TEST(test_only_for_a_dip);
    RUN_TEST(test_a_limited_number_of_times_unless_it_has_run_since);
    RUN_TEST(test_the_operator_wins);
    RUN_TEST(test_torque_mode_is_restarted_too);
    RUN_TEST(test_the_state_machine_runs_again);
    RUN_TEST(test_a_dip_with_the_gates_on_is_restarted);
    RUN_TEST(test_what_did_not_run_is_not_restarted);
    RUN_TEST(test_the_delay_begins_with_the_fault_not_with_the_run);
    RUN_TEST(test_waits_for_the_mains_not_for_warnings);
    RUN_TEST(test_torque_off_is_not_undone_by_a_dip);
    return UNITY_END();
}
