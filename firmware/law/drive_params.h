/* Parameters of all parts of the law, in SI units. */
#ifndef DRIVE_PARAMS_H
#define DRIVE_PARAMS_H

#include "drive.h"

typedef struct {
    modes_control_t control;
    flux_reference_params_t flux;
    flying_start_params_t flying;
    volts_per_hertz_params_t volts;
    mains_loss_params_t mains;
    dc_brake_params_t brake;
    float dc_bandwidth_rad_s; /* of the direct current's control */
} modes_params_t;

struct drive_params {
    const params_t *list; /* the unconverted parameters, for the estimator */
    float period_s;
    motor_t motor;
    measurement_params_t measurement;
    acting_voltage_params_t acting;
    float delay_comp_periods; /* reference voltage is turned ahead by w_s T times this */
    speed_control_params_t speed;
    speed_ramp_params_t ramp;
    flux_control_params_t flux;
    current_control_params_t current;
    svpwm_params_t svpwm;
    inverter_error_params_t dead_time;
    bool dead_time_identify; /* use the loss found by the dc measurement, not the parameters */
    rs_measurement_params_t rs_measurement;
    rs_tracking_params_t rs_tracking;
    heating_params_t heating;
    m_tracking_params_t m_tracking;
    offset_tracking_params_t offset_tracking;
    bool unbalance_tracking;
    dwell_params_t dwell;
    flux_steering_params_t steering;
    monitor_config_t monitor;
    link_limit_params_t link;
    overload_params_t overload;
    plausibility_params_t plausibility;
    speed_guard_params_t speed_guard;
    supervisor_params_t supervisor;
    drive_lost_action_t lost_action;
    i_f_params_t i_f;
    modes_params_t modes;
};

#endif
