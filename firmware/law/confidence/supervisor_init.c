#include "supervisor.h"

/* Filter of w_s: a quarter in 3.2 ms. The noise of w_hat is faster. */
#define SUPERVISOR_OMEGA_S_PER_S 78.125f

/* Mean of the share of the time in which any speed explains what is measured. */
#define SUPERVISOR_STANDING_S 0.3f

/* The estimate of an oriented drive overshoots nominal flux by a smaller factor (M wrong by 15 %,
 * and a quarter on top). */
#define SUPERVISOR_FLUX_HIGH_PU 1.5f

/* Floor of the flux that errors are measured by. */
#define SUPERVISOR_FLUX_LOW_PU 0.05f

/* Longest time in schedules that a counter takes with room to spare. */
#define SUPERVISOR_MAX_SCHEDULES 1e9f

static bool params_valid(const supervisor_params_t *p)
{
    const bool uncertainty = ALL_NONNEGATIVE(p->Rs_uncertainty_pu, p->Rr_uncertainty_pu,
                                             p->i_uncertainty_pu, p->u_uncertainty_V);
    const bool residual = (p->residual_pu <= p->lost_pu) && is_finite(p->lost_pu);
    return ALL_POSITIVE(p->corner_rad_s, p->residual_pu, p->lambda_nominal_Wb,
                        p->omega_max_rad_s) &&
           uncertainty && residual &&
           ALL_NONNEGATIVE(p->confirm_s, p->return_s, p->still_rad_s, p->still_A, p->still_s);
}

bool supervisor_init(supervisor_config_t *cfg, const supervisor_params_t *params,
                     const motor_model_t *motor, float period_s)
{
    if (!params_valid(params) ||
        !ALL_POSITIVE(period_s, motor->kr, motor->eps_H, motor->tau_per_s, motor->M_H)) {
        return false;
    }
    const float schedule_s = (float)SLOT_COUNT * period_s;
    const float confirm = params->confirm_s / schedule_s;
    const float back = params->return_s / schedule_s;
    const float still = params->still_s / schedule_s;
    const float still_units = (float)SUPERVISOR_STILL_LIGHT * still;
    if (!(params->corner_rad_s * (float)SLOT_QUARTERS * period_s < 1.0f) ||
        !(maxf(maxf(confirm, back), still_units) < SUPERVISOR_MAX_SCHEDULES)) {
        return false;
    }
    *cfg = (supervisor_config_t){
        .p = *params,
        .kr_inv = 1.0f / motor->kr,
        .kT_s = period_s / motor->kr,
        .share = params->corner_rad_s * (float)SLOT_QUARTERS * period_s,
        .eps_H = motor->eps_H,
        .tau_per_s = motor->tau_per_s,
        .m_tau_ohm = motor->M_H * motor->tau_per_s,
        .corner2_rad2_s2 = params->corner_rad_s * params->corner_rad_s,
        .lambda_low_Wb = SUPERVISOR_FLUX_LOW_PU * params->lambda_nominal_Wb,
        .lambda_high_Wb = SUPERVISOR_FLUX_HIGH_PU * params->lambda_nominal_Wb,
        .omega_s_gain = minf(SUPERVISOR_OMEGA_S_PER_S * schedule_s, 1.0f),
        .standing_gain = schedule_s / (schedule_s + SUPERVISOR_STANDING_S),
        .confirm_schedules = (uint32_t)(confirm + 0.5f),
        .return_schedules = (uint32_t)(back + 0.5f),
        .still_units = SUPERVISOR_STILL_LIGHT * (uint32_t)(still + 0.5f),
    };
    return true;
}
