/* Devices of the background function, as operations that the port fills in.
 *
 * Called from the background only, never from the control period. An operation may be NULL when
 * the board has no such device; the background then does without.
 */
#ifndef HAL_DEVICES_H
#define HAL_DEVICES_H

#include <stdint.h>

typedef struct {
    void *context; /* handed back to every operation */

    /* Feeds the watchdog; returns at once. */
    void (*watchdog_serve)(void *context);

    /* Free-running clock in microseconds, wraps. */
    uint32_t (*clock_us)(void *context);
} hal_devices_t;

#endif
