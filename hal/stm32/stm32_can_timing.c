#include "stm32_can.h"

#define QUANTA_MOST  20u /* of a bit */
#define QUANTA_LEAST 8u
#define DIVIDER_MOST 512u

bool stm32_can_timing(uint32_t clock_Hz, uint32_t baud, stm32_can_timing_t *timing)
{
    for (uint32_t quanta = QUANTA_MOST; quanta >= QUANTA_LEAST; quanta--) {
        const uint32_t rate_Hz = quanta * baud;
        if ((clock_Hz % rate_Hz == 0u) && (clock_Hz / rate_Hz <= DIVIDER_MOST)) {
            const uint32_t behind = (quanta + 4u) / 8u;
            *timing = (stm32_can_timing_t){clock_Hz / rate_Hz, quanta - 1u - behind, behind};
            return true;
        }
    }
    return false;
}
