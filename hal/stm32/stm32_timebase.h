/* TIM5: microseconds since start, 32 bits, wraps after 71 minutes. */
#ifndef STM32_TIMEBASE_H
#define STM32_TIMEBASE_H

#include "stm32_registers.h"

/* clock_Hz: the timer's, a whole number of MHz. */
void stm32_timebase_start(stm32_tim_t *tim, uint32_t clock_Hz);

static inline uint32_t stm32_timebase_us(const stm32_tim_t *tim)
{
    return tim->CNT;
}

#endif
