#include "estimator.h"

#include <math.h>

/* asin x = x + x^3/6: .1 rad a period at 500 rad/s. */
#define ARCSINE_3 0.16666667f

/* Unit vector along the flux; along the current while there is none. */
static ab_t direction(const estimator_config_t *cfg, const estimate_t *e, ab_t i_A)
{
    if (e->lambda_Wb > cfg->lambda_min_Wb) {
        return ab_scale(e->lambda_r_hat_Wb, 1.0f / e->lambda_Wb);
    }
    const float length_A = sqrtf(ab_norm2(i_A));
    return (length_A > 0.0f) ? ab_scale(i_A, 1.0f / length_A) : (ab_t){0.0f, 0.0f};
}

/* The current model's rotor flux at the end of the interval that ended; its axis is that of the
 * flux at its start, which the correction then holds against the voltage model's. */
static ab_t current_model(const estimator_config_t *cfg, estimator_state_t *st,
                          const estimator_in_t *in)
{
    const ab_t axis = direction(cfg, &st->estimate, in->i_s_A);
    const float i_d_A = ab_dot(axis, st->i_before_A);
    const float tau_per_s = cfg->tau_per_s + in->tau_extra_per_s;
    const float rate_V = cfg->m_tau_ohm * i_d_A - tau_per_s * st->slow_Wb;
    const ab_t lambda_Wb = ab_scale(axis, st->slow_Wb);
    st->slow_Wb = clampf(st->slow_Wb + cfg->period_s * rate_V, 0.0f, cfg->lambda_max_Wb);
    return lambda_Wb;
}

/* Both models over the interval that ended. */
static void advance(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in)
{
    estimate_t *e = &st->estimate;
    const ab_t slow_Wb = current_model(cfg, st, in);
    const ab_t of_slow_Wb =
        ab_add(ab_scale(slow_Wb, cfg->kr), ab_scale(st->i_before_A, cfg->sigma_Ls_H));
    const ab_t d_Wb = ab_sub(of_slow_Wb, st->psi_s_Wb);
    const ab_t i_A = ab_scale(ab_add(st->i_before_A, in->i_s_A), 0.5f);
    const ab_t emf_V = ab_sub(in->u_s_V, ab_scale(i_A, cfg->Rs_ohm));
    const ab_t rate_V = ab_add(emf_V, ab_scale(d_Wb, cfg->corner_per_s));
    st->psi_s_Wb = ab_limited(ab_add(st->psi_s_Wb, ab_scale(rate_V, cfg->period_s)),
                              2.0f * cfg->lambda_max_Wb);
    st->i_before_A = in->i_s_A;
    const ab_t lambda_Wb =
        ab_scale(ab_sub(st->psi_s_Wb, ab_scale(in->i_s_A, cfg->sigma_Ls_H)), cfg->inv_kr);
    e->lambda_r_hat_Wb = ab_limited(lambda_Wb, cfg->lambda_max_Wb);
    e->lambda_Wb = sqrtf(ab_norm2(e->lambda_r_hat_Wb));
}

void estimator_step(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in)
{
    estimate_t *e = &st->estimate;
    const ab_t before_Wb = e->lambda_r_hat_Wb;
    advance(cfg, st, in);
    const float base_Wb = maxf(e->lambda_Wb, cfg->lambda_min_Wb);
    const float per_Wb2 = 1.0f / (base_Wb * base_Wb);
    const float slip_rad_s = cfg->m_tau_ohm * ab_cross(e->lambda_r_hat_Wb, in->i_s_A) * per_Wb2;
    const float sine = ab_cross(before_Wb, e->lambda_r_hat_Wb) * per_Wb2;
    const float turn_rad_s = (sine + ARCSINE_3 * sine * sine * sine) / cfg->period_s;
    const float change_rad_s = turn_rad_s - slip_rad_s - st->omega_model_rad_s;
    st->omega_model_rad_s =
        limitf(st->omega_model_rad_s + cfg->speed_share * change_rad_s, cfg->omega_max_rad_s);
    e->omega_e_rad_s = st->omega_model_rad_s - in->slip_extra_rad_s;
    e->omega_s_rad_s =
        in->frame_imposed ? in->omega_frame_rad_s : (st->omega_model_rad_s + slip_rad_s);
}

void estimator_hold(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in,
                    float omega_e_rad_s)
{
    advance(cfg, st, in);
    st->omega_model_rad_s = omega_e_rad_s + in->slip_extra_rad_s;
    st->estimate.omega_e_rad_s = omega_e_rad_s;
    st->estimate.omega_s_rad_s = omega_e_rad_s;
}

void estimator_off(estimator_state_t *st, ab_t i_s_A, float omega_e_rad_s)
{
    *st = (estimator_state_t){
        .estimate = {.omega_e_rad_s = omega_e_rad_s, .omega_s_rad_s = omega_e_rad_s},
        .i_before_A = i_s_A,
        .omega_model_rad_s = omega_e_rad_s};
}

void estimator_seed(const estimator_config_t *cfg, estimator_state_t *st,
                    const estimator_seed_t *seed)
{
    estimator_off(st, seed->i_s_A, seed->omega_e_rad_s);
    const ab_t lambda_Wb = ab_limited(seed->lambda_r_Wb, cfg->lambda_max_Wb);
    st->estimate.lambda_r_hat_Wb = lambda_Wb;
    st->estimate.lambda_Wb = sqrtf(ab_norm2(lambda_Wb));
    st->slow_Wb = st->estimate.lambda_Wb;
    st->psi_s_Wb = ab_add(ab_scale(lambda_Wb, cfg->kr), ab_scale(seed->i_s_A, cfg->sigma_Ls_H));
}
