#include "speed_guard.h"

#include "debounce.h"

/* Coming nearer is faster than 4 rad/s^2: a load of fifty times the motor's inertia at rated torque
 * still is. The mean of a quarter of a second keeps the ripple of an estimate out. */
#define SPEED_NEARER_S     0.25f
#define SPEED_NEARER_RAD_S 1.0f
/* A take-over is as slow as its torque turns the inertia, and its frequency has no ripple (zh
 * envelope: run 369 of 3344238633, with 88 times the motor's inertia). */
#define SPEED_TAKEN_OVER_RAD_S 0.01f
#define SPEED_WARNING_S        0.15f
/* On the way there: a load or a ramp beyond the torque, or a large inertia. All torque in use at
 * high speed: half the distance too, where a sag of the link by 30 % keeps the shaft for .8 to .9 s
 * without coming nearer. */
#define SPEED_APPROACH_S    0.9f
#define SPEED_UNEXPLAINED_S 0.8f /* without a limit of torque that would explain it */
/* Of the reference: 7 % are allowed. A sag of the link by 30 % takes 6.7 % at twice rated speed. */
#define SPEED_DEVIATION_PU 0.07f
#define SPEED_FARTHEST_PU  4.0f
/* With all torque in use half of it, for the whole time: a sound drive is on its way back. One that
 * is lost may stay there (37 kW, zh envelope: 20 s). */
#define SPEED_ALL_TORQUE_PU 0.5f
/* All torque in use and a field slower than this: the estimate may be lost there without a sign, so
 * any deviation counts (zh envelope: a shaft ran away beside an estimate that followed). */
#define SPEED_STANDING_RAD_S 6.0f
/* Electrical. Beside a faster ramp time counts once towards unexplained_s, however far off: it is
 * the reference that goes away, and a load that sticks waits for the integrator (zh envelope, 265
 * of 4236589842). Towards deviation_s it counts as ever. */
#define SPEED_RAMP_RAD_S2 40.0f
/* Time that heals over time that counts. A rotor that was lost and caught again may be lost again:
 * that heals slowly. */
#define SPEED_HEALS_PU        0.5f
#define SPEED_FOLLOWS_PU      0.05f
#define SPEED_UNKNOWN_AFTER_S 0.05f
#define SPEED_OVER_SCHEDULES  4u
#define SPEED_MAX_SCHEDULES   1e6f

bool speed_guard_init(speed_guard_config_t *cfg, const speed_guard_params_t *params,
                      const motor_model_t *motor, float schedule_s)
{
    if (!ALL_POSITIVE(params->deviation_rad_s, params->deviation_s, params->unknown_s,
                      params->over_speed_rad_s, params->lambda_nominal_Wb, schedule_s) ||
        !nonnegativef(params->count_V) ||
        !(maxf(params->deviation_s, params->unknown_s) < SPEED_MAX_SCHEDULES * schedule_s)) {
        return false;
    }
    *cfg = (speed_guard_config_t){
        .deviation_rad_s = params->deviation_rad_s,
        .over_speed_rad_s = params->over_speed_rad_s,
        .deviation_s = params->deviation_s,
        .unexplained_s = minf(SPEED_UNEXPLAINED_S, params->deviation_s),
        .warning_s = minf(SPEED_WARNING_S, params->deviation_s),
        .approach_s = minf(SPEED_APPROACH_S, params->deviation_s),
        .schedule_s = schedule_s,
        .nearer_share = schedule_s / (schedule_s + SPEED_NEARER_S),
        .unknown_s = params->unknown_s,
    };
    rotor_check_init(&cfg->rotor, motor, params->lambda_nominal_Wb, params->count_V, schedule_s);
    return true;
}

/* Time on, or back; it stays at its limit. */
static float passed(float time_s, float step_s, float most_s)
{
    return clampf(time_s + step_s, 0.0f, most_s);
}

/* How far off is away. */
static float away_pu(const speed_guard_in_t *in)
{
    if (!in->at_limit || (in->basis != SPEED_BASIS_ESTIMATE)) {
        return 1.0f;
    }
    return (absf(in->omega_s_rad_s) >= SPEED_STANDING_RAD_S) ? SPEED_ALL_TORQUE_PU : 0.0f;
}

/* Away from the reference, and not on the way to it. A NaN is away. */
static bool deviates(const speed_guard_config_t *cfg, speed_guard_state_t *st,
                     const speed_guard_in_t *in, float far_pu)
{
    const float moved_rad_s = in->omega_rad_s - st->omega_slow_rad_s;
    st->omega_slow_rad_s = is_finite(moved_rad_s)
                               ? (st->omega_slow_rad_s + cfg->nearer_share * moved_rad_s)
                               : in->omega_rad_s; /* a NaN; the next number replaces it */
    const float nearer_rad_s = (far_pu < 0.0f) ? -moved_rad_s : moved_rad_s;
    const float least_rad_s =
        (in->basis == SPEED_BASIS_TAKEN_OVER) ? SPEED_TAKEN_OVER_RAD_S : SPEED_NEARER_RAD_S;
    return !(absf(far_pu) <= away_pu(in)) && !(nearer_rad_s > least_rad_s);
}

/* Half the limit counts as in deviates. At high speed only the whole limit is told at once: a sag
 * of the link passes. In V/f the current limit holds the frequency back, so a speed that only
 * approaches counts too. */
static bool stays_away(const speed_guard_config_t *cfg, const speed_guard_in_t *in, bool far,
                       bool wrong)
{
    const bool slow_ref = SPEED_DEVIATION_PU * absf(in->omega_ref_rad_s) < cfg->deviation_rad_s;
    return (wrong && (far || slow_ref)) || (far && (in->basis == SPEED_BASIS_VOLTAGE));
}

/* True when the speed stays away from its reference although the torque is at its limit. With an
 * estimate, or in a take-over, it is told after the longer approach_s as well, whatever the torque:
 * of a speed that only approaches, too, and at high speed of half the limit with all torque in use.
 */
static bool lacks_torque(const speed_guard_config_t *cfg, speed_guard_state_t *st,
                         const speed_guard_in_t *in, float far_pu, bool wrong)
{
    const bool far = !(absf(far_pu) <= 1.0f);
    const bool away = stays_away(cfg, in, far, wrong);
    const bool slow = (far || wrong) && (in->basis <= SPEED_BASIS_TAKEN_OVER);
    const float one_s = cfg->schedule_s;
    st->away_s = passed(st->away_s, away ? one_s : -(SPEED_HEALS_PU * one_s), cfg->warning_s);
    st->approach_s = passed(st->approach_s, slow ? one_s : -one_s, cfg->approach_s);
    return (away && in->at_limit && (st->away_s >= cfg->warning_s)) ||
           (st->approach_s >= cfg->approach_s);
}

static bool ramps(const speed_guard_config_t *cfg, speed_guard_state_t *st, float omega_ref_rad_s)
{
    const float moved_rad_s = omega_ref_rad_s - st->omega_ref_rad_s;
    st->omega_ref_rad_s = omega_ref_rad_s;
    return absf(moved_rad_s) > SPEED_RAMP_RAD_S2 * cfg->schedule_s;
}

/* Torque at its limit explains a deviation: that only heals. */
static float unexplained_step_s(const speed_guard_in_t *in, float step_s)
{
    return in->at_limit ? minf(step_s, 0.0f) : step_s;
}

static uint32_t look_at_deviation(const speed_guard_config_t *cfg, speed_guard_state_t *st,
                                  const speed_guard_in_t *in)
{
    const float allowed_rad_s =
        maxf(cfg->deviation_rad_s, SPEED_DEVIATION_PU * absf(in->omega_ref_rad_s));
    const float far_pu = (in->omega_ref_rad_s - in->omega_rad_s) / allowed_rad_s;
    const bool ramp = ramps(cfg, st, in->omega_ref_rad_s);
    const bool wrong = deviates(cfg, st, in, far_pu);
    /* Neither away nor lately so: nothing to count. (unexplained_s is never above deviation_s.) */
    if (!wrong && (absf(far_pu) <= 1.0f) &&
        (st->deviation_s + st->away_s + st->approach_s <= 0.0f)) {
        return 0u;
    }
    const float one_s = cfg->schedule_s * (wrong ? 1.0f : -SPEED_HEALS_PU);
    const float step_s = wrong ? (one_s * clampf(absf(far_pu), 1.0f, SPEED_FARTHEST_PU)) : one_s;
    st->deviation_s = passed(st->deviation_s, step_s, cfg->deviation_s);
    st->unexplained_s = passed(st->unexplained_s, unexplained_step_s(in, ramp ? one_s : step_s),
                               cfg->unexplained_s);
    const bool late =
        (st->deviation_s >= cfg->deviation_s) || (st->unexplained_s >= cfg->unexplained_s);
    const bool told = lacks_torque(cfg, st, in, far_pu, wrong);
    return (late ? FAULT_SPEED_DEVIATION : 0u) | (told ? FAULT_DERATED : 0u);
}

static uint32_t look_at_frequency(const speed_guard_config_t *cfg, speed_guard_state_t *st,
                                  const speed_guard_in_t *in)
{
    const bool wrong = !(absf(in->omega_s_rad_s) <= cfg->over_speed_rad_s);
    st->frequency = debounce_count(st->frequency, wrong, SPEED_OVER_SCHEDULES);
    return debounce_elapsed(st->frequency, SPEED_OVER_SCHEDULES) ? FAULT_OVER_SPEED : 0u;
}

/* An imposed frequency is the speed only while the rotor is seen to follow it. */
static rotor_check_t seen_rotor(const speed_guard_config_t *cfg, speed_guard_state_t *st,
                                const speed_guard_in_t *in)
{
    if (in->basis == SPEED_BASIS_NOBODY) {
        return ROTOR_NOT_SEEN;
    }
    if (in->basis >= SPEED_BASIS_TAKEN_OVER) {
        return rotor_check_step(&cfg->rotor, &st->rotor, &in->rotor);
    }
    return ROTOR_FOLLOWS; /* estimated, or taken as 0 */
}

/* Doubt is told and nothing else: an estimate may come back from it. */
static uint32_t look_at_rotor(const speed_guard_config_t *cfg, speed_guard_state_t *st,
                              const speed_guard_in_t *in)
{
    const rotor_check_t rotor = seen_rotor(cfg, st, in);
    const bool lost = rotor == ROTOR_LOST;
    st->speed_unknown = in->in_doubt;
    /* Neither lost nor lately so: nothing to count. */
    if ((rotor == ROTOR_FOLLOWS) && (st->lost_s + st->unknown_s <= 0.0f)) {
        return 0u;
    }
    const float one_s = cfg->schedule_s;
    st->lost_s = passed(st->lost_s, one_s * (lost ? 1.0f : -SPEED_FOLLOWS_PU), cfg->unexplained_s);
    const bool unseen =
        (rotor == ROTOR_NOT_SEEN) || (lost && (st->lost_s >= SPEED_UNKNOWN_AFTER_S));
    st->speed_unknown = st->speed_unknown || unseen;
    st->unknown_s =
        passed(st->unknown_s, unseen ? one_s : -(SPEED_HEALS_PU * one_s), cfg->unknown_s);
    const bool late = (st->lost_s >= cfg->unexplained_s) || (st->unknown_s >= cfg->unknown_s);
    return late ? FAULT_SPEED_DEVIATION : 0u;
}

uint32_t speed_guard_look(const speed_guard_config_t *cfg, speed_guard_state_t *st,
                          const speed_guard_in_t *in)
{
    if (in->basis == SPEED_BASIS_NONE) {
        *st = (speed_guard_state_t){0};
        return 0u;
    }
    if (in->basis != st->basis) {
        st->basis = in->basis;
        st->omega_slow_rad_s = in->omega_rad_s;
        st->rotor = (rotor_check_state_t){0};
    }
    const bool turns = in->premagnetising && rotor_turns(&cfg->rotor, &st->rotor, &in->rotor);
    return look_at_deviation(cfg, st, in) | look_at_frequency(cfg, st, in) |
           look_at_rotor(cfg, st, in) | (turns ? FAULT_FLYING_START : 0u);
}
