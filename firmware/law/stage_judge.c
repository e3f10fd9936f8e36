#include "stages.h"

#include "fault.h"
#include "transition.h"

/* What the resistances gain. In any mode but vector control nothing says what Rs is. */
static void warm(const drive_config_t *cfg, drive_state_t *st, const drive_out_t *out)
{
    const estimate_t *e = &st->estimator.estimate;
    const bool vector = st->mode == MODE_VECTOR;
    const heating_in_t in = {.i2_A2 = ab_norm2(out->meas.i_s_A),
                             .i_q_A = out->i_A.q,
                             .Rr_extra_pu = st->modes.premagnetise.Rr_extra_pu,
                             .Rs_ohm = vector ? drive_rs_ohm(cfg, st) : 0.0f,
                             .slip_rad_s =
                                 e->omega_s_rad_s - e->omega_e_rad_s - st->heating.slip_rad_s};
    const float rise_ohm = heating_step(&cfg->heating, &st->heating, &in);
    if (vector) {
        st->rs_tracking.delta_ohm += rise_ohm;
    }
}

void stage_heat(const drive_config_t *cfg, drive_state_t *st, drive_mode_t asked, drive_out_t *out)
{
    if (overload_step(&cfg->limits.overload, &st->limits.overload, ab_norm2(out->meas.i_s_A)) &&
        (asked != DRIVE_OFF)) {
        out->faults |= FAULT_OVERLOAD;
    }
    if (heating_on(&cfg->heating) || (absf(st->modes.premagnetise.Rr_extra_pu) > 0.0f)) {
        warm(cfg, st, out);
    }
}

/* The speed asks for all of the torque current; only the slot that measures looks. A flux that
 * swings takes some of it away itself. */
static inline bool torque_spent(const drive_state_t *st, drive_aim_t aim)
{
    return (st->slot == SLOT_SUPERVISOR_MEASURE) && (st->mode == MODE_VECTOR) &&
           (aim != DRIVE_AIM_TORQUE) && !st->dwell.flux &&
           speed_control_at_limit(&st->modes.vector.speed);
}

void stage_judge(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                 drive_out_t *out)
{
    const estimate_t *e = &st->estimator.estimate;
    const supervisor_in_t supervisor_in = {.i_s_A = out->meas.i_s_A,
                                           .lambda_r_hat_Wb = e->lambda_r_hat_Wb,
                                           .e1_A = e->i_residual_A,
                                           .correction_V = e->flux_correction_V,
                                           .Rs_ohm = drive_rs_ohm(cfg, st),
                                           .omega_e_hat_rad_s = e->omega_e_rad_s,
                                           .omega_s_hat_rad_s = e->omega_s_rad_s,
                                           .at_limit = torque_spent(st, asked->aim),
                                           .told_torque = asked->aim == DRIVE_AIM_TORQUE,
                                           .swing_rad_s = st->dwell.swing_rad_s,
                                           .swing_omega_rad_s = cfg->dwell.omega_rad_s};
    supervisor_step(&cfg->supervisor, &st->supervisor, &supervisor_in, st->slot);
    transition_by_confidence(cfg, st, asked, out);
}
