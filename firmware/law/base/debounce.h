/* How often something was wrong lately: a count that goes up by 8 when it is and down by 1 when it
 * is not. It reaches limit x 8 after `limit` times on end, and from one time in eight upward at
 * all: a loose contact is found, a disturbed sample is not.
 */
#ifndef DEBOUNCE_H
#define DEBOUNCE_H

#include <stdbool.h>
#include <stdint.h>

#define DEBOUNCE_WEIGHT 8u

/* The next count; it stays at `limit` x 8 and cannot wrap. */
static inline uint32_t debounce_count(uint32_t count, bool wrong, uint32_t limit)
{
    const uint32_t most = DEBOUNCE_WEIGHT * limit;
    if (!wrong) {
        return (count > 0u) ? (count - 1u) : 0u;
    }
    return ((most - count) > DEBOUNCE_WEIGHT) ? (count + DEBOUNCE_WEIGHT) : most;
}

static inline bool debounce_elapsed(uint32_t count, uint32_t limit)
{
    return count >= (DEBOUNCE_WEIGHT * limit);
}

#endif
