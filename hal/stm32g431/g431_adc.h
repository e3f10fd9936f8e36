/* ADC1 and ADC2 together: three shunts at the carrier crest, then the dc link.
 *
 * Injected groups in dual mode ("injected simultaneous"), started by TIM1's TRGO (the update at the
 * crest, where all lower switches conduct), two ranks each:
 *
 *            ADC1   ADC2
 *   rank 1   i_u    i_v     12.5 + 12.5 cycles of 42.5 MHz: held .29 us behind the crest
 *   rank 2   i_w    u_dc    47.5 + 12.5 cycles: held 1.7 us behind it; all done after 2.0 us
 *
 * ADC1 raises the control interrupt. Words are 12 bit, as converted (g431_shunts.h has the rest).
 */
#ifndef G431_ADC_H
#define G431_ADC_H

#include <stdbool.h>
#include <stdint.h>

#include "stm32_registers.h"

typedef struct {
    uint32_t u, w, v, dc; /* inputs: of ADC1 u and w, of ADC2 v and the dc link */
} g431_channels_t;

typedef struct {
    stm32_adc_t *adc1;
    stm32_adc_t *adc2;
    stm32_adc_common_t *common;
    const g431_channels_t *channels;
} g431_adcs_t;

typedef struct {
    uint16_t u, v, w, dc;
} g431_words_t;

/* Polls of a ready bit before giving up: calibration takes 2.7 us. */
#define G431_ADC_POLLS 10000u

/* Switches both on and calibrates them; false when one does not get ready. */
bool g431_adc_start(const g431_adcs_t *adcs, uint32_t polls);

/* One conversion now, by software, before g431_adc_follow_carrier; false when it does not end. */
bool g431_adc_convert(const g431_adcs_t *adcs, g431_words_t *words, uint32_t polls);

/* Waits for TIM1's triggers from then on, and interrupts. */
void g431_adc_follow_carrier(const g431_adcs_t *adcs);

/* Takes the results of this crest and clears their flags. */
void g431_adc_read(const g431_adcs_t *adcs, g431_words_t *words);

#endif
