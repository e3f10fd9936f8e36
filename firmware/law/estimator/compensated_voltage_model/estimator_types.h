/* Statically compensated voltage model of Harnefors.
 *
 * L. Harnefors, "Design and analysis of general rotor-flux-oriented vector control systems", IEEE
 * Trans. Ind. Electron. 48(2), 2001; L. Harnefors, M. Jansson, R. Ottersten, K. Pietilainen,
 * "Unified sensorless vector control of synchronous and induction motors", IEEE Trans. Ind.
 * Electron. 50(1), 2003; as surveyed by L. Harnefors, M. Hinkkanen, "Stabilization methods for
 * sensorless induction motor drives", IEEE J. Emerg. Sel. Topics Power Electron. 2(2), 2014.
 *
 * Inverse-Gamma circuit: psi = M/Lr lambda_r, R_R = (M/Lr)^2 Rr. The voltage model's integrator
 * becomes a low-pass of bandwidth lambda |w_1|; its gain and phase at w_1 are taken out again:
 *
 *   v = u - Rs i - sigma Ls i'
 *   psi' = (1 - j lambda sgn w_1) v - lambda |w_1| psi
 *   w' = alpha_o (w_s - R_R i_q/|psi| - w),  w_1 = w + R_R i_q/|psi|,  w_s: speed of psi
 *
 * In steady state v = j w_1 psi, and the flux is exact. An error decays with lambda |w_1|: an
 * offset does not add up, and at w_1 = 0 nothing decays. The rotor's equation serves for the slip
 * alone.
 *
 * Discrete: stationary frame; the voltage of the ended interval is integrated exactly and Rs i by
 * the trapezoid; the decay is forward Euler of the flux at the middle of the interval. States: psi
 * and w. With the speed imposed (hold): the current model, psi' = R_R i - (a - j w) psi, a = Rr/Lr.
 */
#ifndef ESTIMATOR_TYPES_H
#define ESTIMATOR_TYPES_H

#include "estimate.h"

typedef struct {
    float period_s;
    float inv_period_Hz;
    float Rs_ohm;
    float sigma_Ls_H;
    float kr; /* M/Lr */
    float inv_kr;
    float R_R_ohm;
    float tau_per_s;   /* a */
    float speed_share; /* of the low-pass of the speed, per period */
    float omega_max_rad_s;
    float psi_min_Wb;
    float psi_max_Wb;
} estimator_config_t;

typedef struct {
    estimate_t estimate;
    ab_t psi_Wb;
    ab_t i_before_A;
    float omega_rad_s;   /* speed of a rotor with the parameter's Rr */
    float omega_1_rad_s; /* of the flux */
} estimator_state_t;

static inline float estimator_sum(const estimator_state_t *st)
{
    return ab_sum(st->psi_Wb) + ab_sum(st->i_before_A) + st->omega_rad_s + st->omega_1_rad_s +
           st->estimate.omega_e_rad_s + st->estimate.omega_s_rad_s;
}

#endif
