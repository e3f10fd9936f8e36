#include "m_tracking.h"

/* Ten rotor time constants: the flux of a step of i_d does not count as another M. */
#define M_TRACKING_S 2.0f

/* No motor's M is further from its parameter. */
#define M_TRACKING_MAX_PU 0.3f

bool m_tracking_init(m_tracking_config_t *cfg, const m_tracking_params_t *p,
                     const motor_model_t *motor, float step_s)
{
    *cfg = (m_tracking_config_t){0};
    if (!p->on) {
        return true;
    }
    if (!ALL_POSITIVE(p->min_rad_s, motor->M_H, motor->tau_per_s, step_s)) {
        return false;
    }
    *cfg = (m_tracking_config_t){.gain = step_s / (step_s + M_TRACKING_S),
                                 .min_rad_s = p->min_rad_s,
                                 .inv_M_per_H = 1.0f / motor->M_H,
                                 .tau_per_s = motor->tau_per_s};
    return true;
}

void m_tracking_step(const m_tracking_config_t *cfg, m_tracking_state_t *st,
                     const m_tracking_in_t *in)
{
    if (!(absf(in->omega_s_hat_rad_s) >= cfg->min_rad_s) || !(in->i_d_A > 0.0f)) {
        return;
    }
    const float extra_pu = in->lambda_hat_Wb * cfg->inv_M_per_H / in->i_d_A - 1.0f;
    st->extra_pu += cfg->gain * (limitf(extra_pu, M_TRACKING_MAX_PU) - st->extra_pu);
    st->tau_extra_per_s = -cfg->tau_per_s * st->extra_pu / (1.0f + st->extra_pu);
}
