/* Mean stator voltage over the interval that ended at this sample.
 *
 * Duties of step k act from the crest after it, so the interval that ended at t_k had the duties of
 * step k - 2. Source: the filtered line-voltage sensors (the paper), whose 800 Hz filter delays the
 * reading by an angle w_s times filter_comp_s (THEORY 4), or the duty that acted. Stationary frame.
 */
#ifndef ACTING_VOLTAGE_H
#define ACTING_VOLTAGE_H

#include <stdbool.h>

#include "frames.h"

typedef enum {
    ACTING_VOLTAGE_SENSORS = 0, /* filtered line-voltage sensors */
    ACTING_VOLTAGE_DUTY = 1     /* reconstructed from the duty that acted */
} acting_voltage_source_t;

typedef struct {
    acting_voltage_source_t source;
    float filter_comp_s;
} acting_voltage_config_t;

/* By the duties. */
typedef struct {
    ab_t ended_V;   /* of the interval that ended at this sample */
    ab_t acting_V;  /* from now to the next sample */
    ab_t pending_V; /* after that: of the duties of the last step */
} acting_voltage_state_t;

/* False for an unknown source, or a delay that is negative or not finite. */
CHECKED bool acting_voltage_init(acting_voltage_config_t *cfg, acting_voltage_source_t source,
                                 float filter_comp_s);

/* One period: the voltage of the ended interval, by the source in use. u_line_V: sensed now;
 * omega_s_rad_s: speed of the flux, for the filter's angle. */
ab_t acting_voltage_step(const acting_voltage_config_t *cfg, acting_voltage_state_t *st,
                         ab_t u_line_V, float omega_s_rad_s);

#endif
