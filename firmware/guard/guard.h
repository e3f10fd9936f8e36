/* Protection beside the control law: reads sample, duty, request and estimate; writes fault bits
 * and nothing else.
 *
 * Limits are checked in every period of every state. Checks for which one sample proves nothing run
 * once per 16 periods and are debounced.
 */
#ifndef GUARD_H
#define GUARD_H

#include "current_fit.h"
#include "current_jump.h"
#include "estimate.h"
#include "frozen_link.h"
#include "link_drop.h"
#include "liveness.h"
#include "mains_check.h"
#include "monitor.h"
#include "plausibility.h"
#include "slots.h"
#include "speed_guard.h"

typedef struct {
    monitor_config_t monitor;
    plausibility_config_t plausibility;
    liveness_config_t liveness;
    current_fit_config_t current_fit;
    current_jump_config_t current_jump;
    mains_check_config_t mains;
    frozen_link_config_t frozen_link;
    speed_guard_config_t speed;
    float i_q_max2_A2; /* largest torque current and current vector */
    float i_max2_A2;
    float kr; /* M/Lr */
} guard_config_t;

typedef struct {
    monitor_state_t monitor;
    plausibility_state_t plausibility;
    liveness_state_t liveness;
    current_fit_state_t current_fit;
    current_jump_state_t current_jump;
    mains_check_state_t mains;
    frozen_link_state_t frozen_link;
    link_drop_state_t link_drop;
    speed_guard_state_t speed;
} guard_state_t;

/* Input of every period. */
typedef monitor_in_t guard_in_t;

/* Input of the sensor checks: no estimate, no mode. */
typedef struct {
    const measured_t *meas;
    ab_t u_V;          /* of the interval that ended, by the duties */
    bool window_ended; /* of current_fit.h: SLOT_GUARD_CURRENT */
    bool motor_known;  /* false while its data are identified */
} guard_sensors_t;

/* Input of a period with a slow check. */
typedef struct {
    const measured_t *meas;
    const estimate_t *estimate;
    uint32_t slot;
    bool controlled; /* RUN with an estimate, or I-f in its place: currents follow a reference */
    bool brake_on;   /* the brake resistor of the dc link */
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

#define GUARD_LOOK_SLOTS                                                                           \
    ((1u << SLOT_GUARD_VOLTAGE) | (1u << SLOT_GUARD_PHASES) | (1u << SLOT_GUARD_ESTIMATE))
static inline bool guard_look_is_due(uint32_t slot)
{
    return slot_is_among(slot, GUARD_LOOK_SLOTS);
}

/* Parameters of the sensor checks. */
typedef struct {
    float period_s;
    float Rs_ohm;
    float sigma_Ls_H;
    float flux_Wb; /* nominal, as the stator sees it */
    float M_H;     /* M^2/Lr: flux per current */
    float A_per_count;
} guard_sensor_params_t;

/* False if one of the parts refuses. */
CHECKED bool guard_init(guard_config_t *cfg, const monitor_config_t *monitor,
                        const plausibility_params_t *plausibility,
                        const guard_sensor_params_t *sensors);

/* Fault bits of this period: limits, and values that are not finite. */
static inline uint32_t guard_step(const guard_config_t *cfg, guard_state_t *st,
                                  const guard_in_t *in)
{
    return monitor_step(&cfg->monitor, &st->monitor, in);
}

/* Frozen current words: a fault, or none. */
HOT uint32_t guard_repeated(const guard_config_t *cfg, guard_state_t *st, const measured_t *meas,
                            ab_t u_V);

/* Current words that jumped: a fault, unless the sum names the sensor or the motor is unknown. */
COLD uint32_t guard_jumped(uint32_t flags, bool motor_known);

/* A window of voltage and current has ended. */
HOT uint32_t guard_look_at_current(const guard_config_t *cfg, guard_state_t *st,
                                   const measured_t *meas, bool motor_known);

/* In every period with the gates off: measures the noise of the current words. */
static inline void guard_look_at_noise(const guard_config_t *cfg, guard_state_t *st,
                                       const measured_t *meas)
{
    liveness_look(&cfg->liveness, &st->liveness.noise, meas->i_A);
}

/* In every period with the gates on, whatever the mode. */
static inline uint32_t guard_sensors(const guard_config_t *cfg, guard_state_t *st,
                                     const guard_sensors_t *in)
{
    const ab_t i_s_A = ab_by_parts(in->meas->i_s_A);
    uint32_t faults = 0u;
    if (liveness_repeats(&st->liveness, &in->meas->i_A)) {
        faults = guard_repeated(cfg, st, in->meas, in->u_V);
    }
    current_fit_add(&st->current_fit, in->u_V, i_s_A);
    if (current_jump_step(&cfg->current_jump, &st->current_jump, i_s_A, in->u_V)) {
        faults |= guard_jumped(in->meas->flags, in->motor_known);
    }
    if (in->window_ended) {
        faults |= guard_look_at_current(cfg, st, in->meas, in->motor_known);
    }
    return faults;
}

/* In every period of direct current: FAULT_CURRENT_SENSOR when two current sensors are exchanged.
 */
uint32_t guard_standing(const guard_config_t *cfg, guard_state_t *st, ab_t i_s_A,
                        ab_t i_residual_A);

/* Fault bits of the slow checks, with the gates on, where they are due. */
uint32_t guard_look(const guard_config_t *cfg, guard_state_t *st, const guard_look_t *in);

/* Reset when the gates go off. The limits go on counting, and the measured noise stays. Checks that
 * need a running motor start again. */
typedef struct {
    monitor_state_t monitor;
    liveness_noise_t noise;
} guard_kept_t;

static inline guard_kept_t guard_kept(const guard_state_t *st)
{
    return (guard_kept_t){.monitor = st->monitor, .noise = st->liveness.noise};
}

/* Into a state that was cleared. */
static inline void guard_restore(guard_state_t *st, const guard_kept_t *kept)
{
    st->monitor = kept->monitor;
    st->liveness.noise = kept->noise;
}

#endif
