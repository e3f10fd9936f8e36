#include "analog_reference.h"

#include "hal_terminals.h"
#include "lapse.h"

#define LOW_A  4e-3f
#define SPAN_A 16e-3f
#define SPAN_V 10.0f

bool analog_reference_init(analog_reference_config_t *cfg, const analog_reference_params_t *p)
{
    *cfg = (analog_reference_config_t){.scale = p->full_scale / HAL_TERMINAL_FULL_SCALE,
                                       .per_unit = 1.0f / SPAN_V,
                                       .break_high = ANALOG_REFERENCE_HIGH_V,
                                       .dead_pu = p->dead_pu,
                                       .filter_s = p->filter_s,
                                       .lost_steps = p->lost_steps,
                                       .on = p->kind != (uint32_t)ANALOG_REFERENCE_OFF};
    if (p->kind > (uint32_t)ANALOG_REFERENCE_CURRENT) {
        return false;
    }
    if (p->kind == (uint32_t)ANALOG_REFERENCE_CURRENT) {
        cfg->low = LOW_A;
        cfg->per_unit = 1.0f / SPAN_A;
        cfg->break_low = ANALOG_REFERENCE_BREAK_A;
        cfg->break_high = ANALOG_REFERENCE_SHORT_A;
    }
    const bool reaches = is_finite(p->full_scale) && (p->full_scale > cfg->break_high);
    return (reaches || !cfg->on) && nonnegativef(p->dead_pu) && (p->dead_pu < 1.0f) &&
           nonnegativef(p->filter_s) && (p->lost_steps > 0u);
}

bool analog_reference_step(const analog_reference_config_t *cfg, analog_reference_state_t *st,
                           uint16_t counts, uint32_t steps)
{
    if (!cfg->on) {
        return false;
    }
    const float value = cfg->scale * (float)counts;
    const bool wrong = (value < cfg->break_low) || (value > cfg->break_high);
    st->wrong = lapse_debounce(st->wrong, wrong, cfg->lost_steps, steps);
    if (!wrong) {
        const float share_pu = minf(cfg->per_unit * (value - cfg->low), 1.0f);
        const float wanted_pu = (share_pu < cfg->dead_pu) ? 0.0f : share_pu;
        st->share_pu += lapse_gain(cfg->filter_s, steps) * (wanted_pu - st->share_pu);
    }
    return debounce_elapsed(st->wrong, cfg->lost_steps);
}
