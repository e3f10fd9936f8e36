#include "stm32_hang.h"

void stm32_hang_start(stm32_tim_t *tim, uint32_t clock_Hz, uint32_t time_us)
{
    tim->PSC = clock_Hz / 1000000u - 1u;
    tim->ARR = time_us;
    tim->CR1 = TIM_CR1_URS; /* only the end of the count is an event */
    tim->EGR = TIM_EGR_UG;  /* the prescaler is loaded by an update only */
    tim->SR = 0u;
    tim->DIER = TIM_DIER_UIE;
    tim->CR1 |= TIM_CR1_CEN;
}
