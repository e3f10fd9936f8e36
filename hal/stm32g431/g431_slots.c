#include "g431_slots.h"

#include <stdbool.h>

#include "num.h"

static bool inside(uint32_t slot, uint32_t offset, uint32_t bytes)
{
    return (slot < 2u) && (offset < G431_SLOTS_BYTES) && (offset % bytes == 0u);
}

COLD hal_flash_status_t g431_slots_erase(const g431_slots_t *slots, uint32_t slot)
{
    if (!inside(slot, 0u, 8u)) {
        return HAL_FLASH_FAILED;
    }
    const g431_flash_status_t status =
        g431_flash_erase(slots->flash, g431_slots_page(slot), slots->polls);
    return (status == G431_FLASH_OK) ? HAL_FLASH_DONE : HAL_FLASH_FAILED;
}

COLD hal_flash_status_t g431_slots_program(const g431_slots_t *slots, uint32_t slot,
                                           uint32_t offset, const uint32_t *words)
{
    if (!inside(slot, offset, 8u)) {
        return HAL_FLASH_FAILED;
    }
    const uint32_t at = slot * G431_SLOTS_BYTES + offset;
    const g431_flash_status_t status = g431_flash_program(
        slots->flash, G431_FLASH_START + at, &slots->cell[at / 4u], words, slots->polls);
    return (status == G431_FLASH_OK) ? HAL_FLASH_DONE : HAL_FLASH_FAILED;
}

uint32_t g431_slots_read(const g431_slots_t *slots, uint32_t slot, uint32_t offset)
{
    const uint32_t at = slot * G431_SLOTS_BYTES + offset;
    return inside(slot, offset, 4u) ? slots->cell[at / 4u] : 0u;
}
