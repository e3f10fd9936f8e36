/* Rotor flux reference -> magnetising current: i_d = (lambda_ref + lambda_ref'/tau)/M, constant
 * with the reference, or a PI on |lambda_hat|.
 *
 * Plant lambda' = tau (M i_d - lambda). Kp = bw/(tau M), Ki = tau Kp: the zero cancels the pole,
 * and lambda follows its reference as 1/(1 + s/bw). The PI has no feed-forward: during a limited
 * build-up from zero the integrator also stays at lambda/M, and the flux does not overshoot.
 */
#ifndef FLUX_CONTROL_H
#define FLUX_CONTROL_H

#include <stdbool.h>

#include "motor.h"
#include "pi.h"

typedef enum {
    FLUX_CONTROL_CONSTANT = 0,
    FLUX_CONTROL_PI = 1
} flux_control_mode_t;

typedef struct {
    flux_control_mode_t mode;
    float i_d_A;           /* constant mode's current; flux reference is M i_d in both */
    float bandwidth_rad_s; /* of the flux loop */
    float i_d_max_A;
} flux_control_params_t;

typedef struct {
    flux_control_mode_t mode;
    float i_d_A;
    float lambda_ref_Wb;
    float i_d_max_A;
    float inv_M_per_H;
    float inv_tau_s;
    pi_config_t pi;
} flux_control_config_t;

typedef struct {
    pi_state_t pi;
} flux_control_state_t;

/* False for an unknown mode, a bad number, or i_d_A above i_d_max_A. */
CHECKED bool flux_control_init(flux_control_config_t *cfg, const flux_control_params_t *params,
                               const motor_model_t *motor, float period_s);

typedef struct {
    float lambda_hat_Wb;
    float reduction_Wb; /* the reference is this much below M i_d (flux_steering) */
    float reduction_A;  /* constant mode: of i_d, from flux_control_i_d_reduction_A */
} flux_control_in_t;

/* (reduction - rate/tau)/M: the flux follows M i_d with the lag 1/tau, which the rate compensates.
 * Need not be called every period. */
static inline float flux_control_reduction_A(const flux_control_config_t *cfg, float reduction_Wb,
                                             float rate_Wb_per_s)
{
    const float reduction_A = (reduction_Wb - rate_Wb_per_s * cfg->inv_tau_s) * cfg->inv_M_per_H;
    return clampf(reduction_A, cfg->i_d_A - cfg->i_d_max_A, cfg->i_d_A);
}

float flux_control_pi(const flux_control_config_t *cfg, flux_control_state_t *st,
                      const flux_control_in_t *in);

/* i_d reference in A, 0..i_d_max. */
static inline float flux_control_step(const flux_control_config_t *cfg, flux_control_state_t *st,
                                      const flux_control_in_t *in)
{
    return (cfg->mode == FLUX_CONTROL_CONSTANT) ? (cfg->i_d_A - in->reduction_A)
                                                : flux_control_pi(cfg, st, in);
}

#endif
