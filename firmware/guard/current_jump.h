/* Do the current words jump where the current cannot? Without an estimate and in every mode.
 *
 * A period changes the current by di = T/(sigma Ls) (u - Rs i - e). Without the voltage's share,
 * d = di - T/(sigma Ls) u depends on Rs i and the EMF only, so it changes slowly. If a sensor's
 * gain changes, sensors are exchanged or lose their supply, or the ADC loses its reference, d jumps
 * for one period and returns in the next. A single disturbed sample is different: d then jumps
 * twice, the second time the other way. A wrong sigma Ls gives an error in proportion to di.
 * Stationary frame.
 */
#ifndef CURRENT_JUMP_H
#define CURRENT_JUMP_H

#include "frames.h"
#include "num.h"

typedef struct {
    float A_per_V; /* of a period */
    float jump_A2; /* square of the smallest jump */
} current_jump_config_t;

typedef enum {
    CURRENT_JUMP_NEW = 0,    /* no sample before */
    CURRENT_JUMP_SECOND = 1, /* no d before */
    CURRENT_JUMP_STEADY = 2,
    CURRENT_JUMP_OFF = 3 /* d left its place in the period before */
} current_jump_seen_t;

typedef struct {
    current_jump_seen_t seen;
    ab_t i_A;     /* of the sample before */
    ab_t rest_A;  /* d, of the last period in its place */
    float off_A2; /* by how much d left it */
} current_jump_state_t;

/* All finite and positive, as liveness_init() asks. */
void current_jump_init(current_jump_config_t *cfg, float period_s, float sigma_Ls_H,
                       float i_trip_A);

/* A large change, the period after one, or a beginning: true when the words have jumped to stay. */
COLD bool current_jump_look(const current_jump_config_t *cfg, current_jump_state_t *st,
                            ab_t change_A, ab_t rest_A);

/* In every period with the gates on; u_V: of the interval that ended, by the duties. */
static inline bool current_jump_step(const current_jump_config_t *cfg, current_jump_state_t *st,
                                     ab_t i_A, ab_t u_V)
{
    const ab_t change_A = ab_sub(i_A, st->i_A);
    const ab_t rest_A = ab_sub(change_A, ab_scale(u_V, cfg->A_per_V));
    st->i_A = i_A;
    if ((ab_norm2(change_A) > cfg->jump_A2) || (st->seen != CURRENT_JUMP_STEADY)) {
        return current_jump_look(cfg, st, change_A, rest_A);
    }
    st->rest_A = rest_A;
    return false;
}

#endif
