#include "commissioning.h"

/* Direct currents for Rs: the larger heats phase u like rated current, and no phase current of the
 * smaller one is near the threshold of the inverter's error. */
#define RS_HIGH_PU 0.7f
#define RS_LOW_PU  0.35f
/* Guessed from a nameplate it is right within two or three times. */
#define RS_RATIO 10.0f

/* Where the curve begins: every leg current is already beyond the inverter's threshold. */
#define LOWEST_PU 0.0625f

/* Where the tones are: below the knee of most motors, every leg current well beyond the threshold.
 */
#define BIAS_PU  0.4f
#define SWING_PU 0.1f

/* Fast enough that the rotor's flux stands still, slow enough for the sampling. */
#define FAST_TURN_PERIODS 16.0f
#define FAST_TURNS        512u
#define FAST_QUIET_TURNS  64u
/* The rotor's resistance shows best where it equals the reactance of M; twice the rated slip is
 * near that at BIAS_PU, and the bars still conduct evenly. */
#define SLOW_PER_SLIP    2.0f
#define SLOW_TURNS       8u
#define SLOW_QUIET_TURNS 2u

/* Last part of a level, averaged; more periods than floats can add up are not taken. */
#define AVERAGE_SHARE       0.2f
#define AVERAGE_MAX_PERIODS 8192u
#define LEVEL_MIN_PERIODS   100.0f
#define LEVEL_MAX_PERIODS   1000000.0f

/* A current further off than this share of what was asked is not the asked one. */
#define FOLLOW_PU 0.1f
/* The voltage may still change within the average by this share of the level's flux over its
 * length: six time constants pass, five do not. */
#define UNSETTLED_PU 0.03f
/* Leakage over the inductance of the first level, Rr over Rs: no motor is outside. */
#define LEAKAGE_MAX_PU 0.5f
#define ROTOR_MAX_PU   10.0f

bool commissioning_init(commissioning_config_t *cfg, const params_t *params)
{
    const float periods = params->rs_level_s / params->period_s;
    if (!ALL_POSITIVE(params->com_rated_A, params->period_s, params->Rs_ohm) ||
        !(periods >= LEVEL_MIN_PERIODS) || !(periods <= LEVEL_MAX_PERIODS)) {
        return false;
    }
    const uint32_t level = (uint32_t)periods;
    const uint32_t share = (uint32_t)(AVERAGE_SHARE * periods);
    const uint32_t half = (share < AVERAGE_MAX_PERIODS ? share : AVERAGE_MAX_PERIODS) / 2u;
    *cfg = (commissioning_config_t){
        .level_step_A = params->com_rated_A / (float)COMMISSIONING_LEVELS,
        .bias_A = BIAS_PU * params->com_rated_A,
        .swing_A = SWING_PU * params->com_rated_A,
        .lowest_A = LOWEST_PU * params->com_rated_A,
        .period_s = params->period_s,
        .level_periods = level,
        .average_periods = 2u * half,
        .rs = {.level = {{[RS_LEVEL_HIGH] = RS_HIGH_PU * params->com_rated_A,
                          [RS_LEVEL_LOW] = RS_LOW_PU * params->com_rated_A}},
               .level_periods = level,
               .average_periods = 2u * half,
               .bias = 1.0f,
               .Rs_min_ohm = params->Rs_ohm / RS_RATIO,
               .Rs_max_ohm = params->Rs_ohm * RS_RATIO}};
    const float fast_Hz = 1.0f / (FAST_TURN_PERIODS * params->period_s);
    return tone_init(&cfg->fast, fast_Hz, FAST_QUIET_TURNS, FAST_TURNS, params->period_s) &&
           tone_init(&cfg->slow, SLOW_PER_SLIP * params->com_slip_Hz, SLOW_QUIET_TURNS, SLOW_TURNS,
                     params->period_s);
}

static void next_stage(commissioning_state_t *st, commissioning_stage_t stage)
{
    st->stage = stage;
    st->periods = 0u;
    st->sum_V = 0.0f;
    st->first_V = 0.0f;
    st->last_V = 0.0f;
    st->i_sum_A = 0.0f;
    st->i_end_A = 0.0f;
    st->across_A = 0.0f;
    st->tone = (tone_state_t){0};
}

/* The interval that has just ended. */
typedef struct {
    ab_t i_A;      /* at its end */
    float i_mid_A; /* along the axis, in its middle */
    float u_V;     /* likewise */
} interval_t;

/* Does no current flow across the axis, and is the mean along it the one that was asked for? With v
 * or w open the controllers of both fight for the one current that is left. */
static bool follows(commissioning_state_t *st, float mean_A, float asked_A, float periods)
{
    if (!(absf(st->across_A) <= periods * FOLLOW_PU * asked_A)) {
        st->refusal = COMMISSIONING_OPEN_PHASE;
    } else if (!(absf(mean_A - asked_A) <= FOLLOW_PU * asked_A)) {
        st->refusal = COMMISSIONING_NO_CURRENT;
    } else {
        return true;
    }
    return false;
}

static void step_rs(const commissioning_config_t *cfg, commissioning_state_t *st,
                    const interval_t *ended, commissioning_out_t *out)
{
    const rs_measurement_in_t in = {
        .i_A = ended->i_A.alpha, .u_V = ended->u_V, .u_duty_V = ended->u_V};
    const rs_measurement_out_t rs = rs_measurement_step(&cfg->rs, &st->rs, &in);
    const float n = (float)cfg->average_periods;
    out->i_ref_A = rs.i_ref_A;
    if ((st->periods < cfg->level_periods) &&
        (st->periods >= (cfg->level_periods - cfg->average_periods))) {
        st->across_A += ended->i_A.beta;
    }
    st->periods++;
    if ((rs.status == RS_MEASUREMENT_BUSY) ||
        !follows(st, st->rs.level[RS_LEVEL_HIGH].i_A / n, cfg->rs.level.A[RS_LEVEL_HIGH], n)) {
        return;
    }
    if (rs.status == RS_MEASUREMENT_REFUSED) {
        st->refusal = COMMISSIONING_RS;
        return;
    }
    st->result.Rs_ohm = rs.Rs_ohm;
    st->result.lost_V = rs.lost_V;
    next_stage(st, COMMISSIONING_STAGE_LOWEST);
}

/* Flux between two settled currents: between them u - Rs i is on the straight line that joins both,
 * but for the flux that changes. */
static bool level_flux(const commissioning_config_t *cfg, commissioning_state_t *st, float level_A,
                       float end_V, float end_A)
{
    const float n = (float)cfg->average_periods;
    const float line_V = end_V * st->i_sum_A / end_A;
    const float change_Wb = cfg->period_s * (st->sum_V - line_V);
    const float drift_V = 2.0f * (st->first_V - st->last_V) / n;
    const float drift_Wb = drift_V * cfg->period_s * (float)cfg->level_periods;
    if (!follows(st, st->settled_A + end_A, level_A, n)) {
        return false;
    }
    if (!positivef(change_Wb)) {
        st->refusal = COMMISSIONING_CURVE;
        return false;
    }
    if (!(absf(drift_Wb) <= UNSETTLED_PU * change_Wb)) {
        st->refusal = COMMISSIONING_UNSETTLED;
        return false;
    }
    const float before_Wb =
        (st->level > 0u) ? st->result.flux_Wb[st->level - 1u] : (change_Wb * st->settled_A / end_A);
    st->result.flux_Wb[st->level] = before_Wb + change_Wb;
    return true;
}

/* End of the lowest current, or of a level of the curve. */
static void end_level(const commissioning_config_t *cfg, commissioning_state_t *st, float level_A)
{
    const float n = (float)cfg->average_periods;
    const float end_V = (st->first_V + st->last_V) / n;
    const float end_A = st->i_end_A / n;
    if (st->stage == COMMISSIONING_STAGE_CURVE) {
        if (!level_flux(cfg, st, level_A, end_V, end_A)) {
            return;
        }
        st->result.level_A[st->level] = st->settled_A + end_A;
        st->result.error_V[st->level] = st->settled_V + end_V;
        st->level++;
    }
    st->settled_V += end_V;
    st->settled_A += end_A;
    next_stage(st, (st->level < COMMISSIONING_LEVELS) ? COMMISSIONING_STAGE_CURVE
                                                      : COMMISSIONING_STAGE_BIAS);
}

static void step_level(const commissioning_config_t *cfg, commissioning_state_t *st,
                       const interval_t *ended, commissioning_out_t *out)
{
    const float level_A = (st->stage == COMMISSIONING_STAGE_LOWEST)
                              ? cfg->lowest_A
                              : ((float)(st->level + 1u) * cfg->level_step_A);
    const float change_A = ended->i_mid_A - st->settled_A;
    const float change_V = (ended->u_V - st->result.Rs_ohm * ended->i_mid_A) - st->settled_V;
    const uint32_t left = cfg->level_periods - st->periods;
    out->i_ref_A = level_A;
    st->sum_V += change_V;
    st->i_sum_A += change_A;
    if (left <= cfg->average_periods) {
        const bool first = (2u * left) > cfg->average_periods;
        st->first_V += first ? change_V : 0.0f;
        st->last_V += first ? 0.0f : change_V;
        st->i_end_A += change_A;
        st->across_A += ended->i_A.beta;
    }
    st->periods++;
    if (left <= 1u) {
        end_level(cfg, st, level_A);
    }
}

/* sigma Ls: the rotor's flux stands still, its resistance adds to the real part alone. */
static void end_fast(const commissioning_config_t *cfg, commissioning_state_t *st)
{
    const float first_H = st->result.flux_Wb[0] / st->result.level_A[0];
    st->result.sigma_Ls_H = tone_impedance_ohm(&st->tone).beta / cfg->fast.omega_rad_s;
    if (!positivef(st->result.sigma_Ls_H) || !(st->result.sigma_Ls_H <= LEAKAGE_MAX_PU * first_H)) {
        st->refusal = COMMISSIONING_LEAKAGE;
        return;
    }
    next_stage(st, COMMISSIONING_STAGE_SLOW);
}

/* What is left of Z is j w M^2/Lr parallel to (M/Lr)^2 Rr: its inverse shows each alone. */
static void end_slow(const commissioning_config_t *cfg, commissioning_state_t *st)
{
    const ab_t stator_ohm = {st->result.Rs_ohm, cfg->slow.omega_rad_s * st->result.sigma_Ls_H};
    const ab_t z_ohm = ab_sub(tone_impedance_ohm(&st->tone), stator_ohm);
    const float z2 = ab_norm2(z_ohm);
    st->result.Rr_gamma_ohm = z2 / z_ohm.alpha;
    st->result.M_gamma_H = z2 / (z_ohm.beta * cfg->slow.omega_rad_s);
    st->result.bias_A = cfg->bias_A;
    const float most_H = 2.0f * st->result.flux_Wb[0] / st->result.level_A[0];
    if (!ALL_POSITIVE(st->result.Rr_gamma_ohm, st->result.M_gamma_H) ||
        !(st->result.Rr_gamma_ohm <= ROTOR_MAX_PU * st->result.Rs_ohm) ||
        !(st->result.M_gamma_H <= most_H)) {
        st->refusal = COMMISSIONING_ROTOR;
        return;
    }
    next_stage(st, COMMISSIONING_STAGE_END);
}

static void step_tone(const commissioning_config_t *cfg, commissioning_state_t *st,
                      const interval_t *ended, commissioning_out_t *out)
{
    const bool fast = st->stage == COMMISSIONING_STAGE_FAST;
    const bool all =
        tone_step(fast ? &cfg->fast : &cfg->slow, &st->tone, ended->i_mid_A, ended->u_V);
    out->i_ref_A = cfg->bias_A + cfg->swing_A * st->tone.unit.alpha;
    if (all && fast) {
        end_fast(cfg, st);
    } else if (all) {
        end_slow(cfg, st);
    } else {
        /* goes on */
    }
}

/* A direct current for the length of a level. */
static void wait(const commissioning_config_t *cfg, commissioning_state_t *st,
                 commissioning_stage_t next)
{
    st->periods++;
    if (st->periods >= cfg->level_periods) {
        next_stage(st, next);
    }
}

commissioning_out_t commissioning_step(const commissioning_config_t *cfg, commissioning_state_t *st,
                                       const commissioning_in_t *in)
{
    commissioning_out_t out = {.status = COMMISSIONING_BUSY};
    const interval_t ended = {
        .i_A = in->i_A, .i_mid_A = 0.5f * (st->i_before_A + in->i_A.alpha), .u_V = st->u_coming_V};
    st->u_coming_V = in->u_coming_V;
    st->i_before_A = in->i_A.alpha;

    if (st->refusal != COMMISSIONING_NOT_REFUSED) {
        out.status = COMMISSIONING_REFUSED;
        return out;
    }
    switch (st->stage) {
    case COMMISSIONING_STAGE_RS:
        step_rs(cfg, st, &ended, &out);
        break;
    case COMMISSIONING_STAGE_LOWEST:
    case COMMISSIONING_STAGE_CURVE:
        step_level(cfg, st, &ended, &out);
        break;
    case COMMISSIONING_STAGE_BIAS:
        out.i_ref_A = cfg->bias_A;
        wait(cfg, st, COMMISSIONING_STAGE_FAST);
        break;
    case COMMISSIONING_STAGE_FAST:
    case COMMISSIONING_STAGE_SLOW:
        step_tone(cfg, st, &ended, &out);
        break;
    case COMMISSIONING_STAGE_END:
    default:
        out.status = COMMISSIONING_DONE;
        break;
    }
    return out;
}
