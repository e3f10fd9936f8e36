#include "pi.h"

bool pi_init(pi_config_t *cfg, float kp, float ki_per_s, float x_max, float period_s)
{
    const float ki_T = ki_per_s * period_s;

    if (!ALL_POSITIVE(kp, x_max, period_s) || !ALL_NONNEGATIVE(ki_per_s, ki_T)) {
        return false;
    }
    cfg->kp = kp;
    cfg->ki_T = ki_T;
    /* Above 1 the integrator would jump past the value that ends the saturation, and chatter. */
    cfg->tracking = minf(ki_T / kp, 1.0f);
    cfg->x_max = x_max;
    return true;
}
