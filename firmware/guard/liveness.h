/* Are the current words frozen? Needs no estimate and works in every mode.
 *
 * A spell begins when a sample repeats all three currents exactly. Two checks judge it, and a third
 * judges each word alone:
 *   demand   the acting voltage must not demand a change of current that is not seen. The demand x:
 *            sigma Ls dx/dt = u - Rs (i + x) - e, e: mean EMF of the window before the spell
 *            (current_fit.h). |x| <= i_unseen + b; b allows for the change of e since. A current
 *            that rotates with the field and yet repeats rotates slowly. A very small current says
 *            nothing about the field, so e may have any direction, and little about what the legs
 *            lose. A current at its peak repeats for a moment, so the shortest spells do not count.
 *   flicker  with the gates off one sample in six of each word jumped by two counts. Then 40
 *            repeats of three such words are no coincidence: with noise of .8 counts below 1e-50.
 *   word     a word that flickers is the same in 80 looks on end, three in sixteen periods. Direct
 *            current behind one frozen word fits every other check, and an earth fault of that
 *            phase was seen by nobody (zh campaign faults: 147 A in V/f at rest).
 * At standstill with a quiet ADC none acts until the voltage changes: constant words are then
 * correct. Before they do harm the voltage has to change.
 */
#ifndef LIVENESS_H
#define LIVENESS_H

#include "frames.h"

typedef struct {
    float Rs_ohm;
    float A_per_V;  /* of a period */
    float spell;    /* repeats from which a demand counts */
    float unseen_A; /* change of current that may stay unseen */
    float small_A2; /* square of a current too small to show the field */
    float jump_A;   /* between one and two counts */
} liveness_config_t;

/* Measured with the gates off: noise of each word. */
typedef struct {
    float i_A[3];      /* of the period before */
    uint32_t jumps[3]; /* weighed, less the samples without one; per phase */
} liveness_noise_t;

/* One word, with the gates on. */
typedef struct {
    float i_A;      /* of the look before */
    uint32_t looks; /* on end with the same, of a word that flickers */
} liveness_word_t;

typedef struct {
    liveness_noise_t noise;
    uvw_t i_A; /* of the sample before */
    liveness_word_t word[3];
    uint32_t repeats; /* of this spell */
    ab_t demand_A;    /* of this spell */
    float allowed_A;  /* likewise */
    ab_t emf_V;       /* before it */
} liveness_state_t;

typedef struct {
    ab_t i_s_A;
    ab_t u_V;   /* of the interval that ended, by the duties */
    ab_t emf_V; /* of the last whole window */
    float u_dc_V;
} liveness_in_t;

typedef struct {
    float period_s;
    float Rs_ohm;
    float sigma_Ls_H;
    float i_trip_A;
    float A_per_count;
} liveness_params_t;

/* False unless all are finite and positive, and sigma Ls/Rs is longer than a period. */
CHECKED bool liveness_init(liveness_config_t *cfg, const liveness_params_t *params);

/* In every period with the gates on: does this sample repeat the last one? Compared as bits: each
 * word has one value. */
static inline bool liveness_repeats(liveness_state_t *st, const uvw_t *i_A)
{
    if ((float_bits(i_A->u) == float_bits(st->i_A.u)) &&
        (float_bits(i_A->v) == float_bits(st->i_A.v)) &&
        (float_bits(i_A->w) == float_bits(st->i_A.w))) {
        return true;
    }
    st->i_A = (uvw_t){i_A->u, i_A->v, i_A->w}; /* number by number: they are at hand */
    st->repeats = 0u;
    return false;
}

/* A sample that repeats: true when it must not. */
bool liveness_frozen(const liveness_config_t *cfg, liveness_state_t *st, const liveness_in_t *in);

/* In some slots with the gates on: true when one word does not change any more. */
bool liveness_word_frozen(liveness_state_t *st, uvw_t i_A);

/* In every period with the gates off: learns whether these words flicker. */
COLD void liveness_look(const liveness_config_t *cfg, liveness_noise_t *noise, uvw_t i_A);

#endif
