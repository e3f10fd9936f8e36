/* What the dc link still takes and gives: brake resistor, and limits of the torque current.
 *
 * u_dc above regen_start_V: the braking current allowed falls in a line, to none where a quarter of
 * the way to u_dc_max_V is left. Below 1.2 hold_V the motoring current falls likewise, is none at
 * hold_V and turns into braking below: the shaft feeds the link through a dip (drive: if fast
 * enough to). The resistor goes off 3 % below where it goes on. Each is off at 0 V; inside the
 * window in which none acts nothing is computed.
 */
#ifndef LINK_LIMIT_H
#define LINK_LIMIT_H

#include <stdbool.h>

#include "num.h"

typedef struct {
    float chopper_on_V;  /* 0: no brake resistor */
    float regen_start_V; /* 0: braking is not limited */
    float hold_V;        /* 0: motoring is not limited */
    float u_dc_max_V;    /* where the drive trips */
} link_limit_params_t;

typedef struct {
    float chopper_on_V;
    float chopper_off_V;
    float middle_V; /* of the window in which nothing acts ... */
    float half_V;   /* ... and half its width */
    /* Allowed shares as lines over u_dc: at 0 V, and per V. */
    float braking_pu;
    float braking_pu_per_V;
    float motoring_pu;
    float motoring_pu_per_V;
} link_limit_config_t;

typedef struct {
    bool acting;
    bool brake_on;
    bool limiting;     /* one of the two below is less than 1 */
    float braking_pu;  /* 0..1 of the largest torque current */
    float motoring_pu; /* -1..1; negative: brake at least as much */
} link_limit_state_t;

/* False for a voltage that is negative or not finite, or levels in the wrong order. */
CHECKED bool link_limit_init(link_limit_config_t *cfg, const link_limit_params_t *params);

COLD void link_limit_act(const link_limit_config_t *cfg, link_limit_state_t *st, float u_dc_V);

static inline void link_limit_step(const link_limit_config_t *cfg, link_limit_state_t *st,
                                   float u_dc_V)
{
    if (st->acting || !(absf(u_dc_V - cfg->middle_V) < cfg->half_V)) {
        link_limit_act(cfg, st, u_dc_V);
    }
}

#endif
