/* Flight recorder: what a drive is given in every control period, for a host that runs it again.
 *
 * A ring of rows of three words. The control period writes them, the background hands them to the
 * host and frees them. Recording begins with a start of the drive's state, so a replay needs
 * nothing but the rows and the parameters. A full ring ends it: behind a gap nothing can be
 * replayed.
 *
 * A row is six half-words, the first one low. Either the six ADC words of hal_sample_t, 15 bits
 * each; bit 15 of the second: the host is alive, of the third: break input. Bit 15 of the first
 * marks a row of another kind. It belongs to the sample that follows; a CHECK to those before it.
 *
 *   START      number of parameter changes so far; heat of motor and inverter (float)
 *   COMMAND    command bits; speed (rad/s) and torque (Nm) wanted (float)
 *   PARAMETER  index; value (float), number of parameter changes so far
 *   EVENT      crests missed; faults that the background found, 0
 *   CHECK      0; digest of all outputs so far, number of samples so far
 */
#ifndef FLIGHT_H
#define FLIGHT_H

#include <stdbool.h>
#include <stdint.h>

#include "num.h"

#define FLIGHT_ROW_WORDS     3u
#define FLIGHT_ROWS_MIN      64u /* of a ring that is of any use */
#define FLIGHT_PER_PERIOD    5u  /* rows of one period at most: one of each kind but START */
#define FLIGHT_ADC_BITS_MAX  15u
#define FLIGHT_CHECK_SAMPLES 256u
#define FLIGHT_MARK          0x8000u /* bit 15 of a half-word */

/* First half-word of a row that is no sample. Append-only. */
#define FLIGHT_START     0x8000u
#define FLIGHT_COMMAND   0x8001u
#define FLIGHT_PARAMETER 0x8002u
#define FLIGHT_EVENT     0x8003u
#define FLIGHT_CHECK     0x8004u

typedef enum {
    FLIGHT_OFF = 0,
    FLIGHT_ASKED = 1, /* the next period starts the drive anew */
    FLIGHT_ON = 2,
    FLIGHT_LOST = 3 /* the ring was full: what it holds can still be read */
} flight_state_t;

typedef struct {
    uint32_t *word;
    uint32_t rows; /* a power of two; 0: no ring */

    volatile uint32_t state;   /* flight_state_t */
    volatile uint32_t written; /* rows since the start, wraps */
    volatile uint32_t taken;   /* of those, the host has these: the background's */
    uint32_t lost;             /* periods since the ring was full */
    uint32_t changes;          /* of parameters, asked for over the link: the background's */
    uint32_t changed;          /* index of the last one: the background's */

    /* The control period's: as the last row had it. */
    uint32_t command;
    uint32_t alive;
    uint32_t in_force;
    uint32_t faults;
    uint16_t late_periods;
    uint32_t digest;
    uint32_t samples;
} flight_t;

/* The memory stays the caller's; words may be 0: then nothing can be recorded. */
void flight_init(flight_t *f, uint32_t *word, uint32_t words);

/* Background: asks the next period to begin; false without a ring. */
CHECKED bool flight_arm(flight_t *f);

static inline void flight_stop(flight_t *f)
{
    f->state = (uint32_t)FLIGHT_OFF;
}

/* Background: all rows before this one are freed; false for one that was freed or not written. */
CHECKED bool flight_take(flight_t *f, uint32_t row);

/* Background: a row that has been written and not been freed. */
static inline const uint32_t *flight_row(const flight_t *f, uint32_t row)
{
    return &f->word[(size_t)FLIGHT_ROW_WORDS * (row & (f->rows - 1u))];
}

/* Control period: room for all that one may have to tell. */
bool flight_room(const flight_t *f);

/* Control period: a row, by two half-words and two words, or as six half-words. */
void flight_put(flight_t *f, uint32_t first, uint32_t second, uint32_t third);

static inline void flight_put_kind(flight_t *f, uint32_t kind, uint32_t value, uint32_t second,
                                   uint32_t third)
{
    flight_put(f, kind | (value << 16u), second, third);
}

/* FNV-1a, word by word. */
static inline uint32_t flight_fold(uint32_t digest, uint32_t word)
{
    return (digest ^ word) * 0x01000193u;
}

#endif
