#include "drive_params.h"

/* What is stepped once in a schedule. */
static bool init_scheduled(drive_config_t *cfg, const drive_params_t *p)
{
    const float schedule_s = (float)SLOT_COUNT * p->period_s;
    if (!rs_tracking_init(&cfg->rs_tracking, &p->rs_tracking, schedule_s) ||
        !heating_init(&cfg->heating, &p->heating, schedule_s) ||
        !m_tracking_init(&cfg->m_tracking, &p->m_tracking, &cfg->motor, schedule_s)) {
        return false;
    }
    offset_tracking_init(&cfg->offset_tracking, &p->offset_tracking, &cfg->motor, schedule_s);
    unbalance_tracking_init(&cfg->unbalance_tracking, p->unbalance_tracking, schedule_s);
    return dwell_init(&cfg->dwell, &p->dwell, &cfg->motor, schedule_s);
}

static bool init_estimator(drive_config_t *cfg, const drive_params_t *p, const gain_table_t *table)
{
    return measurement_init(&cfg->measurement, &p->measurement) &&
           acting_voltage_init(&cfg->acting, &p->acting) &&
           estimator_init(&cfg->estimator, p->list, &cfg->motor, table) &&
           supervisor_init(&cfg->supervisor, &p->supervisor, &cfg->motor, p->period_s) &&
           init_scheduled(cfg, p);
}

static bool init_vector(vector_config_t *cfg, const drive_params_t *p, const motor_model_t *motor)
{
    const float lambda_Wb = p->motor.M_H * p->flux.i_d_A;
    cfg->motor = *motor;
    cfg->inv_lambda_ref_per_Wb = 1.0f / lambda_Wb;
    cfg->lambda_min_Wb = ESTIMATE_LAMBDA_MIN_PU * p->motor.M_H * p->flux.i_d_A;
    cfg->ride_through = p->modes.mains.u_lost_V > 0.0f;
    const float schedule_s = (float)SLOT_COUNT * p->period_s;
    const float quarter_s = (float)SLOT_QUARTERS * p->period_s;
    return speed_control_init(&cfg->speed, &p->speed, motor, p->period_s) &&
           speed_ramp_init(&cfg->ramp, &p->ramp, quarter_s) &&
           flux_control_init(&cfg->flux, &p->flux, motor) &&
           flux_steering_init(&cfg->steering, &p->steering, motor, schedule_s) &&
           flux_reference_init(&cfg->reference, &p->modes.flux, motor, schedule_s) &&
           mains_loss_init(&cfg->mains, &p->modes.mains, motor, p->period_s);
}

static bool control_known(modes_control_t control)
{
    return (control == MODES_CONTROL_VECTOR) || (control == MODES_CONTROL_VOLTS_PER_HERTZ) ||
           (control == MODES_CONTROL_I_F);
}

static bool init_premagnetise(premagnetise_config_t *cfg, const drive_params_t *p, float Rs_ohm)
{
    const float kr = p->motor.M_H / p->motor.Lr_H;
    cfg->Rs_ohm = Rs_ohm;
    cfg->Rr_ohm = kr * kr * p->motor.Rr_ohm;
    cfg->identify_leg_loss = p->dead_time_identify;
    return rs_measurement_init(&cfg->measurement, &p->rs_measurement, p->motor.Rs_ohm, p->period_s);
}

static bool init_open_loop(modes_config_t *cfg, const drive_params_t *p, const motor_model_t *motor)
{
    const bool volts = p->modes.control == MODES_CONTROL_VOLTS_PER_HERTZ;
    return i_f_init(&cfg->i_f, &p->i_f, motor, p->period_s) &&
           (!volts || volts_per_hertz_init(&cfg->volts, &p->modes.volts, p->period_s));
}

/* Search and brake share the direct current. */
static bool init_modes(modes_config_t *cfg, const drive_params_t *p, const motor_model_t *motor)
{
    const modes_params_t *modes = &p->modes;
    const bool direct = modes->flying.enable || (modes->brake.current_A > 0.0f);
    cfg->control = modes->control;
    cfg->fixed = (modes->control == MODES_CONTROL_VECTOR) && !direct;
    return control_known(modes->control) && init_vector(&cfg->vector, p, motor) &&
           init_premagnetise(&cfg->premagnetise, p, motor->Rs_ohm) &&
           init_open_loop(cfg, p, motor) &&
           flying_start_init(&cfg->flying, &modes->flying, motor, p->period_s) &&
           (!direct ||
            dc_current_init(&cfg->dc_current, modes->dc_bandwidth_rad_s, motor, p->period_s)) &&
           dc_brake_init(&cfg->brake, &modes->brake, p->period_s);
}

static bool init_voltage(voltage_config_t *cfg, const drive_params_t *p, const motor_model_t *motor)
{
    cfg->delay_comp_s = p->delay_comp_periods * p->period_s;
    return nonnegativef(p->delay_comp_periods) &&
           current_control_init(&cfg->current, &p->current, motor, p->period_s) &&
           svpwm_init(&cfg->svpwm, &p->svpwm, p->period_s) &&
           inverter_error_init(&cfg->error, &p->dead_time, p->period_s);
}

static bool init_protection(drive_config_t *cfg, const drive_params_t *p)
{
    const float schedule_s = (float)SLOT_COUNT * p->period_s;
    cfg->guard.i_q_max2_A2 = cfg->modes.vector.speed.i_q_max2_A2;
    cfg->guard.i_max2_A2 = cfg->modes.vector.speed.i_max2_A2;
    cfg->guard.kr = cfg->motor.kr;
    const torque_limits_params_t limits = {
        .link = p->link, .overload = p->overload, .i_q_max_A = p->speed.i_q_max_A};
    const float M_H = cfg->motor.kr * cfg->motor.M_H;
    const guard_sensor_params_t sensors = {.period_s = p->period_s,
                                           .Rs_ohm = cfg->motor.Rs_ohm,
                                           .sigma_Ls_H = cfg->motor.sigma_Ls_H,
                                           .flux_Wb = M_H * p->flux.i_d_A,
                                           .M_H = M_H,
                                           .A_per_count = cfg->measurement.A_per_count};
    speed_guard_params_t speed = p->speed_guard;
    speed.count_V = cfg->voltage.current.pi.kp * cfg->measurement.A_per_count;
    return torque_limits_init(&cfg->limits, &limits, schedule_s) &&
           guard_init(&cfg->guard, &p->monitor, &p->plausibility, &sensors) &&
           speed_guard_init(&cfg->guard.speed, &speed, &cfg->motor, schedule_s);
}

/* I-f current is there where something may ask for it. */
static bool lost_action_valid(const drive_config_t *cfg, const drive_params_t *p)
{
    const bool known = (p->lost_action == DRIVE_LOST_TELL) || (p->lost_action == DRIVE_LOST_STOP) ||
                       (p->lost_action == DRIVE_LOST_I_F);
    const bool wanted =
        (p->lost_action == DRIVE_LOST_I_F) || (p->modes.control == MODES_CONTROL_I_F);
    return known && (!wanted || i_f_on(&cfg->modes.i_f));
}

bool drive_init(drive_config_t *cfg, const drive_params_t *params, const gain_table_t *table)
{
    *cfg = (drive_config_t){.lost_action = params->lost_action};
    return positivef(params->period_s) && motor_derive(&cfg->motor, &params->motor) &&
           init_estimator(cfg, params, table) && init_modes(&cfg->modes, params, &cfg->motor) &&
           init_voltage(&cfg->voltage, params, &cfg->motor) && init_protection(cfg, params) &&
           lost_action_valid(cfg, params);
}
