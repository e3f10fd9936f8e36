#include "speed_control.h"

#include <math.h>
#include <stddef.h>

static bool init_schedule(speed_control_config_t *cfg, const speed_control_params_t *params)
{
    if (!nonnegativef(params->fast_bandwidth_rad_s)) {
        return false;
    }
    if (params->fast_bandwidth_rad_s > params->bandwidth_rad_s) {
        cfg->gain_extra_max = params->fast_bandwidth_rad_s / params->bandwidth_rad_s - 1.0f;
        cfg->gain_extra_per_rad_s = cfg->gain_extra_max / (params->fast_rad_s - params->slow_rad_s);
        return nonnegativef(params->slow_rad_s) && positivef(cfg->gain_extra_per_rad_s);
    }
    return true;
}

static bool init_torque(speed_control_config_t *cfg, const speed_control_params_t *params,
                        const motor_model_t *motor, float period_s)
{
    cfg->A_per_Nm = 1.0f / motor_torque_Nm(motor, params->lambda_Wb, 1.0f);
    cfg->torque_step_A = params->torque_slew_Nm_per_s * period_s * cfg->A_per_Nm;
    return nonnegativef(params->torque_max_rad_s) && nonnegativef(-params->torque_min_rad_s) &&
           positivef(cfg->torque_step_A);
}

/* The estimate takes the slip of a torque for its speed until it has settled: the torque that an
 * error of speed asks for may have no more slip than so many times that error. */
static float gain_max(const speed_control_params_t *params, const motor_model_t *motor)
{
    const float slip_rad_s_per_A = motor->tau_per_s * motor->M_H / params->lambda_Wb;
    const float faster = maxf(params->fast_bandwidth_rad_s / params->bandwidth_rad_s, 1.0f);
    return SPEED_CONTROL_SLIP_MAX / (slip_rad_s_per_A * faster);
}

/* The estimate takes a change of the torque current for one of the speed as well where the leakage
 * is not what was told. A bounded gain makes the loop slower: then the filter may be, too. */
static float filter_s(const speed_control_params_t *params, float wanted_pu)
{
    const float fast_rad_s = maxf(params->fast_bandwidth_rad_s, params->bandwidth_rad_s);
    const float left_pu = 1.0f / wanted_pu;
    return params->filter_s +
           SPEED_CONTROL_FILTER_PU / fast_rad_s * (wanted_pu - 1.0f) * (1.0f - left_pu);
}

bool speed_control_init(speed_control_config_t *cfg, const speed_control_params_t *params,
                        const motor_model_t *motor, float period_s)
{
    const float p = motor->pole_pairs;
    /* d w_e/dt = (p^2 kr lambda/J) i_q: one pole at the bandwidth. */
    const float wanted =
        params->J_kg_m2 * params->bandwidth_rad_s / (p * p * motor->kr * params->lambda_Wb);
    const float kp = minf(wanted, gain_max(params, motor));
    const float bandwidth_rad_s = params->bandwidth_rad_s * (kp / wanted);
    const float ki_per_s = params->ki_factor * bandwidth_rad_s * kp;
    speed_control_config_t c = {
        .i_q_max_A = params->i_q_max_A,
        .i_q_max2_A2 = params->i_q_max_A * params->i_q_max_A,
        .i_max2_A2 = params->i_max_A * params->i_max_A,
        .filter_gain = period_s / (period_s + filter_s(params, wanted / kp)),
        .slew_step_rad_s = params->slew_rad_s2 * period_s,
        .slow_rad_s = params->slow_rad_s,
        .torque_max_rad_s = params->torque_max_rad_s,
        .torque_min_rad_s = params->torque_min_rad_s,
    };

    /* Two negative factors would make a positive product: each is looked at. */
    if (!ALL_POSITIVE(params->J_kg_m2, params->bandwidth_rad_s, params->lambda_Wb, p,
                      params->i_max_A, c.i_max2_A2, c.slew_step_rad_s) ||
        !nonnegativef(params->filter_s)) {
        return false;
    }
    if (!pi_init(&c.pi, kp, ki_per_s, params->i_q_max_A, period_s) || !init_schedule(&c, params) ||
        !init_torque(&c, params, motor, period_s)) {
        return false;
    }
    if (c.gain_extra_max > 0.0f) {
        c.weakening = 1.0f + 1.0f / c.gain_extra_max; /* 1 + max becomes flux (1 + max) */
        c.step_rad_s_per_A = params->bandwidth_rad_s / wanted * period_s / c.gain_extra_max;
    }
    *cfg = c;
    return true;
}

/* The step of the slew-limited reference. A difference that is not finite moves nothing: monitor
 * trips on it, nothing may remember it. */
static inline float slewed(float difference_rad_s, float slew_rad_s)
{
    float step_rad_s = difference_rad_s;
    if (!(absf(difference_rad_s) <= slew_rad_s)) {
        step_rad_s = is_finite(difference_rad_s) ? limitf(difference_rad_s, slew_rad_s) : 0.0f;
    }
    return step_rad_s;
}

/* i_d first: what is left of |i_s| is for torque; none when i_d takes it all (or is NaN). */
static float i_q_limit_A(const speed_control_config_t *cfg, float i_d_ref_A)
{
    const float room2_A2 = cfg->i_max2_A2 - i_d_ref_A * i_d_ref_A;
    return (room2_A2 >= cfg->i_q_max2_A2) ? cfg->i_q_max_A : sqrtf(maxf(room2_A2, 0.0f));
}

void speed_control_limit(const speed_control_config_t *cfg, speed_control_state_t *st,
                         const speed_control_in_t *in)
{
    /* At nominal flux; less flux takes more current for the same torque. */
    const float limit_A = i_q_limit_A(cfg, in->i_d_ref_A) * in->flux_pu;
    st->low_A = -limit_A;
    st->high_A = limit_A;
    if (in->window != NULL) {
        st->low_A =
            clampf(-limit_A, in->window->low_A * in->flux_pu, in->window->high_A * in->flux_pu);
        st->high_A =
            clampf(limit_A, in->window->low_A * in->flux_pu, in->window->high_A * in->flux_pu);
    }
}

/* The integrator holds the torque of the load, and never asks for more than the limits allow. A
 * limit that is no number shows in it. */
static inline void integrate(const speed_control_config_t *cfg, speed_control_state_t *st,
                             float error_rad_s)
{
    float x_A = st->pi.x + cfg->pi.ki_T * error_rad_s;
    x_A = (x_A > st->high_A) ? st->high_A : x_A;
    st->pi.x = (x_A < st->low_A) ? st->low_A : x_A;
}

/* What the limits leave of asked_A. The integrator waits while they cut it, unless that leads back
 * inside; a limit that is no number leaves it alone. */
COLD static float cut_A(const speed_control_config_t *cfg, speed_control_state_t *st,
                        float error_rad_s, float asked_A)
{
    const float i_q_A = clampf(asked_A, st->low_A, st->high_A);
    if (error_rad_s * (i_q_A - asked_A) >= 0.0f) {
        integrate(cfg, st, error_rad_s);
    }
    return i_q_A;
}

/* Torque mode: the torque on its slew, unless the speed controller at the limit of this direction
 * wants less. That one waits at the current of now, so that it takes over where the error changes
 * its sign, and speed mode goes on from it. */
COLD static float torque_mode_A(const speed_control_config_t *cfg, speed_control_state_t *st,
                                float torque_ref_Nm)
{
    const float omega_rad_s = st->omega_filtered_rad_s;
    const bool forward = omega_rad_s >= 0.0f;
    const float limit_rad_s = forward ? cfg->torque_max_rad_s : cfg->torque_min_rad_s;
    const float faster = 1.0f + st->gain_extra;
    const float faster_err_rad_s = faster * (limit_rad_s - omega_rad_s);
    const float asked_A = pi_output(&cfg->pi, &st->pi, faster_err_rad_s);
    const float change_A = cfg->A_per_Nm * torque_ref_Nm - st->i_q_A;
    const float torque_A =
        clampf(st->i_q_A + slewed(change_A, cfg->torque_step_A), st->low_A, st->high_A);
    st->omega_ref_rad_s = omega_rad_s;
    if (forward ? (torque_A <= asked_A) : (torque_A >= asked_A)) {
        st->pi.x = torque_A;
        return torque_A;
    }
    return cut_A(cfg, st, faster * faster_err_rad_s, asked_A);
}

/* Speed mode. Usually inside the limits: two comparisons. */
static inline float speed_mode_A(const speed_control_config_t *cfg, speed_control_state_t *st)
{
    const float faster = 1.0f + st->gain_extra;
    const float faster_err_rad_s = faster * (st->omega_ref_rad_s - st->omega_filtered_rad_s);
    const float asked_A = pi_output(&cfg->pi, &st->pi, faster_err_rad_s);
    if (!((asked_A >= st->low_A) && (asked_A <= st->high_A))) {
        return cut_A(cfg, st, faster * faster_err_rad_s, asked_A);
    }
    integrate(cfg, st, faster * faster_err_rad_s);
    return asked_A;
}

float speed_control_step(const speed_control_config_t *cfg, speed_control_state_t *st,
                         const speed_control_in_t *in, float omega_hat_rad_s)
{
    st->omega_ref_rad_s += slewed(in->omega_ref_rad_s - st->omega_ref_rad_s, cfg->slew_step_rad_s);
    const float behind_rad_s = omega_hat_rad_s - st->omega_filtered_rad_s;
    const float step_rad_s = is_finite(behind_rad_s) ? cfg->filter_gain * behind_rad_s : 0.0f;
    st->omega_filtered_rad_s += step_rad_s;
    st->i_q_A = in->torque ? torque_mode_A(cfg, st, in->torque_ref_Nm) : speed_mode_A(cfg, st);
    return st->i_q_A * in->inv_flux_pu;
}
