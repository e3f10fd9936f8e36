#include "stm32_slots.h"

#include <stdbool.h>

#define SECTOR_B_START 0x08040000u

static hal_flash_status_t told(stm32_flash_status_t status)
{
    return (status == STM32_FLASH_OK) ? HAL_FLASH_DONE : HAL_FLASH_FAILED;
}

static bool inside(uint32_t slot, uint32_t offset)
{
    return (slot < 2u) && (offset < STM32_SLOTS_BYTES) && (offset % 4u == 0u);
}

hal_flash_status_t stm32_slots_erase(const stm32_slots_t *slots, uint32_t slot)
{
    if (!inside(slot, 0u)) {
        return HAL_FLASH_FAILED;
    }
    const uint32_t sector = (slot == 0u) ? STM32_FLASH_SECTOR_A : STM32_FLASH_SECTOR_B;
    return told(stm32_flash_erase(slots->flash, sector, slots->polls));
}

hal_flash_status_t stm32_slots_program(const stm32_slots_t *slots, uint32_t slot, uint32_t offset,
                                       uint32_t word)
{
    if (!inside(slot, offset)) {
        return HAL_FLASH_FAILED;
    }
    const uint32_t start = (slot == 0u) ? STM32_FLASH_START : SECTOR_B_START;
    return told(stm32_flash_program(slots->flash, start + offset, &slots->cell[slot][offset / 4u],
                                    word, slots->polls));
}

uint32_t stm32_slots_read(const stm32_slots_t *slots, uint32_t slot, uint32_t offset)
{
    return inside(slot, offset) ? slots->cell[slot][offset / 4u] : 0u;
}
