/* Pre-charge of the dc link through a resistor, and the contactor that bypasses it.
 *
 *   WAITING -> CHARGING -> CLOSING -> CLOSED -> OPENING -> WAITING;  FAILED until a reset
 *
 * The contactor closes once the link is above ready_V and has risen by less than 1 % in 50 steps.
 * When the link stays below .7 ready_V it has to open: the next charging current needs the resistor
 * again. It never opens under load: the fault takes the gates off first. OPENING keeps the coil
 * energised until they are off and no current flows.
 */
#ifndef PRECHARGE_H
#define PRECHARGE_H

#include <stdbool.h>
#include <stdint.h>

#include "num.h"

#define PRECHARGE_PRESENT_PU   0.1f /* of ready_V: the supply is there, the time counts */
#define PRECHARGE_OPEN_PU      0.7f
#define PRECHARGE_LEVEL_PU     1.01f
#define PRECHARGE_LEVEL_STEPS  50u
#define PRECHARGE_BOUNCE_STEPS 20u /* that the auxiliary contact has to be wrong */
#define PRECHARGE_LOW_STEPS    5u  /* that the link has to be low */
/* Without gates it opens after this time at any current: a sensor may be stuck. */
#define PRECHARGE_DECAY_STEPS 500u

#define PRECHARGE_TOO_SLOW  (1u << 0) /* the link is not charged within charge_steps */
#define PRECHARGE_CONTACTOR (1u << 1) /* its auxiliary contact contradicts */
#define PRECHARGE_LINK_LOW  (1u << 2) /* the link fell while the gates were on */

typedef enum {
    PRECHARGE_WAITING = 0,
    PRECHARGE_CHARGING = 1,
    PRECHARGE_CLOSING = 2,
    PRECHARGE_CLOSED = 3,
    PRECHARGE_FAILED = 4,
    PRECHARGE_OPENING = 5
} precharge_id_t;

typedef struct {
    bool on;
    bool feedback; /* the contactor has an auxiliary contact */
    float ready_V;
    uint32_t charge_steps;
    uint32_t contactor_steps; /* until it has closed, or must have */
} precharge_config_t;

typedef struct {
    precharge_id_t id;
    uint32_t steps; /* in this state; CLOSED: of a low link; OPENING: without gates */
    uint32_t level_steps;
    precharge_id_t then; /* behind OPENING */
    float before_V;      /* at the last look at the rise */
    uint32_t wrong;
} precharge_state_t;

typedef struct {
    uint32_t steps; /* since the last look (lapse.h) */
    float u_dc_V;
    bool closed; /* auxiliary contact */
    bool reset;
    bool open;     /* the contactor has to open: the chopper does not switch off */
    bool gates_on; /* the drive's */
    bool current;  /* the motor's is not zero */
} precharge_in_t;

/* False for a number that is not finite or not positive. */
CHECKED bool precharge_init(const precharge_config_t *cfg);

/* PRECHARGE_* of this step. */
uint32_t precharge_step(const precharge_config_t *cfg, precharge_state_t *st,
                        const precharge_in_t *in);

/* Energise the contactor. */
static inline bool precharge_close(const precharge_state_t *st)
{
    return (st->id == PRECHARGE_CLOSING) || (st->id == PRECHARGE_CLOSED) ||
           (st->id == PRECHARGE_OPENING);
}

/* The drive may run. */
static inline bool precharge_ready(const precharge_config_t *cfg, const precharge_state_t *st)
{
    return !cfg->on || (st->id == PRECHARGE_CLOSED);
}

#endif
