/* Protection beside the control law: reads sample, duty, request and estimate; writes fault bits
 * and nothing else.
 *
 * Limits are judged in every period of every state. What needs a second look, because one sample
 * proves nothing, is judged once per 16 periods and debounced.
 */
#ifndef GUARD_H
#define GUARD_H

#include "current_fit.h"
#include "estimate.h"
#include "liveness.h"
#include "monitor.h"
#include "plausibility.h"
#include "slots.h"
#include "speed_guard.h"

typedef struct {
    monitor_config_t monitor;
    plausibility_config_t plausibility;
    liveness_config_t liveness;
    current_fit_config_t current_fit;
    speed_guard_config_t speed;
    float i_q_max2_A2; /* torque current and current vector that there are at most */
    float i_max2_A2;
    float kr; /* M/Lr */
} guard_config_t;

typedef struct {
    monitor_state_t monitor;
    plausibility_state_t plausibility;
    liveness_state_t liveness;
    current_fit_state_t current_fit;
    speed_guard_state_t speed;
} guard_state_t;

/* Of every period. */
typedef monitor_in_t guard_in_t;

/* What the sensors are judged by: no estimate, no mode. */
typedef struct {
    const measured_t *meas;
    ab_t u_V; /* of the interval that ended, by the duties */
    uint32_t slot;
    bool motor_known; /* not while its data are looked for */
} guard_sensors_t;

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

/* What the sensors' judgement needs to know. */
typedef struct {
    float period_s;
    float Rs_ohm;
    float sigma_Ls_H;
    float flux_Wb; /* nominal, as the stator sees it */
    float M_H;     /* and what a current makes of it: M^2/Lr */
    float A_per_count;
} guard_sensor_params_t;

/* False for what one of the parts refuses. */
CHECKED bool guard_init(guard_config_t *cfg, const monitor_config_t *monitor,
                        const plausibility_params_t *plausibility,
                        const guard_sensor_params_t *sensors);

/* Fault bits of this period: limits, and numbers that are none. */
static inline uint32_t guard_step(const guard_config_t *cfg, guard_state_t *st,
                                  const guard_in_t *in)
{
    return monitor_step(&cfg->monitor, &st->monitor, in);
}

/* In every period with the gates on, whatever the mode: current words that stand still, currents
 * that do not explain the voltage. */
static inline uint32_t guard_sensors(const guard_config_t *cfg, guard_state_t *st,
                                     const guard_sensors_t *in)
{
    const liveness_in_t live = {.i_A = in->meas->i_A,
                                .i_s_A = in->meas->i_s_A,
                                .u_V = in->u_V,
                                .emf_V = st->current_fit.emf_V};
    uint32_t faults = liveness_step(&cfg->liveness, &st->liveness, &live) ? FAULT_ADC_FROZEN : 0u;
    current_fit_add(&st->current_fit, in->u_V, in->meas->i_s_A);
    if ((in->slot == SLOT_GUARD_CURRENT) &&
        !current_fit_holds(&cfg->current_fit, &st->current_fit, in->meas->i_s_A, in->meas->u_dc_V,
                           in->motor_known)) {
        faults |= FAULT_CURRENT_SENSOR;
    }
    return faults;
}

/* In every period of direct current: FAULT_CURRENT_SENSOR when two current sensors are exchanged.
 */
COLD uint32_t guard_standing(const guard_config_t *cfg, guard_state_t *st, ab_t i_s_A,
                             ab_t i_residual_A);

/* Fault bits of the slow judgements. */
COLD uint32_t guard_look(const guard_config_t *cfg, guard_state_t *st, const guard_look_t *in);

/* Gates off, once in 16 periods: the limits go on counting, the words are watched for noise, what
 * needs a running motor starts again. */
guard_state_t guard_at_rest(const guard_config_t *cfg, const guard_state_t *st,
                            const measured_t *meas);

#endif
