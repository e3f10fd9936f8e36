/* What a slot holds, as one word: a period asks for each bit with one shift.
 *
 * The modules say in which slots they have work; slots.h has the numbers.
 */
#ifndef DUE_H
#define DUE_H

#include <stdint.h>

#include "guard.h"
#include "slots.h"
#include "state_sum.h"
#include "supervisor.h"
#include "vector.h"

#define DUE_STATE      (1u << 0) /* state_sum_of_slot */
#define DUE_ANGLES     (1u << 1) /* turn_angles */
#define DUE_SLOW       (1u << 2) /* vector_slow */
#define DUE_SUPERVISOR (1u << 3)
#define DUE_HEAT       (1u << 4) /* stage_heat */
#define DUE_CURRENT    (1u << 5) /* a window of current_fit.h has ended */
#define DUE_GUARD      (1u << 6) /* stage_guard_look */

#define DUE_IN(slot, slots, due) ((((slots) >> (slot)) & 1u) * (due))
#define DUE(slot)                                                                                  \
    (DUE_IN(slot, STATE_SUM_SLOTS, DUE_STATE) |                                                    \
     DUE_IN(slot, SLOTS_OF_QUARTER(SLOT_QUARTER_ANGLES), DUE_ANGLES) |                             \
     DUE_IN(slot, VECTOR_SLOW_SLOTS, DUE_SLOW) | DUE_IN(slot, SUPERVISOR_SLOTS, DUE_SUPERVISOR) |  \
     DUE_IN(slot, 1u << SLOT_HEAT, DUE_HEAT) |                                                     \
     DUE_IN(slot, 1u << SLOT_GUARD_CURRENT, DUE_CURRENT) |                                         \
     DUE_IN(slot, GUARD_LOOK_SLOTS | (1u << SLOT_GUARD_SPEED), DUE_GUARD))

static const uint8_t due_in[SLOT_COUNT] = {DUE(0),  DUE(1),  DUE(2),  DUE(3), DUE(4),  DUE(5),
                                           DUE(6),  DUE(7),  DUE(8),  DUE(9), DUE(10), DUE(11),
                                           DUE(12), DUE(13), DUE(14), DUE(15)};

#endif
