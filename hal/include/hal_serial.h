/* A second serial line, for a fieldbus: bytes with their times. */
#ifndef HAL_SERIAL_H
#define HAL_SERIAL_H

#include <stdbool.h>
#include <stdint.h>

/* Called from the background. */
typedef struct {
    void *context;
    uint32_t silence_us; /* that ends a frame: modbus_rtu_silence_us() of its baud rate */

    /* One byte that came, and when; false when there is none. Buffers what arrives while nobody
     * asks: at least 256, the size of one frame. */
    bool (*read)(void *context, uint8_t *byte, uint32_t *at_us);

    /* Takes as many of n bytes as it can send without waiting, and returns that number. Drives the
     * transceiver while it sends. */
    uint32_t (*write)(void *context, const uint8_t *data, uint32_t n);

    uint32_t (*clock_us)(void *context); /* the clock of those times; wraps */
} hal_serial_t;

#endif
