/* Recorder of up to eight signals at the control period, as an oscilloscope records.
 *
 * A ring of rows in memory that the port gives. The control period writes it while it is armed; the
 * background sets it up and reads it while it is not: `state` says whose it is. Signals are words
 * as they come, floats as their bits; the caller knows which signal is what.
 */
#ifndef TRACE_H
#define TRACE_H

#include <stdbool.h>
#include <stdint.h>

#include "num.h"

#define TRACE_SIGNALS_MAX 8u

typedef enum {
    TRACE_IDLE = 0,      /* the background's: nothing recorded */
    TRACE_ARMED = 1,     /* the period's: waits for its trigger */
    TRACE_TRIGGERED = 2, /* the period's: records what comes after */
    TRACE_DONE = 3       /* the background's: to be read */
} trace_state_t;

typedef enum {
    TRACE_NOW = 0,     /* the first sample */
    TRACE_RISING = 1,  /* from below the level to it or above */
    TRACE_FALLING = 2, /* from the level or above to below */
    TRACE_EITHER = 3,
    TRACE_EDGES /* their count */
} trace_edge_t;

typedef struct {
    uint8_t signal[TRACE_SIGNALS_MAX]; /* numbers, the caller's */
    uint32_t signals;                  /* how many */
    uint32_t decimation;               /* every n-th period; the trigger is watched in each */
    uint8_t trigger;                   /* number of the signal to watch */
    bool trigger_is_float;             /* else uint32_t */
    trace_edge_t edge;
    uint32_t level;  /* in the trigger's type */
    float before_pu; /* share of the rows that is to lie before the trigger, 0..1 */
    uint32_t rows;   /* 0: all that fit */
} trace_setup_t;

typedef struct {
    uint32_t *word; /* rows of setup.signals words each, a ring */
    uint32_t words;

    trace_setup_t setup;
    uint32_t rows;
    uint32_t rows_after; /* from the trigger on */

    volatile uint32_t state; /* trace_state_t */
    uint32_t head;           /* next row */
    uint32_t filled;
    uint32_t left;      /* rows still to come once triggered */
    uint32_t countdown; /* periods to the next row */
    bool above;         /* trigger signal at its last look */
    bool looked;
    uint32_t trigger_period;
} trace_t;

/* The memory stays the caller's; words may be 0: then nothing can be set up. */
void trace_init(trace_t *t, uint32_t *word, uint32_t words);

/* Background: armed afterwards, instead of whatever was before. False, and nothing changed, for a
 * set-up that makes no sense or does not fit. */
CHECKED bool trace_arm(trace_t *t, const trace_setup_t *setup);

/* Background: back to IDLE from any state. */
void trace_stop(trace_t *t);

/* Control period: whether it is to be given a sample. */
static inline bool trace_running(const trace_t *t)
{
    return (t->state == (uint32_t)TRACE_ARMED) || (t->state == (uint32_t)TRACE_TRIGGERED);
}

/* Control period: looks at the trigger's word of this period; true when the period is a row, which
 * is then to be written to trace_row() and ended with trace_row_done(). */
bool trace_watch(trace_t *t, uint32_t trigger_word, uint32_t period);
uint32_t *trace_row(const trace_t *t);
void trace_row_done(trace_t *t);

/* Background, when DONE: rows there are, the row of the trigger, one word of a row; oldest first.
 * 0 for a word that does not exist. */
uint32_t trace_rows(const trace_t *t);
uint32_t trace_trigger_row(const trace_t *t);
uint32_t trace_word(const trace_t *t, uint32_t row, uint32_t column);

#endif
