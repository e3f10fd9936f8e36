#include "stm32_timebase.h"

void stm32_timebase_start(stm32_tim_t *tim, uint32_t clock_Hz)
{
    tim->PSC = clock_Hz / 1000000u - 1u;
    tim->ARR = UINT32_MAX;
    tim->EGR = TIM_EGR_UG; /* the prescaler is loaded by an update only */
    tim->CR1 = TIM_CR1_CEN;
}
