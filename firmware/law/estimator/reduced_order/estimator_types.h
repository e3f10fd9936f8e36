/* Inherently sensorless reduced-order flux observer of Harnefors and Hinkkanen.
 *
 * L. Harnefors, M. Hinkkanen, "Complete stability of reduced-order and full-order observers for
 * sensorless IM drives", IEEE Trans. Ind. Electron. 55(3), 2008; gain of M. Hinkkanen,
 * L. Harnefors, J. Luomi, "Reduced-order flux observers with stator-resistance adaptation for
 * speed-sensorless induction motor drives", IEEE Trans. Power Electron. 25(5), 2010.
 *
 * Inverse-Gamma circuit: psi = M/Lr lambda_r, R_R = (M/Lr)^2 Rr, a = Rr/Lr. Voltage model,
 * corrected along the estimated flux only, d = psi/|psi|:
 *
 *   v = u - Rs i - sigma Ls i',  v_d = v . d,  r_d = R_R i . d - a |psi|
 *   psi' = v + 2 k (r_d - v_d) d,  k = (b/2)/(a - j w),  b = a + 2 zeta |w|
 *   w' = alpha_o (w_s - R_R i_q/|psi| - w),  w_s: speed of psi
 *
 * r_d does not contain the speed: the flux needs it for k only. The error of the flux then decays
 * with s^2 + b s + w_s^2 (test_reduced_order.c measures it): stable at every load and speed but w_s
 * = 0.
 *
 * Discrete: stationary frame; the voltage of the ended interval is integrated exactly and Rs i by
 * the trapezoid; the correction is forward Euler, with d at the middle of the interval. States: psi
 * and w. With the speed imposed (hold): psi' = v + k1 (R_R i - (a - j w) psi - v),
 * k1 = 1 + zeta |w|/(a - j w), the gain of the same family with a measured speed.
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
    float omega_rad_s; /* speed of a rotor with the parameter's Rr */
} estimator_state_t;

static inline float estimator_sum(const estimator_state_t *st)
{
    return ab_sum(st->psi_Wb) + ab_sum(st->i_before_A) + st->omega_rad_s +
           st->estimate.omega_e_rad_s + st->estimate.omega_s_rad_s;
}

#endif
