/* What one mode leaves to the next: estimator, controllers and confidence go on from what is known.
 * Nothing but verbs of their owners.
 */
#ifndef TRANSITION_H
#define TRANSITION_H

#include "drive.h"

/* Chooses the mode of this period and prepares it. */
COLD void transition_choose(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                            const drive_out_t *out);

/* After a mode without estimator has acted: what it found, and what it knows of the speed. */
COLD void transition_after_open_loop(const drive_config_t *cfg, drive_state_t *st,
                                     const mode_in_t *in, request_t *request);

/* Lost, or taken over until now: what follows from the supervisor's judgement. */
void transition_by_confidence(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                              drive_out_t *out);

#endif
