#include "boot_flash.h"

bool boot_read(const boot_flash_t *flash, boot_area_t area, uint32_t offset, uint32_t *words)
{
    words[0] = flash->read(flash->context, area, offset);
    words[1] = flash->read(flash->context, area, offset + 4u);
    return (words[0] & words[1]) == BOOT_ERASED;
}

bool boot_write(const boot_flash_t *flash, boot_area_t area, uint32_t offset, const uint32_t *words)
{
    uint32_t back[2];
    if (!flash->program(flash->context, area, offset, words)) {
        return false;
    }
    (void)boot_read(flash, area, offset, back);
    return (back[0] == words[0]) && (back[1] == words[1]);
}
