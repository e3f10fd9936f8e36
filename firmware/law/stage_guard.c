#include "stages.h"

/* What the slow judgements of the guard look at. */
COLD static uint32_t look(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                          const drive_out_t *out)
{
    const premagnetise_state_t *found = &st->modes.premagnetise;
    const vector_config_t *vector = &cfg->modes.vector;
    const guard_look_t in = {
        .meas = &out->meas,
        .estimate = &st->estimator.estimate,
        .slot = st->supervisor.periods,
        .standing = (st->mode == MODE_PREMAGNETISE) || (st->mode == MODE_COMMISSIONING),
        .oriented = st->mode == MODE_VECTOR,
        /* After a flying start nobody knows what the legs lose, if that was to be found. */
        .sensed = (cfg->acting.source == ACTING_VOLTAGE_SENSORS) &&
                  (found->leg_loss_found || !cfg->modes.premagnetise.identify_leg_loss),
        .u_duty_V = st->acting.ended_V,
        .u_s_V = out->u_s_V,
        .axis = out->mode.request.axis,
        .i_ref_A = out->i_ref_A,
        .omega_ref_rad_s = asked->omega_e_ref_rad_s,
        .lambda_ref_Wb = vector->flux.lambda_ref_Wb - st->modes.vector.flux_reduction_Wb,
        .Rs_ohm = drive_rs_ohm(cfg, st)};
    return guard_look(&cfg->guard, &st->guard, &in);
}

uint32_t stage_guard(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                     const drive_out_t *out, float state_sum)
{
    const guard_in_t in = {.meas = &out->meas,
                           .duty = out->duty,
                           .state_sum = state_sum,
                           .omega_e_hat_rad_s = st->estimator.estimate.omega_e_rad_s};
    uint32_t faults = guard_step(&cfg->guard, &st->guard, &in);
    const bool standing = (asked->mode == DRIVE_PREMAGNETISE) || (asked->mode == DRIVE_COMMISSION);
    if (standing || guard_look_is_due(st->supervisor.periods)) {
        faults |= look(cfg, st, asked, out);
    }
    return faults;
}
