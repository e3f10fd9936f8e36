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
#include "trig.h"

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
    ab_t lag;       /* the filter's angle as a unit vector, less (1, 0) */
} acting_voltage_state_t;

/* False for an unknown source, or a delay that is negative or not finite. */
CHECKED bool acting_voltage_init(acting_voltage_config_t *cfg, acting_voltage_source_t source,
                                 float filter_comp_s);

/* The filter's angle at this speed of the flux; need not be called every period. */
static inline void acting_voltage_angle(const acting_voltage_config_t *cfg,
                                        acting_voltage_state_t *st, float omega_s_rad_s)
{
    const ab_t unit = trig_ahead(omega_s_rad_s, cfg->filter_comp_s);
    st->lag = (ab_t){unit.alpha - 1.0f, unit.beta};
}

/* The voltage that this period's duties will give. */
static inline void acting_voltage_push(acting_voltage_state_t *st, ab_t u_V)
{
    st->pending_V = u_V;
}

/* One period: the voltage of the ended interval, by the source in use. u_line_V: sensed now. */
ab_t acting_voltage_step(const acting_voltage_config_t *cfg, acting_voltage_state_t *st,
                         ab_t u_line_V);

#endif
