#include "g431_adc.h"

#include "num.h"

#define SAMPLE_12_5           2u
#define SAMPLE_47_5           4u
#define INJECTED_SIMULTANEOUS 5u /* dual mode, injected groups only */
#define BUS_BY_4              3u /* 170 MHz / 4 */
#define TRIGGER_TIM1_TRGO     0u
#define RISING_EDGE           1u
#define TWO_RANKS             1u
#define WORD_MASK             0xFFFFu
#define REGULATOR_READS       2000u /* 20 us: a read takes two clocks of 170 MHz or more */

COLD static void sample_time(stm32_adc_t *adc, uint32_t channel, uint32_t cycles)
{
    if (channel < 10u) {
        adc->SMPR1 |= cycles << (3u * channel);
    } else {
        adc->SMPR2 |= cycles << (3u * (channel - 10u));
    }
}

COLD static void sequence(stm32_adc_t *adc, uint32_t first, uint32_t second)
{
    adc->SMPR1 = 0u;
    adc->SMPR2 = 0u;
    sample_time(adc, first, SAMPLE_12_5);
    sample_time(adc, second, SAMPLE_47_5);
    adc->JSQR = (TWO_RANKS << ADC_JSQR_JL_Pos) | (first << ADC_JSQR_JSQ1_Pos) |
                (second << ADC_JSQR_JSQ2_Pos);
}

COLD static bool wait_for(const stm32_reg_t *reg, uint32_t mask, uint32_t value, uint32_t polls)
{
    for (uint32_t n = 0u; n < polls; n++) {
        if ((*reg & mask) == value) {
            return true;
        }
    }
    return false;
}

/* Out of deep power-down, its regulator on. */
COLD static void wake(stm32_adc_t *adc)
{
    adc->CR = 0u;
    adc->CR = ADC_CR_ADVREGEN;
}

COLD static bool calibrate_and_enable(stm32_adc_t *adc, uint32_t polls)
{
    adc->CR = ADC_CR_ADVREGEN | ADC_CR_ADCAL;
    if (!wait_for(&adc->CR, ADC_CR_ADCAL, 0u, polls)) {
        return false;
    }
    /* ADEN behind the end of the calibration needs four of the converter's clocks: RM0440. */
    for (uint32_t n = 0u; n < 16u; n++) {
        (void)adc->CR;
    }
    adc->ISR = ADC_ISR_ADRDY;
    adc->CR = ADC_CR_ADVREGEN | ADC_CR_ADEN;
    return wait_for(&adc->ISR, ADC_ISR_ADRDY, ADC_ISR_ADRDY, polls);
}

COLD bool g431_adc_start(const g431_adcs_t *adcs, uint32_t polls)
{
    wake(adcs->adc1);
    wake(adcs->adc2);
    for (uint32_t n = 0u; n < REGULATOR_READS; n++) {
        (void)adcs->adc1->CR;
    }
    adcs->common->CCR =
        (INJECTED_SIMULTANEOUS << ADC_CCR_DUAL_Pos) | (BUS_BY_4 << ADC_CCR_CKMODE_Pos);
    if (!calibrate_and_enable(adcs->adc1, polls) || !calibrate_and_enable(adcs->adc2, polls)) {
        return false;
    }
    adcs->adc1->CFGR = ADC_CFGR_JQDIS;
    adcs->adc2->CFGR = ADC_CFGR_JQDIS;
    sequence(adcs->adc1, adcs->channels->u, adcs->channels->w);
    sequence(adcs->adc2, adcs->channels->v, adcs->channels->dc);
    return true;
}

COLD bool g431_adc_convert(const g431_adcs_t *adcs, g431_words_t *words, uint32_t polls)
{
    adcs->adc1->ISR = ADC_ISR_JEOS | ADC_ISR_JEOC;
    adcs->adc1->CR = ADC_CR_ADVREGEN | ADC_CR_JADSTART;
    const bool done = wait_for(&adcs->adc1->ISR, ADC_ISR_JEOS, ADC_ISR_JEOS, polls);
    g431_adc_read(adcs, words);
    return done;
}

/* Only the master has trigger and interrupt. */
COLD void g431_adc_follow_carrier(const g431_adcs_t *adcs)
{
    adcs->adc1->JSQR |=
        (TRIGGER_TIM1_TRGO << ADC_JSQR_JEXTSEL_Pos) | (RISING_EDGE << ADC_JSQR_JEXTEN_Pos);
    adcs->adc1->ISR = ADC_ISR_JEOS | ADC_ISR_JEOC;
    adcs->adc1->IER = ADC_IER_JEOSIE;
    adcs->adc1->CR = ADC_CR_ADVREGEN | ADC_CR_JADSTART;
}

void g431_adc_read(const g431_adcs_t *adcs, g431_words_t *words)
{
    adcs->adc1->ISR = ADC_ISR_JEOS | ADC_ISR_JEOC; /* written 1 clears */
    words->u = (uint16_t)(adcs->adc1->JDR1 & WORD_MASK);
    words->v = (uint16_t)(adcs->adc2->JDR1 & WORD_MASK);
    words->w = (uint16_t)(adcs->adc1->JDR2 & WORD_MASK);
    words->dc = (uint16_t)(adcs->adc2->JDR2 & WORD_MASK);
}
