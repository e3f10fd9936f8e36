/* `link_frames COUNT SEED`: COUNT random frames into a SIL drive that runs in closed loop; not one
 * duty of one period may differ from the same run without them. A third word, `set`, also changes a
 * parameter, which has to be noticed: exit code 1. */
#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "access.h"
#include "hal_development_key.h"
#include "unit_link.h"
#include "link.h"
#include "params.h"
#include "random_frames.h"

#define BUFFER        4096u
#define ANSWERS       (1u << 16)
#define PERIODS_A_RUN 64u
#define POWER_UP      6000u /* periods until the drive gives a challenge */

static uint8_t answers[ANSWERS];

static void refuse(const char *what)
{
    (void)fprintf(stderr, "link_frames: %s: %s\n", what, zh_sil_error());
    exit(2);
}

static zh_link *open_drive(void)
{
    const zh_sim_job job = {.struct_size = sizeof job,
                            .decimate = 1u,
                            .seed = 1u,
                            .scenario = ZH_ROOT "/host_sim/scenarios/smoke.toml",
                            .rig = ZH_ROOT "/host_sim/rigs/hasegawa2005.toml",
                            .board = ZH_ROOT "/host_sim/boards/paper.toml",
                            .motor_dir = ZH_ROOT "/gain_tables/hasegawa2005"};
    zh_link *drive = zh_link_open(&job, 0u, NULL);
    if (drive == NULL) {
        refuse("zh_link_open");
    }
    return drive;
}

static zh_link_state state_of(const zh_link *drive)
{
    zh_link_state state = {.struct_size = sizeof state};
    if (zh_link_get_state(drive, &state) != ZH_OK) {
        refuse("zh_link_get_state");
    }
    return state;
}

/* Until the drive has taken them all; how many answers came. */
static uint32_t talk(zh_link *drive, const uint8_t *byte, uint32_t n, command_parser_t *parser,
                     command_frame_t *last)
{
    uint32_t count = 0u;
    while (n > 0u) {
        uint32_t taken = n;
        uint32_t said = ANSWERS;
        if (zh_link_run(drive, PERIODS_A_RUN, byte, &taken, answers, &said) != ZH_OK) {
            refuse("zh_link_run");
        }
        for (uint32_t k = 0u; k < said; k++) {
            count += command_byte(parser, answers[k], last) ? 1u : 0u;
        }
        byte += taken;
        n -= taken;
    }
    return count;
}

static uint32_t session_of(zh_link *drive, command_parser_t *parser)
{
    command_writer_t w;
    command_begin(&w, 0u, UNIT_LINK_SESSION);
    command_end(&w);
    command_frame_t answer;
    if (talk(drive, w.byte, w.length, parser, &answer) != 1u) {
        refuse("no session");
    }
    command_reader_t body = {.at = answer.body, .left = answer.body_bytes};
    (void)command_take_u8(&body);
    return command_take_u32(&body);
}

static void wait_periods(zh_link *drive, uint32_t n)
{
    for (uint32_t k = 0u; k < n; k += PERIODS_A_RUN) {
        uint32_t none = 0u;
        uint32_t room = 0u;
        if (zh_link_run(drive, PERIODS_A_RUN, NULL, &none, NULL, &room) != ZH_OK) {
            refuse("zh_link_run");
        }
    }
}

/* Of one request that has to be done: what its answer says behind the status. */
static command_reader_t done(zh_link *drive, command_writer_t *w, command_parser_t *parser)
{
    static command_frame_t answer;
    command_end(w);
    if ((talk(drive, w->byte, w->length, parser, &answer) != 1u) || (answer.body[0] != 0u)) {
        refuse("a request is refused");
    }
    return (command_reader_t){.at = &answer.body[1], .left = answer.body_bytes - 1u};
}

static void put_u64(command_writer_t *w, uint64_t value)
{
    command_put_u32(w, (uint32_t)value);
    command_put_u32(w, (uint32_t)(value >> 32u));
}

/* As somebody with the key does it: challenge, answer, sealed request. */
static void set_parameter(zh_link *drive, uint32_t session, command_parser_t *parser)
{
    static const uint8_t key[SIPHASH_KEY_BYTES] = HAL_DEVELOPMENT_KEY;
    uint8_t session_key[SIPHASH_KEY_BYTES];
    command_writer_t w;
    wait_periods(drive, POWER_UP);
    command_begin(&w, 253u, UNIT_LINK_CHALLENGE);
    command_put_u32(&w, session);
    command_reader_t said = done(drive, &w, parser);
    const uint64_t low = command_take_u32(&said);
    const uint64_t nonce = low | ((uint64_t)command_take_u32(&said) << 32u);
    command_begin(&w, 254u, UNIT_LINK_UNLOCK);
    command_put_u32(&w, session);
    put_u64(&w, access_open_response(key, nonce));
    (void)done(drive, &w, parser);
    access_session_key(key, nonce, session_key);
    command_begin(&w, 255u, UNIT_LINK_SEALED);
    const uint32_t from = w.length;
    command_put_u8(&w, UNIT_LINK_SET);
    command_put_u32(&w, session);
    command_put_u16(&w, (uint16_t)params_find("i_d_A"));
    command_put_float(&w, 4.6f);
    command_put_u32(&w, 1u);
    put_u64(&w, siphash_2_4(session_key, &w.byte[from], w.length - from));
    (void)done(drive, &w, parser);
}

int main(int argc, char **argv)
{
    if ((argc != 3) && (argc != 4)) {
        (void)fprintf(stderr, "usage: %s COUNT SEED [set]\n", argv[0]);
        return 2;
    }
    const unsigned long count = strtoul(argv[1], NULL, 10);
    command_parser_t parser = {0};
    command_frame_t answer;
    zh_link *talked = open_drive();
    random_frames_t frames = {.seed = strtoul(argv[2], NULL, 10),
                              .session = session_of(talked, &parser)};
    if (argc == 4) {
        set_parameter(talked, frames.session, &parser);
    }
    uint64_t answered = 0u;
    for (unsigned long done = 0u; done < count;) {
        static uint8_t buffer[BUFFER];
        uint32_t n = 0u;
        while ((n + RANDOM_FRAME_MAX <= BUFFER) && (done < count)) {
            n += random_frame(&frames, &buffer[n]);
            done++;
        }
        answered += talk(talked, buffer, n, &parser, &answer);
    }
    const zh_link_state with = state_of(talked);
    zh_link_close(talked);

    zh_link *quiet = open_drive();
    wait_periods(quiet, (uint32_t)with.periods);
    const zh_link_state without = state_of(quiet);
    zh_link_close(quiet);

    const bool equal = (with.digest == without.digest) && (with.periods == without.periods);
    (void)printf("%lu frames, %" PRIu64 " answers (%u bad), %" PRIu64
                 " periods, gates %s, %.1f min^-1: %s\n",
                 count, answered, parser.bad, with.periods, with.gates_on ? "on" : "off",
                 with.speed_rpm, equal ? "the same duties" : "DUTIES DIFFER");
    return (equal && (with.gates_on != 0u) && (answered > count / 4u) && (parser.bad == 0u)) ? 0
                                                                                             : 1;
}
