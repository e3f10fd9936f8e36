/* Rotor flux reference -> magnetising current: i_d = (lambda_ref + lambda_ref'/tau)/M.
 *
 * Plant lambda' = tau (M i_d - lambda): with the rate in i_d the flux follows its reference without
 * lag. The reference is M times the parameter's current, less what weakening, economy, steering and
 * dwelling take. There is no controller on |lambda_hat|: near zero frequency the estimate knows the
 * flux from this current alone.
 */
#ifndef FLUX_CONTROL_H
#define FLUX_CONTROL_H

#include <stdbool.h>

#include "motor.h"

typedef struct {
    float i_d_A; /* of nominal flux M i_d */
    float i_d_max_A;
} flux_control_params_t;

typedef struct {
    float i_d_A;
    float lambda_ref_Wb; /* nominal */
    float i_d_max_A;
    float inv_M_per_H;
    float inv_tau_s;
} flux_control_config_t;

/* False for a bad number, or i_d_A above i_d_max_A. */
CHECKED bool flux_control_init(flux_control_config_t *cfg, const flux_control_params_t *params,
                               const motor_model_t *motor);

/* What a flux of reduction_Wb below nominal, changing by rate_Wb_per_s, takes from i_d_A, in A; i_d
 * stays within 0..i_d_max_A. Need not be called every period. */
static inline float flux_control_reduction_A(const flux_control_config_t *cfg, float reduction_Wb,
                                             float rate_Wb_per_s)
{
    const float reduction_A = (reduction_Wb - rate_Wb_per_s * cfg->inv_tau_s) * cfg->inv_M_per_H;
    return clampf(reduction_A, cfg->i_d_A - cfg->i_d_max_A, cfg->i_d_A);
}

#endif
