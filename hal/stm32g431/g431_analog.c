#include "g431_analog.h"

#include "num.h"

#define PGA             2u  /* the inverting input gets the internal ladder */
#define GAIN_16_BIAS    11u /* x16, the ladder's foot at VINM0 */
#define INTERNAL        3u  /* DAC channel to the comparators only, without buffer */
#define ABOVE_160_MHZ   2u  /* the DAC's bus clock */
#define MINUS_DAC3      4u
#define HYSTERESIS_10MV 1u

COLD void g431_analog_amplify(stm32_opamp_t *opamp)
{
    const uint32_t mode = (PGA << OPAMP_OPAMP1_CSR_VM_SEL_Pos) | OPAMP_OPAMP1_CSR_OPAHSM |
                          (GAIN_16_BIAS << OPAMP_OPAMP1_CSR_PGA_GAIN_Pos);
    opamp->OPAMP1_CSR = mode;
    opamp->OPAMP2_CSR = mode;
    opamp->OPAMP3_CSR = mode;
    opamp->OPAMP1_CSR = mode | OPAMP_OPAMP1_CSR_OPAEN;
    opamp->OPAMP2_CSR = mode | OPAMP_OPAMP1_CSR_OPAEN;
    opamp->OPAMP3_CSR = mode | OPAMP_OPAMP1_CSR_OPAEN;
}

COLD void g431_analog_watch(stm32_dac_t *dac, stm32_comp_t *comp, uint32_t code)
{
    dac->MCR = (INTERNAL << DAC_MCR_MODE1_Pos) | (INTERNAL << DAC_MCR_MODE2_Pos) |
               (ABOVE_160_MHZ << DAC_MCR_HFSEL_Pos);
    dac->CR = DAC_CR_EN1 | DAC_CR_EN2;
    dac->DHR12R1 = code;
    dac->DHR12R2 = code;
    const uint32_t mode = COMP_C1CSR_EN | (MINUS_DAC3 << COMP_C1CSR_INMSEL_Pos) |
                          (HYSTERESIS_10MV << COMP_C1CSR_HYST_Pos);
    comp->C1CSR = mode;
    comp->C2CSR = mode;
    comp->C4CSR = mode;
    comp->C1CSR = mode | COMP_C1CSR_LOCK;
    comp->C2CSR = mode | COMP_C1CSR_LOCK;
    comp->C4CSR = mode | COMP_C1CSR_LOCK;
}
