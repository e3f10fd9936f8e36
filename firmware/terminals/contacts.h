/* Contacts: debounced levels, and start and stop made of them.
 *
 * A level counts once it has stood for debounce_steps. Two wires: START closed runs. Three wires:
 * START is a push button, STOP opens to stop. START has to be seen open before it counts: after
 * power-up, and after run was taken away. A bounce at power-up does not count as open.
 */
#ifndef CONTACTS_H
#define CONTACTS_H

#include <stdbool.h>
#include <stdint.h>

#include "hal_terminals.h"
#include "num.h"

typedef enum {
    CONTACTS_OFF = 0,
    CONTACTS_TWO_WIRE = 1,
    CONTACTS_THREE_WIRE = 2
} contacts_control_t;

typedef struct {
    contacts_control_t control;
    uint32_t debounce_steps; /* at least 1 */
} contacts_config_t;

typedef struct {
    uint32_t closed; /* debounced */
    uint32_t inputs; /* as read last */
    uint32_t steps[HAL_TERMINAL_INPUTS];
    uint32_t age;    /* steps since power-up or a bounce, as far as they matter */
    bool armed;      /* START was seen open: it counts */
    bool run;        /* the contacts ask for it */
    bool reset_open; /* RESET was seen open */
    bool reset;      /* this step: it has closed */
} contacts_state_t;

/* False for a control that does not exist, or no step. */
CHECKED bool contacts_init(contacts_config_t *cfg, uint32_t control, uint32_t debounce_steps);

void contacts_step(const contacts_config_t *cfg, contacts_state_t *st, uint32_t inputs,
                   uint32_t steps);

/* Run is taken away: START has to open before it counts again. */
static inline void contacts_withdraw(contacts_state_t *st)
{
    st->run = false;
    st->armed = false;
}

static inline bool contacts_closed(const contacts_state_t *st, uint32_t input)
{
    return (st->closed & input) != 0u;
}

/* Three wires with STOP open: nobody's run command counts. */
static inline bool contacts_stop(const contacts_config_t *cfg, const contacts_state_t *st)
{
    return (cfg->control == CONTACTS_THREE_WIRE) && !contacts_closed(st, HAL_TERMINAL_STOP);
}

#endif
