/* Output of any estimator, valid at the end of a period. Stationary frame, electrical. */
#ifndef ESTIMATE_H
#define ESTIMATE_H

#include "frames.h"

/* Below this share of the flux reference the estimated flux angle is not usable. */
#define ESTIMATE_LAMBDA_MIN_PU 0.05f

typedef struct {
    ab_t lambda_r_hat_Wb;   /* rotor flux */
    float lambda_Wb;        /* its length */
    ab_t i_residual_A;      /* estimated minus measured current; 0 where an estimator has none */
    ab_t flux_correction_V; /* what the correction adds to the flux row (l2 e1 of eq. (3)) */
    float omega_e_rad_s;    /* rotor speed */
    float omega_s_rad_s;    /* speed of the flux: stator frequency */
} estimate_t;

#endif
