/* Schauder's rotor-flux MRAS: the current model is adapted until its flux agrees with that of the
 * voltage model.
 *
 *   reference   (M/Lr) F = Q(u - Rs i) - sigma Ls H(i)          voltage model, without speed
 *   adjustable  lambda' = M/Tr i - (1/Tr - j w) lambda,  G = H(lambda)
 *   adaptation  z = Im(conj(G) F),  x' = K1 z,  w = x + K2 z
 *
 * Neither model can be integrated from an unknown start or with an offset. So both fluxes pass the
 * paper's high-pass H = s/(s + 1/T); with the integration it becomes Q = 1/(s + 1/T). One state
 * holds it: y' = u - Rs i + sigma Ls i/T - y/T, (M/Lr) F = y - sigma Ls i. With a slip w_sl and
 * constant flux the paper finds
 *
 *   z/(w - w_hat) = |lambda|^2 (s + 1/Tr) / ((s + 1/Tr)^2 + w_sl^2)
 *
 * Tuning. Without slip that makes s^2 + (1/Tr + K2 |lambda|^2) s + K1 |lambda|^2. Two poles at p,
 * with nominal flux: K2 = 2 p/|lambda|^2, K1 = p^2/|lambda|^2. With slip the loop stays damped. The
 * paper makes the gains as large as noise permits.
 *
 * Orientation: F + (lambda' - G), the reference model with the slow part that the high-pass takes
 * from the adjustable one. By lambda' alone a wrong M would be a wrong flux at every speed.
 *
 * C. Schauder, "Adaptive speed identification for vector control of induction motors without
 * rotational transducers", IEEE Trans. Ind. Appl. 28(5), 1992.
 */
#ifndef ESTIMATOR_TYPES_H
#define ESTIMATOR_TYPES_H

#include "estimate.h"

typedef struct {
    float period_s;
    float Rs_ohm;
    float sigma_Ls_H;
    float inv_kr;
    float m_tau_ohm;
    float decay;              /* of the adjustable model over a period: exp(-period/Tr) */
    float high_pass_gain;     /* period/T */
    float kp_rad_per_s_Wb2;   /* K2 */
    float ki_T_rad_per_s_Wb2; /* K1 times the period */
    float omega_max_rad_s;
    float lambda_min_Wb;
    float lambda_max_Wb;
} estimator_config_t;

typedef struct {
    estimate_t estimate;
    ab_t y_Wb;          /* reference model */
    ab_t adjustable_Wb; /* lambda' of the adjustable model */
    ab_t slow_Wb;       /* what the high-pass takes from it */
    ab_t i_before_A;
    float x_rad_s; /* integrator of the adaptation */
} estimator_state_t;

static inline float estimator_sum(const estimator_state_t *st)
{
    return ab_sum(st->y_Wb) + ab_sum(st->adjustable_Wb) + ab_sum(st->slow_Wb) +
           ab_sum(st->i_before_A) + st->x_rad_s + ab_sum(st->estimate.lambda_r_hat_Wb) +
           st->estimate.omega_e_rad_s + st->estimate.omega_s_rad_s;
}

#endif
