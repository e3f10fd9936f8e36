#include "estimator.h"

#include <math.h>
#include <stddef.h>

/* zeta: damping at speed, in 0..1; 0.2 is the authors' choice, a compromise with noise. */
#define REDUCED_ORDER_ZETA 0.2f

/* alpha_o: bandwidth of the speed, 40 Hz; the authors' choice. */
#define REDUCED_ORDER_SPEED_RAD_S (NUM_TWO_PI * 40.0f)

/* One interval: current at its middle, rotor EMF times period by the stator equation, and the flux
 * at its middle as the voltage model has it. */
typedef struct {
    ab_t i_A;
    ab_t v_Vs;
    ab_t psi_Wb;
} interval_t;

bool estimator_init(estimator_config_t *cfg, const params_t *params, const motor_model_t *motor,
                    const gain_table_t *table)
{
    (void)table;
    const float psi_nominal_Wb = motor->kr * params->M_H * params->i_d_A;
    *cfg = (estimator_config_t){.period_s = params->period_s,
                                .inv_period_Hz = 1.0f / params->period_s,
                                .Rs_ohm = motor->Rs_ohm,
                                .sigma_Ls_H = motor->sigma_Ls_H,
                                .kr = motor->kr,
                                .inv_kr = 1.0f / motor->kr,
                                .R_R_ohm = motor->kr * motor->M_H * motor->tau_per_s,
                                .tau_per_s = motor->tau_per_s,
                                .speed_share = REDUCED_ORDER_SPEED_RAD_S * params->period_s,
                                .omega_max_rad_s = params->omega_max_rad_s,
                                .psi_min_Wb = ESTIMATE_LAMBDA_MIN_PU * psi_nominal_Wb,
                                .psi_max_Wb = motor->kr * params->lambda_max_Wb};
    return ALL_POSITIVE(cfg->period_s, cfg->omega_max_rad_s, cfg->psi_min_Wb, cfg->psi_max_Wb) &&
           (cfg->speed_share < 1.0f);
}

const gain_table_t *estimator_table(const estimator_config_t *cfg)
{
    (void)cfg;
    return NULL;
}

static interval_t interval(const estimator_config_t *cfg, const estimator_state_t *st,
                           const estimator_in_t *in)
{
    const ab_t i_A = ab_scale(ab_add(in->i_s_A, st->i_before_A), 0.5f);
    const ab_t step_A = ab_sub(in->i_s_A, st->i_before_A);
    const ab_t over_leakage_V = ab_sub(in->u_s_V, ab_scale(i_A, cfg->Rs_ohm));
    const ab_t v_Vs =
        ab_sub(ab_scale(over_leakage_V, cfg->period_s), ab_scale(step_A, cfg->sigma_Ls_H));
    return (interval_t){
        .i_A = i_A, .v_Vs = v_Vs, .psi_Wb = ab_add(st->psi_Wb, ab_scale(v_Vs, 0.5f))};
}

/* 1/(a - j w). */
static ab_t inverse_pole(float tau_per_s, float omega_rad_s)
{
    const float scale = 1.0f / (tau_per_s * tau_per_s + omega_rad_s * omega_rad_s);
    return (ab_t){scale * tau_per_s, scale * omega_rad_s};
}

/* 2 k (r_d - v_d) d, over the interval. */
static ab_t correction_Vs(const estimator_config_t *cfg, const interval_t *over, float tau_per_s,
                          float omega_rad_s)
{
    const float psi_Wb = sqrtf(ab_norm2(over->psi_Wb));
    const ab_t d = ab_scale(over->psi_Wb, 1.0f / maxf(psi_Wb, cfg->psi_min_Wb));
    const float r_d_V = cfg->R_R_ohm * ab_dot(d, over->i_A) - tau_per_s * psi_Wb;
    const float error_Vs = cfg->period_s * r_d_V - ab_dot(d, over->v_Vs);
    const float b_per_s = tau_per_s + 2.0f * REDUCED_ORDER_ZETA * absf(omega_rad_s);
    const ab_t two_k = ab_scale(inverse_pole(tau_per_s, omega_rad_s), b_per_s);
    return ab_scale(ab_mul(two_k, d), error_Vs);
}

/* k1 (R_R i - (a - j w) psi - v), over the interval. */
static ab_t held_correction_Vs(const estimator_config_t *cfg, const interval_t *over,
                               float tau_per_s, float omega_rad_s)
{
    const ab_t pole_per_s = {tau_per_s, -omega_rad_s};
    const ab_t v_r_V = ab_sub(ab_scale(over->i_A, cfg->R_R_ohm), ab_mul(pole_per_s, over->psi_Wb));
    const ab_t error_Vs = ab_sub(ab_scale(v_r_V, cfg->period_s), over->v_Vs);
    const ab_t beyond =
        ab_scale(inverse_pole(tau_per_s, omega_rad_s), REDUCED_ORDER_ZETA * absf(omega_rad_s));
    return ab_mul((ab_t){1.0f + beyond.alpha, beyond.beta}, error_Vs);
}

/* The flux of the interval's end, into the estimate; returns how fast it turned. */
static float turn(const estimator_config_t *cfg, estimator_state_t *st, ab_t i_s_A, ab_t psi_Wb)
{
    const ab_t before_Wb = st->psi_Wb;
    st->psi_Wb = ab_limited(psi_Wb, cfg->psi_max_Wb);
    st->i_before_A = i_s_A;
    estimate_t *e = &st->estimate;
    e->lambda_r_hat_Wb = ab_scale(st->psi_Wb, cfg->inv_kr);
    e->lambda_Wb = sqrtf(ab_norm2(e->lambda_r_hat_Wb));
    const float base_Wb2 = maxf(ab_dot(before_Wb, st->psi_Wb), cfg->psi_min_Wb * cfg->psi_min_Wb);
    /* The angle of a tangent up to its third power: 1e-3 rad/s at 300 rad/s. */
    const float tangent = limitf(ab_cross(before_Wb, st->psi_Wb) / base_Wb2, 1.0f);
    return (tangent - tangent * tangent * tangent / 3.0f) * cfg->inv_period_Hz;
}

/* w_r = R_R i_q/|psi|. */
static float slip_rad_s(const estimator_config_t *cfg, const estimator_state_t *st)
{
    const float base_Wb2 = maxf(ab_norm2(st->psi_Wb), cfg->psi_min_Wb * cfg->psi_min_Wb);
    return cfg->R_R_ohm * ab_cross(st->psi_Wb, st->i_before_A) / base_Wb2;
}

void estimator_step(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in)
{
    estimate_t *e = &st->estimate;
    const interval_t over = interval(cfg, st, in);
    const float tau_per_s = cfg->tau_per_s + in->tau_extra_per_s;
    const ab_t free_Wb = ab_add(st->psi_Wb, over.v_Vs);
    const ab_t pull_Wb = correction_Vs(cfg, &over, tau_per_s, st->omega_rad_s);
    const float omega_s_rad_s = turn(cfg, st, in->i_s_A, ab_add(free_Wb, pull_Wb));
    const float omega_r_rad_s = slip_rad_s(cfg, st);
    const float ahead_rad_s = omega_s_rad_s - omega_r_rad_s - st->omega_rad_s;
    st->omega_rad_s =
        limitf(st->omega_rad_s + cfg->speed_share * ahead_rad_s, cfg->omega_max_rad_s);
    e->omega_e_rad_s = st->omega_rad_s - in->slip_extra_rad_s;
    e->omega_s_rad_s =
        in->frame_imposed ? in->omega_frame_rad_s : (st->omega_rad_s + omega_r_rad_s);
}

void estimator_hold(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in,
                    float omega_e_rad_s)
{
    const interval_t over = interval(cfg, st, in);
    st->omega_rad_s = omega_e_rad_s + in->slip_extra_rad_s;
    const float tau_per_s = cfg->tau_per_s + in->tau_extra_per_s;
    const ab_t free_Wb = ab_add(st->psi_Wb, over.v_Vs);
    const ab_t pull_Wb = held_correction_Vs(cfg, &over, tau_per_s, st->omega_rad_s);
    (void)turn(cfg, st, in->i_s_A, ab_add(free_Wb, pull_Wb));
    st->estimate.omega_e_rad_s = omega_e_rad_s;
    st->estimate.omega_s_rad_s = omega_e_rad_s;
}

void estimator_off(estimator_state_t *st, ab_t i_s_A, float omega_e_rad_s)
{
    *st = (estimator_state_t){
        .estimate = {.omega_e_rad_s = omega_e_rad_s, .omega_s_rad_s = omega_e_rad_s},
        .i_before_A = i_s_A,
        .omega_rad_s = omega_e_rad_s};
}

void estimator_seed(const estimator_config_t *cfg, estimator_state_t *st,
                    const estimator_seed_t *seed)
{
    estimator_off(st, seed->i_s_A, seed->omega_e_rad_s);
    (void)turn(cfg, st, seed->i_s_A, ab_scale(seed->lambda_r_Wb, cfg->kr));
}
