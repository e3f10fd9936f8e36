/* Limits and plausibility -> fault bits (fault.h). Reads everything, writes only the bits. */
#ifndef MONITOR_H
#define MONITOR_H

#include <stdbool.h>
#include <stdint.h>

#include "fault.h"
#include "measured.h"

typedef struct {
    float i_trip_A; /* any phase, instantaneous */
    float u_dc_max_V;
    float u_dc_min_V;
    float omega_max_rad_s;         /* electrical, estimated */
    uint32_t plausibility_periods; /* ADC and current-sum flags must last this long */
} monitor_config_t;

typedef struct {
    uint32_t adc_periods; /* counts of debounce.h */
    uint32_t sum_periods;
    uint32_t earth_periods;
} monitor_state_t;

typedef struct {
    const measured_t *meas;
    float state_sum; /* sum of the state, in a period in which it was taken; else 0 */
    float omega_e_hat_rad_s;
} monitor_in_t;

/* False unless every limit is finite and positive, 0 <= u_dc_min < u_dc_max, and
 * 1 <= plausibility_periods <= 1e6. */
CHECKED bool monitor_init(const monitor_config_t *cfg);

/* Fault bits of this period; 0 when all is well. */
uint32_t monitor_step(const monitor_config_t *cfg, monitor_state_t *st, const monitor_in_t *in);

#endif
