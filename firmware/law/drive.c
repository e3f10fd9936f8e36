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
static void choose_mode(const drive_config_t *cfg, drive_state_t *st, drive_mode_t asked,
                        const mode_in_t *in)
{
    if (cfg->modes.vector_only && in->running) {
        st->mode = st->modes.i_f.active ? MODE_TAKE_OVER : MODE_VECTOR;
    } else {
        transition_choose(cfg, st, asked, in);
    }
}

/* Slow work of flux orientation: a turn of sixteen periods that stands still in other modes. */
static void slow_estimate(const drive_config_t *cfg, drive_state_t *st, const mode_in_t *in)
{
    vector_state_t *vector = &st->modes.vector;
    vector->slow_period = (vector->slow_period + 1u) % DRIVE_SLOW_PERIODS;
    if ((vector->slow_period == VECTOR_SLOW_TRACKING) && rs_tracking_on(&cfg->rs_tracking)) {
        stage_track_rs(cfg, st, in);
    }
}

/* The gates are on: estimator, mode, voltage, judgement. */
static modes_out_t act(const drive_config_t *cfg, drive_state_t *st, mode_in_t *in,
                       drive_mode_t asked, drive_out_t *out)
{
    choose_mode(cfg, st, asked, in);
    const bool open_loop = modes_open_loop(st->mode);
    if (open_loop) {
        in->u_s_V = in->u_duty_V; /* whatever the source: nothing is estimated */
    } else {
        stage_estimate(cfg, st, in);
    }
    if (modes_oriented(st->mode)) {
        slow_estimate(cfg, st, in);
    }
    modes_out_t mode = modes_step(&cfg->modes, &cfg->limits, &st->modes, st->mode, in);
    if (open_loop) {
        transition_after_open_loop(cfg, st, in, &mode);
    }
    out->faults |= mode.faults;
    out->premagnetising = mode.busy;
    stage_apply(cfg, st, &mode, out);
    stage_judge(cfg, st, in, out);
    return mode;
}

/* Gates off: nothing to estimate or control; limits and guard go on. */
static void rest(drive_state_t *st, drive_out_t *out)
{
    const torque_limits_state_t limits = st->limits;
    const guard_state_t guard = guard_at_rest(&st->guard);
    const uint32_t idle_periods = st->idle_periods;
    drive_reset(st);
    st->limits = limits;
    st->guard = guard;
    st->idle_periods = idle_periods;
    out->duty = (uvw_t){0.5f, 0.5f, 0.5f};
    out->u_s_V = (ab_t){0.0f, 0.0f};
    out->i_ref_A = (dq_t){0.0f, 0.0f};
    out->i_A = (dq_t){0.0f, 0.0f};
    out->premagnetising = false;
}

static mode_in_t mode_input(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *in,
                            const measured_t *meas)
{
    const acting_voltage_out_t u = acting_voltage_step(&cfg->acting, &st->acting, meas->u_line_V,
                                                       st->estimator.estimate.omega_s_rad_s);
    return (mode_in_t){.estimate = &st->estimator.estimate,
                       .limits = &st->limits,
                       .i_s_A = meas->i_s_A,
                       .u_dc_V = meas->u_dc_V,
                       .u_duty_V = u.duty_V,
                       .u_s_V = u.u_s_V,
                       .u_pending_V = st->acting.pending_V,
                       .Rs_ohm = drive_rs_ohm(cfg, st),
                       .aim = in->aim,
                       .omega_e_ref_rad_s = in->omega_e_ref_rad_s,
                       .torque_ref_Nm = in->torque_ref_Nm,
                       .i_d_ref_A = in->i_d_ref_A,
                       .running = in->mode == DRIVE_RUN};
}

/* What the guard looks at, beside the sample and the duty. */
static void show_guard(const drive_config_t *cfg, const drive_state_t *st, const mode_in_t *in,
                       const request_t *request, guard_in_t *guard)
{
    const bool estimated = !modes_open_loop(st->mode);
    guard->u_duty_V = in->u_duty_V;
    guard->u_s_V = in->u_s_V;
    guard->omega_ref_rad_s = in->omega_e_ref_rad_s;
    guard->i_ref_A = request->i_ref_A;
    guard->axis = request->axis;
    guard->lambda_ref_Wb =
        cfg->modes.vector.flux.lambda_ref_Wb - st->modes.vector.flux_reduction_Wb;
    guard->Rs_ohm = drive_rs_ohm(cfg, st);
    guard->slot = st->supervisor.periods;
    guard->standing = (st->mode == MODE_PREMAGNETISE) || (st->mode == MODE_COMMISSIONING);
    guard->oriented = st->mode == MODE_VECTOR;
    /* After a flying start nobody knows what the legs lose, if that was to be found. */
    guard->sensed =
        estimated && (cfg->acting.source == ACTING_VOLTAGE_SENSORS) &&
        (st->modes.premagnetise.leg_loss_found || !cfg->modes.premagnetise.identify_leg_loss);
}

/* Of the state, once per turn of whatever counts now. */
static inline bool state_is_due(const drive_state_t *st, drive_mode_t asked)
{
    const uint32_t turn = (asked != DRIVE_RUN)        ? st->idle_periods
                          : modes_open_loop(st->mode) ? st->modes.vector.slow_period
                                                      : st->supervisor.periods;
    return turn == DRIVE_STATE_PERIOD;
}

void drive_step(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *in,
                drive_out_t *out)
{
    guard_in_t guard = {.meas = &out->meas, .estimate = &st->estimator.estimate};
    float state_sum = state_sum_fast(st);
    measurement_step(&cfg->measurement, &st->measurement, &in->sample, &out->meas);
    link_limit_step(&cfg->limits.link, &st->limits.link, out->meas.u_dc_V);
    out->faults = 0u;
    if (in->mode == DRIVE_OFF) {
        rest(st, out);
    } else {
        mode_in_t mode_in = mode_input(cfg, st, in, &out->meas);
        const modes_out_t mode = act(cfg, st, &mode_in, in->mode, out);
        out->u_s_V = mode_in.u_s_V;
        show_guard(cfg, st, &mode_in, &mode.request, &guard);
    }
    if (in->mode != DRIVE_RUN) {
        st->idle_periods = (st->idle_periods + 1u) % DRIVE_SLOW_PERIODS;
        if (st->idle_periods == 0u) {
            stage_heat(cfg, st, in->mode, out);
        }
    }
    if (state_is_due(st, in->mode)) {
        state_sum += state_sum_slow(st);
    }
    guard.duty = out->duty;
    guard.state_sum = state_sum;
    out->faults |= guard_step(&cfg->guard, &st->guard, &guard);
    out->faults |= torque_limits_warnings(&st->limits, in->mode == DRIVE_RUN);
}
