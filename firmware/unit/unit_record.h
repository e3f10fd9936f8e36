/* Recording: the user's trace, the record of the last fault and the flight recorder. */
#ifndef UNIT_RECORD_H
#define UNIT_RECORD_H

#include "unit.h"

/* Memory of the port, after unit_init and before the first period; fault may be NULL, words 0. */
void unit_record_init(unit_t *unit, const unit_memory_t *memory);

/* Control interrupt, after the duties are with the hardware, so that it delays nothing. `sample`
 * and `output` are those of the period just ended. Without this call nothing is recorded. */
void unit_record_period(unit_t *unit, const hal_sample_t *sample, const hal_output_t *output);

/* Slice of the background. */
void unit_record_background(unit_t *unit);

/* Number of the signal in a column of the fault record. */
uint32_t unit_record_fault_signal(uint32_t column);

#endif
