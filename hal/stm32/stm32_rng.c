#include "stm32_rng.h"

#define WRONG (RNG_SR_CECS | RNG_SR_SECS | RNG_SR_CEIS | RNG_SR_SEIS)

void stm32_rng_start(stm32_rng_t *rng)
{
    rng->CR = RNG_CR_RNGEN;
}

static bool draw_word(stm32_rng_t *rng, uint32_t *word)
{
    for (uint32_t n = 0u; n < STM32_RNG_POLLS; n++) {
        const uint32_t status = rng->SR;
        if ((status & WRONG) != 0u) {
            return false;
        }
        if ((status & RNG_SR_DRDY) != 0u) {
            *word = rng->DR;
            return true;
        }
    }
    return false;
}

bool stm32_rng_draw(stm32_rng_t *rng, uint64_t *bits)
{
    uint32_t low = 0u;
    uint32_t high = 0u;
    if (!draw_word(rng, &low) || !draw_word(rng, &high) || (low == high)) {
        return false;
    }
    *bits = ((uint64_t)high << 32u) | low;
    return true;
}
