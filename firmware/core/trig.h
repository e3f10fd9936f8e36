/* Sine, cosine and arctangent by polynomials of our own.
 *
 * libm's differ between C libraries in the last bit; these give the same bits everywhere
 * (error bounds: test_trig).
 */
#ifndef TRIG_H
#define TRIG_H

#include "frames.h"

/* (cos, sin) of the angle. |angle| <= 1000 rad keeps the stated accuracy; NaN gives (1, 0). */
ab_t trig_unit(float angle_rad);

/* Angle of the vector in -pi..pi; 0 for the zero vector and for NaN. */
float trig_angle(ab_t x);

/* The angle brought into -pi..pi. */
float trig_wrap(float angle_rad);

#endif
