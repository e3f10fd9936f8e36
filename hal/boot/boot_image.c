#include "boot_image.h"

#include "boot_journal.h"
#include "monocypher.h"

#define MARK        1u
#define CHUNK_WORDS 32u

void boot_header_read(const boot_flash_t *flash, boot_area_t slot, boot_header_t *header)
{
    for (uint32_t k = 0u; k < BOOT_HEADER_WORDS; k++) {
        header->word[k] = flash->read(flash->context, slot, 4u * k);
    }
}

static bool same(const uint32_t *a, const uint32_t *b, uint32_t words)
{
    uint32_t differing = 0u;
    for (uint32_t k = 0u; k < words; k++) {
        differing |= a[k] ^ b[k];
    }
    return differing == 0u;
}

static bool sensible(const boot_config_t *cfg, const boot_header_t *header)
{
    const uint32_t bytes = header->word[BOOT_AT_BYTES];
    return (header->word[BOOT_AT_MAGIC] == BOOT_MAGIC) &&
           (header->word[BOOT_AT_FORMAT] == BOOT_FORMAT) && (bytes > 0u) &&
           (bytes <= cfg->flash->slot_bytes - BOOT_IMAGE_AT) && (bytes % BOOT_UNIT_BYTES == 0u) &&
           (header->word[BOOT_AT_VERSION] - 1u < BOOT_VERSION_MAX);
}

boot_status_t boot_header_check(const boot_config_t *cfg, const boot_header_t *header,
                                uint32_t least)
{
    if (!sensible(cfg, header)) {
        return BOOT_NO_IMAGE;
    }
    if (!same(&header->word[BOOT_AT_BOARD], cfg->board, BOOT_BOARD_WORDS)) {
        return BOOT_OTHER_BOARD;
    }
    if (header->word[BOOT_AT_VERSION] < least) {
        return BOOT_OLDER;
    }
    const uint8_t *const signature = (const uint8_t *)&header->word[BOOT_AT_SIGNATURE];
    const uint8_t *const text = (const uint8_t *)header->word;
    const int wrong = crypto_eddsa_check(signature, cfg->key, text, BOOT_SIGNED_BYTES);
    return (wrong == 0) ? BOOT_GOOD : BOOT_BAD_SIGNATURE;
}

bool boot_image_intact(const boot_flash_t *flash, boot_area_t slot, const boot_header_t *header)
{
    crypto_blake2b_ctx hash;
    crypto_blake2b_init(&hash, BOOT_HASH_BYTES);
    const uint32_t words = header->word[BOOT_AT_BYTES] / 4u;
    uint32_t chunk[CHUNK_WORDS];
    uint32_t n = 0u;
    for (uint32_t k = 0u; k < words; k++) {
        chunk[n] = flash->read(flash->context, slot, BOOT_IMAGE_AT + 4u * k);
        n++;
        if ((n == CHUNK_WORDS) || (k + 1u == words)) {
            crypto_blake2b_update(&hash, (const uint8_t *)chunk, (size_t)n * 4u);
            n = 0u;
        }
    }
    uint32_t found[BOOT_HASH_BYTES / 4u];
    crypto_blake2b_final(&hash, (uint8_t *)found);
    return same(found, &header->word[BOOT_AT_HASH], BOOT_HASH_BYTES / 4u);
}

static boot_journal_t marks(const boot_flash_t *flash, boot_area_t slot)
{
    return (boot_journal_t){flash, slot, BOOT_MARKS_AT, BOOT_IMAGE_AT};
}

bool boot_image_marked(const boot_flash_t *flash, boot_area_t slot)
{
    const boot_journal_t journal = marks(flash, slot);
    return boot_journal_read(&journal) == MARK;
}

bool boot_image_settle(const boot_flash_t *flash, boot_area_t slot)
{
    const boot_journal_t journal = marks(flash, slot);
    return boot_journal_raise(&journal, MARK);
}

bool boot_image_complete(const boot_flash_t *flash, boot_area_t slot, const boot_header_t *header)
{
    for (uint32_t k = 0u; k < BOOT_HEADER_WORDS; k += 2u) {
        if (!boot_write(flash, slot, 4u * k, &header->word[k])) {
            return false;
        }
    }
    return boot_image_settle(flash, slot);
}
