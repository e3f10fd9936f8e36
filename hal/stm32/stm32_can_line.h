/* CAN line of a fieldbus: two queues between the controller and the background. */
#ifndef STM32_CAN_LINE_H
#define STM32_CAN_LINE_H

#include "stm32_can.h"
#include "stm32_timebase.h"

#define STM32_CAN_FRAMES 32u /* in each queue; a power of two */

/* Zeroed but for the devices: empty. */
typedef struct {
    stm32_can_device_t device;
    const stm32_tim_t *timebase;
    hal_can_frame_t heard[STM32_CAN_FRAMES];
    volatile uint32_t in;
    volatile uint32_t out;
    hal_can_frame_t said[STM32_CAN_FRAMES]; /* of the background alone */
    uint32_t said_in;
    uint32_t said_out;
} stm32_can_line_t;

/* In the controller's interrupt. A full queue drops the frame. */
void stm32_can_line_interrupt(stm32_can_line_t *line);

/* Operations of hal_can_t; context: stm32_can_line_t. A read also sends what waits. */
bool stm32_can_line_read(void *context, hal_can_frame_t *frame);
bool stm32_can_line_write(void *context, const hal_can_frame_t *frame);
uint32_t stm32_can_line_clock_us(void *context);

#endif
