/* V/f operation: a voltage vector that rotates at the reference speed, with the length that the
 * flux needs.
 *
 * |u| = boost + psi |w|, limited by the dc link. It needs no estimate and no current control: a
 * fallback if motor data or sensors cannot be trusted. The frequency waits while the current is
 * above its limit; a ramp far too steep (ten times the default) still ends in over-current.
 */
#ifndef VOLTS_PER_HERTZ_H
#define VOLTS_PER_HERTZ_H

#include <stdbool.h>

#include "frames.h"

typedef struct {
    float psi_Wb;  /* stator flux */
    float boost_V; /* at standstill: Rs i */
    float slew_rad_s2;
    float i_max_A; /* above: the frequency is not raised */
} volts_per_hertz_params_t;

typedef struct {
    float psi_Wb;
    float boost_V;
    float step_rad_s;
    float boost_step_V;
    float i_max2_A2;
    float period_s;
} volts_per_hertz_config_t;

/* A zeroed state starts along alpha. */
typedef struct {
    ab_t off_axis; /* axis minus (1, 0) */
    float omega_rad_s;
    float boost_V; /* on its ramp */
} volts_per_hertz_state_t;

/* False for a number that is not finite or of the wrong sign. */
CHECKED bool volts_per_hertz_init(volts_per_hertz_config_t *cfg,
                                  const volts_per_hertz_params_t *params, float period_s);

/* For a motor that already turns: starts a quarter turn ahead of its rotor flux. Zeroed if that
 * gives no direction or speed. */
COLD void volts_per_hertz_start(const volts_per_hertz_config_t *cfg, volts_per_hertz_state_t *st,
                                ab_t lambda_r_Wb, float omega_rad_s);

/* Voltage for the middle of the interval in which the next duties act. */
COLD ab_t volts_per_hertz_step(const volts_per_hertz_config_t *cfg, volts_per_hertz_state_t *st,
                               float omega_ref_rad_s, ab_t i_s_A, float u_dc_V);

#endif
