/* The contract of an estimator: everything that turns stator voltage and current into rotor flux
 * and speed. Stationary frame, electrical speeds.
 *
 * The folder chosen by ZH_ESTIMATOR supplies
 *   estimator_types.h      estimator_config_t; estimator_state_t, whose member `estimate` is the
 *                          estimate in force; estimator_sum
 *   estimator_signals.def  what it has to show beside the estimate, possibly nothing: lines as in
 *                          firmware/unit/signal_list.def, of the state ESTIMATOR_STATE
 *   CMakeLists.txt         zh_firmware(law_estimator_<folder> SOURCES ... USES law_base parameters)
 * and the functions below. The image, the SIL and `zh replay` call the same ones.
 *
 * A zeroed state is a motor at rest without flux; the drive zeroes it while the gates are off. One
 * of step, hold or off runs in every period with the gates on; seed may come before any of them.
 */
#ifndef ESTIMATOR_H
#define ESTIMATOR_H

#include <stdbool.h>

#include "estimate.h"
#include "estimator_types.h"
#include "gain_table.h"
#include "motor.h"
#include "params.h"

/* One period: input of the estimator. */
typedef struct {
    ab_t u_s_V; /* mean over the interval that just ended, less what an Rs other than the
                   parameter's takes: the estimator keeps the resistance it was designed with */
    ab_t i_s_A; /* sampled now */
    float expected_step_rad_s; /* how much the torque current should have changed the speed since
                                  the last period, as far as inertia and load are known; else 0 */
    bool frame_imposed;        /* the stator frequency is known: a mode turns the frame */
    float omega_frame_rad_s;
    float dwell; /* 0: not; up to 1: the stator frequency stays at zero, and speed or flux are
                    modulated (dwell.h): what of the residual does not move is Rs, not speed */
    float slip_extra_rad_s; /* that the rotor slips more than the parameter's Rr says */
    float tau_extra_per_s;  /* Rr/Lr of the M that was found, less the parameters' */
} estimator_in_t;

/* A known state to start from. */
typedef struct {
    ab_t i_s_A;
    ab_t lambda_r_Wb;
    float omega_e_rad_s;
} estimator_seed_t;

/* Takes what it needs from the parameters. table: the motor's, NULL if it has none. False: a value,
 * the motor or the table is refused; then *cfg must not be used. */
CHECKED COLD bool estimator_init(estimator_config_t *cfg, const params_t *params,
                                 const motor_model_t *motor, const gain_table_t *table);

/* The gain table in use, for the running check of the background; NULL: none. */
COLD const gain_table_t *estimator_table(const estimator_config_t *cfg);

/* Estimates. */
void estimator_step(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in);

/* Another module imposes the speed in this period; the flux is estimated with it. */
void estimator_hold(const estimator_config_t *cfg, estimator_state_t *st, const estimator_in_t *in,
                    float omega_e_rad_s);

/* No estimation: no flux, and the speed of the mode. */
COLD void estimator_off(estimator_state_t *st, ab_t i_s_A, float omega_e_rad_s);

COLD void estimator_seed(const estimator_config_t *cfg, estimator_state_t *st,
                         const estimator_seed_t *seed);

/* In estimator_types.h, inline: a sum over all that is remembered, NaN if one of them is (law's
 * state_sum.h).
 *
 * static inline float estimator_sum(const estimator_state_t *st);
 */

#endif
