#include "ram_flash.h"

#define MAGIC 0x5A48464Cu /* "ZHFL" */

hal_flash_status_t ram_flash_erase(void *context, uint32_t slot)
{
    ram_flash_t *memory = (ram_flash_t *)context;
    for (uint32_t k = 0u; k < RAM_FLASH_WORDS; k++) {
        memory->cell[slot][k] = UINT32_MAX;
    }
    memory->changes++;
    return HAL_FLASH_DONE;
}

/* As flash does it: bits only go from 1 to 0. */
hal_flash_status_t ram_flash_program(void *context, uint32_t slot, uint32_t offset,
                                     const uint32_t *words)
{
    ram_flash_t *memory = (ram_flash_t *)context;
    uint32_t *cell = &memory->cell[slot][offset / 4u];
    *cell &= *words;
    memory->changes++;
    return (*cell == *words) ? HAL_FLASH_DONE : HAL_FLASH_FAILED;
}

uint32_t ram_flash_read(void *context, uint32_t slot, uint32_t offset)
{
    const ram_flash_t *memory = (const ram_flash_t *)context;
    return memory->cell[slot][offset / 4u];
}

void ram_flash_start(ram_flash_t *memory)
{
    if (memory->magic != MAGIC) {
        (void)ram_flash_erase(memory, 0u);
        (void)ram_flash_erase(memory, 1u);
        memory->magic = MAGIC;
    }
}
