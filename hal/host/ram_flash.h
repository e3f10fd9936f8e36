/* Two slots of flash in memory, for ports without flash: the emulated board keeps them through a
 * reset, `zh serve` in a file.
 */
#ifndef RAM_FLASH_H
#define RAM_FLASH_H

#include "hal_devices.h"

#define RAM_FLASH_WORDS 320u /* per slot: 140 parameters */

typedef struct {
    uint32_t magic;
    uint32_t changes; /* operations so far, to detect an outdated copy */
    uint32_t cell[2][RAM_FLASH_WORDS];
} ram_flash_t;

/* Erases memory that was not initialised before; keeps the content otherwise. */
void ram_flash_start(ram_flash_t *memory);

hal_flash_status_t ram_flash_erase(void *context, uint32_t slot);
hal_flash_status_t ram_flash_program(void *context, uint32_t slot, uint32_t offset,
                                     const uint32_t *words);
uint32_t ram_flash_read(void *context, uint32_t slot, uint32_t offset);

/* The operations on a ram_flash_t, as an initialiser: a port's can be constant. */
#define RAM_FLASH(memory)                                                                          \
    {                                                                                              \
        .context = (memory), .slot_bytes = 4u * RAM_FLASH_WORDS, .unit_words = 1u,                 \
        .erased_word = UINT32_MAX, .erase = ram_flash_erase, .program = ram_flash_program,         \
        .read = ram_flash_read                                                                     \
    }

#endif
