/* Sine, cosine and arctangent by polynomials of our own.
 *
 * Those of libm differ between C libraries in the last bit; these give the same bits everywhere.
 * Absolute error: sine and cosine 1e-7, arctangent 4e-7 rad (test_trig sets both).
 */
#ifndef TRIG_H
#define TRIG_H

#include "frames.h"

/* Angles are limited to this: beyond it a float resolves less than 1e-3 rad. */
#define TRIG_ANGLE_MAX_RAD 10000.0f

/* An eighth of a revolution, rounded down: smaller angles need no reduction. */
#define TRIG_SMALL_MAX_RAD 0.785f

/* Minimax over -pi/4..pi/4: sin r = r + r^3 P(r^2), error 2e-9. */
#define TRIG_SIN_3 (-0.16666650772094727f)
#define TRIG_SIN_5 0.008331977762281895f
#define TRIG_SIN_7 (-0.00019495567539706826f)

/* cos r = 1 - r^2/2 + r^4 P(r^2), error 1e-10. */
#define TRIG_COS_4 0.04166664555668831f
#define TRIG_COS_6 (-0.0013887366512790322f)
#define TRIG_COS_8 2.4438379114144482e-5f

/* (cos, sin) of |angle| <= pi/4: the same bits as trig_unit, without the range check. */
static inline ab_t trig_unit_small(float angle_rad)
{
    const float r = angle_rad;
    const float r2 = r * r;
    return (ab_t){(1.0f - 0.5f * r2) + r2 * r2 * (TRIG_COS_4 + r2 * (TRIG_COS_6 + r2 * TRIG_COS_8)),
                  r + r * r2 * (TRIG_SIN_3 + r2 * (TRIG_SIN_5 + r2 * TRIG_SIN_7))};
}

/* Unit vector rotated by w t, by an eighth of a revolution at most, so that a wild speed cannot
 * spin a voltage. */
static inline ab_t trig_ahead(float omega_rad_s, float time_s)
{
    return trig_unit_small(limitf(omega_rad_s * time_s, TRIG_SMALL_MAX_RAD));
}

/* (cos, sin) of the angle. NaN and infinity give (1, 0). */
ab_t trig_unit(float angle_rad);

/* Angle of the vector in -pi..pi; 0 for the zero vector and for one that is not finite. */
float trig_angle(ab_t x);

/* The angle wrapped to -pi..pi; NaN and infinity give 0. */
float trig_wrap(float angle_rad);

#endif
