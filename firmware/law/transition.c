#include "transition.h"

#include "fault.h"
#include "stages.h"

/* The direct current along alpha goes on as magnetising current; all else starts from rest. */
static void stand_still(const drive_config_t *cfg, drive_state_t *st, float i_A)
{
    const estimator_seed_t seed = {.i_s_A = {i_A, 0.0f},
                                   .lambda_r_Wb = {cfg->motor.M_H * i_A, 0.0f}};
    estimator_seed(&cfg->estimator, &st->estimator, &seed);
    vector_rest(&st->modes.vector);
}

/* I-f begins at the speed a flying start has found. */
static void begin_i_f(const drive_config_t *cfg, drive_state_t *st, const mode_in_t *in)
{
    const estimate_t *e = in->estimate;
    i_f_start(&st->modes.i_f, in->meas->i_s_A, e->omega_e_rad_s);
    current_control_keep_emf(&cfg->voltage.current, &st->voltage.current, e->omega_e_rad_s,
                             e->lambda_Wb);
}

/* What was modulated is as it would be without. */
static void stop_dwelling(const drive_config_t *cfg, drive_state_t *st)
{
    st->dwell = (dwell_state_t){0};
    vector_modulate(&cfg->modes.vector, &st->modes.vector, (vector_modulation_t){0});
}

static void begin(const drive_config_t *cfg, drive_state_t *st, const mode_in_t *in,
                  mode_id_t before)
{
    const estimate_t *e = in->estimate;
    const bool at_rest = before == MODE_OFF; /* all of the state was cleared */
    if (before == MODE_DC_BRAKE) {
        stand_still(cfg, st, in->meas->i_s_A.alpha);
    }
    if (st->mode == MODE_DC_BRAKE) {
        dc_brake_start(&st->modes.brake, in->meas->i_s_A, e->omega_e_rad_s);
    } else if (st->mode == MODE_I_F) {
        begin_i_f(cfg, st, in);
    } else if ((st->mode == MODE_VOLTS_PER_HERTZ) &&
               (st->modes.flying.phase == FLYING_START_CAUGHT)) {
        volts_per_hertz_start(&cfg->modes.volts, &st->modes.volts, e->lambda_r_hat_Wb,
                              e->omega_e_rad_s);
    } else {
        /* begins from rest, or goes on */
    }
    if (!at_rest && (st->mode != MODE_VECTOR)) {
        if (st->mode != MODE_TAKE_OVER) {
            st->supervisor = (supervisor_state_t){0};
        }
        stop_dwelling(cfg, st);
    }
}

void transition_choose(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                       const drive_out_t *out)
{
    const mode_in_t in = stage_view(cfg, st, asked, out);
    const mode_id_t before = st->mode;
    if (!mode_running(&in)) {
        st->modes.i_f = (i_f_state_t){0};
    }
    st->asked = asked->mode;
    st->mode = modes_selected(&cfg->modes, &st->modes, before, &in);
    if (st->mode != before) {
        begin(cfg, st, &in, before);
    }
}

/* The search knows speed and flux: estimator and controllers go on from there. */
static void catch_motor(const drive_config_t *cfg, drive_state_t *st, const mode_in_t *in,
                        request_t *request)
{
    const flying_start_state_t *found = &st->modes.flying;
    const estimator_seed_t seed = {.i_s_A = in->meas->i_s_A,
                                   .lambda_r_Wb = found->lambda_Wb,
                                   .omega_e_rad_s = found->omega_rad_s};
    estimator_seed(&cfg->estimator, &st->estimator, &seed);
    vector_catch(&cfg->modes.vector, &st->modes.vector, found->omega_rad_s, in->meas->u_dc_V);
    request->axis =
        mode_flux_axis(in->estimate, vector_lambda_min_Wb(&cfg->modes.vector, mode_running(in)));
}

void transition_after_open_loop(const drive_config_t *cfg, drive_state_t *st, const mode_in_t *in,
                                request_t *request)
{
    estimator_off(&st->estimator, in->meas->i_s_A, request->omega_e_rad_s);
    if (st->mode == MODE_I_F) {
        const i_f_in_t i_f_in = {.omega_ref_rad_s = modes_open_reference_rad_s(in),
                                 .u_dc_V = in->meas->u_dc_V};
        (void)i_f_step(&cfg->modes.i_f, &st->modes.i_f, &i_f_in);
        return;
    }
    speed_control_follow(&st->modes.vector.speed,
                         (st->mode == MODE_DC_BRAKE)
                             ? dc_brake_reference_rad_s(&cfg->modes.brake, &st->modes.brake)
                             : request->omega_e_rad_s);
    if (st->mode != MODE_FLYING_START) {
        return;
    }
    if (st->modes.flying.phase == FLYING_START_STANDS) {
        stand_still(cfg, st, st->modes.flying.current_A);
    } else if (st->modes.flying.phase == FLYING_START_CAUGHT) {
        catch_motor(cfg, st, in, request);
    } else {
        /* goes on, or was refused */
    }
}

/* The estimate starts again from what is known: the current, nominal flux along it, and the speed
 * that was wanted; a lost one may be anywhere, at its limits included. */
COLD static void take_over(const drive_config_t *cfg, drive_state_t *st, const mode_in_t *in)
{
    const float omega_rad_s = st->modes.vector.speed.omega_ref_rad_s;
    i_f_start(&st->modes.i_f, in->meas->i_s_A, omega_rad_s);
    const estimator_seed_t seed = {
        .i_s_A = in->meas->i_s_A,
        .lambda_r_Wb = ab_scale(st->modes.i_f.axis, 1.0f / cfg->modes.vector.inv_lambda_ref_per_Wb),
        .omega_e_rad_s = omega_rad_s};
    estimator_seed(&cfg->estimator, &st->estimator, &seed);
    st->rs_tracking = (rs_tracking_state_t){0}; /* what a lost angle made of it */
    st->offset_tracking = (offset_tracking_state_t){0};
    vector_stop_steering(&cfg->modes.vector, &st->modes.vector);
    stop_dwelling(cfg, st);
    st->mode = MODE_TAKE_OVER;
}

/* Back to flux orientation with the torque that acts; the current controllers' integrators turn
 * with the frame. */
COLD static void hand_back(const drive_config_t *cfg, drive_state_t *st, const mode_in_t *in)
{
    const vector_config_t *vector = &cfg->modes.vector;
    const estimate_t *e = in->estimate;
    const float inv_Wb = 1.0f / maxf(e->lambda_Wb, vector->lambda_min_Wb);
    const ab_t axis = ab_scale(e->lambda_r_hat_Wb, inv_Wb);
    current_control_turn(&st->voltage.current, st->modes.i_f.axis, axis);
    /* Torque, as current at nominal flux. */
    const float i_q_A =
        dq_from_ab(in->meas->i_s_A, axis).q * vector->inv_lambda_ref_per_Wb / inv_Wb;
    vector_seed(vector, &st->modes.vector, i_q_A, st->modes.i_f.omega_rad_s, e->omega_e_rad_s);
    st->modes.i_f = (i_f_state_t){0};
    st->mode = MODE_VECTOR;
}

/* The estimate starts again with the flux that the stator equation shows, when it has not found it
 * itself. The first three times vector control goes on with it. Later the current holds on, and the
 * speed is unknown: a rotor that is seen to follow is no reason to give up. */
COLD static bool hand_back_by_flux(const drive_config_t *cfg, drive_state_t *st,
                                   const mode_in_t *in)
{
    i_f_state_t *const i_f = &st->modes.i_f;
    estimator_seed_t seed = {.i_s_A = in->meas->i_s_A};
    const uint32_t tries = i_f->tries + 1u;
    const float nominal_Wb = 1.0f / cfg->modes.vector.inv_lambda_ref_per_Wb;
    if (!i_f_found(&cfg->modes.i_f, i_f, nominal_Wb, &seed.lambda_r_Wb, &seed.omega_e_rad_s)) {
        return false;
    }
    estimator_seed(&cfg->estimator, &st->estimator, &seed);
    if (tries <= I_F_TRIES) {
        st->supervisor = (supervisor_state_t){0};
        hand_back(cfg, st, in);
    } else {
        i_f->lost_periods = 0u; /* until the next look */
    }
    i_f->tries = tries;
    return tries <= I_F_TRIES;
}

/* I-f holds the load: until the estimate is back, or there is no hope. */
COLD static void hold_load(const drive_config_t *cfg, drive_state_t *st, const mode_in_t *in,
                           bool lost, uint32_t *faults)
{
    /* A torque cannot be held by it: the speed of then can. */
    const float target_rad_s = (in->asked->aim == DRIVE_AIM_TORQUE)
                                   ? st->modes.vector.speed.omega_ref_rad_s
                                   : in->asked->omega_e_ref_rad_s;
    const i_f_in_t i_f_in = {
        .omega_ref_rad_s = target_rad_s, .u_dc_V = in->meas->u_dc_V, .lost = lost};
    if (!lost && i_f_observable(&cfg->modes.i_f, &st->modes.i_f)) {
        hand_back(cfg, st, in);
    } else if (!hand_back_by_flux(cfg, st, in)) {
        const bool hopeless = i_f_step(&cfg->modes.i_f, &st->modes.i_f, &i_f_in);
        *faults |= hopeless ? FAULT_ORIENTATION_LOST : 0u;
    } else {
        /* goes on in vector control */
    }
}

void transition_by_confidence(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                              drive_out_t *out)
{
    const bool lost = st->supervisor.confidence == SUPERVISOR_IMPRESSED;
    if (!lost && (st->mode != MODE_TAKE_OVER)) {
        return;
    }
    const mode_in_t in = stage_view(cfg, st, asked, out);
    if (st->mode == MODE_TAKE_OVER) {
        hold_load(cfg, st, &in, lost, &out->faults);
    } else if (cfg->lost_action == DRIVE_LOST_I_F) {
        take_over(cfg, st, &in);
    } else if (cfg->lost_action == DRIVE_LOST_STOP) {
        out->faults |= FAULT_ORIENTATION_LOST;
    } else {
        /* told only */
    }
}
