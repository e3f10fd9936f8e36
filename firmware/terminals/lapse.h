/* True time of the terminals, in steps of 1 ms.
 *
 * A look at them comes when the background has its turn: `steps` is the whole number of
 * milliseconds since the last look, 1 or more. A condition that is seen for the first time counts
 * one step, whatever time has passed before: when it began is unknown.
 */
#ifndef LAPSE_H
#define LAPSE_H

#include <stdbool.h>
#include <stdint.h>

#include "debounce.h"

#define LAPSE_STEP_S  1e-3f
#define LAPSE_STEP_NS 1000000u

/* For how long a condition has stood. */
static inline uint32_t lapse_stood(uint32_t stood, bool holds, uint32_t steps)
{
    const uint32_t more = (stood == 0u) ? 1u : steps;
    return holds ? (stood + more) : 0u;
}

/* The counter of debounce.h, which a loose contact fills too. */
static inline uint32_t lapse_debounce(uint32_t count, bool wrong, uint32_t limit, uint32_t steps)
{
    if (!wrong) {
        return (count > steps) ? (count - steps) : 0u;
    }
    const uint32_t most = DEBOUNCE_WEIGHT * limit;
    const uint32_t rise = DEBOUNCE_WEIGHT * ((count == 0u) ? 1u : steps);
    return ((most - count) > rise) ? (count + rise) : most;
}

/* Gain of a first-order low-pass filter. */
static inline float lapse_gain(float filter_s, uint32_t steps)
{
    const float lapse_s = LAPSE_STEP_S * (float)steps;
    return lapse_s / (lapse_s + filter_s);
}

#endif
