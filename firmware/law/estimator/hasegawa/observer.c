#include "observer.h"

/* A state of eq. (3) or its rate: current row and flux row. */
typedef struct {
    ab_t current;
    ab_t flux;
} rows_t;

static bool motor_model_valid(const motor_model_t *motor)
{
    return ALL_POSITIVE(motor->Rs_ohm, motor->M_H, motor->sigma_Ls_H, motor->eps_H,
                        motor->tau_per_s, motor->kr, motor->a11_per_s);
}

bool observer_init(observer_config_t *cfg, const observer_params_t *params,
                   const motor_model_t *motor, float period_s)
{
    if (!motor_model_valid(motor) ||
        !ALL_POSITIVE(period_s, params->i_max_A, params->lambda_max_Wb)) {
        return false;
    }
    if (!(motor->a11_per_s * period_s < 1.0f)) {
        return false;
    }
    if ((params->method != OBSERVER_EULER) && (params->method != OBSERVER_SECOND_ORDER)) {
        return false;
    }
    *cfg = (observer_config_t){
        .period_s = period_s,
        .half_period_s = 0.5f * period_s,
        .a11_per_s = motor->a11_per_s,
        .tau_per_s = motor->tau_per_s,
        .inv_eps_per_H = 1.0f / motor->eps_H,
        .m_tau_ohm = motor->M_H * motor->tau_per_s,
        .inv_sigma_Ls_per_H = 1.0f / motor->sigma_Ls_H,
        .i_max_A = params->i_max_A,
        .lambda_max_Wb = params->lambda_max_Wb,
        .method = params->method,
    };
    return true;
}

void observer_set_rs(observer_config_t *cfg, const motor_model_t *motor, float Rs_ohm)
{
    if (positivef(Rs_ohm)) {
        cfg->a11_per_s = motor_a11_per_s(motor, Rs_ohm);
    }
}

/* A(w) x of eq. (3). */
static rows_t a_times(const observer_config_t *cfg, ab_t pole_per_s, rows_t x)
{
    /* (tau - j w) lambda: leaves the flux row, drives the current row over 1/eps. */
    const ab_t decay = ab_mul(pole_per_s, x.flux);
    return (rows_t){
        .current = ab_sub(ab_scale(decay, cfg->inv_eps_per_H), ab_scale(x.current, cfg->a11_per_s)),
        .flux = ab_sub(ab_scale(x.current, cfg->m_tau_ohm), decay),
    };
}

/* x + k rate. */
static rows_t advance(rows_t x, float k, rows_t rate)
{
    return (rows_t){.current = ab_add(x.current, ab_scale(rate.current, k)),
                    .flux = ab_add(x.flux, ab_scale(rate.flux, k))};
}

void observer_step(const observer_config_t *cfg, observer_state_t *st, const observer_in_t *in)
{
    const rows_t x = {.current = st->i_s_hat_A, .flux = st->lambda_r_hat_Wb};
    const ab_t pole_per_s = {cfg->tau_per_s + in->tau_extra_per_s, -in->omega_e_hat_rad_s};
    rows_t rate = a_times(cfg, pole_per_s, x);
    rate.current = ab_add(rate.current, ab_scale(in->u_s_V, cfg->inv_sigma_Ls_per_H));

    if (cfg->method == OBSERVER_SECOND_ORDER) {
        /* x(T) = x + T f + T^2/2 A f; the voltage is constant over the interval. */
        rate = advance(rate, cfg->half_period_s, a_times(cfg, pole_per_s, rate));
    }
    /* L e1 stays outside the expansion: inside it makes the bias worse (THEORY 4). */
    const ab_t l1_per_s = {in->gain.l1_re_per_s, in->gain.l1_im_per_s};
    const ab_t l2_ohm = {in->gain.l2_re_ohm, in->gain.l2_im_ohm};
    rate.current = ab_add(rate.current, ab_mul(l1_per_s, st->e1_A));
    rate.flux = ab_add(rate.flux, ab_mul(l2_ohm, st->e1_A));

    const rows_t next = advance(x, cfg->period_s, rate);
    st->i_s_hat_A = ab_limited(next.current, cfg->i_max_A);
    st->lambda_r_hat_Wb = ab_limited(next.flux, cfg->lambda_max_Wb);
    st->e1_A = ab_clamp(ab_sub(st->i_s_hat_A, in->i_s_A), 2.0f * cfg->i_max_A);
}
