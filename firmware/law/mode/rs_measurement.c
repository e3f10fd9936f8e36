#include "rs_measurement.h"

/* Sum of the three legs' signs as a vector along u: Clarke of (1, -1, -1). */
#define RS_LEGS_TO_ALPHA (2.0f * NUM_SQRT_2_3)

/* Current that has to be there for a result: an open phase or a tripped supply has none. */
#define RS_CURRENT_SHARE 0.5f

/* Least share of the loss at the small current: noise is no curve. */
#define RS_SHARE_MIN 0.05f
#define RS_TINY_V    1e-6f

#define RS_MAX_PERIODS 1000000.0f

/* Float sums: the difference of 8192 samples of some 8 V is right to .1 % (100 000: to 1 %, half
 * the bias). */
#define RS_AVERAGE_MAX_PERIODS 8192.0f

static bool params_valid(const rs_measurement_params_t *p, float Rs_nameplate_ohm, float period_s)
{
    const bool times = (p->average_s >= period_s) && (p->average_s <= p->level_s) &&
                       (p->level_s <= RS_MAX_PERIODS * period_s) &&
                       (p->average_s <= RS_AVERAGE_MAX_PERIODS * period_s);
    return times && (p->low_A < p->high_A) && (p->small_A < p->low_A) && (p->ratio_max > 1.0f) &&
           ALL_POSITIVE(p->low_A, p->high_A, p->bias, p->ratio_max, Rs_nameplate_ohm, period_s);
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
        .high_A = params->high_A,
        .low_A = params->low_A,
        .small_A = params->small_A,
        .level_periods = (uint32_t)(params->level_s / period_s + 0.5f),
        .average_periods = (uint32_t)(params->average_s / period_s + 0.5f),
        .bias = params->bias,
        .Rs_min_ohm = Rs_nameplate_ohm / params->ratio_max,
        .Rs_max_ohm = Rs_nameplate_ohm * params->ratio_max,
    };
    return true;
}

static void add(rs_measurement_sums_t *sums, const rs_measurement_in_t *in)
{
    sums->i_A += in->i_A;
    sums->u_V += in->u_V;
    sums->u_duty_V += in->u_duty_V;
}

/* The leg current from which on the loss is whole. Leg u carries x, the others half of it: of the
 * whole loss there is .75 x/threshold. A threshold below x comes out as .75 x at least. */
COLD static float threshold_A(const rs_measurement_config_t *cfg, const rs_measurement_state_t *st,
                              float Rs_ohm, float lost_V)
{
    const float whole_V = RS_LEGS_TO_ALPHA * (float)cfg->average_periods * lost_V;
    const float here_V = st->small.u_duty_V - Rs_ohm * st->small.i_A;
    const float x_A = NUM_SQRT_2_3 * st->small.i_A / (float)cfg->average_periods;
    const float found_A = 0.75f * x_A * whole_V / maxf(here_V, RS_SHARE_MIN * whole_V + RS_TINY_V);
    /* At the lower level it is whole in every leg. */
    return minf(found_A, 0.5f * NUM_SQRT_2_3 * cfg->low_A);
}

/* All levels are averaged over the same time, so that sums stand for averages. */
COLD static rs_measurement_out_t result(const rs_measurement_config_t *cfg,
                                        const rs_measurement_state_t *st)
{
    const float n = (float)cfg->average_periods;
    const float di_A = st->high.i_A - st->low.i_A;
    rs_measurement_out_t out = {.status = RS_MEASUREMENT_REFUSED};
    if (!(di_A >= RS_CURRENT_SHARE * n * (cfg->high_A - cfg->low_A))) {
        return out;
    }
    out.Rs_ohm = (st->high.u_V - st->low.u_V) / di_A;
    if (!(out.Rs_ohm >= cfg->Rs_min_ohm) || !(out.Rs_ohm <= cfg->Rs_max_ohm)) {
        return out;
    }
    /* At the higher level, where the error curve is flat. */
    const float lost_alpha_V = (st->high.u_duty_V - out.Rs_ohm * st->high.i_A) / n;
    out.lost_V = maxf(lost_alpha_V / RS_LEGS_TO_ALPHA, 0.0f);
    out.threshold_A = threshold_A(cfg, st, out.Rs_ohm, out.lost_V);
    out.Rs_ohm *= cfg->bias;
    out.status = RS_MEASUREMENT_DONE;
    return out;
}

rs_measurement_out_t rs_measurement_step(const rs_measurement_config_t *cfg,
                                         rs_measurement_state_t *st, const rs_measurement_in_t *in)
{
    const uint32_t level = cfg->level_periods;
    const uint32_t end = ((cfg->small_A > 0.0f) ? 3u : 2u) * level;
    const uint32_t k = st->periods;
    if ((level == 0u) || (k > end)) {
        return (rs_measurement_out_t){.status = RS_MEASUREMENT_IDLE};
    }
    if (k == end) {
        const rs_measurement_out_t out = result(cfg, st);
        if (out.status == RS_MEASUREMENT_DONE) {
            st->periods++;
        }
        return out;
    }
    rs_measurement_sums_t *sums = &st->small;
    float i_ref_A = cfg->small_A;
    if (k < level) {
        sums = &st->high;
        i_ref_A = cfg->high_A;
    } else if (k >= (end - level)) {
        sums = &st->low;
        i_ref_A = cfg->low_A;
    } else {
        /* The small one. */
    }
    if ((k % level) >= (level - cfg->average_periods)) {
        add(sums, in);
    }
    st->periods++;
    return (rs_measurement_out_t){.status = RS_MEASUREMENT_BUSY, .i_ref_A = i_ref_A};
}
