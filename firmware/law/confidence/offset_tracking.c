#include "offset_tracking.h"

/* k. An offset is followed within 5 s, at speed sooner. A residual that turns with the field moves
 * the offset by k |tau + j w|/|w_s| of its own amplitude: 3 % at speed, 8 % braking at 1.2 Hz. */
#define OFFSET_TRACKING_GAIN 0.03f

/* .6 Hz. The gain rises from 0 there to all of it at twice that, by the frequency averaged over a
 * second. By the frequency itself, the offset followed a field that swings about zero and passes
 * 1 Hz again and again. And an offset makes w_s swing in time with the field: the gain acted in the
 * upper halves of that swing alone, and found an offset that was not there. After a stop the gain
 * lasts for .7 s. */
#define OFFSET_TRACKING_MIN_RAD_S 3.7699112f
#define OFFSET_TRACKING_AVERAGE_S 1.0f

/* No sensor that works drifts further, over its full scale. */
#define OFFSET_TRACKING_MAX_PU 0.015f

void offset_tracking_init(offset_tracking_config_t *cfg, const offset_tracking_params_t *p,
                          const motor_model_t *motor, float step_s)
{
    *cfg =
        (offset_tracking_config_t){.gain_s = p->on ? (OFFSET_TRACKING_GAIN * step_s) : 0.0f,
                                   .average_gain = minf(step_s / OFFSET_TRACKING_AVERAGE_S, 1.0f),
                                   .max_A = OFFSET_TRACKING_MAX_PU * p->full_scale_A,
                                   .tau_per_s = motor->tau_per_s};
}

ab_t offset_tracking_step(const offset_tracking_config_t *cfg, offset_tracking_state_t *st,
                          ab_t moved_A, const offset_tracking_in_t *in)
{
    /* Bounded, so that a field that comes from high speed is soon seen to stand. An average that is
     * not finite begins anew. */
    const float turning = limitf(in->omega_s_hat_rad_s * (1.0f / OFFSET_TRACKING_MIN_RAD_S), 2.0f);
    const float average = st->turning + cfg->average_gain * (turning - st->turning);
    st->turning = (absf(average) <= 2.0f) ? average : 0.0f;
    const float share = absf(st->turning) - 1.0f;
    if (!(share > 0.0f)) {
        return moved_A;
    }
    const ab_t back_per_s = {cfg->tau_per_s, in->omega_e_hat_rad_s};
    const ab_t sum_A = ab_sub(moved_A, ab_scale(ab_mul(back_per_s, in->e1_A), share * cfg->gain_s));
    return (ab_t){limitf(sum_A.alpha, cfg->max_A), limitf(sum_A.beta, cfg->max_A)};
}
