#include "speed_control.h"

/* The gain falls by itself while the torque swings, and comes back: 1 - lost of it is left. */
static void look_for_swing(const speed_control_config_t *cfg, speed_control_state_t *st)
{
    const float fast_A = st->i_q_A - st->pi.x - st->slow_A;
    const float moved_rad_s = st->omega_ref_rad_s - st->ref_before_rad_s;
    const float asked_A = absf(moved_rad_s * cfg->asked_A_per_rad_s);
    const float swing =
        clampf((absf(fast_A) - asked_A) * cfg->swing_per_A, 0.0f, SPEED_CONTROL_SWING_MAX);
    st->ref_before_rad_s = st->omega_ref_rad_s;
    st->slow_A += cfg->swing_share * fast_A;
    st->lost = clampf(st->lost + SPEED_CONTROL_SWING_MEAN * cfg->swing_share *
                                     (0.5f * swing - 0.5f - st->lost),
                      0.0f, cfg->lost_max);
}

void speed_control_schedule(const speed_control_config_t *cfg, speed_control_state_t *st,
                            float flux_pu, float weakened_pu)
{
    const float flux = minf(flux_pu, 1.0f);
    const float bound = minf(SPEED_CONTROL_WEAKENED * cfg->slip_room * weakened_pu, 1.0f);
    const float left = 1.0f - cfg->weakening * (1.0f - flux * bound);
    const float off_rad_s = absf(st->omega_ref_rad_s - st->omega_filtered_rad_s);
    const float above_rad_s = absf(st->omega_filtered_rad_s) - cfg->slow_rad_s;
    const float speed = clampf(cfg->gain_extra_per_rad_s * above_rad_s, 0.0f, cfg->gain_extra_max);
    const float error =
        cfg->gain_extra_per_rad_s * (above_rad_s + SPEED_CONTROL_ERROR_SPEED * off_rad_s);
    const float more = maxf(speed, minf(error, SPEED_CONTROL_ERROR_MAX * cfg->gain_extra_max));
    /* left may be negative: an error never takes gain away. */
    st->gain_extra = speed * left;
    const float extra = maxf(st->gain_extra, more * left);
    look_for_swing(cfg, st);
    st->gain_change = extra - st->lost * (1.0f + extra);
}
