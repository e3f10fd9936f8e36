#include "fault_record.h"

#include "crc32c.h"

#include <stddef.h>

static uint32_t crc_of(const fault_kept_t *k)
{
    /* All but the two words in front. */
    return crc32c(&k->logged, sizeof(fault_kept_t) - (2u * sizeof(uint32_t)));
}

static void seal(fault_kept_t *k)
{
    k->magic = FAULT_RECORD_MAGIC;
    k->crc32c = crc_of(k);
}

static bool whole(const fault_kept_t *k)
{
    return (k->magic == FAULT_RECORD_MAGIC) && (k->crc32c == crc_of(k)) &&
           (k->rows <= FAULT_RECORD_ROWS);
}

static void start(fault_recorder_t *r)
{
    const trace_setup_t setup = {.signals = FAULT_RECORD_SIGNALS,
                                 .decimation = 1u,
                                 .edge = TRACE_RISING,
                                 .level = 1u,
                                 .before_pu = FAULT_RECORD_BEFORE};
    if (!trace_arm(&r->trace, &setup)) {
        trace_stop(&r->trace); /* not with these constants */
    }
}

void fault_record_init(fault_recorder_t *r, fault_memory_t *memory)
{
    *r = (fault_recorder_t){.memory = memory};
    if (memory == NULL) {
        return;
    }
    r->from_before = whole(&memory->kept);
    if (!r->from_before) {
        memory->kept = (fault_kept_t){0};
        seal(&memory->kept);
    }
    trace_init(&r->trace, memory->ring, FAULT_RECORD_ROWS * FAULT_RECORD_SIGNALS);
    start(r);
}

bool fault_record_watch(fault_recorder_t *r, uint32_t faults, bool gates_on, uint32_t period)
{
    if (!trace_running(&r->trace)) {
        return false;
    }
    const bool opened = (faults != 0u) && r->gates_on;
    r->gates_on = gates_on;
    return trace_watch(&r->trace, opened ? 1u : 0u, period);
}

static void list(fault_recorder_t *r, const fault_entry_t *entry)
{
    fault_kept_t *k = &r->memory->kept;
    k->logged++;
    fault_entry_t *at = &k->entry[(k->logged - 1u) % FAULT_RECORD_LOG];
    *at = *entry;
    at->number = k->logged;
    seal(k);
}

static void keep(fault_recorder_t *r)
{
    fault_kept_t *k = &r->memory->kept;
    k->magic = 0u; /* a reset now finds no half of it */
    k->number = k->logged;
    k->period = r->trace.trigger_period;
    k->rows = trace_rows(&r->trace);
    k->fault_row = trace_trigger_row(&r->trace);
    for (uint32_t row = 0u; row < k->rows; row++) {
        for (uint32_t column = 0u; column < FAULT_RECORD_SIGNALS; column++) {
            k->word[row * FAULT_RECORD_SIGNALS + column] = trace_word(&r->trace, row, column);
        }
    }
    seal(k);
    r->from_before = false;
}

void fault_record_background(fault_recorder_t *r, uint32_t faults, uint32_t state, uint32_t period)
{
    if (r->memory == NULL) {
        return;
    }
    const uint32_t fresh = faults & ~r->listed;
    r->listed = faults;
    if (fresh != 0u) {
        list(r, &(fault_entry_t){.faults = fresh, .state = state, .period = period});
    }
    if (r->trace.state == (uint32_t)TRACE_DONE) {
        keep(r);
        start(r);
    }
}

void fault_record_clear(fault_recorder_t *r)
{
    if (r->memory == NULL) {
        return;
    }
    r->memory->kept = (fault_kept_t){0};
    seal(&r->memory->kept);
    r->from_before = false;
}
