/* What a fieldbus may ask of the drive, when it is refused, and how its run command ends. */
#include "fieldbus.h"

#include <math.h>

#include "bus_fixture.h"
#include "fieldbus_actual.h"
#include "fieldbus_params.h"

void setUp(void)
{
    start_drive();
}
void tearDown(void)
{
}

static fieldbus_status_t ask(uint32_t command, float omega_m_ref_rad_s)
{
    const fieldbus_demand_t demand = {.command = command, .omega_m_ref_rad_s = omega_m_ref_rad_s};
    return fieldbus_ask(&fb, unit(), &demand);
}

static void run(float omega_m_ref_rad_s)
{
    TEST_ASSERT_EQUAL(FIELDBUS_OK, ask(0u, 0.0f));
    TEST_ASSERT_EQUAL(FIELDBUS_OK, ask(SEQUENCE_CMD_RUN, omega_m_ref_rad_s));
}

static void test_run_starts_the_drive_with_the_reference(void)
{
    run(6.0f);
    rounds(2u);
    TEST_ASSERT_EQUAL(SEQUENCE_PREMAGNETISE, unit()->machine.id);
    TEST_ASSERT_EQUAL_FLOAT(6.0f, unit()->command.omega_m_ref_rad_s);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_CMD_RUN, unit()->command.command);
}

static void test_torque_and_its_reference_are_posted(void)
{
    TEST_ASSERT_EQUAL(FIELDBUS_OK, ask(0u, 0.0f));
    const fieldbus_demand_t demand = {.command = SEQUENCE_CMD_TORQUE_MODE, .torque_ref_Nm = 2.5f};
    TEST_ASSERT_EQUAL(FIELDBUS_OK, fieldbus_ask(&fb, unit(), &demand));
    const unit_command_t posted = fieldbus_command(&fb, unit());
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_CMD_TORQUE_MODE, posted.command);
    TEST_ASSERT_EQUAL_FLOAT(2.5f, posted.torque_ref_Nm);
    TEST_ASSERT_EQUAL_UINT32(2u, posted.count);
}

static void test_run_has_to_be_low_once_after_power_up(void)
{
    TEST_ASSERT_EQUAL(FIELDBUS_NOT_ARMED, ask(SEQUENCE_CMD_RUN, 6.0f));
    rounds(2u);
    TEST_ASSERT_EQUAL(SEQUENCE_READY, unit()->machine.id);
    TEST_ASSERT_EQUAL_UINT32(0u, fb.commands);
    run(6.0f);
}

static void test_silence_ends_run_within_the_set_time(void)
{
    run(6.0f);
    rounds(501u); /* 500 periods and the one in which it came */
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_CMD_RUN, unit()->command.command);
    TEST_ASSERT_FALSE(fb.expired);
    rounds(2u);
    TEST_ASSERT_EQUAL_UINT32(0u, unit()->command.command);
    TEST_ASSERT_TRUE(fb.expired);
    TEST_ASSERT_EQUAL(FIELDBUS_NOT_ARMED, ask(SEQUENCE_CMD_RUN, 6.0f));
    TEST_ASSERT_TRUE(fb.expired);
    run(6.0f);
    TEST_ASSERT_FALSE(fb.expired);
}

static void test_each_command_renews_the_time(void)
{
    run(6.0f);
    for (uint32_t k = 0u; k < 4u; k++) {
        rounds(400u);
        TEST_ASSERT_EQUAL(FIELDBUS_OK, ask(SEQUENCE_CMD_RUN, 6.0f));
    }
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_CMD_RUN, unit()->command.command);
}

static void test_silence_without_run_changes_nothing(void)
{
    TEST_ASSERT_EQUAL(FIELDBUS_OK, ask(SEQUENCE_CMD_TORQUE_OFF, 0.0f));
    rounds(2000u);
    TEST_ASSERT_FALSE(fb.expired);
    TEST_ASSERT_TRUE(fb.armed);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_CMD_TORQUE_OFF, unit()->command.command);
}

static void test_a_disabled_bus_is_refused_and_forgotten(void)
{
    run(6.0f);
    unit()->params.fieldbus_commands = 0u;
    TEST_ASSERT_EQUAL(FIELDBUS_DISABLED, ask(0u, 0.0f));
    const unit_command_t posted = fieldbus_command(&fb, unit());
    TEST_ASSERT_EQUAL_UINT32(0u, posted.command);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, posted.omega_m_ref_rad_s);
    unit()->params.fieldbus_commands = 1u;
    TEST_ASSERT_EQUAL_UINT32(0u, fieldbus_command(&fb, unit()).command);
    TEST_ASSERT_EQUAL(FIELDBUS_NOT_ARMED, ask(SEQUENCE_CMD_RUN, 6.0f));
}

static void test_while_the_host_runs_the_drive_the_bus_is_refused(void)
{
    TEST_ASSERT_EQUAL(FIELDBUS_OK, ask(0u, 3.0f));
    host_commands(SEQUENCE_CMD_RUN);
    unit()->link.omega_m_ref_rad_s = 7.0f;
    TEST_ASSERT_EQUAL(FIELDBUS_TAKEN, ask(0u, 5.0f));
    const unit_command_t posted = fieldbus_command(&fb, unit());
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_CMD_RUN, posted.command);
    TEST_ASSERT_EQUAL_FLOAT(7.0f, posted.omega_m_ref_rad_s);
    host_commands(SEQUENCE_CMD_COMMISSION);
    TEST_ASSERT_EQUAL(FIELDBUS_TAKEN, ask(0u, 5.0f));
    host_commands(0u);
    TEST_ASSERT_EQUAL(FIELDBUS_OK, ask(0u, 5.0f));
}

static void test_a_stop_by_the_host_holds_against_a_standing_run(void)
{
    run(6.0f);
    rounds(3u);
    host_commands(0u);
    rounds(1u);
    TEST_ASSERT_EQUAL_UINT32(0u, unit()->command.command);
    TEST_ASSERT_EQUAL(FIELDBUS_NOT_ARMED, ask(SEQUENCE_CMD_RUN, 6.0f));
    TEST_ASSERT_FALSE(fb.expired);
    run(6.0f);
}

static void test_torque_off_of_the_host_is_added(void)
{
    host_commands(SEQUENCE_CMD_TORQUE_OFF);
    rounds(1u);
    run(6.0f);
    rounds(1u);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_CMD_TORQUE_OFF | SEQUENCE_CMD_RUN, unit()->command.command);
}

static void test_a_reset_is_a_pulse_on_the_rising_edge(void)
{
    TEST_ASSERT_EQUAL(FIELDBUS_OK, ask(SEQUENCE_CMD_FAULT_RESET, 0.0f));
    uint32_t seen = 0u;
    for (uint32_t k = 0u; k < 8u; k++) {
        rounds(1u);
        seen += ((unit()->command.command & SEQUENCE_CMD_FAULT_RESET) != 0u) ? 1u : 0u;
    }
    TEST_ASSERT_EQUAL_UINT32(3u, seen);
    TEST_ASSERT_EQUAL(FIELDBUS_OK, ask(SEQUENCE_CMD_FAULT_RESET, 0.0f));
    rounds(1u);
    TEST_ASSERT_EQUAL_UINT32(0u, unit()->command.command);
    TEST_ASSERT_EQUAL(FIELDBUS_OK, ask(0u, 0.0f));
    TEST_ASSERT_EQUAL(FIELDBUS_OK, ask(SEQUENCE_CMD_FAULT_RESET, 0.0f));
    TEST_ASSERT_EQUAL(FIELDBUS_OK, ask(0u, 0.0f)); /* short, and still seen */
    rounds(1u);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_CMD_FAULT_RESET, unit()->command.command);
}

static void test_a_reset_that_was_withdrawn_does_not_come_later(void)
{
    TEST_ASSERT_EQUAL(FIELDBUS_OK, ask(SEQUENCE_CMD_FAULT_RESET, 0.0f));
    host_commands(0u);
    rounds(2u);
    TEST_ASSERT_EQUAL_UINT32(0u, unit()->command.command);
}

static void test_what_is_out_of_range_changes_nothing(void)
{
    TEST_ASSERT_EQUAL(FIELDBUS_OK, ask(0u, 1.0f));
    const float most_rad_s = unit()->params.speed_max_rad_s / unit()->params.pole_pairs;
    TEST_ASSERT_EQUAL(FIELDBUS_OK, ask(0u, most_rad_s));
    TEST_ASSERT_EQUAL(FIELDBUS_OK, ask(0u, -most_rad_s));
    TEST_ASSERT_EQUAL(FIELDBUS_OUT_OF_RANGE, ask(0u, 1.001f * most_rad_s));
    TEST_ASSERT_EQUAL(FIELDBUS_OUT_OF_RANGE, ask(0u, -1.001f * most_rad_s));
    TEST_ASSERT_EQUAL(FIELDBUS_OUT_OF_RANGE, ask(0u, NAN));
    TEST_ASSERT_EQUAL(FIELDBUS_OUT_OF_RANGE, ask(SEQUENCE_CMD_COMMISSION, 0.0f));
    const fieldbus_demand_t torque = {.torque_ref_Nm = INFINITY};
    TEST_ASSERT_EQUAL(FIELDBUS_OUT_OF_RANGE, fieldbus_ask(&fb, unit(), &torque));
    TEST_ASSERT_EQUAL_FLOAT(-most_rad_s, fb.demand.omega_m_ref_rad_s);
    TEST_ASSERT_EQUAL_UINT32(3u, fb.commands);
}

static void test_status_and_values_are_the_drives(void)
{
    fieldbus_actual_t a;
    fieldbus_actual(&fb, unit(), &a);
    TEST_ASSERT_EQUAL_HEX32(FIELDBUS_READY | FIELDBUS_REMOTE, a.status);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_READY, a.state);
    run(6.0f);
    rounds(3u);
    unit()->drive.estimator.estimate.lambda_r_hat_Wb = (ab_t){0.5f, 0.0f};
    unit()->drive.estimator.estimate.omega_e_rad_s = 4.0f * NUM_PI;
    unit()->last.meas.i_s_A = (ab_t){3.0f, 4.0f};
    unit()->last.meas.u_dc_V = 281.0f;
    fieldbus_actual(&fb, unit(), &a);
    TEST_ASSERT_EQUAL_HEX32(FIELDBUS_GATES | FIELDBUS_REMOTE | FIELDBUS_ARMED, a.status);
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, 60.0f, a.speed_rpm);
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 2.0f * 0.5f * 4.0f, a.torque_Nm); /* Table 1: M = Lr */
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 5.0f / sqrtf(3.0f), a.current_A);
    TEST_ASSERT_EQUAL_FLOAT(281.0f, a.u_dc_V);
    unit()->params.M_H = 0.5f * unit()->params.Lr_H;
    unit()->params.pole_pairs = 3.0f;
    fieldbus_actual(&fb, unit(), &a);
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 3.0f * 0.5f * 0.5f * 4.0f, a.torque_Nm);
}

static void test_faults_warnings_and_an_unknown_speed_show(void)
{
    fieldbus_actual_t a;
    unit()->machine.id = SEQUENCE_RUN;
    unit()->machine.faults = FAULT_PERIOD_LATE;
    unit()->drive.guard.speed.speed_unknown = true;
    fb.expired = true;
    unit()->params.fieldbus_commands = 0u;
    fieldbus_actual(&fb, unit(), &a);
    TEST_ASSERT_EQUAL_HEX32(FIELDBUS_RUNS | FIELDBUS_WARNING | FIELDBUS_EXPIRED | FIELDBUS_UNKNOWN,
                            a.status);
    TEST_ASSERT_TRUE(isnan(a.speed_rpm));
    unit()->machine.id = SEQUENCE_FAULT;
    unit()->machine.faults = FAULT_STALL;
    fieldbus_actual(&fb, unit(), &a);
    TEST_ASSERT_EQUAL_HEX32(FIELDBUS_FAULT | FIELDBUS_EXPIRED | FIELDBUS_UNKNOWN, a.status);
    TEST_ASSERT_EQUAL_HEX32(FAULT_STALL, a.faults);
}

static void test_speeds_are_converted_at_the_edge(void)
{
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 2.0f * NUM_PI, fieldbus_rad_s_from_rpm(60.0f));
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, 60.0f, fieldbus_rpm_from_rad_s(2.0f * NUM_PI));
}

static void test_parameters_are_counted_in_their_group(void)
{
    TEST_ASSERT_EQUAL_size_t(0u, fieldbus_param_at(0u, 0u));
    TEST_ASSERT_EQUAL_size_t(params_find("period_s"), fieldbus_param_at(PARAM_GROUP_BOARD, 0u));
    TEST_ASSERT_EQUAL_size_t(params_find("swap_vw"), fieldbus_param_at(PARAM_GROUP_BOARD, 5u));
    TEST_ASSERT_EQUAL_size_t(params_count(), fieldbus_param_at(PARAM_GROUP_BOARD, 7u));
    TEST_ASSERT_EQUAL_size_t(params_count(), fieldbus_param_at(PARAM_GROUPS, 0u));
}

static float value_of(const char *name)
{
    return params_get(&unit()->params, params_find(name));
}

static void test_bits_of_a_parameter_are_those_of_its_type(void)
{
    TEST_ASSERT_EQUAL_HEX32(float_bits(unit()->params.Rs_ohm),
                            fieldbus_param_bits(unit(), params_find("Rs_ohm")));
    TEST_ASSERT_EQUAL_UINT32(14u, fieldbus_param_bits(unit(), params_find("adc_bits")));
}

static unit_link_status_t set(const char *name, uint32_t bits)
{
    return fieldbus_param_set(unit(), params_find(name), bits);
}

static void test_a_writable_parameter_is_set_as_by_the_host(void)
{
    TEST_ASSERT_EQUAL(UNIT_LINK_OK, set("premagnetise_s", float_bits(0.625f)));
    TEST_ASSERT_EQUAL_FLOAT(0.625f, value_of("premagnetise_s"));
    TEST_ASSERT_EQUAL_UINT32(params_find("premagnetise_s"), unit()->flight.changed);
    TEST_ASSERT_EQUAL(UNIT_LINK_OK, set("rs_measure", 1u));
    TEST_ASSERT_EQUAL_FLOAT(1.0f, value_of("rs_measure"));
    TEST_ASSERT_EQUAL(UNIT_LINK_NOT_FINITE, set("premagnetise_s", float_bits(NAN)));
    TEST_ASSERT_EQUAL(UNIT_LINK_OUT_OF_RANGE, set("rs_measure", 2u));
    TEST_ASSERT_EQUAL_FLOAT(0.625f, value_of("premagnetise_s"));
    TEST_ASSERT_EQUAL_FLOAT(1.0f, value_of("rs_measure"));
}

static void test_a_rule_between_parameters_holds_on_the_bus(void)
{
    const float before = value_of("economy_flux_min");
    TEST_ASSERT_EQUAL(UNIT_LINK_REFUSED, set("economy_flux_min", float_bits(0.05f)));
    TEST_ASSERT_EQUAL_FLOAT(before, value_of("economy_flux_min"));
}

static void test_every_other_parameter_is_read_only(void)
{
    size_t writable = 0u;
    for (size_t i = 0u; i < params_count(); i++) {
        if (fieldbus_param_writable(i)) {
            writable++;
            TEST_ASSERT_TRUE(params_info(i)->access != PARAM_ACCESS_PROTECTED);
            continue;
        }
        const float before = params_get(&unit()->params, i);
        TEST_ASSERT_EQUAL_MESSAGE(UNIT_LINK_PROTECTED, fieldbus_param_set(unit(), i, 1u),
                                  params_name(i));
        TEST_ASSERT_EQUAL_FLOAT(before, params_get(&unit()->params, i));
    }
    TEST_ASSERT_EQUAL_size_t(7u, writable);
}

static void test_parameters_need_leave_and_rest(void)
{
    unit()->params.fieldbus_commands = 0u;
    TEST_ASSERT_EQUAL(UNIT_LINK_NOT_NOW, set("rs_measure", 1u));
    unit()->params.fieldbus_commands = 1u;
    host_commands(SEQUENCE_CMD_RUN);
    TEST_ASSERT_EQUAL(UNIT_LINK_NOT_NOW, set("rs_measure", 1u));
    host_commands(0u);
    rounds(1u);
    run(1.0f);
    rounds(2u);
    TEST_ASSERT_EQUAL(UNIT_LINK_NOT_NOW, set("rs_measure", 1u));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, value_of("rs_measure"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_run_starts_the_drive_with_the_reference);
    RUN_TEST(test_torque_and_its_reference_are_posted);
    RUN_TEST(test_run_has_to_be_low_once_after_power_up);
    RUN_TEST(test_silence_ends_run_within_the_set_time);
    RUN_TEST(test_each_command_renews_the_time);
    RUN_TEST(test_silence_without_run_changes_nothing);
    RUN_TEST(test_a_disabled_bus_is_refused_and_forgotten);
    RUN_TEST(test_while_the_host_runs_the_drive_the_bus_is_refused);
    RUN_TEST(test_a_stop_by_the_host_holds_against_a_standing_run);
    RUN_TEST(test_torque_off_of_the_host_is_added);
    RUN_TEST(test_a_reset_is_a_pulse_on_the_rising_edge);
    RUN_TEST(test_a_reset_that_was_withdrawn_does_not_come_later);
    RUN_TEST(test_what_is_out_of_range_changes_nothing);
    RUN_TEST(test_status_and_values_are_the_drives);
    RUN_TEST(test_faults_warnings_and_an_unknown_speed_show);
    RUN_TEST(test_speeds_are_converted_at_the_edge);
    RUN_TEST(test_parameters_are_counted_in_their_group);
    RUN_TEST(test_bits_of_a_parameter_are_those_of_its_type);
    RUN_TEST(test_a_writable_parameter_is_set_as_by_the_host);
    RUN_TEST(test_a_rule_between_parameters_holds_on_the_bus);
    RUN_TEST(test_every_other_parameter_is_read_only);
    RUN_TEST(test_parameters_need_leave_and_rest);
    return UNITY_END();
}
