/* Debounce counter: rises by 8 when a check fails and falls by 1 when it passes.
 *
 * It reaches limit x 8 after `limit` failures in a row, and also when more than one check in eight
 * fails. It therefore finds a loose contact and ignores a single disturbed sample.
 */
#ifndef DEBOUNCE_H
#define DEBOUNCE_H

#include <stdbool.h>
#include <stdint.h>

#define DEBOUNCE_WEIGHT 8u

/* The next count; it saturates at `limit` x 8 and cannot wrap. */
static inline uint32_t debounce_count(uint32_t count, bool wrong, uint32_t limit)
{
    const uint32_t most = DEBOUNCE_WEIGHT * limit;
    if (!wrong) {
        return (count > 0u) ? (count - 1u) : 0u;
    }
    return ((most - count) > DEBOUNCE_WEIGHT) ? (count + DEBOUNCE_WEIGHT) : most;
}

/* A sign that all is well, not just no failure: falls as fast as a failure rises. */
static inline uint32_t debounce_refute(uint32_t count)
{
    return (count > DEBOUNCE_WEIGHT) ? (count - DEBOUNCE_WEIGHT) : 0u;
}

static inline bool debounce_elapsed(uint32_t count, uint32_t limit)
{
    return count >= (DEBOUNCE_WEIGHT * limit);
}

#endif
