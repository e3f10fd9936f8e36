#include "stages.h"

/* Rs tracking sees the residual along the flux. */
static void track_rs(const drive_config_t *cfg, drive_state_t *st, const mode_in_t *in)
{
    const vector_state_t *vector = &st->modes.vector;
    const estimate_t *e = in->estimate;
    const ab_t axis = mode_flux_axis(e, vector_lambda_min_Wb(&cfg->modes.vector, mode_running(in)));
    const float reference_rad_s = vector->speed.omega_ref_rad_s;
    const rs_tracking_in_t tracking_in = {
        .Rs_start_ohm = cfg->motor.Rs_ohm + st->modes.premagnetise.Rs_delta_ohm,
        .e1_d_A = ab_dot(axis, e->i_residual_A),
        .i_q_A = ab_cross(axis, in->meas->i_s_A),
        .omega_s_hat_rad_s = e->omega_s_rad_s,
        .speed_err_rad_s = reference_rad_s - vector->speed.omega_filtered_rad_s,
        .moved_rad_s = reference_rad_s - st->omega_ref_before_rad_s,
        .changing = vector->steer.moving};
    rs_tracking_step(&cfg->rs_tracking, &st->rs_tracking, &tracking_in);
    st->omega_ref_before_rad_s = reference_rad_s;
}

void stage_slow(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                const drive_out_t *out)
{
    const mode_in_t in = stage_view(cfg, st, asked, out);
    if ((st->slot == SLOT_RS_TRACKING) && rs_tracking_on(&cfg->rs_tracking)) {
        track_rs(cfg, st, &in);
    }
    vector_slow(&cfg->modes.vector, &cfg->limits, &st->modes.vector, &in);
}
