/* Protection beside the control law: reads sample, duty, request and estimate; writes fault bits
 * and nothing else.
 *
 * Limits are judged in every period of every state. What needs a second look, because one sample
 * proves nothing, is judged once per 16 periods and debounced.
 */
#ifndef GUARD_H
#define GUARD_H

#include "estimate.h"
#include "monitor.h"
#include "plausibility.h"

typedef struct {
    monitor_config_t monitor;
    plausibility_config_t plausibility;
    float i_q_max2_A2; /* torque current and current vector that there are at most */
    float i_max2_A2;
    float kr; /* M/Lr */
} guard_config_t;

typedef struct {
    monitor_state_t monitor;
    plausibility_state_t plausibility;
} guard_state_t;

typedef struct {
    const measured_t *meas;
    const estimate_t *estimate;
    uvw_t duty;
    float state_sum; /* of all that is remembered: a number if all of it is */
    uint32_t slot;   /* of the slow judgements; 0: none of them applies */
    bool standing;   /* direct current: exchanged sensors can be told */
    bool sensed;     /* u_s_V comes from sensors and can be compared with u_duty_V */
    bool oriented;   /* the estimate and the request are those of vector control */
    ab_t u_duty_V;   /* of the interval that ended, by the duties */
    ab_t u_s_V;      /* likewise, as the estimator got it */
    ab_t axis;       /* of the request */
    dq_t i_ref_A;
    float omega_ref_rad_s;
    float lambda_ref_Wb;
    float Rs_ohm;
} guard_in_t;

/* False for what one of the parts refuses. */
CHECKED bool guard_init(guard_config_t *cfg, const monitor_config_t *monitor,
                        const plausibility_params_t *plausibility, float turn_s);

/* Fault bits of this period. */
uint32_t guard_step(const guard_config_t *cfg, guard_state_t *st, const guard_in_t *in);

/* Gates off: the limits go on counting, what needs a running motor starts again. */
guard_state_t guard_at_rest(const guard_state_t *st);

#endif
