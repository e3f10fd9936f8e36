#include "frozen_link.h"

/* Of link times trip: 35 W in a drive of 1.5 kW. They move 1 mF by 5 V in the time below. */
#define FROZEN_LINK_PU    0.005f
#define FROZEN_LINK_HIGH  0.95f
#define FROZEN_LINK_LOOKS 16u /* 51 ms at 200 us */

void frozen_link_init(frozen_link_config_t *cfg, float chopper_on_V, float i_trip_A)
{
    cfg->least_W = FROZEN_LINK_PU * chopper_on_V * i_trip_A;
    cfg->high_V = FROZEN_LINK_HIGH * chopper_on_V;
}

bool frozen_link_look(const frozen_link_config_t *cfg, frozen_link_state_t *st, float u_dc_V,
                      float power_W, bool brake_on)
{
    const bool same = float_bits(u_dc_V) == float_bits(st->u_dc_V);
    const bool high = (cfg->high_V > 0.0f) && (u_dc_V > cfg->high_V);
    const bool charged = high && !brake_on && (power_W < -cfg->least_W);
    st->u_dc_V = u_dc_V;
    st->looks = (same && charged) ? (st->looks + 1u) : 0u; /* the gates open long before it wraps */
    return st->looks >= FROZEN_LINK_LOOKS;
}
