/* Devices of the background function, as operations that the port fills in.
 *
 * Called from the background only, never from the control period. An operation may be NULL when
 * the board has no such device; the background then does without.
 */
#ifndef HAL_DEVICES_H
#define HAL_DEVICES_H

#include <stdbool.h>
#include <stdint.h>

typedef enum {
    HAL_FLASH_DONE = 0,
    HAL_FLASH_BUSY = 1, /* nothing failed yet: ask for the same again later */
    HAL_FLASH_FAILED = 2
} hal_flash_status_t;

/* Two slots that are erased one at a time, for what has to survive power-down. All operations have
 * to be there. Whoever calls `erase` or `program` has made sure that the gates are off: the core
 * may stand still meanwhile, and no control period ends in time. An operation either starts and
 * answers BUSY until it is over, or waits itself; then it keeps the watchdog from biting. */
typedef struct {
    void *context;        /* handed back to every operation */
    uint32_t slot_bytes;  /* usable in each slot */
    uint32_t unit_words;  /* 32-bit words per program operation: 1 or 2 */
    uint32_t erased_word; /* what an erased word reads as */

    /* Whole slot 0 or 1. */
    hal_flash_status_t (*erase)(void *context, uint32_t slot);

    /* unit_words words at the byte offset, a multiple of their size; each is written once between
     * two erasures. DONE: it reads back as given. */
    hal_flash_status_t (*program)(void *context, uint32_t slot, uint32_t offset,
                                  const uint32_t *words);

    /* The word at the byte offset, a multiple of 4; from the cells, not from a cache. */
    uint32_t (*read)(void *context, uint32_t slot, uint32_t offset);
} hal_flash_t;

typedef struct {
    void *context; /* handed back to every operation */

    /* Feeds the watchdog; returns at once. */
    void (*watchdog_serve)(void *context);

    /* Free-running clock in microseconds, wraps. */
    uint32_t (*clock_us)(void *context);

    /* Host link. A byte that has come; false when there is none. Bytes that come while nobody asks
     * have to be kept by the port: 250 of them at least, those of one request. */
    bool (*link_read)(void *context, uint8_t *byte);

    /* Takes as many of n bytes as go out without waiting, and says how many. */
    uint32_t (*link_write)(void *context, const uint8_t *data, uint32_t n);

    /* Who we are: port, version, motor; one line. May be NULL. */
    const char *identity;

    /* Protected parameters over the host link: the board's own 16 bytes, and 64 bits that nobody
     * can foresee; false when the generator fails. Without both nothing unlocks. */
    const uint8_t *access_key;
    bool (*entropy)(void *context, uint64_t *bits);

    /* NULL: nothing survives power-down but the image. */
    const hal_flash_t *flash;
} hal_devices_t;

#endif
