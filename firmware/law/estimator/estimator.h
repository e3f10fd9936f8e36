/* The contract of an estimator: everything that turns stator voltage and current into rotor flux
 * and speed. Stationary frame, electrical speeds.
 *
 * The folder chosen by ZH_ESTIMATOR supplies estimator_types.h (estimator_config_t and
 * estimator_state_t, whose member `estimate` is the estimate in force) and the functions below. The
 * image, the SIL and `zh replay` call the same ones.
 *
 * A zeroed state is a motor at rest without flux. One of step, hold or off runs in every period
 * with the gates on; seed may come before any of them.
 */
#ifndef ESTIMATOR_H
#define ESTIMATOR_H

#include <stdbool.h>

#include "estimate.h"
#include "estimator_types.h"
#include "motor.h"

/* One period: what the estimator is given. */
typedef struct {
    ab_t u_s_V;         /* mean over the interval that just ended, less what an Rs other than the
                           parameter's takes: the estimator keeps the resistance it was designed with */
    ab_t i_s_A;         /* sampled now */
    float prior_rad_s;  /* best guess of the speed beside the estimate */
    bool frame_imposed; /* the stator frequency is known: a mode turns the frame */
    float omega_frame_rad_s;
} estimator_in_t;

/* Start from a known state. */
typedef struct {
    ab_t i_s_A;
    ab_t lambda_r_Wb;
    float omega_e_rad_s;
} estimator_seed_t;

/* Estimates. */
void estimator_step(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in);

/* The speed is imposed by somebody else in this period; the flux is estimated with it. */
void estimator_hold(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in,
                    float omega_e_rad_s);

/* Nothing is estimated: no flux, and the speed is what a mode says. */
COLD void estimator_off(estimator_state_t *st, ab_t i_s_A, float omega_e_rad_s);

COLD void estimator_seed(const estimator_config_t *cfg, estimator_state_t *st,
                         const estimator_seed_t *seed);

#endif
