#include "flux_control.h"

bool flux_control_init(flux_control_config_t *cfg, const flux_control_params_t *params,
                       const motor_model_t *motor)
{
    if (!ALL_POSITIVE(params->i_d_A, params->i_d_max_A, motor->M_H, motor->tau_per_s) ||
        !(params->i_d_A <= params->i_d_max_A)) {
        return false;
    }
    *cfg = (flux_control_config_t){
        .i_d_A = params->i_d_A,
        .lambda_ref_Wb = motor->M_H * params->i_d_A,
        .i_d_max_A = params->i_d_max_A,
        .inv_M_per_H = 1.0f / motor->M_H,
        .inv_tau_s = 1.0f / motor->tau_per_s,
    };
    return true;
}
