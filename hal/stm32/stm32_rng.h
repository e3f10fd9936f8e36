/* Random number generator: analogue noise behind a shift register, on the PLL's 48 MHz. */
#ifndef STM32_RNG_H
#define STM32_RNG_H

#include <stdbool.h>

#include "stm32_registers.h"

#define STM32_RNG_POLLS 1000u /* a word takes 40 clocks of 48 MHz */

void stm32_rng_start(stm32_rng_t *rng);

/* False, and *bits unchanged: no word in time, a fault of clock or noise source, or the same word
 * twice, as from a stuck generator (FIPS 140-2 4.9.2). */
bool stm32_rng_draw(stm32_rng_t *rng, uint64_t *bits);

#endif
