/* A CAN line, for a fieldbus: classic frames with 11-bit identifiers. */
#ifndef HAL_CAN_H
#define HAL_CAN_H

#include <stdbool.h>
#include <stdint.h>

#define HAL_CAN_BYTES 8u

typedef struct {
    uint16_t id;
    uint8_t length; /* 0..8 */
    uint8_t data[HAL_CAN_BYTES];
} hal_can_frame_t;

/* Called from the background. */
typedef struct {
    void *context;

    /* One data frame that came; false when there is none. */
    bool (*read)(void *context, hal_can_frame_t *frame);

    /* False when its queue is full: the frame is lost. */
    bool (*write)(void *context, const hal_can_frame_t *frame);

    uint32_t (*clock_us)(void *context); /* wraps */
} hal_can_t;

#endif
