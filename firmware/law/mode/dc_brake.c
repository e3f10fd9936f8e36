#include "dc_brake.h"

#define DC_BRAKE_MAX_PERIODS 1e9f

/* A reference below this is a stop: .01 min^-1 and less. */
#define DC_BRAKE_STOP_RAD_S 1e-3f

bool dc_brake_init(dc_brake_config_t *cfg, const dc_brake_params_t *params, float period_s)
{
    *cfg = (dc_brake_config_t){0};
    if (is_zero(params->current_A)) {
        return true; /* off */
    }
    const float periods = params->least_s / period_s;
    if (!ALL_POSITIVE(params->current_A, params->slew_A_per_s) ||
        !ALL_NONNEGATIVE(params->from_rad_s, periods) || !(periods < DC_BRAKE_MAX_PERIODS)) {
        return false;
    }
    *cfg = (dc_brake_config_t){.current_A = params->current_A,
                               .from_rad_s = params->from_rad_s,
                               .step_A = params->slew_A_per_s * period_s,
                               .least_periods = (uint32_t)periods};
    return true;
}

bool dc_brake_wanted(const dc_brake_config_t *cfg, const dc_brake_state_t *st, bool acting,
                     const mode_in_t *in)
{
    if (!(cfg->current_A > 0.0f)) {
        return false;
    }
    const bool stop = (in->asked->aim != DRIVE_AIM_TORQUE) &&
                      (absf(in->asked->omega_e_ref_rad_s) <= DC_BRAKE_STOP_RAD_S);
    if (acting) {
        return stop || (st->periods < cfg->least_periods);
    }
    return stop && (absf(in->estimate->omega_e_rad_s) <= cfg->from_rad_s);
}

void dc_brake_start(dc_brake_state_t *st, ab_t i_s_A, float omega_e_rad_s)
{
    *st = (dc_brake_state_t){
        .current = {.i_before_A = i_s_A}, .i_ref_A = i_s_A, .omega_rad_s = omega_e_rad_s};
}

ab_t dc_brake_step(const dc_brake_config_t *cfg, const dc_current_config_t *current,
                   dc_brake_state_t *st, const mode_in_t *in)
{
    if (st->periods < cfg->least_periods) {
        st->periods++;
    }
    const ab_t behind_A = ab_sub((ab_t){cfg->current_A, 0.0f}, st->i_ref_A);
    st->i_ref_A = ab_add(st->i_ref_A, ab_clamp(behind_A, cfg->step_A));
    const dc_current_in_t current_in = {.i_ref_A = st->i_ref_A,
                                        .i_A = in->meas->i_s_A,
                                        .u_V = in->acting->ended_V,
                                        .Rs_ohm = in->Rs_ohm,
                                        .omega_rad_s = st->omega_rad_s};
    return dc_current_step(current, &st->current, &current_in);
}
