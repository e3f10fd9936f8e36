/* Rotor speed from the observer's current error: PI adaptation with the eps1-modification, eq.
 * (19).
 *
 *   z = Im(conj(lambda_hat) e1 exp(-j phi)),  x' = K_I z - c |z| x + f a,  w_hat = K_P z + x
 *
 * c in 1/(s Wb A). The paper's eps1 has no unit; three readings convert to c (THEORY 3).
 * phi (default 0) widens the region that stays stable with a wrong Rs (THEORY 2).
 * a is the acceleration that the torque current should make, f the share of it that is believed
 * (default 0). Without it the estimate of an accelerating shaft lags until z has grown to a/K_I,
 * and the speed loop that sees this lag resonates.
 *
 * Beside phi, K_I grows with the stator frequency, towards twice itself: by 1 - 20/|w_s| from 20
 * rad/s on. Nobody expects the acceleration that a load step makes. With the K_I that a crossing of
 * zero frequency bears, the estimate learns it too slowly, and the shaft dips by a fifth more at
 * speed (zh ensemble load_steps). Without phi K_I is the paper's constant. With three times K_I a
 * light motor on an elastic shaft swings at 45 Hz (run 305 of envelope seed 2178943013).
 */
#ifndef SPEED_ADAPTATION_H
#define SPEED_ADAPTATION_H

#include <stdbool.h>
#include <stdint.h>

#include "frames.h"
#include "gain_table.h"
#include "motor.h"

#define SPEED_ADAPTATION_PHI_STEPS 4u /* periods that phi stays */

#define SPEED_ADAPTATION_KI_FROM_RAD_S 20.0f /* |w_s| from which K_I grows */

typedef enum {
    SPEED_ADAPTATION_EPS1_OFF = 0,
    SPEED_ADAPTATION_EPS1_ALWAYS = 1,
    SPEED_ADAPTATION_EPS1_NEAR_ZERO = 2 /* only near zero stator frequency, with hysteresis */
} speed_adaptation_eps1_mode_t;

typedef struct {
    float kp_rad_per_s_Wb_A;
    float ki_rad_per_s2_Wb_A;
    float leak_per_s_Wb_A; /* c */
    speed_adaptation_eps1_mode_t eps1_mode;
    float accel_share;         /* f, 0..1 */
    float near_zero_on_rad_s;  /* |w_s| below: leak on */
    float near_zero_off_rad_s; /* |w_s| above: leak off; >= on */
    float omega_max_rad_s;     /* bound of x and of w_hat, electrical */
    float phi_factor;          /* kappa; 0 switches the angle off */
    float phi_ramp_rad_s;      /* phi grows with |w_s| up to here, so that it is smooth at 0 */
} speed_adaptation_params_t;

typedef struct {
    speed_adaptation_params_t p;
    float ki_T_rad_per_s_Wb_A; /* T K_I */
    float leak_T_per_Wb_A;     /* T c */
    float inv_phi_ramp_s;
    float a11_per_s;
    float tau_per_s;
    float inv_eps_per_H;
    float m_tau_ohm;
} speed_adaptation_config_t;

typedef struct {
    float x_rad_s;   /* integrator */
    bool near_zero;  /* hysteresis of the NEAR_ZERO mode: true when the leak is on */
    uint32_t steps;  /* of SPEED_ADAPTATION_PHI_STEPS: phi is taken anew in the first */
    ab_t phi;        /* as a unit vector */
    float ki_growth; /* beside phi K_I is 1 + this times itself */
} speed_adaptation_state_t;

typedef struct {
    ab_t lambda_r_hat_Wb;
    ab_t e1_A;
    float omega_s_hat_rad_s;   /* stator frequency estimate */
    float omega_e_hat_rad_s;   /* speed estimate of the last period: phi's operating point */
    float expected_step_rad_s; /* a T */
    observer_gain_t gain;      /* L in use: phi needs D(j w_s) */
    float dwell;               /* 0 to 1: phi_factor grows to 1 with it */
} speed_adaptation_in_t;

typedef struct {
    float z_Wb_A;
    float omega_e_hat_rad_s;
} speed_adaptation_out_t;

/* False unless all are finite, gains, leak and near_zero_on >= 0, near_zero_off >= on,
 * omega_max and phi_ramp > 0, phi_factor and accel_share in 0..1, and machine data and period are
 * positive. */
CHECKED bool speed_adaptation_init(speed_adaptation_config_t *cfg,
                                   const speed_adaptation_params_t *params,
                                   const motor_model_t *motor, float period_s);

speed_adaptation_out_t speed_adaptation_step(const speed_adaptation_config_t *cfg,
                                             speed_adaptation_state_t *st,
                                             const speed_adaptation_in_t *in);

/* The three readings of the paper's eps1 as c in 1/(s Wb A). */
float speed_adaptation_leak_from_literal(float eps1_per_s_Wb_A);
float speed_adaptation_leak_from_adaptive(float eps1_s_per_rad, float ki_rad_per_s2_Wb_A);
float speed_adaptation_leak_per_sample(float eps1_per_Wb_A, float period_s);

#endif
