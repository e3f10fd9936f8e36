/* The parameters' flash pages as the slots of the store: one page each. The core stands still for
 * 25 ms while it is erased; the caller takes care of interrupts and watchdogs.
 */
#ifndef G431_SLOTS_H
#define G431_SLOTS_H

#include "g431_flash.h"
#include "hal_devices.h"

#define G431_SLOTS_BYTES G431_FLASH_PAGE_BYTES /* of each */

typedef struct {
    stm32_flash_t *flash;
    volatile uint32_t *cell; /* where the pages are read and written */
    uint32_t polls;
} g431_slots_t;

static inline uint32_t g431_slots_page(uint32_t slot)
{
    return G431_FLASH_PAGE_FIRST + slot;
}

hal_flash_status_t g431_slots_erase(const g431_slots_t *slots, uint32_t slot);
/* Two words. */
hal_flash_status_t g431_slots_program(const g431_slots_t *slots, uint32_t slot, uint32_t offset,
                                      const uint32_t *words);
uint32_t g431_slots_read(const g431_slots_t *slots, uint32_t slot, uint32_t offset);

#endif
