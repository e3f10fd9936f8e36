/* TIM7: interrupts when no control interrupt has begun for a time. Its priority is higher, so a
 * control interrupt that hangs cannot keep the gates on.
 *
 * It counts microseconds; each control interrupt restarts it. Without one it interrupts each time
 * the limit is reached.
 */
#ifndef STM32_HANG_H
#define STM32_HANG_H

#include <stdint.h>

#include "stm32_registers.h"

/* clock_Hz: the timer's, a whole number of MHz. time_us: at most 65535. */
void stm32_hang_start(stm32_tim_t *tim, uint32_t clock_Hz, uint32_t time_us);

static inline void stm32_hang_serve(stm32_tim_t *tim)
{
    tim->CNT = 0u;
}

/* The core will stall on purpose (flash), with the gates off. */
static inline void stm32_hang_pause(stm32_tim_t *tim)
{
    tim->CR1 &= ~TIM_CR1_CEN;
}

static inline void stm32_hang_resume(stm32_tim_t *tim)
{
    tim->CNT = 0u;
    tim->CR1 |= TIM_CR1_CEN;
}

/* In the interrupt: acknowledges it. */
static inline void stm32_hang_seen(stm32_tim_t *tim)
{
    tim->SR = 0u;
}

#endif
