/* What is recorded of the drive: the user's trace and the record of the last fault. */
#ifndef APP_RECORD_H
#define APP_RECORD_H

#include "app.h"

/* Memory of the port, after app_init and before the first period; fault may be NULL, words 0. */
void app_record_init(app_t *app, const app_memory_t *memory);

/* Control interrupt, once the duties are with the hardware: nothing here delays them. `output` is
 * that of the period just ended. Without it nothing is recorded. */
void app_record_period(app_t *app, const hal_output_t *output);

/* Slice of the background. */
void app_record_background(app_t *app);

/* Number of the signal in a column of the fault record. */
uint32_t app_record_fault_signal(uint32_t column);

#endif
