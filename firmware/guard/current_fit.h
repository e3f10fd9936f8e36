/* Does the measured current explain the acting voltage? Needs no estimate and works in every mode.
 *
 * Over a window of 16 periods, u - Rs i - d(sigma Ls i)/dt is the EMF; its integral is the rotor
 * flux seen by the stator. That flux is limited at any speed, so the integral is limited at all
 * times:
 *   |psi| <= 2 Lambda + M^2/Lr |i| + b,   psi, b: forgetting time .1 s
 * b adds up the uncertainty: Rs from zero to twice its value, sigma Ls +-30 %, and 5 % of the dc
 * link lost in the inverter, or more where 4 us of dead time take more of a short period. Lambda
 * is 1.25 times the nominal flux; twice that, because the flux may have any angle when the gates
 * close. A motor under commissioning is known only within a factor. Stationary frame.
 */
#ifndef CURRENT_FIT_H
#define CURRENT_FIT_H

#include "frames.h"

typedef struct {
    float period_s;
    float Rs_ohm;
    float sigma_Ls_H;
    float flux_Wb; /* nominal, as the stator sees it */
    float M_H;     /* M^2/Lr: flux per current */
} current_fit_params_t;

typedef struct {
    current_fit_params_t p;
    float per_window_s; /* 1 over the window's time */
    float keep;         /* of the integral, from window to window */
    float inverter_s;   /* flux per dc link that the inverter may lose in a window */
    float limit_Wb;
} current_fit_config_t;

typedef struct {
    ab_t u_sum_V; /* of this window */
    ab_t i_sum_A;
    ab_t i_A;   /* where it began */
    ab_t emf_V; /* of the last window */
    ab_t psi_Wb;
    float b_Wb;
} current_fit_state_t;

/* False unless all are finite and positive and the window is shorter than the forgetting time. */
CHECKED bool current_fit_init(current_fit_config_t *cfg, const current_fit_params_t *params);

/* In every period with the gates on. */
static inline void current_fit_add(current_fit_state_t *st, ab_t u_V, ab_t i_A)
{
    st->u_sum_V = ab_add(st->u_sum_V, u_V);
    st->i_sum_A = ab_add(st->i_sum_A, i_A);
}

/* At the end of a window: false when the current does not explain the voltage. */
bool current_fit_holds(const current_fit_config_t *cfg, current_fit_state_t *st, ab_t i_A,
                       float u_dc_V, bool motor_known);

#endif
