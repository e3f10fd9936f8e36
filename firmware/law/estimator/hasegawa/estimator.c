#include "estimator.h"

#include <math.h>
#include <stddef.h>

/* With weakening L's imaginary parts grow with the speed beyond the table's end, up to so many
 * times: no motor runs at more. Without, the last entry holds, as the paper's estimate at its
 * bounds has it. */
#define ESTIMATOR_BEYOND_TABLE_MAX 3.0f

/* Beyond the table's end l1 = .. - j w no longer fits: a braking motor would swing (zh modes). */
COLD static observer_gain_t gain_beyond(const estimator_config_t *cfg, float nearest,
                                        float omega_e_rad_s)
{
    const float number = (nearest > cfg->table_last) ? cfg->table_last : 0.0f; /* 0: a NaN */
    observer_gain_t gain = gain_table_entry(cfg->table, number, omega_e_rad_s);
    const float growth =
        clampf(absf(omega_e_rad_s) / cfg->table_end_rad_s, 1.0f, ESTIMATOR_BEYOND_TABLE_MAX);
    gain.l1_im_per_s *= growth;
    gain.l2_im_ohm *= growth;
    return gain;
}

static observer_gain_t gain_at(const estimator_config_t *cfg, float omega_e_rad_s)
{
    if (cfg->table == NULL) {
        return (observer_gain_t){0.0f, 0.0f, 0.0f, 0.0f};
    }
    const float nearest = gain_table_nearest(cfg->table, omega_e_rad_s);
    if (!(nearest <= cfg->table_last)) {
        return gain_beyond(cfg, nearest, omega_e_rad_s);
    }
    return gain_table_entry(cfg->table, nearest, omega_e_rad_s);
}

/* Flux and current over the interval that ended. omega_e_rad_s: of a rotor with the parameter's Rr,
 * which turns faster at the same current. */
static inline void observe(const estimator_config_t *cfg, estimator_state_t *st,
                           const estimator_in_t *in, float omega_e_rad_s)
{
    st->gain = gain_at(cfg, omega_e_rad_s);
    const observer_in_t observer_in = {.u_s_V = in->u_s_V,
                                       .i_s_A = in->i_s_A,
                                       .omega_e_hat_rad_s = omega_e_rad_s,
                                       .tau_extra_per_s = in->tau_extra_per_s,
                                       .gain = st->gain};
    observer_step(&cfg->observer, &st->observer, &observer_in);
    estimate_t *e = &st->estimate;
    e->lambda_r_hat_Wb = ab_by_parts(st->observer.lambda_r_hat_Wb);
    e->lambda_Wb = sqrtf(ab_norm2(e->lambda_r_hat_Wb));
    e->i_residual_A = ab_by_parts(st->observer.e1_A);
    e->flux_correction_V =
        ab_mul((ab_t){st->gain.l2_re_ohm, st->gain.l2_im_ohm}, st->observer.e1_A);
}

/* How fast the estimated flux turns, by the flux row of eq. (3): the speed, and the slip that the
 * estimated current and the correction make. With e1 = 0 that is w + (M Rr/Lr) i_q / lambda. */
static inline float flux_frequency(const estimator_config_t *cfg, const estimator_state_t *st,
                                   float omega_e_rad_s)
{
    const estimate_t *e = &st->estimate;
    const ab_t pull_V =
        ab_add(ab_scale(st->observer.i_s_hat_A, cfg->observer.m_tau_ohm), e->flux_correction_V);
    const float base_Wb = maxf(e->lambda_Wb, cfg->lambda_min_Wb);
    return omega_e_rad_s + ab_cross(e->lambda_r_hat_Wb, pull_V) / (base_Wb * base_Wb);
}

/* While dwelling a constant residual is that of Rs: the speed adaptation gets what moves. The slow
 * part is remembered from one dwell to the next: with the Rs of then there was next to none. */
static inline ab_t residual_of_speed(const estimator_config_t *cfg, estimator_state_t *st,
                                     float dwell)
{
    const ab_t e1_A = st->estimate.i_residual_A;
    if (!above_zerof(dwell)) {
        return e1_A;
    }
    const ab_t moving_A = ab_sub(e1_A, st->residual_slow_A);
    st->residual_slow_A = ab_add(st->residual_slow_A, ab_scale(moving_A, cfg->residual_slow_gain));
    return ab_sub(e1_A, ab_scale(st->residual_slow_A, dwell));
}

void estimator_step(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in)
{
    estimate_t *e = &st->estimate;
    const observer_gain_t *g = &st->gain;
    const float before_rad_s = e->omega_e_rad_s + in->slip_extra_rad_s;
    observe(cfg, st, in, before_rad_s);
    const speed_adaptation_in_t adaptation_in = {
        .lambda_r_hat_Wb = e->lambda_r_hat_Wb,
        .e1_A = residual_of_speed(cfg, st, in->dwell),
        .dwell = in->dwell,
        .omega_s_hat_rad_s = e->omega_s_rad_s,
        .omega_e_hat_rad_s = before_rad_s,
        .expected_step_rad_s = in->expected_step_rad_s,
        .gain = {g->l1_re_per_s, g->l1_im_per_s, g->l2_re_ohm, g->l2_im_ohm}};
    const float omega_e_rad_s =
        speed_adaptation_step(&cfg->adaptation, &st->adaptation, &adaptation_in).omega_e_hat_rad_s;
    e->omega_e_rad_s = omega_e_rad_s - in->slip_extra_rad_s;
    e->omega_s_rad_s =
        in->frame_imposed ? in->omega_frame_rad_s : flux_frequency(cfg, st, omega_e_rad_s);
}

void estimator_hold(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in,
                    float omega_e_rad_s)
{
    observe(cfg, st, in, st->estimate.omega_e_rad_s + in->slip_extra_rad_s);
    st->adaptation.x_rad_s = omega_e_rad_s + in->slip_extra_rad_s;
    st->estimate.omega_e_rad_s = omega_e_rad_s;
    st->estimate.omega_s_rad_s = omega_e_rad_s;
}

void estimator_off(estimator_state_t *st, ab_t i_s_A, float omega_e_rad_s)
{
    st->observer = (observer_state_t){.i_s_hat_A = i_s_A};
    st->gain = (observer_gain_t){0.0f, 0.0f, 0.0f, 0.0f};
    st->estimate = (estimate_t){.omega_e_rad_s = omega_e_rad_s, .omega_s_rad_s = omega_e_rad_s};
}

void estimator_seed(const estimator_config_t *cfg, estimator_state_t *st,
                    const estimator_seed_t *seed)
{
    const float omega_e_rad_s = seed->omega_e_rad_s;
    const ab_t lambda_Wb = ab_limited(seed->lambda_r_Wb, cfg->observer.lambda_max_Wb);
    st->observer = (observer_state_t){.i_s_hat_A = seed->i_s_A, .lambda_r_hat_Wb = lambda_Wb};
    st->adaptation = (speed_adaptation_state_t){.x_rad_s = omega_e_rad_s};
    st->estimate = (estimate_t){.lambda_r_hat_Wb = lambda_Wb,
                                .lambda_Wb = sqrtf(ab_norm2(lambda_Wb)),
                                .omega_e_rad_s = omega_e_rad_s,
                                .omega_s_rad_s = omega_e_rad_s};
}
