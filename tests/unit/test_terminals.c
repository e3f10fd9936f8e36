/* Who commands beside host link and bus, what each fault does, and what the relays show. */
#include "terminal_fixture.h"

#include "monitor.h"

#define RUN        SEQUENCE_CMD_RUN
#define TORQUE_OFF SEQUENCE_CMD_TORQUE_OFF
#define RESET      SEQUENCE_CMD_FAULT_RESET
#define START      HAL_TERMINAL_START
#define QUIET      (HAL_TERMINAL_READY | HAL_TERMINAL_NO_FAULT)

void setUp(void)
{
    start_board();
}
void tearDown(void)
{
}

static void start(void)
{
    two_wires();
    close_contacts(START);
    TEST_ASSERT_EQUAL_UINT32(RUN, out.command);
}

static uint16_t of_mA(float mA)
{
    return (uint16_t)(mA / 25.0f * 65536.0f);
}

static uint16_t of_pt1000(float degC)
{
    const float ohm = 1000.0f * (1.0f + 3.9083e-3f * degC - 5.775e-7f * degC * degC);
    return (uint16_t)(65536.0f * ohm / (ohm + 2200.0f));
}

static void test_with_all_off_a_command_passes(void)
{
    fit();
    posted = (unit_command_t){RUN | SEQUENCE_CMD_TORQUE_MODE, 7.0f, 3.0f, 9u};
    rounds(3u);
    TEST_ASSERT_EQUAL_UINT32(RUN | SEQUENCE_CMD_TORQUE_MODE, out.command);
    TEST_ASSERT_EQUAL_FLOAT(7.0f, out.omega_m_ref_rad_s);
    TEST_ASSERT_EQUAL_FLOAT(3.0f, out.torque_ref_Nm);
    TEST_ASSERT_EQUAL_UINT32(9u, out.count);
    posted.command = SEQUENCE_CMD_COMMISSION | RESET;
    command();
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_CMD_COMMISSION | RESET, out.command);
    posted.command = TORQUE_OFF;
    command();
    TEST_ASSERT_EQUAL_UINT32(TORQUE_OFF, out.command);
}

static void test_a_step_comes_once_in_its_periods(void)
{
    fit();
    rounds(1u);
    TEST_ASSERT_EQUAL_UINT32(1u, st.steps);
    TEST_ASSERT_EQUAL_UINT32(1u, writes);
    unit.period_count += 4u;
    command();
    TEST_ASSERT_EQUAL_UINT32(1u, st.steps);
    unit.period_count += 1u;
    command();
    TEST_ASSERT_EQUAL_UINT32(2u, st.steps);
    unit.period_count = 3u; /* it wraps: 4 s are the longest time that counts */
    command();
    TEST_ASSERT_EQUAL_UINT32(2u + 4000u, st.steps);
    TEST_ASSERT_EQUAL_UINT32(3u, writes);
}

static void lose_reference(void)
{
    params.analog_reference = ANALOG_REFERENCE_CURRENT;
    params.analog_lost_s = 0.1f;
}

static void charge_slowly(void)
{
    params.precharge = 1u;
    params.precharge_ready_V = 200.0f;
    params.precharge_s = 0.5f;
    unit.last.meas.u_dc_V = 150.0f;
}

/* RUN without torque. */
static void prove_nothing(void)
{
    params.brake_control = 1u;
    params.brake_torque_Nm = 5.0f;
    params.brake_prove_s = 0.3f;
    unit.machine.id = SEQUENCE_RUN;
    unit.asked.mode = DRIVE_RUN;
    posted = (unit_command_t){RUN, 10.0f, 0.0f, 1u};
}

static void hide_inputs(void)
{
    answers = false;
}

/* Whatever the control period, and however many of them the background misses. */
static void test_times_are_true(void)
{
    const float period_s[] = {62.5e-6f, 100e-6f, 200e-6f, 300e-6f, 1e-3f, 2e-3f};
    const uint32_t turn[] = {1u, 7u, 23u}; /* periods from round to round of the background */
    void (*const prepare[])(void) = {lose_reference, charge_slowly, prove_nothing, hide_inputs};
    const double time_s[] = {0.1, 0.5, 0.3, 0.1};
    for (uint32_t k = 0u; k < 6u * 3u * 4u; k++) {
        start_board();
        drive.period_s = period_s[k % 6u];
        prepare[k / 18u]();
        fit();
        uint32_t periods = 0u;
        for (command(); st.faults == 0u; command()) {
            unit.period_count += turn[(k / 6u) % 3u];
            periods += turn[(k / 6u) % 3u];
            TEST_ASSERT_TRUE(periods < 100000u);
        }
        const double look_s = 1e-3 + (double)(2u + turn[(k / 6u) % 3u]) * (double)drive.period_s;
        const double lasted_s = (double)periods * (double)drive.period_s;
        TEST_ASSERT_DOUBLE_WITHIN(2.0 * look_s, time_s[k / 18u], lasted_s);
    }
}

/* Since when it has been there is unknown. */
static void test_what_is_seen_once_counts_once_after_a_gap(void)
{
    params.contact_debounce_s = 0.02f;
    params.sink_sensor = TEMPERATURE_PT1000;
    params.precharge = 1u;
    params.precharge_ready_V = 200.0f;
    in.sink_counts = of_pt1000(40.0f);
    two_wires();
    rounds(200u);
    unit.period_count += 2500u; /* .5 s: flash was erased */
    in.inputs = START;
    in.sink_counts = 0u;
    command();
    in.sink_counts = of_pt1000(40.0f);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command);
    TEST_ASSERT_EQUAL_HEX32(0u, st.faults);
    in.inputs = 0u;
    rounds(30u);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command);
    TEST_ASSERT_EQUAL_HEX32(0u, st.faults);
}

static void test_start_runs_at_the_full_speed(void)
{
    start();
    TEST_ASSERT_EQUAL_FLOAT(50.0f, out.omega_m_ref_rad_s);
    close_contacts(START | HAL_TERMINAL_REVERSE);
    TEST_ASSERT_EQUAL_FLOAT(-50.0f, out.omega_m_ref_rad_s);
    close_contacts(0u);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, out.omega_m_ref_rad_s);
}

static void test_contacts_run_at_speed_whatever_a_silent_host_said(void)
{
    posted = (unit_command_t){SEQUENCE_CMD_TORQUE_MODE, 7.0f, 3.0f, 0u};
    start();
    TEST_ASSERT_EQUAL_UINT32(RUN, out.command);
    close_contacts(0u);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_CMD_TORQUE_MODE, out.command);
}

static void test_contacts_are_alive_and_a_host_only_by_itself(void)
{
    start();
    const uint32_t before = out.count;
    rounds(3u);
    TEST_ASSERT_EQUAL_UINT32(before + 3u, out.count);
    posted = (unit_command_t){RUN, 7.0f, 0.0f, 100u};
    rounds(3u);
    TEST_ASSERT_EQUAL_UINT32(100u, out.count);
    posted.command = SEQUENCE_CMD_COMMISSION;
    rounds(3u);
    TEST_ASSERT_EQUAL_UINT32(100u, out.count);
}

static void test_inputs_that_are_not_fitted_are_open(void)
{
    params.start_control = CONTACTS_TWO_WIRE;
    hal.fitted = ~HAL_TERMINAL_REVERSE;
    fit();
    rounds(1u);
    close_contacts(START | HAL_TERMINAL_REVERSE);
    TEST_ASSERT_EQUAL_FLOAT(50.0f, out.omega_m_ref_rad_s);
}

static void test_outputs_that_are_not_fitted_stay_off(void)
{
    hal.fitted = HAL_TERMINAL_NO_FAULT;
    fit();
    rounds(1u);
    TEST_ASSERT_EQUAL_HEX32(HAL_TERMINAL_NO_FAULT, written);
}

static void test_a_host_takes_the_drive_from_the_contacts(void)
{
    start();
    posted = (unit_command_t){RUN, 7.0f, 0.0f, 1u};
    command();
    TEST_ASSERT_EQUAL_FLOAT(7.0f, out.omega_m_ref_rad_s);
    TEST_ASSERT_EQUAL_UINT32(RUN, out.command);
    rounds(3u);
    TEST_ASSERT_EQUAL_FLOAT(7.0f, out.omega_m_ref_rad_s);
    posted.command = 0u;
    rounds(10u);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command); /* START still closed */
    close_contacts(0u);
    close_contacts(START);
    TEST_ASSERT_EQUAL_UINT32(RUN, out.command);
}

static void test_a_stop_of_the_host_holds_against_a_closed_start(void)
{
    start();
    unit.link.commands++;
    rounds(10u);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command);
    close_contacts(0u);
    close_contacts(START);
    TEST_ASSERT_EQUAL_UINT32(RUN, out.command);
    posted.command = TORQUE_OFF;
    command();
    TEST_ASSERT_EQUAL_UINT32(TORQUE_OFF, out.command);
    posted.command = 0u;
    rounds(10u);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command);
}

static void test_commissioning_takes_the_drive_too(void)
{
    start();
    posted.command = SEQUENCE_CMD_COMMISSION;
    command();
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_CMD_COMMISSION, out.command);
}

static void test_an_open_stop_ends_the_run_of_everybody(void)
{
    params.start_control = CONTACTS_THREE_WIRE;
    fit();
    close_contacts(HAL_TERMINAL_STOP);
    posted.command = RUN;
    command();
    TEST_ASSERT_EQUAL_UINT32(RUN, out.command);
    close_contacts(0u);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command);
    close_contacts(HAL_TERMINAL_STOP);
    rounds(10u);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command); /* run of the host has to drop */
    posted.command = 0u;
    command();
    posted.command = RUN;
    command();
    TEST_ASSERT_EQUAL_UINT32(RUN, out.command);
}

static void test_an_open_stop_ends_commissioning(void)
{
    params.start_control = CONTACTS_THREE_WIRE;
    fit();
    close_contacts(HAL_TERMINAL_STOP);
    posted.command = SEQUENCE_CMD_COMMISSION;
    command();
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_CMD_COMMISSION, out.command);
    close_contacts(0u);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command);
}

static void test_a_button_starts_again_after_a_fault(void)
{
    params.start_control = CONTACTS_THREE_WIRE;
    fit();
    close_contacts(HAL_TERMINAL_STOP);
    close_contacts(HAL_TERMINAL_STOP | START);
    close_contacts(HAL_TERMINAL_STOP);
    TEST_ASSERT_EQUAL_UINT32(RUN, out.command);
    st.faults = TERMINAL_FAULT_MOTOR_HOT;
    rounds(1u);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command);
    close_contacts(HAL_TERMINAL_STOP | HAL_TERMINAL_RESET);
    close_contacts(HAL_TERMINAL_STOP);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command);
    close_contacts(HAL_TERMINAL_STOP | START);
    TEST_ASSERT_EQUAL_UINT32(RUN, out.command);
}

static void test_reset_is_passed_for_one_step(void)
{
    two_wires();
    close_contacts(HAL_TERMINAL_RESET);
    TEST_ASSERT_EQUAL_UINT32(RESET, out.command);
    unit.period_count += 4u;
    command();
    TEST_ASSERT_EQUAL_UINT32(RESET, out.command);
    unit.period_count += 1u;
    command();
    TEST_ASSERT_EQUAL_UINT32(0u, out.command);
}

static void test_the_analogue_reference_scales_the_speed(void)
{
    params.analog_reference = ANALOG_REFERENCE_CURRENT;
    params.analog_filter_s = 0.0f;
    in.analog_counts = of_mA(8.0f);
    start();
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 12.5f, out.omega_m_ref_rad_s);
    in.analog_counts = of_mA(20.0f);
    close_contacts(START | HAL_TERMINAL_REVERSE);
    TEST_ASSERT_FLOAT_WITHIN(0.01f, -50.0f, out.omega_m_ref_rad_s);
    TEST_ASSERT_EQUAL_UINT32(0u, st.faults);
}

static void test_a_lost_reference_stops_until_reset_and_start(void)
{
    params.analog_reference = ANALOG_REFERENCE_CURRENT;
    params.analog_filter_s = 0.0f;
    in.analog_counts = of_mA(12.0f);
    start();
    in.analog_counts = 0u;
    rounds(99u);
    TEST_ASSERT_EQUAL_UINT32(RUN, out.command);
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 25.0f, out.omega_m_ref_rad_s);
    rounds(1u);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command);
    TEST_ASSERT_EQUAL_HEX32(TERMINAL_FAULT_REFERENCE_LOST, st.faults);
    TEST_ASSERT_EQUAL_HEX32(0u, written);
    close_contacts(START | HAL_TERMINAL_RESET); /* still lost */
    TEST_ASSERT_EQUAL_HEX32(TERMINAL_FAULT_REFERENCE_LOST, st.faults);
    in.analog_counts = of_mA(12.0f);
    rounds(1000u);
    TEST_ASSERT_EQUAL_HEX32(TERMINAL_FAULT_REFERENCE_LOST, st.faults);
    close_contacts(START);
    close_contacts(START | HAL_TERMINAL_RESET);
    TEST_ASSERT_EQUAL_HEX32(0u, st.faults);
    close_contacts(START);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command);
    close_contacts(0u);
    close_contacts(START);
    TEST_ASSERT_EQUAL_UINT32(RUN, out.command);
}

static void test_a_lost_reference_may_be_held(void)
{
    params.analog_reference = ANALOG_REFERENCE_CURRENT;
    params.analog_filter_s = 0.0f;
    params.analog_lost_action = 1u;
    in.analog_counts = of_mA(12.0f);
    start();
    in.analog_counts = 0u;
    rounds(200u);
    TEST_ASSERT_EQUAL_UINT32(RUN, out.command);
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 25.0f, out.omega_m_ref_rad_s);
    TEST_ASSERT_EQUAL_HEX32(TERMINAL_FAULT_REFERENCE_HELD, st.faults);
    TEST_ASSERT_EQUAL_HEX32(QUIET, written);
}

static void test_a_reset_of_the_host_clears_the_terminals_as_well(void)
{
    start();
    st.faults = TERMINAL_FAULT_SINK_SENSOR;
    posted.command = RESET;
    rounds(1u);
    TEST_ASSERT_EQUAL_HEX32(0u, st.faults);
    st.faults = TERMINAL_FAULT_SINK_SENSOR;
    rounds(5u); /* the edge counts */
    TEST_ASSERT_EQUAL_HEX32(TERMINAL_FAULT_SINK_SENSOR, st.faults);
    posted.command = 0u;
    command();
    posted.command = RESET;
    command(); /* between two steps */
    posted.command = 0u;
    rounds(1u);
    TEST_ASSERT_EQUAL_HEX32(0u, st.faults);
}

static void test_inputs_that_do_not_answer_stay_and_then_stop(void)
{
    start();
    in.inputs = HAL_TERMINAL_RESET; /* would reset and stop, if it was read */
    answers = false;
    rounds(99u);
    TEST_ASSERT_EQUAL_UINT32(RUN, out.command);
    rounds(1u);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command);
    TEST_ASSERT_EQUAL_HEX32(TERMINAL_FAULT_INPUTS_LOST, st.faults);
    rounds(1000u);
    TEST_ASSERT_EQUAL_UINT32(100u, st.unread);
    answers = true;
    in.inputs = 0u;
    rounds(1u);
    TEST_ASSERT_EQUAL_UINT32(0u, st.unread);
    close_contacts(HAL_TERMINAL_RESET);
    TEST_ASSERT_EQUAL_HEX32(0u, st.faults);
    answers = false;
    rounds(1u);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command); /* the reset was one step */
}

static void test_sensors_stop_trip_or_warn(void)
{
    params.sink_sensor = TEMPERATURE_PT1000;
    params.motor_sensor = TEMPERATURE_PT1000;
    params.sensor_lost_s = 0.01f;
    const uint16_t good = of_pt1000(40.0f);
    const struct {
        uint16_t sink;
        uint16_t motor;
        uint32_t fault;
        uint32_t command;
    } rows[] = {{0u, good, TERMINAL_FAULT_SINK_SENSOR | TERMINAL_FAULT_SINK_SHORT, 0u},
                {65535u, good, TERMINAL_FAULT_SINK_SENSOR, 0u},
                {good, 65535u, TERMINAL_FAULT_MOTOR_SENSOR, RUN},
                {good, 0u, TERMINAL_FAULT_MOTOR_SENSOR | TERMINAL_FAULT_MOTOR_SHORT, RUN},
                {of_pt1000(95.0f), good, TERMINAL_FAULT_SINK_HOT, TORQUE_OFF},
                {good, of_pt1000(155.0f), TERMINAL_FAULT_MOTOR_HOT, 0u},
                {good, good, 0u, RUN}};
    for (uint32_t k = 0u; k < sizeof rows / sizeof rows[0]; k++) {
        in.inputs = 0u;
        in.sink_counts = good;
        in.motor_counts = good;
        start();
        in.sink_counts = rows[k].sink;
        in.motor_counts = rows[k].motor;
        rounds(100u);
        TEST_ASSERT_EQUAL_HEX32(rows[k].fault, st.faults);
        TEST_ASSERT_EQUAL_UINT32(rows[k].command, out.command);
    }
}

static void test_relays_show_the_drive(void)
{
    two_wires();
    TEST_ASSERT_EQUAL_HEX32(QUIET, written);
    unit.machine.id = SEQUENCE_FAULT;
    rounds(1u);
    TEST_ASSERT_EQUAL_HEX32(0u, written);
    unit.machine.id = SEQUENCE_SELF_TEST;
    rounds(1u);
    TEST_ASSERT_EQUAL_HEX32(HAL_TERMINAL_NO_FAULT, written);
    drive_runs();
    rounds(1u);
    TEST_ASSERT_EQUAL_HEX32(QUIET, written);
}

static void test_ready_drops_while_stop_is_open(void)
{
    params.start_control = CONTACTS_THREE_WIRE;
    fit();
    rounds(1u);
    TEST_ASSERT_EQUAL_HEX32(HAL_TERMINAL_NO_FAULT, written);
    close_contacts(HAL_TERMINAL_STOP);
    TEST_ASSERT_EQUAL_HEX32(QUIET, written);
}

/* --- pre-charge and brake resistor ------------------------------------------------------------ */

static void precharge(void)
{
    params.precharge = 1u;
    params.precharge_ready_V = 200.0f;
    params.contactor_feedback = 1u;
    fit();
    unit.last.meas.u_dc_V = 280.0f;
}

static void test_nothing_runs_before_the_contactor_has_closed(void)
{
    precharge();
    rounds(1u);
    posted.command = RUN;
    rounds(100u);
    TEST_ASSERT_EQUAL(PRECHARGE_CLOSING, st.precharge.id);
    TEST_ASSERT_EQUAL_HEX32(HAL_TERMINAL_CONTACTOR | HAL_TERMINAL_NO_FAULT, written);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command);
    close_contacts(HAL_TERMINAL_CONTACTOR_ON);
    TEST_ASSERT_EQUAL_HEX32(HAL_TERMINAL_CONTACTOR | QUIET, written);
    rounds(10u);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command); /* run has to drop */
    posted.command = 0u;
    rounds(1u);
    posted.command = RUN;
    rounds(1u);
    TEST_ASSERT_EQUAL_UINT32(RUN, out.command);
}

static void test_the_under_voltage_of_charging_is_reset(void)
{
    const uint32_t latched[] = {FAULT_DC_UNDER_VOLTAGE, FAULT_DC_UNDER_VOLTAGE | FAULT_DERATED,
                                FAULT_DC_UNDER_VOLTAGE | FAULT_OVER_CURRENT};
    for (uint32_t k = 0u; k < 3u; k++) {
        in.inputs = 0u;
        precharge();
        unit.machine.id = SEQUENCE_FAULT;
        unit.machine.faults = latched[k];
        rounds(101u);
        TEST_ASSERT_EQUAL_UINT32(0u, out.command);
        close_contacts(HAL_TERMINAL_CONTACTOR_ON);
        TEST_ASSERT_EQUAL_UINT32((k < 2u) ? RESET : 0u, out.command);
        rounds(1u);
        TEST_ASSERT_EQUAL_UINT32(0u, out.command);
    }
}

static void test_a_link_that_does_not_charge_keeps_the_gates_off(void)
{
    precharge();
    params.precharge_s = 0.5f;
    fit();
    unit.last.meas.u_dc_V = 150.0f;
    rounds(500u);
    TEST_ASSERT_EQUAL_HEX32(0u, st.faults);
    rounds(1u);
    TEST_ASSERT_EQUAL_HEX32(TERMINAL_FAULT_PRECHARGE, st.faults);
    TEST_ASSERT_EQUAL_UINT32(TORQUE_OFF, out.command);
    posted.command = RESET;
    rounds(1u);
    TEST_ASSERT_EQUAL_HEX32(0u, st.faults);
    TEST_ASSERT_EQUAL(PRECHARGE_WAITING, st.precharge.id);
}

static void test_a_contactor_that_contradicts_keeps_the_gates_off(void)
{
    precharge();
    unit.last.meas.u_dc_V = 0.0f;
    in.inputs = HAL_TERMINAL_CONTACTOR_ON;
    rounds(20u);
    TEST_ASSERT_EQUAL_HEX32(TERMINAL_FAULT_CONTACTOR, st.faults);
    TEST_ASSERT_EQUAL_UINT32(TORQUE_OFF, out.command);
}

static void charged(void)
{
    precharge();
    rounds(101u);
    close_contacts(HAL_TERMINAL_CONTACTOR_ON);
    TEST_ASSERT_EQUAL(PRECHARGE_CLOSED, st.precharge.id);
}

/* Gates off first, then the current has to be gone, then the contactor. */
static void test_a_low_link_turns_the_gates_off_before_the_contactor_opens(void)
{
    charged();
    drive_runs();
    unit.last.meas.i_s_A = (ab_t){0.0f, 0.021f * unit.params.current_full_scale_A};
    unit.last.meas.u_dc_V = 139.0f;
    rounds(4u);
    TEST_ASSERT_EQUAL_HEX32(0u, st.faults);
    rounds(1u);
    TEST_ASSERT_EQUAL_HEX32(TERMINAL_FAULT_LINK_LOW, st.faults);
    TEST_ASSERT_EQUAL_UINT32(TORQUE_OFF, out.command);
    TEST_ASSERT_EQUAL_HEX32(HAL_TERMINAL_CONTACTOR | HAL_TERMINAL_READY, written);
    drive_rests();
    rounds(1u);
    TEST_ASSERT_EQUAL_HEX32(HAL_TERMINAL_CONTACTOR, written);
    unit.last.meas.i_s_A = (ab_t){0.0f, 0.019f * unit.params.current_full_scale_A};
    rounds(1u);
    TEST_ASSERT_EQUAL_HEX32(0u, written);
    TEST_ASSERT_EQUAL(PRECHARGE_WAITING, st.precharge.id);
    posted.command = RESET;
    rounds(1u);
    TEST_ASSERT_EQUAL_HEX32(0u, st.faults);
}

static void chopper(void)
{
    params.chopper_ohm = 40.0f;
    params.chopper_W = 10.0f;
    params.chopper_s = 1.0f;
    fit();
    unit.last.meas.u_dc_V = 400.0f; /* 400 times the rating */
}

static void test_a_hot_resistor_is_disabled_and_stops_the_drive(void)
{
    chopper();
    rounds(1u);
    TEST_ASSERT_EQUAL_HEX32(HAL_TERMINAL_CHOPPER | QUIET, written);
    posted.command = RUN;
    drive_runs();
    unit.drive.limits.link.brake_on = true;
    rounds(3u);
    TEST_ASSERT_EQUAL_HEX32(TERMINAL_FAULT_CHOPPER_HOT, st.faults);
    TEST_ASSERT_EQUAL_HEX32(HAL_TERMINAL_READY, written);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command);
    const float heat_pu = st.chopper.heat_pu;
    rounds(1u);
    TEST_ASSERT_TRUE(st.chopper.heat_pu < heat_pu); /* disabled, it cools */
}

static void test_a_shorted_transistor_opens_contactor_and_gates(void)
{
    params.chopper_feedback = 1u;
    params.precharge = 1u;
    params.precharge_ready_V = 200.0f;
    params.contactor_s = 0.01f;
    chopper();
    params.chopper_W = 1e6f;
    fit();
    rounds(112u);
    TEST_ASSERT_EQUAL_HEX32(HAL_TERMINAL_CONTACTOR | HAL_TERMINAL_CHOPPER | QUIET, written);
    in.inputs = HAL_TERMINAL_CHOPPER_LEADS;
    rounds(20u);
    TEST_ASSERT_EQUAL_HEX32(TERMINAL_FAULT_CHOPPER_SHORT, st.faults);
    TEST_ASSERT_EQUAL_HEX32(0u, written);
    TEST_ASSERT_EQUAL_UINT32(TORQUE_OFF, out.command);
}

/* Faster than a contact is debounced: the feedback follows, and the heat counts. */
static void test_a_switching_chopper_is_no_fault_and_heats(void)
{
    params.chopper_feedback = 1u;
    params.contact_debounce_s = 0.02f;
    chopper();
    params.chopper_W = 1e6f;
    fit();
    rounds(1u);
    for (uint32_t k = 0u; k < 200u; k++) {
        const bool on = (k % 20u) < 10u;
        unit.drive.limits.link.brake_on = on;
        in.inputs = on ? HAL_TERMINAL_CHOPPER_LEADS : 0u;
        const float heat_pu = st.chopper.heat_pu;
        rounds(1u);
        TEST_ASSERT_EQUAL_HEX32(0u, st.faults);
        TEST_ASSERT_EQUAL(on, st.chopper.heat_pu > heat_pu);
    }
}

static void test_a_resistor_that_does_not_lead_is_told(void)
{
    params.chopper_feedback = 1u;
    chopper();
    rounds(1u);
    unit.drive.limits.link.brake_on = true;
    rounds(20u);
    TEST_ASSERT_EQUAL_HEX32(TERMINAL_FAULT_CHOPPER_OPEN, st.faults);
    TEST_ASSERT_EQUAL_HEX32(HAL_TERMINAL_CHOPPER | QUIET, written);
}

/* --- mechanical brake ------------------------------------------------------------------------- */

static void torque(float torque_Nm)
{
    const float i_A = 4.0f;
    const float lambda_Wb =
        torque_Nm / (i_A * unit.params.pole_pairs * unit.params.M_H / unit.params.Lr_H);
    unit.drive.estimator.estimate.lambda_r_hat_Wb = (ab_t){lambda_Wb, 0.0f};
    unit.last.meas.i_s_A = (ab_t){1.0f, i_A};
}

static void hoist(void)
{
    unit.params.Lr_H = 2.0f * unit.params.M_H;
    params.brake_control = 1u;
    params.brake_feedback = 1u;
    params.brake_torque_Nm = 8.0f;
    params.brake_close_rad_s = 2.0f;
    two_wires();
    close_contacts(START);
}

static void test_a_hoist_proves_releases_and_follows(void)
{
    hoist();
    TEST_ASSERT_EQUAL_UINT32(RUN | SEQUENCE_CMD_TORQUE_MODE, out.command);
    TEST_ASSERT_EQUAL_FLOAT(8.0f, out.torque_ref_Nm);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, out.omega_m_ref_rad_s);
    drive_runs();
    torque(7.1f);
    rounds(100u);
    TEST_ASSERT_EQUAL(MECH_BRAKE_PROVING, st.brake.id);
    torque(7.3f);
    rounds(20u);
    TEST_ASSERT_EQUAL(MECH_BRAKE_RELEASING, st.brake.id);
    TEST_ASSERT_EQUAL_HEX32(HAL_TERMINAL_BRAKE_RELEASE | QUIET, written);
    TEST_ASSERT_EQUAL_UINT32(RUN, out.command);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, out.torque_ref_Nm);
    close_contacts(START | HAL_TERMINAL_BRAKE_RELEASED);
    rounds(3u);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, out.omega_m_ref_rad_s);
    rounds(1u);
    TEST_ASSERT_EQUAL_FLOAT(50.0f, out.omega_m_ref_rad_s);
    unit.drive.estimator.estimate.omega_e_rad_s = 60.0f;
    close_contacts(HAL_TERMINAL_BRAKE_RELEASED);
    rounds(10u);
    TEST_ASSERT_EQUAL(MECH_BRAKE_RELEASED, st.brake.id);
    TEST_ASSERT_EQUAL_UINT32(RUN, out.command); /* until the brake has closed */
    TEST_ASSERT_EQUAL_FLOAT(0.0f, out.omega_m_ref_rad_s);
    unit.drive.estimator.estimate.omega_e_rad_s = 1.0f;
    rounds(1u);
    TEST_ASSERT_EQUAL(MECH_BRAKE_CLOSING, st.brake.id);
    TEST_ASSERT_EQUAL_HEX32(QUIET, written);
    in.inputs = 0u;
    rounds(4u);
    TEST_ASSERT_EQUAL_UINT32(RUN, out.command);
    rounds(1u);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command);
}

static void released(void)
{
    hoist();
    drive_runs();
    torque(8.0f);
    rounds(20u);
    unit.drive.estimator.estimate.omega_e_rad_s = 60.0f;
    close_contacts(START | HAL_TERMINAL_BRAKE_RELEASED);
    rounds(4u);
    TEST_ASSERT_EQUAL(MECH_BRAKE_RELEASED, st.brake.id);
}

static void expect_off(uint32_t fault)
{
    TEST_ASSERT_EQUAL_HEX32(fault, st.faults);
    TEST_ASSERT_EQUAL_UINT32(TORQUE_OFF, out.command);
    TEST_ASSERT_EQUAL_HEX32(HAL_TERMINAL_READY, written); /* the gates are still on */
}

static void test_torque_that_is_not_proven_is_a_fault(void)
{
    hoist();
    drive_runs();
    torque(7.0f);
    rounds(999u);
    TEST_ASSERT_EQUAL_HEX32(0u, st.faults);
    rounds(1u);
    expect_off(TERMINAL_FAULT_BRAKE_TORQUE);
}

static void test_a_brake_that_does_not_release_is_a_fault(void)
{
    hoist();
    drive_runs();
    torque(8.0f);
    rounds(20u + 299u);
    TEST_ASSERT_EQUAL_HEX32(0u, st.faults);
    rounds(1u);
    expect_off(TERMINAL_FAULT_BRAKE_NOT_RELEASED);
}

static void test_a_switch_that_opens_is_a_fault(void)
{
    released();
    close_contacts(START);
    rounds(3u);
    TEST_ASSERT_EQUAL_HEX32(0u, st.faults);
    rounds(1u);
    expect_off(TERMINAL_FAULT_BRAKE_FEEDBACK);
}

/* Whatever the debounce of the operator's contacts. */
static void test_the_switch_of_the_brake_has_its_own_debounce(void)
{
    params.contact_debounce_s = 0.001f;
    released();
    cfg.contacts.debounce_steps = 500u;
    in.inputs = START;
    rounds(5u);
    expect_off(TERMINAL_FAULT_BRAKE_FEEDBACK);
}

static void test_a_brake_that_does_not_close_is_held_and_told(void)
{
    released();
    unit.drive.estimator.estimate.omega_e_rad_s = 0.0f;
    close_contacts(HAL_TERMINAL_BRAKE_RELEASED);
    rounds(299u);
    TEST_ASSERT_EQUAL_HEX32(0u, st.faults);
    rounds(1u);
    TEST_ASSERT_EQUAL_HEX32(TERMINAL_FAULT_BRAKE_NOT_CLOSED, st.faults);
    TEST_ASSERT_EQUAL_UINT32(RUN, out.command);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, out.omega_m_ref_rad_s);
    TEST_ASSERT_EQUAL_HEX32(QUIET, written);
}

static void test_a_fault_that_stops_lets_a_hoist_down_on_its_brake(void)
{
    released();
    st.faults = TERMINAL_FAULT_MOTOR_HOT;
    rounds(10u);
    TEST_ASSERT_EQUAL(MECH_BRAKE_RELEASED, st.brake.id);
    TEST_ASSERT_EQUAL_UINT32(RUN, out.command);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, out.omega_m_ref_rad_s);
}

static void test_off_closes_the_brake_in_the_same_step(void)
{
    released();
    posted.command = TORQUE_OFF;
    rounds(1u);
    TEST_ASSERT_EQUAL(MECH_BRAKE_CLOSED, st.brake.id);
    TEST_ASSERT_EQUAL_UINT32(TORQUE_OFF, out.command);
    TEST_ASSERT_EQUAL_HEX32(QUIET, written);
    posted.command = 0u;
    in.inputs = 0u;
    rounds(1u);
    released();
    st.faults = TERMINAL_FAULT_SINK_HOT;
    rounds(1u);
    TEST_ASSERT_EQUAL(MECH_BRAKE_CLOSED, st.brake.id);
    TEST_ASSERT_EQUAL_UINT32(TORQUE_OFF, out.command);
}

static void test_gates_that_go_off_close_the_brake(void)
{
    released();
    drive_rests();
    rounds(1u);
    TEST_ASSERT_EQUAL(MECH_BRAKE_CLOSED, st.brake.id);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command);
    close_contacts(START);
    rounds(10u);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command); /* START has to open */
}

static void test_a_host_lifts_through_the_brake_and_not_in_torque_mode(void)
{
    hoist();
    close_contacts(0u);
    posted = (unit_command_t){RUN, 20.0f, 0.0f, 1u};
    rounds(2u);
    TEST_ASSERT_EQUAL_UINT32(RUN | SEQUENCE_CMD_TORQUE_MODE, out.command);
    TEST_ASSERT_EQUAL(MECH_BRAKE_PROVING, st.brake.id);
    posted.command = RUN | SEQUENCE_CMD_TORQUE_MODE;
    posted.torque_ref_Nm = 1.0f;
    rounds(1u);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command);
    posted.command = SEQUENCE_CMD_TORQUE_MODE;
    rounds(1u);
    TEST_ASSERT_FALSE(st.blocked);
}

static void test_a_hoist_is_not_commissioned(void)
{
    hoist();
    close_contacts(0u);
    posted.command = SEQUENCE_CMD_COMMISSION;
    rounds(10u);
    TEST_ASSERT_EQUAL_UINT32(0u, out.command);
    TEST_ASSERT_EQUAL(MECH_BRAKE_CLOSED, st.brake.id);
    TEST_ASSERT_EQUAL_HEX32(TERMINAL_FAULT_COMMISSION_REFUSED, st.faults);
    TEST_ASSERT_EQUAL_HEX32(TERMINAL_FAULT_COMMISSION_REFUSED, unit.link.terminal_faults);
    TEST_ASSERT_EQUAL_HEX32(QUIET, written); /* a warning */
    posted.command = 0u;
    rounds(1u);
    posted.command = RESET;
    rounds(1u);
    TEST_ASSERT_EQUAL_HEX32(0u, unit.link.terminal_faults);
    posted = (unit_command_t){RUN | SEQUENCE_CMD_COMMISSION, 20.0f, 0.0f, 1u};
    rounds(2u);
    TEST_ASSERT_EQUAL_UINT32(RUN | SEQUENCE_CMD_TORQUE_MODE, out.command);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_with_all_off_a_command_passes);
    RUN_TEST(test_a_step_comes_once_in_its_periods);
    RUN_TEST(test_times_are_true);
    RUN_TEST(test_what_is_seen_once_counts_once_after_a_gap);
    RUN_TEST(test_start_runs_at_the_full_speed);
    RUN_TEST(test_contacts_run_at_speed_whatever_a_silent_host_said);
    RUN_TEST(test_contacts_are_alive_and_a_host_only_by_itself);
    RUN_TEST(test_inputs_that_are_not_fitted_are_open);
    RUN_TEST(test_outputs_that_are_not_fitted_stay_off);
    RUN_TEST(test_a_host_takes_the_drive_from_the_contacts);
    RUN_TEST(test_a_stop_of_the_host_holds_against_a_closed_start);
    RUN_TEST(test_commissioning_takes_the_drive_too);
    RUN_TEST(test_an_open_stop_ends_the_run_of_everybody);
    RUN_TEST(test_an_open_stop_ends_commissioning);
    RUN_TEST(test_a_button_starts_again_after_a_fault);
    RUN_TEST(test_reset_is_passed_for_one_step);
    RUN_TEST(test_the_analogue_reference_scales_the_speed);
    RUN_TEST(test_a_lost_reference_stops_until_reset_and_start);
    RUN_TEST(test_a_lost_reference_may_be_held);
    RUN_TEST(test_a_reset_of_the_host_clears_the_terminals_as_well);
    RUN_TEST(test_inputs_that_do_not_answer_stay_and_then_stop);
    RUN_TEST(test_sensors_stop_trip_or_warn);
    RUN_TEST(test_relays_show_the_drive);
    RUN_TEST(test_ready_drops_while_stop_is_open);
    RUN_TEST(test_nothing_runs_before_the_contactor_has_closed);
    RUN_TEST(test_the_under_voltage_of_charging_is_reset);
    RUN_TEST(test_a_link_that_does_not_charge_keeps_the_gates_off);
    RUN_TEST(test_a_contactor_that_contradicts_keeps_the_gates_off);
    RUN_TEST(test_a_low_link_turns_the_gates_off_before_the_contactor_opens);
    RUN_TEST(test_a_hot_resistor_is_disabled_and_stops_the_drive);
    RUN_TEST(test_a_shorted_transistor_opens_contactor_and_gates);
    RUN_TEST(test_a_switching_chopper_is_no_fault_and_heats);
    RUN_TEST(test_a_resistor_that_does_not_lead_is_told);
    RUN_TEST(test_a_hoist_proves_releases_and_follows);
    RUN_TEST(test_torque_that_is_not_proven_is_a_fault);
    RUN_TEST(test_a_brake_that_does_not_release_is_a_fault);
    RUN_TEST(test_a_switch_that_opens_is_a_fault);
    RUN_TEST(test_the_switch_of_the_brake_has_its_own_debounce);
    RUN_TEST(test_a_brake_that_does_not_close_is_held_and_told);
    RUN_TEST(test_a_fault_that_stops_lets_a_hoist_down_on_its_brake);
    RUN_TEST(test_off_closes_the_brake_in_the_same_step);
    RUN_TEST(test_gates_that_go_off_close_the_brake);
    RUN_TEST(test_a_host_lifts_through_the_brake_and_not_in_torque_mode);
    RUN_TEST(test_a_hoist_is_not_commissioned);
    return UNITY_END();
}
