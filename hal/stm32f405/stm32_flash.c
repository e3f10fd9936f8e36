#include "stm32_flash.h"

#include <stdbool.h>

#define KEY_1    0x45670123u
#define KEY_2    0xCDEF89ABu
#define WORDS    2u /* parallelism of 32 bits: 2.7..3.6 V */
#define FAILURES (FLASH_SR_WRPERR | FLASH_SR_PGAERR | FLASH_SR_PGPERR | FLASH_SR_PGSERR)

static bool idle(const stm32_flash_t *flash, uint32_t polls)
{
    for (uint32_t n = 0u; n < polls; n++) {
        if ((flash->SR & FLASH_SR_BSY) == 0u) {
            return true;
        }
    }
    return false;
}

/* False when the flash does not open: after a wrong key it stays closed until the next reset. */
static bool unlock(stm32_flash_t *flash)
{
    if ((flash->CR & FLASH_CR_LOCK) != 0u) {
        flash->KEYR = KEY_1;
        flash->KEYR = KEY_2;
    }
    flash->SR &= FAILURES; /* of before: written 1 clears */
    return (flash->CR & FLASH_CR_LOCK) == 0u;
}

/* The data cache may hold what was there before; it can be emptied only while it is off. */
static void empty_data_cache(stm32_flash_t *flash)
{
    const uint32_t acr = flash->ACR & ~FLASH_ACR_DCRST;
    flash->ACR = acr & ~FLASH_ACR_DCEN;
    flash->ACR = (acr & ~FLASH_ACR_DCEN) | FLASH_ACR_DCRST;
    flash->ACR = acr;
}

/* Waits for the end and locks again, whatever happened. */
static stm32_flash_status_t finish(stm32_flash_t *flash, uint32_t polls)
{
    const bool done = idle(flash, polls);
    const bool failed = (flash->SR & FAILURES) != 0u;
    flash->CR = FLASH_CR_LOCK;
    empty_data_cache(flash);
    if (!done) {
        return STM32_FLASH_TIMEOUT;
    }
    return failed ? STM32_FLASH_FAILED : STM32_FLASH_OK;
}

stm32_flash_status_t stm32_flash_erase(stm32_flash_t *flash, uint32_t sector, uint32_t polls)
{
    if ((sector != STM32_FLASH_SECTOR_A) && (sector != STM32_FLASH_SECTOR_B)) {
        return STM32_FLASH_REFUSED;
    }
    if (!idle(flash, polls)) {
        return STM32_FLASH_TIMEOUT;
    }
    if (!unlock(flash)) {
        return STM32_FLASH_FAILED;
    }
    flash->CR = FLASH_CR_SER | (sector << FLASH_CR_SNB_Pos) | (WORDS << FLASH_CR_PSIZE_Pos);
    flash->CR |= FLASH_CR_STRT;
    return finish(flash, polls);
}

stm32_flash_status_t stm32_flash_program(stm32_flash_t *flash, uint32_t address,
                                         volatile uint32_t *to, uint32_t word, uint32_t polls)
{
    if ((address < STM32_FLASH_START) || (address >= STM32_FLASH_END) || (address % 4u != 0u)) {
        return STM32_FLASH_REFUSED;
    }
    if (!idle(flash, polls)) {
        return STM32_FLASH_TIMEOUT;
    }
    if (!unlock(flash)) {
        return STM32_FLASH_FAILED;
    }
    flash->CR = FLASH_CR_PG | (WORDS << FLASH_CR_PSIZE_Pos);
    *to = word;
    const stm32_flash_status_t status = finish(flash, polls);
    if (status != STM32_FLASH_OK) {
        return status;
    }
    /* A bit once 0 does not become 1, and no flag says so. */
    return (*to == word) ? STM32_FLASH_OK : STM32_FLASH_FAILED;
}
