/* my_observer: voltage model of the rotor flux, whose length a feedback holds at its reference.
 *
 *   kr lambda' = u - Rs i - sigma Ls i' + kr g (M id* - |lambda|) lambda/|lambda|
 *   w = ws - M/Tr Im(conj(lambda) i)/|lambda|^2,  ws low-passed
 */
#ifndef ESTIMATOR_TYPES_H
#define ESTIMATOR_TYPES_H

#include "estimate.h"
#include "motor.h"

typedef struct {
    motor_model_t motor;
    float period_s;
    float lambda_ref_Wb;
    float omega_max_rad_s;
    float filter_s;
    float gain_per_s;
} estimator_config_t;

typedef struct {
    estimate_t estimate;
    ab_t i_before_A;
} estimator_state_t;

/* NaN if one of them is. */
static inline float estimator_sum(const estimator_state_t *st)
{
    return ab_sum(st->i_before_A) + ab_sum(st->estimate.lambda_r_hat_Wb) +
           st->estimate.omega_e_rad_s + st->estimate.omega_s_rad_s;
}

#endif
