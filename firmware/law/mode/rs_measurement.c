#include "rs_measurement.h"

/* Sum of the three legs' signs as a vector along u: Clarke of (1, -1, -1). */
#define RS_LEGS_TO_ALPHA (2.0f * NUM_SQRT_2_3)

#define RS_CURRENT_SHARE 0.5f    /* of the current's step: an open phase or no supply gives none */
#define RS_TINY_V        1e-6f   /* no division by 0 */
#define RS_LOW_PU        0.125f  /* of the largest Rs: less is a voltage that stands */
#define RS_TAIL_MIN_PU   0.0025f /* c/i of the high level over its voltage: less is noise */

#define RS_MAX_PERIODS 1000000.0f

/* Amplitude over the high level. A tooth covers about four steps of a 10-bit voltage sensor. */
#define RS_DITHER_PU    0.1f
#define RS_DITHER_TEETH 4.0f /* in an average */

/* The slot in which the small current is reversed, and bend begins: with the next one a window of
 * the guard's EMF begins (current_fit.h). A window with both signs would tell nothing of the legs'
 * loss, and coarse words that stand still would look frozen. So would they behind a window that
 * ends while the current is on its way to bend: what is missing of the change is taken for EMF. */
#define RS_REVERSAL_SLOT (SLOT_GUARD_CURRENT - 1u)

/* Saturation lets the measured Rr fall from the low level to the high one. This share of the fall
 * is added to that of the low level; chosen on motors of the envelope. */
#define RS_BENT 0.6f

/* Float sums: the difference of 8192 samples of some 8 V is right to .1 % (100 000: to 1 %, half
 * the bias). */
#define RS_AVERAGE_MAX_PERIODS 8192.0f

static bool params_valid(const rs_measurement_params_t *p, float Rs_nameplate_ohm, float period_s)
{
    const float *level_A = p->level.A;
    const bool levels = (level_A[RS_LEVEL_LOW] < level_A[RS_LEVEL_HIGH]) &&
                        (level_A[RS_LEVEL_BEND] < level_A[RS_LEVEL_LOW]) &&
                        (level_A[RS_LEVEL_SMALL] < level_A[RS_LEVEL_BEND]);
    const bool times = (p->average_s >= period_s) && (p->average_s <= p->level_s) &&
                       (p->level_s <= RS_MAX_PERIODS * period_s) &&
                       (p->average_s <= RS_AVERAGE_MAX_PERIODS * period_s);
    return levels && times && (p->ratio_max > 1.0f) &&
           ALL_POSITIVE(level_A[RS_LEVEL_HIGH], level_A[RS_LEVEL_LOW], p->bias, p->ratio_max,
                        Rs_nameplate_ohm, period_s);
}

bool rs_measurement_init(rs_measurement_config_t *cfg, const rs_measurement_params_t *params,
                         float Rs_nameplate_ohm, float period_s)
{
    *cfg = (rs_measurement_config_t){0};
    if (!params->enable) {
        return true;
    }
    if (!params_valid(params, Rs_nameplate_ohm, period_s)) {
        return false;
    }
    *cfg = (rs_measurement_config_t){
        .level = params->level,
        .curve = params->level.A[RS_LEVEL_SMALL] > 0.0f,
        .by_duty = params->by_duty,
        .level_periods = (uint32_t)(params->level_s / period_s + 0.5f),
        .average_periods = (uint32_t)(params->average_s / period_s + 0.5f),
        .dither_A = RS_DITHER_PU * params->level.A[RS_LEVEL_HIGH],
        .bias = params->bias,
        .Rs_min_ohm = Rs_nameplate_ohm / params->ratio_max,
        .Rs_max_ohm = Rs_nameplate_ohm * params->ratio_max,
    };
    cfg->dither_turns = RS_DITHER_TEETH / (float)cfg->average_periods;
    return true;
}

static void add(const rs_measurement_config_t *cfg, rs_measurement_state_t *st, uint32_t here,
                const rs_measurement_in_t *in)
{
    rs_measurement_sums_t *sums = &st->level[here];
    const float x_A = 0.5f * (in->i_A + st->i_before_A) - cfg->level.A[here];
    sums->i_A += in->i_A;
    sums->u_V += in->u_V;
    sums->u_duty_V += in->u_duty_V;
    sums->x_A += x_A;
    sums->xx_A2 += x_A * x_A;
    sums->xu_VA += x_A * in->u_duty_V;
}

/* Of the observer's voltage, between two levels. */
static float between_ohm(const rs_measurement_sums_t *high, const rs_measurement_sums_t *low)
{
    return (high->u_V - low->u_V) / (high->i_A - low->i_A);
}

/* Slope of the duties' voltage between two levels. */
static float slope_ohm(const rs_measurement_sums_t *high, const rs_measurement_sums_t *low)
{
    return (high->u_duty_V - low->u_duty_V) / (high->i_A - low->i_A);
}

/* Slope of the duties' voltage within the teeth of a level. */
COLD static float tooth_ohm(const rs_measurement_config_t *cfg, const rs_measurement_sums_t *sums)
{
    const float x_A = sums->x_A / (float)cfg->average_periods;
    return (sums->xu_VA - x_A * sums->u_duty_V) / (sums->xx_A2 - x_A * sums->x_A);
}

/* c/(i j) by the teeth of two levels. */
COLD static float toothed_tail_ohm(const rs_measurement_config_t *cfg,
                                   const rs_measurement_sums_t *upper,
                                   const rs_measurement_sums_t *lower)
{
    const float i_A = upper->i_A;
    const float j_A = lower->i_A;
    return (tooth_ohm(cfg, lower) - tooth_ohm(cfg, upper)) * i_A * j_A /
           ((i_A - j_A) * (i_A + j_A));
}

/* c/i of the high level in u = Rs i + u_0 - c/i. Between i and j the slope is Rs + c/(i j), within
 * the teeth of a level Rs + Rr' + c/i^2. The smaller c counts: where the lowest level is in the
 * bend of another curve, the levels show a c that the teeth of the upper ones do not. Without the
 * lowest level, whose sums are zero then, there is none. */
static float bent_V(const rs_measurement_config_t *cfg, const rs_measurement_state_t *st)
{
    const rs_measurement_sums_t *bend = &st->level[RS_LEVEL_BEND];
    const rs_measurement_sums_t *high = &st->level[RS_LEVEL_HIGH];
    const rs_measurement_sums_t *low = &st->level[RS_LEVEL_LOW];
    const float bent_ohm = slope_ohm(low, bend) - slope_ohm(high, low);
    const float levels_ohm = bent_ohm * bend->i_A / (high->i_A - bend->i_A);
    const float c_V = low->i_A * minf(levels_ohm, toothed_tail_ohm(cfg, high, low));
    return (c_V > RS_TAIL_MIN_PU * absf(high->u_duty_V)) ? c_V : 0.0f;
}

/* The leg current at which the line through zero ends. Below it the legs act as a resistance
 * lost_V/line: the slope at the small current, less the slope in the low level's teeth. A line
 * below .82 of the small current comes out too long, as about .61 of it at least. With a
 * capacitance alone the line is four times the tail, and touches it at half that. Where legs_ohm is
 * not above 0, or not finite, as without the curve: twice the tail, and without a tail none. */
COLD static float threshold_A(const rs_measurement_config_t *cfg, const rs_measurement_state_t *st,
                              const rs_measurement_out_t *out)
{
    const float legs_ohm =
        tooth_ohm(cfg, &st->level[RS_LEVEL_SMALL]) - tooth_ohm(cfg, &st->level[RS_LEVEL_LOW]);
    const float line_A = (legs_ohm > 0.0f) ? (out->lost_V / legs_ohm) : 0.0f;
    /* At the lower level it is whole in every leg. */
    return minf(maxf(line_A - 2.0f * out->tail_A, 2.0f * out->tail_A),
                0.5f * NUM_SQRT_2_3 * cfg->level.A[RS_LEVEL_LOW]);
}

/* The tail bends the slopes: by c/i^2 within the teeth, by c/(i j) between two levels. */
COLD static float rotor_ohm(const rs_measurement_config_t *cfg, const rs_measurement_state_t *st,
                            float c_V)
{
    const rs_measurement_sums_t *high = &st->level[RS_LEVEL_HIGH];
    const rs_measurement_sums_t *low = &st->level[RS_LEVEL_LOW];
    const float stator_ohm = slope_ohm(high, low);
    const float tail_ohm = c_V / low->i_A;
    const float low_ohm =
        tooth_ohm(cfg, low) - stator_ohm - (high->i_A / low->i_A - 1.0f) * tail_ohm;
    const float high_ohm =
        tooth_ohm(cfg, high) - stator_ohm + (1.0f - low->i_A / high->i_A) * tail_ohm;
    return low_ohm + RS_BENT * maxf(low_ohm - high_ohm, 0.0f);
}

/* All levels are averaged over the same time, so that sums stand for averages. */
COLD static rs_measurement_out_t result(const rs_measurement_config_t *cfg,
                                        const rs_measurement_state_t *st)
{
    const rs_measurement_sums_t *high = &st->level[RS_LEVEL_HIGH];
    const rs_measurement_sums_t *low = &st->level[RS_LEVEL_LOW];
    const float n = (float)cfg->average_periods;
    const float di_A = high->i_A - low->i_A;
    rs_measurement_out_t out = {.status = RS_MEASUREMENT_REFUSED};
    if (!(di_A >=
          RS_CURRENT_SHARE * n * (cfg->level.A[RS_LEVEL_HIGH] - cfg->level.A[RS_LEVEL_LOW]))) {
        return out;
    }
    const float c_V = st->bent_V;
    out.Rs_ohm = between_ohm(high, low);
    if (cfg->by_duty) {
        out.Rs_ohm -= c_V / low->i_A;
    }
    if (!(out.Rs_ohm >= cfg->Rs_min_ohm) || !(out.Rs_ohm <= cfg->Rs_max_ohm)) {
        return out;
    }
    /* At the higher level, where the error curve is flat. */
    const float lost_alpha_V = (high->u_duty_V + c_V - out.Rs_ohm * high->i_A) / n;
    out.lost_V = maxf(lost_alpha_V / RS_LEGS_TO_ALPHA, 0.0f);
    /* Leg u has i, the others half of it: their tails add up to three times that of leg u. */
    out.tail_A = c_V * high->i_A / (n * n * (3.0f * out.lost_V + RS_TINY_V));
    out.threshold_A = threshold_A(cfg, st, &out);
    out.tail_A = minf(out.tail_A, 0.5f * out.threshold_A);
    out.Rr_ohm = rotor_ohm(cfg, st, c_V);
    out.Rs_ohm *= cfg->bias;
    out.status = RS_MEASUREMENT_DONE;
    return out;
}

static inline float small_A(const rs_measurement_config_t *cfg, bool negative)
{
    return negative ? -cfg->level.A[RS_LEVEL_SMALL] : cfg->level.A[RS_LEVEL_SMALL];
}

/* Bend begins with a window of the guard; the small current stays until then. */
static inline bool waits(uint32_t here, uint32_t part, uint32_t since)
{
    return (here == (uint32_t)RS_LEVEL_BEND) && (part < since);
}

/* Averaged over a tooth the steps of the ADC do not show. The small current is reversed by every
 * tooth instead, with the first window of the guard that begins in it. part: periods of this level;
 * since: periods since a window began. */
static float wanted_A(const rs_measurement_config_t *cfg, uint32_t here, uint32_t part,
                      uint32_t since)
{
    const bool small = here == (uint32_t)RS_LEVEL_SMALL;
    const uint32_t from = small ? (cfg->level_periods - cfg->average_periods + since) : 0u;
    const float turns = (float)((part >= from) ? (part - from) : 0u) * cfg->dither_turns;
    const uint32_t whole = (uint32_t)turns;
    if (small) {
        return small_A(cfg, (whole & 1u) != 0u);
    }
    return cfg->level.A[here] + (4.0f * absf(turns - (float)whole - 0.5f) - 1.0f) * cfg->dither_A;
}

/* Before the largest current: sensors that read too little make it larger still. The tail of the
 * legs' loss raises the slope of the duties' voltage by c/(i j): with it four of 125 sound drives
 * were refused (zh envelope, 99 of 2528188677); without it 694 come to .975 of the limit at most.
 * Sensors see no such loss, and zero is the level farthest away: .874 at most in 1115 drives, .35
 * at least in 629, nothing if one stands. The duties' voltage showed less than 0 in two of 383. */
COLD static bool resists_oddly(const rs_measurement_config_t *cfg, const rs_measurement_state_t *st)
{
    const rs_measurement_sums_t *low = &st->level[RS_LEVEL_LOW];
    const rs_measurement_sums_t *lower = &st->level[cfg->by_duty ? RS_LEVEL_BEND : RS_LEVEL_SMALL];
    float lower_ohm = between_ohm(low, lower);
    if (!cfg->by_duty) {
        return !(lower_ohm <= cfg->Rs_max_ohm) || !(lower_ohm >= RS_LOW_PU * cfg->Rs_max_ohm);
    }
    const float tail_ohm = toothed_tail_ohm(cfg, low, lower);
    if (tail_ohm > 0.0f) {
        lower_ohm -= tail_ohm;
    }
    return !(lower_ohm <= cfg->Rs_max_ohm);
}

/* A period of a level. */
static float go_on_A(const rs_measurement_config_t *cfg, rs_measurement_state_t *st,
                     const rs_measurement_in_t *in)
{
    const uint32_t level = cfg->level_periods;
    const uint32_t nth = st->periods / level;
    const uint32_t here =
        cfg->curve ? nth : ((nth == 0u) ? (uint32_t)RS_LEVEL_HIGH : (uint32_t)RS_LEVEL_LOW);
    const uint32_t part = st->periods % level;
    if (part >= level - cfg->average_periods) {
        add(cfg, st, here, in);
    }
    const uint32_t since = (in->slot + SLOT_COUNT - RS_REVERSAL_SLOT) % SLOT_COUNT;
    float i_ref_A = wanted_A(cfg, here, part, since);
    if (waits(here, part, since)) {
        i_ref_A = small_A(cfg, st->reversed);
    }
    st->mirror = (i_ref_A < 0.0f) != st->reversed;
    st->reversed = i_ref_A < 0.0f;
    st->i_before_A = in->i_A;
    st->periods++;
    return i_ref_A;
}

COLD rs_measurement_out_t rs_measurement_step(const rs_measurement_config_t *cfg,
                                              rs_measurement_state_t *st,
                                              const rs_measurement_in_t *in)
{
    const uint32_t level = cfg->level_periods;
    const uint32_t end = (cfg->curve ? 4u : 2u) * level;
    rs_measurement_out_t out = {.status = RS_MEASUREMENT_IDLE};
    if ((level == 0u) || (st->periods > end)) {
        return out;
    }
    if (st->periods == end) {
        out = result(cfg, st);
        st->periods += (out.status == RS_MEASUREMENT_DONE) ? 1u : 0u;
    } else if ((st->periods == (uint32_t)RS_LEVEL_HIGH * level) && resists_oddly(cfg, st)) {
        out.status = RS_MEASUREMENT_REFUSED; /* without the curve it ends before */
    } else {
        out.status = RS_MEASUREMENT_BUSY;
        out.i_ref_A = go_on_A(cfg, st, in);
        if (st->periods == end) {
            st->bent_V = bent_V(cfg, st);
        }
    }
    return out;
}

uint32_t rs_measurement_digest(const rs_measurement_state_t *st)
{
    uint32_t digest = 0u;
    for (uint32_t k = 0u; k < (uint32_t)RS_LEVELS; k++) {
        const rs_measurement_sums_t *sums = &st->level[k];
        digest = 3u * (digest + float_bits(sums->i_A)) + 5u * float_bits(sums->u_V) +
                 float_bits(sums->u_duty_V) + 7u * float_bits(sums->x_A) +
                 9u * float_bits(sums->xx_A2) + 11u * float_bits(sums->xu_VA);
    }
    return digest;
}
