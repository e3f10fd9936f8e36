/* Is every float of the law's state a number? One sum stands for all: NaN and infinity survive any
 * addition, and no sum of limited values overflows.
 *
 * `fast` is what the estimate and the voltage rest on, in every fourth period; `slow` is the rest,
 * in one slot of sixteen: what changes slowly, or waits for its use. Both are taken before the
 * period limits anything. The offsets of the sensors are in every current and voltage.
 */
#ifndef STATE_SUM_H
#define STATE_SUM_H

#include "drive.h"

static inline float state_sum_fast(const drive_state_t *st)
{
    const float acting = st->voltage.current.d.x + st->voltage.current.q.x +
                         st->modes.vector.speed.pi.x + ab_sum(st->acting.acting_V) +
                         ab_sum(st->acting.pending_V) + ab_sum(st->acting.lag) +
                         ab_sum(st->voltage.ahead);
    const measurement_state_t *m = &st->measurement;
    const float offsets = m->offset_A.u + m->offset_A.v + m->offset_A.w + ab_sum(m->offset_V);
    return estimator_sum(&st->estimator) + acting + offsets;
}

COLD float state_sum_slow(const drive_state_t *st);

/* What is due in this slot, as the period finds it; 0 when nothing is. */
static inline float state_sum_due(const drive_state_t *st)
{
    float sum = 0.0f;
    if (slot_is_quarter(st->slot, SLOT_QUARTER_STATE)) {
        sum = state_sum_fast(st);
    } else if (st->slot == SLOT_WHOLE_STATE) {
        sum = state_sum_slow(st);
    } else {
        /* its turn comes */
    }
    return sum;
}

#endif
