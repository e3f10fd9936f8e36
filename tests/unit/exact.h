/* Assertions and values the unit tests share: bit equality, NaN and infinity, repeatable noise.
 */
#ifndef EXACT_H
#define EXACT_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "unity.h"

static inline uint32_t exact_bits(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

/* The very same float, the sign of zero included. */
#define ASSERT_SAME_FLOAT(expected, actual)                                                        \
    TEST_ASSERT_EQUAL_HEX32(exact_bits(expected), exact_bits(actual))

/* |actual - expected| <= tolerance; fails for NaN. */
#define ASSERT_NEAR(tolerance, expected, actual)                                                   \
    TEST_ASSERT_DOUBLE_WITHIN((tolerance), (double)(expected), (double)(actual))

/* What no physical quantity may be. */
#define NOT_POSITIVE_COUNT 5
static inline float not_positive(int k)
{
    const float bad[NOT_POSITIVE_COUNT] = {NAN, INFINITY, -INFINITY, -1.0f, 0.0f};
    return bad[k];
}

#define NOT_FINITE_COUNT 3
static inline float not_finite(int k)
{
    const float bad[NOT_FINITE_COUNT] = {NAN, INFINITY, -INFINITY};
    return bad[k];
}

/* Uniform in -1..1, the same sequence on every machine. */
static inline float noise(uint32_t *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return (float)(*seed >> 8) / 8388608.0f - 1.0f;
}

#endif
