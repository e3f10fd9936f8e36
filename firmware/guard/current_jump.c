#include "current_jump.h"

#define CURRENT_JUMP_PU 0.08f /* of the trip */
/* Squares of shares. Of the change, which a sigma Ls between .63 and 2.5 times the true one leaves
 * unexplained; of the jump, from which the next period may be off. */
#define CURRENT_JUMP_UNEXPLAINED_PU2 0.36f
#define CURRENT_JUMP_BACK_PU2        0.25f

void current_jump_init(current_jump_config_t *cfg, float period_s, float sigma_Ls_H, float i_trip_A)
{
    const float jump_A = CURRENT_JUMP_PU * i_trip_A;
    *cfg = (current_jump_config_t){.A_per_V = period_s / sigma_Ls_H, .jump_A2 = jump_A * jump_A};
}

bool current_jump_look(const current_jump_config_t *cfg, current_jump_state_t *st, ab_t change_A,
                       ab_t rest_A)
{
    const current_jump_seen_t seen = st->seen;
    const float before_A2 = st->off_A2;
    const float off_A2 = ab_norm2(ab_sub(rest_A, st->rest_A));
    const float explained_A2 = CURRENT_JUMP_UNEXPLAINED_PU2 * ab_norm2(change_A);
    if ((seen == CURRENT_JUMP_STEADY) && (off_A2 > maxf(cfg->jump_A2, explained_A2))) {
        st->seen = CURRENT_JUMP_OFF; /* and d stays where it was */
        st->off_A2 = off_A2;
        return false;
    }
    st->seen = (seen == CURRENT_JUMP_NEW) ? CURRENT_JUMP_SECOND : CURRENT_JUMP_STEADY;
    st->rest_A = rest_A;
    return (seen == CURRENT_JUMP_OFF) && (off_A2 <= CURRENT_JUMP_BACK_PU2 * before_A2);
}
