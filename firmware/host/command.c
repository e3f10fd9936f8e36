#include "command.h"

#include "crc32c.h"

#include <stddef.h>

/* Where the frame begins in a writer's bytes: behind the opening zero and the first COBS code. */
#define FRAME_AT 2u

static void append(command_parser_t *p, uint8_t byte)
{
    if (p->length < COMMAND_FRAME_MAX) {
        p->byte[p->length] = byte;
        p->length++;
    } else {
        p->overlong = true;
    }
}

static uint32_t word_at(const uint8_t *byte)
{
    return (uint32_t)byte[0] | ((uint32_t)byte[1] << 8) | ((uint32_t)byte[2] << 16) |
           ((uint32_t)byte[3] << 24);
}

/* What stands between two zeros is a frame of ours, or it is not. */
static bool check(const command_parser_t *p, command_frame_t *frame)
{
    if (p->overlong || (p->run != 0u) || (p->length < COMMAND_HEAD + COMMAND_CRC)) {
        return false;
    }
    const uint32_t body_bytes = p->length - COMMAND_HEAD - COMMAND_CRC;
    const uint32_t crc = crc32c(p->byte, (size_t)p->length - COMMAND_CRC);
    *frame = (command_frame_t){.sequence = p->byte[0],
                               .op = p->byte[1],
                               .body = &p->byte[COMMAND_HEAD],
                               .body_bytes = body_bytes,
                               .crc32c = crc};
    return crc == word_at(&p->byte[p->length - COMMAND_CRC]);
}

static bool end_of_frame(command_parser_t *p, command_frame_t *frame)
{
    bool good = false;
    if (p->started) {
        good = check(p, frame);
        p->good += good ? 1u : 0u;
        p->bad += good ? 0u : 1u;
    }
    p->length = 0u;
    p->run = 0u;
    p->started = false;
    p->overlong = false;
    return good;
}

bool command_byte(command_parser_t *p, uint8_t byte, command_frame_t *frame)
{
    if (byte == 0u) {
        return end_of_frame(p, frame);
    }
    if (p->run == 0u) {
        /* A code: the zero it stands for, but for the first, and how far the next one is. */
        if (p->started) {
            append(p, 0u);
        }
        p->started = true;
        p->run = (uint32_t)byte - 1u;
    } else {
        append(p, byte);
        p->run--;
    }
    return false;
}

void command_begin(command_writer_t *w, uint8_t sequence, uint8_t op)
{
    w->length = FRAME_AT;
    w->full = false;
    command_put_u8(w, sequence);
    command_put_u8(w, op);
}

uint32_t command_room(const command_writer_t *w)
{
    return (FRAME_AT + COMMAND_HEAD + COMMAND_BODY_MAX) - w->length;
}

void command_put_u8(command_writer_t *w, uint8_t value)
{
    if (command_room(w) == 0u) {
        w->full = true;
        return;
    }
    w->byte[w->length] = value;
    w->length++;
}

void command_put_u16(command_writer_t *w, uint16_t value)
{
    command_put_u8(w, (uint8_t)(value & 0xFFu));
    command_put_u8(w, (uint8_t)(value >> 8));
}

void command_put_u32(command_writer_t *w, uint32_t value)
{
    command_put_u16(w, (uint16_t)(value & 0xFFFFu));
    command_put_u16(w, (uint16_t)(value >> 16));
}

void command_put_float(command_writer_t *w, float value)
{
    command_put_u32(w, float_bits(value));
}

void command_put_text(command_writer_t *w, const char *text)
{
    const uint32_t room = command_room(w);
    const uint32_t most = (room > 0u) ? (room - 1u) : 0u;
    uint32_t n = 0u;
    while ((n < most) && (text[n] != '\0')) {
        n++;
    }
    command_put_u8(w, (uint8_t)n);
    for (uint32_t k = 0u; k < n; k++) {
        command_put_u8(w, (uint8_t)text[k]);
    }
}

void command_end(command_writer_t *w)
{
    const uint32_t crc = crc32c(&w->byte[FRAME_AT], (size_t)w->length - FRAME_AT);
    for (uint32_t k = 0u; k < COMMAND_CRC; k++) {
        w->byte[w->length] = (uint8_t)((crc >> (8u * k)) & 0xFFu);
        w->length++;
    }
    /* Each zero becomes the distance to the next; shorter than a block, so no other code exists. */
    uint32_t code_at = FRAME_AT - 1u;
    for (uint32_t k = FRAME_AT; k < w->length; k++) {
        if (w->byte[k] == 0u) {
            w->byte[code_at] = (uint8_t)(k - code_at);
            code_at = k;
        }
    }
    w->byte[code_at] = (uint8_t)(w->length - code_at);
    w->byte[0] = 0u;
    w->byte[w->length] = 0u;
    w->length++;
}

uint8_t command_take_u8(command_reader_t *r)
{
    if (r->left == 0u) {
        r->missing = true;
        return 0u;
    }
    const uint8_t value = *r->at;
    r->at = &r->at[1];
    r->left--;
    return value;
}

uint16_t command_take_u16(command_reader_t *r)
{
    const uint32_t low = command_take_u8(r);
    const uint32_t high = command_take_u8(r);
    return (uint16_t)(low | (high << 8));
}

uint32_t command_take_u32(command_reader_t *r)
{
    const uint32_t low = command_take_u16(r);
    const uint32_t high = command_take_u16(r);
    return low | (high << 16);
}

float command_take_float(command_reader_t *r)
{
    return float_of_bits(command_take_u32(r));
}

bool command_all_taken(const command_reader_t *r)
{
    return !r->missing && (r->left == 0u);
}
