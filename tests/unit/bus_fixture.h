/* A drive with a fieldbus for unit tests: one round is what a port's main loop does. */
#ifndef BUS_FIXTURE_H
#define BUS_FIXTURE_H

#include "fieldbus.h"
#include "host_port.h"
#include "unity.h"

static host_port_t port;
static params_t params;
static fieldbus_t fb;
static int flicker; /* of a word's last bit, as words have it */

static unit_t *unit(void)
{
    return &port.unit;
}

/* With the gates on 4.5 A along u, the magnetising current. */
static void rounds(uint32_t n)
{
    for (uint32_t k = 0u; k < n; k++) {
        const int i_u_counts = (unit()->asked.mode != DRIVE_OFF) ? 1204 : 0;
        flicker ^= 1;
        const hal_sample_t rest = {(uint16_t)(8192 + i_u_counts + flicker),
                                   (uint16_t)(8192 - i_u_counts / 2),
                                   (uint16_t)(8192 - i_u_counts / 2),
                                   8192u,
                                   8192u,
                                   11592u,
                                   0u,
                                   0u};
        hal_output_t out;
        const unit_command_t command = fieldbus_command(&fb, unit());
        host_port_period(&port, &command, &rest, &out);
    }
}

/* READY, its bus enabled. */
static void start_drive(void)
{
    params_default(&params);
    params.offset_calibration_s = 0.0f;
    params.observer_gain_enable = 0u;
    params.fieldbus_commands = 1u;
    params.fieldbus_timeout_s = 0.1f; /* 500 periods */
    fb = (fieldbus_t){0};
    TEST_ASSERT_TRUE(host_port_init(&port, &params, NULL));
    rounds(10u);
    TEST_ASSERT_EQUAL(SEQUENCE_READY, unit()->machine.id);
}

/* As a command of the host link that has arrived. */
static void host_commands(uint32_t command)
{
    unit()->link.command = command;
    unit()->link.commands++;
}

#endif
