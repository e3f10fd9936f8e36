#include "random_frames.h"

#include <string.h>

#include "unit_link.h"
#include "unit_signal.h"

/* 64-bit LCG, high bits. */
static uint32_t next(random_frames_t *r)
{
    r->seed = r->seed * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(r->seed >> 33);
}

static uint32_t noise(random_frames_t *r, uint8_t *wire)
{
    const uint32_t n = 1u + next(r) % 60u;
    for (uint32_t k = 0u; k < n; k++) {
        wire[k] = (uint8_t)next(r);
    }
    wire[n - 1u] = 0u;
    return n;
}

static uint32_t wire_of(command_writer_t *w, uint8_t *wire)
{
    command_end(w);
    memcpy(wire, w->byte, w->length);
    return w->length;
}

/* Any op but that which gives a session, with any body: what acts lacks the session's number. */
static uint32_t stranger(random_frames_t *r, uint8_t *wire)
{
    static const uint8_t known[] = {
        UNIT_LINK_SET,        UNIT_LINK_COMMAND,     UNIT_LINK_TRACE_ARM,
        UNIT_LINK_TRACE_STOP, UNIT_LINK_FAULT_CLEAR, UNIT_LINK_SAVE,
        UNIT_LINK_CHALLENGE,  UNIT_LINK_UNLOCK,      UNIT_LINK_SEALED};
    static const uint8_t length[] = {10u, 14u, 25u, 4u, 4u, 4u, 4u, 12u, 23u};
    const uint32_t pick = next(r) % (2u * sizeof known);
    uint8_t op = (uint8_t)next(r);
    uint32_t n = next(r) % 41u;
    if (pick < sizeof known) {
        op = known[pick];
        n = length[pick];
    }
    command_writer_t w;
    command_begin(&w, r->sequence++, (op == UNIT_LINK_SESSION) ? UNIT_LINK_STATUS : op);
    for (uint32_t k = 0u; k < n; k++) {
        command_put_u8(&w, (uint8_t)next(r));
    }
    return wire_of(&w, wire);
}

static uint32_t reader(random_frames_t *r, uint8_t *wire)
{
    static const uint8_t ops[] = {
        UNIT_LINK_HELLO,        UNIT_LINK_STATUS,     UNIT_LINK_TRACE_STATE, UNIT_LINK_FAULT_LOG,
        UNIT_LINK_FAULT_RECORD, UNIT_LINK_PARAM_INFO, UNIT_LINK_SIGNAL_INFO, UNIT_LINK_GET,
        UNIT_LINK_SAMPLE,       UNIT_LINK_TRACE_READ, UNIT_LINK_FAULT_READ,  UNIT_LINK_STORE};
    const uint8_t op = ops[next(r) % sizeof ops];
    command_writer_t w;
    command_begin(&w, r->sequence++, op);
    if (op == UNIT_LINK_PARAM_INFO) {
        command_put_u16(&w, (uint16_t)(next(r) % 120u));
    } else if ((op == UNIT_LINK_SIGNAL_INFO) || (op == UNIT_LINK_SAMPLE)) {
        command_put_u8(&w, (uint8_t)(next(r) % 80u));
    } else if (op == UNIT_LINK_GET) {
        for (uint32_t k = next(r) % 40u; k > 0u; k--) {
            command_put_u16(&w, (uint16_t)(next(r) % 100u));
        }
    } else if ((op == UNIT_LINK_TRACE_READ) || (op == UNIT_LINK_FAULT_READ)) {
        command_put_u32(&w, next(r) % 100u);
    } else {
        /* no body */
    }
    return wire_of(&w, wire);
}

static uint32_t recorder(random_frames_t *r, uint8_t *wire)
{
    command_writer_t w;
    const uint32_t what = next(r) % 4u;
    const uint8_t op = (what == 0u)   ? UNIT_LINK_TRACE_STOP
                       : (what == 1u) ? UNIT_LINK_FAULT_CLEAR
                                      : UNIT_LINK_TRACE_ARM;
    command_begin(&w, r->sequence++, op);
    command_put_u32(&w, r->session);
    if (op == UNIT_LINK_TRACE_ARM) {
        const uint32_t n = next(r) % 10u;
        command_put_u8(&w, (uint8_t)n);
        for (uint32_t k = 0u; k < n; k++) {
            command_put_u8(&w, (uint8_t)(next(r) % (UNIT_SIGNALS + 2u)));
        }
        command_put_u32(&w, next(r) % 4u);
        command_put_u8(&w, (uint8_t)(next(r) % UNIT_SIGNALS));
        command_put_u8(&w, (uint8_t)(next(r) % 5u));
        command_put_u32(&w, next(r));
        command_put_float(&w, (float)(next(r) % 5u) * 0.3f);
        command_put_u32(&w, next(r) % 600u);
    }
    return wire_of(&w, wire);
}

static uint32_t damaged(random_frames_t *r, uint8_t *wire)
{
    uint32_t n = ((next(r) & 1u) != 0u) ? reader(r, wire) : stranger(r, wire);
    for (uint32_t k = 1u + next(r) % 3u; k > 0u; k--) {
        wire[next(r) % n] ^= (uint8_t)(1u << (next(r) % 8u));
    }
    if ((next(r) & 3u) == 0u) {
        n = 1u + next(r) % n; /* cut */
    }
    return n;
}

uint32_t random_frame(random_frames_t *r, uint8_t *wire)
{
    switch (next(r) % 5u) {
    case 0u:
        return noise(r, wire);
    case 1u:
        return stranger(r, wire);
    case 2u:
        return reader(r, wire);
    case 3u:
        return (r->session != 0u) ? recorder(r, wire) : reader(r, wire);
    default:
        return damaged(r, wire);
    }
}
