/* Terminals of this board, where the image has them (ZH_TERMINALS); without, every command passes.
 */
#ifndef TERMINALS_PORT_H
#define TERMINALS_PORT_H

#include "unit.h"

#ifdef ZH_TERMINALS
#include "terminals.h"

/* Zeroed: every output off. */
typedef struct {
    terminals_config_t config;
    terminals_state_t state;
} terminals_port_t;

/* False: the board does not have what the parameters ask for. */
CHECKED bool terminals_port_start(terminals_port_t *port, const unit_t *unit);

/* Last before the mailbox. */
unit_command_t terminals_port_command(terminals_port_t *port, unit_t *unit, unit_command_t posted);
#else
typedef struct {
    uint32_t none;
} terminals_port_t;

static inline bool terminals_port_start(terminals_port_t *port, const unit_t *unit)
{
    (void)port;
    (void)unit;
    return true;
}

static inline unit_command_t terminals_port_command(terminals_port_t *port, unit_t *unit,
                                                    unit_command_t posted)
{
    (void)port;
    (void)unit;
    return posted;
}
#endif

#endif
