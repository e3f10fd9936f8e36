/* Dwelling at zero stator frequency: a small modulation that keeps the speed observable.
 *
 * At constant flux and w_s = 0 every pair (w, lambda = M tau i/(tau - j w)) gives the same current
 * and voltage: nothing tells the speed. Once the flux swings by the angle a about its mean, an
 * error of speed swings with it and the adaptation sees a^2/2 of it. Rs is the easy parameter
 * there: u = Rs i (rs_tracking_dwell).
 *
 * The field stands when the low-passed stator frequency has stayed inside a window about zero while
 * the reference hardly moved: a ramp that crosses zero never gets there. Where the flux is steered
 * the field ought to turn: one that stands there is lost, and the supervisor says so (STILL). A
 * drive that is asked to stand dwells all the same.
 *
 * While the field stands Rs is found. Under load the speed reference also gets A sin(W t) on top, A
 * = k max(|w|, tau), W = 1.67 tau, at first 1.8 times that; where the speed is not controlled, or
 * may not move, the flux swings by k (1 - cos W t) of itself instead. `share` fades all of it in
 * and out, what the estimator makes of it included: neither entry nor exit is a step.
 */
#ifndef DWELL_H
#define DWELL_H

#include <stdbool.h>
#include <stdint.h>

#include "frames.h"
#include "motor.h"

typedef enum {
    DWELL_OFF = 0,
    DWELL_SPEED = 1,
    DWELL_FLUX = 2
} dwell_kind_t;

typedef struct {
    dwell_kind_t kind;
    float amplitude_pu; /* k */
    float window_rad_s; /* begins inside; ends outside twice that */
    float wait_s;       /* inside for so long */
    float filter_s;     /* of frequency and torque current */
    float fade_s;       /* of share, from 0 to 1 */
    float settle_s;     /* of gain */
    float slew_rad_s2;  /* a reference that moves as fast crosses */
    float load_A;       /* torque current that is load; half of it is none */
} dwell_params_t;

typedef struct {
    dwell_kind_t kind;
    float amplitude_pu;
    float window_rad_s;
    float load_A;
    float tau_per_s;
    float settle_gain;
    float omega_rad_s; /* W */
    float turns;       /* of the modulation, per step */
    float filter_gain;
    float share_step;
    float moved_rad_s; /* by the reference, in a step */
    uint32_t wait_steps;
} dwell_config_t;

typedef struct {
    bool standing;         /* the field stands: Rs can be found */
    bool active;           /* under load: something is modulated */
    bool flux;             /* that is what is modulated, not the speed */
    uint32_t inside_steps; /* in a row */
    float omega_s_rad_s;   /* low-passed, less the modulation */
    float i_q_A;           /* low-passed */
    float reference_rad_s; /* as the last step saw it */
    float share;           /* 0 to 1: how much of the modulation is on */
    float gain;            /* of the modulation: falls from DWELL_FIRST to 1 */
    float turns;           /* phase, 0 to 1 */
    float speed_rad_s;     /* on top of the speed reference */
    float reduction_pu;    /* of the flux */
    float rate_pu_per_s;   /* of reduction_pu */
    float swing_rad_s;     /* of the field's frequency, or what makes as much of the voltage */
} dwell_state_t;

typedef struct {
    float omega_s_hat_rad_s;
    float i_q_A;
    float omega_ref_rad_s; /* without the modulation */
    bool steered;          /* the flux is lowered so that the field turns */
    bool speed_free;       /* a torque is asked for, not a speed */
} dwell_in_t;

/* False for an unknown kind, or a number that is not finite and positive; nothing else is looked at
 * with DWELL_OFF. period_s: between two steps. */
CHECKED bool dwell_init(dwell_config_t *cfg, const dwell_params_t *params,
                        const motor_model_t *motor, float period_s);

static inline bool dwell_on(const dwell_config_t *cfg)
{
    return cfg->kind != DWELL_OFF;
}

/* Nothing is modulated, and nothing fades out. */
static inline bool dwell_idle(const dwell_state_t *st)
{
    return !st->active && !(st->share > 0.0f);
}

void dwell_step(const dwell_config_t *cfg, dwell_state_t *st, const dwell_in_t *in);

#endif
