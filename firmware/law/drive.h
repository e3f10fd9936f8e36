/* The control law of one drive, one call per 200 us period, in one direction:
 *
 *   ADC -> measurement -> observer -> speed adaptation -> speed PI -> current PI -> SVPWM -> duty
 *
 * A stator resistance other than the parameter's (measured at the start, tracked while running)
 * acts as voltage: u - (Rs - Rs_parameter) i_s. Observer, gain table and adaptation angle stay
 * those that were designed and proven.
 *
 * The only file that knows the order. Timing: step k takes the samples of carrier crest t_k; its
 * duties act on t_(k+1) .. t_(k+2), so the interval that ended at t_k had the duties of step k - 2.
 */
#ifndef DRIVE_H
#define DRIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "current_control.h"
#include "inverter_error.h"
#include "drive_modes.h"
#include "flux_control.h"
#include "flux_steering.h"
#include "frames.h"
#include "gain_table.h"
#include "i_f.h"
#include "link_limit.h"
#include "measurement.h"
#include "monitor.h"
#include "motor.h"
#include "observer.h"
#include "overload.h"
#include "plausibility.h"
#include "rs_measurement.h"
#include "rs_tracking.h"
#include "speed_adaptation.h"
#include "speed_control.h"
#include "speed_ramp.h"
#include "supervisor.h"
#include "svpwm.h"

/* Slow work has its turn every so many periods, each kind in a period of its own, so that the worst
 * period stays near the mean. */
#define DRIVE_SLOW_PERIODS 16u

typedef enum {
    DRIVE_OFF = 0, /* gates off: estimator and controllers at rest, currents still watched */
    DRIVE_PREMAGNETISE = 1, /* i_d along a fixed axis, no torque, speed taken as 0 */
    DRIVE_RUN = 2,          /* flux-oriented control of what the aim says */
    DRIVE_COMMISSION = 3    /* i_d as asked along phase u, nothing estimated or compensated */
} drive_mode_t;

/* What DRIVE_RUN is to reach. */
typedef enum {
    DRIVE_AIM_SPEED = 0,
    DRIVE_AIM_TORQUE = 1, /* between two speeds */
    DRIVE_AIM_STOP = 2    /* speed 0, on the ramp of a stop */
} drive_aim_t;

typedef enum {
    DRIVE_VOLTAGE_SENSORS = 0, /* filtered line-voltage sensors (the paper) */
    DRIVE_VOLTAGE_DUTY = 1     /* reconstructed from the duty that acted */
} drive_voltage_source_t;

/* When the supervisor finds the orientation lost. */
typedef enum {
    DRIVE_LOST_TELL = 0,   /* telemetry only, as the paper would */
    DRIVE_LOST_STOP = 1,   /* a fault: gates off */
    DRIVE_LOST_IMPRESS = 2 /* impressed current holds the load until the estimate is back */
} drive_lost_action_t;

typedef struct {
    float period_s;
    motor_t motor;
    measurement_params_t measurement;
    drive_voltage_source_t voltage_source;
    float voltage_filter_comp_s; /* sensor voltage is turned ahead by w_s times this */
    float delay_comp_periods;    /* reference voltage is turned ahead by w_s T times this */
    observer_method_t observer_method;
    bool observer_gain_enable; /* false: L = 0 */
    float lambda_max_Wb;
    speed_adaptation_params_t adaptation;
    speed_control_params_t speed;
    speed_ramp_params_t ramp;
    flux_control_params_t flux;
    current_control_params_t current;
    svpwm_params_t svpwm;
    inverter_error_params_t dead_time;
    bool dead_time_identify; /* the loss that the dc measurement finds, instead of the parameters */
    rs_measurement_params_t rs_measurement;
    rs_tracking_params_t rs_tracking;
    flux_steering_params_t steering;
    monitor_config_t monitor;
    link_limit_params_t link;
    overload_params_t overload;
    plausibility_params_t plausibility;
    supervisor_params_t supervisor;
    drive_lost_action_t lost_action;
    i_f_params_t impressed;
    drive_modes_params_t modes;
} drive_params_t;

typedef struct {
    float period_s;
    motor_model_t motor;
    measurement_config_t measurement;
    drive_voltage_source_t voltage_source;
    float voltage_filter_comp_s;
    float delay_comp_s;
    float lambda_min_Wb;       /* below: no orientation from the estimate */
    const gain_table_t *table; /* NULL: L = 0 */
    float table_end_rad_s;     /* from here on L turns with the speed; FLT_MAX: it holds */
    observer_config_t observer;
    speed_adaptation_config_t adaptation;
    speed_control_config_t speed;
    speed_ramp_config_t ramp;
    flux_control_config_t flux;
    current_control_config_t current;
    svpwm_config_t svpwm;
    inverter_error_config_t dead_time;
    bool dead_time_identify;
    float inv_lambda_ref_per_Wb;
    rs_measurement_config_t rs_measurement;
    rs_tracking_config_t rs_tracking;
    flux_steering_config_t steering;
    monitor_config_t monitor;
    link_limit_config_t link;
    overload_config_t overload;
    plausibility_config_t plausibility;
    supervisor_config_t supervisor;
    drive_lost_action_t lost_action;
    i_f_config_t impressed;
    drive_modes_config_t modes;
} drive_config_t;

typedef struct {
    measurement_state_t measurement;
    observer_state_t observer;
    speed_adaptation_state_t adaptation;
    speed_control_state_t speed;
    speed_ramp_state_t ramp;
    flux_control_state_t flux;
    current_control_state_t current;
    rs_measurement_state_t rs_measurement;
    rs_tracking_state_t rs_tracking;
    flux_steering_state_t steering;
    flux_steering_out_t steer;    /* of its last turn */
    float flux_below_Wb;          /* nominal flux minus the reference: steering or flux level */
    float i_d_less_A;             /* what that takes from the magnetising current */
    float torque_more_pu;         /* nominal flux over the reference, less 1 */
    bool pull_out_near;           /* the flux level takes torque current away */
    float omega_ref_before_rad_s; /* at the last turn of Rs tracking */
    uint32_t slow_period;
    monitor_state_t monitor;
    link_limit_state_t link;
    overload_state_t overload;
    uint32_t idle_periods; /* of its turn while not in RUN */
    plausibility_state_t plausibility;
    supervisor_state_t supervisor;
    i_f_state_t impressed;
    float rs_start_delta_ohm; /* Rs found at the start minus the parameter; 0: none found */
    float dead_time_pu;       /* leg voltage lost over dc link, as found */
    bool dead_time_found;     /* else by the parameters */
    float omega_e_hat_rad_s;
    float omega_s_hat_rad_s;
    ab_t u_acting_V;           /* voltage of the duties acting from now to the next sample */
    ab_t u_pending_V;          /* voltage of the duties of the last step, which act after that */
    drive_modes_state_t modes; /* last: what every period needs stays within a load's reach */
} drive_state_t;

typedef struct {
    measurement_in_t sample;
    drive_mode_t mode;
    drive_aim_t aim;
    float omega_e_ref_rad_s; /* 0 with DRIVE_AIM_STOP */
    float torque_ref_Nm;
    float i_d_ref_A; /* DRIVE_COMMISSION alone */
} drive_in_t;

/* What happened in one period and is not kept in the state: duties for the port, the rest for
 * telemetry and trace. */
typedef struct {
    uvw_t duty;
    uint32_t faults;
    measurement_out_t meas;
    ab_t u_s_V; /* voltage given to the observer */
    dq_t i_ref_A;
    dq_t i_A;
    observer_gain_t gain;
    rs_measurement_status_t rs_measurement; /* BUSY: premagnetisation is not over yet */
} drive_out_t;

/* table may be NULL when observer_gain_enable is false. False: some value refused; then *cfg must
 * not be used. */
CHECKED bool drive_init(drive_config_t *cfg, const drive_params_t *params,
                        const gain_table_t *table);

void drive_step(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *in,
                drive_out_t *out);

/* Everything but the sensors' offsets back to rest. */
void drive_reset(drive_state_t *st);

/* A stop has come to its end: reference and estimate are within this of standstill. */
bool drive_standing(const drive_state_t *st, float omega_e_max_rad_s);

/* Stator resistance in use. */
float drive_rs_ohm(const drive_config_t *cfg, const drive_state_t *st);

#endif
