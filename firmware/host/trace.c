#include "trace.h"

#include "handover.h"

#include <stddef.h>

/* A row per decimation: a trace of a day is more than the period count can tell. */
#define DECIMATION_MAX 1000000u

void trace_init(trace_t *t, uint32_t *word, uint32_t words)
{
    *t = (trace_t){.words = (word != NULL) ? words : 0u};
    t->word = word;
}

static bool setup_good(const trace_setup_t *s)
{
    return (s->signals >= 1u) && (s->signals <= TRACE_SIGNALS_MAX) && (s->decimation >= 1u) &&
           (s->decimation <= DECIMATION_MAX) && ((uint32_t)s->edge < (uint32_t)TRACE_EDGES) &&
           (s->before_pu >= 0.0f) && (s->before_pu <= 1.0f) &&
           (!s->trigger_is_float || is_finite(float_of_bits(s->level)));
}

void trace_stop(trace_t *t)
{
    t->state = (uint32_t)TRACE_IDLE;
}

bool trace_arm(trace_t *t, const trace_setup_t *setup)
{
    if (!setup_good(setup)) {
        return false;
    }
    const uint32_t fit = t->words / setup->signals;
    const uint32_t rows = (setup->rows != 0u) ? setup->rows : fit;
    if ((rows == 0u) || (rows > fit)) {
        return false;
    }
    const uint32_t before = (uint32_t)(setup->before_pu * (float)rows);
    trace_stop(t);
    handover();
    t->setup = *setup;
    t->rows = rows;
    t->rows_after = (before < rows) ? (rows - before) : 1u; /* the trigger's own row at least */
    t->head = 0u;
    t->filled = 0u;
    t->left = 0u;
    t->countdown = 1u;
    t->above = false;
    t->looked = false;
    t->trigger_period = 0u;
    handover();
    t->state = (uint32_t)TRACE_ARMED;
    return true;
}

static bool is_above(const trace_setup_t *s, uint32_t word)
{
    return s->trigger_is_float ? (float_of_bits(word) >= float_of_bits(s->level))
                               : (word >= s->level);
}

static bool triggered(trace_t *t, uint32_t word)
{
    const bool above = is_above(&t->setup, word);
    const bool crosses = t->looked && (above != t->above);
    t->above = above;
    t->looked = true;
    const trace_edge_t other = above ? TRACE_FALLING : TRACE_RISING;
    return (t->setup.edge == TRACE_NOW) || (crosses && (t->setup.edge != other));
}

bool trace_watch(trace_t *t, uint32_t trigger_word, uint32_t period)
{
    if ((t->state == (uint32_t)TRACE_ARMED) && triggered(t, trigger_word)) {
        t->trigger_period = period;
        t->left = t->rows_after;
        t->countdown = 1u; /* the trigger's own period is a row, whatever the decimation */
        t->state = (uint32_t)TRACE_TRIGGERED;
    }
    t->countdown--;
    if (t->countdown > 0u) {
        return false;
    }
    t->countdown = t->setup.decimation;
    return true;
}

uint32_t *trace_row(const trace_t *t)
{
    return &t->word[(size_t)t->head * t->setup.signals];
}

void trace_row_done(trace_t *t)
{
    t->head++;
    if (t->head == t->rows) {
        t->head = 0u;
    }
    if (t->filled < t->rows) {
        t->filled++;
    }
    if (t->state == (uint32_t)TRACE_TRIGGERED) {
        t->left--;
        if (t->left == 0u) {
            t->state = (uint32_t)TRACE_DONE;
        }
    }
}

uint32_t trace_rows(const trace_t *t)
{
    return (t->state == (uint32_t)TRACE_DONE) ? t->filled : 0u;
}

uint32_t trace_trigger_row(const trace_t *t)
{
    return (t->filled > t->rows_after) ? (t->filled - t->rows_after) : 0u;
}

uint32_t trace_word(const trace_t *t, uint32_t row, uint32_t column)
{
    if ((row >= trace_rows(t)) || (column >= t->setup.signals)) {
        return 0u;
    }
    /* Behind the newest row comes the oldest, once the ring has gone round. */
    const uint32_t oldest = (t->filled < t->rows) ? 0u : t->head;
    uint32_t at = oldest + row;
    if (at >= t->rows) {
        at -= t->rows;
    }
    return t->word[at * t->setup.signals + column];
}
