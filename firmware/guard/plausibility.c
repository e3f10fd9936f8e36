#include "plausibility.h"

#include <math.h>

#include "debounce.h"

/* Longer than any transient of the current loop, shorter than what a wrong angle needs to lose the
 * load. A phase comes first: with one open, the voltages do not fit either. */
#define PLAUSIBILITY_VOLTAGE_S  0.0256f
#define PLAUSIBILITY_PHASE_S    0.0192f
#define PLAUSIBILITY_ESTIMATE_S 0.192f

/* Periods on end, and how well the image fits (square of a tenth). Two exchanged sensors make 8 and
 * more of them up to the trip, the start of a motor that turns 3 at most (tools/docs/monitor.md).
 */
#define PLAUSIBILITY_MIRRORED_PERIODS 5u
#define PLAUSIBILITY_MIRRORED_PU2     0.01f
#define PLAUSIBILITY_SIN_THIRD        0.86602540378f /* of a turn */

/* Of what is expected: less is no flux of this current. At speed the voltage shows the flux, and
 * less than half means that the dc link is not what its word says. */
#define PLAUSIBILITY_FLUX_PU      0.25f
#define PLAUSIBILITY_FLUX_FAST_PU 0.5f
#define PLAUSIBILITY_FAST_RAD_S   60.0f /* electrical */
#define PLAUSIBILITY_VOLTAGE_PU   0.1f  /* filter in transients, gains of the sensors */
#define PLAUSIBILITY_LEG          2.0f /* times the allowance, while a leg has hardly any current */
#define PLAUSIBILITY_OPEN_PU      0.25f
/* Electrical. No speed: below the first, and below a share of the one wanted; one is wanted from
 * the second on (tests/sil/test_standing_faults.py: a locked rotor at 5 min^-1). */
#define PLAUSIBILITY_STILL_RAD_S  3.0f
#define PLAUSIBILITY_WANTED_RAD_S 0.5f
#define PLAUSIBILITY_SHORT_PU     0.5f
#define PLAUSIBILITY_STALL_MAX    1000000.0f /* schedules */

static uint32_t schedules(float time_s, float schedule_s)
{
    return (uint32_t)(time_s / schedule_s + 0.5f);
}

bool plausibility_init(plausibility_config_t *cfg, const plausibility_params_t *params,
                       float schedule_s)
{
    if (!ALL_NONNEGATIVE(params->u_V, params->open_A, params->e1_A, params->rate_rad_s2,
                         params->power_W, params->stall_s) ||
        !positivef(schedule_s)) {
        return false;
    }
    if (!(params->stall_s + 0.5f * schedule_s < PLAUSIBILITY_STALL_MAX * schedule_s)) {
        return false;
    }
    *cfg = (plausibility_config_t){
        .p = *params,
        .change_rad_s = params->rate_rad_s2 * schedule_s,
        .voltage_schedules = schedules(PLAUSIBILITY_VOLTAGE_S, schedule_s),
        .phase_schedules = schedules(PLAUSIBILITY_PHASE_S, schedule_s),
        .estimate_schedules = schedules(PLAUSIBILITY_ESTIMATE_S, schedule_s),
        .stall_schedules = schedules(params->stall_s, schedule_s)};
    return true;
}

/* What a leg loses has the sign of its current. A field that stands keeps a leg near zero for
 * seconds (zh envelope, 272 of 841164779: the duty's voltage is 4.7 V off, 3.6 are allowed). */
static bool leg_in_doubt(const plausibility_config_t *cfg, uvw_t i_A)
{
    const float least_A = PLAUSIBILITY_OPEN_PU * cfg->p.open_A;
    return (absf(i_A.u) < least_A) || (absf(i_A.v) < least_A) || (absf(i_A.w) < least_A);
}

bool plausibility_voltage_wrong(const plausibility_config_t *cfg, plausibility_state_t *st,
                                ab_t sensed_V, ab_t duty_V, uvw_t i_A)
{
    if (!(cfg->p.u_V > 0.0f)) {
        return false;
    }
    const float usual_V = cfg->p.u_V + PLAUSIBILITY_VOLTAGE_PU * sqrtf(ab_norm2(duty_V));
    const float allowed_V = leg_in_doubt(cfg, i_A) ? (PLAUSIBILITY_LEG * usual_V) : usual_V;
    const bool wrong = !(ab_norm2(ab_sub(sensed_V, duty_V)) <= (allowed_V * allowed_V));
    st->voltage = debounce_count(st->voltage, wrong, cfg->voltage_schedules);
    return debounce_elapsed(st->voltage, cfg->voltage_schedules);
}

/* Each phase counts for itself: where the voltage ends, the current lags what is asked for, and one
 * phase after the other is short of it when it passes zero. At a third or an eighth of the rate of
 * these checks the same phase is short of it again and again, at the same angle; but in between it
 * has current, which an open one never has. */
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
    uint32_t longest = 0u;
    for (int x = 0; x < 3; x++) {
        /* A NaN is no current. */
        const bool flows = absf(flows_A[x]) >= (PLAUSIBILITY_OPEN_PU * least_A);
        if (flows && (st->phase[x] == 0u)) {
            continue; /* the usual case: nothing to count */
        }
        const bool wrong = (absf(wanted_A[x]) > least_A) && !flows;
        st->phase[x] = flows ? debounce_refute(st->phase[x])
                             : debounce_count(st->phase[x], wrong, cfg->phase_schedules);
        longest = (st->phase[x] > longest) ? st->phase[x] : longest;
    }
    return debounce_elapsed(longest, cfg->phase_schedules);
}

/* A NaN is beyond any limit but 0, which is none. */
static bool beyond(float x, float limit)
{
    return (limit > 0.0f) && !(absf(x) <= limit);
}

bool plausibility_estimate_wrong(const plausibility_config_t *cfg, plausibility_state_t *st,
                                 const plausibility_estimate_t *in)
{
    const bool e1 = beyond(ab_norm2(in->e1_A), cfg->p.e1_A * cfg->p.e1_A);
    const float flux_pu = (absf(in->omega_rad_s) > PLAUSIBILITY_FAST_RAD_S)
                              ? PLAUSIBILITY_FLUX_FAST_PU
                              : PLAUSIBILITY_FLUX_PU;
    const bool flux = (cfg->p.e1_A > 0.0f) && !(in->lambda_Wb >= (flux_pu * in->lambda_ref_Wb));
    const bool rate = beyond(in->omega_rad_s - st->omega_before_rad_s, cfg->change_rad_s);
    const bool power = beyond(in->air_gap_W - in->torque_power_W, cfg->p.power_W);
    st->omega_before_rad_s = in->omega_rad_s;
    st->estimate =
        debounce_count(st->estimate, e1 || flux || rate || power, cfg->estimate_schedules);
    return debounce_elapsed(st->estimate, cfg->estimate_schedules);
}

bool plausibility_stalled(const plausibility_config_t *cfg, plausibility_state_t *st, bool at_limit,
                          float omega_rad_s, float omega_ref_rad_s)
{
    if (cfg->stall_schedules == 0u) {
        return false;
    }
    const float wanted_rad_s = absf(omega_ref_rad_s);
    const float turns_rad_s = (omega_ref_rad_s < 0.0f) ? -omega_rad_s : omega_rad_s;
    const bool wrong = at_limit && (absf(omega_rad_s) < PLAUSIBILITY_STILL_RAD_S) &&
                       (wanted_rad_s > PLAUSIBILITY_WANTED_RAD_S) &&
                       (turns_rad_s < PLAUSIBILITY_SHORT_PU * wanted_rad_s);
    st->stall = debounce_count(st->stall, wrong, cfg->stall_schedules);
    return debounce_elapsed(st->stall, cfg->stall_schedules);
}

/* With u and v, v and w or w and u exchanged the sensors show e^(j phi) conj(i), phi a third of a
 * turn or none. |mirrored - i_hat|^2 = |i|^2 + |i_hat|^2 - 2 Re(e^(-j phi) i i_hat): the best of
 * the three against the error that there is without. */
bool plausibility_current_mirrored(plausibility_state_t *st, ab_t i_A, ab_t i_hat_A, float much_A)
{
    const float i_A2 = ab_norm2(i_A);
    const float both_A2 = i_A2 + ab_norm2(i_hat_A);
    const float e1_A2 = both_A2 - 2.0f * ab_dot(i_A, i_hat_A);
    const ab_t product_A2 = ab_mul(i_A, i_hat_A);
    const float best_A2 = maxf(product_A2.alpha, PLAUSIBILITY_SIN_THIRD * absf(product_A2.beta) -
                                                     0.5f * product_A2.alpha);
    const bool fits = (both_A2 - 2.0f * best_A2) < (PLAUSIBILITY_MIRRORED_PU2 * e1_A2);
    st->mirrored = fits ? (st->mirrored + 1u) : 0u; /* a premagnetisation wraps nothing */
    return (st->mirrored >= PLAUSIBILITY_MIRRORED_PERIODS) && (i_A2 > (much_A * much_A));
}
