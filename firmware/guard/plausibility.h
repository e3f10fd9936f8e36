/* Do measurement, reference and estimate agree? Fault bits.
 *
 * Each check runs once per schedule on one sample and is debounced (debounce.h):
 *   voltage   |u_sensed - u_duty| <= u_V + .1 |u_duty|: line sensors, dc link, duty; twice as much
 *             while a leg has hardly any current
 *   phases    no phase lacks the current of its reference: open phase
 *   estimate  |e1| <= e1_A; flux not far below its reference; speed changes by rate_rad_s2 at most;
 *             air-gap power (u - Rs i) . i equals torque times w_s/p within power_W: observer
 *   stall     fault: all available torque, a speed reference, and no speed
 *   sensors   fault: i_hat is a mirror image of a large i: two current sensors exchanged
 * The last check runs in every period of premagnetisation. Three sensors of which two are exchanged
 * have the right sum and show a mirror image. The current controller then amplifies the error until
 * the trip. The check names the cause just before. A motor that turns at its start can trip as
 * well. Stationary frame. A limit of 0 switches its check off.
 */
#ifndef PLAUSIBILITY_H
#define PLAUSIBILITY_H

#include <stdbool.h>
#include <stdint.h>

#include "frames.h"
#include "num.h"

typedef struct {
    float u_V;
    float open_A; /* reference, with less than a quarter of it flowing */
    float e1_A;   /* enables the flux check too */
    float rate_rad_s2;
    float power_W;
    float stall_s;
    float mains_V;      /* for mains_check.h */
    float chopper_on_V; /* for frozen_link.h */
} plausibility_params_t;

typedef struct {
    plausibility_params_t p;
    float change_rad_s; /* rate_rad_s2 times a schedule */
    uint32_t voltage_schedules;
    uint32_t phase_schedules;
    uint32_t estimate_schedules;
    uint32_t stall_schedules;
} plausibility_config_t;

typedef struct {
    uint32_t voltage; /* counts of debounce.h */
    uint32_t phase[3];
    uint32_t estimate;
    float omega_before_rad_s; /* a schedule ago */
    uint32_t stall;
    uint32_t mirrored;
} plausibility_state_t;

/* The estimate, and what it has to agree with. */
typedef struct {
    ab_t e1_A;
    float lambda_Wb;
    float lambda_ref_Wb;
    float omega_rad_s;    /* electrical */
    float air_gap_W;      /* (u - Rs i) . i */
    float torque_power_W; /* torque times w_s/p */
} plausibility_estimate_t;

/* False for a limit that is negative or not finite, or a stall time of more than an hour. */
CHECKED bool plausibility_init(plausibility_config_t *cfg, const plausibility_params_t *params,
                               float schedule_s);

/* Each: true when debounced. */
bool plausibility_voltage_wrong(const plausibility_config_t *cfg, plausibility_state_t *st,
                                ab_t sensed_V, ab_t duty_V, uvw_t i_A);
bool plausibility_phase_open(const plausibility_config_t *cfg, plausibility_state_t *st, uvw_t i_A,
                             ab_t i_ref_A);
bool plausibility_estimate_wrong(const plausibility_config_t *cfg, plausibility_state_t *st,
                                 const plausibility_estimate_t *in);
bool plausibility_stalled(const plausibility_config_t *cfg, plausibility_state_t *st, bool at_limit,
                          float omega_rad_s, float omega_ref_rad_s);
/* much_A: vector length from which the check applies. */
bool plausibility_current_mirrored(plausibility_state_t *st, ab_t i_A, ab_t i_hat_A, float much_A);

#endif
