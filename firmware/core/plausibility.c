#include "plausibility.h"

#include <math.h>

#include "lasting.h"

/* Times on end, each a turn of 3.2 ms: longer than any transient of the current loop, shorter than
 * what a wrong angle needs to lose the load. A phase comes first: with one open, the voltages do
 * not fit either. */
#define PLAUSIBILITY_VOLTAGE_TURNS  8u
#define PLAUSIBILITY_PHASE_TURNS    6u
#define PLAUSIBILITY_ESTIMATE_TURNS 60u

#define PLAUSIBILITY_VOLTAGE_PU 0.1f /* filter in transients, gains of the sensors */
#define PLAUSIBILITY_OPEN_PU    0.25f
/* Electrical. No speed: below the first; a speed is wanted from the second on. */
#define PLAUSIBILITY_STILL_RAD_S  3.0f
#define PLAUSIBILITY_WANTED_RAD_S 6.0f
#define PLAUSIBILITY_STALL_MAX    1000000.0f /* turns */

bool plausibility_init(plausibility_config_t *cfg, const plausibility_params_t *params,
                       float turn_s)
{
    if (!nonnegativef(params->u_V) || !nonnegativef(params->open_A) ||
        !nonnegativef(params->e1_A) || !nonnegativef(params->stall_s) || !positivef(turn_s)) {
        return false;
    }
    const float turns = params->stall_s / turn_s + 0.5f;
    if (!(turns < PLAUSIBILITY_STALL_MAX)) {
        return false;
    }
    *cfg = (plausibility_config_t){.p = *params, .stall_turns = (uint32_t)turns};
    return true;
}

bool plausibility_voltage_wrong(const plausibility_config_t *cfg, plausibility_state_t *st,
                                ab_t sensed_V, ab_t duty_V)
{
    if (!(cfg->p.u_V > 0.0f)) {
        return false;
    }
    const float allowed_V = cfg->p.u_V + PLAUSIBILITY_VOLTAGE_PU * sqrtf(ab_norm2(duty_V));
    const bool wrong = !(ab_norm2(ab_sub(sensed_V, duty_V)) <= (allowed_V * allowed_V));
    st->voltage = lasting_count(st->voltage, wrong, PLAUSIBILITY_VOLTAGE_TURNS);
    return lasting(st->voltage, PLAUSIBILITY_VOLTAGE_TURNS);
}

/* Each phase counts for itself: where the voltage ends, the current lags what is asked for, and one
 * phase after the other is short of it when it passes zero. */
bool plausibility_phase_open(const plausibility_config_t *cfg, plausibility_state_t *st, uvw_t i_A,
                             ab_t i_ref_A)
{
    const float least_A = cfg->p.open_A;
    if (!(least_A > 0.0f)) {
        return false;
    }
    const uvw_t ref_A = uvw_from_ab(i_ref_A);
    const float wanted_A[3] = {ref_A.u, ref_A.v, ref_A.w};
    const float flows_A[3] = {i_A.u, i_A.v, i_A.w};
    bool open = false;
    for (int x = 0; x < 3; x++) {
        /* A NaN is no current. */
        const bool wrong = (absf(wanted_A[x]) > least_A) &&
                           !(absf(flows_A[x]) >= (PLAUSIBILITY_OPEN_PU * least_A));
        st->phase[x] = lasting_count(st->phase[x], wrong, PLAUSIBILITY_PHASE_TURNS);
        open = open || lasting(st->phase[x], PLAUSIBILITY_PHASE_TURNS);
    }
    return open;
}

bool plausibility_estimate_wrong(const plausibility_config_t *cfg, plausibility_state_t *st,
                                 ab_t e1_A)
{
    if (!(cfg->p.e1_A > 0.0f)) {
        return false;
    }
    const bool wrong = !(ab_norm2(e1_A) <= (cfg->p.e1_A * cfg->p.e1_A));
    st->estimate = lasting_count(st->estimate, wrong, PLAUSIBILITY_ESTIMATE_TURNS);
    return lasting(st->estimate, PLAUSIBILITY_ESTIMATE_TURNS);
}

bool plausibility_stalled(const plausibility_config_t *cfg, plausibility_state_t *st, bool at_limit,
                          float omega_rad_s, float omega_ref_rad_s)
{
    if (cfg->stall_turns == 0u) {
        return false;
    }
    const bool wrong = at_limit && (absf(omega_rad_s) < PLAUSIBILITY_STILL_RAD_S) &&
                       (absf(omega_ref_rad_s) > PLAUSIBILITY_WANTED_RAD_S);
    st->stall = lasting_count(st->stall, wrong, cfg->stall_turns);
    return lasting(st->stall, cfg->stall_turns);
}
