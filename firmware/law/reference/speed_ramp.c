#include "speed_ramp.h"

/* n (n + 1) stays exact in a float up to here. */
#define SPEED_RAMP_STEPS_MAX 4000.0f

/* Whole quanta of j T in an acceleration. */
static float whole_steps(float acceleration_rad_s2, float jerk_step_rad_s2)
{
    return (float)(uint32_t)minf(acceleration_rad_s2 / jerk_step_rad_s2, SPEED_RAMP_STEPS_MAX);
}

bool speed_ramp_init(speed_ramp_config_t *cfg, const speed_ramp_params_t *params, float period_s)
{
    if (!ALL_POSITIVE(params->acceleration_rad_s2, params->stop_rad_s2, period_s) ||
        !nonnegativef(params->jerk_rad_s3)) {
        return false;
    }
    speed_ramp_config_t c = {.on = params->jerk_rad_s3 > 0.0f,
                             .stop_step_rad_s = params->stop_rad_s2 * period_s};
    if (c.on) {
        const float jerk_step_rad_s2 = params->jerk_rad_s3 * period_s;
        c.quantum_rad_s = jerk_step_rad_s2 * period_s;
        c.steps_max = whole_steps(params->acceleration_rad_s2, jerk_step_rad_s2);
        c.stop_steps_max = whole_steps(params->stop_rad_s2, jerk_step_rad_s2);
        if (!positivef(c.quantum_rad_s) || !(c.steps_max >= 1.0f) || !(c.stop_steps_max >= 1.0f)) {
            return false;
        }
    }
    *cfg = c;
    return true;
}

/* Whether n steps a period, counted towards the target, still end there. */
static bool ends(const speed_ramp_config_t *cfg, float n, float distance_rad_s, float n_max)
{
    const float way_rad_s = 0.5f * n * (n + 1.0f) * cfg->quantum_rad_s;
    return (n <= 0.0f) || ((n <= n_max) && (way_rad_s <= distance_rad_s));
}

/* The largest n that can be had in this period and still ends. */
static float next_steps(const speed_ramp_config_t *cfg, float n, float distance_rad_s, float n_max)
{
    if (ends(cfg, n + 1.0f, distance_rad_s, n_max)) {
        return n + 1.0f;
    }
    return ends(cfg, n, distance_rad_s, n_max) ? n : (n - 1.0f);
}

COLD float speed_ramp_step(const speed_ramp_config_t *cfg, speed_ramp_state_t *st, float from_rad_s,
                           float target_rad_s, bool stop)
{
    const float difference_rad_s = target_rad_s - from_rad_s;
    if (!is_finite(difference_rad_s)) {
        return from_rad_s;
    }
    if (!cfg->on) {
        return stop ? (from_rad_s + limitf(difference_rad_s, cfg->stop_step_rad_s)) : target_rad_s;
    }
    const float distance_rad_s = absf(difference_rad_s);
    const float sign = (difference_rad_s < 0.0f) ? -1.0f : 1.0f;
    const float n = next_steps(cfg, sign * st->steps, distance_rad_s,
                               stop ? cfg->stop_steps_max : cfg->steps_max);
    /* What is left is less than one quantum: the last step is that. */
    if ((absf(n) < 1.0f) && (distance_rad_s < cfg->quantum_rad_s)) {
        st->steps = 0.0f;
        return target_rad_s;
    }
    st->steps = sign * n;
    return from_rad_s + sign * n * cfg->quantum_rad_s;
}
