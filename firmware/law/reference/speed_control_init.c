#include "speed_control.h"

#include "slots.h"

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
 * error of speed asks for may have no more slip than so many times that error. Twice as much where
 * the loop stays slower than the rotor's flux: by then the estimate has settled. wanted: the gain
 * without a bound; fast_rad_s: the bandwidth at speed. */
static float gain_max(const speed_control_params_t *params, const motor_model_t *motor,
                      float wanted, float fast_rad_s)
{
    const float slip_rad_s_per_A = motor->tau_per_s * motor->M_H / params->lambda_Wb;
    const float by_slip =
        SPEED_CONTROL_SLIP_MAX / (slip_rad_s_per_A * (fast_rad_s / params->bandwidth_rad_s));
    const float slower =
        wanted * SPEED_CONTROL_SLOWER_PU * motor->tau_per_s / params->bandwidth_rad_s;
    return clampf(slower, by_slip, 2.0f * by_slip);
}

/* The estimate takes a change of the torque current for one of the speed as well where the leakage
 * is not what was told. A bounded gain makes the loop slower: then the filter may be, too. */
static float filter_s(const speed_control_params_t *params, float fast_rad_s, float left_pu)
{
    return params->filter_s +
           SPEED_CONTROL_FILTER_PU / fast_rad_s * (1.0f / left_pu - 2.0f + left_pu);
}

/* A loop that the bound makes slow bears more: filter and delays are short beside it. */
static float ki_per_s(const speed_control_params_t *params, float kp, float left_pu)
{
    const float lost_pu = 1.0f - left_pu;
    const float bandwidth_rad_s = params->bandwidth_rad_s * left_pu;
    return params->ki_factor * (1.0f + lost_pu * lost_pu) * bandwidth_rad_s * kp;
}

/* Beside a bandwidth that grows with speed: weakened flux, the expected acceleration, swings. most:
 * the gain that slip allows. */
static void with_schedule(speed_control_config_t *cfg, const speed_control_params_t *params,
                          float most, float wanted, float period_s)
{
    cfg->slip_room = most / cfg->pi.kp;
    cfg->weakening = 1.0f + 1.0f / cfg->gain_extra_max; /* 1 + max becomes flux (1 + max) */
    cfg->swing_share = minf((float)SLOT_COUNT / SPEED_CONTROL_SWING_S * period_s, 1.0f);
    cfg->lost_max = maxf(1.0f - SPEED_CONTROL_SWING_GAIN * most / cfg->pi.kp, 0.0f);
    cfg->asked_A_per_rad_s = cfg->pi.kp * (1.0f + cfg->gain_extra_max) / cfg->swing_share;
    cfg->swing_per_A = 1.0f / (SPEED_CONTROL_SWING_PU * params->i_q_max_A);
    cfg->step_rad_s_per_A = params->bandwidth_rad_s / wanted * period_s / cfg->gain_extra_max;
}

bool speed_control_init(speed_control_config_t *cfg, const speed_control_params_t *params,
                        const motor_model_t *motor, float period_s)
{
    const float p = motor->pole_pairs;
    /* d w_e/dt = (p^2 kr lambda/J) i_q: one pole at the bandwidth. */
    const float wanted =
        params->J_kg_m2 * params->bandwidth_rad_s / (p * p * motor->kr * params->lambda_Wb);
    const float fast_rad_s = maxf(params->fast_bandwidth_rad_s, params->bandwidth_rad_s);
    const float most = gain_max(params, motor, wanted, fast_rad_s);
    const float kp = minf(wanted, most);
    const float left_pu = kp / wanted;
    speed_control_config_t c = {
        .i_q_max_A = params->i_q_max_A,
        .i_q_max2_A2 = params->i_q_max_A * params->i_q_max_A,
        .i_max2_A2 = params->i_max_A * params->i_max_A,
        .filter_gain = period_s / (period_s + filter_s(params, fast_rad_s, left_pu)),
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
    if (!pi_init(&c.pi, kp, ki_per_s(params, kp, left_pu), params->i_q_max_A, period_s) ||
        !init_schedule(&c, params) || !init_torque(&c, params, motor, period_s)) {
        return false;
    }
    if (c.gain_extra_max > 0.0f) {
        with_schedule(&c, params, most, wanted, period_s);
    }
    *cfg = c;
    return true;
}
