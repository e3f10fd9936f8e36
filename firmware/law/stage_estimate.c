#include "stages.h"

void stage_estimate(const drive_config_t *cfg, drive_state_t *st, const mode_in_t *in)
{
    const float Rs_extra_ohm = st->modes.premagnetise.Rs_delta_ohm + st->rs_tracking.delta_ohm;
    const bool taken_over = st->mode == MODE_TAKE_OVER;
    /* In I-f what is imposed is a better guess than what was wanted when the angle was lost. */
    const float prior_rad_s =
        taken_over ? st->modes.i_f.omega_rad_s : st->modes.vector.speed.omega_ref_rad_s;
    const estimator_in_t estimator_in = {
        .u_s_V = ab_sub(in->u_s_V, ab_scale(in->meas->i_s_A, Rs_extra_ohm)),
        .i_s_A = in->meas->i_s_A,
        .prior_rad_s = prior_rad_s,
        .frame_imposed = taken_over,
        .omega_frame_rad_s = prior_rad_s,
        .lambda_min_Wb = vector_lambda_min_Wb(&cfg->modes.vector, mode_running(in))};
    if (modes_oriented(st->mode) ||
        (taken_over && i_f_observable(&cfg->modes.i_f, &st->modes.i_f))) {
        estimator_step(&cfg->estimator, &st->estimator, &estimator_in);
    } else {
        /* Nothing to see: the rotor follows what is imposed, or stands. */
        estimator_hold(&cfg->estimator, &st->estimator, &estimator_in,
                       taken_over ? prior_rad_s : 0.0f);
    }
}

void stage_track_rs(const drive_config_t *cfg, drive_state_t *st, const mode_in_t *in)
{
    const vector_state_t *vector = &st->modes.vector;
    const estimate_t *e = in->estimate;
    const ab_t axis = mode_flux_axis(e, vector_lambda_min_Wb(&cfg->modes.vector, mode_running(in)));
    const float reference_rad_s = vector->speed.omega_ref_rad_s;
    const float moved_rad_s = absf(reference_rad_s - st->omega_ref_before_rad_s);
    const rs_tracking_in_t tracking_in = {
        .Rs_start_ohm = cfg->motor.Rs_ohm + st->modes.premagnetise.Rs_delta_ohm,
        .e1_d_A = ab_dot(axis, e->i_residual_A),
        .i_q_A = ab_cross(axis, in->meas->i_s_A),
        .omega_s_hat_rad_s = e->omega_s_rad_s,
        .speed_err_rad_s = reference_rad_s - vector->speed.omega_filtered_rad_s,
        .changing = vector->steer.moving || (moved_rad_s > 0.0f)};
    rs_tracking_step(&cfg->rs_tracking, &st->rs_tracking, &tracking_in);
    st->omega_ref_before_rad_s = reference_rad_s;
}
