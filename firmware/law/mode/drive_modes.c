#include "drive_modes.h"

#define DRIVE_MODES_MAX_PERIODS 1e9f

/* A reference below this is a stop: .01 min^-1 and less. */
#define DRIVE_MODES_STOP_RAD_S 1e-3f

static bool init_brake(drive_modes_config_t *cfg, const drive_modes_params_t *params,
                       float period_s)
{
    if (!(params->brake_A > 0.0f) && nonnegativef(params->brake_A)) {
        return true; /* off */
    }
    const float periods = params->brake_s / period_s;
    if (!positivef(params->brake_A) || !nonnegativef(params->brake_from_rad_s) ||
        !nonnegativef(periods) || !(periods < DRIVE_MODES_MAX_PERIODS) ||
        !positivef(params->brake_slew_A_per_s)) {
        return false;
    }
    cfg->brake_A = params->brake_A;
    cfg->brake_from_rad_s = params->brake_from_rad_s;
    cfg->brake_step_A = params->brake_slew_A_per_s * period_s;
    cfg->brake_periods = (uint32_t)periods;
    return true;
}

bool drive_modes_init(drive_modes_config_t *cfg, const drive_modes_params_t *params,
                      const motor_model_t *motor, float period_s)
{
    *cfg = (drive_modes_config_t){.control = params->control};
    if ((params->control != DRIVE_CONTROL_VECTOR) &&
        (params->control != DRIVE_CONTROL_VOLTS_PER_HERTZ) &&
        (params->control != DRIVE_CONTROL_IMPRESSED)) {
        return false;
    }
    cfg->any_open = (params->control != DRIVE_CONTROL_VECTOR) || params->flying.enable ||
                    (params->brake_A > 0.0f);
    cfg->ride_through = params->mains.u_lost_V > 0.0f;
    return flux_reference_init(&cfg->level, &params->level, motor,
                               period_s * (float)FLUX_REFERENCE_PERIODS) &&
           flying_start_init(&cfg->flying, &params->flying, motor, period_s) &&
           (!cfg->any_open ||
            dc_current_init(&cfg->standing, params->standing_bandwidth_rad_s, motor, period_s)) &&
           ((params->control != DRIVE_CONTROL_VOLTS_PER_HERTZ) ||
            volts_per_hertz_init(&cfg->volts, &params->volts, period_s)) &&
           mains_loss_init(&cfg->mains, &params->mains, motor, period_s) &&
           init_brake(cfg, params, period_s);
}

/* Wanted while the reference is zero; once begun it lasts its time. */
static bool brakes(const drive_modes_config_t *cfg, const drive_modes_state_t *st,
                   const drive_modes_in_t *in)
{
    if (!(cfg->brake_A > 0.0f) || in->lost) {
        return false;
    }
    const bool stop = !in->torque && (absf(in->omega_ref_rad_s) <= DRIVE_MODES_STOP_RAD_S);
    if (st->open == DRIVE_OPEN_BRAKE) {
        return stop || (st->brake_periods < cfg->brake_periods);
    }
    return stop && (absf(in->omega_hat_rad_s) <= cfg->brake_from_rad_s);
}

static drive_open_t selected(const drive_modes_config_t *cfg, const drive_modes_state_t *st,
                             const drive_modes_in_t *in)
{
    if (!in->running) {
        const bool search = cfg->flying.enable && (st->flying.phase == FLYING_START_SEARCH);
        return search ? DRIVE_OPEN_SEARCH : DRIVE_OPEN_NONE;
    }
    if (cfg->control == DRIVE_CONTROL_VOLTS_PER_HERTZ) {
        return DRIVE_OPEN_VOLTS;
    }
    if (cfg->control == DRIVE_CONTROL_IMPRESSED) {
        return DRIVE_OPEN_IMPRESSED;
    }
    return brakes(cfg, st, in) ? DRIVE_OPEN_BRAKE : DRIVE_OPEN_NONE;
}

bool drive_modes_select(const drive_modes_config_t *cfg, drive_modes_state_t *st,
                        const drive_modes_in_t *in)
{
    const drive_open_t before = st->open;
    st->open = selected(cfg, st, in);
    if ((st->open == DRIVE_OPEN_BRAKE) && (before != DRIVE_OPEN_BRAKE)) {
        st->standing = (dc_current_state_t){.i_before_A = in->i_A};
        st->brake_i_ref_A = in->i_A;
        st->brake_omega_rad_s = in->omega_hat_rad_s;
        st->brake_periods = 0u;
    }
    if ((st->open == DRIVE_OPEN_VOLTS) && (before != DRIVE_OPEN_VOLTS) &&
        (st->flying.phase == FLYING_START_CAUGHT)) {
        volts_per_hertz_start(&cfg->volts, &st->volts, in->lambda_Wb, in->omega_hat_rad_s);
    }
    return (before == DRIVE_OPEN_BRAKE) && (st->open != DRIVE_OPEN_BRAKE);
}

static ab_t stand(const drive_modes_config_t *cfg, drive_modes_state_t *st,
                  const drive_modes_in_t *in, ab_t i_ref_A, float omega_rad_s)
{
    const dc_current_in_t standing_in = {.i_ref_A = i_ref_A,
                                         .i_A = in->i_A,
                                         .u_V = in->u_V,
                                         .Rs_ohm = in->Rs_ohm,
                                         .omega_rad_s = omega_rad_s};
    return dc_current_step(&cfg->standing, &st->standing, &standing_in);
}

static ab_t brake_voltage(const drive_modes_config_t *cfg, drive_modes_state_t *st,
                          const drive_modes_in_t *in)
{
    if (st->brake_periods < cfg->brake_periods) {
        st->brake_periods++;
    }
    const ab_t behind_A = ab_sub((ab_t){cfg->brake_A, 0.0f}, st->brake_i_ref_A);
    st->brake_i_ref_A = ab_add(st->brake_i_ref_A, ab_clamp(behind_A, cfg->brake_step_A));
    return stand(cfg, st, in, st->brake_i_ref_A, st->brake_omega_rad_s);
}

ab_t drive_modes_voltage(const drive_modes_config_t *cfg, drive_modes_state_t *st,
                         const drive_modes_in_t *in)
{
    if (st->open == DRIVE_OPEN_VOLTS) {
        return volts_per_hertz_step(&cfg->volts, &st->volts, in->omega_ref_rad_s, in->i_A,
                                    in->u_dc_V);
    }
    if (st->open == DRIVE_OPEN_BRAKE) {
        return brake_voltage(cfg, st, in);
    }
    const ab_t i_ref_A = {st->flying.current_A, 0.0f};
    const ab_t u_V = stand(cfg, st, in, i_ref_A, st->flying.rough_rad_s);
    flying_start_step(&cfg->flying, &st->flying, st->standing.e_V, in->i_A);
    return u_V;
}
