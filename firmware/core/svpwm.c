#include "svpwm.h"

/* Share of the hexagon in which no rounding can bring a duty to its limits. */
#define SVPWM_FREE_PU 0.999999f

typedef struct {
    float max_V;
    float min_V;
} span_t;

bool svpwm_init(svpwm_config_t *cfg, const svpwm_params_t *params, float period_s)
{
    const float min_duty = params->min_pulse_s / period_s;

    /* Half a period or more would leave no duty but 0 and 1. */
    if (!positivef(period_s) || !nonnegativef(params->min_pulse_s) || !(min_duty < 0.5f) ||
        !positivef(params->u_dc_min_V)) {
        return false;
    }
    cfg->min_duty = min_duty;
    cfg->u_dc_min_V = params->u_dc_min_V;
    cfg->swap_vw = params->swap_vw;
    return true;
}

/* The nearer of no pulse and the shortest one, for a pulse shorter than that. None when a rounding
 * has made it negative. */
static float without_short_pulse(float pulse, float shortest)
{
    if (pulse < 0.5f * shortest) {
        return 0.0f;
    }
    return maxf(pulse, shortest);
}

/* The duty the switches can do: the on pulse is d, the off pulse 1 - d. */
static float realisable_duty(float duty, float min_duty)
{
    if (duty < 0.5f) {
        return without_short_pulse(duty, min_duty);
    }
    return 1.0f - without_short_pulse(1.0f - duty, min_duty);
}

/* Largest and smallest of three voltages that add up to zero: w is no number only when u or v is
 * none, so it may lose every comparison. */
static span_t span_of(uvw_t u_V)
{
    span_t s = (u_V.u > u_V.v) ? (span_t){u_V.u, u_V.v} : (span_t){u_V.v, u_V.u};
    if (u_V.w > s.max_V) {
        s.max_V = u_V.w;
    } else if (u_V.w < s.min_V) {
        s.min_V = u_V.w;
    } else {
        /* w lies between. */
    }
    return s;
}

svpwm_out_t svpwm_step(const svpwm_config_t *cfg, ab_t u_ref_V, float u_dc_V)
{
    const uvw_t u_V = uvw_from_ab(u_ref_V);
    const span_t s = span_of(u_V);
    const float span_V = s.max_V - s.min_V; /* the largest line voltage wanted */
    /* Every pulse is long enough and no duty is beyond 0 or 1; false when one of them is NaN. */
    const bool inside = span_V <= (SVPWM_FREE_PU - 2.0f * cfg->min_duty) * u_dc_V;

    /* No zero of the voltage is wrong: all legs alike. A reference that is not finite leaves a
     * span that is not. */
    if (!(u_dc_V >= cfg->u_dc_min_V) || !is_finite(u_dc_V) || (!inside && !is_finite(span_V))) {
        return (svpwm_out_t){.duty = {0.5f, 0.5f, 0.5f}, .limited = true};
    }

    /* Outside the hexagon u_dc/span shortens the vector: dividing by the span does both. */
    const float per_V = 1.0f / (inside ? u_dc_V : maxf(u_dc_V, span_V));
    const float mid_V = 0.5f * (s.max_V + s.min_V);
    uvw_t duty = {0.5f + (u_V.u - mid_V) * per_V, 0.5f + (u_V.v - mid_V) * per_V,
                  0.5f + (u_V.w - mid_V) * per_V};
    if (!inside) {
        duty =
            (uvw_t){realisable_duty(duty.u, cfg->min_duty), realisable_duty(duty.v, cfg->min_duty),
                    realisable_duty(duty.w, cfg->min_duty)};
    }

    svpwm_out_t out;
    out.duty.u = duty.u;
    out.duty.v = cfg->swap_vw ? duty.w : duty.v;
    out.duty.w = cfg->swap_vw ? duty.v : duty.w;
    out.u_realised_V = ab_from_line((duty.u - duty.v) * u_dc_V, (duty.v - duty.w) * u_dc_V);
    out.limited = span_V > u_dc_V;
    return out;
}
