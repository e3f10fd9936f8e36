#include "speed_control.h"

#include <math.h>
#include <stddef.h>

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
    const float faster = 1.0f + st->gain_change;
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
    const float faster = 1.0f + st->gain_change;
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
