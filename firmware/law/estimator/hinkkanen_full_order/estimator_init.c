#include "estimator.h"

#include <stddef.h>

/* Of the paper, per inductance; bandwidth of the adaptation: estimator_types.h. */
#define HINKKANEN_K0_PER_S        478.0f
#define HINKKANEN_BANDWIDTH_RAD_S 251.32741f

bool estimator_init(estimator_config_t *cfg, const params_t *params, const motor_model_t *motor,
                    const gain_table_t *table)
{
    (void)table;
    const float psi_Wb = motor->kr * params->M_H * params->i_d_A;
    const float kp = HINKKANEN_BANDWIDTH_RAD_S * motor->sigma_Ls_H / (psi_Wb * psi_Wb);
    *cfg = (estimator_config_t){.period_s = params->period_s,
                                .Rs_ohm = motor->Rs_ohm,
                                .Rr_gamma_ohm = motor->kr * motor->M_H * motor->tau_per_s,
                                .tau_per_s = motor->tau_per_s,
                                .a11_per_s = motor->a11_per_s,
                                .inv_sigma_Ls_per_H = 1.0f / motor->sigma_Ls_H,
                                .sigma_Ls_H = motor->sigma_Ls_H,
                                .kr = motor->kr,
                                .inv_kr = 1.0f / motor->kr,
                                .k0_ohm = HINKKANEN_K0_PER_S * motor->sigma_Ls_H,
                                .kp_rad_per_s_Wb_A = kp,
                                .omega_max_rad_s = params->omega_max_rad_s,
                                .psi_min_Wb = ESTIMATE_LAMBDA_MIN_PU * psi_Wb,
                                .psi_max_Wb = motor->kr * params->lambda_max_Wb};
    return ALL_POSITIVE(params->period_s, psi_Wb, kp, params->omega_max_rad_s,
                        params->lambda_max_Wb);
}

const gain_table_t *estimator_table(const estimator_config_t *cfg)
{
    (void)cfg;
    return NULL;
}
