#include "stm32_pwm.h"

#define CENTRE_ALIGNED   1u /* compare flags when counting down; the same waveform in all modes */
#define PWM_MODE_1       6u
#define TRGO_ENABLE      1u
#define TRGO_UPDATE      2u
#define TRGO_MASK        7u
#define LOCK_LEVEL_1     1u /* dead time, break and idle states can no longer be changed */
#define ARR_MAX          65535u
#define ARR_MIN          256u /* less would be no resolution worth the name */
#define ONCE_PER_CARRIER 1u   /* repetition counter: every second of overflow and underflow */

bool stm32_pwm_dead_time_code(uint32_t ticks, uint32_t *code)
{
    /* Four ranges of growing step; each rounded up: rather too long than too short. */
    if (ticks <= 127u) {
        *code = ticks;
    } else if (ticks <= 254u) {
        *code = 0x80u | ((ticks + 1u) / 2u - 64u);
    } else if (ticks <= 504u) {
        *code = 0xC0u | ((ticks + 7u) / 8u - 32u);
    } else if (ticks <= 1008u) {
        *code = 0xE0u | ((ticks + 15u) / 16u - 32u);
    } else {
        return false;
    }
    return true;
}

static bool timing(const stm32_pwm_params_t *params, uint32_t *arr, uint32_t *code)
{
    const float half_ticks = 0.5f * params->period_s * (float)params->clock_Hz;
    const float dead_ticks = params->dead_time_s * (float)params->clock_Hz;
    if (!((half_ticks >= (float)ARR_MIN) && (half_ticks <= (float)ARR_MAX)) ||
        !((dead_ticks >= 1.0f) && (dead_ticks <= half_ticks))) {
        return false;
    }
    *arr = (uint32_t)(half_ticks + 0.5f);
    /* A value that is whole but for rounding must not be rounded up to the next tick. */
    return stm32_pwm_dead_time_code((uint32_t)(dead_ticks + 0.99f), code);
}

/* The first write to BDTR locks the levels of the outputs: it comes last. */
static void outputs(stm32_tim_t *tim, const stm32_pwm_params_t *params, uint32_t dead_time)
{
    const bool low = params->lower_inverted;
    tim->CR2 |= low ? (TIM_CR2_OIS1N | TIM_CR2_OIS2N | TIM_CR2_OIS3N) : 0u;
    tim->CCER = TIM_CCER_CC1E | TIM_CCER_CC1NE | TIM_CCER_CC2E | TIM_CCER_CC2NE | TIM_CCER_CC3E |
                TIM_CCER_CC3NE | (low ? (TIM_CCER_CC1NP | TIM_CCER_CC2NP | TIM_CCER_CC3NP) : 0u);
    tim->BDTR = dead_time | (LOCK_LEVEL_1 << TIM_BDTR_LOCK_Pos) | TIM_BDTR_OSSI | TIM_BDTR_OSSR |
                TIM_BDTR_BKE | params->break_bits;
}

bool stm32_pwm_start(stm32_tim_t *tim, const stm32_pwm_params_t *params)
{
    uint32_t arr;
    uint32_t dead_time;
    stm32_pwm_gates_off(tim);
    if (!timing(params, &arr, &dead_time)) {
        return false;
    }
    tim->CR1 = TIM_CR1_ARPE | (CENTRE_ALIGNED << TIM_CR1_CMS_Pos);
    tim->CR2 = TRGO_ENABLE << TIM_CR2_MMS_Pos; /* until UG is over: that is no crest to sample at */
    tim->PSC = 0u;
    tim->ARR = arr;
    tim->CCR1 = arr / 2u;
    tim->CCR2 = arr / 2u;
    tim->CCR3 = arr / 2u;
    tim->CCMR1_Output = TIM_CCMR1_OC1PE | (PWM_MODE_1 << TIM_CCMR1_OC1M_Pos) | TIM_CCMR1_OC2PE |
                        (PWM_MODE_1 << TIM_CCMR1_OC2M_Pos);
    tim->CCMR2_Output = TIM_CCMR2_OC3PE | (PWM_MODE_1 << TIM_CCMR2_OC3M_Pos);
    outputs(tim, params, dead_time);
    /* UG loads the preload registers and the repetition counter, which then counts from the first
     * overflow. With RCR 1 set only now, the events that follow are overflow, overflow, ...: the
     * crests. */
    tim->RCR = 0u;
    tim->EGR = TIM_EGR_UG;
    tim->RCR = ONCE_PER_CARRIER;
    tim->CR2 = (tim->CR2 & ~(TRGO_MASK << TIM_CR2_MMS_Pos)) | (TRGO_UPDATE << TIM_CR2_MMS_Pos);
    tim->CR1 |= TIM_CR1_CEN;
    return true;
}

static bool is_duty(float duty)
{
    return (duty >= 0.0f) && (duty <= 1.0f);
}

void stm32_pwm_write(stm32_tim_t *tim, const hal_output_t *output)
{
    const bool duties =
        is_duty(output->duty_u) && is_duty(output->duty_v) && is_duty(output->duty_w);
    if (!output->gates_on || !duties) {
        stm32_pwm_gates_off(tim);
    }
    if (!duties) {
        return;
    }
    /* On for CCR counts of the ARR up and of the ARR down: compare 0 is never on, ARR always. */
    const float counts = (float)tim->ARR;
    tim->CCR1 = (uint32_t)(output->duty_u * counts + 0.5f);
    tim->CCR2 = (uint32_t)(output->duty_v * counts + 0.5f);
    tim->CCR3 = (uint32_t)(output->duty_w * counts + 0.5f);
    if (output->gates_on && !stm32_pwm_broken(tim)) {
        tim->BDTR |= TIM_BDTR_MOE;
    }
    /* A break shorter than that read, change and write would be undone by it; its latch is not. */
    if (stm32_pwm_broken(tim)) {
        stm32_pwm_gates_off(tim);
    }
}

bool stm32_pwm_broken(const stm32_tim_t *tim)
{
    return (tim->SR & TIM_SR_BIF) != 0u;
}

void stm32_pwm_clear_break(stm32_tim_t *tim)
{
    tim->SR = ~TIM_SR_BIF; /* written 0 clears, 1 leaves */
}

bool stm32_pwm_held(stm32_tim_t *tim, bool reset)
{
    const bool broken = stm32_pwm_broken(tim);
    if (broken && reset) {
        stm32_pwm_clear_break(tim);
    }
    return broken;
}
