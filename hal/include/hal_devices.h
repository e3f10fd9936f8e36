/* Devices of the background function, as operations that the port fills in.
 *
 * Called from the background only, never from the control period. An operation may be NULL when
 * the board has no such device; the background then does without.
 */
#ifndef HAL_DEVICES_H
#define HAL_DEVICES_H

#include <stdbool.h>
#include <stdint.h>

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
} hal_devices_t;

#endif
