#include "stages.h"

#include "transition.h"

/* Caught in turning: by itself. Lost orientation: I-f turns the frame; fast enough the estimator
 * sees the rotor again; below, the rotor follows what is imposed, or nothing helps. Else at rest.
 */
COLD static void estimate(const drive_config_t *cfg, drive_state_t *st, const drive_out_t *out)
{
    i_f_state_t *i_f = &st->modes.i_f;
    const bool beside_i_f = st->mode == MODE_TAKE_OVER;
    estimator_in_t in = stage_estimator_in(st, out);
    if (beside_i_f && i_f_observable(&cfg->modes.i_f, i_f)) {
        in.frame_imposed = true;
        in.omega_frame_rad_s = i_f->omega_rad_s;
        i_f_see_flux(&cfg->modes.i_f, i_f, in.u_s_V, in.i_s_A);
    }
    if (in.frame_imposed || (st->mode == MODE_REMAGNETISE)) {
        estimator_step(&cfg->estimator, &st->estimator, &in);
    } else {
        estimator_hold(&cfg->estimator, &st->estimator, &in, beside_i_f ? i_f->omega_rad_s : 0.0f);
    }
}

/* Caught in turning: flux-oriented, without torque. */
static request_t remagnetise(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                             const drive_out_t *out)
{
    const estimate_t *e = &st->estimator.estimate;
    if (stage_slow_is_due(cfg, st, slot_is_among(st->slot, VECTOR_SLOW_SLOTS))) {
        stage_slow(cfg, st, asked, out);
    }
    return (request_t){.kind = REQUEST_CURRENT,
                       .axis = mode_flux_axis(e, vector_lambda_min_Wb(&cfg->modes.vector, false)),
                       .i_ref_A = vector_wait(&st->modes.vector, e->omega_e_rad_s)};
}

/* Estimator and request. */
static request_t wanted(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                        drive_out_t *out)
{
    const bool open_loop = modes_open_loop(st->mode);
    if (open_loop) {
        out->u_s_V = st->acting.ended_V; /* whatever the source: nothing is estimated */
    } else {
        estimate(cfg, st, out);
        if (st->mode == MODE_REMAGNETISE) {
            return remagnetise(cfg, st, asked, out);
        }
    }
    const mode_in_t in = stage_view(cfg, st, asked, out);
    request_t request = modes_step(&cfg->modes, &st->modes, st->mode, &in, &out->faults);
    if (st->modes.premagnetise.measurement.mirror) {
        st->modes.premagnetise.measurement.mirror = false;
        current_control_mirror(&st->voltage.current);
    }
    if (open_loop) {
        transition_after_open_loop(cfg, st, &in, &request);
    }
    return request;
}

void stage_other_mode(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                      drive_out_t *out)
{
    const bool taken_over = st->mode == MODE_TAKE_OVER;
    const request_t request = wanted(cfg, st, asked, out);
    stage_apply(cfg, st, &request, out);
    if (taken_over) {
        supervisor_add(&st->supervisor, out->u_s_V, out->meas.i_s_A, drive_rs_ohm(cfg, st));
        stage_judge(cfg, st, asked, out);
    }
}
