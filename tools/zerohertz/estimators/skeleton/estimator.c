#include "estimator.h"

#include <math.h>
#include <stddef.h>

bool estimator_init(estimator_config_t *cfg, const params_t *params, const motor_model_t *motor,
                    const gain_table_t *table)
{
    (void)table;
    *cfg = (estimator_config_t){.motor = *motor,
                                .period_s = params->period_s,
                                .lambda_ref_Wb = params->M_H * params->i_d_A,
                                .omega_max_rad_s = params->omega_max_rad_s,
                                .filter_s = params->my_observer_filter_s,
                                .gain_per_s = params->my_observer_gain_per_s};
    return positivef(cfg->period_s) && positivef(cfg->lambda_ref_Wb) &&
           positivef(cfg->omega_max_rad_s);
}

const gain_table_t *estimator_table(const estimator_config_t *cfg)
{
    (void)cfg;
    return NULL;
}

/* The new flux; the slip that goes with it and the current. */
static float take(const estimator_config_t *cfg, estimator_state_t *st, ab_t lambda_Wb, ab_t i_A)
{
    estimate_t *e = &st->estimate;
    e->lambda_r_hat_Wb = ab_limited(lambda_Wb, 2.0f * cfg->lambda_ref_Wb);
    e->lambda_Wb = sqrtf(ab_norm2(e->lambda_r_hat_Wb));
    st->i_before_A = i_A;
    const float base_Wb = maxf(e->lambda_Wb, ESTIMATE_LAMBDA_MIN_PU * cfg->lambda_ref_Wb);
    return cfg->motor.M_H * cfg->motor.tau_per_s * ab_cross(e->lambda_r_hat_Wb, i_A) /
           (base_Wb * base_Wb);
}

void estimator_step(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in)
{
    const motor_model_t *m = &cfg->motor;
    estimate_t *e = &st->estimate;
    const ab_t i_A = ab_scale(ab_add(in->i_s_A, st->i_before_A), 0.5f);
    const ab_t u_V = ab_sub(in->u_s_V, ab_scale(i_A, m->Rs_ohm));
    const ab_t leak_Wb = ab_scale(ab_sub(in->i_s_A, st->i_before_A), m->sigma_Ls_H);
    const ab_t step_Wb = ab_scale(ab_sub(ab_scale(u_V, cfg->period_s), leak_Wb), 1.0f / m->kr);
    const float base_Wb = maxf(e->lambda_Wb, ESTIMATE_LAMBDA_MIN_PU * cfg->lambda_ref_Wb);
    const float omega_s_rad_s =
        ab_cross(e->lambda_r_hat_Wb, step_Wb) / (base_Wb * base_Wb * cfg->period_s);
    const float hold = cfg->period_s * cfg->gain_per_s * (cfg->lambda_ref_Wb / base_Wb - 1.0f);
    const ab_t lambda_Wb = ab_add(ab_scale(e->lambda_r_hat_Wb, 1.0f + hold), step_Wb);
    const float slip_rad_s = take(cfg, st, lambda_Wb, in->i_s_A);
    const float share = cfg->period_s / (cfg->period_s + cfg->filter_s);
    e->omega_e_rad_s += share * (omega_s_rad_s - slip_rad_s - e->omega_e_rad_s);
    e->omega_e_rad_s = limitf(e->omega_e_rad_s, cfg->omega_max_rad_s);
    e->omega_s_rad_s = in->frame_imposed ? in->omega_frame_rad_s : e->omega_e_rad_s + slip_rad_s;
}

/* The speed is known: the current model, lambda' = M/Tr i - (1/Tr - j w) lambda. */
void estimator_hold(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in,
                    float omega_e_rad_s)
{
    const motor_model_t *m = &cfg->motor;
    estimate_t *e = &st->estimate;
    const ab_t decay_per_s = {m->tau_per_s, -omega_e_rad_s};
    const ab_t rate_V =
        ab_sub(ab_scale(in->i_s_A, m->M_H * m->tau_per_s), ab_mul(decay_per_s, e->lambda_r_hat_Wb));
    const ab_t lambda_Wb = ab_add(e->lambda_r_hat_Wb, ab_scale(rate_V, cfg->period_s));
    (void)take(cfg, st, lambda_Wb, in->i_s_A);
    e->omega_e_rad_s = omega_e_rad_s;
    e->omega_s_rad_s = omega_e_rad_s;
}

void estimator_off(estimator_state_t *st, ab_t i_s_A, float omega_e_rad_s)
{
    *st = (estimator_state_t){.i_before_A = i_s_A};
    st->estimate.omega_e_rad_s = omega_e_rad_s;
    st->estimate.omega_s_rad_s = omega_e_rad_s;
}

void estimator_seed(const estimator_config_t *cfg, estimator_state_t *st,
                    const estimator_seed_t *seed)
{
    estimator_off(st, seed->i_s_A, seed->omega_e_rad_s);
    (void)take(cfg, st, seed->lambda_r_Wb, seed->i_s_A);
}
