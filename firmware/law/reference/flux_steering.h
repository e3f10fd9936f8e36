/* Flux reference that keeps the stator frequency away from zero, where the speed is not observable.
 *
 * The slip Rr T/(p lambda^2) grows when the flux is reduced. If |w* + slip| at nominal flux would
 * be below w_min, the flux is reduced until the field rotates with w_min in the direction of the
 * torque: slip = w_min - w* sgn(T), lambda = sqrt(Rr |T| / (p slip)). Braking, where the field
 * has to pass zero, w* counts 1.25 times, as Rr may be less than known. Hysteresis and a fast
 * transition make the drive cross zero frequency without staying there. Where the flux may not
 * fall far enough for that, because of its floor or of the torque, it stays nominal.
 *
 * w* is the speed reference, or the estimated speed less .4 w_min where that lies further against
 * the torque. A load that drives pushes the shaft beyond its reference: steered by the reference
 * alone the field then stood at zero until the shaft was back (zh envelope).
 */
#ifndef FLUX_STEERING_H
#define FLUX_STEERING_H

#include <stdbool.h>

#include "motor.h"
#include "num.h"

typedef struct {
    float min_rad_s;        /* w_min; 0: off */
    float hysteresis_rad_s; /* steering ends where nominal flux turns faster than w_min + this */
    float lambda_nominal_Wb;
    float lambda_min_Wb;
    float torque_min_Nm;   /* steering begins above, and ends below half of it */
    float torque_filter_s; /* the flux follows with a quarter of this */
    float slew_Wb_per_s;
    float i_q_max_A; /* the flux stays high enough for the torque with this */
} flux_steering_params_t;

typedef struct {
    float min_rad_s; /* 0: off */
    float leave_rad_s;
    float lambda_nominal_Wb;
    float lambda_min_Wb;
    float torque_min_Nm;
    float slip_Wb2_per_Nm_s;         /* Rr/p: slip = this T / lambda^2 */
    float nominal_slip_per_Nm_s;     /* at nominal flux */
    float flux_per_torque_Wb_per_Nm; /* flux that i_q_max needs */
    float step_Wb;
    float filter_gain;
    float follow; /* share of the way that the flux goes in a step */
    float inv_period_per_s;
} flux_steering_config_t;

typedef struct {
    float torque_Nm;    /* filtered */
    float omega_rad_s;  /* the estimate, filtered as the torque */
    float reduction_Wb; /* nominal flux minus the reference, after the slew limit */
    bool steering;      /* hysteresis */
} flux_steering_state_t;

typedef struct {
    float reduction_Wb;  /* nominal flux minus the reference */
    float rate_Wb_per_s; /* of the reference */
    bool moving;         /* the slew limit is active */
} flux_steering_out_t;

/* False for a number that is not finite or of the wrong sign, or lambda_min above nominal. With
 * min_rad_s = 0 nothing else is checked. */
CHECKED bool flux_steering_init(flux_steering_config_t *cfg, const flux_steering_params_t *params,
                                const motor_model_t *motor, float period_s);

static inline bool flux_steering_on(const flux_steering_config_t *cfg)
{
    return cfg->min_rad_s > 0.0f;
}

/* omega_ref: electrical speed reference after its slew limit, in torque mode omega_rad_s of
 * the state; omega_hat: the estimate; torque: of the estimate, unfiltered. */
flux_steering_out_t flux_steering_step(const flux_steering_config_t *cfg, flux_steering_state_t *st,
                                       float omega_ref_rad_s, float omega_hat_rad_s,
                                       float torque_Nm);

#endif
