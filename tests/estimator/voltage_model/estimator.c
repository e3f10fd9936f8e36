#include "estimator.h"

#include <math.h>
#include <stddef.h>

#define VOLTAGE_MODEL_CORNER_RAD_S 12.0f
#define VOLTAGE_MODEL_FILTER_S     0.005f

bool estimator_init(estimator_config_t *cfg, const params_t *params, const motor_model_t *motor,
                    const gain_table_t *table)
{
    (void)table;
    *cfg =
        (estimator_config_t){.period_s = params->period_s,
                             .Rs_ohm = motor->Rs_ohm,
                             .sigma_Ls_H = motor->sigma_Ls_H,
                             .kr = motor->kr,
                             .inv_kr = 1.0f / motor->kr,
                             .m_tau_ohm = motor->M_H * motor->tau_per_s,
                             .tau_per_s = motor->tau_per_s,
                             .omega_max_rad_s = params->omega_max_rad_s,
                             .lambda_min_Wb = ESTIMATE_LAMBDA_MIN_PU * params->M_H * params->i_d_A,
                             .lambda_max_Wb = params->lambda_max_Wb};
    return positivef(cfg->period_s) && positivef(cfg->omega_max_rad_s) &&
           positivef(cfg->lambda_min_Wb) && positivef(cfg->lambda_max_Wb);
}

const gain_table_t *estimator_table(const estimator_config_t *cfg)
{
    (void)cfg;
    return NULL;
}

/* Both models over the interval that ended; how fast their flux turns, and how fast it slips. */
static float advance(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in,
                     float *slip_rad_s)
{
    estimate_t *e = &st->estimate;
    const ab_t i_A = ab_scale(ab_add(in->i_s_A, st->i_before_A), 0.5f);
    const ab_t g_per_s = {cfg->tau_per_s, -e->omega_e_rad_s};
    const ab_t slow_V = ab_sub(ab_scale(i_A, cfg->m_tau_ohm), ab_mul(g_per_s, st->slow_Wb));
    st->slow_Wb =
        ab_limited(ab_add(st->slow_Wb, ab_scale(slow_V, cfg->period_s)), cfg->lambda_max_Wb);
    const ab_t of_slow_Wb =
        ab_add(ab_scale(st->slow_Wb, cfg->kr), ab_scale(in->i_s_A, cfg->sigma_Ls_H));
    const ab_t held_V = ab_scale(ab_sub(of_slow_Wb, st->psi_s_Wb), VOLTAGE_MODEL_CORNER_RAD_S);
    const ab_t rate_V = ab_add(ab_sub(in->u_s_V, ab_scale(i_A, cfg->Rs_ohm)), held_V);
    st->psi_s_Wb = ab_limited(ab_add(st->psi_s_Wb, ab_scale(rate_V, cfg->period_s)),
                              2.0f * cfg->lambda_max_Wb);
    st->i_before_A = in->i_s_A;

    const ab_t before_Wb = e->lambda_r_hat_Wb;
    const ab_t lambda_Wb =
        ab_scale(ab_sub(st->psi_s_Wb, ab_scale(in->i_s_A, cfg->sigma_Ls_H)), cfg->inv_kr);
    e->lambda_r_hat_Wb = ab_limited(lambda_Wb, cfg->lambda_max_Wb);
    e->lambda_Wb = sqrtf(ab_norm2(e->lambda_r_hat_Wb));
    const float base_Wb = maxf(e->lambda_Wb, cfg->lambda_min_Wb);
    const float inv_Wb2 = 1.0f / (base_Wb * base_Wb);
    *slip_rad_s = cfg->m_tau_ohm * ab_cross(e->lambda_r_hat_Wb, in->i_s_A) * inv_Wb2;
    return ab_cross(before_Wb, e->lambda_r_hat_Wb) * inv_Wb2 / cfg->period_s;
}

void estimator_step(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in)
{
    estimate_t *e = &st->estimate;
    float slip_rad_s = 0.0f;
    const float omega_s_rad_s = advance(cfg, st, in, &slip_rad_s);
    const float share = cfg->period_s / (cfg->period_s + VOLTAGE_MODEL_FILTER_S);
    const float omega_e_rad_s =
        e->omega_e_rad_s + share * (omega_s_rad_s - slip_rad_s - e->omega_e_rad_s);
    e->omega_e_rad_s = limitf(omega_e_rad_s, cfg->omega_max_rad_s);
    e->omega_s_rad_s = in->frame_imposed ? in->omega_frame_rad_s : (e->omega_e_rad_s + slip_rad_s);
}

void estimator_hold(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in,
                    float omega_e_rad_s)
{
    float slip_rad_s = 0.0f;
    st->estimate.omega_e_rad_s = omega_e_rad_s;
    (void)advance(cfg, st, in, &slip_rad_s);
    st->estimate.omega_s_rad_s = omega_e_rad_s;
}

void estimator_off(estimator_state_t *st, ab_t i_s_A, float omega_e_rad_s)
{
    *st = (estimator_state_t){
        .estimate = {.omega_e_rad_s = omega_e_rad_s, .omega_s_rad_s = omega_e_rad_s},
        .i_before_A = i_s_A};
}

void estimator_seed(const estimator_config_t *cfg, estimator_state_t *st,
                    const estimator_seed_t *seed)
{
    estimator_off(st, seed->i_s_A, seed->omega_e_rad_s);
    const ab_t lambda_Wb = ab_limited(seed->lambda_r_Wb, cfg->lambda_max_Wb);
    st->estimate.lambda_r_hat_Wb = lambda_Wb;
    st->estimate.lambda_Wb = sqrtf(ab_norm2(lambda_Wb));
    st->slow_Wb = lambda_Wb;
    st->psi_s_Wb = ab_add(ab_scale(lambda_Wb, cfg->kr), ab_scale(seed->i_s_A, cfg->sigma_Ls_H));
}
