/* Values of which nothing is known, for Frama-C's Eva: a function of which it knows the prototype
 * alone. A float may be infinite or NaN. Nobody defines them: an entry is compiled like everything
 * else, and never linked.
 */
#ifndef ANY_H
#define ANY_H

#include <stdbool.h>
#include <stdint.h>

#include "frames.h"

uint32_t any_word(void);
float any_float(void);

static inline bool any_bool(void)
{
    return (any_word() & 1u) != 0u;
}

static inline ab_t any_ab(void)
{
    const float alpha = any_float();
    return (ab_t){alpha, any_float()};
}

#endif
