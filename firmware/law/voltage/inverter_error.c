#include "inverter_error.h"

bool inverter_error_init(inverter_error_config_t *cfg, const inverter_error_params_t *params,
                         float period_s)
{
    const float inv_i_threshold_per_A = 1.0f / params->i_threshold_A;

    if (!positivef(period_s) || !nonnegativef(params->fraction) || !(params->fraction <= 1.0f)) {
        return false;
    }
    if (!nonnegativef(params->dead_time_s) || !(params->dead_time_s < period_s) ||
        !nonnegativef(params->drop_V) || !positivef(inv_i_threshold_per_A)) {
        return false;
    }
    cfg->k = params->fraction * params->dead_time_s / period_s;
    cfg->drop_V = params->fraction * params->drop_V;
    cfg->inv_i_threshold_per_A = inv_i_threshold_per_A;
    return true;
}

ab_t inverter_error_voltage(const inverter_error_config_t *cfg, ab_t i_predicted_A, float lost_V)
{
    /* Nothing to add: switched off, or a dc link that is no number. */
    if (!positivef(lost_V)) {
        return (ab_t){0.0f, 0.0f};
    }
    const uvw_t i_A = uvw_from_ab(i_predicted_A);
    const float per_A = cfg->inv_i_threshold_per_A;
    /* Beyond the threshold is the usual case: the clamp without branches. */
    const uvw_t sat = {clampf(i_A.u * per_A, -1.0f, 1.0f), clampf(i_A.v * per_A, -1.0f, 1.0f),
                       clampf(i_A.w * per_A, -1.0f, 1.0f)};
    return ab_scale(ab_from_uvw(sat), lost_V);
}
