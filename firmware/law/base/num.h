/* Small float helpers for all modules.
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

/* Every caller has to check the result. A function that may refuse runs before the drive turns, or
 * in the background, and is compiled for size. */
#if defined(__GNUC__) || defined(__clang__)
#define CHECKED __attribute__((warn_unused_result, cold))
/* The same for code that rarely or never runs in a control period, and everything that only it
 * calls. */
#define COLD __attribute__((cold, noinline))
#else
#define CHECKED
#define COLD
#endif

/* For code that every control period runs once and that the compiler considers too large to inline.
 * Not without optimisation: there coverage counts each function once. */
#if (defined(__GNUC__) || defined(__clang__)) && defined(__OPTIMIZE__)
#define INLINE __attribute__((always_inline))
#else
#define INLINE
#endif

/* For the control law of a period, and for each piece of its slow work. Everything it calls is
 * inlined, except COLD code, so that no argument struct is built. It is a function of its own, so
 * that state and configuration are within a load's reach (1 KiB) of a register. */
#if (defined(__GNUC__) && !defined(__clang__)) && defined(__OPTIMIZE__)
#define HOT __attribute__((flatten, noinline))
#else
#define HOT
#endif

/* For slow work that HOT code calls: it stays a function of its own, and the compiler decides what
 * it inlines there. For stage_slow this takes 300 B less flash than HOT and costs one instruction
 * on average (`zh bench --only fig07 --config recommended`).
 */
#if (defined(__GNUC__) && !defined(__clang__)) && defined(__OPTIMIZE__)
#define APART __attribute__((noinline))
#else
#define APART
#endif

/* Selections, not branches: one instruction each where the core has min and max. A comparison with
 * NaN is false, so NaN leaves b. */
static inline float maxf(float a, float b)
{
    return (a > b) ? a : b;
}

static inline float minf(float a, float b)
{
    return (a < b) ? a : b;
}

/* x limited to lo..hi (lo <= hi); NaN gives lo, so that it does not propagate. */
static inline float clampf(float x, float lo, float hi)
{
    return minf(maxf(x, lo), hi);
}

/* NaN stays NaN. A bit operation, no call: every supported compiler inlines it. */
static inline float absf(float x)
{
    return fabsf(x);
}

/* x limited to +-limit (limit >= 0); NaN gives -limit. One comparison in the usual case, inside. */
static inline float limitf(float x, float limit)
{
    if (!(absf(x) <= limit)) {
        x = (x > 0.0f) ? limit : -limit;
    }
    return x;
}

/* The 32 bits of x. Positive floats are in the same order as their bits; infinity, NaN and
 * everything negative, -0 included, come after them. A range that starts at 0 is therefore one
 * integer comparison, which takes half the instructions of a float comparison on the target. */
static inline uint32_t float_bits(float x)
{
    const union {
        float value;
        uint32_t bits;
    } u = {.value = x};
    return u.bits;
}

/* The inverse of float_bits. */
static inline float float_of_bits(uint32_t bits)
{
    const union {
        uint32_t bits;
        float value;
    } u = {.bits = bits};
    return u.value;
}

#define NUM_BITS_OF_NORMAL   0x00800000u /* the smallest */
#define NUM_BITS_OF_ONE      0x3F800000u
#define NUM_BITS_OF_INFINITY 0x7F800000u
#define NUM_BITS_OF_MINUS_0  0x80000000u

/* Neither infinite nor NaN. */
static inline bool is_finite(float x)
{
    return (float_bits(x) << 1) < (NUM_BITS_OF_INFINITY << 1);
}

/* Finite and > 0, as required of every resistance, inductance, period and limit. 0 wraps round. */
static inline bool positivef(float x)
{
    return (float_bits(x) - 1u) < (NUM_BITS_OF_INFINITY - 1u);
}

/* Of either sign: the parameter of what is switched off. */
static inline bool is_zero(float x)
{
    return (float_bits(x) << 1) == 0u;
}

/* x > 0 and finite, for a quantity of which less than the smallest normal number is none. */
static inline bool effectivef(float x)
{
    return (float_bits(x) - NUM_BITS_OF_NORMAL) < (NUM_BITS_OF_INFINITY - NUM_BITS_OF_NORMAL);
}

/* x > 0, for a share or a voltage that is a number: NaN and infinity count as large. */
static inline bool above_zerof(float x)
{
    const uint32_t bits = float_bits(x);
    return (bits != 0u) && (bits < NUM_BITS_OF_MINUS_0);
}

/* +0..1, the range of a duty. */
static inline bool is_duty(float x)
{
    return float_bits(x) <= NUM_BITS_OF_ONE;
}

/* Finite and >= 0, -0 included. Called, not inlined: only parameters are checked by it. */
bool nonnegativef(float x);

/* The same for each of n values. */
CHECKED bool all_finite(const float *x, size_t n);
CHECKED bool all_positive(const float *x, size_t n);
CHECKED bool all_nonnegative(const float *x, size_t n);

/* And for a list: ALL_POSITIVE(period_s, i_max_A). */
#define ALL_FINITE(...)      all_finite((const float[]){__VA_ARGS__}, NUM_COUNT(__VA_ARGS__))
#define ALL_POSITIVE(...)    all_positive((const float[]){__VA_ARGS__}, NUM_COUNT(__VA_ARGS__))
#define ALL_NONNEGATIVE(...) all_nonnegative((const float[]){__VA_ARGS__}, NUM_COUNT(__VA_ARGS__))

/* Number of arguments, 12 at most; with more it is not an integer. A sizeof of the list would count
 * any number, but no analyser accepts it. */
#define NUM_COUNT(...)                                                                             \
    NUM_TWELFTH(__VA_ARGS__, 12u, 11u, 10u, 9u, 8u, 7u, 6u, 5u, 4u, 3u, 2u, 1u, 0u)
#define NUM_TWELFTH(a, b, c, d, e, f, g, h, i, j, k, l, count, ...) (count)

#endif
