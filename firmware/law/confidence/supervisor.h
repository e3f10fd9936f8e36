/* Supervisor: is the field angle still valid, and how large may the speed error be?
 *
 * A second rotor flux v comes from the stator equation alone, which needs no speed. The corner w_c
 * ties it to the estimate:
 *
 *   s' = (Lr/M)(u - Rs i) + w_c d,  v = s - eps i,  d = lambda_hat - v
 *
 * Above w_c, d is the estimate's flux error, apart from the uncertainty of Rs and u. With dV =
 * (Lr/M)(dRs |i| + dU) that is dV/sqrt(w_s^2 + w_c^2) on d, and dV/|w_s| on the true error.
 * Stationary frame. Thresholds and reasons: README.md, "The supervisor".
 */
#ifndef SUPERVISOR_H
#define SUPERVISOR_H

#include <stdbool.h>
#include <stdint.h>

#include "frames.h"
#include "motor.h"
#include "slots.h"

/* Under little torque a field may stand so many times as long. */
#define SUPERVISOR_STILL_LIGHT 5u

typedef enum {
    SUPERVISOR_CLOSED = 0,   /* oriented, as far as anyone can know */
    SUPERVISOR_DEGRADED = 1, /* may be lost, or could be lost without a sign */
    SUPERVISOR_IMPRESSED = 2 /* lost: I-f operation is requested */
} supervisor_confidence_t;

/* Reasons, as append-only bits of the fault log. */
#define SUPERVISOR_UNSURE   (1u << 0) /* bound of the flux error beyond 25 degrees: the wedge */
#define SUPERVISOR_RESIDUAL (1u << 1) /* d beyond what the uncertainty explains */
#define SUPERVISOR_FLUX     (1u << 2) /* more flux than any current here makes */
#define SUPERVISOR_LOST     (1u << 3) /* far beyond, or RESIDUAL, FLUX or STILL for too long */
#define SUPERVISOR_STILL    (1u << 4) /* a field at standstill under torque, although steered */

typedef struct {
    float corner_rad_s;      /* w_c */
    float Rs_uncertainty_pu; /* of Rs: measurement error and heating since */
    float Rr_uncertainty_pu; /* of Rr: heating of the rotor */
    float i_uncertainty_pu;  /* gain errors of the current sensors: ripple of the speed */
    float u_uncertainty_V;   /* voltage sensors, or what dead-time compensation leaves */
    float residual_pu;       /* |d| over flux, beyond the uncertainty: RESIDUAL */
    float lost_pu;           /* likewise, LOST at once; >= residual_pu */
    float confirm_s;         /* RESIDUAL or FLUX for this long: LOST */
    float return_s;          /* all quiet for this long: CLOSED again */
    float still_rad_s;       /* the flux is steered to twice this of |w_s|; 0: it is not */
    float still_A;           /* torque current from which it counts in full */
    float still_s;           /* STILL for this long: LOST */
    float lambda_nominal_Wb;
    float omega_max_rad_s; /* bound that is reported when there is none */
} supervisor_params_t;

typedef struct {
    supervisor_params_t p;
    float kr_inv; /* Lr/M */
    float kT_s;   /* T Lr/M */
    float share;  /* T w_c */
    float eps_H;
    float tau_per_s;
    float m_tau_ohm;
    float corner2_rad2_s2;
    float lambda_low_Wb;
    float lambda_high_Wb;
    float omega_s_gain;  /* per schedule */
    float standing_gain; /* likewise */
    uint32_t confirm_schedules;
    uint32_t return_schedules;
    uint32_t still_units;
} supervisor_config_t;

/* Intermediate results between the parts of a judgement. */
typedef struct {
    float residual_pu;
    float lambda_Wb;
    float i_s_A;
    float excess_pu;
    bool flux_high;
    bool swings; /* as it should while it dwells at zero */
    bool still;
    bool light; /* with little torque */
} supervisor_findings_t;

typedef struct {
    ab_t s_Wb;
    ab_t emf_sum_V;            /* of the periods since s was tied to the estimate */
    ab_t d_Wb;                 /* as it was then */
    float omega_s_rad_s;       /* low-passed */
    float standing_pu;         /* how much of the time, under torque, the field stands or the flux
                                  may be off by .7 of itself; mean of .3 s; once the speed is
                                  unknown it falls as one of 3 s */
    float flux_error_bound_pu; /* over the flux: the sine of the angle error */
    float omega_bound_rad_s;   /* bound of |omega_e_hat - omega_e|, as far as known */
    float torque_Wb_A;         /* of the estimate, mean of .3 s */
    supervisor_findings_t found;
    bool started;               /* s is tied to the estimate */
    bool judged;                /* a judgement has begun */
    bool surges;                /* near zero frequency the torque is larger than its mean */
    uint32_t suspect_schedules; /* successive ones with RESIDUAL or FLUX */
    uint32_t quiet_schedules;
    uint32_t still_units; /* of the time with STILL, less that without */
    uint32_t reasons;     /* SUPERVISOR_*, of the last judgement */
    supervisor_confidence_t confidence;
} supervisor_state_t;

typedef struct {
    ab_t i_s_A;           /* sampled now */
    ab_t lambda_r_hat_Wb; /* of this sample */
    ab_t e1_A;
    ab_t correction_V; /* what the estimator's correction adds to the flux row */
    float Rs_ohm;      /* in use */
    float omega_e_hat_rad_s;
    float omega_s_hat_rad_s;
    bool at_limit;           /* the speed asks for all of the torque current */
    bool told_torque;        /* the torque is what somebody asks for, no speed controller's */
    float swing_rad_s;       /* the field dwells at zero and its frequency swings by this; 0: not */
    float swing_omega_rad_s; /* so fast; > 0 where swing_rad_s is */
} supervisor_in_t;

/* False unless all numbers are finite and positive (uncertainties and times may be 0),
 * residual_pu <= lost_pu and the corner is slow against the period. */
CHECKED bool supervisor_init(supervisor_config_t *cfg, const supervisor_params_t *params,
                             const motor_model_t *motor, float period_s);

/* Lost; or in doubt beside a field under torque that stands or may be 45 degrees aside: any speed
 * explains what is measured. */
static inline bool supervisor_speed_unknown(const supervisor_state_t *st)
{
    return (st->confidence == SUPERVISOR_IMPRESSED) ||
           ((st->confidence != SUPERVISOR_CLOSED) && (st->standing_pu > 0.5f));
}

/* One period of RUN; at any other time the state is zeroed. */
static inline void supervisor_add(supervisor_state_t *st, ab_t u_s_V, ab_t i_s_A, float Rs_ohm)
{
    st->emf_sum_V = ab_add(st->emf_sum_V, ab_sub(u_s_V, ab_scale(i_s_A, Rs_ohm)));
}

/* After that, in a slot in which it is due: ties its flux to the estimate in every fourth period.
 * Judges in four slots of sixteen, one part each: measure, weigh, decide, bound. NaN never passes
 * as CLOSED. */
void supervisor_step(const supervisor_config_t *cfg, supervisor_state_t *st,
                     const supervisor_in_t *in, uint32_t slot);

#define SUPERVISOR_SLOTS                                                                           \
    (SLOTS_OF_QUARTER(SLOT_QUARTER_SUPERVISOR) | (1u << SLOT_SUPERVISOR_WEIGH) |                   \
     (1u << SLOT_SUPERVISOR_DECIDE) | (1u << SLOT_SUPERVISOR_BOUND))
static inline bool supervisor_is_due(uint32_t slot)
{
    return slot_is_among(slot, SUPERVISOR_SLOTS);
}

#endif
