/* How warm the motor is: what Rs and Rr have gained since the first start, and the slip that the
 * rotor's share makes.
 *
 *   winding: w' = (a i^2 - w)/tau,   w = Rs/Rs_cold - 1
 *   rotor:   r' = 1.5 (w + b i_q^2 - r)/tau,   r = Rr/Rr_parameter - 1
 *
 * w is the resistance in use: the model moves it, Rs tracking corrects it where Rs is seen, and a
 * start measures it anew. The rotor sits inside the stator: it follows the winding, and its own
 * copper loss lifts it above. The observer keeps the Rr that it was designed with; a rotor that is
 * warmer by r slips r times the observer's slip more than it says. Currents power invariant.
 */
#ifndef HEATING_H
#define HEATING_H

#include <stdbool.h>

#include "num.h"

typedef struct {
    float winding_pu; /* w of the rated current, in the end; 0: off */
    float rated_A;
    float i_d_A; /* of that: what magnetises */
    float tau_s;
} heating_params_t;

typedef struct {
    float fade;           /* T/tau */
    float winding_per_A2; /* a */
    float rotor_per_A2;   /* b */
    float slip_gain;      /* the slip's share that is taken over in a step */
} heating_config_t;

typedef struct {
    float Rs_cold_ohm; /* of the first start; 0: none yet */
    float winding_pu;
    float rotor_pu;
    float slip_rad_s; /* that the rotor slips more than the observer says */
} heating_state_t;

typedef struct {
    float i2_A2;
    float i_q_A;
    float Rs_ohm;      /* in use; 0: nothing says what it is */
    float slip_rad_s;  /* by the observer's Rr */
    float Rr_extra_pu; /* what the start found, beyond r */
} heating_in_t;

/* False for a number that is not finite or of the wrong sign, a rated current of no more than i_d,
 * or a time constant that the step is too long for; nothing but the step is looked at with
 * winding_pu 0: then a step takes what the start found of Rr into the slip, and no more. */
CHECKED bool heating_init(heating_config_t *cfg, const heating_params_t *params, float step_s);

static inline bool heating_on(const heating_config_t *cfg)
{
    return cfg->fade > 0.0f;
}

/* What Rs in use has to rise by, ohm. */
float heating_step(const heating_config_t *cfg, heating_state_t *st, const heating_in_t *in);

#endif
