/* The host link of one drive, byte by byte as a host talks to it: what it tells, what it does, and
 * what it refuses. */
#include "unit_link.h"

#include <math.h>
#include <string.h>

#include "unit_link_drive.h"
#include "unit_link_requests.h"
#include "unit_record.h"
#include "unit_signal.h"
#include "command.h"
#include "crc32c.h"
#include "exact.h"
#include "host_port.h"
#include "ram_flash.h"
#include "unity.h"

#define TRACE_WORDS  256u
#define FLIGHT_WORDS (64u * FLIGHT_ROW_WORDS)

static host_port_t port;
static params_t params;
static uint32_t trace_memory[TRACE_WORDS];
static uint32_t flight_memory[FLIGHT_WORDS];
static fault_memory_t fault_memory;
static uint8_t sequence;
static int flicker;
static uint8_t answer_byte[4096];
static command_frame_t answer;
static command_parser_t answer_parser;
static uint32_t session;
static uint8_t session_key[SIPHASH_KEY_BYTES];
static uint32_t counter; /* of the last sealed request */
static bool sealing;     /* what needs it is sealed */
static ram_flash_t flash_memory;
static const hal_flash_t flash = RAM_FLASH(&flash_memory);
static const uint8_t key[SIPHASH_KEY_BYTES] = {1u, 2u, 3u};
static observer_gain_t gains[100];
static gain_table_t table;

static bool entropy(void *context, uint64_t *bits)
{
    *bits = 42u + ((const host_port_t *)context)->clock_us;
    return true;
}

static bool no_entropy(void *context, uint64_t *bits)
{
    (void)context;
    *bits = 0u;
    return false;
}

static unit_t *unit(void)
{
    return &port.unit;
}

/* One control period and one slice of the background, as a port's main loop has it. No voltages;
 * with the gates on 4.5 A along u, the magnetising current. The last bit of a word flickers, as
 * words do. */
static hal_output_t round_of_the_port(void)
{
    const int i_u_counts = (unit()->asked.mode != DRIVE_OFF) ? 1204 : 0;
    flicker ^= 1;
    const hal_sample_t rest = {(uint16_t)(8192 + i_u_counts + flicker),
                               (uint16_t)(8192 - i_u_counts / 2),
                               (uint16_t)(8192 - i_u_counts / 2),
                               8192u,
                               8192u,
                               11592u,
                               0u,
                               0u};
    hal_output_t out;
    const unit_command_t command = unit_link_command(unit());
    host_port_period(&port, &command, &rest, &out);
    return out;
}

/* Bytes to the drive; true when a good answer came, in `answer`. */
static bool talk(const uint8_t *byte, uint32_t n)
{
    port.line = (host_port_line_t){
        .received = byte, .received_n = n, .sent = answer_byte, .room = sizeof answer_byte};
    for (uint32_t k = 0u; k < n / 32u + 8u; k++) {
        (void)round_of_the_port();
    }
    TEST_ASSERT_EQUAL_UINT32(n, port.line.taken);
    bool good = false;
    for (uint32_t k = 0u; k < port.line.sent_n; k++) {
        if (command_byte(&answer_parser, answer_byte[k], &answer)) {
            TEST_ASSERT_FALSE(good); /* one answer to one request */
            good = true;
        }
    }
    port.line = (host_port_line_t){0};
    return good;
}

static command_writer_t ask(uint8_t op)
{
    command_writer_t w;
    sequence++;
    command_begin(&w, sequence, op);
    return w;
}

/* The same request with counter and MAC. */
static command_writer_t sealed(const command_writer_t *w)
{
    command_writer_t s;
    command_begin(&s, w->byte[2], UNIT_LINK_SEALED);
    const uint32_t from = s.length;
    for (uint32_t k = 3u; k < w->length; k++) {
        command_put_u8(&s, w->byte[k]); /* op and body */
    }
    command_put_u32(&s, ++counter);
    const uint64_t mac = siphash_2_4(session_key, &s.byte[from], s.length - from);
    command_put_u32(&s, (uint32_t)mac);
    command_put_u32(&s, (uint32_t)(mac >> 32u));
    return s;
}

static bool needs_seal(uint8_t op)
{
    return (op == UNIT_LINK_SET) || (op == UNIT_LINK_SAVE) || (op == UNIT_LINK_COMMAND) ||
           (op == UNIT_LINK_FAULT_CLEAR) || (op == UNIT_LINK_FLIGHT_ARM) ||
           (op == UNIT_LINK_LOADER);
}

/* Sends; the answer's status, and a reader behind it. */
static uint8_t send(command_writer_t *w, command_reader_t *body)
{
    if (sealing && needs_seal(w->byte[3])) {
        *w = sealed(w);
    }
    const uint8_t op = w->byte[3];
    command_end(w);
    TEST_ASSERT_TRUE(talk(w->byte, w->length));
    TEST_ASSERT_EQUAL_UINT8(sequence, answer.sequence);
    TEST_ASSERT_EQUAL_UINT8(op | UNIT_LINK_ANSWER, answer.op);
    *body = (command_reader_t){.at = answer.body, .left = answer.body_bytes};
    return command_take_u8(body);
}

static uint8_t send_only(command_writer_t *w)
{
    command_reader_t body;
    return send(w, &body);
}

static uint8_t command(uint32_t bits, float omega_m_rad_s, uint16_t valid_ms)
{
    command_writer_t w = ask(UNIT_LINK_COMMAND);
    command_put_u32(&w, session);
    command_put_u32(&w, bits);
    command_put_float(&w, omega_m_rad_s);
    command_put_u16(&w, valid_ms);
    return send_only(&w);
}

static uint8_t set(const char *name, float value)
{
    command_writer_t w = ask(UNIT_LINK_SET);
    command_put_u32(&w, session);
    command_put_u16(&w, (uint16_t)params_find(name));
    command_put_float(&w, value);
    return send_only(&w);
}

static void open_session(void)
{
    command_writer_t w = ask(UNIT_LINK_SESSION);
    command_reader_t body;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&w, &body));
    session = command_take_u32(&body);
    TEST_ASSERT_NOT_EQUAL_UINT32(0u, session);
    TEST_ASSERT_TRUE(command_all_taken(&body));
}

/* Answers a challenge for the purpose: "open", or "unlock" too. */
static uint8_t answer_challenge(const uint8_t *k, bool unlock)
{
    command_writer_t w = ask(UNIT_LINK_CHALLENGE);
    command_put_u32(&w, session);
    command_reader_t body;
    const uint8_t status = send(&w, &body);
    if (status != UNIT_LINK_OK) {
        return status;
    }
    const uint64_t low = command_take_u32(&body);
    const uint64_t nonce = low | ((uint64_t)command_take_u32(&body) << 32u);
    const uint64_t word = unlock ? access_response(k, nonce) : access_open_response(k, nonce);
    access_session_key(k, nonce, session_key);
    counter = 0u;
    w = ask(UNIT_LINK_UNLOCK);
    command_put_u32(&w, session);
    command_put_u32(&w, (uint32_t)word);
    command_put_u32(&w, (uint32_t)(word >> 32u));
    return send_only(&w);
}

/* In session and with the key, whatever is left of the time from power-up. */
static void enter(void)
{
    open_session();
    access_t *a = &unit()->store.access;
    const uint32_t waited = a->waited;
    a->waited = unit()->store.access_cfg.lockout_ticks;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, answer_challenge(key, false));
    a->waited = waited;
}

static void rounds(uint32_t n)
{
    for (uint32_t k = 0u; k < n; k++) {
        (void)round_of_the_port();
    }
}

void setUp(void)
{
    params_default(&params);
    params.observer_gain_enable = 0u;
    params.offset_calibration_s = 0.01f;
    params.premagnetise_s = 0.02f;
    TEST_ASSERT_TRUE(host_port_init(&port, &params, NULL));
    const host_port_store_t store = {.access_key = key, .entropy = entropy};
    TEST_ASSERT_TRUE(host_port_start(&port, &params, NULL, &store));
    sealing = true;
    port.background_every = 1u;
    port.until_background = 1u;
    memset(&fault_memory, 0, sizeof fault_memory);
    const unit_memory_t memory = {trace_memory, TRACE_WORDS, &fault_memory, flight_memory,
                                  FLIGHT_WORDS};
    host_port_record(&port, &memory);
    answer_parser = (command_parser_t){0};
    session = 0u;
    rounds(60u);
    enter();
}

void tearDown(void)
{
}

static void test_says_who_it_is(void)
{
    unit()->params.pole_pairs = 3.0f;
    command_writer_t w = ask(UNIT_LINK_HELLO);
    command_reader_t body;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&w, &body));
    TEST_ASSERT_EQUAL_UINT16(1u, command_take_u16(&body)); /* of the protocol: hosts rely on it */
    TEST_ASSERT_EQUAL_UINT16(params_count(), command_take_u16(&body));
    TEST_ASSERT_EQUAL_UINT16(UNIT_SIGNALS, command_take_u16(&body));
    TEST_ASSERT_EQUAL_UINT32(TRACE_WORDS, command_take_u32(&body));
    TEST_ASSERT_EQUAL_UINT32(0u, command_take_u32(&body)); /* no table: no motor, no CRC */
    TEST_ASSERT_EQUAL_UINT32(0u, command_take_u32(&body));
    TEST_ASSERT_EQUAL_FLOAT(200e-6f, command_take_float(&body));
    TEST_ASSERT_EQUAL_FLOAT(3.0f, command_take_float(&body));
    TEST_ASSERT_EQUAL_UINT8(strlen("ZeroHertz port=host"), command_take_u8(&body));
}

static void take(command_reader_t *body, size_t n)
{
    for (size_t k = 0u; k < n; k++) {
        (void)command_take_u8(body);
    }
}

static void expect_text(const char *text, command_reader_t *body)
{
    TEST_ASSERT_EQUAL_UINT8(strlen(text), command_take_u8(body));
    for (size_t k = 0u; k < strlen(text); k++) {
        TEST_ASSERT_EQUAL_UINT8(text[k], command_take_u8(body));
    }
}

static void test_lists_every_parameter_and_signal(void)
{
    for (size_t k = 0u; k < params_count(); k++) {
        const param_info_t *info = params_info(k);
        command_writer_t w = ask(UNIT_LINK_PARAM_INFO);
        command_put_u16(&w, (uint16_t)k);
        command_reader_t body;
        TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&w, &body));
        TEST_ASSERT_EQUAL_UINT8((info->type == PARAM_FLOAT) ? 0u : 1u, command_take_u8(&body));
        TEST_ASSERT_EQUAL_UINT8(info->access, command_take_u8(&body));
        TEST_ASSERT_EQUAL_FLOAT(info->minimum, command_take_float(&body));
        TEST_ASSERT_EQUAL_FLOAT(info->maximum, command_take_float(&body));
        TEST_ASSERT_EQUAL_FLOAT(params_get(&params, k), command_take_float(&body));
        TEST_ASSERT_EQUAL_UINT8(strlen(params_name(k)), command_take_u8(&body));
        TEST_ASSERT_EQUAL_MEMORY(params_name(k), body.at, strlen(params_name(k)));
        take(&body, strlen(params_name(k)));
        expect_text(param_unit(info), &body);
        expect_text(params_group_name(info->group), &body);
        const uint32_t choices = command_take_u8(&body);
        TEST_ASSERT_EQUAL_UINT32((param_choices(info) != NULL) ? info->maximum + 1.0f : 0.0f,
                                 choices);
        for (uint32_t n = 0u; n < choices; n++) {
            expect_text(param_choices(info)[n], &body);
        }
        TEST_ASSERT_TRUE(command_all_taken(&body));
    }
    for (uint32_t k = 0u; k < (uint32_t)UNIT_SIGNALS; k++) {
        command_writer_t w = ask(UNIT_LINK_SIGNAL_INFO);
        command_put_u8(&w, (uint8_t)k);
        command_reader_t body;
        TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&w, &body));
        TEST_ASSERT_EQUAL_UINT8(unit_signal_is_float(k) ? PARAM_FLOAT : PARAM_UINT,
                                command_take_u8(&body));
        TEST_ASSERT_EQUAL_UINT8(strlen(unit_signal_name(k)), command_take_u8(&body));
    }
    TEST_ASSERT_TRUE(unit_signal_is_float(UNIT_SIGNAL_duty_u));
    TEST_ASSERT_FALSE(unit_signal_is_float(UNIT_SIGNAL_faults));
    TEST_ASSERT_EQUAL_STRING("duty_u", unit_signal_name(0u));
    TEST_ASSERT_EQUAL_STRING("", unit_signal_name(UNIT_SIGNALS));
    TEST_ASSERT_EQUAL_HEX32(0u, unit_signal(unit(), UNIT_SIGNALS));
    TEST_ASSERT_FALSE(unit_signal_is_float(UNIT_SIGNALS));
}

static void test_a_parameter_that_was_set_is_read_back_and_in_the_control_law(void)
{
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, set("i_d_A", 3.25f));
    command_writer_t w = ask(UNIT_LINK_GET);
    command_put_u16(&w, (uint16_t)params_find("i_d_A"));
    command_put_u16(&w, (uint16_t)params_find("adc_bits"));
    command_reader_t body;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&w, &body));
    TEST_ASSERT_EQUAL_FLOAT(3.25f, command_take_float(&body));
    TEST_ASSERT_EQUAL_FLOAT(14.0f, command_take_float(&body));
    TEST_ASSERT_TRUE(command_all_taken(&body));
    TEST_ASSERT_EQUAL_FLOAT(3.25f, unit_config(unit())->drive.modes.vector.flux.i_d_A);
}

static void test_refuses_a_parameter_for_the_right_reason(void)
{
    const params_t before = unit()->params; /* words only: a config made anew differs in padding */
    const drive_config_t drive = unit_config(unit())->drive;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OUT_OF_RANGE, set("i_d_A", 1e5f));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_FINITE, set("i_d_A", NAN));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_WHOLE, set("eps1_mode", 0.5f));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SUCH, set("no_such_name", 0.0f));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_PROTECTED, set("Rs_ohm", 1.0f));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_REFUSED, set("eps1_off_Hz", 0.5f)); /* below eps1_on_Hz */
    TEST_ASSERT_EQUAL_MEMORY(&before, &unit()->params, sizeof before);
    TEST_ASSERT_EQUAL_FLOAT(drive.modes.vector.flux.i_d_A,
                            unit_config(unit())->drive.modes.vector.flux.i_d_A);
    TEST_ASSERT_EQUAL_FLOAT(drive.motor.Rs_ohm, unit_config(unit())->drive.motor.Rs_ohm);
    TEST_ASSERT_EQUAL_MEMORY(&drive.modes.vector.speed.pi,
                             &unit_config(unit())->drive.modes.vector.speed.pi,
                             sizeof drive.modes.vector.speed.pi);
}

static void test_a_ready_parameter_waits_for_the_gates_to_be_off(void)
{
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, set("swap_vw", 0.0f));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(SEQUENCE_CMD_RUN, 0.0f, 0u));
    rounds(3u);
    TEST_ASSERT_TRUE(unit()->asked.mode != DRIVE_OFF);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_NOW, set("swap_vw", 1.0f));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, set("i_d_A", 4.0f)); /* RUN: live */
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(0u, 0.0f, 0u));
    rounds(3u);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, set("swap_vw", 1.0f));
}

/* The gates are off, but the run command that stands may open them in any next period. */
static void test_a_standing_run_command_counts_as_gates_on(void)
{
    const unit_command_t run = {.command = SEQUENCE_CMD_RUN};
    TEST_ASSERT_TRUE(unit_at_rest(unit()));
    unit_post_command(unit(), &run);
    TEST_ASSERT_EQUAL(DRIVE_OFF, unit()->asked.mode);
    TEST_ASSERT_FALSE(unit_at_rest(unit()));
}

static void test_a_command_runs_and_stops_the_drive(void)
{
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(SEQUENCE_CMD_RUN, 3.5f, 0u));
    TEST_ASSERT_FALSE(unit()->link.reset);
    rounds(200u);
    TEST_ASSERT_EQUAL(SEQUENCE_RUN, unit()->machine.id);
    TEST_ASSERT_EQUAL_FLOAT(3.5f, unit_link_command(unit()).omega_m_ref_rad_s);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(SEQUENCE_CMD_TORQUE_OFF, 0.0f, 0u));
    TEST_ASSERT_EQUAL(SEQUENCE_TORQUE_OFF, unit()->machine.id);
}

static void test_a_torque_may_come_with_the_command(void)
{
    command_writer_t w = ask(UNIT_LINK_COMMAND);
    command_put_u32(&w, session);
    command_put_u32(&w, SEQUENCE_CMD_RUN | SEQUENCE_CMD_TORQUE_MODE);
    command_put_float(&w, 3.5f);
    command_put_u16(&w, 0u);
    command_put_float(&w, -1.25f);
    const uint32_t before = unit_link_command(unit()).count;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send_only(&w));
    const unit_command_t c = unit_link_command(unit());
    TEST_ASSERT_EQUAL_FLOAT(-1.25f, c.torque_ref_Nm);
    TEST_ASSERT_EQUAL_UINT32(before + 1u, c.count);
    rounds(200u);
    TEST_ASSERT_EQUAL(DRIVE_AIM_TORQUE, unit()->asked.aim);
    /* One that says nothing of it asks for none. */
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(SEQUENCE_CMD_RUN, 3.5f, 0u));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, unit_link_command(unit()).torque_ref_Nm);
    w = ask(UNIT_LINK_COMMAND);
    command_put_u32(&w, session);
    command_put_u32(&w, SEQUENCE_CMD_RUN);
    command_put_float(&w, 3.5f);
    command_put_u16(&w, 0u);
    command_put_float(&w, NAN);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_FINITE, send_only(&w));
}

static void test_a_command_that_is_none_is_refused_and_the_old_one_stands(void)
{
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(SEQUENCE_CMD_RUN, 3.5f, 0u));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OUT_OF_RANGE, command(32u, 1.0f, 0u));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_FINITE, command(0u, INFINITY, 0u));
    const unit_command_t c = unit_link_command(unit());
    TEST_ASSERT_EQUAL_HEX32(SEQUENCE_CMD_RUN, c.command);
    TEST_ASSERT_EQUAL_FLOAT(3.5f, c.omega_m_ref_rad_s);
}

static void test_a_silent_host_stops_the_drive_when_it_said_so(void)
{
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, set("command_timeout_s", 0.0f));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(SEQUENCE_CMD_RUN, 0.0f, 20u)); /* 100 periods */
    rounds(85u);
    TEST_ASSERT_TRUE(unit()->asked.mode != DRIVE_OFF);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(SEQUENCE_CMD_RUN, 0.0f, 20u));
    rounds(85u);
    TEST_ASSERT_TRUE(unit()->asked.mode != DRIVE_OFF); /* the repetition counts */
    rounds(30u);
    TEST_ASSERT_EQUAL(DRIVE_OFF, unit()->asked.mode);
    TEST_ASSERT_TRUE(unit()->link.expired);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(SEQUENCE_CMD_RUN, 0.0f, 0u));
    rounds(10000u);
    TEST_ASSERT_TRUE(unit()->asked.mode != DRIVE_OFF); /* 0: without end */
}

static uint8_t ask_commissioning(uint32_t word[4], float value[6u + 3u * COMMISSIONING_LEVELS])
{
    command_writer_t w = ask(UNIT_LINK_COMMISSIONING);
    command_reader_t body;
    const uint8_t status = send(&w, &body);
    for (size_t k = 0u; k < 4u; k++) {
        word[k] = command_take_u32(&body);
    }
    for (size_t k = 0u; k < 6u + 3u * COMMISSIONING_LEVELS; k++) {
        value[k] = command_take_float(&body);
    }
    TEST_ASSERT_TRUE(command_all_taken(&body));
    return status;
}

/* No motor is connected here: the currents stay zero. */
static void test_a_commissioning_is_started_and_its_refusal_told(void)
{
    uint32_t word[4];
    float value[6u + 3u * COMMISSIONING_LEVELS];
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, set("rs_level_s", 0.02f));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(SEQUENCE_CMD_COMMISSION, 0.0f, 0u));
    rounds(50u);
    TEST_ASSERT_EQUAL(SEQUENCE_COMMISSIONING, unit()->machine.id);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, ask_commissioning(word, value));
    TEST_ASSERT_EQUAL_UINT32(COMMISSIONING_BUSY, word[0]);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_NOW, set("rs_level_s", 0.03f));
    rounds(200u);
    TEST_ASSERT_EQUAL(SEQUENCE_FAULT, unit()->machine.id);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, ask_commissioning(word, value));
    TEST_ASSERT_EQUAL_UINT32(COMMISSIONING_REFUSED, word[0]);
    TEST_ASSERT_EQUAL_UINT32(COMMISSIONING_NO_CURRENT, word[1]);
}

static void test_what_a_commissioning_found_is_told_in_order(void)
{
    uint32_t word[4];
    float value[6u + 3u * COMMISSIONING_LEVELS];
    commissioning_result_t *r = &unit()->commissioning.result;
    unit()->commissioned.status = COMMISSIONING_DONE;
    unit()->commissioning.stage = COMMISSIONING_STAGE_END;
    unit()->commissioning.level = COMMISSIONING_LEVELS;
    *r = (commissioning_result_t){1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, {0}, {0}, {0}};
    for (uint32_t k = 0u; k < COMMISSIONING_LEVELS; k++) {
        r->level_A[k] = 7.0f + 3.0f * (float)k;
        r->flux_Wb[k] = 8.0f + 3.0f * (float)k;
        r->error_V[k] = 9.0f + 3.0f * (float)k;
    }
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, ask_commissioning(word, value));
    TEST_ASSERT_EQUAL_UINT32(COMMISSIONING_DONE, word[0]);
    TEST_ASSERT_EQUAL_UINT32(COMMISSIONING_NOT_REFUSED, word[1]);
    TEST_ASSERT_EQUAL_UINT32(COMMISSIONING_STAGE_END, word[2]);
    TEST_ASSERT_EQUAL_UINT32(COMMISSIONING_LEVELS, word[3]);
    for (uint32_t k = 0u; k < 6u + 3u * COMMISSIONING_LEVELS; k++) {
        TEST_ASSERT_EQUAL_FLOAT(1.0f + (float)k, value[k]);
    }
}

static void test_a_silent_host_ends_a_commissioning_too(void)
{
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(SEQUENCE_CMD_COMMISSION, 0.0f, 20u));
    rounds(85u); /* of 100 */
    TEST_ASSERT_EQUAL(SEQUENCE_COMMISSIONING, unit()->machine.id);
    rounds(30u);
    TEST_ASSERT_EQUAL(DRIVE_OFF, unit()->asked.mode);
    TEST_ASSERT_TRUE(unit()->link.expired);
}

/* The drive takes the edge; a level would swallow the next reset. */
static void test_a_reset_is_a_pulse_and_can_be_given_again(void)
{
    for (uint32_t n = 0u; n < 2u; n++) {
        unit()->machine.faults = 1u;
        unit()->machine.id = SEQUENCE_FAULT;
        TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(SEQUENCE_CMD_FAULT_RESET, 0.0f, 0u));
        rounds(60u); /* the offsets are averaged anew */
        TEST_ASSERT_EQUAL(SEQUENCE_READY, unit()->machine.id);
        TEST_ASSERT_EQUAL_HEX32(0u, unit_link_command(unit()).command);
    }
}

/* The mailbox is read once in a period: a reset stands for two of them, whatever the rounds are. */
static void test_a_reset_stands_for_two_periods(void)
{
    unit_link_t *link = &unit()->link;
    link->command = SEQUENCE_CMD_FAULT_RESET;
    link->reset = true;
    TEST_ASSERT_EQUAL_HEX32(SEQUENCE_CMD_FAULT_RESET, unit_link_command(unit()).command);
    for (uint32_t n = 0u; n < 2u; n++) {
        unit()->period_count++;
        TEST_ASSERT_EQUAL_HEX32(SEQUENCE_CMD_FAULT_RESET, unit_link_command(unit()).command);
    }
    unit()->period_count++;
    TEST_ASSERT_EQUAL_HEX32(0u, unit_link_command(unit()).command);
}

/* The watchdog and the checks wait behind it. */
static void test_a_slice_takes_64_bytes_of_the_line(void)
{
    static const uint8_t noise_on_the_line[100] = {0x55u};
    port.line = (host_port_line_t){.received = noise_on_the_line,
                                   .received_n = sizeof noise_on_the_line,
                                   .sent = answer_byte,
                                   .room = sizeof answer_byte};
    (void)round_of_the_port();
    TEST_ASSERT_EQUAL_UINT32(64u, port.line.taken);
    (void)round_of_the_port();
    TEST_ASSERT_EQUAL_UINT32(100u, port.line.taken);
    port.line = (host_port_line_t){0};
}

static void test_who_is_not_in_session_changes_nothing(void)
{
    const unit_config_t before = *unit_config(unit());
    const uint32_t mine = session;
    const uint32_t others[] = {0u, mine + 1u, mine ^ 0x80000000u};
    for (size_t k = 0u; k < 3u; k++) {
        session = others[k];
        TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SESSION, command(SEQUENCE_CMD_RUN, 9.0f, 0u));
        TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SESSION, set("i_d_A", 1.0f));
    }
    TEST_ASSERT_EQUAL_HEX32(0u, unit_link_command(unit()).command);
    TEST_ASSERT_EQUAL_MEMORY(&before, unit_config(unit()), sizeof before);
    open_session();
    TEST_ASSERT_NOT_EQUAL_UINT32(mine, session);
    const uint32_t second = session;
    session = mine;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SESSION, set("i_d_A", 1.0f));
    session = second;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_SEALED, set("i_d_A", 1.0f)); /* nor has it the key */
    enter();
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, set("i_d_A", 1.0f));
}

static void test_before_any_session_zero_is_none_either(void)
{
    TEST_ASSERT_TRUE(host_port_init(&port, &params, NULL));
    port.background_every = 1u;
    port.until_background = 1u;
    session = 0u;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SESSION, command(SEQUENCE_CMD_RUN, 0.0f, 0u));
}

static void test_a_repeated_request_is_answered_again_and_done_once(void)
{
    command_writer_t w = ask(UNIT_LINK_COMMAND);
    command_put_u32(&w, session);
    command_put_u32(&w, SEQUENCE_CMD_FAULT_RESET);
    command_put_float(&w, 0.0f);
    command_put_u16(&w, 0u);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send_only(&w));
    rounds(5u);
    TEST_ASSERT_TRUE(talk(w.byte, w.length)); /* its answer was lost, the host believes */
    TEST_ASSERT_EQUAL_UINT8(sequence, answer.sequence);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, answer.body[0]);
    TEST_ASSERT_FALSE(unit()->link.reset);
    TEST_ASSERT_EQUAL_HEX32(0u, unit_link_command(unit()).command);
}

static void test_every_op_with_every_length_answers_and_only_the_right_one_does(void)
{
    const unit_config_t before = *unit_config(unit());
    for (uint32_t op = 0u; op < UNIT_LINK_ANSWER; op++) {
        for (uint32_t n = 0u; n <= 40u; n++) {
            command_writer_t w = ask((uint8_t)op);
            for (uint32_t k = 0u; k < n; k++) {
                command_put_u8(&w, (uint8_t)(0xA5u + 3u * k));
            }
            const uint8_t status = send_only(&w);
            TEST_ASSERT_TRUE(status <= UNIT_LINK_NOT_SEALED);
        }
    }
    TEST_ASSERT_EQUAL_HEX32(0u, unit_link_command(unit()).command);
    TEST_ASSERT_EQUAL_MEMORY(&before, unit_config(unit()), sizeof before);
}

static void test_a_request_of_wrong_length_is_not_carried_out(void)
{
    command_writer_t w = ask(UNIT_LINK_SET);
    command_put_u32(&w, session);
    command_put_u16(&w, (uint16_t)params_find("i_d_A"));
    command_put_float(&w, 1.0f);
    command_put_u8(&w, 0u);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_BAD_LENGTH, send_only(&w));
    TEST_ASSERT_EQUAL_FLOAT(4.5f, unit_config(unit())->drive.modes.vector.flux.i_d_A);
    command_writer_t many = ask(UNIT_LINK_GET);
    for (uint32_t k = 0u; k < 61u; k++) {
        command_put_u16(&many, 0u); /* one more than an answer holds */
    }
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_BAD_LENGTH, send_only(&many));
    command_writer_t unknown = ask(UNIT_LINK_GET);
    command_put_u16(&unknown, 60000u);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SUCH, send_only(&unknown));
}

/* Each op that has one length only, with a byte more. */
static void test_a_request_that_is_too_long_is_not_carried_out(void)
{
    static const uint8_t exact[][2] = {
        {UNIT_LINK_PARAM_INFO, 2u},  {UNIT_LINK_SIGNAL_INFO, 1u}, {UNIT_LINK_SET, 10u},
        {UNIT_LINK_SAVE, 4u},        {UNIT_LINK_CHALLENGE, 4u},   {UNIT_LINK_UNLOCK, 12u},
        {UNIT_LINK_STORE_ENTRY, 2u}, {UNIT_LINK_LOADER, 4u},      {UNIT_LINK_TRACE_READ, 4u},
        {UNIT_LINK_TRACE_STOP, 4u},  {UNIT_LINK_FLIGHT_ARM, 5u},  {UNIT_LINK_FLIGHT_READ, 8u},
        {UNIT_LINK_FAULT_READ, 4u},  {UNIT_LINK_FAULT_CLEAR, 4u},
    };
    for (size_t k = 0u; k < sizeof exact / sizeof exact[0]; k++) {
        command_writer_t w = ask(exact[k][0]);
        for (uint32_t n = 0u; n <= exact[k][1]; n++) {
            command_put_u8(&w, (n < 4u) ? (uint8_t)(session >> (8u * n)) : 0u);
        }
        TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_BAD_LENGTH, send_only(&w));
    }
}

static void test_status_tells_state_reference_and_counts(void)
{
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(SEQUENCE_CMD_RUN, 3.5f, 0u));
    rounds(200u);
    unit()->link.terminal_faults = 1u << 17;
    command_writer_t w = ask(UNIT_LINK_STATUS);
    command_reader_t body;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&w, &body));
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_RUN, command_take_u32(&body));
    TEST_ASSERT_EQUAL_UINT32(0u, command_take_u32(&body));
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_CMD_RUN, command_take_u32(&body));
    TEST_ASSERT_TRUE(command_take_u32(&body) > 260u);
    for (uint32_t k = 0u; k < 5u; k++) {
        (void)command_take_u32(&body);
    }
    TEST_ASSERT_EQUAL_FLOAT(3.5f, command_take_float(&body));
    for (uint32_t k = 0u; k < 6u; k++) {
        (void)command_take_float(&body);
    }
    TEST_ASSERT_FLOAT_WITHIN(0.5f, 283.0f, command_take_float(&body));
    (void)command_take_float(&body);
    TEST_ASSERT_EQUAL_FLOAT(params.Rs_ohm, command_take_float(&body));
    TEST_ASSERT_EQUAL_UINT32(0u, command_take_u32(&body));
    TEST_ASSERT_EQUAL_HEX32(1u << 17, command_take_u32(&body));
    TEST_ASSERT_TRUE(command_all_taken(&body));
}

static void test_a_sample_is_of_one_period(void)
{
    command_writer_t w = ask(UNIT_LINK_SAMPLE);
    command_put_u8(&w, UNIT_SIGNAL_state);
    command_put_u8(&w, UNIT_SIGNAL_u_dc_V);
    command_reader_t body;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&w, &body));
    TEST_ASSERT_TRUE(command_take_u32(&body) > 60u);
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_READY, command_take_u32(&body));
    TEST_ASSERT_FLOAT_WITHIN(0.5f, 283.0f, command_take_float(&body));
    command_writer_t bad = ask(UNIT_LINK_SAMPLE);
    command_put_u8(&bad, UNIT_SIGNALS);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SUCH, send_only(&bad));
}

static command_writer_t arm(uint8_t trigger, uint8_t edge, uint32_t level)
{
    command_writer_t w = ask(UNIT_LINK_TRACE_ARM);
    command_put_u32(&w, session);
    command_put_u8(&w, 2u);
    command_put_u8(&w, UNIT_SIGNAL_state);
    command_put_u8(&w, UNIT_SIGNAL_u_dc_V);
    command_put_u32(&w, 1u);
    command_put_u8(&w, trigger);
    command_put_u8(&w, edge);
    command_put_u32(&w, level);
    command_put_float(&w, 0.5f);
    command_put_u32(&w, 100u);
    return w;
}

static void test_a_trace_round_the_start_is_read_back(void)
{
    command_writer_t w = arm(UNIT_SIGNAL_state, TRACE_RISING, SEQUENCE_PREMAGNETISE);
    command_reader_t body;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&w, &body));
    TEST_ASSERT_EQUAL_UINT32(100u, command_take_u32(&body));
    TEST_ASSERT_EQUAL_UINT32(50u, command_take_u32(&body));
    rounds(200u);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(SEQUENCE_CMD_RUN, 0.0f, 0u));
    rounds(200u);
    command_writer_t state = ask(UNIT_LINK_TRACE_STATE);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&state, &body));
    TEST_ASSERT_EQUAL_UINT32(TRACE_DONE, command_take_u32(&body));
    TEST_ASSERT_EQUAL_UINT32(100u, command_take_u32(&body));
    TEST_ASSERT_EQUAL_UINT32(50u, command_take_u32(&body));
    uint32_t row = 0u;
    while (row < 100u) {
        command_writer_t read = ask(UNIT_LINK_TRACE_READ);
        command_put_u32(&read, row);
        TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&read, &body));
        /* As many whole rows of two words as an answer holds beside its status. */
        const uint32_t left = 100u - row;
        const uint32_t whole = (COMMAND_BODY_MAX - 1u) / 8u;
        TEST_ASSERT_EQUAL_UINT32(8u * ((left < whole) ? left : whole), body.left);
        TEST_ASSERT_EQUAL_UINT32(0u, body.left % 8u);
        TEST_ASSERT_TRUE(body.left > 0u);
        while (body.left > 0u) {
            const uint32_t id = command_take_u32(&body);
            TEST_ASSERT_EQUAL_UINT32((row < 50u) ? SEQUENCE_READY : SEQUENCE_PREMAGNETISE, id);
            TEST_ASSERT_FLOAT_WITHIN(0.5f, 283.0f, command_take_float(&body));
            row++;
        }
    }
    command_writer_t beyond = ask(UNIT_LINK_TRACE_READ);
    command_put_u32(&beyond, 100u);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SUCH, send_only(&beyond));
}

static void test_a_trace_set_up_wrongly_is_refused(void)
{
    command_writer_t w = arm(UNIT_SIGNALS, TRACE_RISING, 0u);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SUCH, send_only(&w));
    w = arm(UNIT_SIGNAL_state, TRACE_EDGES, 0u);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OUT_OF_RANGE, send_only(&w));
    w = arm(UNIT_SIGNAL_u_dc_V, TRACE_RISING, 0x7FC00000u);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_REFUSED, send_only(&w));
    w = arm(UNIT_SIGNAL_state, TRACE_RISING, 0u);
    command_put_u8(&w, 0u);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_BAD_LENGTH, send_only(&w));
    command_writer_t nine = ask(UNIT_LINK_TRACE_ARM);
    command_put_u32(&nine, session);
    command_put_u8(&nine, 9u);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OUT_OF_RANGE, send_only(&nine));
    command_writer_t unknown = ask(UNIT_LINK_TRACE_ARM);
    command_put_u32(&unknown, session);
    command_put_u8(&unknown, 1u);
    command_put_u8(&unknown, UNIT_SIGNALS);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SUCH, send_only(&unknown));
    TEST_ASSERT_EQUAL_UINT32(TRACE_IDLE, unit()->trace.state);
    w = arm(UNIT_SIGNAL_state, TRACE_RISING, 99u);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send_only(&w));
    command_writer_t stop = ask(UNIT_LINK_TRACE_STOP);
    command_put_u32(&stop, session);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send_only(&stop));
    TEST_ASSERT_EQUAL_UINT32(TRACE_IDLE, unit()->trace.state);
}

static void test_a_fault_is_listed_recorded_read_and_cleared(void)
{
    command_reader_t body;
    command_writer_t none = ask(UNIT_LINK_FAULT_RECORD);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SUCH, send_only(&none));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(SEQUENCE_CMD_RUN, 0.0f, 0u));
    rounds(100u);
    const hal_sample_t over = {16000u, 8192u, 8192u, 8192u, 8192u, 11592u, 0u, 0u};
    hal_output_t out;
    const unit_command_t run = {.command = SEQUENCE_CMD_RUN};
    host_port_period(&port, &run, &over, &out);
    TEST_ASSERT_FALSE(out.gates_on);
    rounds(50u);

    command_writer_t log = ask(UNIT_LINK_FAULT_LOG);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&log, &body));
    const uint32_t listed = command_take_u32(&body);
    TEST_ASSERT_EQUAL_UINT32(1u, listed);
    TEST_ASSERT_EQUAL_UINT32(1u, command_take_u32(&body));
    TEST_ASSERT_BITS_HIGH(FAULT_OVER_CURRENT, command_take_u32(&body));
    TEST_ASSERT_EQUAL_UINT32(SEQUENCE_FAULT, command_take_u32(&body));
    const uint32_t period = command_take_u32(&body);
    TEST_ASSERT_TRUE(command_all_taken(&body));

    command_writer_t record = ask(UNIT_LINK_FAULT_RECORD);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&record, &body));
    TEST_ASSERT_EQUAL_UINT32(1u, command_take_u32(&body));
    TEST_ASSERT_EQUAL_UINT32(period, command_take_u32(&body));
    TEST_ASSERT_EQUAL_UINT32(FAULT_RECORD_ROWS, command_take_u32(&body));
    const uint32_t fault_row = command_take_u32(&body);
    TEST_ASSERT_EQUAL_UINT32(32u, fault_row);
    TEST_ASSERT_EQUAL_UINT32(0u, command_take_u32(&body));
    const uint8_t columns[] = {UNIT_SIGNAL_i_s_alpha_A,     UNIT_SIGNAL_i_s_beta_A,
                               UNIT_SIGNAL_u_dc_V,          UNIT_SIGNAL_omega_e_hat_rad_s,
                               UNIT_SIGNAL_omega_ref_rad_s, UNIT_SIGNAL_i_q_ref_A};
    for (size_t k = 0u; k < sizeof columns; k++) {
        TEST_ASSERT_EQUAL_UINT8(columns[k], command_take_u8(&body));
    }

    command_writer_t read = ask(UNIT_LINK_FAULT_READ);
    command_put_u32(&read, fault_row);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&read, &body));
    /* What tripped it: 23.8 A in phase u alone are 19.5 A of alpha. */
    TEST_ASSERT_FLOAT_WITHIN(0.3f, 19.5f, command_take_float(&body));
    command_writer_t first = ask(UNIT_LINK_FAULT_READ);
    command_put_u32(&first, 0u);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&first, &body));
    /* As many whole rows as an answer holds beside its status. */
    const uint32_t row_bytes = 4u * FAULT_RECORD_SIGNALS;
    TEST_ASSERT_EQUAL_UINT32((COMMAND_BODY_MAX - 1u) / row_bytes * row_bytes, body.left);
    command_writer_t beyond = ask(UNIT_LINK_FAULT_READ);
    command_put_u32(&beyond, FAULT_RECORD_ROWS);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SUCH, send_only(&beyond));

    command_writer_t clear = ask(UNIT_LINK_FAULT_CLEAR);
    command_put_u32(&clear, session);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send_only(&clear));
    command_writer_t gone = ask(UNIT_LINK_FAULT_RECORD);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SUCH, send_only(&gone));
}

static uint8_t arm_flight(uint8_t on)
{
    command_writer_t w = ask(UNIT_LINK_FLIGHT_ARM);
    command_put_u32(&w, session);
    command_put_u8(&w, on);
    return send_only(&w);
}

static uint8_t read_flight(uint32_t row, command_reader_t *body)
{
    command_writer_t w = ask(UNIT_LINK_FLIGHT_READ);
    command_put_u32(&w, session);
    command_put_u32(&w, row);
    return send(&w, body);
}

/* State, rows, written, taken, changes, lost. */
static void flight_state(uint32_t word[6])
{
    command_writer_t w = ask(UNIT_LINK_FLIGHT_STATE);
    command_reader_t body;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&w, &body));
    for (size_t k = 0u; k < 6u; k++) {
        word[k] = command_take_u32(&body);
    }
    TEST_ASSERT_TRUE(command_all_taken(&body));
}

static void test_a_flight_is_read_row_by_row_as_it_goes_on(void)
{
    uint32_t word[6];
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, arm_flight(1u));
    uint32_t row = 0u;
    uint32_t most = 0u;
    while (row < 200u) {
        command_reader_t body;
        TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, read_flight(row, &body));
        TEST_ASSERT_EQUAL_UINT8(FLIGHT_ON, command_take_u8(&body));
        TEST_ASSERT_EQUAL_UINT32(0u, body.left % (4u * FLIGHT_ROW_WORDS));
        most = (body.left > most) ? body.left : most;
        while (body.left > 0u) {
            for (uint32_t k = 0u; k < FLIGHT_ROW_WORDS; k++) {
                TEST_ASSERT_EQUAL_HEX32(flight_row(&unit()->flight, row)[k],
                                        command_take_u32(&body));
            }
            row++;
        }
    }
    /* As many whole rows as an answer holds beside its status and the state. */
    TEST_ASSERT_TRUE(most <= (COMMAND_BODY_MAX - 2u) / 12u * 12u);
    flight_state(word);
    TEST_ASSERT_EQUAL_UINT32(FLIGHT_ON, word[0]);
    TEST_ASSERT_EQUAL_UINT32(64u, word[1]);
    TEST_ASSERT_TRUE(word[2] >= row);
    TEST_ASSERT_TRUE(word[3] <= row);
    TEST_ASSERT_EQUAL_UINT32(0u, word[5]);
    command_reader_t body;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SUCH, read_flight(0u, &body)); /* freed */
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SUCH, read_flight(row + 1000u, &body));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, arm_flight(0u));
    flight_state(word);
    TEST_ASSERT_EQUAL_UINT32(FLIGHT_OFF, word[0]);
}

static void test_an_answer_is_full_of_rows_when_there_are_enough(void)
{
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, arm_flight(1u));
    rounds(60u);
    command_reader_t body;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, read_flight(0u, &body));
    (void)command_take_u8(&body);
    TEST_ASSERT_EQUAL_UINT32(20u * 12u, body.left);
    rounds(60u);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, read_flight(20u, &body));
    TEST_ASSERT_EQUAL_UINT8(FLIGHT_LOST, command_take_u8(&body));
    uint32_t word[6];
    flight_state(word);
    TEST_ASSERT_EQUAL_UINT32(FLIGHT_LOST, word[0]);
    TEST_ASSERT_EQUAL_UINT32(20u, word[3]);
    TEST_ASSERT_TRUE(word[5] > 30u);
}

static void test_a_flight_waits_for_the_drive_to_stand(void)
{
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(SEQUENCE_CMD_RUN, 0.0f, 0u));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_NOW, arm_flight(1u));
    TEST_ASSERT_EQUAL_UINT32(FLIGHT_OFF, unit()->flight.state);
}

static void test_a_flight_without_memory_is_refused(void)
{
    unit()->flight.rows = 0u;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_REFUSED, arm_flight(1u));
}

static void test_a_flight_is_started_with_the_key_and_read_in_session(void)
{
    sealing = false;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_SEALED, arm_flight(1u));
    session++;
    command_reader_t body;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SESSION, read_flight(0u, &body));
    TEST_ASSERT_EQUAL_UINT32(FLIGHT_OFF, unit()->flight.state);
}

static void test_a_parameter_that_is_set_is_counted_for_the_flight(void)
{
    uint32_t word[6];
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, set("i_d_A", 3.25f));
    flight_state(word);
    TEST_ASSERT_EQUAL_UINT32(1u, word[4]);
    TEST_ASSERT_EQUAL_UINT32(params_find("i_d_A"), unit()->flight.changed);
}

static void test_a_port_without_recording_says_so(void)
{
    TEST_ASSERT_TRUE(host_port_init(&port, &params, NULL));
    port.background_every = 1u;
    port.until_background = 1u;
    const uint8_t ops[] = {UNIT_LINK_FAULT_LOG, UNIT_LINK_FAULT_RECORD};
    for (size_t k = 0u; k < 2u; k++) {
        command_writer_t w = ask(ops[k]);
        TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SUCH, send_only(&w));
    }
    open_session();
    command_writer_t w = arm(UNIT_SIGNAL_state, TRACE_NOW, 0u);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_REFUSED, send_only(&w));
}

/* A slow line: a byte at a time goes out, the next request waits, nothing is lost. */
/* The board of before, switched on again: what its flash keeps is all it has. */
static bool power_up(void)
{
    const host_port_store_t store = {&flash, key, entropy};
    TEST_ASSERT_TRUE(host_port_init(&port, &params, &table));
    const bool good = host_port_start(&port, &params, &table, &store);
    const unit_memory_t memory = {
        .trace_word = trace_memory, .trace_words = TRACE_WORDS, .fault = &fault_memory};
    host_port_record(&port, &memory);
    port.background_every = 1u;
    port.until_background = 1u;
    enter();
    return good;
}

static void new_board(void)
{
    flash_memory = (ram_flash_t){0};
    ram_flash_start(&flash_memory);
    for (int k = 0; k < 100; k++) {
        gains[k] = (observer_gain_t){-300.0f, (float)k, 0.5f, -0.01f * (float)k};
    }
    table = (gain_table_t){.magic = GAIN_TABLE_MAGIC,
                           .version = GAIN_TABLE_VERSION,
                           .motor_id = 1u,
                           .entry_count = 100u,
                           .crc32c = crc32c(gains, sizeof gains),
                           .step_rad_s = 0.20943951f,
                           .entry = gains};
    TEST_ASSERT_TRUE(power_up());
}

static void wait_s(float s)
{
    for (uint32_t k = 0u; k < (uint32_t)(s / params.period_s); k++) {
        (void)round_of_the_port();
    }
}

static uint8_t act_only(uint8_t op)
{
    command_writer_t w = ask(op);
    command_put_u32(&w, session);
    return send_only(&w);
}

static uint8_t unlock_with(const uint8_t *k)
{
    return answer_challenge(k, true);
}

static uint32_t store_word(uint32_t k)
{
    command_writer_t w = ask(UNIT_LINK_STORE);
    command_reader_t body;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&w, &body));
    for (uint32_t n = 0u; n < k; n++) {
        (void)command_take_u32(&body);
    }
    return command_take_u32(&body);
}

static float get(const char *name)
{
    return params_get(&unit()->params, params_find(name));
}

static void test_a_saved_parameter_is_there_after_power_up(void)
{
    new_board();
    TEST_ASSERT_EQUAL_UINT32(PARAM_STORE_EMPTY, store_word(0u));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, set("i_d_A", 3.5f));
    TEST_ASSERT_TRUE(power_up());
    TEST_ASSERT_EQUAL_FLOAT(params.i_d_A, get("i_d_A")); /* not saved */
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, set("i_d_A", 3.5f));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, act_only(UNIT_LINK_SAVE));
    wait_s(0.2f);
    TEST_ASSERT_EQUAL_UINT32(0u, store_word(1u));
    TEST_ASSERT_EQUAL_UINT32(0u, store_word(2u));
    TEST_ASSERT_TRUE(power_up());
    TEST_ASSERT_EQUAL_UINT32(PARAM_STORE_LOADED, store_word(0u));
    TEST_ASSERT_EQUAL_UINT32(params_count(), store_word(4u));
    TEST_ASSERT_EQUAL_FLOAT(3.5f, get("i_d_A"));
    TEST_ASSERT_EQUAL_FLOAT(3.5f, unit_config(unit())->drive.modes.vector.flux.i_d_A);
}

static void test_nothing_is_saved_while_the_gates_are_on(void)
{
    new_board();
    wait_s(2.0f * params.offset_calibration_s + 0.01f);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, act_only(UNIT_LINK_SAVE)); /* asked for in time, but */
    const uint32_t before = flash_memory.changes;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(SEQUENCE_CMD_RUN, 1.0f, 0u));
    const uint32_t at_command = flash_memory.changes;
    TEST_ASSERT_GREATER_THAN_UINT32(before, at_command);
    wait_s(0.1f);
    TEST_ASSERT_NOT_EQUAL(DRIVE_OFF, unit()->asked.mode);
    TEST_ASSERT_UINT32_WITHIN(2u, at_command, flash_memory.changes);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_NOW, act_only(UNIT_LINK_SAVE));
    TEST_ASSERT_EQUAL_UINT32(1u, store_word(1u));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(0u, 0.0f, 0u));
    wait_s(0.2f);
    TEST_ASSERT_EQUAL_UINT32(0u, store_word(1u)); /* and goes on afterwards */
    TEST_ASSERT_TRUE(power_up());
    TEST_ASSERT_EQUAL_UINT32(PARAM_STORE_LOADED, store_word(0u));
}

static void test_protected_parameters_want_the_key(void)
{
    const uint8_t other[SIPHASH_KEY_BYTES] = {1u, 2u, 4u};
    new_board();
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_NOW, unlock_with(key)); /* straight after power-up */
    wait_s(UNIT_STORE_LOCKOUT_S + 0.2f);
    enter();
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_PROTECTED, set("Rs_ohm", 1.0f));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, unlock_with(key));
    TEST_ASSERT_EQUAL_UINT32(1u, store_word(3u));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, set("Rs_ohm", 1.0f));
    TEST_ASSERT_EQUAL_FLOAT(1.0f, get("Rs_ohm"));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_REFUSED, set("period_s", 100e-6f)); /* the timer's */
    TEST_ASSERT_EQUAL_FLOAT(params.period_s, get("period_s"));
    open_session(); /* somebody else */
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_SEALED, set("Rs_ohm", 1.1f));
    enter();
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_PROTECTED, set("Rs_ohm", 1.1f));
    for (uint32_t k = 0u; k < ACCESS_FAILURES_MAX; k++) {
        TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_PROTECTED, unlock_with(other));
    }
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_NOW, unlock_with(key)); /* locked out */
    wait_s(UNIT_STORE_LOCKOUT_S + 0.2f);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, unlock_with(key));
}

/* In ticks of 512 periods: not before the time, and a tick after it at most. */
/* Every request that can hurt, as it would come from who has the session but not the key. */
static void test_what_can_hurt_needs_a_sealed_request(void)
{
    const float before = get("speed_filter_s");
    sealing = false;
    const uint32_t bits[] = {SEQUENCE_CMD_RUN, SEQUENCE_CMD_FAULT_RESET, SEQUENCE_CMD_COMMISSION,
                             SEQUENCE_CMD_TORQUE_MODE};
    for (size_t k = 0u; k < sizeof bits / sizeof bits[0]; k++) {
        TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_SEALED, command(bits[k], 1.0f, 0u));
    }
    TEST_ASSERT_EQUAL_HEX32(0u, unit_link_command(unit()).command);
    for (size_t k = 0u; k < params_count(); k++) {
        TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_SEALED, set(params_name(k), 1.0f));
    }
    TEST_ASSERT_EQUAL_FLOAT(before, get("speed_filter_s"));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_SEALED, act_only(UNIT_LINK_SAVE));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_SEALED, act_only(UNIT_LINK_FAULT_CLEAR));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_SEALED, act_only(UNIT_LINK_LOADER));
    sealing = true;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, set("speed_filter_s", 0.01f));
    TEST_ASSERT_EQUAL_FLOAT(0.01f, get("speed_filter_s"));
}

/* The way into the boot loader: how often it was taken, and what the host had been sent by then. */
static uint32_t loader_calls;
static uint32_t sent_before;

static void loader(void *context)
{
    loader_calls++;
    sent_before = ((const host_port_t *)context)->line.sent_n;
}

static void stand_above_a_loader(void)
{
    loader_calls = 0u;
    sent_before = 0u;
    port.devices.loader = loader;
}

static void test_an_image_without_a_loader_knows_no_way_there(void)
{
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SUCH_OP, act_only(UNIT_LINK_LOADER));
    unit()->link.leaving = true;
    rounds(3u);
    TEST_ASSERT_TRUE(unit()->link.leaving);
}

static void test_the_loader_is_called_once_behind_the_answer(void)
{
    stand_above_a_loader();
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, act_only(UNIT_LINK_LOADER));
    TEST_ASSERT_EQUAL_UINT32(1u, loader_calls);
    TEST_ASSERT_EQUAL_UINT32(unit()->link.answer.length, sent_before);
    rounds(100u);
    TEST_ASSERT_EQUAL_UINT32(1u, loader_calls);
}

static void test_the_loader_is_not_called_while_the_drive_runs(void)
{
    stand_above_a_loader();
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(SEQUENCE_CMD_RUN, 1.0f, 0u));
    rounds(100u);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_NOW, act_only(UNIT_LINK_LOADER));
    TEST_ASSERT_FALSE(unit()->link.leaving);
    unit()->link.leaving = true; /* a bus started it behind the answer */
    rounds(3u);
    TEST_ASSERT_FALSE(unit()->link.leaving);
    TEST_ASSERT_EQUAL_UINT32(0u, loader_calls);
}

static void test_the_loader_is_not_called_while_parameters_are_saved(void)
{
    stand_above_a_loader();
    unit()->store.store.wanted = true;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_NOW, act_only(UNIT_LINK_LOADER));
    TEST_ASSERT_EQUAL_UINT32(0u, loader_calls);
}

static void test_a_stop_needs_no_key(void)
{
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(SEQUENCE_CMD_RUN, 1.0f, 0u));
    rounds(100u);
    sealing = false;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(SEQUENCE_CMD_TORQUE_OFF, 0.0f, 0u));
    rounds(3u);
    TEST_ASSERT_EQUAL(DRIVE_OFF, unit()->asked.mode);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(0u, 0.0f, 0u));
}

/* The same bytes again under another sequence number, an older counter, each bit of it changed. */
static void test_a_sealed_request_is_taken_once_and_whole(void)
{
    command_writer_t inner = ask(UNIT_LINK_SET);
    command_put_u32(&inner, session);
    command_put_u16(&inner, (uint16_t)params_find("i_d_A"));
    command_put_float(&inner, 3.5f);
    const command_writer_t first = sealed(&inner);
    const command_writer_t second = sealed(&inner);
    command_writer_t w = second;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send_only(&w));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, set("i_d_A", 4.0f));
    const command_writer_t old[] = {first, second};
    for (int k = 0; k < 2; k++) {
        w = old[k];
        w.byte[2] = ++sequence;
        TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_SEALED, send_only(&w));
    }
    const command_writer_t next = sealed(&inner);
    for (uint32_t bit = 0u; bit < 8u * (next.length - 4u); bit++) {
        w = next;
        w.byte[2] = ++sequence;
        w.byte[4u + bit / 8u] ^= (uint8_t)(1u << (bit % 8u));
        const uint8_t status = send_only(&w);
        TEST_ASSERT_TRUE((status == UNIT_LINK_NOT_SEALED) || (status == UNIT_LINK_NO_SESSION));
    }
    TEST_ASSERT_EQUAL_FLOAT(4.0f, get("i_d_A"));
    w = next;
    w.byte[2] = ++sequence;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send_only(&w));
    TEST_ASSERT_EQUAL_FLOAT(3.5f, get("i_d_A"));
}

static void test_a_seal_is_of_one_session(void)
{
    command_writer_t inner = ask(UNIT_LINK_SET);
    command_put_u32(&inner, session);
    command_put_u16(&inner, (uint16_t)params_find("i_d_A"));
    command_put_float(&inner, 3.5f);
    command_writer_t w = sealed(&inner);
    const uint32_t before = session;
    enter();
    session = before;
    w.byte[2] = ++sequence;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SESSION, send_only(&w));
    /* With the new key, but the number of the session before. */
    w = sealed(&inner);
    w.byte[2] = ++sequence;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SESSION, send_only(&w));
    /* One sealed request in another is none. */
    command_writer_t twice = sealed(&inner);
    twice = sealed(&twice);
    twice.byte[2] = ++sequence;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_BAD_LENGTH, send_only(&twice));
    command_writer_t empty = ask(UNIT_LINK_SEALED);
    for (uint32_t k = 0u; k < 12u; k++) {
        command_put_u8(&empty, 0u);
    }
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_BAD_LENGTH, send_only(&empty));
}

static void test_the_guard_counts_its_times_in_seconds(void)
{
    new_board();
    const access_config_t *cfg = &unit()->store.access_cfg;
    const uint32_t ticks[] = {cfg->lockout_ticks, cfg->challenge_ticks, cfg->unlocked_ticks};
    const float s[] = {10.0f, 10.0f, 600.0f};
    const float tick_s = 512.0f * params.period_s;
    for (size_t k = 0u; k < 3u; k++) {
        TEST_ASSERT_TRUE((float)ticks[k] * tick_s >= s[k]);
        TEST_ASSERT_TRUE((float)(ticks[k] - 1u) * tick_s <= s[k]);
    }
    wait_s(0.8f); /* from power-up */
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_NOW, unlock_with(key));
    wait_s(0.4f);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, unlock_with(key));
    const uint8_t other[SIPHASH_KEY_BYTES] = {1u, 2u, 4u};
    for (uint32_t k = 0u; k < ACCESS_FAILURES_MAX; k++) {
        TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_PROTECTED, unlock_with(other));
    }
    wait_s(9.8f);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_NOW, unlock_with(key));
    wait_s(0.4f);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, unlock_with(key));
}

static void test_an_answer_without_a_challenge_unlocks_nothing(void)
{
    new_board();
    wait_s(UNIT_STORE_LOCKOUT_S + 0.2f);
    command_writer_t w = ask(UNIT_LINK_UNLOCK);
    command_put_u32(&w, session);
    const uint64_t word = access_response(key, 0u);
    command_put_u32(&w, (uint32_t)word);
    command_put_u32(&w, (uint32_t)(word >> 32u));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_PROTECTED, send_only(&w));
    port.devices.entropy = NULL; /* a board without a generator */
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_NOW, unlock_with(key));
}

static void save_now(void)
{
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, act_only(UNIT_LINK_SAVE));
    wait_s(0.2f);
    TEST_ASSERT_EQUAL_UINT32(0u, store_word(1u));
}

/* What stands in the way of running, until somebody with the key has looked and saved anew. */
static void refuses_until_saved_with_the_key(void)
{
    TEST_ASSERT_FALSE(power_up());
    wait_s(2.0f * params.offset_calibration_s + 0.01f);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(SEQUENCE_CMD_RUN, 1.0f, 0u));
    wait_s(0.01f);
    TEST_ASSERT_EQUAL_UINT32(DRIVE_OFF, unit()->asked.mode);
    TEST_ASSERT_EQUAL_UINT32(FAULT_STORE, unit()->machine.faults);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(0u, 0.0f, 0u));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_PROTECTED, act_only(UNIT_LINK_SAVE));
    wait_s(UNIT_STORE_LOCKOUT_S + 0.2f);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, unlock_with(key));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, set("i_d_A", 4.0f));
    save_now();
    TEST_ASSERT_TRUE(power_up());
    TEST_ASSERT_EQUAL_FLOAT(4.0f, get("i_d_A"));
}

static void test_parameters_of_another_table_are_refused_until_saved_anew(void)
{
    params.observer_gain_enable = 1u;
    new_board();
    save_now();
    table.motor_id++;
    refuses_until_saved_with_the_key();
    table.motor_id--;
    params.observer_gain_enable = 0u;
}

static void test_parameters_of_another_period_are_refused(void)
{
    const float period_s = params.period_s;
    new_board();
    save_now();
    params.period_s = 0.5f * period_s;
    TEST_ASSERT_FALSE(power_up());
    TEST_ASSERT_EQUAL_UINT32(FAULT_STORE, unit()->mailbox.faults);
    params.period_s = period_s;
}

static void test_a_set_that_cannot_be_read_any_more_is_refused_until_saved_anew(void)
{
    new_board();
    save_now();
    save_now(); /* both slots */
    flash_memory.cell[0][20] ^= 1u;
    flash_memory.cell[1][20] ^= 1u;
    refuses_until_saved_with_the_key();
}

static void test_without_a_flash_a_save_is_refused(void)
{
    command_writer_t w = ask(UNIT_LINK_SAVE);
    command_put_u32(&w, session);
    command_reader_t body;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_REFUSED, send(&w, &body));
    TEST_ASSERT_TRUE(command_all_taken(&body)); /* no two parameters are to blame */
}

static uint8_t send_entry(uint16_t n, command_reader_t *body)
{
    command_reader_t unused;
    command_writer_t w = ask(UNIT_LINK_STORE_ENTRY);
    command_put_u16(&w, n);
    return send(&w, (body != NULL) ? body : &unused);
}

static void expect_conflict(const char *first, const char *second, params_relation_t relation,
                            float limit, command_reader_t *body)
{
    TEST_ASSERT_EQUAL_UINT16(params_find(first), command_take_u16(body));
    TEST_ASSERT_EQUAL_UINT16((second != NULL) ? params_find(second) : UINT16_MAX,
                             command_take_u16(body));
    TEST_ASSERT_EQUAL_UINT8(relation, command_take_u8(body));
    TEST_ASSERT_EQUAL_FLOAT(limit, command_take_float(body));
}

static command_reader_t refused(const char *name, float value)
{
    command_writer_t w = ask(UNIT_LINK_SET);
    command_put_u32(&w, session);
    command_put_u16(&w, (uint16_t)params_find(name));
    command_put_float(&w, value);
    command_reader_t body;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_REFUSED, send(&w, &body));
    return body;
}

static void test_a_refused_set_tells_which_two_exclude_each_other(void)
{
    command_reader_t body = refused("i_d_A", 500.0f);
    expect_conflict("i_d_A", "i_d_max_A", PARAMS_AT_MOST, params.i_d_max_A, &body);
    TEST_ASSERT_TRUE(command_all_taken(&body));
    body = refused("eps1_on_Hz", 9.0f);
    expect_conflict("eps1_off_Hz", "eps1_on_Hz", PARAMS_AT_LEAST, 9.0f, &body);
    /* What is in use keeps the rules. */
    command_writer_t w = ask(UNIT_LINK_STORE);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&w, &body));
    take(&body, 8u * sizeof(uint32_t));
    TEST_ASSERT_EQUAL_UINT16(UINT16_MAX, command_take_u16(&body));
    take(&body, 7u);
    TEST_ASSERT_EQUAL_UINT32(0u, command_take_u32(&body)); /* renamed */
    TEST_ASSERT_EQUAL_UINT32(0u, command_take_u32(&body)); /* entries: nothing was saved */
    TEST_ASSERT_TRUE(command_all_taken(&body));
}

static void test_the_entries_of_a_saved_record_are_told_one_by_one(void)
{
    new_board();
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SUCH, send_entry(0u, NULL));
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, act_only(UNIT_LINK_SAVE));
    wait_s(0.2f);
    for (size_t k = 0u; k < params_count(); k++) {
        command_reader_t body;
        TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send_entry((uint16_t)k, &body));
        const char *name = params_name(k);
        TEST_ASSERT_EQUAL_HEX32(crc32c(name, strlen(name)), command_take_u32(&body));
        TEST_ASSERT_EQUAL_FLOAT(params_get(&unit()->params, k), command_take_float(&body));
        TEST_ASSERT_EQUAL_UINT16(k, command_take_u16(&body));
        TEST_ASSERT_EQUAL_UINT8(PARAM_STORE_TAKEN, command_take_u8(&body));
        TEST_ASSERT_TRUE(command_all_taken(&body));
    }
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SUCH, send_entry((uint16_t)params_count(), NULL));
}

/* A board with a table, and one that cannot tell who it is, what time it is, or listen. */
static void test_says_what_the_board_gives(void)
{
    params.observer_gain_enable = 1u;
    new_board();
    params.observer_gain_enable = 0u;
    command_reader_t body;
    port.devices.identity = NULL;
    port.devices.clock_us = NULL;
    command_writer_t w = ask(UNIT_LINK_HELLO);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&w, &body));
    take(&body, 10u);
    TEST_ASSERT_EQUAL_UINT32(table.motor_id, command_take_u32(&body));
    TEST_ASSERT_EQUAL_UINT32(table.crc32c, command_take_u32(&body));
    take(&body, 8u);
    expect_text("", &body);
    TEST_ASSERT_TRUE(command_all_taken(&body));
    const uint32_t before = session;
    open_session();
    TEST_ASSERT_NOT_EQUAL_UINT32(before, session);
    bool (*const read)(void *, uint8_t *) = port.devices.link_read;
    for (int n = 0; n < 2; n++) {
        port.devices.link_read = (n == 0) ? NULL : read;
        if (n == 1) {
            port.devices.link_write = NULL;
        }
        port.line = (host_port_line_t){.received = w.byte, .received_n = w.length};
        rounds(3u);
        TEST_ASSERT_EQUAL_UINT32(0u, port.line.taken);
    }
}

/* The number is a CRC-32C of four words, linear in each bit: a clock that makes it zero. */
static void test_no_session_has_the_number_of_nobody(void)
{
    const unit_t *u = unit();
    /* What the request itself adds by the time it is carried out. */
    const unit_link_t link = u->link;
    uint32_t basis[32] = {0}, clock_of[32] = {0};
    uint32_t seed[4] = {link.session, u->period_count, 0u, link.parser.good + 1u};
    const uint32_t at_zero = crc32c(seed, sizeof seed);
    for (uint32_t bit = 0u; bit < 32u; bit++) {
        seed[2] = 1u << bit;
        uint32_t word = crc32c(seed, sizeof seed) ^ at_zero, clock = seed[2];
        for (uint32_t k = 32u; (k-- > 0u) && (word != 0u);) {
            if ((word & (1u << k)) == 0u) {
                continue;
            }
            if (basis[k] == 0u) {
                basis[k] = word;
                clock_of[k] = clock;
                word = 0u;
            } else {
                word ^= basis[k];
                clock ^= clock_of[k];
            }
        }
    }
    uint32_t rest = at_zero, clock = 0u;
    for (uint32_t k = 32u; k-- > 0u;) {
        if ((rest & (1u << k)) != 0u) {
            rest ^= basis[k];
            clock ^= clock_of[k];
        }
    }
    TEST_ASSERT_EQUAL_HEX32(0u, rest);
    seed[2] = clock;
    TEST_ASSERT_EQUAL_HEX32(0u, crc32c(seed, sizeof seed));
    unit()->link.parser.good++;
    port.clock_us = clock;
    command_reader_t body = {0};
    command_begin(&unit()->link.answer, 1u, UNIT_LINK_SESSION | UNIT_LINK_ANSWER);
    TEST_ASSERT_EQUAL(UNIT_LINK_OK,
                      unit_link_request(unit(), &port.devices, UNIT_LINK_SESSION, &body));
    TEST_ASSERT_EQUAL_UINT32(1u, unit()->link.session);
}

/* Without a store the default told is what is in use. */
static void test_a_board_without_a_store_tells_its_parameters_too(void)
{
    TEST_ASSERT_TRUE(host_port_init(&port, &params, NULL));
    port.background_every = 1u;
    port.until_background = 1u;
    command_writer_t w = ask(UNIT_LINK_PARAM_INFO);
    command_put_u16(&w, (uint16_t)params_find("i_d_A"));
    command_reader_t body;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&w, &body));
    take(&body, 10u);
    TEST_ASSERT_EQUAL_FLOAT(params.i_d_A, command_take_float(&body));
}

static void test_more_signals_than_a_sample_holds_are_refused(void)
{
    const uint8_t number[TRACE_SIGNALS_MAX + 1u] = {0};
    command_reader_t body = {.at = number, .left = TRACE_SIGNALS_MAX};
    command_writer_t w;
    command_begin(&w, 0u, UNIT_LINK_SAMPLE | UNIT_LINK_ANSWER);
    TEST_ASSERT_EQUAL(UNIT_LINK_OK, unit_link_sample(unit(), &body, &w));
    body = (command_reader_t){.at = number, .left = sizeof number};
    command_begin(&w, 0u, UNIT_LINK_SAMPLE | UNIT_LINK_ANSWER);
    TEST_ASSERT_EQUAL(UNIT_LINK_OUT_OF_RANGE, unit_link_sample(unit(), &body, &w));
}

/* A generator that fails is as good as none; a store that could not save says so. */
static void test_a_board_whose_devices_fail_says_so(void)
{
    new_board();
    wait_s(UNIT_STORE_LOCKOUT_S + 0.2f);
    port.devices.entropy = no_entropy;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NOT_NOW, unlock_with(key));
    TEST_ASSERT_EQUAL_UINT32(0u, store_word(2u));
    unit()->store.store.failed = true;
    TEST_ASSERT_EQUAL_UINT32(1u, store_word(2u));
}

static void test_a_command_that_ran_out_is_told(void)
{
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, command(SEQUENCE_CMD_RUN, 0.0f, 10u));
    rounds(100u);
    command_writer_t w = ask(UNIT_LINK_STATUS);
    command_reader_t body;
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&w, &body));
    take(&body, 4u * sizeof(uint32_t));
    TEST_ASSERT_EQUAL_UINT32(1u, command_take_u32(&body));
}

/* More faults than the list keeps, and a record that came through a reset. */
static void test_the_list_of_faults_is_told_as_far_as_it_goes(void)
{
    for (uint32_t n = 0u; n < FAULT_RECORD_LOG + 2u; n++) {
        unit()->machine.faults = 0u;
        rounds(2u);
        unit()->machine.faults = FAULT_OVERLOAD;
        unit()->machine.id = SEQUENCE_FAULT;
        rounds(2u);
    }
    command_reader_t body;
    command_writer_t log = ask(UNIT_LINK_FAULT_LOG);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&log, &body));
    TEST_ASSERT_EQUAL_UINT32(FAULT_RECORD_LOG + 2u, command_take_u32(&body));
    for (uint32_t n = 0u; n < FAULT_RECORD_LOG; n++) { /* the newest first */
        TEST_ASSERT_EQUAL_UINT32(FAULT_RECORD_LOG + 2u - n, command_take_u32(&body));
        take(&body, 12u);
    }
    TEST_ASSERT_TRUE(command_all_taken(&body));
    unit()->fault_recorder.from_before = true;
    fault_memory.kept.number = 1u;
    fault_memory.kept.rows = 2u;
    command_writer_t record = ask(UNIT_LINK_FAULT_RECORD);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&record, &body));
    take(&body, 4u * sizeof(uint32_t));
    TEST_ASSERT_EQUAL_UINT32(1u, command_take_u32(&body));
    command_writer_t read = ask(UNIT_LINK_FAULT_READ);
    command_put_u32(&read, 0u);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_OK, send(&read, &body));
    take(&body, 2u * FAULT_RECORD_SIGNALS * sizeof(uint32_t));
    TEST_ASSERT_TRUE(command_all_taken(&body));
    unit()->fault_recorder = (fault_recorder_t){0}; /* a port without memory for it */
    command_writer_t none = ask(UNIT_LINK_FAULT_READ);
    command_put_u32(&none, 0u);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_NO_SUCH, send_only(&none));
}

static void test_a_slow_line_gets_whole_answers(void)
{
    command_writer_t w = ask(UNIT_LINK_STATUS);
    command_end(&w);
    port.line = (host_port_line_t){.received = w.byte, .received_n = w.length, .sent = answer_byte};
    bool good = false;
    for (uint32_t k = 0u; k < 300u; k++) {
        port.line.room = port.line.sent_n + 1u;
        const uint32_t before = port.line.sent_n;
        (void)round_of_the_port();
        for (uint32_t at = before; at < port.line.sent_n; at++) {
            good |= command_byte(&answer_parser, answer_byte[at], &answer);
        }
    }
    TEST_ASSERT_TRUE(good);
    TEST_ASSERT_EQUAL_UINT8(UNIT_LINK_STATUS | UNIT_LINK_ANSWER, answer.op);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_says_who_it_is);
    RUN_TEST(test_lists_every_parameter_and_signal);
    RUN_TEST(test_a_parameter_that_was_set_is_read_back_and_in_the_control_law);
    RUN_TEST(test_refuses_a_parameter_for_the_right_reason);
    RUN_TEST(test_a_ready_parameter_waits_for_the_gates_to_be_off);
    RUN_TEST(test_a_standing_run_command_counts_as_gates_on);
    RUN_TEST(test_a_command_runs_and_stops_the_drive);
    RUN_TEST(test_a_torque_may_come_with_the_command);
    RUN_TEST(test_a_command_that_is_none_is_refused_and_the_old_one_stands);
    RUN_TEST(test_a_silent_host_stops_the_drive_when_it_said_so);
    RUN_TEST(test_a_commissioning_is_started_and_its_refusal_told);
    RUN_TEST(test_what_a_commissioning_found_is_told_in_order);
    RUN_TEST(test_a_silent_host_ends_a_commissioning_too);
    RUN_TEST(test_a_reset_is_a_pulse_and_can_be_given_again);
    RUN_TEST(test_a_reset_stands_for_two_periods);
    RUN_TEST(test_a_slice_takes_64_bytes_of_the_line);
    RUN_TEST(test_who_is_not_in_session_changes_nothing);
    RUN_TEST(test_before_any_session_zero_is_none_either);
    RUN_TEST(test_a_repeated_request_is_answered_again_and_done_once);
    RUN_TEST(test_every_op_with_every_length_answers_and_only_the_right_one_does);
    RUN_TEST(test_a_request_of_wrong_length_is_not_carried_out);
    RUN_TEST(test_a_request_that_is_too_long_is_not_carried_out);
    RUN_TEST(test_status_tells_state_reference_and_counts);
    RUN_TEST(test_a_sample_is_of_one_period);
    RUN_TEST(test_a_trace_round_the_start_is_read_back);
    RUN_TEST(test_a_trace_set_up_wrongly_is_refused);
    RUN_TEST(test_a_fault_is_listed_recorded_read_and_cleared);
    RUN_TEST(test_a_flight_is_read_row_by_row_as_it_goes_on);
    RUN_TEST(test_an_answer_is_full_of_rows_when_there_are_enough);
    RUN_TEST(test_a_flight_waits_for_the_drive_to_stand);
    RUN_TEST(test_a_flight_without_memory_is_refused);
    RUN_TEST(test_a_flight_is_started_with_the_key_and_read_in_session);
    RUN_TEST(test_a_parameter_that_is_set_is_counted_for_the_flight);
    RUN_TEST(test_a_port_without_recording_says_so);
    RUN_TEST(test_a_refused_set_tells_which_two_exclude_each_other);
    RUN_TEST(test_the_entries_of_a_saved_record_are_told_one_by_one);
    RUN_TEST(test_says_what_the_board_gives);
    RUN_TEST(test_no_session_has_the_number_of_nobody);
    RUN_TEST(test_a_board_without_a_store_tells_its_parameters_too);
    RUN_TEST(test_more_signals_than_a_sample_holds_are_refused);
    RUN_TEST(test_a_board_whose_devices_fail_says_so);
    RUN_TEST(test_a_command_that_ran_out_is_told);
    RUN_TEST(test_the_list_of_faults_is_told_as_far_as_it_goes);
    RUN_TEST(test_a_slow_line_gets_whole_answers);
    RUN_TEST(test_a_saved_parameter_is_there_after_power_up);
    RUN_TEST(test_nothing_is_saved_while_the_gates_are_on);
    RUN_TEST(test_protected_parameters_want_the_key);
    RUN_TEST(test_what_can_hurt_needs_a_sealed_request);
    RUN_TEST(test_an_image_without_a_loader_knows_no_way_there);
    RUN_TEST(test_the_loader_is_called_once_behind_the_answer);
    RUN_TEST(test_the_loader_is_not_called_while_the_drive_runs);
    RUN_TEST(test_the_loader_is_not_called_while_parameters_are_saved);
    RUN_TEST(test_a_stop_needs_no_key);
    RUN_TEST(test_a_sealed_request_is_taken_once_and_whole);
    RUN_TEST(test_a_seal_is_of_one_session);
    RUN_TEST(test_the_guard_counts_its_times_in_seconds);
    RUN_TEST(test_an_answer_without_a_challenge_unlocks_nothing);
    RUN_TEST(test_parameters_of_another_table_are_refused_until_saved_anew);
    RUN_TEST(test_parameters_of_another_period_are_refused);
    RUN_TEST(test_a_set_that_cannot_be_read_any_more_is_refused_until_saved_anew);
    RUN_TEST(test_without_a_flash_a_save_is_refused);
    return UNITY_END();
}
