/* Does what is measured, what was asked for and what is estimated fit together? Bits for faults.
 *
 * Each question is put once per slow turn, to one sample, and answered by a count (lasting.h):
 *   voltage   |u_sensed - u_duty| <= u_V + .1 |u_duty|    line sensors, dc link, duty
 *   phases    no phase without current that was asked for   open phase
 *   estimate  |e1| <= e1_A                                  observer
 *   stall     not: all the torque there is, a speed wanted, and none there
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
    float e1_A;
    float stall_s;
} plausibility_params_t;

typedef struct {
    plausibility_params_t p;
    uint32_t stall_turns;
} plausibility_config_t;

typedef struct {
    uint32_t voltage; /* counts of lasting.h */
    uint32_t phase[3];
    uint32_t estimate;
    uint32_t stall;
} plausibility_state_t;

/* False for a limit that is negative or not finite, or a stall time of more than an hour. */
CHECKED bool plausibility_init(plausibility_config_t *cfg, const plausibility_params_t *params,
                               float turn_s);

/* Each: true when it has lasted. */
COLD bool plausibility_voltage_wrong(const plausibility_config_t *cfg, plausibility_state_t *st,
                                     ab_t sensed_V, ab_t duty_V);
COLD bool plausibility_phase_open(const plausibility_config_t *cfg, plausibility_state_t *st,
                                  uvw_t i_A, ab_t i_ref_A);
COLD bool plausibility_estimate_wrong(const plausibility_config_t *cfg, plausibility_state_t *st,
                                      ab_t e1_A);
COLD bool plausibility_stalled(const plausibility_config_t *cfg, plausibility_state_t *st,
                               bool at_limit, float omega_rad_s, float omega_ref_rad_s);

#endif
