/* Flash sectors of the parameters: erase, program a word. Nothing else can be changed from here.
 *
 * Sectors 5 and 6 (128 KiB each), behind the image (memory.ld). The core stalls while the flash is
 * busy, up to 2 s for an erase: gates off, and the watchdog's time set before that. Option bytes
 * cannot be changed: their key is never written.
 */
#ifndef STM32_FLASH_H
#define STM32_FLASH_H

#include "stm32_registers.h"

#ifndef STM32_FLASH_SECTOR_A /* the boot loader has others: boot/CMakeLists.txt */
#define STM32_FLASH_SECTOR_A 5u
#define STM32_FLASH_SECTOR_B 6u
#define STM32_FLASH_START    0x08020000u /* of sector A */
#define STM32_FLASH_END      0x08060000u /* behind sector B */
#endif

/* Polls of BSY; each takes several clocks: above the 2 s of the largest sector. */
#define STM32_FLASH_POLLS 400000000u

typedef enum {
    STM32_FLASH_OK = 0,
    STM32_FLASH_REFUSED = 1, /* another sector, an address outside or not of a word */
    STM32_FLASH_TIMEOUT = 2,
    STM32_FLASH_FAILED = 3 /* write protection, alignment, parallelism, sequence, closed, or it
                              reads back as something else */
} stm32_flash_status_t;

stm32_flash_status_t stm32_flash_erase(stm32_flash_t *flash, uint32_t sector, uint32_t polls);

/* `to` is where the word goes: its own address on the target. */
stm32_flash_status_t stm32_flash_program(stm32_flash_t *flash, uint32_t address,
                                         volatile uint32_t *to, uint32_t word, uint32_t polls);

#endif
