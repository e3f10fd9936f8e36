#include "stm32_adc.h"

#define SAMPLE_15_CYCLES      1u
#define INJECTED_SIMULTANEOUS 0x15u /* triple mode, injected groups only */
#define DIVIDE_BY_4           1u    /* of APB2's 84 MHz */
#define TRIGGER_TIM1_TRGO     1u
#define RISING_EDGE           1u
#define TWO_RANKS             1u
#define WORD_MASK             0xFFFFu
#define STABLE_READS          200u /* 3 us from ADON on: a read takes 4 clocks of 168 MHz or more */

/* A group of two has its channels in JSQ3 and JSQ4 (RM0090: the sequence is right aligned). */
static uint32_t sequence(uint32_t first, uint32_t second)
{
    return (TWO_RANKS << ADC_JSQR_JL_Pos) | (first << ADC_JSQR_JSQ3_Pos) |
           (second << ADC_JSQR_JSQ4_Pos);
}

static void configure(stm32_adc_t *adc, uint32_t first, uint32_t second)
{
    adc->CR1 = ADC_CR1_SCAN;
    adc->SMPR1 = (SAMPLE_15_CYCLES << ADC_SMPR1_SMP10_Pos) |
                 (SAMPLE_15_CYCLES << ADC_SMPR1_SMP11_Pos) |
                 (SAMPLE_15_CYCLES << ADC_SMPR1_SMP12_Pos);
    adc->SMPR2 = (SAMPLE_15_CYCLES << ADC_SMPR2_SMP0_Pos) |
                 (SAMPLE_15_CYCLES << ADC_SMPR2_SMP1_Pos) |
                 (SAMPLE_15_CYCLES << ADC_SMPR2_SMP2_Pos);
    adc->JSQR = sequence(first, second);
    adc->CR2 = ADC_CR2_ADON;
}

void stm32_adc_start(const stm32_adcs_t *adcs)
{
    adcs->common->CCR =
        (DIVIDE_BY_4 << ADC_CCR_ADCPRE_Pos) | (INJECTED_SIMULTANEOUS << ADC_CCR_MULT_Pos);
    configure(adcs->adc2, 1u, 11u);
    configure(adcs->adc3, 2u, 12u);
    configure(adcs->adc1, 0u, 10u);
    for (uint32_t n = 0u; n < STABLE_READS; n++) {
        (void)adcs->adc1->SR;
    }
    /* Only the master has trigger and interrupt. */
    adcs->adc1->SR = 0u;
    adcs->adc1->CR1 = ADC_CR1_SCAN | ADC_CR1_JEOCIE;
    adcs->adc1->CR2 = ADC_CR2_ADON | (TRIGGER_TIM1_TRGO << ADC_CR2_JEXTSEL_Pos) |
                      (RISING_EDGE << ADC_CR2_JEXTEN_Pos);
}

static uint16_t word(uint32_t data)
{
    return (uint16_t)(data & WORD_MASK);
}

void stm32_adc_read(const stm32_adcs_t *adcs, hal_sample_t *sample)
{
    adcs->adc1->SR = ~ADC_SR_JEOC; /* written 0 clears, 1 leaves */
    sample->i_u_counts = word(adcs->adc1->JDR1);
    sample->i_v_counts = word(adcs->adc2->JDR1);
    sample->i_w_counts = word(adcs->adc3->JDR1);
    sample->u_uv_counts = word(adcs->adc1->JDR2);
    sample->u_vw_counts = word(adcs->adc2->JDR2);
    sample->u_dc_counts = word(adcs->adc3->JDR2);
}

bool stm32_adc_ready(const stm32_adcs_t *adcs)
{
    return (adcs->adc1->SR & ADC_SR_JEOC) != 0u;
}
