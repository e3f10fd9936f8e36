#include "frames.h"

#include <math.h>

ab_t ab_shortened(ab_t x, float limit)
{
    const ab_t boxed = ab_clamp(x, limit);
    return ab_scale(boxed, limit / sqrtf(ab_norm2(boxed)));
}
