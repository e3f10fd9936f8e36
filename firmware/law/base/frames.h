/* Reference frames as types: three-phase, stationary alpha/beta, rotating d/q.
 *
 * Power-invariant scaling. A pair is a complex number alpha + j beta (d + j q);
 * the paper's J is multiplication by j.
 */
#ifndef FRAMES_H
#define FRAMES_H

#include "num.h"

typedef struct {
    float u;
    float v;
    float w;
} uvw_t;

typedef struct {
    float alpha;
    float beta;
} ab_t;

typedef struct {
    float d;
    float q;
} dq_t;

/* Copy by component, so that a vector just computed is not read back from memory. */
static inline ab_t ab_by_parts(ab_t a)
{
    return (ab_t){a.alpha, a.beta};
}

static inline ab_t ab_add(ab_t a, ab_t b)
{
    return (ab_t){a.alpha + b.alpha, a.beta + b.beta};
}

static inline ab_t ab_sub(ab_t a, ab_t b)
{
    return (ab_t){a.alpha - b.alpha, a.beta - b.beta};
}

static inline ab_t ab_scale(ab_t a, float k)
{
    return (ab_t){k * a.alpha, k * a.beta};
}

/* Complex product a b: rotates and stretches b by a. */
static inline ab_t ab_mul(ab_t a, ab_t b)
{
    return (ab_t){a.alpha * b.alpha - a.beta * b.beta, a.alpha * b.beta + a.beta * b.alpha};
}

static inline ab_t ab_conj(ab_t a)
{
    return (ab_t){a.alpha, -a.beta};
}

/* Re(conj(a) b) = a^T b. */
static inline float ab_dot(ab_t a, ab_t b)
{
    return a.alpha * b.alpha + a.beta * b.beta;
}

/* Im(conj(a) b) = (J a)^T b: b's component 90 degrees ahead of a, times |a|. */
static inline float ab_cross(ab_t a, ab_t b)
{
    return a.alpha * b.beta - a.beta * b.alpha;
}

/* One number for both components, where only NaN matters. */
static inline float ab_sum(ab_t a)
{
    return a.alpha + a.beta;
}

static inline float ab_norm2(ab_t a)
{
    return a.alpha * a.alpha + a.beta * a.beta;
}

static inline bool ab_finite(ab_t a)
{
    return is_finite(a.alpha) && is_finite(a.beta);
}

/* Both components limited to +-limit; NaN becomes -limit. */
static inline ab_t ab_clamp(ab_t a, float limit)
{
    /* If the sum is within the limit, both are: one comparison in the usual case. */
    if (!(absf(a.alpha) + absf(a.beta) <= limit)) {
        a = (ab_t){limitf(a.alpha, limit), limitf(a.beta, limit)};
    }
    return a;
}

/* Shortens x to the limit; out of line, so that the usual case stays short. */
COLD ab_t ab_shortened(ab_t x, float limit);

/* Limits |x| and keeps the angle. A limit per component would be a square, whose corners would hold
 * the field angle. NaN also ends inside. */
static inline ab_t ab_limited(ab_t x, float limit)
{
    if (!(ab_norm2(x) <= limit * limit)) {
        x = ab_shortened(x, limit);
    }
    return x;
}

/* Clarke, power invariant; the zero-sequence component is dropped. */
static inline ab_t ab_from_uvw(uvw_t x)
{
    return (ab_t){NUM_SQRT_2_3 * (x.u - 0.5f * (x.v + x.w)), NUM_SQRT_1_2 * (x.v - x.w)};
}

/* Clarke from two line-to-line quantities u_uv = u_u - u_v, u_vw = u_v - u_w. */
static inline ab_t ab_from_line(float uv, float vw)
{
    return (ab_t){NUM_SQRT_2_3 * (uv + 0.5f * vw), NUM_SQRT_1_2 * vw};
}

/* Inverse Clarke with zero sequence 0. */
static inline uvw_t uvw_from_ab(ab_t x)
{
    const float u = NUM_SQRT_2_3 * x.alpha;
    const float b = NUM_SQRT_1_2 * x.beta;
    return (uvw_t){u, b - 0.5f * u, -b - 0.5f * u};
}

/* Park: x seen from the frame whose d axis is the unit vector axis. */
static inline dq_t dq_from_ab(ab_t x, ab_t axis)
{
    return (dq_t){ab_dot(axis, x), ab_cross(axis, x)};
}

static inline ab_t ab_from_dq(dq_t x, ab_t axis)
{
    return (ab_t){x.d * axis.alpha - x.q * axis.beta, x.d * axis.beta + x.q * axis.alpha};
}

#endif
