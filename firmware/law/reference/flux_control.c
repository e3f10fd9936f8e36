#include "flux_control.h"

bool flux_control_init(flux_control_config_t *cfg, const flux_control_params_t *params,
                       const motor_model_t *motor, float period_s)
{
    /* Plant lambda' = tau (M i_d - lambda): the zero Ki/Kp = tau cancels its pole, which leaves
     * the open loop bw/s. */
    const float ki_per_s = params->bandwidth_rad_s / motor->M_H;
    const float kp = ki_per_s / motor->tau_per_s;
    flux_control_config_t c = {
        .mode = params->mode,
        .i_d_A = params->i_d_A,
        .lambda_ref_Wb = motor->M_H * params->i_d_A,
        .i_d_max_A = params->i_d_max_A,
        .inv_M_per_H = 1.0f / motor->M_H,
        .inv_tau_s = 1.0f / motor->tau_per_s,
    };

    if ((params->mode != FLUX_CONTROL_CONSTANT) && (params->mode != FLUX_CONTROL_PI)) {
        return false;
    }
    /* A negative M and bandwidth would make a positive gain. */
    if (!ALL_POSITIVE(params->i_d_A, motor->M_H) || !(params->i_d_A <= params->i_d_max_A) ||
        !pi_init(&c.pi, kp, ki_per_s, params->i_d_max_A, period_s)) {
        return false;
    }
    *cfg = c;
    return true;
}

float flux_control_pi(const flux_control_config_t *cfg, flux_control_state_t *st,
                      const flux_control_in_t *in)
{
    const float lambda_err_Wb = cfg->lambda_ref_Wb - in->reduction_Wb - in->lambda_hat_Wb;
    const float asked_A = pi_output(&cfg->pi, &st->pi, lambda_err_Wb);
    const float i_d_ref_A = clampf(asked_A, 0.0f, cfg->i_d_max_A);
    pi_update(&cfg->pi, &st->pi, lambda_err_Wb, i_d_ref_A - asked_A);
    return i_d_ref_A;
}
