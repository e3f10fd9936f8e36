/* The control law of one drive, one call per 200 us period, in one direction:
 *
 *   ADC -> measurement -> acting voltage -> estimator -> mode -> current control -> inverter error
 *       -> SVPWM -> duty, with the guard beside it
 *
 * A stator resistance that differs from the parameter (measured at the start, tracked while
 * running) acts as a voltage: u - (Rs - Rs_parameter) i_s. The estimator therefore stays as
 * designed and proven. A rotor resistance that differs from the parameter acts as slip (heating.h).
 *
 * This is the only file that knows the order. Timing: step k takes the samples of carrier crest
 * t_k; its duties act on t_(k+1) .. t_(k+2). The interval that ended at t_k therefore had the
 * duties of step k - 2.
 */
#ifndef DRIVE_H
#define DRIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "acting_voltage.h"
#include "dwell.h"
#include "estimator.h"
#include "guard.h"
#include "heating.h"
#include "m_tracking.h"
#include "offset_tracking.h"
#include "measurement.h"
#include "modes.h"
#include "rs_tracking.h"
#include "supervisor.h"
#include "torque_limits.h"
#include "unbalance_tracking.h"
#include "voltage.h"

/* Reaction to a lost orientation. */
typedef enum {
    DRIVE_LOST_TELL = 0, /* warning only, as in the paper */
    DRIVE_LOST_STOP = 1, /* a fault: gates off */
    DRIVE_LOST_I_F = 2   /* I-f takes over and holds the load until the estimate has recovered */
} drive_lost_action_t;

typedef struct {
    motor_model_t motor;
    measurement_config_t measurement;
    acting_voltage_config_t acting;
    estimator_config_t estimator;
    supervisor_config_t supervisor;
    rs_tracking_config_t rs_tracking;
    heating_config_t heating;
    m_tracking_config_t m_tracking;
    offset_tracking_config_t offset_tracking;
    unbalance_tracking_config_t unbalance_tracking;
    dwell_config_t dwell;
    torque_limits_config_t limits;
    modes_config_t modes;
    voltage_config_t voltage;
    guard_config_t guard;
    drive_lost_action_t lost_action;
} drive_config_t;

typedef struct {
    mode_id_t mode;
    drive_mode_t asked; /* request for which this mode was chosen */
    measurement_state_t measurement;
    acting_voltage_state_t acting;
    estimator_state_t estimator;
    voltage_state_t voltage;
    torque_limits_state_t limits;
    guard_state_t guard;
    supervisor_state_t supervisor;
    rs_tracking_state_t rs_tracking;
    heating_state_t heating;
    m_tracking_state_t m_tracking;
    offset_tracking_state_t offset_tracking;
    dwell_state_t dwell;
    float omega_ref_before_rad_s; /* at the last step of Rs tracking */
    uint32_t slot;                /* slots.h */
    modes_state_t modes;          /* last: what every period needs stays within a load's reach */
} drive_state_t;

/* Results of one period that are not kept in the state: duties for the port, the rest for telemetry
 * and trace. */
typedef struct {
    uvw_t duty;
    uint32_t faults;
    measured_t meas;
    ab_t u_s_V; /* mean voltage over the interval that ended */
    dq_t i_ref_A;
    dq_t i_A;
    ab_t axis;           /* of the request */
    bool premagnetising; /* measuring or searching: RUN has to wait */
} drive_out_t;

/* Parameters of all parts; drive_params.c makes them a configuration. */
typedef struct drive_params drive_params_t;

/* table may be NULL with L = 0. False: some value refused; then *cfg must not be used. */
CHECKED COLD bool drive_init(drive_config_t *cfg, const drive_params_t *params,
                             const gain_table_t *table);

void drive_step(const drive_config_t *cfg, drive_state_t *st, const measurement_in_t *sample,
                const drive_in_t *in, drive_out_t *out);

/* Resets everything except the sensor offsets. */
void drive_reset(drive_state_t *st);

/* True when a stop is complete: reference and estimate are within this of standstill. */
bool drive_standing(const drive_state_t *st, float omega_e_max_rad_s);

/* Stator resistance in use. */
static inline float drive_rs_ohm(const drive_config_t *cfg, const drive_state_t *st)
{
    return cfg->motor.Rs_ohm + st->modes.premagnetise.Rs_delta_ohm + st->rs_tracking.delta_ohm;
}

#endif
