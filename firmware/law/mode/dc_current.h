/* Direct current against any back-EMF: needs no angle and no speed.
 *
 * The current gives the EMF of the interval that ended: e = u - Rs i - sigma Ls di/dt. It is fed
 * forward, rotated to the middle of the interval in which the next duties act (two periods later).
 * So a spinning, magnetised motor does not trip even in the first period. Stationary frame: u = e
 * exp(2 j w T) + Rs i_ref + bw sigma Ls (i_ref - i).
 */
#ifndef DC_CURRENT_H
#define DC_CURRENT_H

#include <stdbool.h>

#include "frames.h"
#include "motor.h"

typedef struct {
    float kp_ohm;
    float sigma_Ls_per_T_ohm;
    float period_s;
} dc_current_config_t;

typedef struct {
    ab_t i_before_A;
    ab_t e_V; /* back-EMF, mean of the interval that ended */
} dc_current_state_t;

typedef struct {
    ab_t i_ref_A;
    ab_t i_A; /* sampled now */
    ab_t u_V; /* mean of the interval that ended */
    float Rs_ohm;
    float omega_rad_s; /* angular speed of the EMF, as far as known */
} dc_current_in_t;

/* False for a number that is not finite and positive. */
CHECKED bool dc_current_init(dc_current_config_t *cfg, float bandwidth_rad_s,
                             const motor_model_t *motor, float period_s);

/* Voltage reference. The state of the first period is zero: the gates were off. */
COLD ab_t dc_current_step(const dc_current_config_t *cfg, dc_current_state_t *st,
                          const dc_current_in_t *in);

#endif
