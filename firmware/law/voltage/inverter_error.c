#include "inverter_error.h"

bool inverter_error_init(inverter_error_config_t *cfg, const inverter_error_params_t *params,
                         float period_s)
{
    if (!positivef(period_s) || !nonnegativef(params->fraction) || !(params->fraction <= 1.0f)) {
        return false;
    }
    if (!nonnegativef(params->dead_time_s) || !(params->dead_time_s < period_s) ||
        !nonnegativef(params->drop_V) || !positivef(1.0f / params->i_threshold_A)) {
        return false;
    }
    cfg->k = params->fraction * params->dead_time_s / period_s;
    cfg->drop_V = params->fraction * params->drop_V;
    cfg->i_threshold_A = params->i_threshold_A;
    return true;
}

/* What legs that lose +-1 V make, by the signs of the currents: bit 0 u, 1 v, 2 w, set when
 * negative.
 */
#define LEGS(u, v, w)                                                                              \
    {                                                                                              \
        NUM_SQRT_2_3 *((u)-0.5f * ((v) + (w))), NUM_SQRT_1_2 *((v) - (w))                          \
    }
static const ab_t of_signs[8] = {LEGS(1.0f, 1.0f, 1.0f),   LEGS(-1.0f, 1.0f, 1.0f),
                                 LEGS(1.0f, -1.0f, 1.0f),  LEGS(-1.0f, -1.0f, 1.0f),
                                 LEGS(1.0f, 1.0f, -1.0f),  LEGS(-1.0f, 1.0f, -1.0f),
                                 LEGS(1.0f, -1.0f, -1.0f), LEGS(-1.0f, -1.0f, -1.0f)};

/* Share of the whole: a line up to the threshold, then all but the tail. */
COLD static float leg_share(const leg_loss_t *loss, float i_A)
{
    const float line = clampf(i_A * (1.0f / loss->threshold_A), -1.0f, 1.0f);
    return line * (1.0f - loss->tail_A / maxf(absf(i_A), loss->threshold_A));
}

/* The curve has a tail, or some phase is near its zero. */
COLD static ab_t by_leg(const leg_loss_t *loss, uvw_t i_A)
{
    return ab_from_uvw(
        (uvw_t){leg_share(loss, i_A.u), leg_share(loss, i_A.v), leg_share(loss, i_A.w)});
}

ab_t inverter_error_voltage(leg_loss_t loss, ab_t i_predicted_A)
{
    /* Nothing to add: switched off, or a dc link that is no number. */
    if (!effectivef(loss.whole_V)) {
        return (ab_t){0.0f, 0.0f};
    }
    const uvw_t i_A = uvw_from_ab(i_predicted_A);
    const uint32_t u = float_bits(i_A.u);
    const uint32_t v = float_bits(i_A.v);
    const uint32_t w = float_bits(i_A.w);
    const uint32_t threshold = float_bits(loss.threshold_A) << 1; /* without the sign */
    if ((loss.tail_A > 0.0f) || ((u << 1) < threshold) || ((v << 1) < threshold) ||
        ((w << 1) < threshold)) {
        return ab_scale(by_leg(&loss, i_A), loss.whole_V);
    }
    /* The usual case: a sector of the current. */
    return ab_scale(of_signs[(u >> 31) | ((v >> 31) << 1) | ((w >> 31) << 2)], loss.whole_V);
}
