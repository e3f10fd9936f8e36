#include "svpwm.h"

/* Share of the hexagon in which no rounding brings a duty to its limits: none needs a look. */
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
    cfg->inside_pu = SVPWM_FREE_PU - 2.0f * min_duty;
    cfg->u_dc_min_V = params->u_dc_min_V;
    cfg->beta_sign = params->swap_vw ? -1.0f : 1.0f;
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
static inline span_t span_of(uvw_t u_V)
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

/* Centred between the rails; per_V is 1 over the dc link or over the span. */
static inline uvw_t duties(uvw_t u_V, span_t s, float per_V)
{
    const float mid_V = 0.5f * (s.max_V + s.min_V);
    return (uvw_t){0.5f + (u_V.u - mid_V) * per_V, 0.5f + (u_V.v - mid_V) * per_V,
                   0.5f + (u_V.w - mid_V) * per_V};
}

/* Outside the hexagon u_dc/span shortens the vector: dividing by the span does both. What is
 * realised then follows from the duties. */
COLD static svpwm_out_t near_the_limits(const svpwm_config_t *cfg, uvw_t u_V, span_t s,
                                        float u_dc_V)
{
    const float span_V = s.max_V - s.min_V;
    const uvw_t d = duties(u_V, s, 1.0f / maxf(u_dc_V, span_V));
    const uvw_t duty = {realisable_duty(d.u, cfg->min_duty), realisable_duty(d.v, cfg->min_duty),
                        realisable_duty(d.w, cfg->min_duty)};
    const ab_t legs_V = ab_from_line((duty.u - duty.v) * u_dc_V, (duty.v - duty.w) * u_dc_V);
    return (svpwm_out_t){.duty = duty,
                         .u_realised_V = {legs_V.alpha, cfg->beta_sign * legs_V.beta},
                         .limited = span_V > u_dc_V};
}

svpwm_out_t svpwm_step(const svpwm_config_t *cfg, ab_t u_ref_V, float u_dc_V)
{
    const svpwm_out_t none = {.duty = {0.5f, 0.5f, 0.5f}, .limited = true};
    const uvw_t u_V = uvw_from_ab((ab_t){u_ref_V.alpha, cfg->beta_sign * u_ref_V.beta});
    const span_t s = span_of(u_V);
    const float span_V = s.max_V - s.min_V; /* the largest line voltage wanted */

    /* No zero of the voltage is wrong: all legs alike. */
    if (!(u_dc_V >= cfg->u_dc_min_V) || !is_finite(u_dc_V)) {
        return none;
    }
    if (span_V <= cfg->inside_pu * u_dc_V) {
        return (svpwm_out_t){
            .duty = duties(u_V, s, 1.0f / u_dc_V), .u_realised_V = u_ref_V, .exact = true};
    }
    /* A reference that is not finite leaves a span that is not. */
    return is_finite(span_V) ? near_the_limits(cfg, u_V, s, u_dc_V) : none;
}
