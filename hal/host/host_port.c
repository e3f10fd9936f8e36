#include "host_port.h"

#include "unit_record.h"

#define HOST_PORT_BACKGROUND_EVERY 10u

static void serve_watchdog(void *context)
{
    host_port_t *port = (host_port_t *)context;
    port->watchdog_served++;
}

static uint32_t read_clock_us(void *context)
{
    const host_port_t *port = (const host_port_t *)context;
    return port->clock_us;
}

static bool read_line(void *context, uint8_t *byte)
{
    host_port_line_t *line = &((host_port_t *)context)->line;
    if (line->taken >= line->received_n) {
        return false;
    }
    *byte = line->received[line->taken];
    line->taken++;
    return true;
}

static uint32_t write_line(void *context, const uint8_t *data, uint32_t n)
{
    host_port_line_t *line = &((host_port_t *)context)->line;
    uint32_t k = 0u;
    while ((k < n) && (line->sent_n < line->room)) {
        line->sent[line->sent_n] = data[k];
        line->sent_n++;
        k++;
    }
    return k;
}

bool host_port_init(host_port_t *port, const params_t *params, const gain_table_t *table)
{
    *port = (host_port_t){.background_every = HOST_PORT_BACKGROUND_EVERY,
                          .until_background = HOST_PORT_BACKGROUND_EVERY,
                          .period_us = (uint32_t)(params->period_s * 1e6f + 0.5f)};
    port->devices = (hal_devices_t){.context = port,
                                    .watchdog_serve = serve_watchdog,
                                    .clock_us = read_clock_us,
                                    .link_read = read_line,
                                    .link_write = write_line,
                                    .identity = "ZeroHertz port=host"};
    return unit_init(&port->unit, params, table);
}

bool host_port_start(host_port_t *port, const params_t *params, const gain_table_t *table,
                     const host_port_store_t *store)
{
    port->devices.flash = store->flash;
    port->devices.access_key = store->access_key;
    port->devices.entropy = store->entropy;
    return unit_start(&port->unit, params, table, &port->devices);
}

void host_port_record(host_port_t *port, const unit_memory_t *memory)
{
    unit_record_init(&port->unit, memory);
    port->recording = true;
}

/* Not inlined: `zh bench --peer` counts its instructions by name. */
__attribute__((noinline)) void host_port_period(host_port_t *port, const unit_command_t *command,
                                                const hal_sample_t *sample, hal_output_t *output)
{
    unit_post_command(&port->unit, command);
    unit_control_period(&port->unit, sample, output);
    if (port->recording) {
        unit_record_period(&port->unit, sample, output);
    }
    port->clock_us += port->period_us;
    port->until_background--;
    if (port->until_background == 0u) {
        port->until_background = port->background_every;
        unit_background(&port->unit, &port->devices);
    }
}
