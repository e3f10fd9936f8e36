/* Flash as the boot loader sees it: the counter, the slot that runs, and the slot that receives
 * where the part has room for two. The loader itself is no area: nothing here can change it.
 */
#ifndef BOOT_FLASH_H
#define BOOT_FLASH_H

#include <stdbool.h>
#include <stdint.h>

#define BOOT_ERASED     0xFFFFFFFFu
#define BOOT_UNIT_BYTES 8u /* written at a time, on every part */

typedef enum {
    BOOT_COUNTER = 0, /* written, never erased */
    BOOT_RUN = 1,     /* the application is linked to run here */
    BOOT_STAGE = 2    /* receives an update; only if `staged` */
} boot_area_t;

/* Every operation waits for its end. */
typedef struct {
    void *context; /* passed to every operation */
    uint32_t counter_bytes;
    uint32_t slot_bytes; /* of each slot, its header included */
    bool staged;         /* there are two slots */

    /* The whole slot. */
    bool (*erase)(void *context, boot_area_t slot);

    /* BOOT_UNIT_BYTES at a multiple of it; each once between two erasures. */
    bool (*program)(void *context, boot_area_t area, uint32_t offset, const uint32_t *words);

    /* The word at a multiple of 4. */
    uint32_t (*read)(void *context, boot_area_t area, uint32_t offset);
} boot_flash_t;

/* Programs one unit and reads it back; false when it is not what was written. */
bool boot_write(const boot_flash_t *flash, boot_area_t area, uint32_t offset,
                const uint32_t *words);

/* Both words of a unit; true when it is blank. */
bool boot_read(const boot_flash_t *flash, boot_area_t area, uint32_t offset, uint32_t *words);

#endif
