#include "vector.h"

#include <math.h>
#include <stddef.h>

#include "fault.h"

/* The lower of the two flux references counts: steering acts near zero frequency, the voltage limit
 * far from it. */
static void choose_flux(const vector_config_t *cfg, vector_state_t *st)
{
    const bool level = st->reference.reduction_Wb > st->steer.reduction_Wb;
    const float reduction_Wb = level ? st->reference.reduction_Wb : st->steer.reduction_Wb;
    const float chosen_Wb_per_s = level ? st->reference.rate_Wb_per_s : st->steer.rate_Wb_per_s;
    const vector_modulation_t *m = &st->modulation;
    const float lambda_Wb = cfg->flux.lambda_ref_Wb - reduction_Wb;
    const float rate_Wb_per_s =
        chosen_Wb_per_s * (1.0f - m->flux_pu) - lambda_Wb * m->rate_pu_per_s;
    st->flux_reduction_Wb = reduction_Wb + lambda_Wb * m->flux_pu;
    const float reduction_pu = st->flux_reduction_Wb * cfg->inv_lambda_ref_per_Wb;
    st->torque_gain_extra_pu = reduction_pu / (1.0f - reduction_pu);
    st->i_d_reduction_A =
        flux_control_reduction_A(&cfg->flux, st->flux_reduction_Wb, rate_Wb_per_s);
    st->pull_out_near = st->reference.i_q_reduction_A > 0.0f;
}

static float torque_Nm(const vector_config_t *cfg, const mode_in_t *in, ab_t axis)
{
    return motor_torque_Nm(&cfg->motor, in->estimate->lambda_Wb, ab_cross(axis, in->meas->i_s_A));
}

/* What voltage and torque of now leave of the nominal flux. */
static void limit_flux(const vector_config_t *cfg, vector_state_t *st, const mode_in_t *in,
                       ab_t axis)
{
    if (!flux_reference_on(&cfg->reference) && !(st->reference.reduction_Wb > 0.0f)) {
        return;
    }
    const flux_reference_in_t reference_in = {.u_V = sqrtf(ab_norm2(in->acting->legs_V)),
                                              .u_dc_V = in->meas->u_dc_V,
                                              .omega_s_rad_s = in->estimate->omega_s_rad_s,
                                              .lambda_Wb = in->estimate->lambda_Wb,
                                              .torque_Nm = torque_Nm(cfg, in, axis),
                                              .full_pu = in->limits->link.taken_pu};
    flux_reference_step(&cfg->reference, &st->reference, &reference_in);
    choose_flux(cfg, st);
}

static void steer_flux(const vector_config_t *cfg, vector_state_t *st, const mode_in_t *in,
                       ab_t axis)
{
    if (flux_steering_on(&cfg->steering)) {
        /* Slip is Rr T/lambda^2, and M i_d comes out as M_pu times the flux that is wanted. */
        const float slip_Nm = torque_Nm(cfg, in, axis) * in->Rr_pu / (in->M_pu * in->M_pu);
        /* Asked to stand it is steered as asked: with an Rs far off the estimate of a shaft that
         * stands unloaded steered the flux down and lost it (zh modes, flying start). */
        const bool torque = in->asked->aim == DRIVE_AIM_TORQUE;
        const float ref_rad_s = torque ? st->steering.omega_rad_s : st->speed.omega_ref_rad_s;
        float hat_rad_s = st->speed.omega_filtered_rad_s;
        if (!(absf(vector_unmodulated_rad_s(st)) > 0.0f)) {
            hat_rad_s = ref_rad_s;
        }
        st->steer =
            flux_steering_step(&cfg->steering, &st->steering, ref_rad_s, hat_rad_s, slip_Nm);
        choose_flux(cfg, st);
    }
}

void vector_modulate(const vector_config_t *cfg, vector_state_t *st, vector_modulation_t modulation)
{
    const bool flux = (modulation.flux_pu > 0.0f) || (st->modulation.flux_pu > 0.0f);
    st->modulation = modulation;
    if (flux) {
        choose_flux(cfg, st);
    }
}

/* Usually the target itself: jerk limit and stop are what makes a difference. */
static float next_reference(const vector_config_t *cfg, vector_state_t *st, const mode_in_t *in)
{
    const bool stop = in->asked->aim == DRIVE_AIM_STOP;
    if (!cfg->ramp.on && !stop) {
        return in->asked->omega_e_ref_rad_s;
    }
    return speed_ramp_step(&cfg->ramp, &st->ramp, vector_unmodulated_rad_s(st),
                           in->asked->omega_e_ref_rad_s, stop);
}

/* Torque to current is meant at the flux that is wanted; the estimate knows how much there is, even
 * if M is not what was told. Too little of it, and it does not say. */
COLD static float torque_for_flux_Nm(const vector_config_t *cfg, const vector_state_t *st,
                                     float lambda_Wb, float torque_ref_Nm)
{
    const float wanted_Wb = cfg->flux.lambda_ref_Wb - st->flux_reduction_Wb;
    const float there_Wb =
        clampf(lambda_Wb, VECTOR_FLUX_LEAST_PU * wanted_Wb, VECTOR_FLUX_MOST_PU * wanted_Wb);
    return torque_ref_Nm * (wanted_Wb / there_Wb);
}

/* What the torque current does to the speed, for the estimator. Nothing is said of a current that
 * somebody else sets, nor with the flux weakened: the load is not known then. */
static void expect(const vector_config_t *cfg, vector_state_t *st)
{
    const bool known = speed_control_expects(&cfg->speed) && !st->mains.active &&
                       !(st->reference.reduction_Wb > 0.0f);
    st->speed.expected_step_rad_s =
        known ? speed_control_expected_rad_s(&cfg->speed, &st->speed, st->speed.i_q_A) : 0.0f;
}

/* Least i_d over the torque current at nominal flux, while the torque grows near zero frequency. An
 * angle error e leaves the flux of i_d cos e - i_q sin e, and steering lets i_d fall to a third of
 * i_q. At any other time so much i_d would keep a sound drive's field at zero. */
#define VECTOR_KEEP_PU 0.7f

static float i_d_A(const vector_config_t *cfg, const vector_state_t *st, const mode_in_t *in)
{
    const float keep_A = in->torque_surges ? (VECTOR_KEEP_PU * absf(st->speed.i_q_A)) : 0.0f;
    return maxf(cfg->flux.i_d_A - st->i_d_reduction_A, keep_A);
}

/* Flux control, limits and target of the next four periods. */
static void plan(const vector_config_t *cfg, const torque_limits_config_t *limits,
                 vector_state_t *st, const mode_in_t *in)
{
    const float i_d_ref_A = i_d_A(cfg, st, in);
    torque_window_t window;
    const bool limited = torque_limits_active(in->limits) || st->pull_out_near;
    if (limited) {
        window = torque_limits_window(limits, in->limits, in->estimate->omega_e_rad_s, i_d_ref_A,
                                      st->reference.i_q_reduction_A);
    }
    const bool torque = in->asked->aim == DRIVE_AIM_TORQUE;
    if (torque) {
        st->ramp = (speed_ramp_state_t){0}; /* speed mode will begin without acceleration */
    }
    st->plan = (speed_control_in_t){
        .omega_ref_rad_s =
            torque ? 0.0f : (next_reference(cfg, st, in) + st->modulation.speed_rad_s),
        .i_d_ref_A = i_d_ref_A,
        .flux_pu = 1.0f - st->flux_reduction_Wb * cfg->inv_lambda_ref_per_Wb,
        .inv_flux_pu = 1.0f + st->torque_gain_extra_pu,
        .torque = torque,
        .torque_ref_Nm =
            torque ? torque_for_flux_Nm(cfg, st, in->estimate->lambda_Wb, in->asked->torque_ref_Nm)
                   : 0.0f,
        .window = limited ? &window : NULL};
    speed_control_limit(&cfg->speed, &st->speed, &st->plan);
    st->plan.window = NULL;
    expect(cfg, st);
    st->planned = true;
}

void vector_slow(const vector_config_t *cfg, const torque_limits_config_t *limits,
                 vector_state_t *st, const mode_in_t *in)
{
    if ((in->slot == SLOT_FLUX_REFERENCE) || (in->slot == SLOT_FLUX_STEERING)) {
        const ab_t axis = mode_flux_axis(in->estimate, vector_lambda_min_Wb(cfg, mode_running(in)));
        if (in->slot == SLOT_FLUX_REFERENCE) {
            limit_flux(cfg, st, in, axis);
        } else {
            steer_flux(cfg, st, in, axis);
        }
    }
    if (in->slot == SLOT_SPEED_SCHEDULE) {
        speed_control_schedule(&cfg->speed, &st->speed, st->plan.flux_pu,
                               1.0f - st->reference.weakened_Wb * cfg->inv_lambda_ref_per_Wb);
    }
    if (slot_is_quarter(in->slot, SLOT_QUARTER_REFERENCES) || !st->planned) {
        plan(cfg, limits, st, in);
    }
}

/* The speed controller follows, and is there with torque and speed of then. */
float vector_ride_through(const vector_config_t *cfg, vector_state_t *st, const mode_in_t *in,
                          float i_q_A, uint32_t *faults)
{
    mains_loss_step(&cfg->mains, &st->mains, in->meas->u_dc_V, in->estimate->omega_e_rad_s);
    if (!st->mains.active) {
        return i_q_A; /* the shaft need not or cannot feed the link */
    }
    if (st->mains.over) {
        *faults |= FAULT_MAINS_LOST;
    }
    st->ramp = (speed_ramp_state_t){0};
    speed_control_track(&st->speed, st->mains.i_q_A);
    return limitf(st->mains.i_q_A * (1.0f + st->torque_gain_extra_pu), cfg->speed.i_q_max_A);
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
    st->planned = false;
    st->ramp = (speed_ramp_state_t){0};
}

void vector_stop_steering(const vector_config_t *cfg, vector_state_t *st)
{
    st->steering = (flux_steering_state_t){0};
    st->steer = (flux_steering_out_t){0};
    choose_flux(cfg, st);
}

void vector_rest(vector_state_t *st)
{
    st->speed = (speed_control_state_t){0};
    st->planned = false;
}
