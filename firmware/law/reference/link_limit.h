/* Braking into the dc link: brake resistor, and limit of the braking current.
 *
 * With u_dc above regen_start_V, the allowed braking current falls linearly. It is zero at three
 * quarters of the way to u_dc_max_V. The flux falls as well at high speed (vector.c). The resistor
 * switches off 3 % below its switch-on voltage. Each is off at 0 V; below the first of the two
 * nothing is computed. mains_loss.h handles a falling link.
 */
#ifndef LINK_LIMIT_H
#define LINK_LIMIT_H

#include <stdbool.h>

#include "num.h"

typedef struct {
    float chopper_on_V;  /* 0: no brake resistor */
    float regen_start_V; /* 0: braking is not limited */
    float u_dc_max_V;    /* where the drive trips */
} link_limit_params_t;

typedef struct {
    float chopper_on_V;
    float chopper_off_V;
    float first_V; /* below, nothing acts */
    /* Allowed share, linear over u_dc: value at 0 V, and slope per V. */
    float braking_pu;
    float braking_pu_per_V;
} link_limit_config_t;

typedef struct {
    bool acting;
    bool brake_on;
    bool limiting;  /* the share below is not 0 */
    float taken_pu; /* share of the largest braking current that is not allowed, 0..1 */
} link_limit_state_t;

/* False for a voltage that is negative or not finite, or levels in the wrong order. */
CHECKED bool link_limit_init(link_limit_config_t *cfg, const link_limit_params_t *params);

COLD void link_limit_act(const link_limit_config_t *cfg, link_limit_state_t *st, float u_dc_V);

static inline void link_limit_step(const link_limit_config_t *cfg, link_limit_state_t *st,
                                   float u_dc_V)
{
    if (st->acting || !(u_dc_V < cfg->first_V)) {
        link_limit_act(cfg, st, u_dc_V);
    }
}

#endif
