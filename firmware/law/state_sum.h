/* NaN check of the law's state: one sum over all floats. NaN and infinity survive any addition, and
 * no sum of limited values overflows.
 *
 * The sums are taken before a period uses the state. `passing`, in every period: states where a
 * limit would turn NaN into a wrong number in the same period. `fast`, in every fourth: the other
 * states behind the voltage, and the sensor offsets. The rest, in nine parts once in sixteen:
 * states that change slowly or are used later. What is tracked of the sensors reaches the estimate
 * within the period and is not summed.
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
                         ab_sum(st->acting.lagging_V) + st->acting.duty_share +
                         ab_sum(st->voltage.ahead);
    const measurement_state_t *m = &st->measurement;
    const float offsets = m->offset_A.u + m->offset_A.v + m->offset_A.w + ab_sum(m->offset_V);
    return acting + offsets + st->modes.vector.speed.gain_change;
}

/* Every one but 1, 2 and 10. */
#define STATE_SUM_SLOTS 0xFBF9u

/* Of a slot in STATE_SUM_SLOTS: `fast` in its quarter, else the runs of this slot. */
HOT float state_sum_of_slot(const drive_state_t *st);

/* due: in one of STATE_SUM_SLOTS. */
static inline float state_sum_due(const drive_state_t *st, bool due)
{
    float sum = state_sum_passing(st);
    if (due) {
        sum += state_sum_of_slot(st);
    }
    return sum;
}

#endif
