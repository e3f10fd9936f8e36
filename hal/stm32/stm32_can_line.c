#include "stm32_can_line.h"

/* As deep as the controllers' own queue. */
#define FRAMES_MOST 3u

void stm32_can_line_interrupt(stm32_can_line_t *line)
{
    for (uint32_t k = 0u; k < FRAMES_MOST; k++) {
        hal_can_frame_t frame;
        if (!stm32_can_receive(&line->device, &frame)) {
            return;
        }
        const uint32_t in = line->in;
        if (in - line->out < STM32_CAN_FRAMES) {
            line->heard[in % STM32_CAN_FRAMES] = frame;
            line->in = in + 1u;
        }
    }
}

static void send_waiting(stm32_can_line_t *line)
{
    for (uint32_t k = 0u; (k < FRAMES_MOST) && (line->said_in != line->said_out); k++) {
        if (!stm32_can_send(&line->device, &line->said[line->said_out % STM32_CAN_FRAMES])) {
            return;
        }
        line->said_out++;
    }
}

bool stm32_can_line_read(void *context, hal_can_frame_t *frame)
{
    stm32_can_line_t *const line = (stm32_can_line_t *)context;
    stm32_can_return(&line->device);
    send_waiting(line);
    const uint32_t out = line->out;
    if (line->in == out) {
        return false;
    }
    *frame = line->heard[out % STM32_CAN_FRAMES];
    line->out = out + 1u;
    return true;
}

bool stm32_can_line_write(void *context, const hal_can_frame_t *frame)
{
    stm32_can_line_t *const line = (stm32_can_line_t *)context;
    if (line->said_in - line->said_out >= STM32_CAN_FRAMES) {
        return false;
    }
    line->said[line->said_in % STM32_CAN_FRAMES] = *frame;
    line->said_in++;
    send_waiting(line);
    return true;
}

uint32_t stm32_can_line_clock_us(void *context)
{
    return stm32_timebase_us(((const stm32_can_line_t *)context)->timebase);
}
