/* Brake resistor and its transistor, as far as terminals see them. The drive switches it by
 * chopper_on_V; this watches.
 *
 * Heat of the resistor over its rating: x' = (P/P_cont - x)/tau, P = u_dc^2/R while it conducts. At
 * 1 the driver is disabled until x has fallen below .8. A transistor that leads although it should
 * not, or the reverse, shows in the voltage of the resistor.
 */
#ifndef CHOPPER_WATCH_H
#define CHOPPER_WATCH_H

#include <stdbool.h>
#include <stdint.h>

#include "num.h"

#define CHOPPER_WATCH_COOL_PU     0.8f
#define CHOPPER_WATCH_WRONG_STEPS 20u

#define CHOPPER_WATCH_HOT   (1u << 0)
#define CHOPPER_WATCH_SHORT (1u << 1) /* it leads although it should not */
#define CHOPPER_WATCH_OPEN  (1u << 2) /* it does not lead although it should */

typedef struct {
    float ohm; /* 0: no resistor */
    float rated_W;
    float tau_s;
    float step_s;
    bool feedback;
} chopper_watch_params_t;

typedef struct {
    bool on;
    bool feedback;
    float per_V2; /* heat over its rating, per V^2 */
    float fade;   /* T/tau */
} chopper_watch_config_t;

typedef struct {
    float heat_pu;
    bool hot;
    uint32_t shorted;
    uint32_t open;
} chopper_watch_state_t;

typedef struct {
    uint32_t steps; /* since the last look (lapse.h) */
    float u_dc_V;
    bool switched_on;
    bool leads; /* feedback */
} chopper_watch_in_t;

/* False for a number that is not finite or of the wrong sign, or a time constant below 10 steps;
 * nothing but ohm is looked at without a resistor. */
CHECKED bool chopper_watch_init(chopper_watch_config_t *cfg, const chopper_watch_params_t *params);

/* CHOPPER_WATCH_* of this step. */
uint32_t chopper_watch_step(const chopper_watch_config_t *cfg, chopper_watch_state_t *st,
                            const chopper_watch_in_t *in);

#endif
