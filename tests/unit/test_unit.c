/* One drive as an object: refused configurations stay off, commands arrive, a lost bit is found. */
#include "unit.h"

#include <math.h>
#include <string.h>

#include "crc32c.h"
#include "unit_config.h"
#include "unit_signal.h"
#include "unit_record.h"
#include "unity.h"

static observer_gain_t entries[100];
static gain_table_t table;
static params_t params;
static unit_t unit;
static uint32_t served;
static float steer_share; /* of the torque, found with one pole pair */
static int flicker;

static void serve(void *context)
{
    (*(uint32_t *)context)++;
}

void setUp(void)
{
    for (int k = 0; k < 100; k++) {
        entries[k] = (observer_gain_t){-300.0f, (float)k, 0.5f, -0.01f * (float)k};
    }
    table = (gain_table_t){.magic = GAIN_TABLE_MAGIC,
                           .version = GAIN_TABLE_VERSION,
                           .motor_id = 1u,
                           .entry_count = 100u,
                           .step_rad_s = 0.20943951f,
                           .entry = entries};
    table.crc32c = crc32c(entries, sizeof(entries));
    params_default(&params);
    params.offset_calibration_s = 0.01f;
    params.premagnetise_s = 0.02f;
    served = 0u;
}

void tearDown(void)
{
}

/* 283 V, no voltages; with the gates on the magnetising current along u. The last bit of a word
 * flickers, as words do. */
static hal_sample_t rest(void)
{
    const bool on = unit.asked.mode != DRIVE_OFF;
    const int i_u_counts = on ? (int)lrintf(NUM_SQRT_2_3 * params.i_d_A / 25.0f * 8192.0f) : 0;
    flicker ^= 1;
    return (hal_sample_t){(uint16_t)(8192 + i_u_counts + flicker),
                          (uint16_t)(8192 - i_u_counts / 2),
                          (uint16_t)(8192 - i_u_counts / 2),
                          8192u,
                          8192u,
                          11592u,
                          0u,
                          0u};
}

static hal_output_t periods(uint32_t command, float omega_m_rad_s, int n)
{
    hal_output_t out = {0};
    const unit_command_t c = {.command = command, .omega_m_ref_rad_s = omega_m_rad_s};
    for (int k = 0; k < n; k++) {
        const hal_sample_t sample = rest();
        unit_post_command(&unit, &c);
        unit_control_period(&unit, &sample, &out);
    }
    return out;
}

static unit_telemetry_t telemetry(void)
{
    unit_telemetry_t t;
    unit_telemetry(&unit, &t);
    return t;
}

static void test_starts_from_boot_to_run_by_itself(void)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    TEST_ASSERT_FALSE(periods(0u, 0.0f, 60).gates_on);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_READY, telemetry().state);
    TEST_ASSERT_TRUE(periods(SEQUENCE_CMD_RUN, 0.0f, 1).gates_on);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_PREMAGNETISE, telemetry().state);
    const hal_output_t out = periods(SEQUENCE_CMD_RUN, 0.0f, 1);
    TEST_ASSERT_TRUE(out.duty_u > 0.5f); /* d axis along alpha: current builds up in phase u */
    TEST_ASSERT_TRUE(out.duty_v < 0.5f);
    TEST_ASSERT_EQUAL_FLOAT(out.duty_v, out.duty_w);
    (void)periods(SEQUENCE_CMD_RUN, 0.0f, 120);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_RUN, telemetry().state);
    TEST_ASSERT_EQUAL_UINT32(0u, telemetry().faults);
}

static void test_speed_reference_is_mechanical(void)
{
    params.speed_slew_rad_s2 = 1e9f;
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    (void)periods(0u, 0.0f, 60);
    (void)periods(SEQUENCE_CMD_RUN, 10.0f, 110);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_RUN, telemetry().state);
    TEST_ASSERT_EQUAL_FLOAT(20.0f,
                            unit.drive.modes.vector.speed.omega_ref_rad_s); /* 2 pole pairs */
}

static void test_the_pole_pairs_are_those_of_the_parameters(void)
{
    params.speed_slew_rad_s2 = 1e9f;
    for (uint32_t p = 1u; p <= 4u; p++) {
        const float pairs = (float)p;
        params.pole_pairs = pairs;
        TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
        (void)periods(0u, 0.0f, 60);
        (void)periods(SEQUENCE_CMD_RUN, 10.0f, 110);
        TEST_ASSERT_EQUAL_FLOAT(10.0f * pairs, unit.drive.modes.vector.speed.omega_ref_rad_s);
        unit.drive.estimator.estimate.omega_e_rad_s = 20.0f;
        unit.drive.supervisor.omega_bound_rad_s = 6.0f;
        TEST_ASSERT_EQUAL_FLOAT(20.0f / pairs, telemetry().omega_m_hat_rad_s);
        TEST_ASSERT_EQUAL_FLOAT(6.0f / pairs, telemetry().omega_m_bound_rad_s);
        TEST_ASSERT_EQUAL_FLOAT(pairs, unit_config(&unit)->drive.motor.pole_pairs);
        drive_params_t drive;
        unit_config_drive(&drive, &params);
        TEST_ASSERT_EQUAL_FLOAT(pairs, drive.motor.pole_pairs);
        /* Steering acts from a share of the torque that i_q_max_A gives at nominal flux. */
        const float rated_Nm =
            pairs * params.M_H / params.Lr_H * params.M_H * params.i_d_A * params.i_q_max_A;
        if (p == 1u) {
            steer_share = drive.steering.torque_min_Nm / rated_Nm;
        }
        TEST_ASSERT_FLOAT_WITHIN(1e-6f, steer_share, drive.steering.torque_min_Nm / rated_Nm);
    }
}

/* A commissioning that comes after another begins with nothing found. */
static void test_a_commissioning_begins_anew(void)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    (void)periods(0u, 0.0f, 60);
    unit.commissioning.stage = COMMISSIONING_STAGE_END;
    unit.commissioning.result.Rs_ohm = 9.0f;
    unit.commissioned.status = COMMISSIONING_DONE;
    unit.asked.i_d_ref_A = 5.0f;
    (void)periods(SEQUENCE_CMD_COMMISSION, 0.0f, 1);
    TEST_ASSERT_EQUAL(DRIVE_COMMISSION, unit.asked.mode);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, unit.asked.i_d_ref_A);
    TEST_ASSERT_EQUAL(COMMISSIONING_BUSY, unit.commissioned.status);
    (void)periods(SEQUENCE_CMD_COMMISSION, 0.0f, 1);
    TEST_ASSERT_NOT_EQUAL(COMMISSIONING_STAGE_END, unit.commissioning.stage);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, unit.commissioning.result.Rs_ohm);
    TEST_ASSERT_EQUAL(COMMISSIONING_BUSY, unit.commissioned.status);
    for (int k = 0; (k < 100) && !(unit.commissioned.i_ref_A > 0.0f); k++) {
        (void)periods(SEQUENCE_CMD_COMMISSION, 0.0f, 1);
    }
    TEST_ASSERT_TRUE(unit.asked.i_d_ref_A > 0.0f); /* the drive is asked for its current */
    TEST_ASSERT_EQUAL_FLOAT(unit.commissioned.i_ref_A, unit.asked.i_d_ref_A);
}

/* To RUN, with the number of a command that stands from then on. */
static void run_up(float omega_m_rad_s)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    (void)periods(0u, 0.0f, 60);
    (void)periods(SEQUENCE_CMD_RUN, omega_m_rad_s, 110);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_RUN, telemetry().state);
}

static void test_silence_is_counted_with_the_gates_on_only(void)
{
    params.command_timeout_s = 0.1f; /* 500 periods */
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    (void)periods(0u, 0.0f, 2000);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_READY, telemetry().state);
    (void)periods(SEQUENCE_CMD_RUN, 0.0f, 500);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_RUN, telemetry().state);
    (void)periods(SEQUENCE_CMD_RUN, 0.0f, 2 * (int)SLOT_COUNT);
    TEST_ASSERT_EQUAL_HEX32(FAULT_COMMAND_TIMEOUT, telemetry().faults);
    /* Standing already: nothing to bring down. */
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_FAULT, telemetry().state);
    (void)periods(SEQUENCE_CMD_FAULT_RESET, 0.0f, 60);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_READY, telemetry().state);
}

/* The least that is watched; 0 is not. */
static void test_a_silence_of_one_period_is_watched_and_of_none_is_not(void)
{
    for (uint32_t watched = 0u; watched < 2u; watched++) {
        params.command_timeout_s = (float)watched * params.period_s;
        TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
        (void)periods(0u, 0.0f, 60);
        (void)periods(SEQUENCE_CMD_RUN, 0.0f, 3 * (int)SLOT_COUNT);
        TEST_ASSERT_EQUAL_HEX32((watched != 0u) ? FAULT_COMMAND_TIMEOUT : 0u, telemetry().faults);
    }
}

static void test_a_timeout_is_rounded_to_whole_periods(void)
{
    params.command_timeout_s = 0.10015f; /* 500.75 of .0002 s */
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    TEST_ASSERT_EQUAL_UINT32(501u, unit_config(&unit)->command_timeout_periods);
}

static void test_a_command_that_counts_keeps_the_drive_running(void)
{
    params.command_timeout_s = 0.1f;
    run_up(0.0f);
    hal_output_t out = {0};
    for (uint32_t k = 0u; k < 3000u; k++) {
        const hal_sample_t sample = rest();
        const unit_command_t c = {.command = SEQUENCE_CMD_RUN, .count = 1u + k / 400u};
        unit_post_command(&unit, &c);
        unit_control_period(&unit, &sample, &out);
    }
    TEST_ASSERT_TRUE(out.gates_on);
    TEST_ASSERT_EQUAL_HEX32(0u, telemetry().faults);
}

static void test_a_direction_forbidden_makes_zero_of_the_reference(void)
{
    const float given[4][2] = {{10.0f, 10.0f}, {-10.0f, 0.0f}, {0.0f, 0.0f}, {0.5f, 0.5f}};
    for (uint32_t direction = 1u; direction <= 2u; direction++) {
        const float way = (direction == 1u) ? 1.0f : -1.0f;
        for (int n = 0; n < 4; n++) {
            params.direction = direction;
            run_up(way * given[n][0]);
            TEST_ASSERT_EQUAL_FLOAT(2.0f * way * given[n][1],
                                    unit.drive.modes.vector.speed.omega_ref_rad_s);
        }
    }
}

static void test_a_stop_ramp_ignores_the_reference(void)
{
    params.stop_mode = 1u;
    params.ramp_down_rad_s2 = 100.0f; /* .08 rad/s in four periods */
    run_up(10.0f);
    TEST_ASSERT_EQUAL_FLOAT(6.0f, unit_config(&unit)->stop_speed_rad_s);
    (void)periods(0u, 10.0f, 1);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_RAMP_DOWN, telemetry().state);
    TEST_ASSERT_EQUAL_FLOAT(20.0f, unit.drive.modes.vector.speed.omega_ref_rad_s);
    (void)periods(0u, 10.0f, 48);
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, 20.0f - 12.0f * 0.08f,
                             unit.drive.modes.vector.speed.omega_ref_rad_s);
}

static void test_torque_mode_asks_for_its_current(void)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    (void)periods(0u, 0.0f, 60);
    const unit_command_t c = {.command = SEQUENCE_CMD_RUN | SEQUENCE_CMD_TORQUE_MODE,
                              .torque_ref_Nm = 1.0f};
    hal_output_t out;
    for (int k = 0; k < 120; k++) {
        const hal_sample_t sample = rest();
        unit_post_command(&unit, &c);
        unit_control_period(&unit, &sample, &out);
    }
    /* T = p (M/Lr) lambda i_q with M = Lr; no current flows here, so there is the least flux that
     * torque mode makes up for. */
    TEST_ASSERT_FLOAT_WITHIN(1e-4f,
                             1.0f / (2.0f * params.M_H * params.i_d_A * VECTOR_FLUX_LEAST_PU),
                             unit.drive.modes.vector.speed.i_q_A);
}

static void test_a_torque_that_is_no_number_opens_the_gates(void)
{
    run_up(0.0f);
    const unit_command_t c = {.command = SEQUENCE_CMD_RUN, .torque_ref_Nm = NAN};
    const hal_sample_t sample = rest();
    hal_output_t out;
    unit_post_command(&unit, &c);
    unit_control_period(&unit, &sample, &out);
    TEST_ASSERT_FALSE(out.gates_on);
    TEST_ASSERT_EQUAL_HEX32(FAULT_NON_FINITE, telemetry().faults);
}

static void test_measured_offsets_are_removed(void)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    hal_sample_t s = rest();
    s.i_u_counts = 8202u;
    s.i_v_counts = 8182u;
    hal_output_t out;
    for (int k = 0; k < 60; k++) {
        unit_control_period(&unit, &s, &out);
    }
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 10.0f * 25.0f / 8192.0f, unit.drive.measurement.offset_A.u);
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 0.0f, unit.last.meas.i_A.u);
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 0.0f, unit.last.meas.i_A.v);
}

/* Two line voltages that differ make an offset on either axis. */
static void test_measured_voltage_offsets_are_removed(void)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    hal_sample_t s = rest();
    s.u_uv_counts = 8202u;
    s.u_vw_counts = 8222u;
    hal_output_t out;
    for (int k = 0; k < 60; k++) {
        unit_control_period(&unit, &s, &out);
    }
    TEST_ASSERT_TRUE(absf(unit.drive.measurement.offset_V.alpha) > 0.1f);
    TEST_ASSERT_TRUE(absf(unit.drive.measurement.offset_V.beta) > 0.1f);
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, 0.0f, unit.last.meas.u_line_V.alpha);
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, 0.0f, unit.last.meas.u_line_V.beta);
}

static void test_refused_configuration_stands_in_fault_with_gates_off(void)
{
    params.M_H = 0.2f; /* no leakage */
    TEST_ASSERT_FALSE(unit_init(&unit, &params, &table));
    const hal_output_t out = periods(SEQUENCE_CMD_RUN, 10.0f, 50);
    TEST_ASSERT_FALSE(out.gates_on);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, out.duty_u);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, out.duty_v);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, out.duty_w);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_FAULT, telemetry().state);
    TEST_ASSERT_EQUAL_UINT32(FAULT_CONFIG, telemetry().faults);
    (void)periods(0u, 0.0f, 1);
    (void)periods(SEQUENCE_CMD_FAULT_RESET, 0.0f, 5);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_FAULT, telemetry().state);
    unit_background(&unit, NULL); /* and nothing breaks */
}

/* The parameters, as if they came from a store. */
static bool adopts(const gain_table_id_t *made_for)
{
    return unit_init(&unit, &params, &table) && unit_adopt(&unit, made_for);
}

static void test_parameters_of_another_table_are_refused(void)
{
    const gain_table_id_t same = {table.motor_id, table.crc32c};
    const gain_table_id_t other_motor = {table.motor_id + 1u, table.crc32c};
    const gain_table_id_t other_gains = {table.motor_id, table.crc32c + 1u};
    TEST_ASSERT_TRUE(adopts(&same));
    TEST_ASSERT_FALSE(adopts(&other_gains));
    TEST_ASSERT_FALSE(adopts(&other_motor));
    TEST_ASSERT_FALSE(periods(SEQUENCE_CMD_RUN, 10.0f, 50).gates_on);
    TEST_ASSERT_EQUAL_UINT32(FAULT_STORE, telemetry().faults);
    params.observer_gain_enable = 0u; /* L = 0 does not need it */
    TEST_ASSERT_TRUE(adopts(&other_motor));
    params.M_H = 0.2f; /* no leakage */
    TEST_ASSERT_FALSE(adopts(&same));
}

/* The rules between parameters pass it; who has to work with it does not. */
static void test_what_a_part_of_the_drive_refuses_is_refused(void)
{
    params.stop_mode = 9u;
    TEST_ASSERT_FALSE(unit_init(&unit, &params, &table)); /* state machine */
    params_default(&params);
    params.restart_count = 1u;
    params.restart_delay_s = 1e9f;
    TEST_ASSERT_FALSE(unit_init(&unit, &params, &table)); /* automatic restart */
    params_default(&params);
    params.com_rated_A = 0.0f;
    TEST_ASSERT_FALSE(unit_init(&unit, &params, &table)); /* commissioning */
    TEST_ASSERT_EQUAL_HEX32(FAULT_CONFIG, unit.mailbox.faults);
    /* Without a configuration that was ever taken there is none to go back to. */
    TEST_ASSERT_FALSE(unit_reconfigure(&unit, &params));
    TEST_ASSERT_FALSE(unit.change_ready);
}

/* A dip of the link trips; it runs again by itself while the command stands. */
static void test_a_dip_is_followed_by_an_automatic_restart(void)
{
    params.restart_count = 1u;
    params.restart_delay_s = 0.01f;
    run_up(0.0f);
    hal_sample_t dip = rest();
    dip.u_dc_counts = 4000u; /* 98 V */
    hal_output_t out = {0};
    for (int k = 0; k < 50; k++) {
        unit_control_period(&unit, &dip, &out);
    }
    TEST_ASSERT_FALSE(out.gates_on);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_FAULT, telemetry().state);
    (void)periods(SEQUENCE_CMD_RUN, 0.0f, 40);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_FAULT, telemetry().state);
    TEST_ASSERT_TRUE(periods(SEQUENCE_CMD_RUN, 0.0f, 300).gates_on);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_RUN, telemetry().state);
}

static void test_refused_state_times_stand_in_fault(void)
{
    params.premagnetise_s = -1.0f;
    TEST_ASSERT_FALSE(unit_init(&unit, &params, &table));
}

static void test_a_table_with_a_flipped_bit_is_refused(void)
{
    entries[42].l1_im_per_s += 0.0001f;
    TEST_ASSERT_FALSE(unit_init(&unit, &params, &table));
    (void)periods(SEQUENCE_CMD_RUN, 0.0f, 5);
    TEST_ASSERT_EQUAL_UINT32(FAULT_TABLE_CRC, telemetry().faults);
    params.observer_gain_enable = 0u; /* L = 0 does not need it */
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    TEST_ASSERT_TRUE(unit_init(&unit, &params, NULL));
}

static void test_background_finds_a_bit_lost_while_running(void)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    (void)periods(0u, 0.0f, 60);
    (void)periods(SEQUENCE_CMD_RUN, 0.0f, 5);
    TEST_ASSERT_EQUAL_UINT32(0u, unit.crc_entry);
    unit_background(&unit, NULL);
    TEST_ASSERT_EQUAL_UINT32(24u, unit.crc_entry);
    for (int k = 1; k < 10; k++) {
        unit_background(&unit, NULL);
    }
    TEST_ASSERT_TRUE(periods(SEQUENCE_CMD_RUN, 0.0f, 1).gates_on);
    entries[99].l2_im_ohm = 0.5f;
    for (int k = 0; k < 5; k++) { /* 100 entries are five slices */
        unit_background(&unit, NULL);
    }
    TEST_ASSERT_FALSE(periods(SEQUENCE_CMD_RUN, 0.0f, 1).gates_on);
    TEST_ASSERT_EQUAL_UINT32(FAULT_TABLE_CRC, telemetry().faults);
}

static void test_background_without_a_table_has_nothing_to_check(void)
{
    params.observer_gain_enable = 0u;
    TEST_ASSERT_TRUE(unit_init(&unit, &params, NULL));
    unit_background(&unit, NULL);
    (void)periods(0u, 0.0f, 3);
    TEST_ASSERT_EQUAL_UINT32(0u, telemetry().faults);
}

static void test_watchdog_is_fed_only_while_the_control_period_lives(void)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    const hal_devices_t devices = {.context = &served, .watchdog_serve = serve};
    (void)periods(0u, 0.0f, 1);
    unit_background(&unit, &devices);
    TEST_ASSERT_EQUAL_UINT32(1u, served);
    unit_background(&unit, &devices);
    TEST_ASSERT_EQUAL_UINT32(1u, served);
    (void)periods(0u, 0.0f, 1);
    unit_background(&unit, &devices);
    TEST_ASSERT_EQUAL_UINT32(2u, served);
    const hal_devices_t none = {.context = &served};
    (void)periods(0u, 0.0f, 1);
    unit_background(&unit, &none); /* no watchdog on this board */
}

static void test_a_speed_reference_that_is_no_number_is_a_fault(void)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    (void)periods(0u, 0.0f, 60);
    TEST_ASSERT_FALSE(periods(SEQUENCE_CMD_RUN, NAN, 1).gates_on);
    TEST_ASSERT_EQUAL_UINT32(FAULT_NON_FINITE, telemetry().faults);
}

static void test_over_current_opens_the_gates_in_the_same_period(void)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    (void)periods(0u, 0.0f, 60);
    TEST_ASSERT_TRUE(periods(SEQUENCE_CMD_RUN, 0.0f, 10).gates_on);
    hal_sample_t s = rest();
    s.i_u_counts = 16000u; /* 23.8 A */
    s.i_v_counts = 384u;
    hal_output_t out;
    unit_control_period(&unit, &s, &out);
    TEST_ASSERT_FALSE(out.gates_on);
    TEST_ASSERT_EQUAL_UINT32(FAULT_OVER_CURRENT, telemetry().faults);
}

/* A limit lost in memory lets any voltage through: the last line stops it in the same period. */
static void test_a_duty_beyond_its_range_never_leaves(void)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    (void)periods(0u, 0.0f, 60);
    TEST_ASSERT_TRUE(periods(SEQUENCE_CMD_RUN, 0.0f, 10).gates_on);
    unit.config[unit.in_force].drive.voltage.svpwm.inside_pu = 1e9f;
    unit.drive.voltage.current.d.x = 1e4f;
    const hal_output_t out = periods(SEQUENCE_CMD_RUN, 0.0f, 1);
    TEST_ASSERT_TRUE(unit.last.duty.u > 1.0f);
    TEST_ASSERT_FALSE(out.gates_on);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, out.duty_u);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, out.duty_v);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, out.duty_w);
    TEST_ASSERT_EQUAL_UINT32(FAULT_NON_FINITE, telemetry().faults);
}

/* Each leg alone, whatever is wrong with it, tells in the period that found it. Gates off and at
 * rest, where the law leaves its duties as they are. */
static void test_a_duty_that_no_timer_can_do_is_a_fault(void)
{
    const float bad[] = {NAN, INFINITY, -INFINITY, -1e-6f, 1.000001f};
    const float good[] = {0.0f, 1.0f, 0.25f};
    for (int leg = 0; leg < 3; leg++) {
        float *const duties[] = {&unit.last.duty.u, &unit.last.duty.v, &unit.last.duty.w};
        for (size_t k = 0u; k < sizeof bad / sizeof bad[0]; k++) {
            TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
            (void)periods(0u, 0.0f, 64); /* slot 0 */
            TEST_ASSERT_EQUAL_UINT32(SEQUENCE_READY, telemetry().state);
            *duties[leg] = good[k % 3u];
            hal_output_t out = periods(0u, 0.0f, 1);
            TEST_ASSERT_EQUAL_UINT32(0u, telemetry().faults);
            TEST_ASSERT_EQUAL_FLOAT(good[k % 3u], (&out.duty_u)[leg]);
            (void)periods(0u, 0.0f, 15);
            *duties[leg] = bad[k];
            out = periods(0u, 0.0f, 1);
            TEST_ASSERT_EQUAL_UINT32(FAULT_NON_FINITE, telemetry().faults);
            TEST_ASSERT_EQUAL_UINT32(SEQUENCE_FAULT, telemetry().state);
            TEST_ASSERT_EQUAL_FLOAT(0.5f, out.duty_u);
            TEST_ASSERT_EQUAL_FLOAT(0.5f, out.duty_v);
            TEST_ASSERT_EQUAL_FLOAT(0.5f, out.duty_w);
            TEST_ASSERT_FALSE(out.gates_on);
        }
    }
}

/* What is new is handed over; what was said before only shows that somebody is alive. */
static void test_a_command_is_posted_when_it_is_new(void)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    const uint32_t before = unit.mailbox.published;
    unit_command_t c = {.command = SEQUENCE_CMD_RUN, .omega_m_ref_rad_s = 3.0f, .count = 7u};
    unit_post_command(&unit, &c);
    TEST_ASSERT_EQUAL_UINT32(before + 1u, unit.mailbox.published);
    for (uint32_t k = 8u; k < 12u; k++) {
        c.count = k;
        unit_post_command(&unit, &c);
        TEST_ASSERT_EQUAL_UINT32(before + 1u, unit.mailbox.published);
        TEST_ASSERT_EQUAL_UINT32(k, unit.mailbox.alive);
    }
    c.command |= SEQUENCE_CMD_TORQUE_MODE;
    unit_post_command(&unit, &c);
    TEST_ASSERT_EQUAL_UINT32(before + 2u, unit.mailbox.published);
    c.omega_m_ref_rad_s = -3.0f;
    unit_post_command(&unit, &c);
    TEST_ASSERT_EQUAL_UINT32(before + 3u, unit.mailbox.published);
    c.torque_ref_Nm = 1.0f;
    unit_post_command(&unit, &c);
    TEST_ASSERT_EQUAL_UINT32(before + 4u, unit.mailbox.published);
    c.torque_ref_Nm = NAN; /* bit for bit: said twice it is the same */
    unit_post_command(&unit, &c);
    unit_post_command(&unit, &c);
    TEST_ASSERT_EQUAL_UINT32(before + 5u, unit.mailbox.published);
    /* The period takes the last one, once. */
    const hal_sample_t sample = rest();
    hal_output_t out;
    unit_control_period(&unit, &sample, &out);
    TEST_ASSERT_EQUAL_UINT32(before + 5u, unit.taken);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_CMD_RUN | SEQUENCE_CMD_TORQUE_MODE, unit.command.command);
    TEST_ASSERT_EQUAL_FLOAT(-3.0f, unit.command.omega_m_ref_rad_s);
}

/* Periods of a drive that runs, each with the port's count of late ones. */
static hal_output_t late(const uint16_t *count, int n)
{
    hal_sample_t s = rest();
    hal_output_t out = {0};
    for (int k = 0; k < n; k++) {
        s.late_periods = count[k];
        unit_control_period(&unit, &s, &out);
    }
    return out;
}

static void test_one_late_period_is_told_and_the_drive_goes_on(void)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    (void)periods(0u, 0.0f, 60);
    (void)periods(SEQUENCE_CMD_RUN, 0.0f, 10);
    const uint16_t apart[] = {1u, 1u, 2u, 2u, 2u, 3u};
    TEST_ASSERT_TRUE(late(apart, 6).gates_on);
    TEST_ASSERT_EQUAL_UINT32(FAULT_PERIOD_LATE, telemetry().faults);
}

/* The count wraps: late is a change, not a larger number. */
static void test_two_late_periods_in_a_row_open_the_gates(void)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    (void)periods(0u, 0.0f, 60);
    (void)periods(SEQUENCE_CMD_RUN, 0.0f, 10);
    unit.late_periods = 65534u;
    const uint16_t row[] = {65535u, 65535u, 0u, 1u};
    TEST_ASSERT_TRUE(late(row, 3).gates_on);
    TEST_ASSERT_FALSE(late(&row[3], 1).gates_on);
    TEST_ASSERT_EQUAL_UINT32(FAULT_PERIOD_LATE | FAULT_PERIOD_OVERRUN, telemetry().faults);
}

/* The hardware has opened the gates by itself: the drive says so, and stays off. */
static void test_a_break_input_opens_the_gates_for_good(void)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    (void)periods(0u, 0.0f, 60);
    TEST_ASSERT_TRUE(periods(SEQUENCE_CMD_RUN, 0.0f, 10).gates_on);
    hal_sample_t s = rest();
    s.inputs = 0xFFFFu & ~HAL_INPUT_BREAK;
    hal_output_t out;
    unit_control_period(&unit, &s, &out);
    TEST_ASSERT_TRUE(out.gates_on);
    s.inputs = HAL_INPUT_BREAK;
    unit_control_period(&unit, &s, &out);
    TEST_ASSERT_FALSE(out.gates_on);
    TEST_ASSERT_EQUAL_UINT32(FAULT_BRAKE_INPUT, telemetry().faults);
    TEST_ASSERT_FALSE(periods(SEQUENCE_CMD_RUN, 0.0f, 10).gates_on);
}

/* 283 V are above 280. */
static void test_the_brake_resistor_is_switched_without_any_command(void)
{
    params.chopper_on_V = 280.0f;
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    TEST_ASSERT_TRUE(periods(0u, 0.0f, 2).brake_on);
    params.chopper_on_V = 290.0f;
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    TEST_ASSERT_FALSE(periods(0u, 0.0f, 2).brake_on);
}

/* A hang: the count has grown by more than one when the drive runs again. */
static void test_one_period_that_misses_two_crests_opens_the_gates(void)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    (void)periods(0u, 0.0f, 60);
    (void)periods(SEQUENCE_CMD_RUN, 0.0f, 10);
    const uint16_t hang[] = {2u};
    TEST_ASSERT_FALSE(late(hang, 1).gates_on);
    TEST_ASSERT_EQUAL_UINT32(FAULT_PERIOD_LATE | FAULT_PERIOD_OVERRUN, telemetry().faults);
}

static void test_live_change_is_taken_or_refused_as_a_whole(void)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    const float before_A = unit_config(&unit)->drive.modes.vector.flux.i_d_A;
    params.i_d_A = 3.0f;
    TEST_ASSERT_TRUE(unit_reconfigure(&unit, &params));
    TEST_ASSERT_EQUAL_FLOAT(
        before_A, unit_config(&unit)->drive.modes.vector.flux.i_d_A); /* not before the period */
    /* A set that is refused leaves the one that waits, and that is taken whole. */
    params.i_d_A = 4.0f;
    params.speed_J_kg_m2 = 0.0f;
    TEST_ASSERT_FALSE(unit_reconfigure(&unit, &params));
    (void)periods(0u, 0.0f, 1);
    TEST_ASSERT_EQUAL_FLOAT(3.0f, unit_config(&unit)->drive.modes.vector.flux.i_d_A);
    TEST_ASSERT_EQUAL_FLOAT(3.0f, unit.params.i_d_A);
    const drive_config_t before = unit_config(&unit)->drive;
    TEST_ASSERT_FALSE(unit_reconfigure(&unit, &params));
    (void)periods(0u, 0.0f, 1);
    TEST_ASSERT_EQUAL_MEMORY(&before.modes.vector.speed,
                             &unit_config(&unit)->drive.modes.vector.speed,
                             sizeof(before.modes.vector.speed));
    TEST_ASSERT_EQUAL_FLOAT(3.0f, unit_config(&unit)->drive.modes.vector.flux.i_d_A);
    unit.configured = false;
    params.i_d_A = 3.5f;
    TEST_ASSERT_FALSE(unit_reconfigure(&unit, &params));
    params.speed_J_kg_m2 = 0.035f;
    TEST_ASSERT_TRUE(unit_reconfigure(&unit, &params)); /* to be saved: for the next start */
    (void)periods(0u, 0.0f, 1);
    TEST_ASSERT_EQUAL_FLOAT(3.5f, unit.params.i_d_A);
    TEST_ASSERT_EQUAL_FLOAT(3.0f, unit_config(&unit)->drive.modes.vector.flux.i_d_A);
    TEST_ASSERT_FALSE(unit.configured);
    /* Nothing says what Rs or the pole pairs are. */
    unit.drive.estimator.estimate.omega_e_rad_s = 20.0f;
    TEST_ASSERT_EQUAL_FLOAT(0.0f, telemetry().Rs_hat_ohm);
    TEST_ASSERT_EQUAL_FLOAT(20.0f, telemetry().omega_m_hat_rad_s);
}

static void test_eps1_units_reach_the_law_converted(void)
{
    params.eps1 = 0.008f;
    params.adapt_ki = 500.0f;
    const float expected[3] = {0.008f, 0.008f * 500.0f, 0.008f / 200e-6f};
    for (uint32_t reading = 0u; reading < 3u; reading++) {
        params.eps1_unit = reading;
        TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
        TEST_ASSERT_EQUAL_FLOAT(expected[reading],
                                unit_config(&unit)->drive.estimator.adaptation.p.leak_per_s_Wb_A);
    }
}

static void test_telemetry_says_what_the_period_did(void)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    unit.drive.estimator.estimate.omega_e_rad_s = 20.0f;
    unit.drive.estimator.estimate.omega_s_rad_s = 6.2831853f;
    unit.drive.estimator.estimate.lambda_r_hat_Wb = (ab_t){0.0f, 0.5f};
    unit.last.i_A = (dq_t){1.0f, 2.0f};
    unit.last.i_ref_A = (dq_t){1.5f, 2.5f};
    unit.drive.estimator.estimate.i_residual_A = (ab_t){0.1f, 0.2f};
    unit.drive.estimator.gain.l1_re_per_s = -7.0f;
    const unit_telemetry_t t = telemetry();
    TEST_ASSERT_EQUAL_FLOAT(10.0f, t.omega_m_hat_rad_s);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, t.stator_frequency_Hz);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, t.lambda_hat_Wb);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 1.5707963f, t.lambda_angle_rad);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, t.i_d_A);
    TEST_ASSERT_EQUAL_FLOAT(2.0f, t.i_q_A);
    TEST_ASSERT_EQUAL_FLOAT(2.5f, t.i_q_ref_A);
    TEST_ASSERT_EQUAL_FLOAT(0.1f, t.e1_alpha_A);
    TEST_ASSERT_EQUAL_FLOAT(0.2f, t.e1_beta_A);
    TEST_ASSERT_EQUAL_UINT32(0u, t.speed_unknown);
    unit.drive.guard.speed.speed_unknown = true;
    TEST_ASSERT_EQUAL_UINT32(1u, telemetry().speed_unknown);
    TEST_ASSERT_TRUE(isnan(telemetry().omega_m_hat_rad_s));
}

static void test_a_reference_is_bounded_and_one_that_is_no_number_is_none(void)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    static const float asked[] = {1e9f, -1e9f, NAN, 10.0f};
    const float most_rad_s = params.speed_max_rad_s;
    const float got[] = {most_rad_s, -most_rad_s, 0.0f, 10.0f * params.pole_pairs};
    for (size_t k = 0u; k < sizeof asked / sizeof asked[0]; k++) {
        (void)periods(SEQUENCE_CMD_RUN, asked[k], 1);
        TEST_ASSERT_EQUAL_FLOAT(got[k], unit.asked.omega_e_ref_rad_s);
    }
}

/* One bit of a word, wherever an enum lies in it. */
static void flip(void *word, uint32_t bit)
{
    uint32_t bits;
    memcpy(&bits, word, sizeof bits);
    bits ^= 1u << bit;
    memcpy(word, &bits, sizeof bits);
}

/* Every bit of mode, aim and state, in RUN and while the flux is built: what the drive does next is
 * what was asked for, or it says FAULT with the gates off. */
static void test_a_flipped_bit_of_mode_aim_or_state_is_healed_or_declared(void)
{
    void *const word[] = {&unit.asked.mode, &unit.asked.aim, &unit.machine.id, &unit.drive.mode};
    const int from_periods[] = {110, 20};
    const uint32_t state[] = {SEQUENCE_RUN, SEQUENCE_PREMAGNETISE};
    uint32_t healed = 0u;
    for (uint32_t n = 0u; n < 2u * 4u * 32u; n++) {
        TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
        (void)periods(0u, 0.0f, 60);
        (void)periods(SEQUENCE_CMD_RUN, 0.0f, from_periods[n / 128u]);
        TEST_ASSERT_EQUAL_UINT32(state[n / 128u], telemetry().state);
        const unit_t before = unit;
        flip(word[(n / 32u) % 4u], n % 32u);
        const hal_output_t first = periods(SEQUENCE_CMD_RUN, 0.0f, 1);
        if (unit.machine.faults != 0u) {
            TEST_ASSERT_FALSE(first.gates_on);
            TEST_ASSERT_EQUAL_HEX32(FAULT_CONFIG, unit.machine.faults);
            TEST_ASSERT_EQUAL_UINT32(SEQUENCE_FAULT, telemetry().state);
            continue;
        }
        (void)periods(SEQUENCE_CMD_RUN, 0.0f, 2);
        const bool same =
            (unit.asked.mode == before.asked.mode) && (unit.asked.aim == before.asked.aim) &&
            (unit.machine.id == before.machine.id) && (unit.drive.mode == before.drive.mode);
        const bool stopped = !periods(SEQUENCE_CMD_RUN, 0.0f, 1).gates_on;
        TEST_ASSERT_TRUE_MESSAGE(same || stopped, "neither healed nor declared");
        healed += same ? 1u : 0u;
    }
    TEST_ASSERT_TRUE(healed > 0u);
}

/* What the operator asked for, whether a start has to wait, and whether there is a configuration at
 * all: a change that nobody made opens the gates at once. */
static void test_a_flipped_bit_of_what_is_asked_opens_the_gates(void)
{
    uint32_t *const reference = (void *)&unit.asked.omega_e_ref_rad_s;
    for (uint32_t bit = 0u; bit < 66u; bit++) {
        run_up(10.0f);
        if (bit < 32u) {
            unit.command.command ^= 1u << bit;
        } else if (bit < 64u) {
            flip(reference, bit - 32u);
        } else if (bit == 64u) {
            unit.configured = false;
        } else {
            unit.machine.run_blocked = true;
        }
        TEST_ASSERT_FALSE(periods(SEQUENCE_CMD_RUN, 10.0f, 1).gates_on);
        TEST_ASSERT_BITS_HIGH(FAULT_CONFIG, telemetry().faults);
    }
}

/* In the configuration in force, padding included; one bit of each byte. */
static void test_a_flipped_bit_of_the_configuration_opens_the_gates_within_50_ms(void)
{
    run_up(0.0f);
    const unit_t before = unit;
    for (size_t at = 0u; at < sizeof unit.config[0]; at++) {
        unit = before;
        ((uint8_t *)&unit.config[unit.in_force])[at] ^= (uint8_t)(1u << (at % 8u));
        for (uint32_t ms = 0u; ms < 50u; ms += 2u) {
            unit_background(&unit, NULL);
        }
        TEST_ASSERT_BITS_HIGH(FAULT_CONFIG, unit.mailbox.faults);
    }
    TEST_ASSERT_FALSE(periods(SEQUENCE_CMD_RUN, 0.0f, 1).gates_on);
    /* Without a flip, and through a live change, nothing is found. */
    unit = before;
    for (uint32_t n = 0u; n < 100u; n++) {
        unit_background(&unit, NULL);
        if (n % 7u == 0u) {
            params.adapt_kp += 0.01f;
            TEST_ASSERT_TRUE(unit_reconfigure(&unit, &params));
        }
        TEST_ASSERT_TRUE(periods(SEQUENCE_CMD_RUN, 0.0f, 1).gates_on);
    }
    TEST_ASSERT_EQUAL_HEX32(0u, unit.mailbox.faults);
}

/* Yes and no of a dwell, and the slow part of e1 that goes with it. */
static void test_signals_of_a_dwell_show_its_state(void)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    for (uint32_t yes = 0u; yes < 2u; yes++) {
        dwell_state_t *dwell = &unit.drive.dwell;
        dwell->standing = yes == 1u;
        dwell->active = yes == 1u;
        dwell->flux = yes == 1u;
        TEST_ASSERT_EQUAL_UINT32(yes, unit_signal(&unit, UNIT_SIGNAL_dwell_standing));
        TEST_ASSERT_EQUAL_UINT32(yes, unit_signal(&unit, UNIT_SIGNAL_dwelling));
        TEST_ASSERT_EQUAL_UINT32(yes, unit_signal(&unit, UNIT_SIGNAL_dwell_flux));
    }
    unit.drive.estimator.residual_slow_A = (ab_t){2.0f, -5.0f};
    TEST_ASSERT_EQUAL_HEX32(float_bits(2.0f),
                            unit_signal(&unit, UNIT_SIGNAL_residual_slow_alpha_A));
    TEST_ASSERT_EQUAL_HEX32(float_bits(-5.0f),
                            unit_signal(&unit, UNIT_SIGNAL_residual_slow_beta_A));
}

/* What the estimator shows beside its estimate is read from its state. */
static void test_signals_of_the_estimator_show_its_state(void)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    TEST_ASSERT_EQUAL_UINT32(0u, unit_signal(&unit, UNIT_SIGNAL_near_zero));
    unit.drive.estimator.adaptation.near_zero = true;
    unit.drive.estimator.adaptation.x_rad_s = 3.0f;
    TEST_ASSERT_EQUAL_UINT32(1u, unit_signal(&unit, UNIT_SIGNAL_near_zero));
    TEST_ASSERT_EQUAL_HEX32(float_bits(3.0f), unit_signal(&unit, UNIT_SIGNAL_x_rad_s));
}

static void test_every_flag_is_a_signal_of_0_and_1(void)
{
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    vector_state_t *const v = &unit.drive.modes.vector;
    const struct {
        bool *flag;
        uint32_t number;
    } cases[] = {{&unit.output.gates_on, UNIT_SIGNAL_gates_on},
                 {&unit.output.brake_on, UNIT_SIGNAL_brake_on},
                 {&unit.drive.modes.premagnetise.leg_loss_found, UNIT_SIGNAL_dead_time_found},
                 {&v->steering.steering, UNIT_SIGNAL_steering},
                 {&v->steer.moving, UNIT_SIGNAL_steer_out_moving},
                 {&v->mains.active, UNIT_SIGNAL_mains_active},
                 {&unit.drive.supervisor.started, UNIT_SIGNAL_sup_started},
                 {&unit.drive.supervisor.found.flux_high, UNIT_SIGNAL_sup_flux_high},
                 {&unit.drive.modes.i_f.active, UNIT_SIGNAL_imp_active},
                 {&unit.machine.run_blocked, UNIT_SIGNAL_run_blocked},
                 {&unit.drive.guard.speed.speed_unknown, UNIT_SIGNAL_speed_unknown}};
    for (size_t n = 0u; n < sizeof cases / sizeof cases[0]; n++) {
        for (uint32_t value = 0u; value < 2u; value++) {
            *cases[n].flag = value != 0u;
            TEST_ASSERT_EQUAL_UINT32(value, unit_signal(&unit, cases[n].number));
        }
    }
    TEST_ASSERT_EQUAL_UINT32(UNIT_SIGNALS, unit_record_fault_signal(FAULT_RECORD_SIGNALS));
}

static void test_a_signal_is_the_member_that_the_list_names(void)
{
    uint32_t expected[UNIT_SIGNALS];
    bool is_float[UNIT_SIGNALS] = {false};
    uint32_t n = 0u;
    /* No branch in here: it would count for the list. */
#define FLOAT(path)                                                                                \
    unit.path = 0.5f + (float)n;                                                                   \
    is_float[n] = true;                                                                            \
    expected[n++] = float_bits(unit.path);
#define WHOLE(path)                                                                                \
    unit.path = 1u;                                                                                \
    expected[n++] = 1u;
#define SIGNAL_F(name, path, text)  FLOAT(path)
#define SIGNAL_U(name, path, text)  WHOLE(path)
#define SIGNAL_OF(name, path, text) FLOAT(output.path)
#define SIGNAL_OU(name, path, text) WHOLE(output.path)
#define SIGNAL_X(name, value, text) expected[n++] = 0u;
#include "signal_list.def"
#undef SIGNAL_F
#undef SIGNAL_U
#undef SIGNAL_OF
#undef SIGNAL_OU
#undef SIGNAL_X
    TEST_ASSERT_EQUAL_UINT32(UNIT_SIGNALS, n);
    for (uint32_t k = 0u; k < n; k++) {
        TEST_ASSERT_EQUAL(is_float[k], unit_signal_is_float(k));
        if (expected[k] != 0u) {
            TEST_ASSERT_EQUAL_HEX32(expected[k], unit_signal(&unit, k));
        }
    }
}

static void test_a_decimated_trace_leaves_periods_out(void)
{
    static uint32_t memory[64];
    TEST_ASSERT_TRUE(unit_init(&unit, &params, &table));
    const unit_memory_t lent = {.trace_word = memory, .trace_words = 64u};
    unit_record_init(&unit, &lent);
    const trace_setup_t setup = {.signal = {UNIT_SIGNAL_state},
                                 .signals = 1u,
                                 .decimation = 2u,
                                 .trigger = UNIT_SIGNAL_state,
                                 .level = 1u << 30,
                                 .edge = TRACE_RISING};
    TEST_ASSERT_TRUE(trace_arm(&unit.trace, &setup));
    const hal_sample_t nothing = {0};
    const hal_output_t output = {0};
    for (int k = 0; k < 10; k++) {
        unit.period_count++;
        unit_record_period(&unit, &nothing, &output);
    }
    TEST_ASSERT_TRUE(trace_running(&unit.trace));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_flag_is_a_signal_of_0_and_1);
    RUN_TEST(test_a_signal_is_the_member_that_the_list_names);
    RUN_TEST(test_a_decimated_trace_leaves_periods_out);
    RUN_TEST(test_starts_from_boot_to_run_by_itself);
    RUN_TEST(test_speed_reference_is_mechanical);
    RUN_TEST(test_the_pole_pairs_are_those_of_the_parameters);
    RUN_TEST(test_a_commissioning_begins_anew);
    RUN_TEST(test_silence_is_counted_with_the_gates_on_only);
    RUN_TEST(test_a_silence_of_one_period_is_watched_and_of_none_is_not);
    RUN_TEST(test_a_timeout_is_rounded_to_whole_periods);
    RUN_TEST(test_a_command_that_counts_keeps_the_drive_running);
    RUN_TEST(test_a_direction_forbidden_makes_zero_of_the_reference);
    RUN_TEST(test_a_stop_ramp_ignores_the_reference);
    RUN_TEST(test_torque_mode_asks_for_its_current);
    RUN_TEST(test_a_torque_that_is_no_number_opens_the_gates);
    RUN_TEST(test_measured_offsets_are_removed);
    RUN_TEST(test_measured_voltage_offsets_are_removed);
    RUN_TEST(test_refused_configuration_stands_in_fault_with_gates_off);
    RUN_TEST(test_parameters_of_another_table_are_refused);
    RUN_TEST(test_what_a_part_of_the_drive_refuses_is_refused);
    RUN_TEST(test_a_dip_is_followed_by_an_automatic_restart);
    RUN_TEST(test_refused_state_times_stand_in_fault);
    RUN_TEST(test_a_table_with_a_flipped_bit_is_refused);
    RUN_TEST(test_background_finds_a_bit_lost_while_running);
    RUN_TEST(test_background_without_a_table_has_nothing_to_check);
    RUN_TEST(test_watchdog_is_fed_only_while_the_control_period_lives);
    RUN_TEST(test_a_speed_reference_that_is_no_number_is_a_fault);
    RUN_TEST(test_over_current_opens_the_gates_in_the_same_period);
    RUN_TEST(test_a_duty_beyond_its_range_never_leaves);
    RUN_TEST(test_a_duty_that_no_timer_can_do_is_a_fault);
    RUN_TEST(test_a_command_is_posted_when_it_is_new);
    RUN_TEST(test_one_late_period_is_told_and_the_drive_goes_on);
    RUN_TEST(test_two_late_periods_in_a_row_open_the_gates);
    RUN_TEST(test_a_break_input_opens_the_gates_for_good);
    RUN_TEST(test_the_brake_resistor_is_switched_without_any_command);
    RUN_TEST(test_one_period_that_misses_two_crests_opens_the_gates);
    RUN_TEST(test_live_change_is_taken_or_refused_as_a_whole);
    RUN_TEST(test_eps1_units_reach_the_law_converted);
    RUN_TEST(test_telemetry_says_what_the_period_did);
    RUN_TEST(test_a_flipped_bit_of_mode_aim_or_state_is_healed_or_declared);
    RUN_TEST(test_a_flipped_bit_of_what_is_asked_opens_the_gates);
    RUN_TEST(test_a_flipped_bit_of_the_configuration_opens_the_gates_within_50_ms);
    RUN_TEST(test_a_reference_is_bounded_and_one_that_is_no_number_is_none);
    RUN_TEST(test_signals_of_a_dwell_show_its_state);
    RUN_TEST(test_signals_of_the_estimator_show_its_state);
    return UNITY_END();
}
