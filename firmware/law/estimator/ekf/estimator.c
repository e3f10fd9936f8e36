#include "estimator.h"

#include <math.h>
#include <stddef.h>

/* Current and flux, or their rates. */
typedef struct {
    ab_t current;
    ab_t flux;
} rows_t;

const gain_table_t *estimator_table(const estimator_config_t *cfg)
{
    (void)cfg;
    return NULL;
}

/* The electrical rows of f without the voltage; pole_per_s: tau - j w. */
static rows_t a_times(const estimator_config_t *cfg, ab_t pole_per_s, rows_t x)
{
    const ab_t decay = ab_mul(pole_per_s, x.flux);
    return (rows_t){
        .current = ab_sub(ab_scale(decay, cfg->inv_eps_per_H), ab_scale(x.current, cfg->a11_per_s)),
        .flux = ab_sub(ab_scale(x.current, cfg->m_tau_ohm), decay)};
}

/* F at the estimate: what df/dx makes of a period. */
static transition_t transition(const estimator_config_t *cfg, const estimator_state_t *st,
                               ab_t pole_per_s)
{
    const float T_s = cfg->period_s;
    /* d(-(tau - j w) lambda)/dw = j lambda */
    const ab_t turned_Vs = {-T_s * st->lambda_Wb.beta, T_s * st->lambda_Wb.alpha};
    const ab_t decay = ab_scale(pole_per_s, T_s);
    return (transition_t){.current_own = 1.0f - T_s * cfg->a11_per_s,
                          .current_flux = ab_scale(decay, cfg->inv_eps_per_H),
                          .current_speed = ab_scale(turned_Vs, -cfg->inv_eps_per_H),
                          .flux_current = T_s * cfg->m_tau_ohm,
                          .flux_own = {1.0f - decay.alpha, -decay.beta},
                          .flux_speed = turned_Vs};
}

/* The state over the interval that ended: x + T f + T^2/2 A f. */
static void predict(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in,
                    ab_t pole_per_s)
{
    const rows_t x = {.current = st->i_s_hat_A, .flux = st->lambda_Wb};
    rows_t rate = a_times(cfg, pole_per_s, x);
    rate.current = ab_add(rate.current, ab_scale(in->u_s_V, cfg->inv_sigma_Ls_per_H));
    const rows_t second = a_times(cfg, pole_per_s, rate);
    const float T_s = cfg->period_s;
    const float half_s2 = 0.5f * T_s * T_s;
    st->i_s_hat_A =
        ab_add(x.current, ab_add(ab_scale(rate.current, T_s), ab_scale(second.current, half_s2)));
    st->lambda_Wb =
        ab_add(x.flux, ab_add(ab_scale(rate.flux, T_s), ab_scale(second.flux, half_s2)));
}

static void correct(const estimator_config_t *cfg, estimator_state_t *st, ab_t i_s_A)
{
    covariance_gain_t K;
    covariance_update(&st->P, cfg->R_A2, &K);
    const ab_t innovation_A = ab_sub(i_s_A, st->i_s_hat_A);
    const ab_t flux_Wb = block_times(&K.flux, innovation_A);
    st->estimate.i_residual_A = ab_clamp(ab_scale(innovation_A, -1.0f), 2.0f * cfg->i_max_A);
    st->estimate.flux_correction_V = ab_scale(flux_Wb, cfg->inv_period_Hz);
    st->i_s_hat_A =
        ab_limited(ab_add(st->i_s_hat_A, block_times(&K.current, innovation_A)), cfg->i_max_A);
    st->lambda_Wb = ab_limited(ab_add(st->lambda_Wb, flux_Wb), cfg->lambda_max_Wb);
    st->omega_rad_s = limitf(st->omega_rad_s + ab_dot(K.speed, innovation_A), cfg->omega_max_rad_s);
}

/* One period of the filter; speed_variance: what Q adds to that of the speed. */
static void filter(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in,
                   float speed_variance)
{
    const covariance_noise_t Q = {
        .current = cfg->Q.current, .flux = cfg->Q.flux, .speed = speed_variance};
    const ab_t pole_per_s = {cfg->tau_per_s + in->tau_extra_per_s, -st->omega_rad_s};
    const transition_t F = transition(cfg, st, pole_per_s);
    covariance_predict(&st->P, &F, &Q);
    predict(cfg, st, in, pole_per_s);
    correct(cfg, st, in->i_s_A);
    st->estimate.lambda_r_hat_Wb = st->lambda_Wb;
    st->estimate.lambda_Wb = sqrtf(ab_norm2(st->lambda_Wb));
}

/* M tau i_q/|lambda|. */
static float slip_rad_s(const estimator_config_t *cfg, const estimator_state_t *st)
{
    const float base_Wb = maxf(st->estimate.lambda_Wb, cfg->lambda_min_Wb);
    return cfg->m_tau_ohm * ab_cross(st->lambda_Wb, st->i_s_hat_A) / (base_Wb * base_Wb);
}

void estimator_step(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in)
{
    /* Where the speed cannot be seen its variance would grow for ever. */
    const float limit_rad_s = cfg->omega_max_rad_s;
    filter(cfg, st, in, (st->P.ww < limit_rad_s * limit_rad_s) ? cfg->Q.speed : 0.0f);
    estimate_t *e = &st->estimate;
    e->omega_e_rad_s = st->omega_rad_s - in->slip_extra_rad_s;
    e->omega_s_rad_s =
        in->frame_imposed ? in->omega_frame_rad_s : (st->omega_rad_s + slip_rad_s(cfg, st));
}

void estimator_hold(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in,
                    float omega_e_rad_s)
{
    st->omega_rad_s = omega_e_rad_s + in->slip_extra_rad_s;
    covariance_know_speed(&st->P);
    filter(cfg, st, in, 0.0f);
    st->estimate.omega_e_rad_s = omega_e_rad_s;
    st->estimate.omega_s_rad_s = omega_e_rad_s;
}

void estimator_off(estimator_state_t *st, ab_t i_s_A, float omega_e_rad_s)
{
    *st = (estimator_state_t){
        .estimate = {.omega_e_rad_s = omega_e_rad_s, .omega_s_rad_s = omega_e_rad_s},
        .i_s_hat_A = i_s_A,
        .omega_rad_s = omega_e_rad_s};
}

void estimator_seed(const estimator_config_t *cfg, estimator_state_t *st,
                    const estimator_seed_t *seed)
{
    estimator_off(st, seed->i_s_A, seed->omega_e_rad_s);
    st->lambda_Wb = ab_limited(seed->lambda_r_Wb, cfg->lambda_max_Wb);
    st->estimate.lambda_r_hat_Wb = st->lambda_Wb;
    st->estimate.lambda_Wb = sqrtf(ab_norm2(st->lambda_Wb));
    const covariance_noise_t *known = &cfg->seed;
    st->P.ii = (block_t){{known->current, 0.0f}, {0.0f, known->current}};
    st->P.ll = (block_t){{known->flux, 0.0f}, {0.0f, known->flux}};
    st->P.ww = known->speed;
}
