/* What the terminals' parameters make, what they need of the board, and what is refused. */
#include "terminal_fixture.h"

void setUp(void)
{
    start_board();
}
void tearDown(void)
{
}

static terminals_status_t init(void)
{
    return terminals_init(&cfg, &params, &hal, &drive);
}

static void test_each_feature_needs_its_terminals(void)
{
    params.brake_torque_Nm = 5.0f;
    params.precharge_ready_V = 100.0f;
    params.chopper_W = 100.0f;
    const terminal_params_t off = params;
    const struct {
        const char *name;
        uint32_t value;
        uint32_t terminals;
    } rows[] = {
        {"start_control", CONTACTS_TWO_WIRE, HAL_TERMINAL_START},
        {"start_control", CONTACTS_THREE_WIRE, HAL_TERMINAL_START | HAL_TERMINAL_STOP},
        {"analog_reference", ANALOG_REFERENCE_CURRENT, HAL_TERMINAL_ANALOG},
        {"brake_control", 1u, HAL_TERMINAL_BRAKE_RELEASE},
        {"brake_feedback", 1u, HAL_TERMINAL_BRAKE_RELEASED},
        {"sink_sensor", TEMPERATURE_NTC, HAL_TERMINAL_SINK_SENSOR},
        {"motor_sensor", TEMPERATURE_PT1000, HAL_TERMINAL_MOTOR_SENSOR},
        {"precharge", 1u, HAL_TERMINAL_CONTACTOR},
        {"contactor_feedback", 1u, HAL_TERMINAL_CONTACTOR_ON},
        {"chopper_ohm", 10u, HAL_TERMINAL_CHOPPER},
        {"chopper_feedback", 1u, HAL_TERMINAL_CHOPPER_LEADS},
    };
    hal.fitted = 0u;
    TEST_ASSERT_EQUAL(TERMINALS_OK, init());
    for (uint32_t k = 0u; k < sizeof rows / sizeof rows[0]; k++) {
        params = off;
        const uint32_t index = terminal_params_find(rows[k].name);
        TEST_ASSERT_TRUE(terminal_params_set(&params, index, (float)rows[k].value));
        hal.fitted = ~rows[k].terminals;
        TEST_ASSERT_EQUAL(TERMINALS_NOT_FITTED, init());
        hal.fitted = rows[k].terminals;
        TEST_ASSERT_EQUAL(TERMINALS_OK, init());
        for (uint32_t bit = 0u; bit < 32u; bit++) {
            hal.fitted = rows[k].terminals & ~(1u << bit);
            const bool all = hal.fitted == rows[k].terminals;
            TEST_ASSERT_EQUAL(all ? TERMINALS_OK : TERMINALS_NOT_FITTED, init());
        }
    }
}

static void test_each_part_that_refuses_is_named(void)
{
    const struct {
        const char *name;
        float value;
        terminals_status_t status;
    } rows[] = {{"full_speed_rad_s", 0.0f, TERMINALS_CONTACTS},
                {"full_speed_rad_s", 1e4f, TERMINALS_CONTACTS},
                {"brake_torque_Nm", 0.0f, TERMINALS_BRAKE},
                {"sink_trip_degC", 20.0f, TERMINALS_SENSOR},
                {"motor_trip_degC", 20.0f, TERMINALS_SENSOR},
                {"precharge_ready_V", 0.0f, TERMINALS_PRECHARGE},
                {"chopper_W", 0.0f, TERMINALS_CHOPPER}};
    params.start_control = CONTACTS_TWO_WIRE;
    params.analog_reference = ANALOG_REFERENCE_CURRENT;
    params.brake_control = 1u;
    params.brake_torque_Nm = 5.0f;
    params.sink_sensor = TEMPERATURE_KTY84;
    params.motor_sensor = TEMPERATURE_KTY84;
    params.precharge = 1u;
    params.precharge_ready_V = 100.0f;
    params.chopper_ohm = 40.0f;
    params.chopper_W = 100.0f;
    TEST_ASSERT_EQUAL(TERMINALS_OK, init());
    const terminal_params_t good = params;
    for (uint32_t k = 0u; k < sizeof rows / sizeof rows[0]; k++) {
        const uint32_t index = terminal_params_find(rows[k].name);
        TEST_ASSERT_TRUE(terminal_params_set(&params, index, rows[k].value));
        TEST_ASSERT_EQUAL(rows[k].status, init());
        params = good;
    }
    hal.analog_full_scale = 20e-3f;
    TEST_ASSERT_EQUAL(TERMINALS_ANALOG, init());
    hal.analog_full_scale = 25e-3f;
    hal.sink_pullup_ohm = 0.0f;
    TEST_ASSERT_EQUAL(TERMINALS_SENSOR, init());
    hal.sink_pullup_ohm = 1.0f;
    hal.motor_pullup_ohm = 0.0f;
    TEST_ASSERT_EQUAL(TERMINALS_SENSOR, init());
}

static void test_without_start_by_contacts_no_speed_is_needed(void)
{
    params.full_speed_rad_s = 0.0f;
    TEST_ASSERT_EQUAL(TERMINALS_OK, init());
    params.start_control = 7u;
    params.full_speed_rad_s = 10.0f;
    TEST_ASSERT_EQUAL(TERMINALS_CONTACTS, init());
}

static void test_the_full_speed_may_be_the_drives_largest(void)
{
    drive.speed_max_rad_s = 100.0f;
    drive.pole_pairs = 4.0f;
    params.full_speed_rad_s = 25.0f;
    TEST_ASSERT_EQUAL(TERMINALS_OK, init());
    TEST_ASSERT_EQUAL_FLOAT(25.0f, cfg.full_speed_rad_s);
    params.full_speed_rad_s = 25.1f;
    TEST_ASSERT_EQUAL(TERMINALS_CONTACTS, init());
}

static void test_a_step_is_a_millisecond_and_two_periods_at_least(void)
{
    const struct {
        float period_s;
        uint32_t periods;
        uint32_t ns;
        uint32_t most;
    } rows[] = {{200e-6f, 5u, 200000u, 20000u},  {100e-6f, 10u, 100000u, 40000u},
                {62.5e-6f, 16u, 62500u, 64000u}, {360e-6f, 3u, 360000u, 11111u},
                {300e-6f, 4u, 300000u, 13333u},  {1e-3f, 2u, 1000000u, 4000u},
                {2e-3f, 2u, 2000000u, 2000u},    {0.0f, 1000u, 1000u, 4000000u},
                {1e9f, 2u, 100000000u, 40u}};
    for (uint32_t k = 0u; k < sizeof rows / sizeof rows[0]; k++) {
        drive.period_s = rows[k].period_s;
        TEST_ASSERT_EQUAL(TERMINALS_OK, init());
        TEST_ASSERT_EQUAL_UINT32(rows[k].periods, cfg.step_periods);
        TEST_ASSERT_EQUAL_UINT32(rows[k].ns, cfg.period_ns);
        TEST_ASSERT_EQUAL_UINT32(rows[k].most, cfg.most_periods);
    }
}

static void test_times_are_steps(void)
{
    params.contact_debounce_s = 0.0116f;
    params.analog_lost_s = 0.2f;
    params.brake_prove_s = 0.9f;
    params.brake_release_s = 0.25f;
    params.brake_close_s = 0.35f;
    params.brake_stop_s = 4.0f;
    params.sensor_lost_s = 0.6f;
    params.precharge_s = 3.0f;
    params.contactor_s = 0.15f;
    TEST_ASSERT_EQUAL(TERMINALS_OK, init());
    TEST_ASSERT_EQUAL_UINT32(12u, cfg.contacts.debounce_steps);
    TEST_ASSERT_EQUAL_UINT32(200u, cfg.analog.lost_steps);
    TEST_ASSERT_EQUAL_UINT32(900u, cfg.brake.prove_steps);
    TEST_ASSERT_EQUAL_UINT32(250u, cfg.brake.release_steps);
    TEST_ASSERT_EQUAL_UINT32(350u, cfg.brake.close_steps);
    TEST_ASSERT_EQUAL_UINT32(4000u, cfg.brake.stop_steps);
    TEST_ASSERT_EQUAL_UINT32(600u, cfg.sink.lost_steps);
    TEST_ASSERT_EQUAL_UINT32(600u, cfg.motor.lost_steps);
    TEST_ASSERT_EQUAL_UINT32(3000u, cfg.precharge.charge_steps);
    TEST_ASSERT_EQUAL_UINT32(150u, cfg.precharge.contactor_steps);
    params.contact_debounce_s = 0.0001f;
    TEST_ASSERT_EQUAL(TERMINALS_OK, init());
    TEST_ASSERT_EQUAL_UINT32(1u, cfg.contacts.debounce_steps);
}

static void test_every_number_goes_where_it_belongs(void)
{
    params.start_control = CONTACTS_THREE_WIRE;
    params.analog_reference = ANALOG_REFERENCE_CURRENT;
    params.analog_filter_s = 3e-3f;
    params.analog_lost_action = 1u;
    params.brake_control = 1u;
    params.brake_feedback = 1u;
    params.brake_torque_Nm = 7.0f;
    params.brake_close_rad_s = 3.0f;
    params.sink_sensor = TEMPERATURE_NTC;
    params.motor_sensor = TEMPERATURE_PT1000;
    params.motor_Rs_degC = 25.0f;
    params.precharge = 1u;
    params.precharge_ready_V = 250.0f;
    params.contactor_feedback = 1u;
    params.chopper_ohm = 20.0f;
    params.chopper_W = 50.0f;
    params.chopper_s = 10.0f;
    params.chopper_feedback = 1u;
    hal.sink_pullup_ohm = 1000.0f;
    hal.motor_pullup_ohm = 3000.0f;
    TEST_ASSERT_EQUAL(TERMINALS_OK, init());
    TEST_ASSERT_EQUAL(CONTACTS_THREE_WIRE, cfg.contacts.control);
    TEST_ASSERT_EQUAL_FLOAT(50.0f, cfg.full_speed_rad_s);
    TEST_ASSERT_TRUE(cfg.analog.on && cfg.hold);
    TEST_ASSERT_EQUAL_FLOAT(3e-3f, cfg.analog.filter_s);
    TEST_ASSERT_EQUAL_FLOAT(0.01f, cfg.analog.dead_pu);
    TEST_ASSERT_TRUE(cfg.brake.on && cfg.brake.feedback);
    TEST_ASSERT_EQUAL_FLOAT(7.0f, cfg.brake.torque_Nm);
    TEST_ASSERT_EQUAL_FLOAT(3.0f, cfg.brake.close_rad_s);
    TEST_ASSERT_EQUAL_UINT32(TEMPERATURE_NTC, cfg.sink.kind);
    TEST_ASSERT_EQUAL_FLOAT(10e3f, cfg.sink.ntc_ohm);
    TEST_ASSERT_EQUAL_FLOAT(3435.0f, cfg.sink.ntc_beta_K);
    TEST_ASSERT_EQUAL_FLOAT(75.0f, cfg.sink.derate_degC);
    TEST_ASSERT_EQUAL_FLOAT(90.0f, cfg.sink.trip_degC);
    TEST_ASSERT_EQUAL_FLOAT(1000.0f, cfg.sink.pullup_ohm);
    TEST_ASSERT_EQUAL_UINT32(TEMPERATURE_PT1000, cfg.motor.kind);
    TEST_ASSERT_EQUAL_FLOAT(120.0f, cfg.motor.derate_degC);
    TEST_ASSERT_EQUAL_FLOAT(150.0f, cfg.motor.trip_degC);
    TEST_ASSERT_EQUAL_FLOAT(3000.0f, cfg.motor.pullup_ohm);
    TEST_ASSERT_EQUAL_FLOAT(25.0f, cfg.motor_Rs_degC);
    TEST_ASSERT_TRUE(cfg.precharge.on && cfg.precharge.feedback);
    TEST_ASSERT_EQUAL_FLOAT(250.0f, cfg.precharge.ready_V);
    TEST_ASSERT_TRUE(cfg.chopper.on && cfg.chopper.feedback);
    TEST_ASSERT_EQUAL_FLOAT(1e-3f, cfg.chopper.per_V2);
    TEST_ASSERT_FLOAT_WITHIN(1e-9f, 1e-4f, cfg.chopper.fade);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_each_feature_needs_its_terminals);
    RUN_TEST(test_each_part_that_refuses_is_named);
    RUN_TEST(test_without_start_by_contacts_no_speed_is_needed);
    RUN_TEST(test_the_full_speed_may_be_the_drives_largest);
    RUN_TEST(test_a_step_is_a_millisecond_and_two_periods_at_least);
    RUN_TEST(test_times_are_steps);
    RUN_TEST(test_every_number_goes_where_it_belongs);
    return UNITY_END();
}
