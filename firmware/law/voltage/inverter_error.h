/* Voltage lost in dead time and device drops, to be added to the reference.
 *
 * Per phase dU = (k u_dc + drop) sat(i/i_th), k = fraction dead_time/T. It saturates because
 * parasitic capacitances soften the step near zero current. The sign comes from the current
 * predicted for the middle of the interval in which the duty acts.
 */
#ifndef INVERTER_ERROR_H
#define INVERTER_ERROR_H

#include <stdbool.h>

#include "frames.h"

typedef struct {
    float fraction; /* share that is compensated: 0 off, 1 all */
    float dead_time_s;
    float drop_V;        /* device forward drop */
    float i_threshold_A; /* below: proportional */
} inverter_error_params_t;

typedef struct {
    float k;      /* fraction dead_time/period */
    float drop_V; /* fraction of the drop */
    float i_threshold_A;
    float inv_i_threshold_per_A;
} inverter_error_config_t;

/* False unless 0 <= fraction <= 1, 0 <= dead_time < period, drop >= 0, i_threshold > 0. */
CHECKED bool inverter_error_init(inverter_error_config_t *cfg,
                                 const inverter_error_params_t *params, float period_s);

/* Loss of a leg at currents above the threshold, from the parameters. */
static inline float inverter_error_lost_V(const inverter_error_config_t *cfg, float u_dc_V)
{
    return cfg->k * u_dc_V + cfg->drop_V;
}

/* Stationary-frame voltage to add to the reference for the predicted current. Exactly zero for a
 * leg without loss and for a loss that is not finite. */
ab_t inverter_error_voltage(const inverter_error_config_t *cfg, ab_t i_predicted_A, float lost_V);

#endif
