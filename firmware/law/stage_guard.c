#include "stages.h"

uint32_t stage_guard_look(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                          const drive_out_t *out)
{
    const premagnetise_state_t *found = &st->modes.premagnetise;
    const vector_config_t *vector = &cfg->modes.vector;
    const guard_look_t in = {
        .meas = &out->meas,
        .estimate = &st->estimator.estimate,
        .slot = st->slot,
        .controlled = (st->mode == MODE_VECTOR) || (st->mode == MODE_TAKE_OVER),
        .oriented = st->mode == MODE_VECTOR,
        /* After a flying start nobody knows what the legs lose, if that was to be found. */
        .sensed = (cfg->acting.source == ACTING_VOLTAGE_SENSORS) &&
                  (found->leg_loss_found || !cfg->modes.premagnetise.identify_leg_loss),
        .u_duty_V = st->acting.ended_V,
        .u_s_V = out->u_s_V,
        .axis = out->axis,
        .i_ref_A = out->i_ref_A,
        .omega_ref_rad_s = asked->omega_e_ref_rad_s,
        .lambda_ref_Wb = vector->flux.lambda_ref_Wb - st->modes.vector.flux_reduction_Wb,
        .Rs_ohm = drive_rs_ohm(cfg, st)};
    return guard_look(&cfg->guard, &st->guard, &in);
}
