#include "measurement.h"

#define ADC_BITS_MIN   8u
#define ADC_BITS_MAX   16u
#define FULL_SCALE_MIN 1e-3f /* A or V: anything outside is a slip of the unit */
#define FULL_SCALE_MAX 1e6f

static bool full_scale_valid(float full_scale)
{
    return (full_scale >= FULL_SCALE_MIN) && (full_scale <= FULL_SCALE_MAX);
}

bool measurement_init(measurement_config_t *cfg, const measurement_params_t *params)
{
    if ((params->adc_bits < ADC_BITS_MIN) || (params->adc_bits > ADC_BITS_MAX)) {
        return false;
    }
    if (!full_scale_valid(params->current_full_scale_A) ||
        !full_scale_valid(params->line_voltage_full_scale_V) ||
        !full_scale_valid(params->dc_link_full_scale_V) || !positivef(params->current_sum_max_A)) {
        return false;
    }
    const uint32_t codes = (uint32_t)1u << params->adc_bits;
    const float mid_counts = 0.5f * (float)codes;
    *cfg = (measurement_config_t){
        .A_per_count = params->current_full_scale_A / mid_counts,
        .V_line_per_count = params->line_voltage_full_scale_V / mid_counts,
        .V_dc_per_count = params->dc_link_full_scale_V / (float)codes,
        .mid_counts = mid_counts,
        .max_counts = codes - 1u,
        .current_sum_max_A = params->current_sum_max_A,
        .swap_vw = params->swap_vw,
    };
    return true;
}

/* Zero wraps round, so one comparison finds both ends of a channel centred at mid. */
static bool at_an_end(uint32_t max_counts, uint32_t word_counts)
{
    return (word_counts - 1u) >= (max_counts - 1u);
}

/* A word above the range is beyond its end as well. */
static bool saturated(uint32_t max_counts, const measurement_in_t *in)
{
    return at_an_end(max_counts, in->i_u_counts) || at_an_end(max_counts, in->i_v_counts) ||
           at_an_end(max_counts, in->i_w_counts) || at_an_end(max_counts, in->u_uv_counts) ||
           at_an_end(max_counts, in->u_vw_counts) || (in->u_dc_counts >= max_counts);
}

/* Some word is at an end. max_counts is all ones: a word above it shows in the union of all bits.
 */
COLD static uint32_t range_flags(uint32_t max_counts, const measurement_in_t *in)
{
    const uint32_t bits = (uint32_t)in->i_u_counts | in->i_v_counts | in->i_w_counts |
                          in->u_uv_counts | in->u_vw_counts | in->u_dc_counts;
    return MEASUREMENT_SATURATED | ((bits > max_counts) ? MEASUREMENT_OUT_OF_RANGE : 0u);
}

/* i - n conj(i): without the negative sequence of unequal gains; n^2 is left. */
static inline ab_t balanced_phases(ab_t i, ab_t n)
{
    return ab_sub(i, ab_mul(n, ab_conj(i)));
}

/* The same, and u + j Im(n) u: line voltages with unequal gains turn the vector as well. Together
 * they scale beta, which is that of one line alone. */
static inline ab_t balanced_lines(ab_t u, ab_t n)
{
    return (ab_t){u.alpha - n.alpha * u.alpha - 2.0f * n.beta * u.beta, u.beta + n.alpha * u.beta};
}

void measurement_step(const measurement_config_t *cfg, const measurement_state_t *st,
                      const measurement_in_t *in, measured_t *out)
{
    const float mid = cfg->mid_counts;
    uvw_t raw_A = {((float)in->i_u_counts - mid) * cfg->A_per_count,
                   ((float)in->i_v_counts - mid) * cfg->A_per_count,
                   ((float)in->i_w_counts - mid) * cfg->A_per_count};
    float uv_V = ((float)in->u_uv_counts - mid) * cfg->V_line_per_count;
    float vw_V = ((float)in->u_vw_counts - mid) * cfg->V_line_per_count;
    if (cfg->swap_vw) {
        /* The inverter's v is the motor's w: u_uw = u_uv + u_vw, u_wv = -u_vw. */
        const float v_A = raw_A.v;
        raw_A.v = raw_A.w;
        raw_A.w = v_A;
        uv_V += vw_V;
        vw_V = -vw_V;
    }
    const uvw_t i_A = {raw_A.u - st->offset_A.u, raw_A.v - st->offset_A.v,
                       raw_A.w - st->offset_A.w};
    out->i_A = i_A;
    out->i_s_A = balanced_phases(ab_sub(ab_from_uvw(i_A), st->moved_A), st->unbalance.i);
    out->u_line_V = balanced_lines(ab_sub(ab_from_line(uv_V, vw_V), st->offset_V), st->unbalance.u);
    out->u_dc_V = (float)in->u_dc_counts * cfg->V_dc_per_count;
    out->flags = 0u;
    if (saturated(cfg->max_counts, in)) {
        out->flags = range_flags(cfg->max_counts, in);
    }
    /* Written so that a NaN, from an offset, is flagged as well. */
    if (!(absf(i_A.u + i_A.v + i_A.w) <= cfg->current_sum_max_A)) {
        out->flags |= MEASUREMENT_CURRENT_SUM;
    }
}
