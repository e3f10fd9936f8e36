/* A signed image: header, then the application, in a slot as on the line.
 *
 * Header (32-bit words, little endian): magic, format, version, bytes of the application, board (16
 * characters, padded with zeros), BLAKE2b-512 of the application; EdDSA signature of all that
 * (Monocypher: curve 25519 with BLAKE2b). It covers the hash: the header alone proves who made the
 * image, before anything is erased for it.
 *
 * In a slot the application is written first, then the header, then a mark. Only a slot with a mark
 * is complete, and a header in front of a mark no longer changes: a mark is begun after the header
 * was read back. boot_journal.h says how a mark outlives a power cut in its own writing.
 */
#ifndef BOOT_IMAGE_H
#define BOOT_IMAGE_H

#include "boot_flash.h"

#define BOOT_MAGIC        0x5055485Au /* "ZHUP" */
#define BOOT_FORMAT       1u
#define BOOT_HEADER_WORDS 40u
#define BOOT_HEADER_BYTES (4u * BOOT_HEADER_WORDS)
#define BOOT_SIGNED_BYTES 96u
#define BOOT_MARKS_AT     256u
#define BOOT_IMAGE_AT     512u /* offset of the application in a slot */
#define BOOT_BOARD_WORDS  4u
#define BOOT_HASH_BYTES   64u
#define BOOT_VERSION_MAX  0xFFFFFFFEu /* so that there is always a next number; 0 is none */
#define BOOT_KEY_BYTES    32u

enum {
    BOOT_AT_MAGIC = 0,
    BOOT_AT_FORMAT = 1,
    BOOT_AT_VERSION = 2,
    BOOT_AT_BYTES = 3,
    BOOT_AT_BOARD = 4,
    BOOT_AT_HASH = 8,
    BOOT_AT_SIGNATURE = 24
};

typedef struct {
    uint32_t word[BOOT_HEADER_WORDS];
} boot_header_t;

typedef struct {
    const boot_flash_t *flash;
    const uint8_t *key; /* public, BOOT_KEY_BYTES */
    uint32_t board[BOOT_BOARD_WORDS];
} boot_config_t;

typedef enum {
    BOOT_GOOD = 0,
    BOOT_NO_IMAGE = 1, /* no header, of another format, of a senseless size */
    BOOT_OTHER_BOARD = 2,
    BOOT_OLDER = 3, /* than the counter, or already there */
    BOOT_BAD_SIGNATURE = 4,
    BOOT_NOT_COMPLETE = 5, /* bytes are missing, or others than those that were signed */
    BOOT_FLASH_FAILS = 6,
    BOOT_COUNTER_FULL = 7,
    BOOT_OUT_OF_ORDER = 8, /* no update begun, or not the next bytes */
    BOOT_UNKNOWN = 9       /* no such request, or of another length */
} boot_status_t;

void boot_header_read(const boot_flash_t *flash, boot_area_t slot, boot_header_t *header);

/* Format, board, size, version not below `least`, signature; in this order. */
boot_status_t boot_header_check(const boot_config_t *cfg, const boot_header_t *header,
                                uint32_t least);

/* Whether the application in the slot is the one that was signed. */
bool boot_image_intact(const boot_flash_t *flash, boot_area_t slot, const boot_header_t *header);

/* Header and mark, behind the application: from the first record of the mark on the slot is
 * complete. */
bool boot_image_complete(const boot_flash_t *flash, boot_area_t slot, const boot_header_t *header);

bool boot_image_marked(const boot_flash_t *flash, boot_area_t slot);

/* True when the mark is proven: what was read of the header will not change any more. */
bool boot_image_settle(const boot_flash_t *flash, boot_area_t slot);

#endif
