/* Do the current words still move? Without an estimate and in every mode.
 *
 * A spell begins when a sample repeats all three currents exactly. It is judged in two ways:
 *   demand   the voltage that acted must not ask for a change while none is seen. Asked for:
 *            sigma Ls dx/dt = u - Rs (i + x) - e, e: mean EMF of the window before the spell
 *            (current_fit.h). |x| <= i_unseen + b; b allows for what e does since. A current that
 *            turns with the field and yet repeats turns slowly; one of almost nothing says nothing
 *            of the field, so e may have any direction. A current that turns back stands still for
 *            a moment: the shortest spells do not count.
 *   flicker  with the gates off a word of this ADC was seen to jump by two counts, often: then
 *            40 repeats of three such words are no chance: of noise of .4 counts less than 1e-12.
 * At standstill with a quiet ADC neither speaks until the voltage changes: constant words are then
 * right. Before they do harm the voltage has to change.
 */
#ifndef LIVENESS_H
#define LIVENESS_H

#include "debounce.h"
#include "frames.h"

typedef struct {
    float Rs_ohm;
    float A_per_V;  /* of a period */
    float spell;    /* repeats from which on a demand counts */
    float unseen_A; /* change of current that may stay unseen */
    float small_A2; /* square of the current that says nothing of the field */
    float jump_A;   /* between one count and two */
} liveness_config_t;

typedef struct {
    uvw_t i_A;           /* of the sample before */
    uint32_t repeats;    /* of this spell */
    ab_t demand_A;       /* of this spell */
    float allowed_A;     /* likewise */
    ab_t emf_V;          /* before it */
    uint32_t flicker[3]; /* counts of debounce.h, per phase, with the gates off */
} liveness_state_t;

typedef struct {
    uvw_t i_A;
    ab_t i_s_A;
    ab_t u_V;   /* of the interval that ended, by the duties */
    ab_t emf_V; /* of the last whole window */
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

/* A sample that repeats the one before: true when it must not. */
COLD bool liveness_repeated(const liveness_config_t *cfg, liveness_state_t *st,
                            const liveness_in_t *in);

/* In every period with the gates on: true when the words stand still. Compared as bits: one word,
 * one value. */
static inline bool liveness_step(const liveness_config_t *cfg, liveness_state_t *st,
                                 const liveness_in_t *in)
{
    const bool repeated = (float_bits(in->i_A.u) == float_bits(st->i_A.u)) &&
                          (float_bits(in->i_A.v) == float_bits(st->i_A.v)) &&
                          (float_bits(in->i_A.w) == float_bits(st->i_A.w));
    if (repeated) {
        return liveness_repeated(cfg, st, in);
    }
    st->i_A = in->i_A;
    st->repeats = 0u;
    return false;
}

/* Once in sixteen periods with the gates off: learns whether these words flicker. Anything but what
 * was learnt starts again. */
COLD liveness_state_t liveness_at_rest(const liveness_config_t *cfg, const liveness_state_t *st,
                                       uvw_t i_A);

#endif
