#include "state_sum.h"

#include <stddef.h>

/* Offsets: two bytes for each float, where the code of a sum takes eight. */
_Static_assert(sizeof(drive_state_t) <= UINT16_MAX, "an offset is a uint16_t");
/* NOLINTBEGIN(bugprone-macro-parentheses): the name of a member cannot stand in them. */
#define AT(member)    (uint16_t) offsetof(drive_state_t, member)
#define AT_AB(member) AT(member.alpha), AT(member.beta)
#define VECTOR(name)  AT(modes.vector.name)
#define SUMS(level)   AT(level.i_A), AT(level.u_V), AT(level.u_duty_V)
#define FOUND(name)   AT(modes.premagnetise.name)
/* NOLINTEND(bugprone-macro-parentheses) */

/* Where a part of the list below begins. A float in the wrong part is still summed, in another
 * slot. */
#define RESISTANCE 0u
#define REFERENCES (RESISTANCE + 10u)
#define START      (REFERENCES + 17u)
#define DWELL      (START + 9u)
#define PROTECTION (DWELL + 10u)
#define CONTROL    (PROTECTION + 24u)
#define MODES      (CONTROL + 12u)
#define PARTS_END  (MODES + 21u)
_Static_assert(PARTS_END <= UINT8_MAX, "an index is a uint8_t");

static const uint16_t parts[] = {
    /* RESISTANCE */
    FOUND(Rs_delta_ohm),
    FOUND(Rr_extra_pu),
    AT(rs_tracking.delta_ohm),
    AT(omega_ref_before_rad_s),
    AT(heating.Rs_cold_ohm),
    AT(heating.winding_pu),
    AT(heating.rotor_pu),
    AT(heating.slip_rad_s),
    AT(m_tracking.extra_pu),
    AT(m_tracking.tau_extra_per_s),
    /* REFERENCES */
    VECTOR(ramp.steps),
    VECTOR(steering.torque_Nm),
    VECTOR(steering.omega_rad_s),
    VECTOR(steering.reduction_Wb),
    VECTOR(steer.reduction_Wb),
    VECTOR(steer.rate_Wb_per_s),
    VECTOR(reference.weakened_Wb),
    VECTOR(reference.economy_Wb),
    VECTOR(reference.reduction_Wb),
    VECTOR(reference.rate_Wb_per_s),
    VECTOR(reference.i_q_reduction_A),
    VECTOR(mains.i_q_A),
    VECTOR(plan.omega_ref_rad_s),
    VECTOR(plan.i_d_ref_A),
    VECTOR(plan.flux_pu),
    VECTOR(plan.inv_flux_pu),
    VECTOR(plan.torque_ref_Nm),
    /* START. Not the sums of the teeth: what is not finite is not taken for a rotor, nor for a line
     * of the legs' loss. */
    SUMS(modes.premagnetise.measurement.level[RS_LEVEL_HIGH]),
    SUMS(modes.premagnetise.measurement.level[RS_LEVEL_LOW]),
    FOUND(leg_loss_pu),
    FOUND(leg_threshold_A),
    FOUND(leg_tail_A),
    /* DWELL */
    AT(dwell.omega_s_rad_s),
    AT(dwell.i_q_A),
    AT(dwell.reference_rad_s),
    AT(dwell.share),
    AT(dwell.gain),
    AT(dwell.turns),
    AT(dwell.speed_rad_s),
    AT(dwell.reduction_pu),
    AT(dwell.rate_pu_per_s),
    AT(dwell.swing_rad_s),
    /* PROTECTION */
    AT(limits.link.taken_pu),
    AT(limits.overload.heat_pu[OVERLOAD_MOTOR]),
    AT(limits.overload.heat_pu[OVERLOAD_INVERTER]),
    AT(limits.overload.i_max_A),
    AT_AB(supervisor.s_Wb),
    AT(supervisor.found.residual_pu),
    AT(supervisor.found.lambda_Wb),
    AT(supervisor.found.i_s_A),
    AT(supervisor.found.excess_pu),
    AT(supervisor.omega_s_rad_s),
    AT(supervisor.standing_pu),
    AT_AB(supervisor.emf_sum_V),
    AT_AB(supervisor.d_Wb),
    AT(supervisor.flux_error_bound_pu),
    AT(supervisor.omega_bound_rad_s),
    AT(guard.plausibility.omega_before_rad_s),
    AT_AB(guard.current_fit.psi_Wb),
    AT(guard.current_fit.b_Wb),
    AT_AB(guard.current_fit.emf_V),
    /* CONTROL */
    VECTOR(speed.omega_filtered_rad_s),
    VECTOR(speed.omega_ref_rad_s),
    VECTOR(speed.i_q_A),
    VECTOR(speed.slow_A),
    VECTOR(speed.low_A),
    VECTOR(speed.high_A),
    VECTOR(flux_reduction_Wb),
    VECTOR(i_d_reduction_A),
    VECTOR(torque_gain_extra_pu),
    VECTOR(modulation.speed_rad_s),
    VECTOR(modulation.flux_pu),
    VECTOR(modulation.rate_pu_per_s),
    /* MODES. Not what the search for a turning motor gathers: its result goes into the estimate. */
    AT_AB(modes.i_f.axis),
    AT(modes.i_f.current_A),
    AT(modes.i_f.omega_rad_s),
    AT_AB(modes.i_f.flux_Wb),
    AT_AB(modes.flying_current.i_before_A),
    AT_AB(modes.flying_current.e_V),
    AT_AB(modes.brake.current.i_before_A),
    AT_AB(modes.brake.current.e_V),
    AT_AB(modes.brake.i_ref_A),
    AT(modes.brake.omega_rad_s),
    AT_AB(modes.volts.off_axis),
    AT(modes.volts.omega_rad_s),
    AT(modes.volts.boost_V),
};

_Static_assert(sizeof(parts) / sizeof(parts[0]) == PARTS_END, "each float has its part");

/* Where the part of a slot begins and ends; 0 and 0: it has none. */
static const uint8_t part_of_slot[SLOT_COUNT][2] = {
    [SLOT_STATE_RESISTANCE] = {RESISTANCE, REFERENCES},
    [SLOT_STATE_REFERENCES] = {REFERENCES, START},
    [SLOT_STATE_START] = {START, DWELL},
    [SLOT_STATE_DWELL] = {DWELL, PROTECTION},
    [SLOT_STATE_PROTECTION] = {PROTECTION, CONTROL},
    [SLOT_STATE_CONTROL] = {CONTROL, MODES},
    [SLOT_STATE_MODES] = {MODES, PARTS_END},
};

float state_sum_of_slot(const drive_state_t *st)
{
    const uint8_t *const bytes = (const uint8_t *)st;
    const uint8_t *const part = part_of_slot[st->slot % SLOT_COUNT];
    if (part[1] == 0u) {
        return state_sum_fast(st);
    }
    const uint16_t *at = &parts[part[0]];
    const uint16_t *const end = &parts[part[1]];
    float sum = 0.0f;
    do {
        sum += *(const float *)(const void *)&bytes[*at];
        at++;
    } while (at != end);
    return sum;
}
