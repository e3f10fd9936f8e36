/* Controller for classic CAN frames with 11-bit identifiers; no others are received, nor remote
 * frames. Each part has its own: bxCAN of the F405 (stm32_bxcan.c), FDCAN of the G431
 * (g431_fdcan.c).
 */
#ifndef STM32_CAN_H
#define STM32_CAN_H

#include <stdbool.h>
#include <stdint.h>

#include "hal_can.h"
#include "stm32_can_device.h"

/* A bit in quanta of the divided clock. */
typedef struct {
    uint32_t divider;
    uint32_t before; /* the sample point, without the first, fixed one */
    uint32_t behind; /* it */
} stm32_can_timing_t;

/* Sample point at 85 to 89 % of the bit; false when the clock does not allow the rate. */
bool stm32_can_timing(uint32_t clock_Hz, uint32_t baud, stm32_can_timing_t *timing);

/* Waits for the controller at most `polls`; then a received frame raises the port's interrupt. */
bool stm32_can_start(const stm32_can_device_t *device, const stm32_can_timing_t *timing,
                     uint32_t polls);

/* The next frame received, false when there is none. */
bool stm32_can_receive(const stm32_can_device_t *device, hal_can_frame_t *frame);

/* False when there is no room now. */
bool stm32_can_send(const stm32_can_device_t *device, const hal_can_frame_t *frame);

/* From the background: off the bus after too many errors, the controller is told to return. */
void stm32_can_return(const stm32_can_device_t *device);

#endif
