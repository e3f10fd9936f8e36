#include "drive.h"

#include "due.h"
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

/* Blend of the voltages, and how far the delay turns, at the speed of the flux. */
COLD static void turn_angles(const drive_config_t *cfg, drive_state_t *st)
{
    acting_voltage_blend(&cfg->acting, &st->acting, st->estimator.estimate.omega_s_rad_s);
    voltage_angle(&cfg->voltage, &st->voltage, st->estimator.estimate.omega_s_rad_s);
}

/* One period of vector control: estimator, slow work when it is due, speed controller. */
static inline request_t vector_control(const drive_config_t *cfg, drive_state_t *st,
                                       const drive_in_t *asked, uint32_t due, drive_out_t *out)
{
    const vector_config_t *vector = &cfg->modes.vector;
    const estimate_t *e = &st->estimator.estimate;
    estimator_in_t in = stage_estimator_in(st, out);
    in.expected_step_rad_s = st->modes.vector.speed.expected_step_rad_s;
    estimator_step(&cfg->estimator, &st->estimator, &in);
    supervisor_add(&st->supervisor, out->u_s_V, out->meas.i_s_A, drive_rs_ohm(cfg, st));
    if (stage_slow_is_due(cfg, st, (due & DUE_SLOW) != 0u)) {
        stage_slow(cfg, st, asked, out);
    }
    dq_t i_ref_A = vector_step(vector, &st->modes.vector, e->omega_e_rad_s);
    if (vector_rides_through(vector, &st->modes.vector, out->meas.u_dc_V)) {
        const mode_in_t view = stage_view(cfg, st, asked, out);
        i_ref_A.q = vector_ride_through(vector, &st->modes.vector, &view, i_ref_A.q, &out->faults);
    }
    return (request_t){.kind = REQUEST_CURRENT,
                       .axis = mode_flux_axis(e, vector->lambda_min_Wb),
                       .i_ref_A = i_ref_A};
}

/* The gates are on: acting voltage, mode with its estimator, voltage, judgement. */
static inline void act(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                       uint32_t due, drive_out_t *out)
{
    if ((asked->mode != st->asked) || !cfg->modes.fixed) {
        transition_choose(cfg, st, asked, out);
    }
    if ((due & DUE_ANGLES) != 0u) {
        turn_angles(cfg, st);
    }
    out->u_s_V = acting_voltage_step(&cfg->acting, &st->acting, out->meas.u_line_V);
    if (st->mode == MODE_VECTOR) {
        const request_t request = vector_control(cfg, st, asked, due, out);
        stage_apply(cfg, st, &request, out);
        if ((due & DUE_SUPERVISOR) != 0u) {
            stage_judge(cfg, st, asked, out);
        }
    } else {
        stage_other_mode(cfg, st, asked, out);
    }
}

/* Gates off: nothing to estimate or control; limits and guard go on. */
COLD static void rest(drive_state_t *st, drive_out_t *out)
{
    const torque_limits_state_t limits = st->limits;
    const guard_kept_t guard = guard_kept(&st->guard);
    heating_state_t heating = st->heating;
    heating.slip_rad_s = 0.0f;
    const m_tracking_state_t m_tracking = st->m_tracking;
    const uint32_t slot = st->slot;
    drive_reset(st);
    st->limits = limits;
    st->heating = heating;
    st->m_tracking = m_tracking;
    guard_restore(&st->guard, &guard);
    st->slot = slot;
    *out = (drive_out_t){.duty = {0.5f, 0.5f, 0.5f}, .meas = out->meas};
}

/* Usually there is none, and nothing to do. */
static inline void tell(drive_out_t *out, uint32_t faults)
{
    if (faults != 0u) {
        out->faults |= faults;
    }
}

/* Sensors in every period, second looks in their slots. */
static inline void guarded(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                           uint32_t due, drive_out_t *out)
{
    if (asked->mode != DRIVE_OFF) {
        const guard_sensors_t sensors = {.meas = &out->meas,
                                         .u_V = ab_by_parts(st->acting.ended_V),
                                         .window_ended = (due & DUE_CURRENT) != 0u,
                                         .motor_known = asked->mode != DRIVE_COMMISSION};
        tell(out, guard_sensors(&cfg->guard, &st->guard, &sensors));
    } else {
        guard_look_at_noise(&cfg->guard, &st->guard, &out->meas);
    }
    if ((due & DUE_GUARD) != 0u) {
        tell(out, stage_guard_look(cfg, st, asked, out));
    }
    if ((st->mode == MODE_PREMAGNETISE) || (st->mode == MODE_COMMISSIONING)) {
        tell(out, guard_standing(&cfg->guard, &st->guard, out->meas.i_s_A,
                                 st->estimator.estimate.i_residual_A));
    }
}

HOT void drive_step(const drive_config_t *cfg, drive_state_t *st, const measurement_in_t *sample,
                    const drive_in_t *in, drive_out_t *out)
{
    st->slot = slot_next(st->slot);
    const uint32_t due = due_in[st->slot];
    const float state_sum = state_sum_due(st, (due & DUE_STATE) != 0u);
    measurement_step(&cfg->measurement, &st->measurement, sample, &out->meas);
    link_limit_step(&cfg->limits.link, &st->limits.link, out->meas.u_dc_V);
    out->faults = 0u;
    if (in->mode != DRIVE_OFF) {
        act(cfg, st, in, due, out);
    } else if ((st->asked != DRIVE_OFF) || (st->slot == SLOT_REST)) {
        rest(st, out);
    } else {
        /* at rest already */
    }
    if ((due & DUE_HEAT) != 0u) {
        stage_heat(cfg, st, in->mode, out);
    }
    tell(out, torque_limits_warnings(&st->limits, in->mode == DRIVE_RUN));
    const guard_in_t looked_at = {.meas = &out->meas,
                                  .state_sum = state_sum,
                                  .omega_e_hat_rad_s = st->estimator.estimate.omega_e_rad_s};
    tell(out, guard_step(&cfg->guard, &st->guard, &looked_at));
    guarded(cfg, st, in, due, out);
}
