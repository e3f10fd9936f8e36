#include "state_sum.h"

#include <stddef.h>

/* Floats side by side in the state. A table of them takes less flash than code. */
typedef struct {
    uint16_t at; /* of the first, bytes */
    uint16_t count;
} run_t;

_Static_assert(sizeof(drive_state_t) <= UINT16_MAX, "an offset is a uint16_t");
/* NOLINTBEGIN(bugprone-macro-parentheses): the name of a member cannot stand in them. */
#define AT(member) offsetof(drive_state_t, member)
#define RUN(first, last)                                                                           \
    {                                                                                              \
        (uint16_t) AT(first), (uint16_t)((AT(last) - AT(first)) / sizeof(float) + 1u)              \
    }
#define ONE(member)            RUN(member, member)
#define OF_VECTOR(first, last) RUN(modes.vector.first, modes.vector.last)
#define FOUND(first, last)     RUN(modes.premagnetise.first, modes.premagnetise.last)
/* NOLINTEND(bugprone-macro-parentheses) */

/* In the order of the slots. A run in the wrong slot is still summed. */
static const run_t runs[] = {
    /* Slot 3: resistances, before heat and tracking replace them unseen. */
    ONE(rs_tracking.delta_ohm),
    RUN(heating.Rs_cold_ohm, m_tracking.tau_extra_per_s),
    FOUND(Rs_delta_ohm, leg_tail_A),
    /* 5: dwelling, before it is used in slot 12. */
    RUN(dwell.omega_s_rad_s, omega_ref_before_rad_s),
    /* 6, 7: protection, before the supervisor measures anew in slot 14. */
    RUN(limits.link.taken_pu, limits.overload.i_max_A),
    ONE(guard.plausibility.omega_before_rad_s),
    RUN(guard.current_fit.emf_V, guard.current_fit.b_Wb),
    RUN(supervisor.s_Wb, supervisor.found.excess_pu),
    /* 9, 11, 13: control and references. */
    OF_VECTOR(speed.omega_filtered_rad_s, steering.reduction_Wb),
    OF_VECTOR(steer.reduction_Wb, steer.rate_Wb_per_s),
    OF_VECTOR(reference.weakened_Wb, reference.i_q_reduction_A),
    OF_VECTOR(mains.i_q_A, torque_gain_extra_pu),
    OF_VECTOR(modulation.speed_rad_s, modulation.rate_pu_per_s),
    OF_VECTOR(plan.omega_ref_rad_s, plan.torque_ref_Nm),
    /* 14: sums of a start. Not those of the teeth: what is not finite is not taken for a rotor, nor
     * for a line of the legs' loss. */
    FOUND(measurement.level[RS_LEVEL_LOW].i_A, measurement.level[RS_LEVEL_LOW].u_duty_V),
    FOUND(measurement.level[RS_LEVEL_HIGH].i_A, measurement.level[RS_LEVEL_HIGH].u_duty_V),
    /* 15: modes. Not what the search for a turning motor gathers: its result goes into the
     * estimate. */
    RUN(modes.i_f.axis, modes.i_f.flux_Wb.beta),
    RUN(modes.flying_current.i_before_A, modes.brake.current.e_V.beta),
    RUN(modes.brake.i_ref_A, modes.volts.boost_V),
};

/* The first run of each slot; the next slot's ends it. */
static const uint8_t first_run[SLOT_COUNT + 1u] = {0u, 0u, 0u, 0u,  3u,  3u,  4u,  7u, 8u,
                                                   8u, 9u, 9u, 12u, 12u, 14u, 16u, 19u};
_Static_assert(sizeof(runs) / sizeof(runs[0]) == 19u, "each run has its slot");

float state_sum_of_slot(const drive_state_t *st)
{
    if (slot_is_quarter(st->slot, SLOT_QUARTER_STATE)) {
        return state_sum_fast(st);
    }
    const uint8_t *const bytes = (const uint8_t *)st;
    const uint8_t *const first = &first_run[st->slot % SLOT_COUNT];
    float sum = 0.0f;
    for (const run_t *run = &runs[first[0]]; run != &runs[first[1]]; run++) {
        const float *value = (const float *)(const void *)&bytes[run->at];
        const float *const end = &value[run->count];
        if ((run->count & 1u) != 0u) {
            sum += *value;
            value++;
        }
        while (value != end) {
            sum += value[0] + value[1];
            value = &value[2];
        }
    }
    return sum;
}
