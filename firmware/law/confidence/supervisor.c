#include "supervisor.h"

#include <math.h>

/* A flux that may be off by so much of itself may stand 45 degrees aside: the torque and the flux
 * current change places. Under load the speed is then anything (zh envelope: run 388 of 841164779
 * was driven 90 min^-1 beyond its reference for two seconds, with a field of .2 to .7 Hz). */
#define SUPERVISOR_UNKNOWN_PU 0.7f

/* So much more slowly a doubt fades once it is told: a lost field may turn. */
#define SUPERVISOR_DOUBT_PU 0.1f

/* Lost is 25 degrees or a quarter of the flux; an error of a quarter turns it by 14.5 degrees at
 * most, so the quarter decides. Hysteresis: back below 10 degrees. */
#define SUPERVISOR_LIMIT_PU  0.25f
#define SUPERVISOR_RETURN_PU 0.18f

/* Under all torque and near zero frequency .85 of the largest flux: 1.28 nominal. A lost drive
 * stands there with the torque current along the field, which magnetised motors of 15 and 37 kW
 * to 1.4 (zh envelope). */
#define SUPERVISOR_FLUX_SPENT     0.85f
#define SUPERVISOR_SPENT_OMEGA_PU 2.0f /* near zero: |w_s| over the corner */

/* Floor of w_s that bounds are divided by. */
#define SUPERVISOR_OMEGA_S_MIN_RAD_S 1e-3f

/* Torque between this share of still_A and still_A is little; below it there is none. */
#define SUPERVISOR_STILL_LIGHT_PU 0.4f

/* A field that may stand aside shows less torque than there is: half of that share. With all of it
 * a shaft was driven away while the drive saw torque one fifth of the time (zh envelope: run 389 of
 * 98154247). */
#define SUPERVISOR_ASIDE_LIGHT_PU 0.2f

/* A flux that is lost shows first in the torque current, which grows while the load is the same.
 * Where it does, near zero frequency, RESIDUAL or FLUX for a quarter of the time is enough: waited
 * for in full, the shaft of a driving load was gone (zh envelope: run 205 of 724531672). With less
 * time for STILL, too, a sound drive was left to I-f (run 270 of 1899669423). In torque mode the
 * torque grows because it is told to: 64 instead of 22 of 200 drives were lost at low speed. */
#define SUPERVISOR_SURGE_PU    1.2f
#define SUPERVISOR_NEAR_PU     2.0f /* |w_s| over still_rad_s: as fast as the field is steered */
#define SUPERVISOR_SURGE_HASTE 4u

/* With all torque in use |w_s| counts up to this times still_rad_s: .9 of what steering holds. */
#define SUPERVISOR_STILL_AT_LIMIT 1.8f

/* Schedules on end with the flag; stops at the limit, so that it cannot wrap. */
static inline uint32_t schedules_with(bool flag, uint32_t schedules, uint32_t limit)
{
    if (!flag) {
        return 0u;
    }
    return (schedules < limit) ? (schedules + 1u) : limit;
}

/* STILL adds 1 in a schedule under little torque and SUPERVISOR_STILL_LIGHT under more. A schedule
 * without STILL takes as much back as the latter: the estimate of a field that stands jumps. */
static inline uint32_t count_still(const supervisor_findings_t *found, uint32_t units,
                                   uint32_t limit)
{
    if (!found->still) {
        return (units > SUPERVISOR_STILL_LIGHT) ? (units - SUPERVISOR_STILL_LIGHT) : 0u;
    }
    return (units < limit) ? (units + (found->light ? 1u : SUPERVISOR_STILL_LIGHT)) : limit;
}

/* Whether signs have lasted for as long as a loss takes. */
static inline bool long_enough(const supervisor_config_t *cfg, const supervisor_state_t *st,
                               bool suspect)
{
    const uint32_t haste = st->surges ? SUPERVISOR_SURGE_HASTE : 1u;
    return (suspect && (haste * st->suspect_schedules >= cfg->confirm_schedules)) ||
           (st->found.still && (st->still_units >= cfg->still_units));
}

/* All comparisons say x <= limit, so that a NaN is a reason. */
static uint32_t find_reasons(const supervisor_config_t *cfg, supervisor_state_t *st,
                             float excess_pu, bool flux_high)
{
    uint32_t reasons = 0u;
    if (!(st->flux_error_bound_pu <= SUPERVISOR_LIMIT_PU)) {
        reasons |= SUPERVISOR_UNSURE;
    }
    if (!(excess_pu <= cfg->p.residual_pu)) {
        reasons |= SUPERVISOR_RESIDUAL;
    }
    if (flux_high) {
        reasons |= SUPERVISOR_FLUX;
    }
    if (st->found.still) {
        reasons |= SUPERVISOR_STILL;
    }
    const bool suspect = (reasons & (SUPERVISOR_RESIDUAL | SUPERVISOR_FLUX)) != 0u;
    const bool lost = long_enough(cfg, st, suspect);
    st->still_units = count_still(&st->found, st->still_units, cfg->still_units);
    st->suspect_schedules = schedules_with(suspect, st->suspect_schedules, cfg->confirm_schedules);
    if (lost || !(excess_pu <= cfg->p.lost_pu)) {
        reasons |= SUPERVISOR_LOST;
    }
    return reasons;
}

/* Down at once, up only after all was quiet for a while. */
static void decide(const supervisor_config_t *cfg, supervisor_state_t *st)
{
    supervisor_confidence_t now = SUPERVISOR_CLOSED;
    if (st->reasons != 0u) {
        now = ((st->reasons & SUPERVISOR_LOST) != 0u) ? SUPERVISOR_IMPRESSED : SUPERVISOR_DEGRADED;
    }
    const bool quiet = (st->reasons == 0u) && (st->flux_error_bound_pu <= SUPERVISOR_RETURN_PU);
    st->quiet_schedules = schedules_with(quiet, st->quiet_schedules, cfg->return_schedules);
    if (now > st->confidence) {
        st->confidence = now;
    } else if (quiet && (st->quiet_schedules >= cfg->return_schedules)) {
        st->confidence = SUPERVISOR_CLOSED;
    } else {
        /* as it was */
    }
}

/* j d w lambda = (tau + j w_slip) d lambda - M tau e1 - l2 e1, from the flux row of eq. (3) at rest
 * in the turning frame: what error of speed an error of flux may hide. None is stated once the
 * angle itself is in doubt. */
static float speed_bound(const supervisor_config_t *cfg, const supervisor_state_t *st,
                         const supervisor_in_t *in, float lambda_Wb)
{
    if (st->confidence != SUPERVISOR_CLOSED) {
        return cfg->p.omega_max_rad_s;
    }
    const float slip_rad_s = st->omega_s_rad_s - in->omega_e_hat_rad_s;
    const float pole_per_s = sqrtf(cfg->tau_per_s * cfg->tau_per_s + slip_rad_s * slip_rad_s);
    const ab_t pull_V = ab_add(ab_scale(in->e1_A, cfg->m_tau_ohm), in->correction_V);
    const float pull_rad_s = sqrtf(ab_norm2(pull_V)) / lambda_Wb;
    /* The true flux may be that much shorter than the estimate; CLOSED: by a quarter at most. */
    const float estimate_rad_s =
        (pole_per_s * st->flux_error_bound_pu + pull_rad_s) / (1.0f - st->flux_error_bound_pu);
    const float bound_rad_s = estimate_rad_s + cfg->p.Rr_uncertainty_pu * absf(slip_rad_s) +
                              cfg->p.i_uncertainty_pu * absf(st->omega_s_rad_s);
    return minf(bound_rad_s, cfg->p.omega_max_rad_s);
}

static inline float high_flux_Wb(const supervisor_config_t *cfg, bool at_limit, float omega_s_rad_s)
{
    const bool spent =
        at_limit && (omega_s_rad_s < SUPERVISOR_SPENT_OMEGA_PU * cfg->p.corner_rad_s);
    return (spent ? SUPERVISOR_FLUX_SPENT : 1.0f) * cfg->lambda_high_Wb;
}

/* How much of the time any speed explains what is measured: under torque, beside a field that
 * stands or a flux that may stand aside. */
static inline void look_whether_seen(const supervisor_config_t *cfg, supervisor_state_t *st,
                                     bool stands, bool loaded_aside)
{
    const bool aside = loaded_aside && !(st->flux_error_bound_pu <= SUPERVISOR_UNKNOWN_PU);
    const bool unseen = stands || aside;
    const bool fades = !unseen && supervisor_speed_unknown(st);
    const float gain = fades ? (SUPERVISOR_DOUBT_PU * cfg->standing_gain) : cfg->standing_gain;
    st->standing_pu += gain * ((unseen ? 1.0f : 0.0f) - st->standing_pu);
}

/* Whether the torque grows near zero frequency; moves its mean. */
static inline void look_whether_it_surges(const supervisor_config_t *cfg, supervisor_state_t *st,
                                          bool told, float torque_Wb_A, float still_Wb_A)
{
    const float usual_Wb_A = maxf(st->torque_Wb_A, SUPERVISOR_STILL_LIGHT_PU * still_Wb_A);
    st->surges = !told && (absf(st->omega_s_rad_s) < SUPERVISOR_NEAR_PU * cfg->p.still_rad_s) &&
                 (torque_Wb_A > SUPERVISOR_SURGE_PU * usual_Wb_A);
    st->torque_Wb_A += cfg->standing_gain * (torque_Wb_A - st->torque_Wb_A);
}

/* Part one: what d, flux and current are. */
static void measure(const supervisor_config_t *cfg, supervisor_state_t *st,
                    const supervisor_in_t *in, ab_t d_Wb)
{
    const float estimate_Wb = sqrtf(ab_norm2(in->lambda_r_hat_Wb));
    const float lambda_Wb = clampf(estimate_Wb, cfg->lambda_low_Wb, cfg->lambda_high_Wb);
    st->omega_s_rad_s += cfg->omega_s_gain * (in->omega_s_hat_rad_s - st->omega_s_rad_s);
    const float torque_Wb_A = absf(ab_cross(in->lambda_r_hat_Wb, in->i_s_A));
    const float still_Wb_A = cfg->p.still_A * lambda_Wb;
    /* Without steering a sound drive's field may stand, too. */
    const bool steered = cfg->p.still_rad_s > 0.0f;
    const bool loaded = steered && (torque_Wb_A > SUPERVISOR_STILL_LIGHT_PU * still_Wb_A);
    const float still_rad_s =
        cfg->p.still_rad_s * (in->at_limit ? SUPERVISOR_STILL_AT_LIMIT : 1.0f);
    const bool stands = loaded && (absf(st->omega_s_rad_s) < still_rad_s);
    look_whether_seen(cfg, st, stands,
                      steered && (torque_Wb_A > SUPERVISOR_ASIDE_LIGHT_PU * still_Wb_A));
    look_whether_it_surges(cfg, st, in->told_torque, torque_Wb_A, still_Wb_A);
    /* Without torque to spare the speed does not swing; STILL looks after it then. */
    const bool swings = (in->swing_rad_s > 0.0f) && !(in->at_limit && steered);
    const float high_Wb = high_flux_Wb(cfg, in->at_limit, absf(st->omega_s_rad_s));
    st->found = (supervisor_findings_t){
        .residual_pu = sqrtf(ab_norm2(d_Wb)) / lambda_Wb,
        .lambda_Wb = lambda_Wb,
        .i_s_A = sqrtf(ab_norm2(in->i_s_A)),
        .swings = swings,
        /* I-f turns the field itself. */
        .still = stands && !swings && (st->confidence != SUPERVISOR_IMPRESSED),
        .light = !(torque_Wb_A > still_Wb_A),
        /* I-f does not control the flux. */
        .flux_high = (st->confidence != SUPERVISOR_IMPRESSED) && !(estimate_Wb <= high_Wb),
    };
}

/* Part two: what the uncertainty explains, and what may hide in it. */
static void weigh(const supervisor_config_t *cfg, supervisor_state_t *st, const supervisor_in_t *in)
{
    const float omega_s_rad_s = absf(st->omega_s_rad_s);
    const float omega_d_rad_s = sqrtf(omega_s_rad_s * omega_s_rad_s + cfg->corner2_rad2_s2);
    const float dV_pu_per_s =
        cfg->kr_inv *
        (cfg->p.Rs_uncertainty_pu * in->Rs_ohm * st->found.i_s_A + cfg->p.u_uncertainty_V) /
        st->found.lambda_Wb;
    st->flux_error_bound_pu = (st->found.residual_pu * omega_d_rad_s + dV_pu_per_s) /
                              maxf(omega_s_rad_s, SUPERVISOR_OMEGA_S_MIN_RAD_S);
    /* Below the corner d is Rs, whatever the flux does: a standing shaft is no loss. */
    const bool told = !(omega_s_rad_s < cfg->p.corner_rad_s);
    st->found.excess_pu = told ? (st->found.residual_pu - dV_pu_per_s / omega_d_rad_s) : 0.0f;
}

/* Part two of a field that dwells at zero, where its frequency swings by A at W. The flux swings by
 * a = A/W, which takes the EMF A lambda at W: a flux that is wrong by d lambda misses A d lambda of
 * it. What may hide that is what nobody knows of the voltage at W: dU, and a dRs |i|, as the
 * current swings by a too. Rs is identified there, u = Rs i, so that dRs |i| is dU. Hence d lambda
 * <= (Lr/M) dU (1/A + 1/W), and d with the corner undone at W: an Rs not yet found is in d. */
static void weigh_swing(const supervisor_config_t *cfg, supervisor_state_t *st,
                        const supervisor_in_t *in)
{
    const float omega_rad_s = in->swing_omega_rad_s;
    const float omega_d_rad_s = sqrtf(omega_rad_s * omega_rad_s + cfg->corner2_rad2_s2);
    const float hidden_Wb =
        cfg->kr_inv * cfg->p.u_uncertainty_V * (1.0f / in->swing_rad_s + 1.0f / omega_rad_s);
    const float hidden_pu = hidden_Wb / st->found.lambda_Wb;
    st->flux_error_bound_pu = st->found.residual_pu * omega_d_rad_s / omega_rad_s + hidden_pu;
    st->found.excess_pu = st->found.residual_pu - hidden_pu;
}

static void judge(const supervisor_config_t *cfg, supervisor_state_t *st, const supervisor_in_t *in,
                  uint32_t slot)
{
    switch (slot) {
    case SLOT_SUPERVISOR_MEASURE:
        measure(cfg, st, in, st->d_Wb);
        break;
    case SLOT_SUPERVISOR_WEIGH:
        if (st->found.swings && (in->swing_rad_s > 0.0f)) {
            weigh_swing(cfg, st, in);
        } else {
            weigh(cfg, st, in);
        }
        break;
    case SLOT_SUPERVISOR_DECIDE:
        st->reasons = find_reasons(cfg, st, st->found.excess_pu, st->found.flux_high);
        decide(cfg, st);
        break;
    case SLOT_SUPERVISOR_BOUND:
        st->omega_bound_rad_s = speed_bound(cfg, st, in, st->found.lambda_Wb);
        break;
    default:
        /* nothing to judge */
        break;
    }
}

/* s integrates the EMF since the last time, and is drawn to lambda_hat + eps i. */
static void tie(const supervisor_config_t *cfg, supervisor_state_t *st, const supervisor_in_t *in)
{
    const ab_t target_Wb = ab_add(in->lambda_r_hat_Wb, ab_scale(in->i_s_A, cfg->eps_H));
    const ab_t s_Wb =
        st->started ? ab_add(st->s_Wb, ab_scale(st->emf_sum_V, cfg->kT_s)) : target_Wb;
    st->started = true;
    st->emf_sum_V = (ab_t){0.0f, 0.0f};
    st->d_Wb = ab_sub(target_Wb, s_Wb);
    st->s_Wb = ab_add(s_Wb, ab_scale(st->d_Wb, cfg->share));
}

void supervisor_step(const supervisor_config_t *cfg, supervisor_state_t *st,
                     const supervisor_in_t *in, uint32_t slot)
{
    if (slot_is_quarter(slot, SLOT_QUARTER_SUPERVISOR)) {
        tie(cfg, st, in);
    }
    st->judged = st->judged || (slot == SLOT_SUPERVISOR_MEASURE);
    if (st->judged) { /* the parts follow one another */
        judge(cfg, st, in, slot);
    }
}
