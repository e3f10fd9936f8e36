#include "speed_control.h"

#include <math.h>

bool speed_control_init(speed_control_config_t *cfg, const speed_control_params_t *params,
                        const motor_model_t *motor, float period_s)
{
    const float p = motor->pole_pairs;
    /* d w_e/dt = (p^2 kr lambda/J) i_q: one pole at the bandwidth. */
    const float kp =
        params->J_kg_m2 * params->bandwidth_rad_s / (p * p * motor->kr * params->lambda_Wb);
    const float ki_per_s = params->ki_factor * params->bandwidth_rad_s * kp;
    speed_control_config_t c = {
        .i_q_max_A = params->i_q_max_A,
        .i_max2_A2 = params->i_max_A * params->i_max_A,
        .filter_gain = period_s / (period_s + params->filter_s),
        .slew_step_rad_s = params->slew_rad_s2 * period_s,
    };

    /* Two negative factors would make a positive product: each is looked at. */
    if (!positivef(params->J_kg_m2) || !positivef(params->bandwidth_rad_s) ||
        !positivef(params->lambda_Wb) || !positivef(p) || !nonnegativef(params->filter_s)) {
        return false;
    }
    if (!positivef(params->i_max_A) || !positivef(c.i_max2_A2) || !positivef(c.slew_step_rad_s) ||
        !pi_init(&c.pi, kp, ki_per_s, params->i_q_max_A, period_s)) {
        return false;
    }
    *cfg = c;
    return true;
}

/* A non-finite difference moves nothing: monitor trips on it, no filter may remember it. */
static float finite_or_zero(float x)
{
    return is_finite(x) ? x : 0.0f;
}

float speed_control_step(const speed_control_config_t *cfg, speed_control_state_t *st,
                         const speed_control_in_t *in)
{
    const float slew = cfg->slew_step_rad_s;

    st->omega_ref_rad_s += limitf(finite_or_zero(in->omega_ref_rad_s - st->omega_ref_rad_s), slew);
    st->omega_filtered_rad_s +=
        cfg->filter_gain * finite_or_zero(in->omega_hat_rad_s - st->omega_filtered_rad_s);

    /* i_d first: what is left of |i_s| is for torque; none when i_d takes it all (or is NaN). */
    const float i_q_room2_A2 = maxf(cfg->i_max2_A2 - in->i_d_ref_A * in->i_d_ref_A, 0.0f);
    const float i_q_limit_A = minf(cfg->i_q_max_A, sqrtf(i_q_room2_A2));

    const float omega_err_rad_s = st->omega_ref_rad_s - st->omega_filtered_rad_s;
    const float asked_A = pi_output(&cfg->pi, &st->pi, omega_err_rad_s);
    const float i_q_ref_A = limitf(asked_A, i_q_limit_A);
    pi_update(&cfg->pi, &st->pi, omega_err_rad_s, i_q_ref_A - asked_A);
    return i_q_ref_A;
}
