/* One PI controller with back-calculation: it is told the output that was realised.
 *
 * v = Kp e + x + feed-forward (the caller's); x += T Ki e + (T Ki/Kp)(realised - asked). The
 * tracking time of this anti-windup is Kp/Ki.
 */
#ifndef PI_H
#define PI_H

#include <stdbool.h>

#include "num.h"

typedef struct {
    float kp;
    float ki_T;     /* Ki times the period */
    float tracking; /* T Ki/Kp, at most 1 */
    float x_max;    /* bound of the integrator */
} pi_config_t;

typedef struct {
    float x;
} pi_state_t;

/* False unless kp > 0, ki >= 0, period > 0, x_max > 0, all finite. */
CHECKED bool pi_init(pi_config_t *cfg, float kp, float ki_per_s, float x_max, float period_s);

static inline float pi_output(const pi_config_t *cfg, const pi_state_t *st, float error)
{
    return cfg->kp * error + st->x;
}

/* The integrator after this period, before its limit: with nothing taken away by later limits. */
static inline float pi_next(const pi_config_t *cfg, const pi_state_t *st, float error)
{
    return st->x + cfg->ki_T * error;
}

static inline void pi_set(const pi_config_t *cfg, pi_state_t *st, float x)
{
    st->x = limitf(x, cfg->x_max);
}

/* realised - asked: the part that later limits took away; 0 if none. */
static inline void pi_update(const pi_config_t *cfg, pi_state_t *st, float error,
                             float realised_minus_asked)
{
    pi_set(cfg, st, pi_next(cfg, st, error) + cfg->tracking * realised_minus_asked);
}

#endif
