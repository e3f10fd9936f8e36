/* Speed reference on its way to the target: acceleration and jerk limited, exact on arrival.
 *
 * The acceleration is a whole number n of quanta j T and changes by one per period. The distance
 * needed to end it, n (n - 1)/2 j T^2, is therefore exact: each period takes the largest n that
 * still stops in time. From rest, or with enough distance left, the reference does not overshoot
 * the target. Electrical.
 */
#ifndef SPEED_RAMP_H
#define SPEED_RAMP_H

#include <stdbool.h>

#include "num.h"

typedef struct {
    float acceleration_rad_s2; /* of the reference */
    float jerk_rad_s3;         /* 0: no ramp except that of a stop, and that without jerk limit */
    float stop_rad_s2;         /* of a stop */
} speed_ramp_params_t;

typedef struct {
    bool on;
    float quantum_rad_s; /* j T^2 */
    float steps_max;     /* n of the acceleration */
    float stop_steps_max;
    float stop_step_rad_s; /* without jerk limit */
} speed_ramp_config_t;

typedef struct {
    float steps; /* n, whole */
} speed_ramp_state_t;

/* False, and *cfg untouched, for a number that is not finite or of the wrong sign, or a jerk that
 * gives no whole quantum (n below 1) or too many of them. */
CHECKED bool speed_ramp_init(speed_ramp_config_t *cfg, const speed_ramp_params_t *params,
                             float period_s);

/* The next reference after `from`. stop: at the deceleration of a stop. A target that is not finite
 * changes nothing. */
float speed_ramp_step(const speed_ramp_config_t *cfg, speed_ramp_state_t *st, float from_rad_s,
                      float target_rad_s, bool stop);

#endif
