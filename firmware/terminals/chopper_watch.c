#include "chopper_watch.h"

#include "lapse.h"

#define FADE_MAX 0.1f

bool chopper_watch_init(chopper_watch_config_t *cfg, const chopper_watch_params_t *p)
{
    *cfg = (chopper_watch_config_t){0};
    if (is_zero(p->ohm)) {
        return true; /* no resistor */
    }
    if (!ALL_POSITIVE(p->ohm, p->rated_W, p->tau_s, p->step_s)) {
        return false;
    }
    *cfg = (chopper_watch_config_t){.on = true,
                                    .feedback = p->feedback,
                                    .per_V2 = 1.0f / (p->ohm * p->rated_W),
                                    .fade = p->step_s / p->tau_s};
    return ALL_POSITIVE(cfg->per_V2, cfg->fade) && (cfg->fade <= FADE_MAX);
}

/* More than one look in eight, for so many steps: switching between two looks does not count. */
static uint32_t contradictions(chopper_watch_state_t *st, const chopper_watch_in_t *in)
{
    const uint32_t limit = CHOPPER_WATCH_WRONG_STEPS;
    st->shorted = lapse_debounce(st->shorted, in->leads && !in->switched_on, limit, in->steps);
    st->open = lapse_debounce(st->open, !in->leads && in->switched_on, limit, in->steps);
    return (debounce_elapsed(st->shorted, limit) ? CHOPPER_WATCH_SHORT : 0u) |
           (debounce_elapsed(st->open, limit) ? CHOPPER_WATCH_OPEN : 0u);
}

uint32_t chopper_watch_step(const chopper_watch_config_t *cfg, chopper_watch_state_t *st,
                            const chopper_watch_in_t *in)
{
    if (!cfg->on) {
        return 0u;
    }
    const bool leads = cfg->feedback ? in->leads : in->switched_on;
    const float power_pu = leads ? (cfg->per_V2 * in->u_dc_V * in->u_dc_V) : 0.0f;
    st->heat_pu += minf(cfg->fade * (float)in->steps, 1.0f) * (power_pu - st->heat_pu);
    st->hot = st->heat_pu >= (st->hot ? CHOPPER_WATCH_COOL_PU : 1.0f);
    const uint32_t wrong = cfg->feedback ? contradictions(st, in) : 0u;
    return wrong | (st->hot ? CHOPPER_WATCH_HOT : 0u);
}
