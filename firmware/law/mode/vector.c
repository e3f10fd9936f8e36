#include "vector.h"

#include <math.h>
#include <stddef.h>

#include "fault.h"

/* The lower of the two flux references counts: steering acts near zero frequency, the voltage limit
 * far from it. */
static void choose_flux(const vector_config_t *cfg, vector_state_t *st)
{
    const bool level = st->reference.below_Wb > st->steer.below_Wb;
    const float rate_Wb_per_s = level ? st->reference.rate_Wb_per_s : st->steer.rate_Wb_per_s;
    st->flux_reduction_Wb = level ? st->reference.below_Wb : st->steer.below_Wb;
    const float reduction_pu = st->flux_reduction_Wb * cfg->inv_lambda_ref_per_Wb;
    st->torque_gain_extra_pu = reduction_pu / (1.0f - reduction_pu);
    st->i_d_reduction_A = flux_control_less_A(&cfg->flux, st->flux_reduction_Wb, rate_Wb_per_s);
    st->pull_out_near = st->reference.i_q_less_A > 0.0f;
}

static float torque_Nm(const vector_config_t *cfg, const mode_in_t *in, ab_t axis)
{
    return motor_torque_Nm(&cfg->motor, in->estimate->lambda_Wb, ab_cross(axis, in->meas->i_s_A));
}

/* What voltage and torque of now leave of the nominal flux. */
COLD static void limit_flux(const vector_config_t *cfg, vector_state_t *st, const mode_in_t *in,
                            ab_t axis)
{
    if (!flux_reference_on(&cfg->reference) && !(st->reference.below_Wb > 0.0f)) {
        return;
    }
    const flux_reference_in_t reference_in = {.u_V = sqrtf(ab_norm2(in->acting->pending_V)),
                                              .u_dc_V = in->meas->u_dc_V,
                                              .omega_s_rad_s = in->estimate->omega_s_rad_s,
                                              .torque_Nm = torque_Nm(cfg, in, axis)};
    flux_reference_step(&cfg->reference, &st->reference, &reference_in);
    choose_flux(cfg, st);
}

static void steer_flux(const vector_config_t *cfg, vector_state_t *st, const mode_in_t *in,
                       ab_t axis)
{
    if (flux_steering_on(&cfg->steering)) {
        st->steer = flux_steering_step(&cfg->steering, &st->steering, st->speed.omega_ref_rad_s,
                                       torque_Nm(cfg, in, axis));
        choose_flux(cfg, st);
    }
}

void vector_slow(const vector_config_t *cfg, vector_state_t *st, const mode_in_t *in, ab_t axis)
{
    switch (st->slow_period) {
    case VECTOR_SLOW_FLUX:
        limit_flux(cfg, st, in, axis);
        break;
    case VECTOR_SLOW_STEERING:
        steer_flux(cfg, st, in, axis);
        break;
    case VECTOR_SLOW_SCHEDULE:
        speed_control_schedule(&cfg->speed, &st->speed);
        break;
    default:
        /* nothing this time */
        break;
    }
}

/* Usually the target itself: jerk limit and stop are what makes a difference. */
static float next_reference(const vector_config_t *cfg, vector_state_t *st, const mode_in_t *in)
{
    const bool stop = in->asked->aim == DRIVE_AIM_STOP;
    if (!cfg->ramp.on && !stop) {
        return in->asked->omega_e_ref_rad_s;
    }
    return speed_ramp_step(&cfg->ramp, &st->ramp, st->speed.omega_ref_rad_s,
                           in->asked->omega_e_ref_rad_s, stop);
}

/* Flux control and speed control: the current that is wanted. */
static dq_t wanted_current(const vector_config_t *cfg, const torque_limits_config_t *limits,
                           vector_state_t *st, const mode_in_t *in)
{
    const flux_control_in_t flux_in = {.lambda_hat_Wb = in->estimate->lambda_Wb,
                                       .below_Wb = st->flux_reduction_Wb,
                                       .less_A = st->i_d_reduction_A};
    const float i_d_A = flux_control_step(&cfg->flux, &st->flux, &flux_in);
    torque_window_t window;
    const bool limited = torque_limits_active(in->limits) || st->pull_out_near;
    if (limited) {
        window = torque_limits_window(limits, in->limits, in->estimate->omega_e_rad_s, i_d_A,
                                      st->reference.i_q_less_A);
    }
    const bool torque = in->asked->aim == DRIVE_AIM_TORQUE;
    if (torque) {
        st->ramp = (speed_ramp_state_t){0}; /* speed mode will begin without acceleration */
    }
    const speed_control_in_t speed_in = {
        .omega_ref_rad_s = torque ? 0.0f : next_reference(cfg, st, in),
        .omega_hat_rad_s = in->estimate->omega_e_rad_s,
        .i_d_ref_A = i_d_A,
        .flux_pu = 1.0f - st->flux_reduction_Wb * cfg->inv_lambda_ref_per_Wb,
        .inv_flux_pu = 1.0f + st->torque_gain_extra_pu,
        .torque = torque,
        .torque_ref_Nm = in->asked->torque_ref_Nm,
        .window = limited ? &window : NULL};
    return (dq_t){i_d_A, speed_control_step(&cfg->speed, &st->speed, &speed_in)};
}

/* No mains: the speed controller follows, and is there with torque and speed of then. i_q: what it
 * wants, and gets while the shaft need not or cannot feed the link. */
COLD static float ride_through(const vector_config_t *cfg, vector_state_t *st, const mode_in_t *in,
                               float i_q_A, uint32_t *faults)
{
    mains_loss_step(&cfg->mains, &st->mains, in->meas->u_dc_V, in->estimate->omega_e_rad_s);
    if (!st->mains.active) {
        return i_q_A;
    }
    if (st->mains.over) {
        *faults |= FAULT_MAINS_LOST;
    }
    st->ramp = (speed_ramp_state_t){0};
    speed_control_track(&st->speed, st->mains.i_q_A);
    return limitf(st->mains.i_q_A * (1.0f + st->torque_gain_extra_pu), cfg->speed.i_q_max_A);
}

void vector_step(const vector_config_t *cfg, const torque_limits_config_t *limits,
                 vector_state_t *st, const mode_in_t *in, mode_out_t *out)
{
    const bool running = mode_running(in);
    const ab_t axis = mode_flux_axis(in->estimate, vector_lambda_min_Wb(cfg, running));
    vector_slow(cfg, st, in, axis);
    dq_t i_ref_A = wanted_current(cfg, limits, st, in);
    if (!running) {
        speed_control_wait(&st->speed, in->estimate->omega_e_rad_s);
        i_ref_A.q = 0.0f;
    } else if (cfg->ride_through && !mains_loss_idle(&cfg->mains, &st->mains, in->meas->u_dc_V)) {
        i_ref_A.q = ride_through(cfg, st, in, i_ref_A.q, &out->faults);
    } else {
        /* as the speed controller says */
    }
    out->request.kind = REQUEST_CURRENT;
    out->request.axis = axis;
    out->request.i_ref_A = i_ref_A;
}

void vector_catch(const vector_config_t *cfg, vector_state_t *st, float omega_rad_s, float u_dc_V)
{
    flux_reference_start(&cfg->reference, &st->reference, omega_rad_s, u_dc_V);
    choose_flux(cfg, st);
}

void vector_seed(const vector_config_t *cfg, vector_state_t *st, float i_q_A, float omega_ref_rad_s,
                 float omega_hat_rad_s)
{
    speed_control_seed(&cfg->speed, &st->speed, i_q_A, omega_ref_rad_s, omega_hat_rad_s);
    st->ramp = (speed_ramp_state_t){0};
}

void vector_stop_steering(const vector_config_t *cfg, vector_state_t *st)
{
    st->steering = (flux_steering_state_t){0};
    st->steer = (flux_steering_out_t){0};
    choose_flux(cfg, st);
}
