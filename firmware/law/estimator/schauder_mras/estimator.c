#include "estimator.h"

#include <math.h>

#include "trig.h"

/* Adjustable model over the interval that ended, exact for a constant speed and a current that
 * changes linearly up to terms of third order. Euler would be unstable from 220 rad/s on. */
static void adjust(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in,
                   float omega_e_rad_s)
{
    const ab_t filtered_Wb = ab_sub(st->adjustable_Wb, st->slow_Wb);
    st->slow_Wb = ab_add(st->slow_Wb, ab_scale(filtered_Wb, cfg->high_pass_gain));

    const float decay = cfg->decay - cfg->period_s * in->tau_extra_per_s;
    const ab_t turn = ab_scale(trig_ahead(omega_e_rad_s, cfg->period_s), decay);
    const float half_V_s = 0.5f * cfg->period_s * cfg->m_tau_ohm;
    const ab_t before_Wb = ab_add(st->adjustable_Wb, ab_scale(st->i_before_A, half_V_s));
    const ab_t lambda_Wb = ab_add(ab_mul(turn, before_Wb), ab_scale(in->i_s_A, half_V_s));
    st->adjustable_Wb = ab_limited(lambda_Wb, cfg->lambda_max_Wb);
}

/* Flux F of the reference model. Both high-passes take what they pass at the start of the interval,
 * so that they turn both fluxes alike. */
static ab_t reference(const estimator_config_t *cfg, estimator_state_t *st,
                      const estimator_in_t *in)
{
    const ab_t i_A = ab_scale(ab_add(st->i_before_A, in->i_s_A), 0.5f);
    const ab_t emf_Wb = ab_scale(ab_sub(in->u_s_V, ab_scale(i_A, cfg->Rs_ohm)), cfg->period_s);
    const ab_t filtered_Wb = ab_sub(st->y_Wb, ab_scale(st->i_before_A, cfg->sigma_Ls_H));
    const ab_t change_Wb = ab_sub(emf_Wb, ab_scale(filtered_Wb, cfg->high_pass_gain));
    st->y_Wb = ab_limited(ab_add(st->y_Wb, change_Wb), 2.0f * cfg->lambda_max_Wb);
    return ab_scale(ab_sub(st->y_Wb, ab_scale(in->i_s_A, cfg->sigma_Ls_H)), cfg->inv_kr);
}

/* Both models and the flux estimate over the interval that ended. Returns z: how far the reference
 * model's flux is ahead of the adjustable model's. */
static float advance(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in)
{
    estimate_t *e = &st->estimate;
    adjust(cfg, st, in, e->omega_e_rad_s + in->slip_extra_rad_s);
    const ab_t reference_Wb = reference(cfg, st, in);
    st->i_before_A = in->i_s_A;
    e->lambda_r_hat_Wb = ab_limited(ab_add(reference_Wb, st->slow_Wb), cfg->lambda_max_Wb);
    e->lambda_Wb = sqrtf(ab_norm2(e->lambda_r_hat_Wb));
    return ab_cross(ab_sub(st->adjustable_Wb, st->slow_Wb), reference_Wb);
}

static float flux_frequency(const estimator_config_t *cfg, const estimator_state_t *st,
                            float omega_e_rad_s)
{
    const estimate_t *e = &st->estimate;
    const float base_Wb = maxf(e->lambda_Wb, cfg->lambda_min_Wb);
    return omega_e_rad_s +
           cfg->m_tau_ohm * ab_cross(e->lambda_r_hat_Wb, st->i_before_A) / (base_Wb * base_Wb);
}

void estimator_step(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in)
{
    estimate_t *e = &st->estimate;
    const float extra_rad_s = in->slip_extra_rad_s;
    const float z_Wb2 = advance(cfg, st, in);
    st->x_rad_s = limitf(st->x_rad_s + cfg->ki_T_rad_per_s_Wb2 * z_Wb2, cfg->omega_max_rad_s);
    const float omega_e_rad_s =
        limitf(st->x_rad_s + cfg->kp_rad_per_s_Wb2 * z_Wb2, cfg->omega_max_rad_s);
    e->omega_e_rad_s = omega_e_rad_s - extra_rad_s;
    e->omega_s_rad_s =
        in->frame_imposed ? in->omega_frame_rad_s : flux_frequency(cfg, st, omega_e_rad_s);
}

void estimator_hold(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in,
                    float omega_e_rad_s)
{
    (void)advance(cfg, st, in);
    st->x_rad_s = omega_e_rad_s + in->slip_extra_rad_s;
    st->estimate.omega_e_rad_s = omega_e_rad_s;
    st->estimate.omega_s_rad_s = omega_e_rad_s;
}

void estimator_off(estimator_state_t *st, ab_t i_s_A, float omega_e_rad_s)
{
    *st = (estimator_state_t){
        .estimate = {.omega_e_rad_s = omega_e_rad_s, .omega_s_rad_s = omega_e_rad_s},
        .i_before_A = i_s_A,
        .x_rad_s = omega_e_rad_s};
}

/* Both high-passes begin here: the models start with the same flux. */
void estimator_seed(const estimator_config_t *cfg, estimator_state_t *st,
                    const estimator_seed_t *seed)
{
    estimator_off(st, seed->i_s_A, seed->omega_e_rad_s);
    const ab_t lambda_Wb = ab_limited(seed->lambda_r_Wb, cfg->lambda_max_Wb);
    st->estimate.lambda_r_hat_Wb = lambda_Wb;
    st->estimate.lambda_Wb = sqrtf(ab_norm2(lambda_Wb));
    st->adjustable_Wb = lambda_Wb;
    st->y_Wb =
        ab_add(ab_scale(lambda_Wb, 1.0f / cfg->inv_kr), ab_scale(seed->i_s_A, cfg->sigma_Ls_H));
}
