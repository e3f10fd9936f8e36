#include "rs_tracking.h"

#include <math.h>

#define RS_TRACKING_MAX_PERIODS 1000000.0f

/* On its way back to the start's Rs a step leaves this share of what is missing: a time constant of
 * 33 steps, .1 s at 200 us. */
#define RS_TRACKING_LEFT 0.97f

/* While dwelling Rs is seen well enough to follow one that cools. */
#define RS_TRACKING_DWELL_LOW_PU 0.6f

static bool bands_valid(const rs_tracking_params_t *p)
{
    const bool frequency =
        ALL_NONNEGATIVE(p->min_rad_s, p->back_rad_s) && (p->min_rad_s < p->max_rad_s);
    const bool resistance = positivef(p->low_pu) && (p->low_pu <= 1.0f) && (p->high_pu >= 1.0f);
    return frequency && resistance && ALL_FINITE(p->max_rad_s, p->high_pu);
}

bool rs_tracking_init(rs_tracking_config_t *cfg, const rs_tracking_params_t *p, float period_s)
{
    *cfg = (rs_tracking_config_t){0};
    if (is_zero(p->gain_ohm_per_rad)) {
        return true; /* off */
    }
    const float i_0_A2 = p->i_0_A * p->i_0_A;
    const bool quiet = p->quiet_s <= RS_TRACKING_MAX_PERIODS * period_s;
    if (!ALL_POSITIVE(p->gain_ohm_per_rad, p->i_0_A, i_0_A2, p->speed_err_rad_s, period_s) ||
        !ALL_NONNEGATIVE(p->quiet_s, p->slew_rad_s2, p->dwell_gain_ohm_per_s) || !quiet ||
        !bands_valid(p)) {
        return false;
    }
    *cfg = (rs_tracking_config_t){
        .gain_T_ohm_s_per_rad = p->gain_ohm_per_rad * period_s,
        .i_0_A2 = i_0_A2,
        .min_rad_s = p->min_rad_s,
        .max_rad_s = p->max_rad_s,
        .back_rad_s = p->back_rad_s,
        .down_pu = p->low_pu - 1.0f,
        .up_pu = p->high_pu - 1.0f,
        .speed_err_rad_s = p->speed_err_rad_s,
        .moved_rad_s = p->slew_rad_s2 * period_s,
        .quiet_periods = (uint32_t)(p->quiet_s / period_s + 0.5f),
        .dwell_gain_T_ohm = p->dwell_gain_ohm_per_s * period_s,
    };
    return true;
}

/* Less than the band allows was found while dwelling, and stays. */
static void come_back(const rs_tracking_config_t *cfg, rs_tracking_state_t *st, float low_ohm,
                      float frequency_rad_s)
{
    if ((frequency_rad_s < cfg->back_rad_s) && (st->delta_ohm >= low_ohm)) {
        st->delta_ohm = maxf(st->delta_ohm, RS_TRACKING_LEFT * st->delta_ohm);
    }
}

void rs_tracking_step(const rs_tracking_config_t *cfg, rs_tracking_state_t *st,
                      const rs_tracking_in_t *in)
{
    const float low_ohm = cfg->down_pu * in->Rs_start_ohm;
    const float along_A_rad_s = in->i_q_A * in->omega_s_hat_rad_s;
    const float i_q_A2 = in->i_q_A * in->i_q_A;
    const bool loaded = i_q_A2 >= cfg->i_0_A2;
    const float frequency_rad_s = absf(in->omega_s_hat_rad_s);
    if (loaded && (along_A_rad_s < 0.0f)) {
        come_back(cfg, st, low_ohm, frequency_rad_s);
    }
    if (in->changing || !(absf(in->moved_rad_s) <= cfg->moved_rad_s) ||
        !(absf(in->speed_err_rad_s) <= cfg->speed_err_rad_s)) {
        st->periods = 0u;
        return;
    }
    if (st->periods < cfg->quiet_periods) {
        st->periods++;
        return;
    }
    if (!(frequency_rad_s >= cfg->min_rad_s) || !(frequency_rad_s <= cfg->max_rad_s) || !loaded) {
        return;
    }
    const float step_ohm =
        cfg->gain_T_ohm_s_per_rad * in->e1_d_A * along_A_rad_s / (i_q_A2 + cfg->i_0_A2);
    st->delta_ohm = clampf(st->delta_ohm + step_ohm, minf(low_ohm, st->delta_ohm),
                           cfg->up_pu * in->Rs_start_ohm);
}

void rs_tracking_dwell(const rs_tracking_config_t *cfg, rs_tracking_state_t *st,
                       const rs_tracking_dwell_in_t *in)
{
    const ab_t pole_per_s = {in->tau_per_s, -in->omega_e_hat_rad_s};
    const float length_A2_per_s = sqrtf(ab_norm2(pole_per_s)) * ab_norm2(in->i_s_A);
    const float along_A2_per_s = ab_dot(ab_mul(in->i_s_A, pole_per_s), in->e1_A);
    st->periods = 0u;
    if (length_A2_per_s > cfg->i_0_A2 * in->tau_per_s) {
        const float step_ohm = cfg->dwell_gain_T_ohm * along_A2_per_s / length_A2_per_s;
        st->delta_ohm =
            clampf(st->delta_ohm + step_ohm, (RS_TRACKING_DWELL_LOW_PU - 1.0f) * in->Rs_start_ohm,
                   cfg->up_pu * in->Rs_start_ohm);
    }
}
