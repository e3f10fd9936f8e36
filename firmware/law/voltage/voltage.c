#include "voltage.h"

voltage_out_t voltage_step(const voltage_config_t *cfg, voltage_state_t *st, const voltage_in_t *in)
{
    const current_control_in_t current_in = {.i_ref_A = in->i_ref_A,
                                             .i_A = in->i_A,
                                             .omega_s_rad_s = in->omega_s_rad_s,
                                             .omega_e_rad_s = in->omega_e_rad_s,
                                             .lambda_Wb = in->lambda_Wb};
    dq_t asked_V = current_control_output(&cfg->current, &st->current, &current_in);
    const ab_t axis_ahead = ab_add(in->axis, ab_mul(st->ahead, in->axis));
    if (in->follow) {
        const dq_t wanted_V = dq_from_ab(in->u_ref_V, axis_ahead);
        current_control_track(&st->current, asked_V, wanted_V);
        asked_V = wanted_V;
    }
    const ab_t u_lost_V =
        inverter_error_voltage(in->leg_loss, ab_add(in->i_s_A, ab_mul(st->ahead, in->i_s_A)));
    ab_t u_V = ab_from_dq(asked_V, axis_ahead);
    const svpwm_out_t pwm = svpwm_step(&cfg->svpwm, ab_add(u_V, u_lost_V), in->u_dc_V);
    if (pwm.exact) {
        current_control_update(&cfg->current, &st->current, &current_in, NULL);
    } else {
        u_V = ab_sub(pwm.u_realised_V, u_lost_V);
        const dq_t realised_V = dq_from_ab(u_V, axis_ahead);
        const dq_t added_V = {realised_V.d - asked_V.d, realised_V.q - asked_V.q};
        current_control_update(&cfg->current, &st->current, &current_in, &added_V);
    }
    return (voltage_out_t){.duty = pwm.duty, .u_V = u_V, .u_legs_V = pwm.u_realised_V};
}
