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

/* Modulates what the vector control is asked for. */
COLD static void dwell(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                       ab_t i_s_A)
{
    const vector_config_t *vector = &cfg->modes.vector;
    const estimate_t *e = &st->estimator.estimate;
    const ab_t axis = mode_flux_axis(e, vector_lambda_min_Wb(vector, asked->mode == DRIVE_RUN));
    const dwell_in_t dwell_in = {.omega_s_hat_rad_s = e->omega_s_rad_s,
                                 .i_q_A = ab_cross(axis, i_s_A),
                                 .omega_ref_rad_s = vector_unmodulated_rad_s(&st->modes.vector),
                                 .steered = vector_steers(&st->modes.vector),
                                 .speed_free = asked->aim == DRIVE_AIM_TORQUE};
    const bool idle = dwell_idle(&st->dwell);
    dwell_step(&cfg->dwell, &st->dwell, &dwell_in);
    if (!idle) {
        const vector_modulation_t modulation = {.speed_rad_s = st->dwell.speed_rad_s,
                                                .flux_pu = st->dwell.reduction_pu,
                                                .rate_pu_per_s = st->dwell.rate_pu_per_s};
        vector_modulate(vector, &st->modes.vector, modulation);
    }
}

/* Rs of a field that stands. */
COLD static void track_standing(const drive_config_t *cfg, drive_state_t *st, ab_t i_s_A)
{
    const estimate_t *e = &st->estimator.estimate;
    const rs_tracking_dwell_in_t tracking_in = {.Rs_start_ohm = cfg->motor.Rs_ohm +
                                                                st->modes.premagnetise.Rs_delta_ohm,
                                                .tau_per_s = cfg->motor.tau_per_s,
                                                .omega_e_hat_rad_s = e->omega_e_rad_s,
                                                .i_s_A = i_s_A,
                                                .e1_A = e->i_residual_A};
    rs_tracking_dwell(&cfg->rs_tracking, &st->rs_tracking, &tracking_in);
}

/* M at nominal flux. */
static void track_m(const drive_config_t *cfg, drive_state_t *st, const mode_in_t *in)
{
    const vector_state_t *vector = &st->modes.vector;
    if (!(absf(vector->flux_reduction_Wb) > 0.0f)) {
        const m_tracking_in_t tracking_in = {.lambda_hat_Wb = in->estimate->lambda_Wb,
                                             .i_d_A = vector->plan.i_d_ref_A,
                                             .omega_s_hat_rad_s = in->estimate->omega_s_rad_s};
        m_tracking_step(&cfg->m_tracking, &st->m_tracking, &tracking_in);
    }
}

/* What the field does not turn. */
static void track_offsets(const drive_config_t *cfg, drive_state_t *st)
{
    const estimate_t *e = &st->estimator.estimate;
    const offset_tracking_in_t in = {.e1_A = e->i_residual_A,
                                     .omega_e_hat_rad_s = e->omega_e_rad_s,
                                     .omega_s_hat_rad_s = e->omega_s_rad_s};
    st->measurement.moved_A = offset_tracking_step(&cfg->offset_tracking, &st->offset_tracking,
                                                   st->measurement.moved_A, &in);
}

/* The negative sequence that the sensors show of balanced voltages and currents. */
static void track_unbalance(const drive_config_t *cfg, drive_state_t *st, const measured_t *meas)
{
    const ab_t expected_V = st->acting.lagging_V;
    const unbalance_tracking_in_t in = {.residual_V = ab_sub(meas->u_line_V, expected_V),
                                        .expected_V = expected_V,
                                        .i_s_A = meas->i_s_A,
                                        .i_sum_A = meas->i_A.u + meas->i_A.v + meas->i_A.w,
                                        .omega_s_hat_rad_s = st->estimator.estimate.omega_s_rad_s};
    unbalance_tracking_step(&cfg->unbalance_tracking, &st->measurement.unbalance, &in);
}

static void track_sensors(const drive_config_t *cfg, drive_state_t *st, const measured_t *meas)
{
    if ((st->slot == SLOT_OFFSET_TRACKING) && offset_tracking_on(&cfg->offset_tracking)) {
        track_offsets(cfg, st);
    }
    if ((st->slot == SLOT_UNBALANCE_TRACKING) && unbalance_tracking_on(&cfg->unbalance_tracking)) {
        track_unbalance(cfg, st, meas);
    }
}

void stage_slow(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                const drive_out_t *out)
{
    const mode_in_t in = stage_view(cfg, st, asked, out);
    if ((st->slot == SLOT_DWELL) && dwell_on(&cfg->dwell)) {
        dwell(cfg, st, asked, out->meas.i_s_A);
    }
    if ((st->slot == SLOT_RS_TRACKING) && rs_tracking_on(&cfg->rs_tracking)) {
        if (!st->dwell.standing && dwell_idle(&st->dwell)) {
            track_rs(cfg, st, &in);
        } else {
            track_standing(cfg, st, out->meas.i_s_A);
        }
    }
    if ((st->slot == SLOT_M_TRACKING) && m_tracking_on(&cfg->m_tracking)) {
        track_m(cfg, st, &in);
    }
    track_sensors(cfg, st, &out->meas);
    vector_slow(&cfg->modes.vector, &cfg->limits, &st->modes.vector, &in);
}
