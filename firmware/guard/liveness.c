#include "liveness.h"

#define LIVENESS_REPEATS 40u /* of words that flicker: 8 ms at 200 us */
/* A current that turns back stands still for a moment: at this bend, in A/s^2, within one count. */
#define LIVENESS_BEND_A_PER_S2 5e4f
#define LIVENESS_SHORTEST      2.0f /* repeats that say nothing in any case */
#define LIVENESS_UNSEEN_PU     0.1f /* of the trip: what may flow before it is noticed */
#define LIVENESS_UNSEEN_COUNTS 8.0f
#define LIVENESS_SMALL_PU      0.05f /* of the trip */
#define LIVENESS_SMALL_COUNTS  16.0f
#define LIVENESS_JUMP          1.5f /* counts */
/* What the EMF may change by in a spell: a share of itself, when it turns slowly (.4 is 23 degrees)
 * or may point anywhere. With .25, run 17 of zh envelope --seed 1658601084 was taken for frozen:
 * its currents stood still for 3 ms while the torque fell. And a share of Rs i, when direct current
 * magnetises a rotor that slows down, or heats a winding that nobody has measured yet: 1.44 times
 * Rs, and the legs' loss, were taken for frozen with .25 (run 124 of seed 3344238633). */
#define LIVENESS_TURNED   0.4f
#define LIVENESS_ANYWHERE 3.0f
#define LIVENESS_ROTOR    0.4f
/* Of the dc link: what the legs lose may change by, as a vector, beside a small current. Without
 * it a start with 10 bits, and a dead time told too long by half, was taken for frozen (zh
 * envelope: 250 of 3395374624). */
#define LIVENESS_LEGS_PU 0.02f
/* Noise is jumps of two counts: one count may be the edge of a code. A jump counts 5, a sample
 * without one takes 1 back, so that it takes more than a sixth of the samples. A word is then the
 * same as before five times of six at most, whatever its noise looks like, and in 80 looks on end
 * once in 2e6; with Gaussian noise .37 times, once in 1e34. With one in nine instead of a sixth,
 * run 262 of zh envelope --seed 2347976002 was taken for frozen. */
#define LIVENESS_JUMP_WEIGHT 5u
#define LIVENESS_JUMPS_MOST  128u
#define LIVENESS_JUMPS       64u
#define LIVENESS_SAME        80u /* 86 ms at 200 us */

bool liveness_init(liveness_config_t *cfg, const liveness_params_t *params)
{
    if (!ALL_POSITIVE(params->period_s, params->Rs_ohm, params->sigma_Ls_H, params->i_trip_A,
                      params->A_per_count)) {
        return false;
    }
    const float count_A = params->A_per_count;
    const float trip_A = params->i_trip_A;
    const float small_A = maxf(LIVENESS_SMALL_PU * trip_A, LIVENESS_SMALL_COUNTS * count_A);
    const float bend_s = 2.0f * sqrtf(count_A / LIVENESS_BEND_A_PER_S2);
    *cfg = (liveness_config_t){.Rs_ohm = params->Rs_ohm,
                               .A_per_V = params->period_s / params->sigma_Ls_H,
                               .spell = LIVENESS_SHORTEST + bend_s / params->period_s,
                               .unseen_A =
                                   LIVENESS_UNSEEN_PU * trip_A + LIVENESS_UNSEEN_COUNTS * count_A,
                               .small_A2 = small_A * small_A,
                               .jump_A = LIVENESS_JUMP * count_A};
    return cfg->A_per_V * cfg->Rs_ohm < 1.0f;
}

static bool flickers(const liveness_noise_t *noise)
{
    return (noise->jumps[0] >= LIVENESS_JUMPS) && (noise->jumps[1] >= LIVENESS_JUMPS) &&
           (noise->jumps[2] >= LIVENESS_JUMPS);
}

bool liveness_frozen(const liveness_config_t *cfg, liveness_state_t *st, const liveness_in_t *in)
{
    if (st->repeats == 0u) {
        st->demand_A = (ab_t){0.0f, 0.0f};
        st->allowed_A = 0.0f;
        st->emf_V = in->emf_V;
    }
    st->repeats++; /* wraps round after ten days: a new spell */
    const float Rs_ohm = cfg->Rs_ohm;
    const float i_A2 = ab_norm2(in->i_s_A);
    const bool small = i_A2 < cfg->small_A2;
    const float share = small ? LIVENESS_ANYWHERE : LIVENESS_TURNED;
    const float legs_V = small ? (LIVENESS_LEGS_PU * in->u_dc_V) : 0.0f;
    const float allowed_V =
        share * sqrtf(ab_norm2(st->emf_V)) + LIVENESS_ROTOR * Rs_ohm * sqrtf(i_A2) + legs_V;
    const ab_t drop_V = ab_scale(ab_add(in->i_s_A, st->demand_A), Rs_ohm);
    const ab_t unexplained_V = ab_sub(in->u_V, ab_add(drop_V, st->emf_V));
    st->demand_A = ab_add(st->demand_A, ab_scale(unexplained_V, cfg->A_per_V));
    st->allowed_A += cfg->A_per_V * (allowed_V - Rs_ohm * st->allowed_A);
    const float limit_A = cfg->unseen_A + st->allowed_A;
    /* A NaN is beyond. */
    const bool demanded = !(ab_norm2(st->demand_A) <= (limit_A * limit_A));
    return (demanded && ((float)st->repeats > cfg->spell)) ||
           ((st->repeats >= LIVENESS_REPEATS) && flickers(&st->noise));
}

bool liveness_word_frozen(liveness_state_t *st, uvw_t i_A)
{
    const float now_A[3] = {i_A.u, i_A.v, i_A.w};
    uint32_t longest = 0u;
    for (int x = 0; x < 3; x++) {
        liveness_word_t *word = &st->word[x];
        const bool stands = (float_bits(now_A[x]) == float_bits(word->i_A)) &&
                            (st->noise.jumps[x] >= LIVENESS_JUMPS);
        word->i_A = now_A[x];
        word->looks = stands ? (word->looks + 1u) : 0u; /* the gates open long before it wraps */
        longest = (word->looks > longest) ? word->looks : longest;
    }
    return longest >= LIVENESS_SAME;
}

static uint32_t counted(uint32_t jumps, bool jump)
{
    if (!jump) {
        return (jumps > 0u) ? (jumps - 1u) : 0u;
    }
    return (jumps < LIVENESS_JUMPS_MOST) ? (jumps + LIVENESS_JUMP_WEIGHT) : jumps;
}

void liveness_look(const liveness_config_t *cfg, liveness_noise_t *noise, uvw_t i_A)
{
    const float now_A[3] = {i_A.u, i_A.v, i_A.w};
    for (int x = 0; x < 3; x++) {
        const bool jump = absf(now_A[x] - noise->i_A[x]) > cfg->jump_A;
        noise->jumps[x] = counted(noise->jumps[x], jump);
        noise->i_A[x] = now_A[x];
    }
}
