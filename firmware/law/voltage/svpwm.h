/* Space-vector PWM: stationary-frame voltage and dc link -> three duties 0..1.
 *
 * Zero-sequence injection -(max+min)/2 (centred space-vector modulation). Overmodulation: beyond
 * the hexagon the vector is shortened at constant angle. Minimum pulse: an on or off pulse shorter
 * than min_pulse is dropped (duty 0 or 1) when below half of it, else lengthened to it. Output: the
 * duties and the voltage they produce, in the motor's phase order, for anti-windup and observer.
 */
#ifndef SVPWM_H
#define SVPWM_H

#include <stdbool.h>

#include "frames.h"

typedef struct {
    float min_pulse_s;
    float u_dc_min_V; /* below this the dc link cannot be divided by: duty .5 */
    bool swap_vw;     /* motor wired u-w-v: same switch as measurement */
} svpwm_params_t;

typedef struct {
    float min_duty;
    float inside_pu; /* span over dc link up to which no duty comes near a limit */
    float u_dc_min_V;
    float beta_sign; /* -1: a motor wired u-w-v sees the mirrored vector */
} svpwm_config_t;

typedef struct {
    uvw_t duty; /* in the order of the inverter's legs */
    ab_t u_realised_V;
    bool exact;   /* u_realised_V is the reference itself: no duty came near a limit */
    bool limited; /* reference outside the hexagon, or no voltage possible (duty .5) */
} svpwm_out_t;

/* False unless 0 <= min_pulse < period/2 and u_dc_min > 0, all finite. */
CHECKED bool svpwm_init(svpwm_config_t *cfg, const svpwm_params_t *params, float period_s);

/* Reference or dc link not finite, or dc link low: duty .5, realised 0, limited. */
svpwm_out_t svpwm_step(const svpwm_config_t *cfg, ab_t u_ref_V, float u_dc_V);

#endif
