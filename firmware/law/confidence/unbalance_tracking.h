/* Unequal gains of the sensors, from what is known to be balanced.
 *
 * A vector x is seen as x + n conj(x) then (measured.h). n conj(x) turns against the field: the
 * estimated speed swings at twice the stator frequency, and the speed loop makes torque of it. n
 * stands still, is followed here and taken out in measurement.c.
 *
 *   voltages  r = seen - u, with the voltage u of the duties behind the sensors' filter: n' = g r u
 * / |u|^2. What the inverter loses turns with the field, offsets stand: both average out. currents
 * the sum s of the three phases, which is 0 with equal gains: s = sqrt(6) Re(n i), so n' = g
 * (2/sqrt(6) s conj(i)/|i|^2 - n).
 *
 * What the sensors of a kind have in common stays unknown. g = .04 (|w_s| - 2 Hz), at most as at 10
 * Hz: averaged over turns of the field. Below 2 Hz what was found holds: there the field may swing
 * about zero, and the inverter takes a large part of the voltage.
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
    ab_t residual_V; /* seen, found taken out, less expected_V */
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

/* Moves what was found. Without voltage or current its part stays; what is no number becomes -2 %.
 */
void unbalance_tracking_step(const unbalance_tracking_config_t *cfg, unbalance_t *found,
                             const unbalance_tracking_in_t *in);

#endif
