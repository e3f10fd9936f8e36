/* Host port: the application as an object, for host_sim and tests; devices are counters.
 *
 * Many instances in one process; no instance knows another.
 */
#ifndef HOST_PORT_H
#define HOST_PORT_H

#include "unit.h"

/* The line of the host link: received bytes for the drive, and space for its answers. */
typedef struct {
    const uint8_t *received;
    uint32_t received_n;
    uint32_t taken;
    uint8_t *sent;
    uint32_t room;
    uint32_t sent_n;
} host_port_line_t;

/* Devices of a board for stored parameters. */
typedef struct {
    const hal_flash_t *flash;
    const uint8_t *access_key;
    bool (*entropy)(void *context, uint64_t *bits);
} host_port_store_t;

typedef struct {
    unit_t unit;
    hal_devices_t devices;
    uint32_t watchdog_served;
    uint32_t clock_us;
    uint32_t period_us;
    uint32_t background_every; /* periods between two background calls */
    uint32_t until_background;
    host_port_line_t line; /* zeroed: no host */
    bool recording;
} host_port_t;

/* False when the application refused the parameters or the table; it can still be stepped. */
CHECKED bool host_port_init(host_port_t *port, const params_t *params, const gain_table_t *table);

/* After host_port_init: restarts with the content of `flash` and a key, as a board starts. The
 * caller owns all of them, and *params; entropy supplies the nonces and may be NULL. */
CHECKED bool host_port_start(host_port_t *port, const params_t *params, const gain_table_t *table,
                             const host_port_store_t *store);

/* Trace and fault record from the next period on; the caller owns the memory. */
void host_port_record(host_port_t *port, const unit_memory_t *memory);

/* One period, and the background function every background_every-th call. */
void host_port_period(host_port_t *port, const unit_command_t *command, const hal_sample_t *sample,
                      hal_output_t *output);

#endif
