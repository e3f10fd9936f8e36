#include "unbalance_tracking.h"

#define UNBALANCE_GAIN      0.04f
#define UNBALANCE_MIN_RAD_S 12.566371f /* 2 Hz */
#define UNBALANCE_MAX_RAD_S 62.831853f /* 10 Hz */

/* In either coordinate: room beyond the .012 of voltages and .007 of currents that gains of +-1 %
 * make. A sensor that is further off is broken, and the guard sees what is left. */
#define UNBALANCE_MAX 0.02f

#define UNBALANCE_SUM 0.81649658f /* 2/sqrt(6) */

void unbalance_tracking_init(unbalance_tracking_config_t *cfg, bool on, float step_s)
{
    cfg->gain_s = on ? (UNBALANCE_GAIN * step_s) : 0.0f;
}

COLD static void follow(ab_t *n, ab_t away, float norm2, float gain)
{
    if (norm2 > 0.0f) {
        const ab_t sum = ab_add(*n, ab_scale(away, gain / norm2));
        *n = (ab_t){limitf(sum.alpha, UNBALANCE_MAX), limitf(sum.beta, UNBALANCE_MAX)};
    }
}

void unbalance_tracking_step(const unbalance_tracking_config_t *cfg, unbalance_t *found,
                             const unbalance_tracking_in_t *in)
{
    const float rate_rad_s =
        minf(UNBALANCE_MAX_RAD_S, absf(in->omega_s_hat_rad_s)) - UNBALANCE_MIN_RAD_S;
    if (!(rate_rad_s > 0.0f)) {
        return;
    }
    const float gain = cfg->gain_s * rate_rad_s;
    follow(&found->u, ab_mul(in->residual_V, in->expected_V), ab_norm2(in->expected_V), gain);
    const float i2_A2 = ab_norm2(in->i_s_A);
    const ab_t seen_A2 = ab_scale(ab_conj(in->i_s_A), UNBALANCE_SUM * in->i_sum_A);
    follow(&found->i, ab_sub(seen_A2, ab_scale(found->i, i2_A2)), i2_A2, gain);
}
