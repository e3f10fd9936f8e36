/* Devices of the background function, as operations that the port supplies.
 *
 * Called only from the background, never from the control period. An operation may be NULL when the
 * board has no such device; the background then works without it.
 */
#ifndef HAL_DEVICES_H
#define HAL_DEVICES_H

#include <stdbool.h>
#include <stdint.h>

typedef enum {
    HAL_FLASH_DONE = 0,
    HAL_FLASH_BUSY = 1, /* no error so far: call again later with the same arguments */
    HAL_FLASH_FAILED = 2
} hal_flash_status_t;

/* Two slots, erased one at a time, for data that survives power-down. All operations are required.
 * The caller of `erase` or `program` ensures that the gates are off: the core may stall meanwhile,
 * and no control period ends in time. An operation either starts and returns BUSY until it has
 * finished, or waits itself and keeps the watchdog served. */
typedef struct {
    void *context;        /* passed to every operation */
    uint32_t slot_bytes;  /* usable in each slot */
    uint32_t unit_words;  /* 32-bit words per program operation: 1 or 2 */
    uint32_t erased_word; /* what an erased word reads as */

    /* Whole slot 0 or 1. */
    hal_flash_status_t (*erase)(void *context, uint32_t slot);

    /* unit_words words at the byte offset, a multiple of their size; each is written once between
     * two erasures. DONE: it reads back correctly. */
    hal_flash_status_t (*program)(void *context, uint32_t slot, uint32_t offset,
                                  const uint32_t *words);

    /* Reads the word at the byte offset, a multiple of 4; from the cells, not from a cache. */
    uint32_t (*read)(void *context, uint32_t slot, uint32_t offset);
} hal_flash_t;

typedef struct {
    void *context; /* passed to every operation */

    /* Feeds the watchdog; returns at once. */
    void (*watchdog_serve)(void *context);

    /* Free-running clock in microseconds, wraps. */
    uint32_t (*clock_us)(void *context);

    /* Host link: the next received byte; false when there is none. The port has to keep bytes that
     * arrive while nobody asks: at least 250, the size of one request. */
    bool (*link_read)(void *context, uint8_t *byte);

    /* Takes as many of n bytes as it can send without waiting, and returns that number. */
    uint32_t (*link_write)(void *context, const uint8_t *data, uint32_t n);

    /* Identity: port, version, motor; one line. May be NULL. */
    const char *identity;

    /* Protected parameters over the host link: the board's own 16 bytes, and 64 unpredictable bits;
     * false when the generator fails. Without both nothing unlocks. */
    const uint8_t *access_key;
    bool (*entropy)(void *context, uint64_t *bits);

    /* NULL: only the image survives power-down. */
    const hal_flash_t *flash;

    /* Resets the part into its boot loader, which then waits for an update; called with the gates
     * off. NULL: this image does not stand above a loader. */
    void (*loader)(void *context);
} hal_devices_t;

#endif
