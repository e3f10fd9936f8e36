#include "liveness.h"

#define LIVENESS_REPEATS   40u    /* of words that flicker: 8 ms at 200 us */
#define LIVENESS_UNSEEN_PU 0.125f /* of the trip: what may flow before it is noticed */
#define LIVENESS_SMALL_PU  0.05f  /* of the trip */
#define LIVENESS_JUMP      1.5f   /* counts */
#define LIVENESS_TURNED    0.5f   /* share of the EMF that a slow field may change in a spell */
#define LIVENESS_ANY_WAY   2.0f   /* likewise when its direction is not known */
#define LIVENESS_LOOKS     8u     /* with a jump, on end, or from one in eight on */
#define LIVENESS_LIVELY    4u     /* of them */

bool liveness_init(liveness_config_t *cfg, const liveness_params_t *params)
{
    if (!ALL_POSITIVE(params->period_s, params->Rs_ohm, params->sigma_Ls_H, params->i_trip_A,
                      params->A_per_count)) {
        return false;
    }
    const float small_A = LIVENESS_SMALL_PU * params->i_trip_A;
    *cfg =
        (liveness_config_t){.period_s = params->period_s,
                            .Rs_ohm = params->Rs_ohm,
                            .unseen_Wb = LIVENESS_UNSEEN_PU * params->i_trip_A * params->sigma_Ls_H,
                            .small_A2 = small_A * small_A,
                            .jump_A = LIVENESS_JUMP * params->A_per_count};
    return true;
}

static bool flickers(const liveness_state_t *st)
{
    return debounce_elapsed(st->flicker[0], LIVENESS_LIVELY) &&
           debounce_elapsed(st->flicker[1], LIVENESS_LIVELY) &&
           debounce_elapsed(st->flicker[2], LIVENESS_LIVELY);
}

bool liveness_repeated(const liveness_config_t *cfg, liveness_state_t *st, const liveness_in_t *in)
{
    if (st->repeats == 0u) {
        st->demand_Wb = (ab_t){0.0f, 0.0f};
        st->emf_V = in->emf_V;
    }
    st->repeats++; /* wraps round after ten days: a new spell */
    const ab_t explained_V = ab_add(ab_scale(in->i_s_A, cfg->Rs_ohm), st->emf_V);
    const ab_t unexplained_V = ab_sub(in->u_V, explained_V);
    st->demand_Wb = ab_add(st->demand_Wb, ab_scale(unexplained_V, cfg->period_s));
    const float share = (ab_norm2(in->i_s_A) < cfg->small_A2) ? LIVENESS_ANY_WAY : LIVENESS_TURNED;
    const float spell_s = (float)st->repeats * cfg->period_s;
    const float allowed_Wb = cfg->unseen_Wb + share * spell_s * sqrtf(ab_norm2(st->emf_V));
    /* A NaN is beyond. */
    const bool demanded = !(ab_norm2(st->demand_Wb) <= (allowed_Wb * allowed_Wb));
    return demanded || ((st->repeats >= LIVENESS_REPEATS) && flickers(st));
}

liveness_state_t liveness_at_rest(const liveness_config_t *cfg, const liveness_state_t *st,
                                  uvw_t i_A)
{
    const float change_A[3] = {i_A.u - st->i_A.u, i_A.v - st->i_A.v, i_A.w - st->i_A.w};
    liveness_state_t next = {.i_A = i_A};
    for (int x = 0; x < 3; x++) {
        next.flicker[x] =
            debounce_count(st->flicker[x], absf(change_A[x]) > cfg->jump_A, LIVENESS_LOOKS);
    }
    return next;
}
