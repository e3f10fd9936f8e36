/* Full-order flux observer, eq. (3)-(5): xh' = A(wh) xh + B u_s + L e1, e1 = i_s_hat - i_s.
 *
 * Stationary frame, states i_s_hat and lambda_r_hat. At sample k the step carries the estimate over
 * the interval that just ended. It uses the voltage that acted in it, and the e1, L and speed of
 * its start. Then it forms e1 with the current of sample k. Forward Euler (the paper), or second
 * order in A with T L e1 added separately, which removes Euler's bias at speed (THEORY 4).
 */
#ifndef OBSERVER_H
#define OBSERVER_H

#include <stdbool.h>
#include <stdint.h>

#include "frames.h"
#include "gain_table.h"
#include "motor.h"

typedef enum {
    OBSERVER_EULER = 0,
    OBSERVER_SECOND_ORDER = 1
} observer_method_t;

typedef struct {
    float i_max_A; /* the states are held inside +-max (e1: twice that) */
    float lambda_max_Wb;
    observer_method_t method;
} observer_params_t;

typedef struct {
    float period_s;
    float half_period_s;
    float a11_per_s;     /* (Rs + M^2 Rr/Lr^2)/(sigma Ls) */
    float tau_per_s;     /* Rr/Lr */
    float inv_eps_per_H; /* 1/epsilon */
    float m_tau_ohm;     /* M Rr/Lr */
    float inv_sigma_Ls_per_H;
    float i_max_A;
    float lambda_max_Wb;
    observer_method_t method;
} observer_config_t;

typedef struct {
    ab_t i_s_hat_A;
    ab_t lambda_r_hat_Wb;
    ab_t e1_A;
} observer_state_t;

typedef struct {
    ab_t u_s_V;              /* mean voltage over the interval that just ended */
    ab_t i_s_A;              /* sampled now */
    float omega_e_hat_rad_s; /* rotor speed estimate of the interval's start */
    float tau_extra_per_s;   /* on top of Rr/Lr in the decay of the flux */
    observer_gain_t gain;    /* L at that speed; all zero switches the correction off */
} observer_in_t;

/* False for bad machine data, limits or method, and for a period in which the current decays
 * completely (a11 T >= 1): Euler would swing. */
CHECKED bool observer_init(observer_config_t *cfg, const observer_params_t *params,
                           const motor_model_t *motor, float period_s);

void observer_step(const observer_config_t *cfg, observer_state_t *st, const observer_in_t *in);

/* Rs may be tracked: replaces a11 for the given stator resistance (same motor otherwise).
 * A resistance that is not finite and positive is ignored. */
void observer_set_rs(observer_config_t *cfg, const motor_model_t *motor, float Rs_ohm);

#endif
