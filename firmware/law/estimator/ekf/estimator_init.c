#include "estimator.h"

/* The states' bound, over the board's full scale. */
#define EKF_I_MAX_PU 2.0f

/* Deviation of the current sensor's noise, over its full scale: 25 mA of 25 A. */
#define EKF_CURRENT_NOISE_PU 1e-3f

/* Deviation of the voltage between what is believed and what acts, over the sensor's full scale:
 * 1 V of 400 V, what a compensated inverter still loses. */
#define EKF_VOLTAGE_NOISE_PU 2.5e-3f

/* Deviation of the unknown acceleration, over the largest that the torque current makes: the rule's
 * range is 0.5 to 1. */
#define EKF_ACCELERATION_PU 1.0f

/* What a seed may be wrong by: flux over the nominal one, speed over Rr/Lr. */
#define EKF_SEED_FLUX_PU   0.1f
#define EKF_SEED_SPEED_TAU 1.0f

/* Change of the speed in a period with the largest torque current. */
static float largest_step_rad_s(const params_t *p, const motor_model_t *motor)
{
    const float lambda_Wb = motor->M_H * p->i_d_A;
    const float torque_Nm = motor_torque_Nm(motor, lambda_Wb, p->i_q_max_A);
    return motor->pole_pairs * torque_Nm / p->speed_J_kg_m2 * p->period_s;
}

static float square(float x)
{
    return x * x;
}

static void init_covariances(estimator_config_t *cfg, const params_t *p, const motor_model_t *motor)
{
    const float noise_V = EKF_VOLTAGE_NOISE_PU * p->line_voltage_full_scale_V;
    cfg->R_A2 = square(EKF_CURRENT_NOISE_PU * p->current_full_scale_A);
    cfg->Q =
        (covariance_noise_t){.current = square(p->period_s * cfg->inv_sigma_Ls_per_H * noise_V),
                             .flux = square(p->period_s * noise_V),
                             .speed = square(EKF_ACCELERATION_PU * largest_step_rad_s(p, motor))};
    cfg->seed = (covariance_noise_t){.current = cfg->R_A2,
                                     .flux = square(EKF_SEED_FLUX_PU * motor->M_H * p->i_d_A),
                                     .speed = square(EKF_SEED_SPEED_TAU * motor->tau_per_s)};
}

bool estimator_init(estimator_config_t *cfg, const params_t *params, const motor_model_t *motor,
                    const gain_table_t *table)
{
    (void)table;
    *cfg = (estimator_config_t){
        .period_s = params->period_s,
        .inv_period_Hz = 1.0f / params->period_s,
        .a11_per_s = motor->a11_per_s,
        .tau_per_s = motor->tau_per_s,
        .inv_eps_per_H = 1.0f / motor->eps_H,
        .m_tau_ohm = motor->M_H * motor->tau_per_s,
        .inv_sigma_Ls_per_H = 1.0f / motor->sigma_Ls_H,
        .i_max_A = EKF_I_MAX_PU * params->current_full_scale_A,
        .lambda_min_Wb = ESTIMATE_LAMBDA_MIN_PU * motor->M_H * params->i_d_A,
        .lambda_max_Wb = params->lambda_max_Wb,
        .omega_max_rad_s = params->omega_max_rad_s,
    };
    init_covariances(cfg, params, motor);
    return ALL_POSITIVE(cfg->period_s, cfg->i_max_A, cfg->lambda_min_Wb, cfg->lambda_max_Wb,
                        cfg->omega_max_rad_s, params->line_voltage_full_scale_V,
                        largest_step_rad_s(params, motor)) &&
           (cfg->a11_per_s * cfg->period_s < 1.0f);
}
