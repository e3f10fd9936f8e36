#include "estimator.h"

#include <stddef.h>

/* Poles of the adaptation and of the high-pass. Of 245 points of `zh atlas --map i` without flux
 * steering 100 and 20 rad/s hold 234, 125 and 25 231, 100 and 10 181. 60 and 15 hold 238, but lose
 * an acceleration at the torque limit, where the flux lags by dw/dt over the square of the pole. */
#define MRAS_POLE_RAD_S      100.0f
#define MRAS_HIGH_PASS_RAD_S 20.0f

bool estimator_init(estimator_config_t *cfg, const params_t *params, const motor_model_t *motor,
                    const gain_table_t *table)
{
    (void)table;
    const float lambda_Wb = params->M_H * params->i_d_A;
    const float share = motor->tau_per_s * params->period_s;
    const float pole_rad_s_Wb2 = MRAS_POLE_RAD_S / (lambda_Wb * lambda_Wb);
    *cfg = (estimator_config_t){.period_s = params->period_s,
                                .Rs_ohm = motor->Rs_ohm,
                                .sigma_Ls_H = motor->sigma_Ls_H,
                                .inv_kr = 1.0f / motor->kr,
                                .m_tau_ohm = motor->M_H * motor->tau_per_s,
                                .decay = 1.0f - share + 0.5f * share * share,
                                .high_pass_gain = MRAS_HIGH_PASS_RAD_S * params->period_s,
                                .kp_rad_per_s_Wb2 = 2.0f * pole_rad_s_Wb2,
                                .ki_T_rad_per_s_Wb2 =
                                    pole_rad_s_Wb2 * MRAS_POLE_RAD_S * params->period_s,
                                .omega_max_rad_s = params->omega_max_rad_s,
                                .lambda_min_Wb = ESTIMATE_LAMBDA_MIN_PU * lambda_Wb,
                                .lambda_max_Wb = params->lambda_max_Wb};
    return ALL_POSITIVE(params->period_s, lambda_Wb, pole_rad_s_Wb2, params->omega_max_rad_s,
                        params->lambda_max_Wb);
}

const gain_table_t *estimator_table(const estimator_config_t *cfg)
{
    (void)cfg;
    return NULL;
}
