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

typedef struct {
    ab_t acting_V;  /* of the duties acting from now to the next sample */
    ab_t pending_V; /* of the duties of the last step, which act after that */
} acting_voltage_state_t;

typedef struct {
    ab_t duty_V; /* by the duties */
    ab_t u_s_V;  /* by the source in use */
} acting_voltage_out_t;

/* False for an unknown source, or a delay that is negative or not finite. */
CHECKED bool acting_voltage_init(acting_voltage_config_t *cfg, acting_voltage_source_t source,
                                 float filter_comp_s);

/* One period. u_line_V: sensed now; omega_s_rad_s: speed of the flux, for the filter's angle. */
acting_voltage_out_t acting_voltage_step(const acting_voltage_config_t *cfg,
                                         acting_voltage_state_t *st, ab_t u_line_V,
                                         float omega_s_rad_s);

#endif
