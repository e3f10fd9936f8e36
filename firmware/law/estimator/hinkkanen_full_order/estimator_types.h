/* Hinkkanen's speed-adaptive full-order observer: gain with one parameter, rotated adaptation where
 * the motor generates at low frequency. States are stator and rotor flux of the inverse-Gamma
 * model.
 *
 *   i' = (psi_s - psi_R)/sigma Ls,  e = i - i',  R_R = (M/Lr)^2 Rr,  psi_R = (M/Lr) lambda
 *   psi_s' = u - Rs i' + l_s e                            l_s = k ( 1 + j sgn w)
 *   psi_R' = R_R i' - (1/Tr - j w) psi_R + l_r e          l_r = k (-1 + j sgn w)
 *   k = k0 min(1, |w|/w_k)
 *   z = -Im(conj(psi_R) e exp(-j phi)),  x' = Ki z,  w = x + Kp z
 *   phi = phi0 sgn(w_s) (1 - |w_s|/w_phi) where w_s and the slip have opposite signs and
 *   |w_s| < w_phi, else 0
 *
 * Gain and angle: the authors' numbers for their 2.2 kW machine (L'_s 20.9 mH, 50 Hz), the gain per
 * inductance: k0 10 ohm is 478/s times sigma Ls; w_k 1 p.u. = 314 rad/s; phi0 80 degrees; w_phi .4
 * p.u. = 126 rad/s. They are from memory, not copied from the page: what they are for, stability in
 * all four quadrants, is tested (test_rivals_classic.py).
 *
 * Adaptation: (w - w_hat) reaches z over psi_R^2/(sigma Ls (s + b)) at high frequency, b = a11 + 2
 * k/(sigma Ls). Ki = b Kp cancels that pole, Kp = a sigma Ls/psi_R^2 leaves the bandwidth a = 2 pi
 * 40 Hz. The paper's constant pair, a = 388/s and Ki/Kp = 1000/s, fits b at speed. At standstill,
 * where b = a11 = 178/s, it swings with our faster speed loop and holds 153 of 245 points of `zh
 * atlas
 * --map i`; this law holds 245. Discretised with second order in A, the correction beside it.
 *
 * M. Hinkkanen, "Analysis and design of full-order flux observers for sensorless induction motors",
 * IEEE Trans. Ind. Electron. 51(5), 2004; phi: M. Hinkkanen and J. Luomi, "Stabilization of
 * regenerating-mode operation in sensorless induction motor drives by full-order flux observer
 * design", IEEE Trans. Ind. Electron. 51(6), 2004.
 */
#ifndef ESTIMATOR_TYPES_H
#define ESTIMATOR_TYPES_H

#include "estimate.h"

typedef struct {
    float period_s;
    float Rs_ohm;
    float Rr_gamma_ohm; /* R_R */
    float tau_per_s;
    float a11_per_s;
    float inv_sigma_Ls_per_H;
    float sigma_Ls_H;
    float kr;
    float inv_kr;
    float k0_ohm;
    float kp_rad_per_s_Wb_A;
    float omega_max_rad_s;
    float psi_min_Wb;
    float psi_max_Wb;
} estimator_config_t;

/* Stator and rotor flux, or their rates. */
typedef struct {
    ab_t s;
    ab_t r;
} fluxes_t;

typedef struct {
    estimate_t estimate;
    fluxes_t psi_Wb;
    float x_rad_s;
    float phi_rad;
} estimator_state_t;

static inline float estimator_sum(const estimator_state_t *st)
{
    const estimate_t *e = &st->estimate;
    return ab_sum(st->psi_Wb.s) + ab_sum(st->psi_Wb.r) + ab_sum(e->i_residual_A) + st->x_rad_s +
           st->phi_rad + e->omega_e_rad_s + e->omega_s_rad_s;
}

#endif
