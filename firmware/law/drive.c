#include "drive.h"

#include "fault.h"
#include "stages.h"
#include "state_sum.h"
#include "transition.h"

void drive_reset(drive_state_t *st)
{
    const measurement_state_t measurement = st->measurement;
    *st = (drive_state_t){0};
    st->measurement = measurement;
}

COLD bool drive_standing(const drive_state_t *st, float omega_e_max_rad_s)
{
    /* I-f does not go by the speed controller's reference. */
    const float reference_rad_s =
        st->modes.i_f.active ? st->modes.i_f.omega_rad_s : st->modes.vector.speed.omega_ref_rad_s;
    return (absf(reference_rad_s) <= omega_e_max_rad_s) &&
           (absf(st->estimator.estimate.omega_e_rad_s) <= omega_e_max_rad_s);
}

/* The mode of this period. With nothing but vector control configured there is little to choose. */
static inline void choose_mode(const drive_config_t *cfg, drive_state_t *st, const mode_in_t *in)
{
    if (cfg->modes.vector_only && mode_running(in)) {
        st->mode = st->modes.i_f.active ? MODE_TAKE_OVER : MODE_VECTOR;
    } else {
        transition_choose(cfg, st, in);
    }
}

/* Slow work of flux orientation: a turn of sixteen periods that stands still in other modes. */
static inline void slow_estimate(const drive_config_t *cfg, drive_state_t *st, const mode_in_t *in)
{
    vector_state_t *vector = &st->modes.vector;
    vector->slow_period = (vector->slow_period + 1u) % DRIVE_SLOW_PERIODS;
    if ((vector->slow_period == VECTOR_SLOW_TRACKING) && rs_tracking_on(&cfg->rs_tracking)) {
        stage_track_rs(cfg, st, in);
    }
}

/* The gates are on: acting voltage, estimator, mode, voltage, judgement. */
static inline void act(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                       drive_out_t *out)
{
    mode_in_t in = {.asked = asked,
                    .meas = &out->meas,
                    .estimate = &st->estimator.estimate,
                    .limits = &st->limits,
                    .acting = &st->acting,
                    .Rs_ohm = drive_rs_ohm(cfg, st)};
    in.u_s_V = acting_voltage_step(&cfg->acting, &st->acting, out->meas.u_line_V,
                                   st->estimator.estimate.omega_s_rad_s);
    choose_mode(cfg, st, &in);
    const bool open_loop = modes_open_loop(st->mode);
    if (open_loop) {
        in.u_s_V = st->acting.ended_V; /* whatever the source: nothing is estimated */
    } else {
        stage_estimate(cfg, st, &in);
    }
    if (modes_oriented(st->mode)) {
        slow_estimate(cfg, st, &in);
    }
    modes_step(&cfg->modes, &cfg->limits, &st->modes, st->mode, &in, &out->mode);
    if (open_loop) {
        transition_after_open_loop(cfg, st, &in, &out->mode);
    }
    out->u_s_V = in.u_s_V;
    out->faults |= out->mode.faults;
    stage_apply(cfg, st, out);
    stage_judge(cfg, st, &in, out);
}

/* Gates off: nothing to estimate or control; limits and guard go on. */
COLD static void rest(drive_state_t *st, drive_out_t *out)
{
    const torque_limits_state_t limits = st->limits;
    const guard_state_t guard = guard_at_rest(&st->guard);
    const uint32_t idle_periods = st->idle_periods;
    drive_reset(st);
    st->limits = limits;
    st->guard = guard;
    st->idle_periods = idle_periods;
    const measured_t meas = out->meas;
    *out = (drive_out_t){.duty = {0.5f, 0.5f, 0.5f}, .meas = meas};
}

/* Outside RUN motor and inverter cool, or are magnetised. */
COLD static void idle(const drive_config_t *cfg, drive_state_t *st, drive_mode_t mode,
                      drive_out_t *out)
{
    st->idle_periods = (st->idle_periods + 1u) % DRIVE_SLOW_PERIODS;
    if (st->idle_periods == 0u) {
        stage_heat(cfg, st, mode, out);
    }
}

/* Of the state, once per turn of whatever counts now. */
static inline bool state_is_due(const drive_state_t *st, drive_mode_t asked)
{
    const uint32_t turn = (asked != DRIVE_RUN)        ? st->idle_periods
                          : modes_open_loop(st->mode) ? st->modes.vector.slow_period
                                                      : st->supervisor.periods;
    return turn == DRIVE_STATE_PERIOD;
}

HOT void drive_step(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *in,
                    drive_out_t *out)
{
    float state_sum = state_sum_fast(st);
    measurement_step(&cfg->measurement, &st->measurement, &in->sample, &out->meas);
    link_limit_step(&cfg->limits.link, &st->limits.link, out->meas.u_dc_V);
    out->faults = 0u;
    if (in->mode == DRIVE_OFF) {
        rest(st, out);
    } else {
        act(cfg, st, in, out);
    }
    if (in->mode != DRIVE_RUN) {
        idle(cfg, st, in->mode, out);
    }
    if (state_is_due(st, in->mode)) {
        state_sum += state_sum_slow(st);
    }
    out->faults |= torque_limits_warnings(&st->limits, in->mode == DRIVE_RUN) |
                   stage_guard(cfg, st, in, out, state_sum);
}
