#include "acting_voltage.h"

bool acting_voltage_init(acting_voltage_config_t *cfg, const acting_voltage_params_t *params)
{
    const bool known = (params->source == ACTING_VOLTAGE_SENSORS) ||
                       (params->source == ACTING_VOLTAGE_DUTY) ||
                       (params->source == ACTING_VOLTAGE_BLEND);
    const float inv_blend_s = 1.0f / params->blend_rad_s;
    const float late_periods = params->filter_comp_s / params->period_s;
    if (!known || !nonnegativef(params->filter_comp_s) ||
        !ALL_POSITIVE(inv_blend_s, params->period_s)) {
        return false;
    }
    *cfg = (acting_voltage_config_t){.source = params->source,
                                     .lag = 1.0f -
                                            2.0f / ((1.0f + late_periods) * (2.0f + late_periods)),
                                     .keep = late_periods / (2.0f + late_periods),
                                     .inv_blend_s = inv_blend_s};
    return true;
}

ab_t acting_voltage_step(const acting_voltage_config_t *cfg, acting_voltage_state_t *st,
                         ab_t u_line_V)
{
    st->ended_V = ab_by_parts(st->acting_V);
    st->acting_V = ab_by_parts(st->pending_V);
    if (cfg->source == ACTING_VOLTAGE_DUTY) {
        return st->ended_V;
    }
    const ab_t change_V = ab_sub(st->ended_V, st->lagging_V);
    const ab_t late_V = ab_sub(ab_scale(change_V, cfg->lag), ab_scale(st->lag_step_V, cfg->keep));
    st->lag_step_V = ab_sub(change_V, late_V);
    st->lagging_V = ab_sub(st->ended_V, late_V);
    const ab_t sensed_V = ab_add(u_line_V, late_V);
    if (cfg->source == ACTING_VOLTAGE_SENSORS) {
        return sensed_V;
    }
    return ab_add(sensed_V, ab_scale(ab_sub(st->ended_V, sensed_V), st->duty_share));
}
