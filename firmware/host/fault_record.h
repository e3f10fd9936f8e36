/* What the drive did around its last fault, and which faults there were: kept through a reset.
 *
 * Six signals of every period run through a ring; a fault that opens the gates freezes it a little
 * later, and the background moves it to `kept`, which has a magic word and a CRC. A port puts the
 * memory where no start-up code clears it. A fault with the gates off already is listed, but does
 * not replace the record: what happens behind a reset must not wipe out why it came.
 */
#ifndef FAULT_RECORD_H
#define FAULT_RECORD_H

#include <stdbool.h>
#include <stdint.h>

#include "trace.h"

#define FAULT_RECORD_MAGIC   0x5A484652u /* "ZHFR" */
#define FAULT_RECORD_SIGNALS 6u
#define FAULT_RECORD_ROWS    48u
#define FAULT_RECORD_BEFORE  0.667f /* 32 rows before the fault's, 15 after */
#define FAULT_RECORD_LOG     8u

typedef struct {
    uint32_t number; /* counts from 1 */
    uint32_t faults; /* bits that were new */
    uint32_t state;  /* of the drive when the background saw it */
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
    trace_t trace;
    bool gates_on;    /* in the period before */
    uint32_t listed;  /* fault bits that the log has */
    bool from_before; /* what is kept came through a reset */
} fault_recorder_t;

/* What memory holds is taken over when it is whole, else emptied; then recording starts. */
void fault_record_init(fault_recorder_t *r, fault_memory_t *memory);

/* Control period: true when the caller is to write a row (trace_row, trace_row_done of r->trace).
 * `faults`: those latched that open the gates. */
bool fault_record_watch(fault_recorder_t *r, uint32_t faults, bool gates_on, uint32_t period);

/* Background: lists new faults, keeps a finished record. */
void fault_record_background(fault_recorder_t *r, uint32_t faults, uint32_t state, uint32_t period);

/* Background: forgets list and record. */
void fault_record_clear(fault_recorder_t *r);

#endif
