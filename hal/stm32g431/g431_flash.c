#include "g431_flash.h"

#include <stdbool.h>

#include "num.h"

#define KEY_1      0x45670123u
#define KEY_2      0xCDEF89ABu
#define FLASH_BASE 0x08000000u
#define FAILURES                                                                                   \
    (FLASH_SR_OPERR | FLASH_SR_PROGERR | FLASH_SR_WRPERR | FLASH_SR_PGAERR | FLASH_SR_SIZERR |     \
     FLASH_SR_PGSERR | FLASH_SR_MISERR | FLASH_SR_FASTERR)

COLD static bool idle(const stm32_flash_t *flash, uint32_t polls)
{
    for (uint32_t n = 0u; n < polls; n++) {
        if ((flash->SR & FLASH_SR_BSY) == 0u) {
            return true;
        }
    }
    return false;
}

/* False when the flash does not open: after a wrong key it stays closed until the next reset. */
COLD static bool unlock(stm32_flash_t *flash)
{
    if ((flash->CR & FLASH_CR_LOCK) != 0u) {
        flash->KEYR = KEY_1;
        flash->KEYR = KEY_2;
    }
    flash->SR &= FAILURES | FLASH_SR_EOP; /* of before: written 1 clears */
    return (flash->CR & FLASH_CR_LOCK) == 0u;
}

/* The data cache may hold what was there before; it can be emptied only while it is off. */
COLD static void empty_data_cache(stm32_flash_t *flash)
{
    const uint32_t acr = flash->ACR & ~FLASH_ACR_DCRST;
    flash->ACR = acr & ~FLASH_ACR_DCEN;
    flash->ACR = (acr & ~FLASH_ACR_DCEN) | FLASH_ACR_DCRST;
    flash->ACR = acr;
}

/* Waits for the end and locks again, whatever happened. */
COLD static g431_flash_status_t finish(stm32_flash_t *flash, uint32_t polls)
{
    const bool done = idle(flash, polls);
    const bool failed = (flash->SR & FAILURES) != 0u;
    flash->CR = FLASH_CR_LOCK;
    empty_data_cache(flash);
    if (!done) {
        return G431_FLASH_TIMEOUT;
    }
    return failed ? G431_FLASH_FAILED : G431_FLASH_OK;
}

COLD bool g431_flash_forgive(stm32_flash_t *flash)
{
    const uint32_t eccr = flash->ECCR;
    if (((eccr & FLASH_ECCR_ECCD) == 0u) ||
        ((eccr & FLASH_ECCR_ADDR_ECC_Msk) < G431_FLASH_START - FLASH_BASE)) {
        return false;
    }
    flash->ECCR = FLASH_ECCR_ECCD; /* written 1 clears */
    return true;
}

COLD g431_flash_status_t g431_flash_erase(stm32_flash_t *flash, uint32_t page, uint32_t polls)
{
    if ((page < G431_FLASH_PAGE_FIRST) || (page > G431_FLASH_PAGE_LAST)) {
        return G431_FLASH_REFUSED;
    }
    if (!idle(flash, polls)) {
        return G431_FLASH_TIMEOUT;
    }
    if (!unlock(flash)) {
        return G431_FLASH_FAILED;
    }
    flash->CR = FLASH_CR_PER | (page << FLASH_CR_PNB_Pos);
    flash->CR |= FLASH_CR_STRT;
    return finish(flash, polls);
}

COLD g431_flash_status_t g431_flash_program(stm32_flash_t *flash, uint32_t address,
                                            volatile uint32_t *to, const uint32_t *words,
                                            uint32_t polls)
{
    if ((address < G431_FLASH_START) || (address >= G431_FLASH_END) || (address % 8u != 0u)) {
        return G431_FLASH_REFUSED;
    }
    if (!idle(flash, polls)) {
        return G431_FLASH_TIMEOUT;
    }
    if (!unlock(flash)) {
        return G431_FLASH_FAILED;
    }
    flash->CR = FLASH_CR_PG;
    to[0] = words[0]; /* the second word starts it */
    to[1] = words[1];
    const g431_flash_status_t status = finish(flash, polls);
    if (status != G431_FLASH_OK) {
        return status;
    }
    return ((to[0] == words[0]) && (to[1] == words[1])) ? G431_FLASH_OK : G431_FLASH_FAILED;
}
