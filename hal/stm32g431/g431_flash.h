/* Flash pages of the parameters: erase, program a double word. Nothing else can be changed from
 * here.
 *
 * One bank: the core stalls while the flash is busy, up to 25 ms for a page, .1 ms for a double
 * word. Gates off, and the watchdogs' times set before that. Option bytes cannot be changed: their
 * key is never written.
 */
#ifndef G431_FLASH_H
#define G431_FLASH_H

#include <stdbool.h>

#include "stm32_registers.h"

#define G431_FLASH_PAGE_BYTES 2048u
#ifndef G431_FLASH_PAGE_FIRST     /* the boot loader has others: CMakeLists.txt */
#define G431_FLASH_PAGE_FIRST 61u /* of the parameters */
#define G431_FLASH_PAGE_LAST  62u
#define G431_FLASH_START      0x0801E800u /* of the first page */
#define G431_FLASH_END        0x0801F800u /* behind the last */
#endif

/* Polls of BSY; each takes several clocks: above the 25 ms of a page. */
#define G431_FLASH_POLLS 5000000u

typedef enum {
    G431_FLASH_OK = 0,
    G431_FLASH_REFUSED = 1, /* another page, an address outside or not of a double word */
    G431_FLASH_TIMEOUT = 2,
    G431_FLASH_FAILED = 3 /* write protection, alignment, sequence, closed, not erased, or it reads
                             back as something else */
} g431_flash_status_t;

/* Behind an NMI: a double word of the parameters was not whole (power cut while it was programmed).
 * Cleared, as the record's CRC tells; false when it was none of these. */
bool g431_flash_forgive(stm32_flash_t *flash);

g431_flash_status_t g431_flash_erase(stm32_flash_t *flash, uint32_t page, uint32_t polls);

/* `to` is where the two words go: their own address on the target. */
g431_flash_status_t g431_flash_program(stm32_flash_t *flash, uint32_t address,
                                       volatile uint32_t *to, const uint32_t *words,
                                       uint32_t polls);

#endif
