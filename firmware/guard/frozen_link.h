/* Is the word of the dc link frozen? While the motor returns power and the brake resistor is off,
 * the link rises: its word cannot stay as it is. A word that froze then would let it rise unseen.
 * With the resistor on the link may rest where the resistor takes just what comes.
 *
 * A stiff supply takes power back without a change. So nothing is checked up to .95 of where the
 * resistor is switched on, which no supply reaches, nor without a resistor.
 */
#ifndef FROZEN_LINK_H
#define FROZEN_LINK_H

#include <stdbool.h>
#include <stdint.h>

#include "num.h"

typedef struct {
    float least_W; /* returned power that counts */
    float high_V;  /* a supply is below; 0: no brake resistor */
} frozen_link_config_t;

typedef struct {
    float u_dc_V;   /* of the look before */
    uint32_t looks; /* in a row at which the word was the same while power came back */
} frozen_link_state_t;

/* chopper_on_V: 0 without a brake resistor. */
void frozen_link_init(frozen_link_config_t *cfg, float chopper_on_V, float i_trip_A);

/* Once per schedule with the gates on; power_W: into the motor. True when it is frozen. */
bool frozen_link_look(const frozen_link_config_t *cfg, frozen_link_state_t *st, float u_dc_V,
                      float power_W, bool brake_on);

#endif
