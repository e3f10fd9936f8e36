/* Is every float of the law's state a number? One sum stands for all: NaN and infinity survive any
 * addition, and no sum of limited values overflows.
 *
 * Taken as a period finds the state. `passing`, in every period: what a limit makes a number of, a
 * wrong one, in the period that uses it. `fast`, in every fourth: what else the voltage rests on,
 * and the sensors' offsets. `slow`, in four parts once in sixteen: what changes slowly, or waits
 * for its use.
 */
#ifndef STATE_SUM_H
#define STATE_SUM_H

#include "drive.h"

static inline float state_sum_passing(const drive_state_t *st)
{
    return estimator_sum(&st->estimator) + st->modes.vector.speed.pi.x;
}

static inline float state_sum_fast(const drive_state_t *st)
{
    const float acting = st->voltage.current.d.x + st->voltage.current.q.x +
                         ab_sum(st->acting.acting_V) + ab_sum(st->acting.pending_V) +
                         ab_sum(st->acting.lag) + ab_sum(st->voltage.ahead);
    const measurement_state_t *m = &st->measurement;
    const float offsets = m->offset_A.u + m->offset_A.v + m->offset_A.w + ab_sum(m->offset_V);
    return acting + offsets + st->modes.vector.speed.gain_extra;
}

/* The part of this slot: one of those of SLOT_QUARTER_STATE. */
HOT float state_sum_slow(const drive_state_t *st);

/* What is due in this slot. */
static inline float state_sum_due(const drive_state_t *st)
{
    float sum = state_sum_passing(st);
    if (slot_is_quarter(st->slot, SLOT_QUARTER_STATE)) {
        sum += state_sum_fast(st) + state_sum_slow(st);
    }
    return sum;
}

#endif
