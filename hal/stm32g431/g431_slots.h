/* The parameters' flash pages as the slots of the store: four pages each. An erasure takes one page
 * per call, so that the core stands still for 25 ms at a time at most; the caller takes care of
 * interrupts and watchdogs.
 */
#ifndef G431_SLOTS_H
#define G431_SLOTS_H

#include "g431_flash.h"
#include "hal_devices.h"

#define G431_SLOTS_PAGES 4u
#define G431_SLOTS_BYTES (G431_SLOTS_PAGES * G431_FLASH_PAGE_BYTES) /* of each */

typedef struct {
    stm32_flash_t *flash;
    volatile uint32_t *cell; /* where the pages are read and written */
    uint32_t polls;
    uint32_t erased; /* pages so far of an erasure that has begun */
} g431_slots_t;

/* One page; BUSY until it was the slot's last. */
hal_flash_status_t g431_slots_erase(g431_slots_t *slots, uint32_t slot);
/* Two words. */
hal_flash_status_t g431_slots_program(const g431_slots_t *slots, uint32_t slot, uint32_t offset,
                                      const uint32_t *words);
uint32_t g431_slots_read(const g431_slots_t *slots, uint32_t slot, uint32_t offset);

#endif
