/* Does the measured dc link fit the mains voltage that the user has set? A rectifier charges the
 * link to the peak of the mains, so a misfit shows a wrong link sensor, ADC reference or supply.
 *
 *   low   below .7 of the peak: weaker than mains, load and ripple explain
 *   high  above 1.2 of the peak while the motor takes power: by then the energy of braking is gone
 * A fault needs 4 s of either. A look that fits takes one that does not back, so a sag does no
 * harm. With the mains unknown (0) nothing is checked.
 */
#ifndef MAINS_CHECK_H
#define MAINS_CHECK_H

#include <stdbool.h>
#include <stdint.h>

#include "num.h"

typedef struct {
    float low_V;
    float high_V;  /* 0: unknown */
    uint32_t most; /* looks that make a fault */
} mains_check_config_t;

typedef struct {
    uint32_t looks; /* that did not fit, less those that did */
} mains_check_state_t;

/* mains_V: rms, between lines. False unless it is 0 or more, or for a schedule that is not. */
CHECKED bool mains_check_init(mains_check_config_t *cfg, float mains_V, float schedule_s);

/* Once per schedule with the gates on; power_W: into the motor. True when it is a fault. */
bool mains_check_look(const mains_check_config_t *cfg, mains_check_state_t *st, float u_dc_V,
                      float power_W);

#endif
