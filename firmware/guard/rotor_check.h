/* Does the rotor follow, judged by the EMF, when nothing estimates it? Stationary frame, voltage
 * from the duties.
 *
 * e = u - Rs i - j w_s sigma Ls i = j w_s kr lambda_r in steady state. A current vector that
 * rotates at w_s makes lambda_r = M i/(1 + j x), x = slip Lr/Rr, so that
 *
 *   Re(e conj(i)) = w_s kr M |i|^2 x/(1 + x^2),   Im(e conj(i)) = w_s kr M |i|^2/(1 + x^2)
 *
 * Rs and dead time are in phase with i and do not affect the second. Pull-out is at |x| = 1; a lost
 * rotor has |x| far above. Where i saturates the motor M is smaller and the second too; the ratio
 * of the two is still x, as far as Rs and dead time are known. With a voltage vector the slip may
 * be larger; there the flux |e|/(w_s kr) collapses.
 *
 * At a start the direct current flows along alpha. A shaft at rest leaves beta at zero. A turning
 * shaft shows an EMF in beta that changes its sign; residual flux of a rotor at rest shows one that
 * does not.
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
    ROTOR_NOT_SEEN = 2 /* too little EMF at this frequency to judge */
} rotor_check_t;

typedef struct {
    float sigma_Ls_H;
    float kr_M_H;         /* EMF of a current vector whose rotor follows, per rad/s and A */
    float kr_lambda_Wb;   /* likewise of a voltage vector, per rad/s */
    float current_rad_s;  /* frequency above which the EMF of a current vector is usable */
    float voltage_rad_s;  /* likewise of a voltage vector */
    float start_V;        /* EMF of a turning shaft at a start */
    uint32_t start_looks; /* number of checks at a start */
    float share;          /* of the mean, per step */
} rotor_check_config_t;

typedef struct {
    ab_t power_VA;     /* mean of e conj(i) */
    float i2_A2;       /* mean of |i|^2 */
    uint32_t looks;    /* at a start */
    float e_V;         /* EMF in the last of them */
    uint32_t positive; /* checks with an EMF of this sign, twice in a row */
    uint32_t negative;
} rotor_check_state_t;

typedef struct {
    bool voltage; /* a voltage vector; else a current vector */
    float omega_s_rad_s;
    ab_t u_V; /* of the interval that ended, by the duties */
    ab_t i_A;
    float Rs_ohm;
} rotor_check_in_t;

/* lambda_Wb: flux of V/f operation. count_V: answer of the current controller to one count of the
 * current ADC; a start's EMF has to be above 1.5 of these. */
void rotor_check_init(rotor_check_config_t *cfg, const motor_model_t *motor, float lambda_Wb,
                      float count_V, float step_s);

/* One step of a mode that imposes the frequency. */
rotor_check_t rotor_check_step(const rotor_check_config_t *cfg, rotor_check_state_t *st,
                               const rotor_check_in_t *in);

/* One step of a start's direct current: true if the shaft turns. */
bool rotor_turns(const rotor_check_config_t *cfg, rotor_check_state_t *st,
                 const rotor_check_in_t *in);

#endif
