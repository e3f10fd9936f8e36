/* TIM1: centre-aligned PWM of three legs, one carrier period per control period.
 *
 * The counter counts up 0..ARR and down again. In PWM mode 1 the upper switch is on while CNT <
 * CCR, so the on pulse is centred on CNT = 0 and the crest is CNT = ARR. With RCR 1 the update
 * event comes at the end of counting up. Preloaded compare values are therefore taken at every
 * crest, once per carrier period: values written after the sample of crest k act from crest k+1
 * (hal/README.md). The same event is TRGO, which starts the ADC.
 *
 * CH1..3 = legs u, v, w, upper switch, active high; CHxN the lower one, active high unless the gate
 * driver inverts; dead time by hardware at both edges. MOE off: all six outputs are driven to their
 * inactive level (OSSI, OSSR). The break input (active low unless the board says otherwise: an open
 * wire breaks) clears MOE without the core. AOE is off, so only stm32_pwm_write sets it again, and
 * not while a break is latched.
 */
#ifndef STM32_PWM_H
#define STM32_PWM_H

#include <stdbool.h>
#include <stdint.h>

#include "hal_drive_io.h"
#include "stm32_registers.h"

typedef struct {
    uint32_t clock_Hz; /* of TIM1 */
    float period_s;    /* carrier = control period */
    float dead_time_s;
    uint32_t break_bits; /* of BDTR: polarity and filter; 0: active low, no filter */
    bool lower_inverted; /* a low level switches a lower switch on */
} stm32_pwm_params_t;

/* Outputs off, counter running. False, and nothing started, when period or dead time are out of the
 * timer's range, or without any dead time, which would short-circuit a leg. */
bool stm32_pwm_start(stm32_tim_t *tim, const stm32_pwm_params_t *params);

/* Writes the duties to the preload registers; gates on or off at once. A duty outside 0..1 or NaN
 * opens the gates. */
void stm32_pwm_write(stm32_tim_t *tim, const hal_output_t *output);

/* From any context. Writes only if there is something to switch off: the first write to BDTR after
 * a reset freezes LOCK, and that has to be the one of stm32_pwm_start. */
static inline void stm32_pwm_gates_off(stm32_tim_t *tim)
{
    if ((tim->BDTR & TIM_BDTR_MOE) != 0u) {
        tim->BDTR &= ~TIM_BDTR_MOE;
    }
}

/* A break by software: the gates go off and stay off until it is cleared. From any context. */
static inline void stm32_pwm_break(stm32_tim_t *tim)
{
    tim->EGR = TIM_EGR_BG;
}

/* True when the counter is counting down: the last update was at a crest, as required. Call it less
 * than half a period after the trigger. */
static inline bool stm32_pwm_past_crest(const stm32_tim_t *tim)
{
    return (tim->CR1 & TIM_CR1_DIR) != 0u;
}

/* True when a crest has passed since the last stm32_pwm_forget_crest: values written now may act
 * one period late. */
static inline bool stm32_pwm_crest_passed(const stm32_tim_t *tim)
{
    return (tim->SR & TIM_SR_UIF) != 0u;
}

/* Crests missed in the time since then: the timer itself only remembers one. */
static inline uint16_t stm32_pwm_missed_crests(const stm32_tim_t *tim, uint32_t spent_us,
                                               uint32_t period_us)
{
    const uint32_t whole = spent_us / period_us;
    if (whole > 0u) {
        return (uint16_t)whole;
    }
    return stm32_pwm_crest_passed(tim) ? 1u : 0u;
}

static inline void stm32_pwm_forget_crest(stm32_tim_t *tim)
{
    tim->SR = ~TIM_SR_UIF; /* written 0 clears, 1 leaves */
}

/* The break input was active since the last clear. */
bool stm32_pwm_broken(const stm32_tim_t *tim);

/* Stays latched while the input is still active. */
void stm32_pwm_clear_break(stm32_tim_t *tim);

/* The same, asked by who follows commands; a reset clears it first. */
bool stm32_pwm_held(stm32_tim_t *tim, bool reset);

/* DTG field for at least this many timer ticks; false above 1008. RM0090, TIMx_BDTR. */
bool stm32_pwm_dead_time_code(uint32_t ticks, uint32_t *code);

#endif
