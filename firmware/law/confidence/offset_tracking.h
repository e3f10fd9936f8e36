/* Offsets of the current sensors that move after their calibration: o' = -k e1 (tau + j w).
 *
 * In the stationary frame an offset stands still while all else turns. The current control keeps
 * the measured current free of it, so the true current has -o, at a frequency of zero. As with an
 * error of Rs there (rs_tracking.h), e1 = -o (tau - j w) Rs/(sigma Ls D), D real and positive with
 * the designed gains: turned back, e1 shows -o. With L = 0 it is e1 = -o: turned by 90 degrees at
 * speed, where the drive would swing. It is on with the gain table alone (unit_config_tracking.c).
 * What turns with the field is averaged out. Where the field turns slower than .6 Hz on average
 * over 1 s nothing tells the two apart, and what was found holds.
 */
#ifndef OFFSET_TRACKING_H
#define OFFSET_TRACKING_H

#include <stdbool.h>

#include "frames.h"
#include "motor.h"

typedef struct {
    bool on;
    float full_scale_A; /* of the current sensors */
} offset_tracking_params_t;

typedef struct {
    float gain_s;       /* k T; 0: off */
    float average_gain; /* of a step, in the average of w_s */
    float max_A;        /* nothing moves further, in either coordinate */
    float tau_per_s;
} offset_tracking_config_t;

/* Zero is the state of a field that stands. */
typedef struct {
    /* Average of w_s divided by .6 Hz, both within +-2; 0 after one that is not finite. */
    float turning;
} offset_tracking_state_t;

typedef struct {
    ab_t e1_A;
    float omega_e_hat_rad_s;
    float omega_s_hat_rad_s;
} offset_tracking_in_t;

/* The numbers are those that measurement, motor and schedule have accepted. */
void offset_tracking_init(offset_tracking_config_t *cfg, const offset_tracking_params_t *params,
                          const motor_model_t *motor, float step_s);

static inline bool offset_tracking_on(const offset_tracking_config_t *cfg)
{
    return cfg->gain_s > 0.0f;
}

/* How far the offsets have moved; moved_A: what the last step said. */
ab_t offset_tracking_step(const offset_tracking_config_t *cfg, offset_tracking_state_t *st,
                          ab_t moved_A, const offset_tracking_in_t *in);

#endif
