/* Seeded frames of every kind of harm a line can bring to a drive's link, none of which may change
 * a duty: noise, whole frames of any op without the session, requests that only read, damaged
 * frames, and in session those that only record. */
#ifndef RANDOM_FRAMES_H
#define RANDOM_FRAMES_H

#include <stddef.h>
#include <stdint.h>

#include "command.h"

#define RANDOM_FRAME_MAX COMMAND_WIRE_MAX

typedef struct {
    uint64_t seed;
    uint32_t session; /* 0: none is known */
    uint8_t sequence;
} random_frames_t;

/* Bytes of the next frame on the wire; their number, 1..RANDOM_FRAME_MAX. */
uint32_t random_frame(random_frames_t *r, uint8_t *wire);

#endif
