/* One schedule for everything slower than a period: a slot is the period number modulo 16.
 *
 * The paper's law, the modulator, the hard limits of the guard and recording run in every period.
 * Work that has to follow the motor within a millisecond runs in every fourth. Work that follows
 * heat, load or wear runs in one slot of sixteen. No slot holds two expensive tasks.
 */
#ifndef SLOTS_H
#define SLOTS_H

#include <stdbool.h>
#include <stdint.h>

#define SLOT_COUNT 16u

/* Every fourth period, by slot modulo 4. The NaN check comes right before the sines, which would
 * replace a wrong angle unseen. The quarter that is left has the checks of the guard. */
#define SLOT_QUARTERS           4u
#define SLOT_QUARTER_STATE      0u /* NaN check of the voltage path */
#define SLOT_QUARTER_ANGLES     0u /* sines of the delay angles */
#define SLOT_QUARTER_REFERENCES 1u /* ramp, flux reference, limits of the torque current */
#define SLOT_QUARTER_SUPERVISOR 2u /* its flux is tied to the estimate */

/* Once in sixteen periods. The rest of the NaN check has its slots in state_sum.c. */
#define SLOT_SUPERVISOR_DECIDE  0u
#define SLOT_SUPERVISOR_BOUND   1u
#define SLOT_REST               2u /* gates off: the state is cleared again */
#define SLOT_GUARD_SPEED        2u /* gates on */
#define SLOT_COMMAND            3u /* command time-out */
#define SLOT_GUARD_VOLTAGE      3u
#define SLOT_HEAT               4u
#define SLOT_M_TRACKING         5u
#define SLOT_FLUX_REFERENCE     6u
#define SLOT_GUARD_PHASES       7u
#define SLOT_SPEED_SCHEDULE     8u
#define SLOT_UNBALANCE_TRACKING 8u
#define SLOT_OFFSET_TRACKING    9u
#define SLOT_FLUX_STEERING      10u
#define SLOT_GUARD_ESTIMATE     11u
#define SLOT_DWELL              12u
#define SLOT_RS_TRACKING        13u
#define SLOT_SUPERVISOR_MEASURE 14u
#define SLOT_GUARD_CURRENT      14u
#define SLOT_SUPERVISOR_WEIGH   15u

static inline uint32_t slot_next(uint32_t slot)
{
    return (slot + 1u) % SLOT_COUNT;
}

static inline bool slot_is_quarter(uint32_t slot, uint32_t quarter)
{
    return (slot % SLOT_QUARTERS) == quarter;
}

/* Slots as bits of a word: one test for several. */
#define SLOTS_OF_QUARTER(quarter) (0x1111u << (quarter))

static inline bool slot_is_among(uint32_t slot, uint32_t slots)
{
    return ((slots >> slot) & 1u) != 0u;
}

#endif
