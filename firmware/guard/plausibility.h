/* Does what is measured, what was asked for and what is estimated fit together? Bits for faults.
 *
 * Each check runs once per schedule on one sample, and is answered by a count (debounce.h):
 *   voltage   |u_sensed - u_duty| <= u_V + .1 |u_duty|    line sensors, dc link, duty
 *   phases    no phase without current that was asked for   open phase
 *   estimate  |e1| <= e1_A, flux not far below its reference, speed changes by rate_rad_s2 at
 *             most, and the power across the air gap, (u - Rs i) . i, is torque times w_s/p but for
 *             power_W                                       observer
 *   stall     not: all the torque there is, a speed wanted, and none there
 *   sensors   not: i_hat is a mirror image of a large i    two current sensors exchanged
 * The last one is put in every period of premagnetisation. Three sensors of which two are exchanged
 * have the right sum and show a mirror image: what the current controller takes away grows, until
 * the trip. It names the cause just before; a motor that turns at its start can trip as well.
 * Stationary frame. A limit of 0 switches its question off.
 */
#ifndef PLAUSIBILITY_H
#define PLAUSIBILITY_H

#include <stdbool.h>
#include <stdint.h>

#include "frames.h"
#include "num.h"

typedef struct {
    float u_V;
    float open_A; /* asked for, while less than a quarter of it flows */
    float e1_A;   /* with it the flux is judged */
    float rate_rad_s2;
    float power_W;
    float stall_s;
} plausibility_params_t;

typedef struct {
    plausibility_params_t p;
    float change_rad_s; /* rate_rad_s2 for a schedule */
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

/* What was estimated, and what it has to fit. */
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

/* Each: true when it has lasted. */
bool plausibility_voltage_wrong(const plausibility_config_t *cfg, plausibility_state_t *st,
                                ab_t sensed_V, ab_t duty_V);
bool plausibility_phase_open(const plausibility_config_t *cfg, plausibility_state_t *st, uvw_t i_A,
                             ab_t i_ref_A);
bool plausibility_estimate_wrong(const plausibility_config_t *cfg, plausibility_state_t *st,
                                 const plausibility_estimate_t *in);
bool plausibility_stalled(const plausibility_config_t *cfg, plausibility_state_t *st, bool at_limit,
                          float omega_rad_s, float omega_ref_rad_s);
/* much_A: length of the vector from which on it is told. */
bool plausibility_current_mirrored(plausibility_state_t *st, ab_t i_A, ab_t i_hat_A, float much_A);

#endif
