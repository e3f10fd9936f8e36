/* Small float helpers every module shares.
 *
 * No state; the same bits on host and target.
 */
#ifndef NUM_H
#define NUM_H

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define NUM_PI       3.14159265358979323846f
#define NUM_TWO_PI   6.28318530717958647692f
#define NUM_HALF_PI  1.57079632679489661923f
#define NUM_SQRT_1_2 0.70710678118654752440f /* sqrt(1/2) */
#define NUM_SQRT_2_3 0.81649658092772603273f /* sqrt(2/3): power-invariant Clarke */

/* Every caller has to look at the answer. Whatever may refuse is at work before the drive turns, or
 * in the background: it is compiled for size. */
#if defined(__GNUC__) || defined(__clang__)
#define CHECKED __attribute__((warn_unused_result, cold))
/* The same for what seldom or never runs in a control period, and all that only it calls. */
#define COLD __attribute__((cold, noinline))
#else
#define CHECKED
#define COLD
#endif

/* For what every control period does once and the compiler finds too large to inline. Not where
 * nothing is optimised: there coverage counts each function once. */
#if (defined(__GNUC__) || defined(__clang__)) && defined(__OPTIMIZE__)
#define INLINE __attribute__((always_inline))
#else
#define INLINE
#endif

/* The control law of a period, and each piece of its slow work: everything it calls is inlined, but
 * for what is COLD, so that no struct of arguments is built. A function of its own, so that state
 * and configuration are each within a load's reach (1 KiB) of a register. */
#if (defined(__GNUC__) && !defined(__clang__)) && defined(__OPTIMIZE__)
#define HOT __attribute__((flatten, noinline))
#else
#define HOT
#endif

/* Choices between two values, not branches: one instruction each where the core has min and max.
 * A comparison with NaN is false, so NaN leaves b. */
static inline float maxf(float a, float b)
{
    return (a > b) ? a : b;
}

static inline float minf(float a, float b)
{
    return (a < b) ? a : b;
}

/* x limited to lo..hi (lo <= hi); lo for NaN, so that nothing downstream sees one. */
static inline float clampf(float x, float lo, float hi)
{
    return minf(maxf(x, lo), hi);
}

/* NaN stays NaN. A bit operation, no call: every compiler here knows the function. */
static inline float absf(float x)
{
    return fabsf(x);
}

/* x limited to +-limit (limit >= 0); -limit for NaN. The usual case, inside, is one comparison. */
static inline float limitf(float x, float limit)
{
    if (!(absf(x) <= limit)) {
        x = (x > 0.0f) ? limit : -limit;
    }
    return x;
}

/* The 32 bits of x. Positive floats are ordered as these are, then come infinity, NaN and
 * everything negative, -0 included: a range that starts at 0 is one comparison of integers, which
 * on the target takes half the instructions of one of floats. */
static inline uint32_t float_bits(float x)
{
    const union {
        float value;
        uint32_t bits;
    } u = {.value = x};
    return u.bits;
}

/* And back: what came as a word is a number again. */
static inline float float_of_bits(uint32_t bits)
{
    const union {
        uint32_t bits;
        float value;
    } u = {.bits = bits};
    return u.value;
}

#define NUM_BITS_OF_ONE      0x3F800000u
#define NUM_BITS_OF_INFINITY 0x7F800000u
#define NUM_BITS_OF_MINUS_0  0x80000000u

/* Neither infinite nor NaN. */
static inline bool is_finite(float x)
{
    return (float_bits(x) << 1) < (NUM_BITS_OF_INFINITY << 1);
}

/* Finite and > 0: what every resistance, inductance, period and limit has to be. 0 wraps round. */
static inline bool positivef(float x)
{
    return (float_bits(x) - 1u) < (NUM_BITS_OF_INFINITY - 1u);
}

/* +0..1, what a duty has to be. */
static inline bool is_duty(float x)
{
    return float_bits(x) <= NUM_BITS_OF_ONE;
}

/* Finite and >= 0, -0 included. */
static inline bool nonnegativef(float x)
{
    return (float_bits(x) < NUM_BITS_OF_INFINITY) || (float_bits(x) == NUM_BITS_OF_MINUS_0);
}

/* The same of each of n values. */
CHECKED bool all_finite(const float *x, size_t n);
CHECKED bool all_positive(const float *x, size_t n);
CHECKED bool all_nonnegative(const float *x, size_t n);

/* And of a list: ALL_POSITIVE(period_s, i_max_A). */
#define ALL_FINITE(...)      all_finite((const float[]){__VA_ARGS__}, NUM_COUNT(__VA_ARGS__))
#define ALL_POSITIVE(...)    all_positive((const float[]){__VA_ARGS__}, NUM_COUNT(__VA_ARGS__))
#define ALL_NONNEGATIVE(...) all_nonnegative((const float[]){__VA_ARGS__}, NUM_COUNT(__VA_ARGS__))

/* How many, of 12 at most; with more the count is no integer. A sizeof of the list would count any,
 * but no analyser takes it. */
#define NUM_COUNT(...)                                                                             \
    NUM_TWELFTH(__VA_ARGS__, 12u, 11u, 10u, 9u, 8u, 7u, 6u, 5u, 4u, 3u, 2u, 1u, 0u)
#define NUM_TWELFTH(a, b, c, d, e, f, g, h, i, j, k, l, count, ...) (count)

#endif
