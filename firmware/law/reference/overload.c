#include "overload.h"

#define OVERLOAD_DERATE_PU 1.0f
#define OVERLOAD_FULL_PU   1.05f
#define OVERLOAD_TRIP_PU   1.2f

bool overload_init(overload_config_t *cfg, const overload_params_t *params, float schedule_s)
{
    if (!positivef(params->i_max_A) || !positivef(schedule_s)) {
        return false;
    }
    *cfg = (overload_config_t){.i_max_A = params->i_max_A};
    for (int n = 0; n < OVERLOAD_MODELS; n++) {
        const float cont_A = params->cont_A[n];
        if (!(cont_A >= 0.0f) || !(cont_A <= params->i_max_A) || !(params->tau_s[n] > schedule_s) ||
            !is_finite(params->tau_s[n])) {
            return false;
        }
        cfg->cont_A[n] = cont_A;
        cfg->fade[n] = schedule_s / params->tau_s[n];
        if (cont_A > 0.0f) {
            cfg->warm_per_A2[n] = cfg->fade[n] / (cont_A * cont_A);
        }
        if (!is_finite(cfg->warm_per_A2[n])) {
            return false;
        }
    }
    return true;
}

bool overload_step(const overload_config_t *cfg, overload_state_t *st, float i2_A2)
{
    float allowed_A = cfg->i_max_A;
    bool stop = false;
    st->derating = false;
    for (int n = 0; n < OVERLOAD_MODELS; n++) {
        const float before_pu = st->heat_pu[n];
        const float heat_pu = before_pu + cfg->warm_per_A2[n] * i2_A2 - cfg->fade[n] * before_pu;
        st->heat_pu[n] = heat_pu;
        /* Written so that a NaN, from the model or the current, is no cold motor. */
        if (!(heat_pu <= OVERLOAD_DERATE_PU)) {
            const float left_pu = clampf(
                (OVERLOAD_FULL_PU - heat_pu) / (OVERLOAD_FULL_PU - OVERLOAD_DERATE_PU), 0.0f, 1.0f);
            st->derating = true;
            allowed_A = minf(allowed_A, cfg->cont_A[n] + left_pu * (cfg->i_max_A - cfg->cont_A[n]));
            stop = stop || !(heat_pu < OVERLOAD_TRIP_PU);
        }
    }
    st->i_max_A = allowed_A;
    return stop;
}
