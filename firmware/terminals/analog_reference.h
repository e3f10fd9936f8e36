/* Analogue reference: 0 to 10 V, or 4 to 20 mA with wire break, to a share of the largest speed.
 *
 * A value that no healthy source gives (NAMUR NE 43: below 3.6 mA or above 21 mA; above 11 V) is
 * not used: the last good one stays. The source is lost once more than one value in eight has been
 * such a one for lost_steps (lapse.h).
 */
#ifndef ANALOG_REFERENCE_H
#define ANALOG_REFERENCE_H

#include <stdbool.h>
#include <stdint.h>

#include "num.h"

#define ANALOG_REFERENCE_BREAK_A 3.6e-3f
#define ANALOG_REFERENCE_SHORT_A 21e-3f
#define ANALOG_REFERENCE_HIGH_V  11.0f

typedef enum {
    ANALOG_REFERENCE_OFF = 0,
    ANALOG_REFERENCE_VOLTAGE = 1, /* 0 to 10 V */
    ANALOG_REFERENCE_CURRENT = 2  /* 4 to 20 mA */
} analog_reference_kind_t;

typedef struct {
    uint32_t kind;    /* analog_reference_kind_t */
    float full_scale; /* of the input: V or A */
    float dead_pu;    /* below it the reference is zero */
    float filter_s;
    uint32_t lost_steps; /* at least 1 */
} analog_reference_params_t;

typedef struct {
    float scale;     /* V or A per count */
    float low;       /* V or A of zero */
    float per_unit;  /* of the span, 1/V or 1/A */
    float break_low; /* V or A: outside these no healthy source; 0 V is a short, and a zero */
    float break_high;
    float dead_pu;
    float filter_s;
    uint32_t lost_steps;
    bool on;
} analog_reference_config_t;

typedef struct {
    float share_pu; /* 0..1, filtered */
    uint32_t wrong;
} analog_reference_state_t;

/* False for a kind that does not exist or a number outside its range. The full scale has to reach
 * the end where the source counts as lost. */
CHECKED bool analog_reference_init(analog_reference_config_t *cfg,
                                   const analog_reference_params_t *params);

/* The share of the largest speed is st->share_pu; true: the source is lost. */
bool analog_reference_step(const analog_reference_config_t *cfg, analog_reference_state_t *st,
                           uint16_t counts, uint32_t steps);

#endif
