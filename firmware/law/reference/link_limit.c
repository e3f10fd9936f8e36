#include "link_limit.h"

/* No braking current any more with this share of the way to the trip left. */
#define LINK_LIMIT_REGEN_SPARE 0.25f
#define LINK_LIMIT_CHOPPER_OFF 0.97f

static bool params_valid(const link_limit_params_t *p)
{
    return ALL_NONNEGATIVE(p->chopper_on_V, p->regen_start_V) && positivef(p->u_dc_max_V) &&
           (p->regen_start_V < p->u_dc_max_V) && (p->chopper_on_V <= p->u_dc_max_V);
}

/* The lowest dc link at which something acts. The resistor's lower level is below: until it is
 * reached, `acting` keeps watching. */
static float first_limit_V(const link_limit_params_t *p)
{
    float high_V = p->u_dc_max_V;
    high_V = (p->chopper_on_V > 0.0f) ? minf(high_V, p->chopper_on_V) : high_V;
    return (p->regen_start_V > 0.0f) ? minf(high_V, p->regen_start_V) : high_V;
}

bool link_limit_init(link_limit_config_t *cfg, const link_limit_params_t *params)
{
    if (!params_valid(params)) {
        return false;
    }
    link_limit_config_t c = {.chopper_on_V = params->chopper_on_V,
                             .chopper_off_V = LINK_LIMIT_CHOPPER_OFF * params->chopper_on_V,
                             .first_V = first_limit_V(params),
                             .braking_pu = 1.0f};
    if (params->regen_start_V > 0.0f) {
        const float per_V =
            1.0f / ((1.0f - LINK_LIMIT_REGEN_SPARE) * (params->u_dc_max_V - params->regen_start_V));
        c.braking_pu = 1.0f + per_V * params->regen_start_V;
        c.braking_pu_per_V = -per_V;
    }
    *cfg = c;
    return true;
}

void link_limit_act(const link_limit_config_t *cfg, link_limit_state_t *st, float u_dc_V)
{
    st->brake_on = (cfg->chopper_on_V > 0.0f) &&
                   (u_dc_V > (st->brake_on ? cfg->chopper_off_V : cfg->chopper_on_V));
    /* A voltage that is no number takes all of it: clampf makes 0 of that. */
    st->taken_pu = 1.0f - clampf(cfg->braking_pu + cfg->braking_pu_per_V * u_dc_V, 0.0f, 1.0f);
    st->limiting = st->taken_pu > 0.0f;
    st->acting = st->brake_on || st->limiting;
}
