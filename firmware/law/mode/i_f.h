/* I-f operation: a current vector of fixed length that rotates at the reference speed.
 *
 * It takes over when the field angle is lost: it needs no estimate, holds at zero stator frequency
 * and cannot run away. The rotor follows with the slip x tau, x + 1/x = p M kr I^2 / |T|, as long
 * as |T| < p M kr I^2 / 2. It starts along the measured current, so that nothing jumps. The vector
 * becomes shorter with speed, so that the flux M I leaves voltage for current control.
 *
 * The flux M I of a long vector saturates the motor: M is then well below the parameter, and an
 * estimator with that parameter does not find the rotor again. The stator equation does without M,
 * in the frame of the vector:
 *
 *   u - Rs i = j w (sigma Ls i + kr lambda)
 */
#ifndef I_F_H
#define I_F_H

#include <stdbool.h>
#include <stdint.h>

#include "frames.h"
#include "motor.h"

/* Looks at the flux of the stator equation: the first three hand back, the others only start the
 * estimate again. They end after 30 s, for the rotor may be locked: it lags by atan(w Tr), and
 * below 45 degrees that looks like one that follows. */
#define I_F_TRIES 3u
#define I_F_LOOKS (I_F_TRIES + 50u) /* .6 s each */

typedef struct {
    float current_A; /* power invariant; 0: never takes over */
    float slew_A_per_s;
    float slew_rad_s2;  /* of the frequency, electrical */
    float return_rad_s; /* above it the estimator runs, below the imposed speed counts */
    float timeout_s;    /* lost, and no rotor seen to follow, for this time above it: gives up */
} i_f_params_t;

typedef struct {
    float current_A;
    float step_A;
    float step_rad_s;
    float return_rad_s;
    uint32_t timeout_periods;
    uint32_t look_periods; /* lost for so long: the mean of the flux is the flux */
    float A_rad_s_per_V;   /* limits |i| w to this share of the dc link */
    float period_s;
    float mean_share; /* of the mean of the flux, per period */
    float Rs_ohm;     /* the parameter */
    float sigma_Ls_H;
    float inv_kr;
    float slip_ohm; /* kr Rr */
} i_f_config_t;

typedef struct {
    bool active;
    ab_t axis;
    float current_A;
    float omega_rad_s;
    ab_t flux_Wb; /* mean, relative to the vector */
    uint32_t lost_periods;
    uint32_t tries; /* looks at this flux since the last hand-back by the estimator */
} i_f_state_t;

typedef struct {
    float omega_ref_rad_s; /* electrical */
    float u_dc_V;
    bool lost; /* the supervisor still says so */
} i_f_in_t;

/* False for a number that is not finite or of the wrong sign. With current 0 nothing else is
 * checked. */
CHECKED bool i_f_init(i_f_config_t *cfg, const i_f_params_t *params, const motor_model_t *motor,
                      float period_s);

static inline bool i_f_on(const i_f_config_t *cfg)
{
    return cfg->current_A > 0.0f;
}

/* Takes over at the present current. */
void i_f_start(i_f_state_t *st, ab_t i_s_A, float omega_rad_s);

/* One period while active; true: gave up. */
bool i_f_step(const i_f_config_t *cfg, i_f_state_t *st, const i_f_in_t *in);

/* True when fast enough for the estimator to find the speed again. */
static inline bool i_f_observable(const i_f_config_t *cfg, const i_f_state_t *st)
{
    return absf(st->omega_rad_s) >= cfg->return_rad_s;
}

/* One period above the return frequency: what the stator equation says of the flux. u_s_V: less
 * what an Rs other than the parameter's takes. */
void i_f_see_flux(const i_f_config_t *cfg, i_f_state_t *st, ab_t u_s_V, ab_t i_s_A);

/* True when the estimator has not found the rotor in time, but the stator equation's flux shows a
 * rotor that follows: a flux of at least half of `nominal_Wb`, and a lag below the pull-out angle.
 * *flux_Wb (stationary frame) and the rotor's *omega_e_rad_s are then what to continue with. */
bool i_f_found(const i_f_config_t *cfg, const i_f_state_t *st, float nominal_Wb, ab_t *flux_Wb,
               float *omega_e_rad_s);

#endif
