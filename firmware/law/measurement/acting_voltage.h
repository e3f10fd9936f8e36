/* Mean stator voltage over the interval that ended at this sample.
 *
 * The duties of step k act from the crest after it, so the interval that ended at t_k had the
 * duties of step k - 2. The source is one of three: the filtered line-voltage sensors (the paper),
 * the duty that acted, or a blend of both.
 *
 * The sensors are late: their 800 Hz filter delays every change (THEORY 4). What of a change they
 * do not show yet is taken from the duty, whose error hardly changes meanwhile: a filter runs on
 * the duty's voltage, and what it lags is added. With the delay d in periods,
 *   step_k = keep step_(k-1) + (1 - lag)(u_k - y_(k-1)),   y_k = y_(k-1) + step_k
 *   1 - lag = 2/((1 + d)(2 + d)),  keep = d/(2 + d):  1 - s D + (s D)^2/2 - ..., D = d periods
 * which is the sensors' own up to the second order. One of first order has (s D)^2 there: .2 % too
 * much voltage at 50 Hz, and commissioning took it for friction. Turning the reading ahead by w_s D
 * is right in steady state alone: the voltage of each change of torque came late, and the speed
 * loop swung (1 of 8 runs of `zh envelope` with voltage_source = sensors).
 *
 * The blend uses the sensors up to a stator frequency, where a volt lost in the inverter is a large
 * part of the voltage. From twice that it uses the duty, because there gain errors of the sensors
 * rotate against the current at twice the stator frequency, until they are found
 * (unbalance_tracking.h). Stationary frame.
 */
#ifndef ACTING_VOLTAGE_H
#define ACTING_VOLTAGE_H

#include <stdbool.h>

#include "frames.h"

typedef enum {
    ACTING_VOLTAGE_SENSORS = 0, /* filtered line-voltage sensors */
    ACTING_VOLTAGE_DUTY = 1,    /* reconstructed from the duty that acted */
    ACTING_VOLTAGE_BLEND = 2    /* sensors at low stator frequency, the duty above */
} acting_voltage_source_t;

typedef struct {
    acting_voltage_source_t source;
    float filter_comp_s; /* delay of the sensors */
    float period_s;
    /* Blend: sensors alone up to this |w_s|, the duty alone from twice that. */
    float blend_rad_s;
} acting_voltage_params_t;

typedef struct {
    acting_voltage_source_t source;
    float lag;         /* share of a change that the sensors do not show in its period */
    float keep;        /* of their change, from period to period */
    float inv_blend_s; /* 1/blend_rad_s */
} acting_voltage_config_t;

/* Voltages from the duties. */
typedef struct {
    ab_t ended_V;     /* of the interval that ended at this sample */
    ab_t acting_V;    /* from now to the next sample */
    ab_t pending_V;   /* after that: of the duties of the last step */
    ab_t legs_V;      /* of those duties, with what the inverter will lose */
    ab_t lagging_V;   /* ended_V as the sensors show it: late */
    ab_t lag_step_V;  /* its change in the last period */
    float duty_share; /* of the blend, 0 to 1 */
} acting_voltage_state_t;

/* False for an unknown source, a delay that is negative or not finite, or a blend or period that is
 * not positive. */
CHECKED bool acting_voltage_init(acting_voltage_config_t *cfg,
                                 const acting_voltage_params_t *params);

/* The blend's share at this speed of the flux; need not be called every period. */
static inline void acting_voltage_blend(const acting_voltage_config_t *cfg,
                                        acting_voltage_state_t *st, float omega_s_rad_s)
{
    st->duty_share = clampf(absf(omega_s_rad_s) * cfg->inv_blend_s - 1.0f, 0.0f, 1.0f);
}

/* Stores the voltage of this period's duties. */
static inline void acting_voltage_push(acting_voltage_state_t *st, ab_t u_V)
{
    st->pending_V = u_V;
}

/* One period: the voltage of the ended interval, from the source in use. u_line_V: sensed now. */
ab_t acting_voltage_step(const acting_voltage_config_t *cfg, acting_voltage_state_t *st,
                         ab_t u_line_V);

#endif
