/* Hasegawa's estimator: full-order observer with gain table, and eps1-modified speed adaptation. */
#ifndef ESTIMATOR_TYPES_H
#define ESTIMATOR_TYPES_H

#include "estimate.h"
#include "frames.h"
#include "gain_table.h"
#include "observer.h"
#include "speed_adaptation.h"

typedef struct {
    observer_config_t observer;
    speed_adaptation_config_t adaptation;
    const gain_table_t *table; /* NULL: L = 0 */
    float table_last;          /* number of its last entry */
    float lambda_min_Wb;       /* flux below which its frequency is not measured by itself */
    float table_end_rad_s;     /* from here on L grows with the speed; FLT_MAX: it holds */
    float residual_slow_gain;  /* of the low-pass that finds it, per period */
} estimator_config_t;

typedef struct {
    estimate_t estimate;
    observer_state_t observer;
    speed_adaptation_state_t adaptation;
    observer_gain_t gain; /* of the last step */
    ab_t residual_slow_A; /* of e1, while dwelling */
} estimator_state_t;

static inline float estimator_sum(const estimator_state_t *st)
{
    const observer_state_t *o = &st->observer;
    return ab_sum(o->i_s_hat_A) + ab_sum(o->lambda_r_hat_Wb) + ab_sum(o->e1_A) +
           ab_sum(st->residual_slow_A) + ab_sum(st->adaptation.phi) + st->adaptation.x_rad_s +
           st->estimate.omega_e_rad_s + st->estimate.omega_s_rad_s;
}

#endif
