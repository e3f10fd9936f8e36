/* What unit and link ask of the store; a header of its own because it needs the whole unit_t. */
#ifndef UNIT_STORE_BACKGROUND_H
#define UNIT_STORE_BACKGROUND_H

#include "unit.h"

/* One slice: at most one operation of the flash, and that only at rest. */
void unit_store_background(unit_t *unit, const hal_devices_t *devices);

/* Asks for a save of the set in use; false while one is under way or without a flash for it. */
CHECKED bool unit_store_save(unit_t *unit, const hal_devices_t *devices);

/* The n-th entry of the record in use; false when there is none. */
CHECKED bool unit_store_entry(const unit_t *unit, const hal_devices_t *devices, uint32_t n,
                              param_store_entry_t *entry);

#endif
