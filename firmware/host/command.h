/* Frames of the host link: bytes in, one complete and checked frame out, and the reverse.
 *
 * Frame: sequence, op, body, CRC-32C of all of that (little endian). On the wire: a zero byte, the
 * frame in COBS, a zero byte. There is no other zero, so that the reader is in step again after the
 * next one, whatever came before (noise, text of another protocol). README.md has the ops.
 */
#ifndef COMMAND_H
#define COMMAND_H

#include <stdbool.h>
#include <stdint.h>

#include "num.h"

#define COMMAND_FRAME_MAX 250u /* below 254: COBS adds one byte, always */
#define COMMAND_HEAD      2u
#define COMMAND_CRC       4u
#define COMMAND_BODY_MAX  (COMMAND_FRAME_MAX - COMMAND_HEAD - COMMAND_CRC)
#define COMMAND_WIRE_MAX  (COMMAND_FRAME_MAX + 3u)

/* A zeroed state is valid. */
typedef struct {
    uint8_t byte[COMMAND_FRAME_MAX]; /* decoded so far */
    uint32_t length;
    uint32_t run;  /* bytes up to the next zero that COBS removed */
    bool started;  /* the first code byte has come */
    bool overlong; /* too long; wait for the next zero */
    uint32_t good; /* counters, wrap */
    uint32_t bad;
} command_parser_t;

/* Owned by the parser; valid until its next byte. */
typedef struct {
    uint8_t sequence;
    uint8_t op;
    const uint8_t *body;
    uint32_t body_bytes;
    uint32_t crc32c;
} command_frame_t;

/* One received byte; true when it completed a frame with a correct CRC. */
CHECKED bool command_byte(command_parser_t *parser, uint8_t byte, command_frame_t *frame);

/* A frame under construction, then its bytes on the wire. */
typedef struct {
    uint8_t byte[COMMAND_WIRE_MAX];
    uint32_t length;
    bool full; /* overflow: the rest is missing */
} command_writer_t;

void command_begin(command_writer_t *w, uint8_t sequence, uint8_t op);
void command_put_u8(command_writer_t *w, uint8_t value);
void command_put_u16(command_writer_t *w, uint16_t value);
void command_put_u32(command_writer_t *w, uint32_t value);
void command_put_float(command_writer_t *w, float value);
/* One byte of length, then the text without terminator, as far as the body has room. */
void command_put_text(command_writer_t *w, const char *text);

/* Free bytes of the body. */
uint32_t command_room(const command_writer_t *w);

/* Adds CRC and COBS: byte[0..length-1] are then the bytes for the wire. */
void command_end(command_writer_t *w);

/* Reads a body from the front; past its end everything reads 0 and `missing` is set. */
typedef struct {
    const uint8_t *at;
    uint32_t left;
    bool missing;
} command_reader_t;

uint8_t command_take_u8(command_reader_t *r);
uint16_t command_take_u16(command_reader_t *r);
uint32_t command_take_u32(command_reader_t *r);
float command_take_float(command_reader_t *r);

/* True when the whole body was read and nothing was missing. */
bool command_all_taken(const command_reader_t *r);

#endif
