#include "estimator.h"

#include <math.h>

#include "trig.h"

/* Of the paper: estimator_types.h. */
#define HINKKANEN_W_K_RAD_S   314.15927f
#define HINKKANEN_PHI0_RAD    1.3962634f
#define HINKKANEN_W_PHI_RAD_S 125.66371f

static ab_t current(const estimator_config_t *cfg, fluxes_t psi)
{
    return ab_scale(ab_sub(psi.s, psi.r), cfg->inv_sigma_Ls_per_H);
}

/* A psi: the rows without voltage and correction. */
static fluxes_t a_times(const estimator_config_t *cfg, ab_t pole_per_s, fluxes_t psi)
{
    const ab_t i_A = current(cfg, psi);
    return (fluxes_t){
        .s = ab_scale(i_A, -cfg->Rs_ohm),
        .r = ab_sub(ab_scale(i_A, cfg->Rr_gamma_ohm), ab_mul(pole_per_s, psi.r)),
    };
}

static fluxes_t plus(fluxes_t psi, float k, fluxes_t rate)
{
    return (fluxes_t){ab_add(psi.s, ab_scale(rate.s, k)), ab_add(psi.r, ab_scale(rate.r, k))};
}

/* k of the gain. */
static float gain_ohm(const estimator_config_t *cfg, float omega_e_rad_s)
{
    return cfg->k0_ohm * minf(absf(omega_e_rad_s) / HINKKANEN_W_K_RAD_S, 1.0f);
}

/* l_s e and l_r e. */
static fluxes_t correction(const estimator_config_t *cfg, float omega_e_rad_s, ab_t e_A)
{
    const float k_ohm = gain_ohm(cfg, omega_e_rad_s);
    const float sign_k_ohm = (omega_e_rad_s < 0.0f) ? -k_ohm : k_ohm;
    return (fluxes_t){ab_mul((ab_t){k_ohm, sign_k_ohm}, e_A),
                      ab_mul((ab_t){-k_ohm, sign_k_ohm}, e_A)};
}

/* Both fluxes over the interval that ended, with the speed and the error of its start. */
static void observe(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in)
{
    estimate_t *e = &st->estimate;
    const float omega_e_rad_s = e->omega_e_rad_s + in->slip_extra_rad_s;
    const ab_t pole_per_s = {cfg->tau_per_s + in->tau_extra_per_s, -omega_e_rad_s};
    fluxes_t rate = a_times(cfg, pole_per_s, st->psi_Wb);
    rate.s = ab_add(rate.s, in->u_s_V);
    rate = plus(rate, 0.5f * cfg->period_s, a_times(cfg, pole_per_s, rate));
    const fluxes_t corrected = correction(cfg, omega_e_rad_s, ab_scale(e->i_residual_A, -1.0f));
    const fluxes_t next = plus(st->psi_Wb, cfg->period_s, plus(rate, 1.0f, corrected));
    const ab_t psi_r_Wb = ab_limited(next.r, cfg->psi_max_Wb);
    st->psi_Wb = (fluxes_t){ab_limited(next.s, 2.0f * cfg->psi_max_Wb), psi_r_Wb};
    e->lambda_r_hat_Wb = ab_scale(psi_r_Wb, cfg->inv_kr);
    e->lambda_Wb = sqrtf(ab_norm2(e->lambda_r_hat_Wb));
    e->i_residual_A = ab_sub(current(cfg, st->psi_Wb), in->i_s_A);
    e->flux_correction_V =
        ab_scale(correction(cfg, omega_e_rad_s, ab_scale(e->i_residual_A, -1.0f)).r, cfg->inv_kr);
}

/* How fast the estimated flux turns on the rotor, by its row. */
static float slip_of(const estimator_config_t *cfg, const estimator_state_t *st)
{
    const ab_t psi_r_Wb = st->psi_Wb.r;
    const ab_t pull_V = ab_add(ab_scale(current(cfg, st->psi_Wb), cfg->Rr_gamma_ohm),
                               ab_scale(st->estimate.flux_correction_V, cfg->kr));
    const float base_Wb2 = maxf(ab_norm2(psi_r_Wb), cfg->psi_min_Wb * cfg->psi_min_Wb);
    return ab_cross(psi_r_Wb, pull_V) / base_Wb2;
}

/* phi: not 0 where the motor generates at low stator frequency. */
static float rotation(float omega_s_rad_s, float slip_rad_s)
{
    const float distance = 1.0f - absf(omega_s_rad_s) / HINKKANEN_W_PHI_RAD_S;
    if (!(omega_s_rad_s * slip_rad_s < 0.0f) || !(distance > 0.0f)) {
        return 0.0f;
    }
    return HINKKANEN_PHI0_RAD * ((omega_s_rad_s < 0.0f) ? -distance : distance);
}

/* PI law; its zero is at the pole that the current error has with this gain. */
static float adapted(const estimator_config_t *cfg, estimator_state_t *st, float z_Wb_A)
{
    const float k_ohm = gain_ohm(cfg, st->x_rad_s);
    const float pole_per_s = cfg->a11_per_s + 2.0f * k_ohm * cfg->inv_sigma_Ls_per_H;
    const float p_rad_s = cfg->kp_rad_per_s_Wb_A * z_Wb_A;
    st->x_rad_s = limitf(st->x_rad_s + cfg->period_s * pole_per_s * p_rad_s, cfg->omega_max_rad_s);
    return limitf(st->x_rad_s + p_rad_s, cfg->omega_max_rad_s);
}

void estimator_step(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in)
{
    estimate_t *e = &st->estimate;
    observe(cfg, st, in);
    const float slip_rad_s = slip_of(cfg, st);
    st->phi_rad = rotation(e->omega_e_rad_s + in->slip_extra_rad_s + slip_rad_s, slip_rad_s);
    const ab_t axis_Wb = ab_mul(trig_unit(st->phi_rad), st->psi_Wb.r);
    const float omega_e_rad_s = adapted(cfg, st, ab_cross(axis_Wb, e->i_residual_A));
    e->omega_e_rad_s = omega_e_rad_s - in->slip_extra_rad_s;
    e->omega_s_rad_s = in->frame_imposed ? in->omega_frame_rad_s : (omega_e_rad_s + slip_rad_s);
}

void estimator_hold(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in,
                    float omega_e_rad_s)
{
    observe(cfg, st, in);
    st->x_rad_s = omega_e_rad_s + in->slip_extra_rad_s;
    st->estimate.omega_e_rad_s = omega_e_rad_s;
    st->estimate.omega_s_rad_s = omega_e_rad_s;
}

void estimator_off(estimator_state_t *st, ab_t i_s_A, float omega_e_rad_s)
{
    (void)i_s_A; /* without flux the observer finds it within milliseconds */
    *st = (estimator_state_t){
        .estimate = {.omega_e_rad_s = omega_e_rad_s, .omega_s_rad_s = omega_e_rad_s},
        .x_rad_s = omega_e_rad_s};
}

void estimator_seed(const estimator_config_t *cfg, estimator_state_t *st,
                    const estimator_seed_t *seed)
{
    estimator_off(st, seed->i_s_A, seed->omega_e_rad_s);
    const ab_t psi_r_Wb = ab_limited(ab_scale(seed->lambda_r_Wb, cfg->kr), cfg->psi_max_Wb);
    st->psi_Wb.r = psi_r_Wb;
    st->psi_Wb.s = ab_add(psi_r_Wb, ab_scale(seed->i_s_A, cfg->sigma_Ls_H));
    st->estimate.lambda_r_hat_Wb = ab_scale(psi_r_Wb, cfg->inv_kr);
    st->estimate.lambda_Wb = sqrtf(ab_norm2(st->estimate.lambda_r_hat_Wb));
}
