#include "host_port.h"

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

bool host_port_init(host_port_t *port, const params_t *params, const gain_table_t *table)
{
    *port = (host_port_t){.background_every = HOST_PORT_BACKGROUND_EVERY,
                          .until_background = HOST_PORT_BACKGROUND_EVERY,
                          .period_us = (uint32_t)(params->period_s * 1e6f + 0.5f)};
    port->devices = (hal_devices_t){
        .context = port, .watchdog_serve = serve_watchdog, .clock_us = read_clock_us};
    return app_init(&port->app, params, table);
}

void host_port_period(host_port_t *port, const app_command_t *command, const hal_sample_t *sample,
                      hal_output_t *output)
{
    app_post_command(&port->app, command);
    app_control_period(&port->app, sample, output);
    port->clock_us += port->period_us;
    port->until_background--;
    if (port->until_background == 0u) {
        port->until_background = port->background_every;
        app_background(&port->app, &port->devices);
    }
}
