/* Hybrid of voltage and current model with a crossover, as motor-control libraries ship it.
 *
 *   current model, along the estimated flux   l' = (M i_d - l)/Tr,  lambda_i = l lambda/|lambda|
 *   voltage model, held by the other          psi' = u - Rs i + wc d,
 *                                             d = (M/Lr) lambda_i + sigma Ls i - psi
 *   rotor flux                                lambda = (Lr/M)(psi - sigma Ls i)
 *   speed                                     w = w_s - M/Tr Im(conj(lambda) i)/|lambda|^2,
 * filtered
 *
 * w_s is how fast lambda turned. Below wc the length of the flux is the current model's, which
 * needs no speed; above wc the flux is the voltage model's.
 *
 * Tuning: wc = 2 pi 10 Hz, the middle of the 8 to 12 Hz in use. d is along the flux, so its angle e
 * obeys e'' + wc e' + w_s^2 e = 0: stable at every frequency. The integral action that some
 * libraries add (Kp = w1 + w2, Ki = w1 w2, Lascu, Boldea and Blaabjerg, 2000) is left out: with
 * poles at 8 and 12 Hz it makes the angle unstable below 10 Hz (test_rivals_classic.py).
 *
 * P. Jansen and R. Lorenz, "A physically insightful approach to the design and accuracy assessment
 * of flux observers for field oriented induction machine drives", IEEE Trans. Ind. Appl. 30(1),
 * 1994; C. Lascu, I. Boldea, F. Blaabjerg, "A modified direct torque control for induction motor
 * sensorless drive", IEEE Trans. Ind. Appl. 36(1), 2000.
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
    float corner_per_s; /* wc */
    float speed_share;  /* of the speed filter, per period */
    float omega_max_rad_s;
    float lambda_min_Wb;
    float lambda_max_Wb;
} estimator_config_t;

typedef struct {
    estimate_t estimate;
    ab_t psi_s_Wb;
    float slow_Wb; /* l */
    ab_t i_before_A;
    float omega_model_rad_s; /* speed of a rotor with the parameter's Rr */
} estimator_state_t;

static inline float estimator_sum(const estimator_state_t *st)
{
    return ab_sum(st->psi_s_Wb) + ab_sum(st->i_before_A) + st->slow_Wb + st->omega_model_rad_s +
           ab_sum(st->estimate.lambda_r_hat_Wb) + st->estimate.omega_e_rad_s +
           st->estimate.omega_s_rad_s;
}

#endif
