#include "torque_limits.h"

#include <math.h>

/* The braking current is limited once the link is as full as this. The flux falls before that,
 * which takes a second. With both at once the load drove the shaft away, although the motor could
 * have taken the power (zh envelope: runs 362 of 1658601084, 268 of 2528188677). */
#define TORQUE_LIMITS_FULL_PU 0.4f

bool torque_limits_init(torque_limits_config_t *cfg, const torque_limits_params_t *params,
                        float schedule_s)
{
    cfg->i_q_max_A = params->i_q_max_A;
    return link_limit_init(&cfg->link, &params->link) &&
           overload_init(&cfg->overload, &params->overload, schedule_s);
}

uint32_t torque_limits_acting(const torque_limits_state_t *st, bool running)
{
    return ((st->link.limiting && running) ? FAULT_REGENERATION : 0u) |
           (st->overload.derating ? FAULT_DERATED : 0u);
}

torque_window_t torque_limits_window(const torque_limits_config_t *cfg,
                                     const torque_limits_state_t *st, float omega_e_rad_s,
                                     float i_d_A, float pull_out_A)
{
    float most_A = cfg->i_q_max_A - pull_out_A;
    if (st->overload.derating) {
        const float i_A = st->overload.i_max_A;
        most_A = minf(most_A, sqrtf(maxf(i_A * i_A - i_d_A * i_d_A, 0.0f)));
    }
    const float left_pu = (1.0f - st->link.taken_pu) / (1.0f - TORQUE_LIMITS_FULL_PU);
    const float braking_A = minf(left_pu, 1.0f) * most_A;
    return (omega_e_rad_s < 0.0f) ? (torque_window_t){-most_A, braking_A}
                                  : (torque_window_t){-braking_A, most_A};
}
