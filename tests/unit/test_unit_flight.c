/* The flight recorder of one drive: when it begins, what every kind of row says, what the start of
 * a recording leaves of the drive. */
#include "unit_flight.h"

#include <string.h>

#include "unit_record.h"
#include "unity.h"

#define ROWS 256u

static unit_t unit;
static params_t params;
static unit_command_t asked;
static hal_sample_t sample;
static hal_output_t output;
static uint32_t memory[ROWS * FLIGHT_ROW_WORDS];
static uint32_t read; /* rows so far */

static void period(void)
{
    sample.i_u_counts ^= 1u; /* words flicker */
    unit_post_command(&unit, &asked);
    unit_control_period(&unit, &sample, &output);
    unit_record_period(&unit, &sample, &output);
}

static void periods(uint32_t n)
{
    for (uint32_t k = 0u; k < n; k++) {
        period();
    }
}

static const uint32_t *next_row(void)
{
    TEST_ASSERT_TRUE(read != unit.flight.written);
    read++;
    return flight_row(&unit.flight, read - 1u);
}

static void expect_kind(uint32_t kind, uint32_t value, uint32_t second, uint32_t third)
{
    const uint32_t *row = next_row();
    TEST_ASSERT_EQUAL_HEX32(kind | (value << 16u), row[0]);
    TEST_ASSERT_EQUAL_HEX32(second, row[1]);
    TEST_ASSERT_EQUAL_HEX32(third, row[2]);
}

static void expect_sample(void)
{
    const uint32_t *row = next_row();
    TEST_ASSERT_EQUAL_HEX32(sample.i_u_counts | ((uint32_t)sample.i_v_counts << 16u), row[0]);
    TEST_ASSERT_EQUAL_HEX32(sample.i_w_counts | ((uint32_t)sample.u_uv_counts << 16u), row[1]);
    TEST_ASSERT_EQUAL_HEX32(sample.u_vw_counts | ((uint32_t)sample.u_dc_counts << 16u), row[2]);
}

static void nothing_more(void)
{
    TEST_ASSERT_EQUAL_UINT32(read, unit.flight.written);
}

/* READY, and the recorder armed. */
static void arm(void)
{
    TEST_ASSERT_TRUE(unit_flight_allowed(&unit));
    TEST_ASSERT_TRUE(flight_arm(&unit.flight));
    read = 0u;
}

/* Behind the first row, and the command that stands: none. */
static void record(void)
{
    arm();
    period();
    (void)next_row();
    period();
    expect_kind(FLIGHT_COMMAND, 0u, 0u, 0u);
    expect_sample();
    nothing_more();
}

void setUp(void)
{
    params_default(&params);
    params.observer_gain_enable = 0u;
    params.offset_calibration_s = 0.01f;
    params.premagnetise_s = 0.02f;
    TEST_ASSERT_TRUE(unit_init(&unit, &params, NULL));
    const unit_memory_t lent = {.flight_word = memory,
                                .flight_words = sizeof memory / sizeof memory[0]};
    unit_record_init(&unit, &lent);
    asked = (unit_command_t){0};
    sample = (hal_sample_t){8193u, 8194u, 8188u, 8195u, 8190u, 11592u, 0u, 0u};
    periods(60u);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_READY, unit.machine.id);
    TEST_ASSERT_EQUAL_UINT32(0u, unit.flight.written);
}

void tearDown(void)
{
}

static void test_begins_with_what_a_replay_cannot_know(void)
{
    unit.flight.changes = 7u;
    unit.drive.limits.overload.heat_pu[OVERLOAD_MOTOR] = 0.25f;
    unit.drive.limits.overload.heat_pu[OVERLOAD_INVERTER] = 0.5f;
    arm();
    period();
    TEST_ASSERT_EQUAL_UINT32(FLIGHT_ON, unit.flight.state);
    expect_kind(FLIGHT_START, 7u, float_bits(0.25f), float_bits(0.5f));
    nothing_more();
    TEST_ASSERT_EQUAL_FLOAT(0.25f, unit.drive.limits.overload.heat_pu[OVERLOAD_MOTOR]);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, unit.drive.limits.overload.heat_pu[OVERLOAD_INVERTER]);
}

/* But for the heat and the counters that run on, as unit_init left it. */
static void test_begins_with_the_drive_as_from_its_start(void)
{
    unit.last.faults = 1u;
    unit.commissioned.status = COMMISSIONING_DONE;
    unit.restart.used = 3u;
    unit.asked.i_d_ref_A = 1.0f;
    unit.command_faults = FAULT_NON_FINITE;
    unit.silent_periods = 5u;
    unit.mailbox.alive = 17u;
    unit.late = true;
    unit.flight.state = FLIGHT_ASKED;
    unit_flight_period(&unit, &sample, &output);
    static unit_t fresh;
    TEST_ASSERT_TRUE(unit_init(&fresh, &params, NULL));
    TEST_ASSERT_EQUAL_MEMORY(&fresh.drive, &unit.drive, sizeof fresh.drive);
    TEST_ASSERT_EQUAL_MEMORY(&fresh.last, &unit.last, sizeof fresh.last);
    TEST_ASSERT_EQUAL_MEMORY(&fresh.machine, &unit.machine, sizeof fresh.machine);
    TEST_ASSERT_EQUAL_MEMORY(&fresh.commissioned, &unit.commissioned, sizeof fresh.commissioned);
    TEST_ASSERT_EQUAL_MEMORY(&fresh.restart, &unit.restart, sizeof fresh.restart);
    TEST_ASSERT_EQUAL_MEMORY(&fresh.asked, &unit.asked, sizeof fresh.asked);
    TEST_ASSERT_EQUAL_MEMORY(&fresh.command, &unit.command, sizeof fresh.command);
    TEST_ASSERT_EQUAL_UINT32(0u, unit.command_faults);
    TEST_ASSERT_EQUAL_UINT32(0u, unit.silent_periods);
    TEST_ASSERT_EQUAL_UINT32(17u, unit.command_count);
    TEST_ASSERT_FALSE(unit.late);
    TEST_ASSERT_EQUAL_HEX32(unit_decisions(&unit), unit.decided);
    TEST_ASSERT_EQUAL_UINT32(unit.mailbox.published - 1u, unit.taken);
}

static void test_the_drive_is_ready_again_as_after_power_up(void)
{
    record();
    periods(60u);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_READY, unit.machine.id);
    TEST_ASSERT_EQUAL_HEX32(0u, unit.machine.faults);
    asked.command = SEQUENCE_CMD_RUN;
    periods(3u);
    TEST_ASSERT_TRUE(output.gates_on);
}

/* The gates may have gone on between the request and the period. */
static void test_a_drive_that_was_started_meanwhile_is_not_touched(void)
{
    arm();
    asked.command = SEQUENCE_CMD_RUN;
    period();
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_PREMAGNETISE, unit.machine.id);
    TEST_ASSERT_EQUAL_UINT32(FLIGHT_OFF, unit.flight.state);
    nothing_more();
    period();
    TEST_ASSERT_TRUE(output.gates_on);
}

static void test_gates_that_are_asked_for_are_enough_to_refuse(void)
{
    arm();
    unit.asked.mode = DRIVE_RUN;
    unit_flight_period(&unit, &sample, &output);
    TEST_ASSERT_EQUAL_UINT32(FLIGHT_OFF, unit.flight.state);
    unit.asked.mode = DRIVE_OFF;
    arm();
    unit.machine.id = SEQUENCE_COAST;
    unit_flight_period(&unit, &sample, &output);
    TEST_ASSERT_EQUAL_UINT32(FLIGHT_OFF, unit.flight.state);
}

static void test_is_allowed_in_ready_without_a_start_command_and_with_a_bit_to_spare(void)
{
    TEST_ASSERT_TRUE(unit_flight_allowed(&unit));
    unit.params.adc_bits = FLIGHT_ADC_BITS_MAX;
    TEST_ASSERT_TRUE(unit_flight_allowed(&unit));
    unit.params.adc_bits = FLIGHT_ADC_BITS_MAX + 1u;
    TEST_ASSERT_FALSE(unit_flight_allowed(&unit));
    unit.params.adc_bits = 12u;
    asked.command = SEQUENCE_CMD_RUN;
    unit_post_command(&unit, &asked);
    TEST_ASSERT_FALSE(unit_flight_allowed(&unit));
    asked.command = 0u;
    unit_post_command(&unit, &asked);
    TEST_ASSERT_TRUE(unit_flight_allowed(&unit));
    unit.machine.id = SEQUENCE_FAULT;
    TEST_ASSERT_FALSE(unit_flight_allowed(&unit));
}

static void test_a_command_stands_in_front_of_the_sample_it_came_with(void)
{
    record();
    asked = (unit_command_t){
        .command = SEQUENCE_CMD_TORQUE_OFF, .omega_m_ref_rad_s = 12.5f, .torque_ref_Nm = -3.0f};
    period();
    expect_kind(FLIGHT_COMMAND, SEQUENCE_CMD_TORQUE_OFF, float_bits(12.5f), float_bits(-3.0f));
    expect_sample();
    period();
    expect_sample();
    nothing_more();
}

static void test_a_host_that_is_alive_marks_the_second_word(void)
{
    record();
    asked.count++;
    period();
    TEST_ASSERT_EQUAL_HEX32(sample.i_u_counts | ((sample.i_v_counts | 0x8000u) << 16u),
                            next_row()[0]);
    period();
    expect_sample();
    nothing_more();
}

static void test_a_break_marks_the_third_word(void)
{
    record();
    sample.inputs = HAL_INPUT_BREAK | 2u;
    period();
    TEST_ASSERT_EQUAL_HEX32((sample.i_w_counts | 0x8000u) | ((uint32_t)sample.u_uv_counts << 16u),
                            next_row()[1]);
    sample.inputs = 2u; /* another input is none of ours */
    period();
    expect_sample();
}

/* A board whose words are wrong does not upset the rows. */
static void test_the_marks_are_no_part_of_the_adc_words(void)
{
    record();
    sample.i_u_counts |= 0x8000u;
    sample.i_v_counts |= 0x8000u;
    sample.i_w_counts |= 0x8000u;
    sample.u_uv_counts = 0xFFFFu;
    period();
    const uint32_t *row = next_row();
    TEST_ASSERT_EQUAL_HEX32(0u, row[0] & 0x80008000u);
    TEST_ASSERT_EQUAL_HEX32(0u, row[1] & 0x8000u);
    TEST_ASSERT_EQUAL_HEX32(0xFFFFu, row[1] >> 16u);
}

static void test_a_parameter_is_told_with_the_value_in_force(void)
{
    record();
    params.i_d_A = 3.5f;
    unit.flight.changed = (uint32_t)params_find("i_d_A");
    unit.flight.changes = 9u;
    TEST_ASSERT_TRUE(unit_reconfigure(&unit, &params));
    period();
    expect_kind(FLIGHT_PARAMETER, (uint32_t)params_find("i_d_A"), float_bits(3.5f), 9u);
    expect_sample();
    period();
    expect_sample();
    nothing_more();
}

/* A set that is refused makes the period take the old one again. */
static void test_a_refused_parameter_is_told_with_the_old_value(void)
{
    record();
    const float before = params.i_d_A;
    params.i_d_A = -1.0f;
    unit.flight.changed = (uint32_t)params_find("i_d_A");
    TEST_ASSERT_FALSE(unit_reconfigure(&unit, &params));
    period();
    expect_kind(FLIGHT_PARAMETER, (uint32_t)params_find("i_d_A"), float_bits(before), 0u);
    expect_sample();
}

static void test_crests_missed_and_faults_of_the_background_are_an_event(void)
{
    record();
    sample.late_periods = 3u;
    period();
    expect_kind(FLIGHT_EVENT, 3u, 0u, 0u);
    expect_sample();
    period();
    expect_sample();
    unit.mailbox.faults = FAULT_TABLE_CRC;
    period();
    expect_kind(FLIGHT_EVENT, 0u, FAULT_TABLE_CRC, 0u);
    expect_sample();
    period();
    expect_sample();
    nothing_more();
}

static void test_the_port_counts_its_crests_from_before_the_recording(void)
{
    sample.late_periods = 1u;
    unit.late_periods = 1u;
    record();
    sample.late_periods = 0u; /* wraps */
    period();
    expect_kind(FLIGHT_EVENT, 0xFFFFu, 0u, 0u);
}

static void test_every_256_samples_a_digest_of_the_outputs(void)
{
    arm();
    period();
    uint32_t digest = 0u;
    for (uint32_t k = 0u; k < 255u; k++) {
        period();
        digest = unit_flight_digest(&unit, &output, digest);
        TEST_ASSERT_TRUE(flight_take(&unit.flight, unit.flight.written));
    }
    read = unit.flight.written;
    period();
    digest = unit_flight_digest(&unit, &output, digest);
    expect_sample();
    expect_kind(FLIGHT_CHECK, 0u, digest, 256u);
    nothing_more();
}

static void test_every_output_is_in_the_digest(void)
{
    const hal_output_t before = output;
    const uint32_t digest = unit_flight_digest(&unit, &output, 1u);
    TEST_ASSERT_NOT_EQUAL_UINT32(digest, unit_flight_digest(&unit, &output, 2u));
    float *const duty[] = {&output.duty_u, &output.duty_v, &output.duty_w};
    for (size_t k = 0u; k < 3u; k++) {
        *duty[k] += 0.125f;
        TEST_ASSERT_NOT_EQUAL_UINT32(digest, unit_flight_digest(&unit, &output, 1u));
        output = before;
    }
    output.gates_on = !before.gates_on;
    const uint32_t gates = unit_flight_digest(&unit, &output, 1u);
    output = before;
    output.brake_on = !before.brake_on;
    const uint32_t brake = unit_flight_digest(&unit, &output, 1u);
    output = before;
    unit.machine.id = SEQUENCE_TORQUE_OFF;
    const uint32_t state = unit_flight_digest(&unit, &output, 1u);
    unit.machine.id = SEQUENCE_READY;
    unit.machine.faults = FAULT_STALL;
    const uint32_t faults = unit_flight_digest(&unit, &output, 1u);
    const uint32_t all[] = {digest, gates, brake, state, faults};
    for (size_t k = 0u; k < 5u; k++) {
        for (size_t n = 0u; n < k; n++) {
            TEST_ASSERT_NOT_EQUAL_UINT32(all[n], all[k]);
        }
    }
}

static void test_with_the_gates_off_every_state_has_its_digest(void)
{
    output.gates_on = false;
    unit.machine.id = SEQUENCE_READY;
    const uint32_t ready = unit_flight_digest(&unit, &output, 1u);
    unit.machine.id = (sequence_id_t)((uint32_t)SEQUENCE_READY ^ 1u);
    TEST_ASSERT_NOT_EQUAL_UINT32(ready, unit_flight_digest(&unit, &output, 1u));
}

/* The words of a known output, folded one by one. */
static void test_the_digest_folds_duties_state_and_faults_in_this_order(void)
{
    unit.machine.id = SEQUENCE_RUN;
    unit.machine.faults = FAULT_DERATED;
    for (uint32_t brake = 0u; brake < 2u; brake++) {
        const hal_output_t out = {0.25f, 0.5f, 0.75f, true, brake != 0u};
        const uint32_t word[] = {float_bits(0.25f), float_bits(0.5f), float_bits(0.75f),
                                 0x104u + 0x200u * brake, FAULT_DERATED};
        uint32_t expected = 5u;
        for (size_t k = 0u; k < 5u; k++) {
            expected = flight_fold(expected, word[k]);
        }
        TEST_ASSERT_EQUAL_HEX32(expected, unit_flight_digest(&unit, &out, 5u));
    }
}

static void test_a_full_ring_ends_the_recording_and_counts_what_is_lost(void)
{
    arm();
    periods(ROWS + 20u);
    TEST_ASSERT_EQUAL_UINT32(FLIGHT_LOST, unit.flight.state);
    const uint32_t written = unit.flight.written;
    TEST_ASSERT_TRUE(written > ROWS - FLIGHT_PER_PERIOD);
    TEST_ASSERT_TRUE(written <= ROWS);
    const uint32_t lost = unit.flight.lost;
    TEST_ASSERT_TRUE(flight_take(&unit.flight, written)); /* room again: too late */
    periods(5u);
    TEST_ASSERT_EQUAL_UINT32(written, unit.flight.written);
    TEST_ASSERT_EQUAL_UINT32(lost + 5u, unit.flight.lost);
    TEST_ASSERT_EQUAL_UINT32(ROWS + 20u - 1u, unit.flight.samples + lost);
}

static void test_nothing_is_written_when_nobody_asked(void)
{
    memset(memory, 0xEE, sizeof memory);
    periods(10u);
    TEST_ASSERT_EQUAL_UINT32(0u, unit.flight.written);
    TEST_ASSERT_EACH_EQUAL_HEX32(0xEEEEEEEEu, memory, sizeof memory / sizeof memory[0]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_begins_with_what_a_replay_cannot_know);
    RUN_TEST(test_begins_with_the_drive_as_from_its_start);
    RUN_TEST(test_the_drive_is_ready_again_as_after_power_up);
    RUN_TEST(test_a_drive_that_was_started_meanwhile_is_not_touched);
    RUN_TEST(test_gates_that_are_asked_for_are_enough_to_refuse);
    RUN_TEST(test_is_allowed_in_ready_without_a_start_command_and_with_a_bit_to_spare);
    RUN_TEST(test_a_command_stands_in_front_of_the_sample_it_came_with);
    RUN_TEST(test_a_host_that_is_alive_marks_the_second_word);
    RUN_TEST(test_a_break_marks_the_third_word);
    RUN_TEST(test_the_marks_are_no_part_of_the_adc_words);
    RUN_TEST(test_a_parameter_is_told_with_the_value_in_force);
    RUN_TEST(test_a_refused_parameter_is_told_with_the_old_value);
    RUN_TEST(test_crests_missed_and_faults_of_the_background_are_an_event);
    RUN_TEST(test_the_port_counts_its_crests_from_before_the_recording);
    RUN_TEST(test_every_256_samples_a_digest_of_the_outputs);
    RUN_TEST(test_every_output_is_in_the_digest);
    RUN_TEST(test_with_the_gates_off_every_state_has_its_digest);
    RUN_TEST(test_the_digest_folds_duties_state_and_faults_in_this_order);
    RUN_TEST(test_a_full_ring_ends_the_recording_and_counts_what_is_lost);
    RUN_TEST(test_nothing_is_written_when_nobody_asked);
    return UNITY_END();
}
