#include "fault_record.h"

#include <stddef.h>

#include "crc32c.h"
#include "handover.h"

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
    r->done = false;
    r->full = false;
    r->opened = false;
    r->left = 0u;
    handover();
    r->row = r->memory->ring;
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
    start(r);
}

void fault_record_look(fault_recorder_t *r, uint32_t faults, uint32_t stopping, bool gates_on,
                       uint32_t period)
{
    if ((stopping != 0u) && r->gates_on && !r->opened && (r->row != NULL)) {
        r->opened = true;
        r->period = period;
        r->left = FAULT_RECORD_AFTER;
    }
    r->faults = faults;
    r->gates_on = gates_on;
}

void fault_record_end_of_ring(fault_recorder_t *r)
{
    r->row = r->memory->ring;
    r->full = true;
}

void fault_record_count_down(fault_recorder_t *r)
{
    r->left--;
    if (r->left == 0u) {
        r->end = r->row;
        r->row = NULL;
        r->done = true;
    }
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

/* The ring, oldest row first. */
static void keep(fault_recorder_t *r)
{
    fault_kept_t *k = &r->memory->kept;
    const uint32_t *ring = r->memory->ring;
    const uint32_t words = FAULT_RECORD_ROWS * FAULT_RECORD_SIGNALS;
    const uint32_t end = (uint32_t)(r->end - ring);
    const uint32_t first = r->full ? end : 0u;
    k->magic = 0u; /* a reset now finds no half of it */
    k->number = k->logged;
    k->period = r->period;
    k->rows = r->full ? FAULT_RECORD_ROWS : (end / FAULT_RECORD_SIGNALS);
    k->fault_row = k->rows - FAULT_RECORD_AFTER;
    for (uint32_t n = 0u; n < (k->rows * FAULT_RECORD_SIGNALS); n++) {
        k->word[n] = ring[(first + n) % words];
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
    if (r->done) {
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
