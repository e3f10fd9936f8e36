#include "current_control.h"

bool current_control_init(current_control_config_t *cfg, const current_control_params_t *params,
                          const motor_model_t *motor, float period_s)
{
    const float bw_rad_s = params->bandwidth_rad_s;
    const float kp_ohm = bw_rad_s * motor->sigma_Ls_H;
    const float ki_ohm_per_s = params->ki_factor * bw_rad_s * kp_ohm;
    current_control_config_t c = {
        .sigma_Ls_H = motor->sigma_Ls_H,
        .kr = motor->kr,
        .decoupling = params->decoupling,
    };

    /* z^2 - z + bw T = 0 with the period of delay between sample and duty: stable below 1. */
    if (!positivef(bw_rad_s) || !(bw_rad_s * period_s < 1.0f) || !positivef(motor->kr)) {
        return false;
    }
    if (!nonnegativef(params->decoupling) || !(params->decoupling <= 1.0f) ||
        !pi_init(&c.pi, kp_ohm, ki_ohm_per_s, params->u_max_V, period_s)) {
        return false;
    }
    *cfg = c;
    return true;
}

dq_t current_control_output(const current_control_config_t *cfg, const current_control_state_t *st,
                            const current_control_in_t *in)
{
    dq_t u_V = {pi_output(&cfg->pi, &st->d, in->i_ref_A.d - in->i_A.d),
                pi_output(&cfg->pi, &st->q, in->i_ref_A.q - in->i_A.q)};
    if (above_zerof(cfg->decoupling)) {
        const float leakage_V_per_A = in->omega_s_rad_s * cfg->sigma_Ls_H;
        const float emf_V = cfg->kr * in->omega_e_rad_s * in->lambda_Wb;
        u_V.d += cfg->decoupling * (-leakage_V_per_A * in->i_A.q);
        u_V.q += cfg->decoupling * (leakage_V_per_A * in->i_A.d + emf_V);
    }
    return u_V;
}

void current_control_update(const current_control_config_t *cfg, current_control_state_t *st,
                            const current_control_in_t *in, const dq_t *added_V)
{
    float d_V = pi_next(&cfg->pi, &st->d, in->i_ref_A.d - in->i_A.d);
    float q_V = pi_next(&cfg->pi, &st->q, in->i_ref_A.q - in->i_A.q);
    if (added_V != NULL) {
        d_V += cfg->pi.tracking * added_V->d;
        q_V += cfg->pi.tracking * added_V->q;
    }
    pi_set(&cfg->pi, &st->d, d_V);
    pi_set(&cfg->pi, &st->q, q_V);
}

void current_control_track(current_control_state_t *st, dq_t asked_V, dq_t acting_V)
{
    st->d.x += acting_V.d - asked_V.d;
    st->q.x += acting_V.q - asked_V.q;
}

void current_control_turn(current_control_state_t *st, ab_t from, ab_t to)
{
    const dq_t x_V = dq_from_ab(ab_from_dq((dq_t){st->d.x, st->q.x}, from), to);
    st->d.x = x_V.d;
    st->q.x = x_V.q;
}

void current_control_keep_emf(const current_control_config_t *cfg, current_control_state_t *st,
                              float omega_e_rad_s, float lambda_Wb)
{
    st->q.x += cfg->decoupling * cfg->kr * omega_e_rad_s * lambda_Wb;
}
