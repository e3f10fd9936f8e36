/* Does the dc link's word fit the mains that the user told? It stands for the link's sensor, the
 * ADC's reference and the supply: a rectifier charges the link to the peak of the mains.
 *
 *   low   below .7 of the peak: beyond what a weak mains, load and ripple take
 *   high  above 1.2 of it while the motor takes power: what braking left there is used up
 * Either for 4 s, so that a sag is ridden through, or as long as it goes away, in turns. With the
 * mains unknown (0) nothing is asked.
 */
#ifndef MAINS_CHECK_H
#define MAINS_CHECK_H

#include <stdbool.h>
#include <stdint.h>

#include "num.h"

typedef struct {
    float low_V;
    float high_V;  /* 0: unknown */
    uint32_t most; /* looks */
} mains_check_config_t;

typedef struct {
    uint32_t looks; /* wrong ones, less the others */
} mains_check_state_t;

/* mains_V: rms, between lines. False unless it is 0 or more, or for a schedule that is not. */
CHECKED bool mains_check_init(mains_check_config_t *cfg, float mains_V, float schedule_s);

/* Once per schedule with the gates on; power_W: into the motor. True when it has lasted. */
bool mains_check_look(const mains_check_config_t *cfg, mains_check_state_t *st, float u_dc_V,
                      float power_W);

#endif
