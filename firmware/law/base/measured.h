/* Sensor values of one sample in SI units: output of the measurement, input of all other modules.
 */
#ifndef MEASURED_H
#define MEASURED_H

#include <stdint.h>

#include "frames.h"

#define MEASUREMENT_SATURATED    1u /* ADC word at an end of its range; dc link: upper end */
#define MEASUREMENT_OUT_OF_RANGE 2u /* a word above 2^bits - 1: not from this ADC */
#define MEASUREMENT_CURRENT_SUM  4u /* i_u + i_v + i_w beyond current_sum_max_A */

typedef struct {
    uvw_t i_A;
    ab_t i_s_A;    /* their vector, less offsets that have moved */
    ab_t u_line_V; /* stationary-frame voltage from the filtered line-voltage sensors */
    float u_dc_V;
    uint32_t flags;
} measured_t;

/* Gains that differ among the sensors of a kind show a vector x as x + n conj(x): n, a negative
 * sequence. */
typedef struct {
    ab_t i; /* of the current sensors */
    ab_t u; /* of the line-voltage sensors */
} unbalance_t;

#endif
