/* Recorder of up to eight signals at the control period, like an oscilloscope.
 *
 * A ring of rows in memory from the port. The control period writes it while armed; the background
 * sets it up and reads it otherwise: `state` shows the owner. Signals are raw words, floats as
 * their bits; the caller knows the signals.
 */
#ifndef TRACE_H
#define TRACE_H

#include <stdbool.h>
#include <stdint.h>

#include "num.h"

#define TRACE_SIGNALS_MAX 8u

typedef enum {
    TRACE_IDLE = 0,      /* background: nothing recorded */
    TRACE_ARMED = 1,     /* control period: waits for the trigger */
    TRACE_TRIGGERED = 2, /* control period: records after the trigger */
    TRACE_DONE = 3       /* background: ready to read */
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
    uint8_t trigger;                   /* number of the trigger signal */
    bool trigger_is_float;             /* else uint32_t */
    trace_edge_t edge;
    uint32_t level;  /* in the trigger's type */
    float before_pu; /* share of the rows before the trigger, 0..1 */
    uint32_t rows;   /* 0: as many as fit */
} trace_setup_t;

typedef struct {
    uint32_t *word; /* rows of setup.signals words each, a ring */
    uint32_t words;

    trace_setup_t setup;
    uint32_t rows;
    uint32_t rows_after; /* rows from the trigger */

    volatile uint32_t state; /* trace_state_t */
    uint32_t head;           /* next row */
    uint32_t filled;
    uint32_t left;      /* rows still to come once triggered */
    uint32_t countdown; /* periods to the next row */
    bool above;         /* trigger signal above the level at the last check */
    bool looked;
    uint32_t trigger_period;
} trace_t;

/* The caller owns the memory; words may be 0: then no set-up is possible. */
void trace_init(trace_t *t, uint32_t *word, uint32_t words);

/* Background: armed afterwards; ends any trace before. False, and nothing changed, for an invalid
 * set-up or one that does not fit. */
CHECKED bool trace_arm(trace_t *t, const trace_setup_t *setup);

/* Background: back to IDLE from any state. */
void trace_stop(trace_t *t);

/* Control period: true when the trace wants a sample. */
static inline bool trace_running(const trace_t *t)
{
    const uint32_t state = t->state;
    return (state == (uint32_t)TRACE_ARMED) || (state == (uint32_t)TRACE_TRIGGERED);
}

/* Control period: checks the trigger with its word of this period. True when the period is a row:
 * write it to trace_row() and end it with trace_row_done(). */
bool trace_watch(trace_t *t, uint32_t trigger_word, uint32_t period);
uint32_t *trace_row(const trace_t *t);
void trace_row_done(trace_t *t);

/* Background, when DONE: number of rows, row of the trigger, one word of a row; oldest first. 0 for
 * a word that does not exist. */
uint32_t trace_rows(const trace_t *t);
uint32_t trace_trigger_row(const trace_t *t);
uint32_t trace_word(const trace_t *t, uint32_t row, uint32_t column);

#endif
