/* Amplifiers of the shunts and comparators of the over-current break, where the board uses those of
 * the part (B-G431B-ESC1).
 *
 *   leg   shunt   OPAMP     output   COMP   threshold
 *   u     PA1     OPAMP1    PA2      1      DAC3 channel 1
 *   v     PA7     OPAMP2    PA6      2      DAC3 channel 2
 *   w     PB0     OPAMP3    PB1      4      DAC3 channel 2
 *
 * The amplifiers have gain 16 with the shunt's other end as reference (PA3, PA5, PB2). The
 * comparators see the pin before the amplifier: .128 V without current, 1.71 mV/A more for current
 * out of the motor through a lower switch. One way only, but three currents sum up to zero, and a
 * short circuit of a leg comes the same way. They break TIM1 by themselves (g431_board.c).
 */
#ifndef G431_ANALOG_H
#define G431_ANALOG_H

#include <stdint.h>

#include "stm32_registers.h"

void g431_analog_amplify(stm32_opamp_t *opamp);

/* code: 12 bits of 3.3 V. The comparators are locked: only a reset changes them again. */
void g431_analog_watch(stm32_dac_t *dac, stm32_comp_t *comp, uint32_t code);

#endif
