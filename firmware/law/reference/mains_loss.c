#include "mains_loss.h"

#define MAINS_LOSS_MAX_PERIODS 1e9f

static bool levels_valid(const mains_loss_params_t *p)
{
    return positivef(p->u_lost_V) && (p->u_lost_V < p->u_hold_V) && (p->u_hold_V < p->u_back_V) &&
           is_finite(p->u_back_V);
}

bool mains_loss_init(mains_loss_config_t *cfg, const mains_loss_params_t *params,
                     const motor_model_t *motor, float period_s)
{
    *cfg = (mains_loss_config_t){0};
    if (is_zero(params->u_lost_V)) {
        return true; /* off: no dc link is below 0 */
    }
    const float back = params->back_s / period_s;
    /* P = T w/p, T = p kr lambda i_q. */
    const float A_rad_s_per_V = params->gain_W_per_V / (motor->kr * params->lambda_Wb);
    if (!levels_valid(params) || !nonnegativef(back) || !(back < MAINS_LOSS_MAX_PERIODS) ||
        !ALL_POSITIVE(params->gain_W_per_V, A_rad_s_per_V, params->stop_rad_s, params->i_q_max_A)) {
        return false;
    }
    *cfg = (mains_loss_config_t){
        .u_lost_V = params->u_lost_V,
        .u_hold_V = params->u_hold_V,
        .u_back_V = params->u_back_V,
        .back_periods = (uint32_t)back,
        .A_rad_s_per_V = A_rad_s_per_V,
        .stop_rad_s = params->stop_rad_s,
        .i_q_max_A = params->i_q_max_A,
    };
    return true;
}

void mains_loss_step(const mains_loss_config_t *cfg, mains_loss_state_t *st, float u_dc_V,
                     float omega_e_rad_s)
{
    const bool feeds = absf(omega_e_rad_s) >= cfg->stop_rad_s;
    if (!feeds && !st->active) {
        return;
    }
    st->active = true;
    if (!feeds) {
        st->over = true;
        st->i_q_A = 0.0f;
        return;
    }
    /* Only ever taken from the shaft: what lies above u_hold the mains gave. */
    const float deficit_V = maxf(cfg->u_hold_V - u_dc_V, 0.0f);
    st->i_q_A = limitf(-cfg->A_rad_s_per_V * deficit_V / omega_e_rad_s, cfg->i_q_max_A);
    if (!(u_dc_V > cfg->u_back_V)) {
        st->back_periods = 0u;
    } else if (st->back_periods < cfg->back_periods) {
        st->back_periods++;
    } else {
        *st = (mains_loss_state_t){0};
    }
}
