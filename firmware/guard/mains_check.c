#include "mains_check.h"

#define MAINS_PEAK      1.41421356f
#define MAINS_LOW       0.7f
#define MAINS_HIGH      1.2f
#define MAINS_WRONG_S   4.0f
#define MAINS_LOOKS_MAX 1e6f

bool mains_check_init(mains_check_config_t *cfg, float mains_V, float schedule_s)
{
    if (!nonnegativef(mains_V) || !positivef(schedule_s)) {
        return false;
    }
    const float peak_V = MAINS_PEAK * mains_V;
    const float looks = minf(MAINS_WRONG_S / schedule_s, MAINS_LOOKS_MAX);
    *cfg = (mains_check_config_t){
        .low_V = MAINS_LOW * peak_V, .high_V = MAINS_HIGH * peak_V, .most = (uint32_t)looks};
    return true;
}

bool mains_check_look(const mains_check_config_t *cfg, mains_check_state_t *st, float u_dc_V,
                      float power_W)
{
    if (!(cfg->high_V > 0.0f)) {
        return false;
    }
    const bool wrong = (u_dc_V < cfg->low_V) || ((u_dc_V > cfg->high_V) && (power_W > 0.0f));
    if (!wrong) {
        st->looks -= (st->looks > 0u) ? 1u : 0u;
        return false;
    }
    st->looks += (st->looks <= cfg->most) ? 1u : 0u;
    return st->looks > cfg->most;
}
