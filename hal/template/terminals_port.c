#include "terminals_port.h"

#ifdef ZH_TERMINALS
#include <stdbool.h>
#include <stdint.h>

/* As in main.c: goes with the stub. */
#define STUB __attribute__((noipa))

/* FILL IN: contacts as they are, 1 where closed; words left-aligned to 16 bits. False when a
 * converter or an expander does not answer: after .1 s the drive stops. Waits for nothing. */
STUB static bool read_terminals(void *context, hal_terminal_in_t *in)
{
    (void)context;
    *in = (hal_terminal_in_t){0};
    return false;
}

/* FILL IN: relays, coil of the brake, contactor, and the enable of the brake transistor's driver,
 * which is a logical AND with brake_on in hardware. What is not set is de-energised;
 * port_gates_off() de-energises all of them: the brake of a hoist closes without this program. */
STUB static void write_terminals(void *context, uint32_t outputs)
{
    (void)context;
    (void)outputs;
}

/* FILL IN: what the board has, and what its words mean. */
static const hal_terminals_t hal_terminals = {.fitted = 0u,
                                              .analog_full_scale = 12.5f,
                                              .sink_pullup_ohm = 2200.0f,
                                              .motor_pullup_ohm = 2200.0f,
                                              .read = read_terminals,
                                              .write = write_terminals};

bool terminals_port_start(terminals_port_t *port, const unit_t *unit)
{
    terminal_params_t params;
    terminal_params_default(&params); /* FILL IN: what is used; tools/docs/terminals.md */
    return terminals_init(&port->config, &params, &hal_terminals, &unit->params) == TERMINALS_OK;
}

unit_command_t terminals_port_command(terminals_port_t *port, unit_t *unit, unit_command_t posted)
{
    return terminals_command(&port->config, &port->state, unit, &hal_terminals, posted);
}
#endif
