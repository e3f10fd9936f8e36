/* Sine, cosine and arctangent by polynomials of our own.
 *
 * libm's differ between C libraries in the last bit; these give the same bits everywhere.
 * Absolute error: sine and cosine 1e-7, arctangent 4e-7 rad (test_trig sets both).
 */
#ifndef TRIG_H
#define TRIG_H

#include "frames.h"

/* Beyond this an angle is taken as this: float has less than 1e-3 rad left there. */
#define TRIG_ANGLE_MAX_RAD 10000.0f

/* (cos, sin) of the angle. NaN and infinity give (1, 0). */
ab_t trig_unit(float angle_rad);

/* Angle of the vector in -pi..pi; 0 for the zero vector and for one that is not finite. */
float trig_angle(ab_t x);

/* The angle brought into -pi..pi; NaN and infinity give 0. */
float trig_wrap(float angle_rad);

#endif
