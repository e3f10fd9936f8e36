/* Flux-oriented current PI with decoupling; dq currents -> dq voltage.
 *
 * u = Kp e + x + decoupling: u_d -= w_s sigmaLs i_q, u_q += w_s sigmaLs i_d + kr w_e lambda. Kp =
 * bw sigmaLs, Ki = ki_factor bw Kp. Output and update are separate: update is told the realised
 * voltage (limits of the inverter), which is the anti-windup (back-calculation). The voltage acts
 * one period after the sample, for one period: 1.5 T of delay. So bw T < 1 is required, and bw T <
 * .25 the aim.
 */
#ifndef CURRENT_CONTROL_H
#define CURRENT_CONTROL_H

#include <stdbool.h>

#include "frames.h"
#include "motor.h"
#include "pi.h"

typedef struct {
    float bandwidth_rad_s;
    float ki_factor;
    float decoupling; /* 0 none .. 1 full */
    float u_max_V;    /* bound of the integrators */
} current_control_params_t;

typedef struct {
    pi_config_t pi;
    float sigma_Ls_H;
    float kr;
    float decoupling;
} current_control_config_t;

typedef struct {
    pi_state_t d;
    pi_state_t q;
} current_control_state_t;

typedef struct {
    dq_t i_ref_A;
    dq_t i_A;
    float omega_s_rad_s;
    float omega_e_rad_s;
    float lambda_Wb;
} current_control_in_t;

/* False for a bad number or bw T >= 1, where the sampled loop is unstable. */
CHECKED bool current_control_init(current_control_config_t *cfg,
                                  const current_control_params_t *params,
                                  const motor_model_t *motor, float period_s);

/* Voltage reference, V. Only reads the state. */
dq_t current_control_output(const current_control_config_t *cfg, const current_control_state_t *st,
                            const current_control_in_t *in);

/* Updates the integrators. added_V: the voltage realised less the one asked for; NULL: none. */
void current_control_update(const current_control_config_t *cfg, current_control_state_t *st,
                            const current_control_in_t *in, const dq_t *added_V);

/* Another voltage than the one asked for acts: the integrators follow, in any frame. */
COLD void current_control_track(current_control_state_t *st, dq_t asked_V, dq_t acting_V);

/* Rotates the integrators from the frame of `from` into the frame of `to`. */
COLD void current_control_turn(current_control_state_t *st, ab_t from, ab_t to);

/* Reverses the voltage along d; that along q stays. */
static inline void current_control_mirror(current_control_state_t *st)
{
    st->d.x = -st->d.x;
}

/* Moves the EMF part of the decoupling into the integrator: the estimate ends here. */
COLD void current_control_keep_emf(const current_control_config_t *cfg, current_control_state_t *st,
                                   float omega_e_rad_s, float lambda_Wb);

#endif
