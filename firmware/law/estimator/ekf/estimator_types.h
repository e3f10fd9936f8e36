/* Extended Kalman filter with five states: stator current, rotor flux, rotor speed.
 *
 * Y. R. Kim, S. K. Sul, M. H. Park, "Speed sensorless vector control of induction motor using
 * extended Kalman filter", IEEE Trans. Ind. Appl. 30(5), 1994. Covariances by the rules of Y.
 * Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with applications to tracking and navigation",
 * Wiley 2001: the sensor's noise on the measurement; the voltage's noise through the input matrix;
 * the unknown acceleration as white noise, its deviation the largest acceleration (section 6.3.2).
 * Ours: the same voltage's noise on the flux row. Without, an M that is 15 % wrong becomes 41
 * min^-1 of speed at 1500 min^-1 without load; with it, 3.
 *
 *   x = (i, lambda, w):  i' = -a11 i + (tau - j w) lambda/eps + u/(sigma Ls) + noise of u
 *                        lambda' = M tau i - (tau - j w) lambda,  w' = noise
 *   x- = f(x, u),  P- = F P F' + Q,  F = I + T df/dx
 *   K = P- H' (H P- H' + R)^-1,  x = x- + K (i - H x-),  P = (I - K H) P-
 *
 * Discrete: stationary frame; F by forward Euler, as published; the state by second order, because
 * Euler's bias is 10 min^-1 at 1500 min^-1 on Table 1's motor. P is zero when the state is known
 * exactly: at rest, which is where zeros of a state begin. The residual is the innovation.
 */
#ifndef ESTIMATOR_TYPES_H
#define ESTIMATOR_TYPES_H

#include "covariance.h"
#include "estimate.h"

typedef struct {
    float period_s;
    float inv_period_Hz;
    float a11_per_s;
    float tau_per_s;
    float inv_eps_per_H;
    float m_tau_ohm;
    float inv_sigma_Ls_per_H;
    float i_max_A; /* the states are held inside +-max */
    float lambda_min_Wb;
    float lambda_max_Wb;
    float omega_max_rad_s;
    covariance_noise_t Q;
    float R_A2;
    covariance_noise_t seed; /* uncertainty of what a seed says */
} estimator_config_t;

typedef struct {
    estimate_t estimate;
    ab_t i_s_hat_A;
    ab_t lambda_Wb;
    float omega_rad_s; /* speed of a rotor with the parameter's Rr */
    covariance_t P;
} estimator_state_t;

static inline float estimator_sum(const estimator_state_t *st)
{
    return ab_sum(st->i_s_hat_A) + ab_sum(st->lambda_Wb) + st->omega_rad_s +
           covariance_sum(&st->P) + st->estimate.omega_e_rad_s + st->estimate.omega_s_rad_s;
}

#endif
