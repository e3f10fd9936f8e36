/* Hand-over from one mode to the next: estimator, controllers and confidence continue from the
 * known state. It only calls verbs of the modules that own the state.
 */
#ifndef TRANSITION_H
#define TRANSITION_H

#include "drive.h"

/* Chooses the mode of this period and prepares it. */
COLD void transition_choose(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                            const drive_out_t *out);

/* After a mode without estimator has acted: takes over its result and its speed. */
COLD void transition_after_open_loop(const drive_config_t *cfg, drive_state_t *st,
                                     const mode_in_t *in, request_t *request);

/* Acts on the supervisor's judgement: lost, or recovered. */
void transition_by_confidence(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                              drive_out_t *out);

#endif
