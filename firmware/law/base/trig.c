#include "trig.h"

#include <stdint.h>

/* pi/2 in three parts (Cody-Waite): a whole number up to 2^13 times each of the first two is exact
 * in float, so the reduction loses nothing of the angle. */
#define HALF_PI_HIGH   1.5703125f
#define HALF_PI_MIDDLE 0.0004837512969970703125f
#define HALF_PI_LOW    7.549790126404332e-8f
#define TWO_OVER_PI    0.63661977236758134308f

/* The same parts times four. */
#define TWO_PI_HIGH     6.28125f
#define TWO_PI_MIDDLE   0.00193500518798828125f
#define TWO_PI_LOW      3.019916050561733e-7f
#define ONE_OVER_TWO_PI 0.15915494309189533577f

/* Minimax over 0..1: atan t = t + t^3 P(t^2), error 5e-8. */
#define ATAN_3  (-0.3333165943622589f)
#define ATAN_5  0.19962704181671143f
#define ATAN_7  (-0.13976582884788513f)
#define ATAN_9  0.09794235229492188f
#define ATAN_11 (-0.05777359753847122f)
#define ATAN_13 0.02304014004766941f
#define ATAN_15 (-0.004355406854301691f)

/* Nearest whole number; |x| below 2^22, or the cast would not be defined. */
static int32_t round_to_int(float x)
{
    return (int32_t)(x + ((x < 0.0f) ? -0.5f : 0.5f));
}

ab_t trig_unit(float angle_rad)
{
    if (absf(angle_rad) <= TRIG_SMALL_MAX_RAD) {
        return trig_unit_small(angle_rad);
    }
    if (!is_finite(angle_rad)) {
        return (ab_t){1.0f, 0.0f};
    }
    const float angle = limitf(angle_rad, TRIG_ANGLE_MAX_RAD);
    const int32_t quarters = round_to_int(angle * TWO_OVER_PI);
    const float n = (float)quarters;
    const float r = ((angle - n * HALF_PI_HIGH) - n * HALF_PI_MIDDLE) - n * HALF_PI_LOW;
    const ab_t part = trig_unit_small(r);

    /* A quarter turn is multiplication by j, half a turn by -1. */
    const uint32_t quadrant = (uint32_t)quarters;
    const ab_t unit = ((quadrant & 1u) != 0u) ? (ab_t){-part.beta, part.alpha} : part;
    return ((quadrant & 2u) != 0u) ? (ab_t){-unit.alpha, -unit.beta} : unit;
}

float trig_angle(ab_t x)
{
    const float a = absf(x.alpha);
    const float b = absf(x.beta);
    const bool steep = b > a; /* beyond 45 degrees */
    const float longer = steep ? b : a;
    const float shorter = steep ? a : b;
    if (!ab_finite(x) || !(longer > 0.0f)) {
        return 0.0f;
    }
    const float t = shorter / longer;
    const float t2 = t * t;
    const float p9 = ATAN_9 + t2 * (ATAN_11 + t2 * (ATAN_13 + t2 * ATAN_15));
    float angle = t + t * t2 * (ATAN_3 + t2 * (ATAN_5 + t2 * (ATAN_7 + t2 * p9)));

    /* Out of the first octant by reflection at 45 degrees and at both axes. */
    if (steep) {
        angle = NUM_HALF_PI - angle;
    }
    if (x.alpha < 0.0f) {
        angle = NUM_PI - angle;
    }
    return (x.beta < 0.0f) ? -angle : angle;
}

float trig_wrap(float angle_rad)
{
    if (!is_finite(angle_rad)) {
        return 0.0f;
    }
    const float angle = limitf(angle_rad, TRIG_ANGLE_MAX_RAD);
    const float n = (float)round_to_int(angle * ONE_OVER_TWO_PI);
    const float r = ((angle - n * TWO_PI_HIGH) - n * TWO_PI_MIDDLE) - n * TWO_PI_LOW;

    /* The number of turns is rounded in float: near +-pi it can be one off. */
    if (r > NUM_PI) {
        return r - NUM_TWO_PI;
    }
    return (r < -NUM_PI) ? (r + NUM_TWO_PI) : r;
}
