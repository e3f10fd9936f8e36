/* An estimator whose functions are somebody else's on this host: a class in Python.
 *
 * Whoever loads the SIL library registers them first (python_bridge.h). Host only: no image has it.
 */
#ifndef ESTIMATOR_TYPES_H
#define ESTIMATOR_TYPES_H

#include <stdint.h>

#include "estimate.h"

typedef struct {
    uint32_t numbers; /* names the parameters on the other side */
} estimator_config_t;

typedef struct {
    estimate_t estimate;
    uint32_t object; /* on the other side; 0: none yet */
} estimator_state_t;

static inline float estimator_sum(const estimator_state_t *st)
{
    return ab_sum(st->estimate.lambda_r_hat_Wb) + st->estimate.omega_e_rad_s +
           st->estimate.omega_s_rad_s;
}

#endif
