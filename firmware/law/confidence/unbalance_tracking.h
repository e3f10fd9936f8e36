/* Unequal gains of the sensors, from what is balanced by itself.
 *
 * A vector x is seen as x + n conj(x) then (measured.h). n conj(x) turns against the field: the
 * estimated speed swings at twice the stator frequency, and the speed loop makes torque of it. n
 * stands still, is followed here and taken out in measurement.c.
 *
 * Voltages: r = seen - u, with the voltage u of the duties behind the sensors' filter, shows n as
 * r u/|u|^2: n' = g r u/|u|^2. What the inverter loses turns with the field, offsets stand: both
 * average out. A negative sequence of the inverter itself, from legs that differ, counts as one of
 * the sensors.
 *
 * Currents: the sum s of the three phases would be 0 with equal gains. s = sqrt(6) Re(n i), so n' =
 * g (2/sqrt(6) s conj(i)/|i|^2 - n). With two current sensors s is 0, and n stays 0: their gains
 * stay unequal. So it is for the samples in which a port rebuilds a leg from the other two.
 *
 * What all current sensors, or both line sensors, have in common stays unknown. The rate g is .04
 * of |w_s| - 4 pi rad/s, at most as at 10 Hz: an average over turns of the field. Below 2 Hz what
 * was found holds: there the field may swing about zero, and the inverter takes a large part of the
 * voltage. What was found also stays when offset_track is switched off, until the next self-test.
 */
#ifndef UNBALANCE_TRACKING_H
#define UNBALANCE_TRACKING_H

#include <stdbool.h>

#include "frames.h"
#include "measured.h"

typedef struct {
    float gain_s; /* .04 T; 0: off */
} unbalance_tracking_config_t;

typedef struct {
    ab_t residual_V; /* seen, with what was found taken out, less expected_V */
    ab_t expected_V; /* of the duties */
    ab_t i_s_A;
    float i_sum_A; /* of the phases */
    float omega_s_hat_rad_s;
} unbalance_tracking_in_t;

void unbalance_tracking_init(unbalance_tracking_config_t *cfg, bool on, float step_s);

static inline bool unbalance_tracking_on(const unbalance_tracking_config_t *cfg)
{
    return cfg->gain_s > 0.0f;
}

/* Moves what was found. Without voltage or current its part stays; a product that is not finite
 * makes it -2 %. */
void unbalance_tracking_step(const unbalance_tracking_config_t *cfg, unbalance_t *found,
                             const unbalance_tracking_in_t *in);

#endif
