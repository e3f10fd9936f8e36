/* The record around the last fault, and the list of faults: both survive a reset.
 *
 * Six signals of every period run through a ring. A fault that opens the gates freezes it a little
 * later, and the background moves it to `kept`, which has a magic word and a CRC. A port places the
 * memory where no start-up code clears it. A fault with the gates already off is listed but does
 * not replace the record: the events after a reset must not overwrite its cause.
 */
#ifndef FAULT_RECORD_H
#define FAULT_RECORD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "num.h"

#define FAULT_RECORD_MAGIC   0x5A484652u /* "ZHFR" */
#define FAULT_RECORD_SIGNALS 6u
#define FAULT_RECORD_ROWS    48u
#define FAULT_RECORD_AFTER   16u /* the fault's own row and 15 after it */
#define FAULT_RECORD_LOG     8u

typedef struct {
    uint32_t number; /* running number, from 1 */
    uint32_t faults; /* bits that were new */
    uint32_t state;  /* state of the drive when the background saw it */
    uint32_t period; /* since start */
} fault_entry_t;

typedef struct {
    uint32_t magic;
    uint32_t crc32c; /* of all that follows */
    uint32_t logged; /* faults ever; the last FAULT_RECORD_LOG of them are in entry */
    fault_entry_t entry[FAULT_RECORD_LOG];
    uint32_t number; /* of the newest entry when it was kept; 0: no record */
    uint32_t period; /* of the fault */
    uint32_t rows;
    uint32_t fault_row;
    uint32_t word[FAULT_RECORD_ROWS * FAULT_RECORD_SIGNALS];
} fault_kept_t;

typedef struct {
    fault_kept_t kept;
    uint32_t ring[FAULT_RECORD_ROWS * FAULT_RECORD_SIGNALS];
} fault_memory_t;

typedef struct {
    fault_memory_t *memory; /* NULL: the port gave none */
    uint32_t *row;          /* next row; NULL: no recording */
    uint32_t *end;          /* end of the newest row of a complete record */
    uint32_t left;          /* rows still to record after the fault; 0: no fault */
    uint32_t faults;        /* at the last check: latched faults ... */
    bool gates_on;          /* ... and the gates */
    bool opened;            /* a fault has opened the gates since recording started */
    bool full;              /* the ring has wrapped */
    volatile bool done;     /* a record is complete and belongs to the background */
    uint32_t period;        /* of the fault */
    uint32_t listed;        /* fault bits already in the log */
    bool from_before;       /* the kept record is from before a reset */
} fault_recorder_t;

/* Keeps a valid record in memory, else clears it; then recording starts. */
void fault_record_init(fault_recorder_t *r, fault_memory_t *memory);

/* Control period, when latched faults or gates have changed since the last check. `stopping`: the
 * faults among them that open the gates. */
COLD void fault_record_look(fault_recorder_t *r, uint32_t faults, uint32_t stopping, bool gates_on,
                            uint32_t period);

static inline bool fault_record_changed(const fault_recorder_t *r, uint32_t faults, bool gates_on)
{
    return (faults != r->faults) || (gates_on != r->gates_on);
}

/* Control period: the row r->row has been written. */
COLD void fault_record_end_of_ring(fault_recorder_t *r);
COLD void fault_record_count_down(fault_recorder_t *r);

static inline void fault_record_next(fault_recorder_t *r)
{
    r->row += FAULT_RECORD_SIGNALS;
    if (r->row == &r->memory->ring[(size_t)FAULT_RECORD_ROWS * FAULT_RECORD_SIGNALS]) {
        fault_record_end_of_ring(r);
    }
    if (r->left > 0u) {
        fault_record_count_down(r);
    }
}

/* Background: lists new faults and keeps a finished record. */
void fault_record_background(fault_recorder_t *r, uint32_t faults, uint32_t state, uint32_t period);

/* Background: clears list and record. */
void fault_record_clear(fault_recorder_t *r);

#endif
