/* What the EMF tells of a rotor that nobody estimates. Stationary frame, duties for the voltage.
 *
 * e = u - Rs i - j w_s sigma Ls i = j w_s kr lambda_r in steady state. A current vector turned at
 * w_s makes lambda_r = M i/(1 + j x), x = slip Lr/Rr, so that
 *
 *   Re(e conj(i)) = w_s kr M |i|^2 x/(1 + x^2),   Im(e conj(i)) = w_s kr M |i|^2/(1 + x^2)
 *
 * and neither Rs nor dead time, both in phase with i, touches the second. Pull-out is at |x| = 1; a
 * rotor that was lost has |x| far above. With a voltage vector the slip may be larger, and the flux
 * |e|/(w_s kr) is what collapses.
 *
 * Direct current along alpha at a start: a shaft at rest leaves beta alone; one that turns shows an
 * EMF there that changes its sign, residual flux of a rotor at rest one that does not.
 */
#ifndef ROTOR_CHECK_H
#define ROTOR_CHECK_H

#include <stdbool.h>
#include <stdint.h>

#include "frames.h"
#include "motor.h"

typedef enum {
    ROTOR_FOLLOWS = 0,
    ROTOR_LOST = 1,
    ROTOR_NOT_SEEN = 2 /* too little EMF at this frequency to tell */
} rotor_check_t;

typedef struct {
    float sigma_Ls_H;
    float kr_M_H;         /* EMF of a current vector whose rotor follows, per rad/s and A */
    float kr_lambda_Wb;   /* likewise of a voltage vector, per rad/s */
    float current_rad_s;  /* frequency from which the EMF of a current vector tells */
    float voltage_rad_s;  /* likewise of a voltage vector */
    float start_V;        /* EMF of a turning shaft at a start */
    uint32_t start_looks; /* of which there are so many */
    float share;          /* of the mean, per step */
} rotor_check_config_t;

typedef struct {
    ab_t power_VA;     /* mean of e conj(i) */
    float i2_A2;       /* mean of |i|^2 */
    uint32_t looks;    /* at a start */
    float e_V;         /* in the last of them */
    uint32_t positive; /* those that saw an EMF of this sign, twice in a row */
    uint32_t negative;
} rotor_check_state_t;

typedef struct {
    bool voltage; /* a voltage vector; else a current vector */
    float omega_s_rad_s;
    ab_t u_V; /* of the interval that ended, by the duties */
    ab_t i_A;
    float Rs_ohm;
} rotor_check_in_t;

/* lambda_Wb: flux of V/f operation. */
void rotor_check_init(rotor_check_config_t *cfg, const motor_model_t *motor, float lambda_Wb,
                      float step_s);

/* One step of a mode that imposes the frequency. */
rotor_check_t rotor_check_step(const rotor_check_config_t *cfg, rotor_check_state_t *st,
                               const rotor_check_in_t *in);

/* One step of a start's direct current: the shaft turns. */
bool rotor_turns(const rotor_check_config_t *cfg, rotor_check_state_t *st,
                 const rotor_check_in_t *in);

#endif
