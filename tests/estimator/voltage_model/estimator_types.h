/* Voltage model of the rotor flux, held by the current model near standstill.
 *
 *   psi_s' = u - Rs i + wc (kr lambda_i + sigma Ls i - psi_s),  lambda = (psi_s - sigma Ls i)/kr
 *   lambda_i' = M/Tr i - (1/Tr - j w) lambda_i,  w = ws - M/Tr Im(conj(lambda) i)/|lambda|^2
 *
 * ws is the flux's own frequency, low-passed. No table, no current error. It shows what an
 * estimator has to bring along (firmware/law/estimator/estimator.h); it is no rival.
 */
#ifndef ESTIMATOR_TYPES_H
#define ESTIMATOR_TYPES_H

#include "estimate.h"

typedef struct {
    float period_s;
    float Rs_ohm;
    float sigma_Ls_H;
    float kr;
    float inv_kr;
    float m_tau_ohm;
    float tau_per_s;
    float omega_max_rad_s;
    float lambda_min_Wb;
    float lambda_max_Wb;
} estimator_config_t;

typedef struct {
    estimate_t estimate;
    ab_t psi_s_Wb;
    ab_t slow_Wb; /* lambda_i */
    ab_t i_before_A;
} estimator_state_t;

static inline float estimator_sum(const estimator_state_t *st)
{
    return ab_sum(st->psi_s_Wb) + ab_sum(st->slow_Wb) + ab_sum(st->i_before_A) +
           st->estimate.omega_e_rad_s + st->estimate.omega_s_rad_s;
}

#endif
