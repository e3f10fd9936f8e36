/* Everything a host can say to a drive, for libFuzzer (clang, preset `fuzz`) or fuzz_main.c.
 *
 * The first byte of an input chooses: raw bytes as from a line, or pieces that become frames with a
 * right CRC, some of them in session, so that the requests behind parser and CRC are met too.
 * Claims, checked after every input: parameters untouched, no command but a stop, nobody opens a
 * session, the answers are frames, and the gates stay off while nobody posts a command.
 */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "unit_link.h"
#include "unit_record.h"
#include "fuzz_link.h"
#include "host_port.h"
#include "ram_flash.h"

#define TRACE_WORDS  64u
#define FLIGHT_WORDS (64u * FLIGHT_ROW_WORDS)
#define ANSWER_BYTES 8192u
#define LINE_BYTES   8192u

static host_port_t port;
static host_port_t fresh; /* port before any input */
static uint32_t trace_memory[TRACE_WORDS];
static uint32_t flight_memory[FLIGHT_WORDS];
static fault_memory_t fault_memory;
static uint8_t answers[ANSWER_BYTES];
static uint8_t line[LINE_BYTES];
static command_parser_t answer_parser;
static ram_flash_t flash_memory;
static const hal_flash_t flash = RAM_FLASH(&flash_memory);
static const uint8_t key[SIPHASH_KEY_BYTES] = {1u};

static bool entropy(void *context, uint64_t *bits)
{
    *bits = ((const host_port_t *)context)->clock_us;
    return true;
}

static void claim(bool holds, const char *what)
{
    if (!holds) {
        (void)fprintf(stderr, "does not hold: %s\n", what);
        abort();
    }
}

static void start(void)
{
    static params_t params; /* the drive keeps them as its defaults */
    params_default(&params);
    params.observer_gain_enable = 0u;
    params.offset_calibration_s = 0.0f;
    const host_port_store_t store = {&flash, key, entropy};
    ram_flash_start(&flash_memory);
    claim(host_port_init(&port, &params, NULL), "the drive starts");
    claim(host_port_start(&port, &params, NULL, &store), "also with a store");
    port.unit.store.access.waited =
        port.unit.store.access_cfg.lockout_ticks; /* challenges from now */
    port.background_every = 1u;
    port.until_background = 1u;
    const unit_memory_t memory = {trace_memory, TRACE_WORDS, &fault_memory, flight_memory,
                                  FLIGHT_WORDS};
    host_port_record(&port, &memory);
    port.unit.link.session = 0x5A5A1234u;
    fresh = port;
}

static void control_periods(uint32_t n)
{
    const unit_command_t nothing = {0};
    const hal_sample_t rest = {8192u, 8192u, 8192u, 8192u, 8192u, 11592u, 0u, 0u};
    for (uint32_t k = 0u; k < n; k++) {
        hal_output_t out;
        host_port_period(&port, &nothing, &rest, &out);
        claim(!out.gates_on, "the gates stay off");
    }
}

static uint32_t append_frame(uint32_t at, const uint8_t *piece, uint32_t n, bool in_session)
{
    command_writer_t w;
    command_begin(&w, (n > 0u) ? piece[0] : 0u, (n > 1u) ? (piece[1] & 0x7Fu) : 0u);
    if (in_session) {
        command_put_u32(&w, port.unit.link.session);
    }
    for (uint32_t k = 2u; k < n; k++) {
        command_put_u8(&w, piece[k]);
    }
    command_end(&w);
    for (uint32_t k = 0u; (k < w.length) && (at < LINE_BYTES); k++) {
        line[at] = w.byte[k];
        at++;
    }
    return at;
}

/* Pieces of 1 + (length byte mod 64) bytes; bit 6 of it puts the frame in session. */
static uint32_t frames_of(const uint8_t *data, size_t n)
{
    uint32_t at = 0u;
    size_t k = 0u;
    while (k < n) {
        const uint8_t head = data[k];
        k++;
        uint32_t bytes = 1u + (head & 63u);
        if (bytes > n - k) {
            bytes = (uint32_t)(n - k);
        }
        at = append_frame(at, &data[k], bytes, (head & 64u) != 0u);
        k += bytes;
    }
    return at;
}

static void check_answers(void)
{
    command_frame_t frame;
    uint32_t good = 0u;
    for (uint32_t k = 0u; k < port.line.sent_n; k++) {
        if (command_byte(&answer_parser, answers[k], &frame)) {
            good++;
            claim((frame.op & UNIT_LINK_ANSWER) != 0u, "an answer is marked as one");
            claim((frame.body_bytes >= 1u) && (frame.body[0] <= UNIT_LINK_NOT_SEALED),
                  "an answer has a known status");
        }
    }
    claim(answer_parser.bad == 0u, "answers are frames");
    claim(good <= port.unit.link.parser.good, "no answer without a request");
    answer_parser = (command_parser_t){0};
}

static void check_drive(void)
{
    const unit_t *unit = &port.unit;
    const bool changed = memcmp(&unit->params, &fresh.unit.params, sizeof unit->params) != 0;
    claim((unit->link.command & ~0x1Fu) == 0u, "commands are known");
    claim(is_finite(unit->link.omega_m_ref_rad_s), "the reference is a number");
    claim(unit->configured, "the drive stays configured");
    claim(!unit->store.access.open, "nobody guesses the answer");
    claim((unit->link.command & ~SEQUENCE_CMD_TORQUE_OFF) == 0u, "nobody without the key starts");
    claim(!changed, "nobody without the key changes a parameter");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    if (fresh.background_every == 0u) {
        start();
    }
    if ((n < 2u) || (n > LINE_BYTES / 4u)) {
        return 0;
    }
    port = fresh;
    const bool raw = (data[0] & 1u) != 0u;
    const uint32_t bytes = raw ? (uint32_t)n - 1u : frames_of(&data[1], n - 1u);
    port.line = (host_port_line_t){.received = raw ? &data[1] : line,
                                   .received_n = bytes,
                                   .sent = answers,
                                   .room = ANSWER_BYTES};
    for (uint32_t k = 0u; (k < 2000u) && (port.line.taken < bytes); k++) {
        unit_background(&port.unit, &port.devices);
    }
    const bool full =
        port.line.sent_n == ANSWER_BYTES; /* then the last answer is still on its way */
    claim(full || (port.line.taken == bytes), "all bytes are taken");
    control_periods(1u);
    if (!full) {
        check_answers();
    }
    check_drive();
    return 0;
}
