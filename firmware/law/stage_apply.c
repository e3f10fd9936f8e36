#include "stages.h"

/* What a leg loses: found at the start, or by the parameters. While it is looked for, nothing is
 * added. */
static leg_loss_t leg_loss(const drive_config_t *cfg, const drive_state_t *st, float u_dc_V,
                           bool busy)
{
    const premagnetise_state_t *found = &st->modes.premagnetise;
    const inverter_error_config_t *error = &cfg->voltage.error;
    if (busy) {
        return (leg_loss_t){.threshold_A = error->i_threshold_A};
    }
    if (!found->leg_loss_found) {
        return inverter_error_loss(error, u_dc_V);
    }
    const float threshold_A = found->leg_threshold_A;
    return (leg_loss_t){.whole_V = found->leg_loss_pu * u_dc_V,
                        .tail_A = found->leg_tail_A,
                        .threshold_A =
                            above_zerof(threshold_A) ? threshold_A : error->i_threshold_A};
}

void stage_apply(const drive_config_t *cfg, drive_state_t *st, const request_t *request,
                 drive_out_t *out)
{
    const estimate_t *e = &st->estimator.estimate;
    const dq_t i_A = dq_from_ab(out->meas.i_s_A, request->axis);
    const bool follow = request->kind == REQUEST_VOLTAGE;
    const voltage_in_t voltage_in = {
        .follow = follow,
        .axis = request->axis,
        .u_ref_V = request->u_ref_V,
        .i_ref_A = {follow ? i_A.d : request->i_ref_A.d, follow ? i_A.q : request->i_ref_A.q},
        .i_A = i_A,
        .i_s_A = out->meas.i_s_A,
        .omega_s_rad_s = e->omega_s_rad_s,
        .omega_e_rad_s = e->omega_e_rad_s,
        .lambda_Wb = e->lambda_Wb,
        .leg_loss = leg_loss(cfg, st, out->meas.u_dc_V, request->busy),
        .u_dc_V = out->meas.u_dc_V};
    const voltage_out_t voltage = voltage_step(&cfg->voltage, &st->voltage, &voltage_in);
    out->duty = voltage.duty;
    out->axis = request->axis;
    out->i_A = i_A;
    out->i_ref_A = voltage_in.i_ref_A; /* of a voltage: no error, the controllers only follow */
    out->premagnetising = request->busy;
    acting_voltage_push(&st->acting, voltage.u_V);
    st->acting.legs_V = voltage.u_legs_V;
}
