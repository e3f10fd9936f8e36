/* Does the word of the dc link drop where the link cannot? An ADC that lost its reference reads
 * half of everything: the duties would give twice the voltage that was asked for, and with little
 * current nothing but the link tells (current_jump.h needs a jump of .08 of the trip).
 *
 * Looks are .8 or 1.6 ms apart at 5 kHz. Meanwhile 100 uF per kW fall by a sixth of 300 V at full
 * power. A rise tells nothing: mains that come back charge the link within a period. One disturbed
 * sample is no drop.
 */
#ifndef LINK_DROP_H
#define LINK_DROP_H

#include <stdbool.h>

#include "num.h"

typedef struct {
    float u_dc_V; /* of the look before, unless it had dropped */
    bool low;     /* it had */
} link_drop_state_t;

/* Three times in a schedule with the gates on; true in the second look in a row that finds the word
 * far below. */
bool link_drop_look(link_drop_state_t *st, float u_dc_V);

#endif
