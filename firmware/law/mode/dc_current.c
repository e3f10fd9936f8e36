#include "dc_current.h"

#include "trig.h"

/* From the middle of the ended interval to the middle of the one the duties act in. */
#define STANDING_AHEAD_PERIODS 2.0f

bool dc_current_init(dc_current_config_t *cfg, float bandwidth_rad_s, const motor_model_t *motor,
                     float period_s)
{
    const dc_current_config_t c = {
        .kp_ohm = bandwidth_rad_s * motor->sigma_Ls_H,
        .sigma_Ls_per_T_ohm = motor->sigma_Ls_H / period_s,
        .period_s = period_s,
    };
    if (!positivef(period_s) || !positivef(c.kp_ohm) || !positivef(c.sigma_Ls_per_T_ohm)) {
        return false;
    }
    *cfg = c;
    return true;
}

ab_t dc_current_step(const dc_current_config_t *cfg, dc_current_state_t *st,
                     const dc_current_in_t *in)
{
    const ab_t change_A = ab_sub(in->i_A, st->i_before_A);
    const ab_t mean_A = ab_sub(in->i_A, ab_scale(change_A, 0.5f));
    st->e_V = ab_sub(ab_sub(in->u_V, ab_scale(mean_A, in->Rs_ohm)),
                     ab_scale(change_A, cfg->sigma_Ls_per_T_ohm));
    st->i_before_A = in->i_A;

    const float ahead_rad = in->omega_rad_s * STANDING_AHEAD_PERIODS * cfg->period_s;
    const ab_t e_V = ab_mul(trig_unit(limitf(ahead_rad, TRIG_SMALL_MAX_RAD)), st->e_V);
    const ab_t pull_V = ab_scale(ab_sub(in->i_ref_A, in->i_A), cfg->kp_ohm);
    return ab_add(ab_add(e_V, ab_scale(in->i_ref_A, in->Rs_ohm)), pull_V);
}
