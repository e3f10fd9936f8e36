#include "acting_voltage.h"

bool acting_voltage_init(acting_voltage_config_t *cfg, acting_voltage_source_t source,
                         float filter_comp_s)
{
    if (((source != ACTING_VOLTAGE_SENSORS) && (source != ACTING_VOLTAGE_DUTY)) ||
        !nonnegativef(filter_comp_s)) {
        return false;
    }
    *cfg = (acting_voltage_config_t){.source = source, .filter_comp_s = filter_comp_s};
    return true;
}

ab_t acting_voltage_step(const acting_voltage_config_t *cfg, acting_voltage_state_t *st,
                         ab_t u_line_V)
{
    st->ended_V = st->acting_V;
    st->acting_V = st->pending_V;
    if (cfg->source == ACTING_VOLTAGE_DUTY) {
        return st->ended_V;
    }
    return ab_add(u_line_V, ab_mul(st->lag, u_line_V));
}
