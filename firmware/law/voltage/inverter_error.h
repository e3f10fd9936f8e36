/* Voltage lost in dead time and device drops, to be added to the reference.
 *
 * Per phase dU = (k u_dc + drop) sat(i/i_th), k = fraction dead_time/T. It saturates because
 * parasitic capacitances soften the step near zero current. The sign comes from the current
 * predicted for the middle of the interval in which the duty acts.
 *
 * A curve that was found at the start may have a tail: 1 - tail/i of dU is lost at a current i
 * above the threshold. While a leg's capacitance C is charged by i, u^2 C/(2 T i) of k u_dc is not
 * lost.
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
} inverter_error_config_t;

/* What a leg loses. */
typedef struct {
    float whole_V;     /* at currents above the threshold */
    float threshold_A; /* below: proportional; > 0 */
    float tail_A;      /* above: 1 - tail_A/i of whole_V is lost; below threshold_A */
} leg_loss_t;

/* False unless 0 <= fraction <= 1, 0 <= dead_time < period, drop >= 0, i_threshold > 0. */
CHECKED bool inverter_error_init(inverter_error_config_t *cfg,
                                 const inverter_error_params_t *params, float period_s);

/* Loss of a leg, from the parameters. */
static inline leg_loss_t inverter_error_loss(const inverter_error_config_t *cfg, float u_dc_V)
{
    return (leg_loss_t){.whole_V = cfg->k * u_dc_V + cfg->drop_V,
                        .threshold_A = cfg->i_threshold_A,
                        .tail_A = 0.0f};
}

/* Stationary-frame voltage to add to the reference for the predicted current. Exactly zero for a
 * leg without loss and for a loss that is not finite. */
ab_t inverter_error_voltage(leg_loss_t loss, ab_t i_predicted_A);

#endif
