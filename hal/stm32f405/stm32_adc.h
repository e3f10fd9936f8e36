/* ADC1..3 together: three phase currents at the carrier crest, then line voltages and dc link.
 *
 * Injected groups in triple regular-free mode ("injected simultaneous"), started by TIM1's TRGO
 * (the update at the crest), two ranks each:
 *
 *            ADC1                 ADC2                 ADC3
 *   rank 1   i_u  PA0 IN0         i_v  PA1 IN1         i_w  PA2 IN2
 *   rank 2   u_uv PC0 IN10        u_vw PC1 IN11        u_dc PC2 IN12
 *
 * 21 MHz, 15 + 12 cycles a rank: the currents are held for .71 us from the crest on, all is done
 * after 2.6 us, and ADC1 raises the control interrupt. Words are 12 bit, right aligned, handed over
 * as they are; signs and full scales are parameters of the board (host_sim/boards/stm32f405.toml).
 */
#ifndef STM32_ADC_H
#define STM32_ADC_H

#include <stdbool.h>

#include "hal_drive_io.h"
#include "stm32_registers.h"

typedef struct {
    stm32_adc_t *adc1;
    stm32_adc_t *adc2;
    stm32_adc_t *adc3;
    stm32_adc_common_t *common;
} stm32_adcs_t;

/* Waits for triggers from then on. */
void stm32_adc_start(const stm32_adcs_t *adcs);

/* Takes the results of this crest and clears their flag; late_periods stays the caller's. */
void stm32_adc_read(const stm32_adcs_t *adcs, hal_sample_t *sample);

/* The next crest's results are there. */
bool stm32_adc_ready(const stm32_adcs_t *adcs);

#endif
