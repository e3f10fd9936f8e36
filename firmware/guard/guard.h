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
#include "slots.h"
#include "speed_guard.h"

typedef struct {
    monitor_config_t monitor;
    plausibility_config_t plausibility;
    speed_guard_config_t speed;
    float i_q_max2_A2; /* torque current and current vector that there are at most */
    float i_max2_A2;
    float kr; /* M/Lr */
} guard_config_t;

typedef struct {
    monitor_state_t monitor;
    plausibility_state_t plausibility;
    speed_guard_state_t speed;
} guard_state_t;

/* Of every period. */
typedef monitor_in_t guard_in_t;

/* Of a period in which something is looked at for the second time. */
typedef struct {
    const measured_t *meas;
    const estimate_t *estimate;
    uint32_t slot;
    bool controlled; /* RUN with an estimate, or I-f in its place: currents follow a reference */
    bool sensed;     /* u_s_V comes from sensors and can be compared with u_duty_V */
    bool oriented;   /* the estimate and the request are those of vector control */
    ab_t u_duty_V;   /* of the interval that ended, by the duties */
    ab_t u_s_V;      /* likewise, as the estimator got it */
    ab_t axis;       /* of the request */
    dq_t i_ref_A;
    float omega_ref_rad_s;
    float lambda_ref_Wb;
    float Rs_ohm;
} guard_look_t;

static inline bool guard_look_is_due(uint32_t slot)
{
    return (slot == SLOT_GUARD_VOLTAGE) || (slot == SLOT_GUARD_PHASES) ||
           (slot == SLOT_GUARD_ESTIMATE) || (slot == SLOT_GUARD_SPEED);
}

/* False for what one of the parts refuses. */
CHECKED bool guard_init(guard_config_t *cfg, const monitor_config_t *monitor,
                        const plausibility_params_t *plausibility, float schedule_s);

/* Fault bits of this period: limits, and numbers that are none. */
static inline uint32_t guard_step(const guard_config_t *cfg, guard_state_t *st,
                                  const guard_in_t *in)
{
    return monitor_step(&cfg->monitor, &st->monitor, in);
}

/* In every period of direct current: FAULT_CURRENT_SENSOR when two current sensors are exchanged.
 */
COLD uint32_t guard_standing(const guard_config_t *cfg, guard_state_t *st, ab_t i_s_A,
                             ab_t i_residual_A);

/* Fault bits of the slow judgements. */
COLD uint32_t guard_look(const guard_config_t *cfg, guard_state_t *st, const guard_look_t *in);

/* Gates off: the limits go on counting, what needs a running motor starts again. */
guard_state_t guard_at_rest(const guard_state_t *st);

#endif
