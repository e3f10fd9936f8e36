/* The Modbus slave: frames by their silence, registers, functions and exceptions. */
#include "modbus.h"

#include <math.h>
#include <string.h>

#include "bus_fixture.h"
#include "fieldbus_actual.h"
#include "fieldbus_params.h"
#include "modbus_crc.h"
#include "unit_signal.h"

#define SILENCE_US 1750u
#define TAPE       1024u

static modbus_t modbus;
static uint8_t tape[TAPE];
static uint32_t tape_at_us[TAPE];
static uint32_t tape_n;
static uint32_t tape_taken;
static uint32_t now_us;
static uint8_t said[TAPE];
static uint32_t said_n;
static uint32_t room; /* of the line, per slice */

static bool line_read(void *context, uint8_t *byte, uint32_t *at_us)
{
    (void)context;
    if (tape_taken >= tape_n) {
        return false;
    }
    *byte = tape[tape_taken];
    *at_us = tape_at_us[tape_taken];
    tape_taken++;
    return true;
}

static uint32_t line_write(void *context, const uint8_t *data, uint32_t n)
{
    (void)context;
    const uint32_t taken = (n < room) ? n : room;
    memcpy(&said[said_n], data, taken);
    said_n += taken;
    return taken;
}

static uint32_t line_clock(void *context)
{
    (void)context;
    return now_us;
}

static const hal_serial_t line = {
    .silence_us = SILENCE_US, .read = line_read, .write = line_write, .clock_us = line_clock};

void setUp(void)
{
    start_drive();
    modbus = (modbus_t){0};
    tape_n = 0u;
    tape_taken = 0u;
    said_n = 0u;
    now_us = UINT32_MAX - 5000u; /* wraps meanwhile */
    room = TAPE;
}
void tearDown(void)
{
}

/* Bytes onto the line, a character apart. */
static void receive(const uint8_t *byte, uint32_t n)
{
    for (uint32_t k = 0u; k < n; k++) {
        now_us += 96u;
        tape[tape_n] = byte[k];
        tape_at_us[tape_n] = now_us;
        tape_n++;
    }
}

static void slices(uint32_t n)
{
    for (uint32_t k = 0u; k < n; k++) {
        modbus_background(&modbus, &fb, unit(), &line);
    }
}

static void send_to(uint8_t address, const uint8_t *pdu, uint32_t n)
{
    uint8_t frame[MODBUS_FRAME_MAX];
    frame[0] = address;
    memcpy(&frame[1], pdu, n);
    const uint16_t crc = modbus_crc(frame, n + 1u);
    frame[n + 1u] = (uint8_t)crc;
    frame[n + 2u] = (uint8_t)(crc >> 8);
    receive(frame, n + 3u);
}

/* The answer's PDU behind its address, its CRC checked; bytes of it. */
static const uint8_t *ask(const uint8_t *pdu, uint32_t n, uint32_t *answer_n)
{
    tape_n = 0u;
    tape_taken = 0u;
    said_n = 0u;
    send_to(1u, pdu, n);
    now_us += SILENCE_US;
    slices(8u);
    TEST_ASSERT_TRUE(said_n >= 5u);
    TEST_ASSERT_EQUAL_HEX8(1u, said[0]);
    TEST_ASSERT_EQUAL_HEX16(0u, modbus_crc(said, said_n)); /* over itself */
    *answer_n = said_n - 3u;
    return &said[1];
}

#define ASK(n, ...) ask((const uint8_t[]){__VA_ARGS__}, sizeof((const uint8_t[]){__VA_ARGS__}), n)

/* 0, or the exception, to bytes that may be no request. */
#define EXCEPTION_OF(...)                                                                          \
    exception_of((const uint8_t[]){__VA_ARGS__}, sizeof((const uint8_t[]){__VA_ARGS__}))

static uint32_t exception_of(const uint8_t *pdu, uint32_t n)
{
    uint32_t answer_n = 0u;
    const uint8_t *answer = ask(pdu, n, &answer_n);
    if (answer[0] == pdu[0]) {
        return 0u;
    }
    TEST_ASSERT_EQUAL_HEX8(pdu[0] | 0x80u, answer[0]);
    TEST_ASSERT_EQUAL_UINT32(2u, answer_n);
    return answer[1];
}

static uint32_t read_words(uint8_t function, uint32_t address, uint32_t n, uint16_t *value)
{
    uint32_t answer_n = 0u;
    const uint8_t *answer = ASK(&answer_n, function, (uint8_t)(address >> 8), (uint8_t)address,
                                (uint8_t)(n >> 8), (uint8_t)n);
    if (answer[0] != function) {
        return answer[1];
    }
    TEST_ASSERT_EQUAL_UINT32(2u + 2u * n, answer_n);
    TEST_ASSERT_EQUAL_UINT32(2u * n, answer[1]);
    for (uint32_t k = 0u; k < n; k++) {
        value[k] = (uint16_t)((answer[2u + 2u * k] << 8) | answer[3u + 2u * k]);
    }
    return 0u;
}

static uint32_t write_one(uint32_t address, uint32_t value)
{
    return EXCEPTION_OF(6u, (uint8_t)(address >> 8), (uint8_t)address, (uint8_t)(value >> 8),
                        (uint8_t)value);
}

static uint32_t write_long(uint32_t address, uint32_t bits)
{
    return EXCEPTION_OF(16u, (uint8_t)(address >> 8), (uint8_t)address, 0u, 2u, 4u,
                        (uint8_t)(bits >> 24), (uint8_t)(bits >> 16), (uint8_t)(bits >> 8),
                        (uint8_t)bits);
}

static uint32_t address_of(const char *name)
{
    const size_t index = params_find(name);
    const uint32_t group = params_info(index)->group;
    uint32_t k = 0u;
    while (fieldbus_param_at(group, k) != index) {
        k++;
    }
    return MODBUS_LIST_AT + MODBUS_GROUP * group + 2u * k;
}

static void test_crc_is_that_of_the_standard(void)
{
    TEST_ASSERT_EQUAL_HEX16(0x4B37u, modbus_crc((const uint8_t *)"123456789", 9u));
    TEST_ASSERT_EQUAL_HEX16(0x1241u, modbus_crc((const uint8_t[]){2u, 7u}, 2u));
}

static void test_silence_is_three_and_a_half_characters(void)
{
    TEST_ASSERT_EQUAL_UINT32(4011u, modbus_rtu_silence_us(9600u)); /* 38.5 bits, rounded up */
    TEST_ASSERT_EQUAL_UINT32(2006u, modbus_rtu_silence_us(19200u));
    TEST_ASSERT_EQUAL_UINT32(1750u, modbus_rtu_silence_us(19201u));
    TEST_ASSERT_EQUAL_UINT32(1750u, modbus_rtu_silence_us(115200u));
}

static void test_an_echo_comes_back_after_the_silence_and_not_before(void)
{
    const uint8_t echo[] = {8u, 0u, 0u, 0xA5u, 0x5Au};
    send_to(1u, echo, sizeof echo);
    now_us += SILENCE_US - 1u;
    slices(4u);
    TEST_ASSERT_EQUAL_UINT32(0u, said_n);
    now_us += 1u;
    slices(1u);
    TEST_ASSERT_EQUAL_UINT32(8u, said_n);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(echo, &said[1], sizeof echo);
    slices(2u);
    TEST_ASSERT_EQUAL_UINT32(8u, said_n); /* once */
    TEST_ASSERT_EQUAL_UINT32(1u, modbus.rtu.good);
    TEST_ASSERT_EQUAL_UINT32(0u, modbus.rtu.bad);
}

static void test_two_frames_waiting_are_two_requests(void)
{
    const uint8_t echo[] = {8u, 0u, 0u, 1u, 2u};
    send_to(1u, echo, sizeof echo);
    now_us += SILENCE_US;
    send_to(1u, echo, sizeof echo);
    now_us += SILENCE_US;
    slices(1u);
    TEST_ASSERT_EQUAL_UINT32(8u, said_n);
    slices(1u);
    TEST_ASSERT_EQUAL_UINT32(16u, said_n);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(said, &said[8], 8u);
}

static void test_what_is_no_whole_frame_gets_no_answer(void)
{
    static const uint8_t noise[300] = {0};
    const uint8_t damaged[] = {1u, 8u, 0u, 0u, 0u, 0u, 0xE0u, 0x0Au}; /* right: 0x0B */
    receive(damaged, sizeof damaged);
    now_us += SILENCE_US;
    slices(2u);
    TEST_ASSERT_EQUAL_UINT32(1u, modbus.rtu.bad);
    const uint16_t crc = modbus_crc((const uint8_t[]){1u}, 1u);
    receive((const uint8_t[]){1u, (uint8_t)crc, (uint8_t)(crc >> 8)}, 3u); /* no function */
    now_us += SILENCE_US;
    slices(2u);
    TEST_ASSERT_EQUAL_UINT32(2u, modbus.rtu.bad);
    receive(noise, sizeof noise); /* too long; ends with the CRC of nothing */
    now_us += SILENCE_US;
    slices(8u);
    TEST_ASSERT_EQUAL_UINT32(3u, modbus.rtu.bad);
    TEST_ASSERT_EQUAL_UINT32(0u, modbus.rtu.good);
    TEST_ASSERT_EQUAL_UINT32(0u, said_n);
    TEST_ASSERT_EQUAL_UINT32(0u, EXCEPTION_OF(8u, 0u, 0u, 0u, 0u)); /* and in step again */
}

static void test_the_longest_frame_is_256_bytes(void)
{
    uint8_t pdu[MODBUS_FRAME_MAX - 3u] = {16u, 0u, 0u, 0u, 123u, 246u};
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_ADDRESS, exception_of(pdu, 6u + 246u));
    pdu[0] = 99u;
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_FUNCTION, exception_of(pdu, sizeof pdu));
    send_to(1u, pdu, sizeof pdu);
    receive((const uint8_t[]){0u}, 1u); /* one more spoils it */
    now_us += SILENCE_US;
    said_n = 0u;
    slices(8u);
    TEST_ASSERT_EQUAL_UINT32(0u, said_n);
    TEST_ASSERT_EQUAL_UINT32(1u, modbus.rtu.bad);
}

static void test_another_address_is_not_answered_and_changes_nothing(void)
{
    send_to(2u, (const uint8_t[]){6u, 0u, 1u, 0u, 60u}, 5u);
    now_us += SILENCE_US;
    slices(3u);
    TEST_ASSERT_EQUAL_UINT32(0u, said_n);
    TEST_ASSERT_EQUAL_UINT32(0u, fb.commands);
    unit()->params.fieldbus_address = 2u;
    send_to(2u, (const uint8_t[]){6u, 0u, 1u, 0u, 60u}, 5u);
    now_us += SILENCE_US;
    slices(3u);
    TEST_ASSERT_EQUAL_UINT32(1u, fb.commands);
    TEST_ASSERT_EQUAL_HEX8(2u, said[0]);
}

static void test_a_broadcast_writes_and_is_not_answered(void)
{
    send_to(0u, (const uint8_t[]){6u, 0u, 1u, 0u, 60u}, 5u);
    now_us += SILENCE_US;
    slices(3u);
    TEST_ASSERT_EQUAL_UINT32(0u, said_n);
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 2.0f * NUM_PI, fb.demand.omega_m_ref_rad_s);
}

static void test_an_answer_waits_for_the_line(void)
{
    send_to(1u, (const uint8_t[]){8u, 0u, 0u, 0u, 0u}, 5u);
    now_us += SILENCE_US;
    room = 3u;
    slices(1u);
    TEST_ASSERT_EQUAL_UINT32(3u, said_n);
    slices(1u);
    TEST_ASSERT_EQUAL_UINT32(6u, said_n);
    slices(1u);
    TEST_ASSERT_EQUAL_UINT32(8u, said_n);
    slices(1u);
    TEST_ASSERT_EQUAL_UINT32(8u, said_n);
}

static void test_a_slice_is_short(void)
{
    static const uint8_t noise[200] = {7u};
    receive(noise, sizeof noise);
    slices(1u);
    TEST_ASSERT_EQUAL_UINT32(64u, tape_taken);
}

static void test_unknown_functions_and_lengths(void)
{
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_FUNCTION, EXCEPTION_OF(1u, 0u, 0u, 0u, 1u));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_FUNCTION, EXCEPTION_OF(43u));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_FUNCTION, EXCEPTION_OF(8u, 0u, 1u, 0u, 0u));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_VALUE, EXCEPTION_OF(3u, 0u, 0u, 0u));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_VALUE, EXCEPTION_OF(3u, 0u, 0u, 0u, 1u, 0u));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_VALUE, EXCEPTION_OF(6u, 0u, 1u, 0u, 0u, 0u));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_VALUE, EXCEPTION_OF(16u, 0u, 0u, 0u, 1u, 2u));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_VALUE, EXCEPTION_OF(3u, 0u, 0u, 0u, 0u));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_VALUE, EXCEPTION_OF(4u, 0u, 0u, 0u, 126u));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_VALUE, EXCEPTION_OF(16u, 0u, 1u, 0u, 0u, 0u, 0u));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_VALUE, EXCEPTION_OF(16u, 0u, 1u, 0u, 124u, 248u, 0u));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_VALUE, EXCEPTION_OF(16u, 0u, 1u, 0u, 1u, 4u, 0u, 1u));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_VALUE,
                             EXCEPTION_OF(16u, 0u, 1u, 0u, 1u, 2u, 0u, 1u, 0u));
    TEST_ASSERT_EQUAL_UINT32(0u, fb.commands);
    TEST_ASSERT_EQUAL_UINT32(0u, EXCEPTION_OF(16u, 0u, 1u, 0u, 1u, 2u, 0u, 1u));
    TEST_ASSERT_EQUAL_UINT32(1u, fb.commands);
}

static void test_a_write_is_answered_with_its_address_and_value(void)
{
    uint32_t n = 0u;
    const uint8_t *one = ASK(&n, 6u, 0u, 1u, 0u, 60u);
    TEST_ASSERT_EQUAL_UINT32(5u, n);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(((const uint8_t[]){6u, 0u, 1u, 0u, 60u}), one, 5u);
    const uint8_t *several = ASK(&n, 16u, 0u, 0u, 0u, 2u, 4u, 0u, 0u, 0u, 61u);
    TEST_ASSERT_EQUAL_UINT32(5u, n);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(((const uint8_t[]){16u, 0u, 0u, 0u, 2u}), several, 5u);
}

static void test_the_command_is_read_back_as_it_was_written(void)
{
    uint16_t value[6];
    TEST_ASSERT_EQUAL_UINT32(0u, write_one(MODBUS_CONTROL, 0u));
    TEST_ASSERT_EQUAL_UINT32(0u, write_one(MODBUS_SPEED, (uint16_t)-900));
    TEST_ASSERT_EQUAL_UINT32(0u, write_long(MODBUS_TORQUE_FLOAT, float_bits(1.5f)));
    TEST_ASSERT_EQUAL_UINT32(0u, write_one(MODBUS_CONTROL, MODBUS_RUN | MODBUS_COAST |
                                                               MODBUS_TORQUE_MODE | MODBUS_RESET));
    TEST_ASSERT_EQUAL_HEX32(SEQUENCE_CMD_RUN | SEQUENCE_CMD_TORQUE_OFF | SEQUENCE_CMD_TORQUE_MODE |
                                SEQUENCE_CMD_FAULT_RESET,
                            fb.demand.command);
    TEST_ASSERT_EQUAL_UINT32(0u, read_words(3u, 0u, 6u, value));
    TEST_ASSERT_EQUAL_HEX16(0x0087u, value[0]);
    TEST_ASSERT_EQUAL_HEX16((uint16_t)-900, value[1]);
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, -900.0f, float_of_bits(((uint32_t)value[2] << 16) | value[3]));
    TEST_ASSERT_EQUAL_HEX32(float_bits(1.5f), ((uint32_t)value[4] << 16) | value[5]);
    TEST_ASSERT_EQUAL_UINT32(0u, write_long(MODBUS_SPEED_FLOAT, float_bits(12.6f)));
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 12.6f * NUM_PI / 30.0f, fb.demand.omega_m_ref_rad_s);
    TEST_ASSERT_EQUAL_UINT32(0u, read_words(3u, MODBUS_SPEED, 1u, value));
    TEST_ASSERT_EQUAL_UINT32(13u, value[0]); /* rounded */
    TEST_ASSERT_EQUAL_UINT32(0u, write_long(MODBUS_SPEED_FLOAT, float_bits(-12.6f)));
    TEST_ASSERT_EQUAL_UINT32(0u, read_words(3u, MODBUS_SPEED, 1u, value));
    TEST_ASSERT_EQUAL_HEX16((uint16_t)-13, value[0]);
}

static void test_each_bit_of_the_control_word_is_one_command(void)
{
    static const struct {
        uint32_t bus;
        uint32_t drive;
    } pair[] = {{1u, SEQUENCE_CMD_RUN},
                {2u, SEQUENCE_CMD_TORQUE_OFF},
                {4u, SEQUENCE_CMD_TORQUE_MODE},
                {128u, SEQUENCE_CMD_FAULT_RESET}};
    TEST_ASSERT_EQUAL_UINT32(0u, write_one(MODBUS_CONTROL, 0u));
    for (size_t k = 0u; k < sizeof pair / sizeof pair[0]; k++) {
        uint16_t word = 0u;
        TEST_ASSERT_EQUAL_UINT32(0u, write_one(MODBUS_CONTROL, pair[k].bus));
        TEST_ASSERT_EQUAL_HEX32(pair[k].drive, fb.demand.command);
        TEST_ASSERT_EQUAL_UINT32(0u, read_words(3u, MODBUS_CONTROL, 1u, &word));
        TEST_ASSERT_EQUAL_HEX16(pair[k].bus, word);
    }
    for (uint32_t bit = 0u; bit < 16u; bit++) {
        const bool known = (0x87u & (1u << bit)) != 0u;
        TEST_ASSERT_EQUAL_UINT32(known ? 0u : MODBUS_ILLEGAL_VALUE,
                                 write_one(MODBUS_CONTROL, 1u << bit));
    }
}

static void test_a_refused_command_changes_nothing(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, write_one(MODBUS_SPEED, 60u));
    const fieldbus_t before = fb;
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_VALUE, write_one(MODBUS_SPEED, 32767u));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_VALUE, write_long(MODBUS_SPEED_FLOAT, float_bits(NAN)));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_VALUE,
                             write_long(MODBUS_TORQUE_FLOAT, float_bits(INFINITY)));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_ADDRESS, write_one(MODBUS_SPEED_FLOAT, 1u));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_ADDRESS, write_long(MODBUS_SPEED_FLOAT + 1u, 1u));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_ADDRESS, write_long(MODBUS_COMMAND_END, 1u));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_ADDRESS, write_one(MODBUS_LIST_AT - 1u, 1u));
    /* A good speed before a bad control word, a bad half behind a good word. */
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_VALUE,
                             EXCEPTION_OF(16u, 0u, 0u, 0u, 2u, 4u, 1u, 0u, 0u, 61u));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_ADDRESS,
                             EXCEPTION_OF(16u, 0u, 1u, 0u, 2u, 4u, 0u, 61u, 0u, 0u));
    /* A speed out of range before the same one in range. */
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_VALUE, EXCEPTION_OF(16u, 0u, 1u, 0u, 3u, 6u, 0x60u,
                                                                0xF9u, 0x42u, 0x70u, 0u, 0u));
    unit()->params.fieldbus_commands = 0u;
    TEST_ASSERT_EQUAL_UINT32(MODBUS_FAILURE, write_one(MODBUS_SPEED, 61u));
    unit()->params.fieldbus_commands = 1u;
    TEST_ASSERT_EQUAL_MEMORY(&before, &fb, sizeof fb);
}

static void test_while_the_host_runs_the_drive_a_write_fails(void)
{
    host_commands(SEQUENCE_CMD_RUN);
    TEST_ASSERT_EQUAL_UINT32(MODBUS_FAILURE, write_one(MODBUS_SPEED, 60u));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_FAILURE, write_one(MODBUS_CONTROL, 0u));
    host_commands(0u);
    TEST_ASSERT_EQUAL_UINT32(0u, write_one(MODBUS_CONTROL, 0u));
}

static void test_the_whole_command_in_one_request(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, write_one(MODBUS_CONTROL, 0u));
    TEST_ASSERT_EQUAL_UINT32(0u, EXCEPTION_OF(16u, 0u, 0u, 0u, 6u, 12u, 0u, 1u, 0u, 50u, 0x42u,
                                              0x70u, 0u, 0u, 0x40u, 0u, 0u, 0u));
    TEST_ASSERT_EQUAL_HEX32(SEQUENCE_CMD_RUN, fb.demand.command);
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 2.0f * NUM_PI, fb.demand.omega_m_ref_rad_s); /* 60, the later */
    TEST_ASSERT_EQUAL_FLOAT(2.0f, fb.demand.torque_ref_Nm);
    rounds(2u);
    TEST_ASSERT_EQUAL(SEQUENCE_PREMAGNETISE, unit()->machine.id);
}

static void test_actual_values_in_both_widths(void)
{
    uint16_t v[16];
    unit()->drive.estimator.estimate.lambda_r_hat_Wb = (ab_t){0.5f, 0.0f};
    unit()->drive.estimator.estimate.omega_e_rad_s = -4.0f * NUM_PI;
    unit()->last.meas.i_s_A = (ab_t){3.0f, 4.0f};
    unit()->last.meas.u_dc_V = 281.26f;
    unit()->machine.faults = 0x12345678u;
    TEST_ASSERT_EQUAL_UINT32(0u, read_words(4u, 0u, 16u, v));
    fieldbus_actual_t a;
    fieldbus_actual(&fb, unit(), &a);
    TEST_ASSERT_EQUAL_HEX16(a.status, v[0]);
    TEST_ASSERT_EQUAL_HEX16((uint16_t)-60, v[1]);
    TEST_ASSERT_EQUAL_UINT32(40u, v[2]);
    TEST_ASSERT_EQUAL_UINT32(289u, v[3]);
    TEST_ASSERT_EQUAL_UINT32(2813u, v[4]);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_READY, v[5]);
    TEST_ASSERT_EQUAL_HEX16(0x1234u, v[6]);
    TEST_ASSERT_EQUAL_HEX16(0x5678u, v[7]);
    const float expected[] = {a.speed_rpm, a.torque_Nm, a.current_A, a.u_dc_V};
    for (uint32_t k = 0u; k < 4u; k++) {
        TEST_ASSERT_EQUAL_HEX32(float_bits(expected[k]),
                                ((uint32_t)v[8u + 2u * k] << 16) | v[9u + 2u * k]);
    }
    unit()->drive.guard.speed.speed_unknown = true;
    TEST_ASSERT_EQUAL_UINT32(0u, read_words(4u, 1u, 1u, v));
    TEST_ASSERT_EQUAL_HEX16(0x8000u, v[0]);
    unit()->drive.guard.speed.speed_unknown = false;
    unit()->drive.estimator.estimate.omega_e_rad_s = 1e6f;
    TEST_ASSERT_EQUAL_UINT32(0u, read_words(4u, 1u, 1u, v));
    TEST_ASSERT_EQUAL_HEX16(32767u, v[0]);
    unit()->drive.estimator.estimate.omega_e_rad_s = -1e6f;
    TEST_ASSERT_EQUAL_UINT32(0u, read_words(4u, 1u, 1u, v));
    TEST_ASSERT_EQUAL_HEX16((uint16_t)-32767, v[0]);
}

static void test_actual_values_are_rounded_from_either_side(void)
{
    uint16_t value = 0u;
    unit()->drive.estimator.estimate.lambda_r_hat_Wb = (ab_t){0.5f, 0.0f};
    const params_t *p = &unit()->params;
    const float Nm_per_A = p->pole_pairs * (p->M_H / p->Lr_H) * 0.5f;
    static const float tenths_Nm[] = {-0.53f, -0.47f, 0.47f, 0.53f};
    static const uint16_t expected[] = {0xFFFFu, 0u, 0u, 1u};
    for (size_t k = 0u; k < 4u; k++) {
        unit()->last.meas.i_s_A = (ab_t){0.0f, 0.1f * tenths_Nm[k] / Nm_per_A};
        TEST_ASSERT_EQUAL_UINT32(0u, read_words(4u, 2u, 1u, &value));
        TEST_ASSERT_EQUAL_HEX16(expected[k], value);
    }
}

static void test_every_signal_is_an_input_register_pair(void)
{
    uint16_t v[2];
    for (uint32_t n = 0u; n < UNIT_SIGNALS; n++) {
        TEST_ASSERT_EQUAL_UINT32(0u, read_words(4u, MODBUS_LIST_AT + 2u * n, 2u, v));
        TEST_ASSERT_EQUAL_HEX32(unit_signal(unit(), n), ((uint32_t)v[0] << 16) | v[1]);
    }
    const uint32_t behind = MODBUS_LIST_AT + 2u * UNIT_SIGNALS;
    TEST_ASSERT_EQUAL_UINT32(0u, read_words(4u, behind - 1u, 1u, v));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_ADDRESS, read_words(4u, behind - 1u, 2u, v));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_ADDRESS, read_words(4u, 16u, 1u, v));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_ADDRESS, read_words(4u, MODBUS_LIST_AT - 1u, 1u, v));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_ADDRESS, read_words(4u, 65535u, 2u, v));
}

static void test_every_parameter_is_a_holding_register_pair(void)
{
    uint16_t v[2];
    for (size_t i = 0u; i < params_count(); i++) {
        TEST_ASSERT_EQUAL_UINT32(0u, read_words(3u, address_of(params_name(i)), 2u, v));
        TEST_ASSERT_EQUAL_HEX32(fieldbus_param_bits(unit(), i), ((uint32_t)v[0] << 16) | v[1]);
    }
    TEST_ASSERT_EQUAL_UINT32(1000u, address_of("Rs_ohm"));
    TEST_ASSERT_EQUAL_UINT32(1110u, address_of("swap_vw"));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_ADDRESS, read_words(3u, 6u, 1u, v));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_ADDRESS, read_words(3u, MODBUS_LIST_AT - 1u, 1u, v));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_ADDRESS,
                             read_words(3u, 1012u, 1u, v)); /* six of motor */
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_ADDRESS,
                             read_words(3u, MODBUS_LIST_AT + MODBUS_GROUP * PARAM_GROUPS, 1u, v));
}

static void test_a_group_fits_between_two(void)
{
    for (uint32_t group = 0u; group < PARAM_GROUPS; group++) {
        TEST_ASSERT_EQUAL_size_t(params_count(), fieldbus_param_at(group, MODBUS_GROUP / 2u));
    }
}

static void test_writes_of_parameters_have_their_exceptions(void)
{
    const uint32_t time = address_of("premagnetise_s");
    const uint32_t economy = address_of("economy_flux_min");
    TEST_ASSERT_EQUAL_UINT32(0u, write_long(time, float_bits(0.75f)));
    TEST_ASSERT_EQUAL_FLOAT(0.75f, unit()->params.premagnetise_s);
    TEST_ASSERT_EQUAL_UINT32(0u, write_long(time, 0x3F010101u));
    TEST_ASSERT_EQUAL_HEX32(0x3F010101u, float_bits(unit()->params.premagnetise_s));
    const params_t before = unit()->params;
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_VALUE, write_long(time, float_bits(-1.0f)));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_VALUE, write_long(time, float_bits(NAN)));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_FAILURE, write_long(economy, float_bits(0.05f)));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_ADDRESS, write_one(time, 1u));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_ADDRESS, write_long(time + 1u, 1u));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_ADDRESS, write_long(1012u, 1u));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_ADDRESS,
                             write_long(address_of("i_trip_A"), float_bits(100.0f)));
    TEST_ASSERT_EQUAL_UINT32(MODBUS_ILLEGAL_ADDRESS,
                             write_long(address_of("fieldbus_commands"), 0u));
    unit()->params.fieldbus_commands = 0u;
    TEST_ASSERT_EQUAL_UINT32(MODBUS_FAILURE, write_long(time, float_bits(0.5f)));
    unit()->params.fieldbus_commands = 1u;
    TEST_ASSERT_EQUAL_MEMORY(&before, &unit()->params, sizeof before);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_crc_is_that_of_the_standard);
    RUN_TEST(test_silence_is_three_and_a_half_characters);
    RUN_TEST(test_an_echo_comes_back_after_the_silence_and_not_before);
    RUN_TEST(test_two_frames_waiting_are_two_requests);
    RUN_TEST(test_what_is_no_whole_frame_gets_no_answer);
    RUN_TEST(test_the_longest_frame_is_256_bytes);
    RUN_TEST(test_another_address_is_not_answered_and_changes_nothing);
    RUN_TEST(test_a_broadcast_writes_and_is_not_answered);
    RUN_TEST(test_an_answer_waits_for_the_line);
    RUN_TEST(test_a_slice_is_short);
    RUN_TEST(test_unknown_functions_and_lengths);
    RUN_TEST(test_a_write_is_answered_with_its_address_and_value);
    RUN_TEST(test_the_command_is_read_back_as_it_was_written);
    RUN_TEST(test_each_bit_of_the_control_word_is_one_command);
    RUN_TEST(test_a_refused_command_changes_nothing);
    RUN_TEST(test_while_the_host_runs_the_drive_a_write_fails);
    RUN_TEST(test_the_whole_command_in_one_request);
    RUN_TEST(test_actual_values_in_both_widths);
    RUN_TEST(test_actual_values_are_rounded_from_either_side);
    RUN_TEST(test_every_signal_is_an_input_register_pair);
    RUN_TEST(test_every_parameter_is_a_holding_register_pair);
    RUN_TEST(test_a_group_fits_between_two);
    RUN_TEST(test_writes_of_parameters_have_their_exceptions);
    return UNITY_END();
}
