/* Functions of the store for unit and link; a separate header because it needs the whole unit_t. */
#ifndef UNIT_STORE_BACKGROUND_H
#define UNIT_STORE_BACKGROUND_H

#include "unit.h"

/* One slice: at most one flash operation, and only at rest. */
void unit_store_background(unit_t *unit, const hal_devices_t *devices);

/* Requests a save of the set in use; false while one is running or without a flash. */
CHECKED bool unit_store_save(unit_t *unit, const hal_devices_t *devices);

/* The n-th entry of the record in use; false when there is none. */
CHECKED bool unit_store_entry(const unit_t *unit, const hal_devices_t *devices, uint32_t n,
                              param_store_entry_t *entry);

#endif
