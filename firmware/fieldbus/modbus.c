#include "modbus.h"

#include "modbus_crc.h"

#include <stddef.h>

/* A slice stays short: the watchdog and the checks wait behind it. */
#define BYTES_PER_SLICE 64u

enum {
    READ_HOLDING = 3,
    READ_INPUT = 4,
    WRITE_ONE = 6,
    DIAGNOSE = 8,
    WRITE_SEVERAL = 16
};

#define BROADCAST     0u
#define EXCEPTION     0x80u
#define PDU_SHORT     5u /* function and two words */
#define PDU_SEVERAL   6u /* and the number of bytes */
#define WRITE_MAX     123u
#define ECHO_FUNCTION 0u /* of DIAGNOSE */

static uint32_t word_at(const uint8_t *byte)
{
    return ((uint32_t)byte[0] << 8) | byte[1];
}

static void put_word(uint8_t *byte, uint32_t word)
{
    byte[0] = (uint8_t)((word >> 8) & 0xFFu);
    byte[1] = (uint8_t)(word & 0xFFu);
}

/* Answers are PDUs: bytes behind the function, *n of them in all. */
static modbus_exception_t read_registers(const fieldbus_t *fb, const unit_t *unit,
                                         const modbus_frame_t *frame, uint8_t *answer, uint32_t *n)
{
    uint16_t value[MODBUS_READ_MAX];
    const modbus_range_t range = {.bank = (frame->pdu[0] == (uint8_t)READ_HOLDING) ? MODBUS_HOLDING
                                                                                   : MODBUS_INPUT,
                                  .address = word_at(&frame->pdu[1]),
                                  .n = word_at(&frame->pdu[3])};
    if ((range.n == 0u) || (range.n > MODBUS_READ_MAX)) {
        return MODBUS_ILLEGAL_VALUE;
    }
    const modbus_exception_t bad = modbus_map_read(fb, unit, &range, value);
    if (bad != MODBUS_OK) {
        return bad;
    }
    answer[1] = (uint8_t)(2u * range.n);
    for (uint32_t k = 0u; k < range.n; k++) {
        put_word(&answer[2u + 2u * k], value[k]);
    }
    *n = 2u + 2u * range.n;
    return MODBUS_OK;
}

static modbus_exception_t write_several(fieldbus_t *fb, unit_t *unit, const modbus_frame_t *frame)
{
    uint16_t value[WRITE_MAX];
    const uint32_t n = word_at(&frame->pdu[3]);
    if ((n == 0u) || (n > WRITE_MAX) || (frame->pdu[5] != 2u * n) ||
        (frame->pdu_bytes != PDU_SEVERAL + 2u * n)) {
        return MODBUS_ILLEGAL_VALUE;
    }
    for (uint32_t k = 0u; k < n; k++) {
        value[k] = (uint16_t)word_at(&frame->pdu[PDU_SEVERAL + 2u * k]);
    }
    return modbus_map_write(fb, unit, word_at(&frame->pdu[1]), n, value);
}

static bool known(uint8_t function)
{
    static const uint8_t functions[] = {READ_HOLDING, READ_INPUT, WRITE_ONE, DIAGNOSE,
                                        WRITE_SEVERAL};
    for (size_t k = 0u; k < sizeof functions; k++) {
        if (functions[k] == function) {
            return true;
        }
    }
    return false;
}

/* Every function but WRITE_SEVERAL has two words. */
static bool length_good(const modbus_frame_t *frame)
{
    return (frame->pdu[0] == (uint8_t)WRITE_SEVERAL) ? (frame->pdu_bytes > PDU_SEVERAL)
                                                     : (frame->pdu_bytes == PDU_SHORT);
}

static modbus_exception_t carry_out(fieldbus_t *fb, unit_t *unit, const modbus_frame_t *frame,
                                    uint8_t *answer, uint32_t *n)
{
    if (!known(frame->pdu[0])) {
        return MODBUS_ILLEGAL_FUNCTION;
    }
    if (!length_good(frame)) {
        return MODBUS_ILLEGAL_VALUE;
    }
    /* A write is answered with its first bytes. */
    *n = PDU_SHORT;
    for (uint32_t k = 0u; k < PDU_SHORT; k++) {
        answer[k] = frame->pdu[k];
    }
    const uint32_t first = word_at(&frame->pdu[1]);
    const uint16_t second = (uint16_t)word_at(&frame->pdu[3]);
    switch (frame->pdu[0]) {
    case WRITE_ONE:
        return modbus_map_write(fb, unit, first, 1u, &second);
    case WRITE_SEVERAL:
        return write_several(fb, unit, frame);
    case DIAGNOSE:
        return (first == ECHO_FUNCTION) ? MODBUS_OK : MODBUS_ILLEGAL_FUNCTION;
    default:
        return read_registers(fb, unit, frame, answer, n);
    }
}

uint32_t modbus_answer(fieldbus_t *fb, unit_t *unit, const modbus_frame_t *frame, uint8_t *answer)
{
    uint32_t n = 0u;
    uint8_t *pdu = &answer[1];
    const modbus_exception_t bad = carry_out(fb, unit, frame, pdu, &n);
    if (bad != MODBUS_OK) {
        pdu[0] = (uint8_t)(frame->pdu[0] | EXCEPTION);
        pdu[1] = (uint8_t)bad;
        n = 2u;
    }
    answer[0] = frame->address;
    const uint32_t covered = n + 1u;
    const uint16_t crc = modbus_crc(answer, covered);
    answer[covered] = (uint8_t)(crc & 0xFFu);
    answer[covered + 1u] = (uint8_t)(crc >> 8);
    return covered + MODBUS_CRC_BYTES;
}

/* Whether the line has taken all of the answer. */
static bool answer_sent(modbus_t *modbus, const hal_serial_t *line)
{
    const uint32_t left = modbus->answer_n - modbus->sent;
    if (left > 0u) {
        modbus->sent += line->write(line->context, &modbus->answer[modbus->sent], left);
    }
    return modbus->sent >= modbus->answer_n;
}

static void take(modbus_t *modbus, fieldbus_t *fb, unit_t *unit, const modbus_frame_t *frame)
{
    const bool everybody = frame->address == BROADCAST;
    if (!everybody && (frame->address != unit->params.fieldbus_address)) {
        return;
    }
    const uint32_t n = modbus_answer(fb, unit, frame, modbus->answer);
    modbus->sent = 0u;
    modbus->answer_n = everybody ? 0u : n;
}

void modbus_background(modbus_t *modbus, fieldbus_t *fb, unit_t *unit, const hal_serial_t *line)
{
    if (!answer_sent(modbus, line)) {
        return; /* the master waits for it before it asks again */
    }
    for (uint32_t n = 0u; n < BYTES_PER_SLICE; n++) {
        uint8_t byte = 0u;
        uint32_t at_us = 0u;
        modbus_frame_t frame;
        const bool came = line->read(line->context, &byte, &at_us);
        const uint32_t now_us = came ? at_us : line->clock_us(line->context);
        const bool ended = modbus_rtu_ended(&modbus->rtu, line->silence_us, now_us, &frame);
        if (ended) {
            take(modbus, fb, unit, &frame);
        }
        if (came) {
            modbus_rtu_byte(&modbus->rtu, byte, at_us);
        }
        if (ended || !came) {
            (void)answer_sent(modbus, line);
            return;
        }
    }
}
