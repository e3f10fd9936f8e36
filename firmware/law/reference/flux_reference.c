#include "flux_reference.h"

#include <math.h>

/* A deviation of the flux up to this may be noise of the torque. */
#define FLUX_REFERENCE_NEAR_PU 0.1f

/* Flux that is there counts up to this share of what the voltage allows. After a sag of the dc link
 * there is more: with .7, the share at pull-out, the currents then took more voltage than there was
 * (zh modes). */
#define FLUX_REFERENCE_THERE_PU 0.5f

/* A full link takes this share of the voltage from the flux at most. With half of the flux a torque
 * needs twice the current: more would leave no current to brake with. */
#define FLUX_REFERENCE_FULL_PU 0.5f
#define FLUX_REFERENCE_FULL_S  2.0f /* time constant of giving it back */

static bool params_valid(const flux_reference_params_t *p)
{
    const bool shares = ALL_NONNEGATIVE(p->voltage_share, p->economy_from_rad_s) &&
                        (p->voltage_share <= 1.0f) && (p->pull_out_share <= 1.0f) &&
                        (p->economy_min_pu <= 1.0f);
    const bool lowest = is_zero(p->economy_min_pu) ||
                        (p->economy_min_pu * p->lambda_nominal_Wb >= p->lambda_min_Wb);
    return shares && lowest && (p->lambda_min_Wb <= p->lambda_nominal_Wb) &&
           ALL_POSITIVE(p->bandwidth_rad_s, p->pull_out_share, p->economy_filter_s,
                        p->economy_slew_Wb_per_s, p->lambda_nominal_Wb, p->lambda_min_Wb,
                        p->i_q_max_A);
}

bool flux_reference_init(flux_reference_config_t *cfg, const flux_reference_params_t *params,
                         const motor_model_t *motor, float period_s)
{
    *cfg = (flux_reference_config_t){0};
    if (is_zero(params->voltage_share) && is_zero(params->economy_min_pu)) {
        return true;
    }
    const float kr = motor->kr;
    const float Ls_H = motor->sigma_Ls_H + kr * motor->M_H;
    const float rotor_ohm = kr * motor->M_H * motor->tau_per_s; /* kr^2 Rr */
    const float economy_Wb2_per_Nm =
        motor->M_H / (motor->pole_pairs * kr) * sqrtf(1.0f + rotor_ohm / motor->Rs_ohm);
    if (!params_valid(params) || !ALL_POSITIVE(period_s, economy_Wb2_per_Nm)) {
        return false;
    }
    *cfg = (flux_reference_config_t){
        .voltage_share = NUM_SQRT_1_2 * params->voltage_share,
        .economy_min_Wb = params->economy_min_pu * params->lambda_nominal_Wb,
        .economy_Wb2_per_Nm = is_zero(params->economy_min_pu) ? 0.0f : economy_Wb2_per_Nm,
        .economy_from_rad_s = params->economy_from_rad_s,
        .economy_gain = period_s / (period_s + params->economy_filter_s),
        .economy_step_Wb = params->economy_slew_Wb_per_s * period_s,
        .gain_Wb_rad_s_per_V = params->bandwidth_rad_s * period_s / kr,
        .lambda_nominal_Wb = params->lambda_nominal_Wb,
        .reduction_max_Wb = params->lambda_nominal_Wb - params->lambda_min_Wb,
        /* sigma Ls i_q = share Ls i_d, i_d = lambda/M. */
        .i_q_per_Wb_A = params->pull_out_share * Ls_H / (motor->sigma_Ls_H * motor->M_H),
        .i_q_max_A = params->i_q_max_A,
        .inv_period_per_s = 1.0f / period_s,
        .full_keep = 1.0f - period_s / FLUX_REFERENCE_FULL_S,
    };
    return true;
}

/* Below this frequency no weakening is ever needed, and nothing has to be divided by less: twice
 * the nominal flux would still fit. */
static float at_least(const flux_reference_config_t *cfg, float omega_s_rad_s, float u_max_V)
{
    return maxf(absf(omega_s_rad_s), 0.5f * u_max_V / cfg->lambda_nominal_Wb);
}

/* Where economy lowers the flux further, the voltage is scaled to the flux weakening allows: its
 * controller is then right when a torque step gives the flux back. */
static void weaken(const flux_reference_config_t *cfg, flux_reference_state_t *st,
                   const flux_reference_in_t *in, float u_max_V, float omega_s_rad_s)
{
    const float allowed_Wb = cfg->lambda_nominal_Wb - st->weakened_Wb;
    const float lambda_Wb = minf(allowed_Wb, cfg->lambda_nominal_Wb - st->economy_Wb);
    const float u_V = in->u_V * (allowed_Wb / lambda_Wb);
    const float change_Wb = cfg->gain_Wb_rad_s_per_V * (u_V - u_max_V) / omega_s_rad_s;
    if (is_finite(change_Wb)) {
        st->weakened_Wb = clampf(st->weakened_Wb + change_Wb, 0.0f, cfg->reduction_max_Wb);
    }
}

/* Slowly down, quickly up: a torque step finds its flux again. */
static void economise(const flux_reference_config_t *cfg, flux_reference_state_t *st,
                      const flux_reference_in_t *in)
{
    if (!is_finite(in->omega_s_rad_s + in->torque_Nm)) {
        return;
    }
    float lambda_Wb = cfg->lambda_nominal_Wb;
    if (absf(in->omega_s_rad_s) > cfg->economy_from_rad_s) {
        lambda_Wb = clampf(sqrtf(cfg->economy_Wb2_per_Nm * absf(in->torque_Nm)),
                           cfg->economy_min_Wb, cfg->lambda_nominal_Wb);
    }
    const float change_Wb = cfg->lambda_nominal_Wb - lambda_Wb - st->economy_Wb;
    const bool step = change_Wb < -FLUX_REFERENCE_NEAR_PU * cfg->lambda_nominal_Wb;
    st->economy_Wb +=
        step ? maxf(change_Wb, -cfg->economy_step_Wb) : (cfg->economy_gain * change_Wb);
}

void flux_reference_step(const flux_reference_config_t *cfg, flux_reference_state_t *st,
                         const flux_reference_in_t *in)
{
    if (cfg->economy_Wb2_per_Nm > 0.0f) {
        economise(cfg, st, in);
    } else {
        st->economy_Wb = 0.0f; /* switched off while it acted */
    }
    /* Neither a number that is not finite nor a flipped bit stays. */
    st->full_pu = minf(maxf(cfg->full_keep * st->full_pu, in->full_pu), FLUX_REFERENCE_FULL_PU);
    const float u_max_V = cfg->voltage_share * (1.0f - st->full_pu) * in->u_dc_V;
    const float omega_s_rad_s = at_least(cfg, in->omega_s_rad_s, u_max_V);
    if (cfg->voltage_share > 0.0f) {
        weaken(cfg, st, in, u_max_V, omega_s_rad_s);
    } else {
        st->weakened_Wb = 0.0f;
    }
    const float reduction_Wb = maxf(st->weakened_Wb, st->economy_Wb);
    st->rate_Wb_per_s = (st->reduction_Wb - reduction_Wb) * cfg->inv_period_per_s;
    st->reduction_Wb = reduction_Wb;
    /* With weakening off u_max is 0, and what was asked for counts; at standstill 0/0 leaves the
     * estimate. */
    const float there_Wb = minf(FLUX_REFERENCE_THERE_PU * u_max_V / omega_s_rad_s, in->lambda_Wb);
    const float i_q_A = cfg->i_q_per_Wb_A * maxf(there_Wb, cfg->lambda_nominal_Wb - reduction_Wb);
    st->i_q_reduction_A = maxf(cfg->i_q_max_A - i_q_A, 0.0f);
}

void flux_reference_start(const flux_reference_config_t *cfg, flux_reference_state_t *st,
                          float omega_s_rad_s, float u_dc_V)
{
    *st = (flux_reference_state_t){0};
    const float room_Wb = cfg->voltage_share * u_dc_V / maxf(absf(omega_s_rad_s), 1.0f);
    if (cfg->voltage_share > 0.0f) {
        st->weakened_Wb = clampf(cfg->lambda_nominal_Wb - room_Wb, 0.0f, cfg->reduction_max_Wb);
        st->reduction_Wb = st->weakened_Wb;
    }
}
