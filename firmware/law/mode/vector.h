/* Flux-oriented control: speed or torque -> current along and across the estimated flux.
 *
 *   target -> ramp -> speed PI -> i_q        flux reference -> flux control -> i_d
 *
 * Flux steering (near zero frequency) and voltage limit or economy (far from it) may reduce the
 * flux; the lower reference counts. During a mains loss its current replaces that of the speed
 * controller.
 */
#ifndef VECTOR_H
#define VECTOR_H

#include "flux_control.h"
#include "flux_reference.h"
#include "flux_steering.h"
#include "mains_loss.h"
#include "mode.h"
#include "speed_control.h"
#include "speed_ramp.h"
#include "torque_limits.h"

typedef struct {
    speed_control_config_t speed;
    speed_ramp_config_t ramp;
    flux_control_config_t flux;
    flux_steering_config_t steering;
    flux_reference_config_t reference;
    mains_loss_config_t mains;
    bool ride_through;
    motor_model_t motor;
    float inv_lambda_ref_per_Wb;
    float lambda_min_Wb; /* below: no orientation from the estimate */
} vector_config_t;

/* Effect of dwelling at zero stator frequency on the references (dwell.h). */
typedef struct {
    float speed_rad_s;   /* on top of the speed */
    float flux_pu;       /* taken from the flux */
    float rate_pu_per_s; /* of that */
} vector_modulation_t;

typedef struct {
    speed_control_state_t speed;
    speed_ramp_state_t ramp;
    flux_steering_state_t steering;
    flux_steering_out_t steer; /* of its last step */
    flux_reference_state_t reference;
    mains_loss_state_t mains;
    float flux_reduction_Wb;    /* nominal flux minus the reference in force */
    float i_d_reduction_A;      /* what that takes from the magnetising current */
    float torque_gain_extra_pu; /* nominal flux over the reference, less 1 */
    bool pull_out_near;         /* the flux reference limits the torque current */
    vector_modulation_t modulation;
    bool planned;            /* the plan below is of this run */
    speed_control_in_t plan; /* of every fourth period */
} vector_state_t;

/* Torque mode compensates at most this deviation of the flux. */
#define VECTOR_FLUX_LEAST_PU 0.67f
#define VECTOR_FLUX_MOST_PU  1.5f

/* Flux below which the estimate has no usable angle. With a motor that turned at the start without
 * flux the angle is usable at once: nothing else builds up the flux. */
#define VECTOR_CAUGHT_MIN_PU 0.01f
static inline float vector_lambda_min_Wb(const vector_config_t *cfg, bool running)
{
    return running ? cfg->lambda_min_Wb : (VECTOR_CAUGHT_MIN_PU * cfg->lambda_min_Wb);
}

/* Slow work of this slot: flux reference, steering, bandwidth; ramp and limits of the next periods.
 */
void vector_slow(const vector_config_t *cfg, const torque_limits_config_t *limits,
                 vector_state_t *st, const mode_in_t *in);

#define VECTOR_SLOW_SLOTS                                                                          \
    (SLOTS_OF_QUARTER(SLOT_QUARTER_REFERENCES) | (1u << SLOT_FLUX_REFERENCE) |                     \
     (1u << SLOT_FLUX_STEERING) | (1u << SLOT_SPEED_SCHEDULE))
static inline bool vector_slow_is_due(const vector_state_t *st, bool among_slots)
{
    return !st->planned || among_slots;
}

/* Mains loss: replaces i_q_A, the current of the speed controller. FAULT_MAINS_LOST once it can no
 * longer hold the dc link. */
COLD float vector_ride_through(const vector_config_t *cfg, vector_state_t *st, const mode_in_t *in,
                               float i_q_A, uint32_t *faults);

static inline bool vector_rides_through(const vector_config_t *cfg, const vector_state_t *st,
                                        float u_dc_V)
{
    return cfg->ride_through && !mains_loss_idle(&cfg->mains, &st->mains, u_dc_V);
}

/* In force from now on. */
COLD void vector_modulate(const vector_config_t *cfg, vector_state_t *st,
                          vector_modulation_t modulation);

/* The speed reference without it. */
static inline float vector_unmodulated_rad_s(const vector_state_t *st)
{
    return st->speed.omega_ref_rad_s - st->modulation.speed_rad_s;
}

/* One period: the current reference. */
static inline dq_t vector_step(const vector_config_t *cfg, vector_state_t *st, float omega_e_rad_s)
{
    return (dq_t){st->plan.i_d_ref_A,
                  speed_control_step(&cfg->speed, &st->speed, &st->plan, omega_e_rad_s)};
}

/* Flux without torque; the speed controller waits. */
static inline dq_t vector_wait(vector_state_t *st, float omega_e_rad_s)
{
    speed_control_wait(&st->speed, omega_e_rad_s);
    return (dq_t){st->plan.i_d_ref_A, 0.0f};
}

/* Sets the flux reference at once to what the voltage allows at this speed. */
COLD void vector_catch(const vector_config_t *cfg, vector_state_t *st, float omega_rad_s,
                       float u_dc_V);

/* Starts with the torque current i_q_A (at nominal flux) at the present speed. */
COLD void vector_seed(const vector_config_t *cfg, vector_state_t *st, float i_q_A,
                      float omega_ref_rad_s, float omega_hat_rad_s);

/* The speed controller starts from rest. */
COLD void vector_rest(vector_state_t *st);

/* The field ought to turn: one that stands all the same is lost. Not where the drive is asked to
 * stand: there friction may hold the shaft. */
static inline bool vector_steers(const vector_state_t *st)
{
    return st->steering.steering && (absf(vector_unmodulated_rad_s(st)) > 0.0f);
}

/* Resets flux steering. */
COLD void vector_stop_steering(const vector_config_t *cfg, vector_state_t *st);

#endif
