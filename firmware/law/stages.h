/* Stages that drive.c calls beside its main path: modes that are not flux-oriented, and slow work.
 */
#ifndef STAGES_H
#define STAGES_H

#include "drive.h"

/* Input of a mode in this period. */
static inline mode_in_t stage_view(const drive_config_t *cfg, const drive_state_t *st,
                                   const drive_in_t *asked, const drive_out_t *out)
{
    return (mode_in_t){.asked = asked,
                       .meas = &out->meas,
                       .estimate = &st->estimator.estimate,
                       .limits = &st->limits,
                       .acting = &st->acting,
                       .u_s_V = out->u_s_V,
                       .Rs_ohm = drive_rs_ohm(cfg, st),
                       .M_pu = 1.0f + st->m_tracking.extra_pu,
                       .Rr_pu = 1.0f + st->heating.rotor_pu + st->modes.premagnetise.Rr_extra_pu,
                       .torque_surges = st->supervisor.surges,
                       .slot = st->slot};
}

/* Input of the estimator; a mode that imposes the frame adds that. */
static inline estimator_in_t stage_estimator_in(const drive_state_t *st, const drive_out_t *out)
{
    const float Rs_extra_ohm = st->modes.premagnetise.Rs_delta_ohm + st->rs_tracking.delta_ohm;
    return (estimator_in_t){.u_s_V = ab_sub(out->u_s_V, ab_scale(out->meas.i_s_A, Rs_extra_ohm)),
                            .i_s_A = out->meas.i_s_A,
                            .dwell = st->dwell.share,
                            .slip_extra_rad_s = st->heating.slip_rad_s,
                            .tau_extra_per_s = st->m_tracking.tau_extra_per_s};
}

/* One period of a mode other than vector control: estimator, request, voltage, judgement. */
HOT void stage_other_mode(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                          drive_out_t *out);

/* Slow work of flux orientation, before the speed controller. */
APART void stage_slow(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                      const drive_out_t *out);

_Static_assert((SLOT_RS_TRACKING % SLOT_QUARTERS) == SLOT_QUARTER_REFERENCES,
               "the slot of Rs tracking is one of references: slow work is due in it anyhow");
static inline bool stage_slow_is_due(const drive_config_t *cfg, const drive_state_t *st,
                                     bool among_slots)
{
    return vector_slow_is_due(&st->modes.vector, among_slots) ||
           ((st->slot == SLOT_DWELL) && dwell_on(&cfg->dwell));
}

/* Request -> duty. */
void stage_apply(const drive_config_t *cfg, drive_state_t *st, const request_t *request,
                 drive_out_t *out);

/* Confidence in the estimate, and its consequences. */
HOT void stage_judge(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                     drive_out_t *out);

/* Fault bits of the guard's slow checks. */
HOT uint32_t stage_guard_look(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                              const drive_out_t *out);

/* Thermal models of motor and inverter: slow work. */
HOT void stage_heat(const drive_config_t *cfg, drive_state_t *st, drive_mode_t asked,
                    drive_out_t *out);

#endif
