#include "estimator.h"

#include <stddef.h>

/* Crossover: 10 Hz. */
#define HYBRID_CORNER_RAD_S 62.831853f

/* Filter of the speed. Of 245 points of `zh atlas --map i` 2 ms orient 177, 5 ms 223, 8 ms 224, and
 * with 8 ms more runs need the I-f take-over. */
#define HYBRID_FILTER_S 0.005f

bool estimator_init(estimator_config_t *cfg, const params_t *params, const motor_model_t *motor,
                    const gain_table_t *table)
{
    (void)table;
    const float lambda_Wb = params->M_H * params->i_d_A;
    *cfg =
        (estimator_config_t){.period_s = params->period_s,
                             .Rs_ohm = motor->Rs_ohm,
                             .sigma_Ls_H = motor->sigma_Ls_H,
                             .kr = motor->kr,
                             .inv_kr = 1.0f / motor->kr,
                             .m_tau_ohm = motor->M_H * motor->tau_per_s,
                             .tau_per_s = motor->tau_per_s,
                             .corner_per_s = HYBRID_CORNER_RAD_S,
                             .speed_share = params->period_s / (params->period_s + HYBRID_FILTER_S),
                             .omega_max_rad_s = params->omega_max_rad_s,
                             .lambda_min_Wb = ESTIMATE_LAMBDA_MIN_PU * lambda_Wb,
                             .lambda_max_Wb = params->lambda_max_Wb};
    return ALL_POSITIVE(params->period_s, lambda_Wb, params->omega_max_rad_s,
                        params->lambda_max_Wb);
}

const gain_table_t *estimator_table(const estimator_config_t *cfg)
{
    (void)cfg;
    return NULL;
}
