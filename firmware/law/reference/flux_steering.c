#include "flux_steering.h"

/* Share of the largest torque current the lowered flux may need. With half of it a sound drive that
 * holds rated driving load at 25 to 37 min^-1 was lost, and left to I-f. */
#define STEERING_I_Q_SHARE 0.95f

/* The estimate counts only where it is further than this share of w_min beyond the reference: its
 * noise would move the flux, and points of zh atlas --standard lost their orientation. */
#define STEERING_BEYOND_PU 0.4f

/* Rr may be less than known: with .8 of it .8 w_min is left, with .74 of it and no margin the field
 * stood at zero, and the shaft ran away (zh envelope). */
#define STEERING_SLIP_PU 1.25f

/* The flux follows this many times as fast as the torque is filtered. With the slew limit alone the
 * noise of the estimate made the direct current swing by half of itself, and Rs was never tracked
 * (zh envelope, 395 of 841164779). With 1 the field swung after a load step. */
#define STEERING_FOLLOWS 4.0f

/* Of torque_min and w_min. Steering begins where the torque can turn the field with w_min, rounding
 * aside. Under less the field would stand, which is dwelling's to hold (dwell.h). While it steers,
 * or is asked to stand, half of both is enough: the estimate sees up to a third less torque once
 * the flux is low, and with .7 the flux went up and down every second. */
#define STEERING_BEGIN_PU 0.99f
#define STEERING_KEEP_PU  0.5f

static bool params_valid(const flux_steering_params_t *p)
{
    return ALL_POSITIVE(p->min_rad_s, p->lambda_nominal_Wb, p->lambda_min_Wb, p->slew_Wb_per_s,
                        p->i_q_max_A) &&
           ALL_NONNEGATIVE(p->hysteresis_rad_s, p->torque_min_Nm, p->torque_filter_s) &&
           (p->lambda_min_Wb <= p->lambda_nominal_Wb);
}

bool flux_steering_init(flux_steering_config_t *cfg, const flux_steering_params_t *params,
                        const motor_model_t *motor, float period_s)
{
    *cfg = (flux_steering_config_t){0};
    if (is_zero(params->min_rad_s)) {
        return true; /* off */
    }
    const float p = motor->pole_pairs;
    const float slip_Wb2_per_Nm_s = motor->tau_per_s * motor->M_H / (motor->kr * p);
    const float per_i_q_Wb_per_Nm = 1.0f / (p * motor->kr * STEERING_I_Q_SHARE * params->i_q_max_A);
    if (!params_valid(params) || !ALL_POSITIVE(period_s, slip_Wb2_per_Nm_s, per_i_q_Wb_per_Nm)) {
        return false;
    }
    const float filter_gain = period_s / (period_s + params->torque_filter_s);
    *cfg = (flux_steering_config_t){
        .min_rad_s = params->min_rad_s,
        .leave_rad_s = params->min_rad_s + params->hysteresis_rad_s,
        .lambda_nominal_Wb = params->lambda_nominal_Wb,
        .lambda_min_Wb = params->lambda_min_Wb,
        .torque_min_Nm = params->torque_min_Nm,
        .slip_Wb2_per_Nm_s = slip_Wb2_per_Nm_s,
        .nominal_slip_per_Nm_s =
            slip_Wb2_per_Nm_s / (params->lambda_nominal_Wb * params->lambda_nominal_Wb),
        .flux_per_torque_Wb_per_Nm = per_i_q_Wb_per_Nm,
        .step_Wb = params->slew_Wb_per_s * period_s,
        .filter_gain = filter_gain,
        .follow = minf(STEERING_FOLLOWS * filter_gain, 1.0f),
        .inv_period_per_s = 1.0f / period_s,
    };
    return true;
}

/* Flux at which the field turns with w_min in the sense of the torque, or faster. */
static float steered_flux(const flux_steering_config_t *cfg, float speed_with_torque_rad_s,
                          float torque_Nm)
{
    const float slip_rad_s =
        cfg->min_rad_s - minf(speed_with_torque_rad_s, STEERING_SLIP_PU * speed_with_torque_rad_s);
    const float lambda_Wb = sqrtf(cfg->slip_Wb2_per_Nm_s * torque_Nm / slip_rad_s);
    const float for_torque_Wb = cfg->flux_per_torque_Wb_per_Nm * torque_Nm;
    return clampf(maxf(lambda_Wb, for_torque_Wb), cfg->lambda_min_Wb, cfg->lambda_nominal_Wb);
}

/* Where the flux should be; moves the hysteresis. */
static float target(const flux_steering_config_t *cfg, flux_steering_state_t *st,
                    float omega_ref_rad_s)
{
    const float torque_Nm = absf(st->torque_Nm);
    /* Seen in the sense of the torque: braking is negative. */
    const float way = (st->torque_Nm < 0.0f) ? -1.0f : 1.0f;
    const float estimate_rad_s = way * st->omega_rad_s + STEERING_BEYOND_PU * cfg->min_rad_s;
    const float speed_rad_s = minf(estimate_rad_s, way * omega_ref_rad_s); /* NaN stays NaN */
    const float nominal_rad_s = speed_rad_s + cfg->nominal_slip_per_Nm_s * torque_Nm;
    const float within_rad_s = st->steering ? cfg->leave_rad_s : cfg->min_rad_s;
    const float share =
        (st->steering || is_zero(omega_ref_rad_s)) ? STEERING_KEEP_PU : STEERING_BEGIN_PU;
    st->steering = false;
    /* Motoring faster than w_min needs no slip at all. */
    if (!(torque_Nm >= share * cfg->torque_min_Nm) || !(absf(nominal_rad_s) <= within_rad_s) ||
        !(speed_rad_s < cfg->min_rad_s)) {
        return cfg->lambda_nominal_Wb;
    }
    const float lambda_Wb = steered_flux(cfg, speed_rad_s, torque_Nm);
    const float steered_rad_s =
        speed_rad_s + cfg->slip_Wb2_per_Nm_s * torque_Nm / (lambda_Wb * lambda_Wb);
    st->steering = steered_rad_s >= share * cfg->min_rad_s;
    return st->steering ? lambda_Wb : cfg->lambda_nominal_Wb;
}

flux_steering_out_t flux_steering_step(const flux_steering_config_t *cfg, flux_steering_state_t *st,
                                       float omega_ref_rad_s, float omega_hat_rad_s,
                                       float torque_Nm)
{
    if (!flux_steering_on(cfg)) {
        return (flux_steering_out_t){0.0f, 0.0f, false};
    }
    /* The flux that moves shows in the estimate of the speed: unfiltered, the target of torque mode
     * went up and down with it in every step (zh envelope: 94 of 3443314690). */
    const float behind_Nm = torque_Nm - st->torque_Nm;
    const float behind_rad_s = omega_hat_rad_s - st->omega_rad_s;
    if (is_finite(behind_Nm + behind_rad_s)) {
        st->torque_Nm += cfg->filter_gain * behind_Nm;
        st->omega_rad_s += cfg->filter_gain * behind_rad_s;
    }
    const float reduction_Wb = cfg->lambda_nominal_Wb - target(cfg, st, omega_ref_rad_s);
    const float step_Wb = limitf(cfg->follow * (reduction_Wb - st->reduction_Wb), cfg->step_Wb);
    st->reduction_Wb += step_Wb;
    return (flux_steering_out_t){.reduction_Wb = st->reduction_Wb,
                                 .rate_Wb_per_s = -step_Wb * cfg->inv_period_per_s,
                                 .moving = absf(step_Wb) >= cfg->step_Wb};
}
