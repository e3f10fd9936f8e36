#include "bus.h"

#include "semihosting.h"

#define SILENCE_US 1750u /* of 115 200 baud */

static uint32_t clock_us(void *context)
{
    const bus_line_t *const line = (const bus_line_t *)context;
    return line->unit->period_count * PIL_PERIOD_US;
}

/* Whether the next frame is there by now. */
static bool came(bus_line_t *line)
{
    if (!line->waits && (line->heard >= 0)) {
        line->waits = semihosting_read(line->heard, &line->next, sizeof line->next);
        line->heard = line->waits ? line->heard : -1;
        line->taken = 0u;
    }
    return line->waits && (clock_us(line) >= line->next.at_us);
}

static bool say(bus_line_t *line, uint16_t id, const uint8_t *data, uint32_t n)
{
    pil_frame_t frame = {.at_us = clock_us(line), .id = id, .length = (uint8_t)n};
    for (uint32_t k = 0u; k < n; k++) {
        frame.data[k] = data[k];
    }
    return semihosting_write(line->said, &frame, sizeof frame);
}

static bool serial_read(void *context, uint8_t *byte, uint32_t *at_us)
{
    bus_line_t *const line = (bus_line_t *)context;
    if (!came(line)) {
        return false;
    }
    *byte = line->next.data[line->taken];
    *at_us = line->next.at_us;
    line->taken++;
    line->waits = line->taken < line->next.length;
    return true;
}

static uint32_t serial_write(void *context, const uint8_t *data, uint32_t n)
{
    const uint32_t most = (n < HAL_CAN_BYTES) ? n : HAL_CAN_BYTES;
    return say((bus_line_t *)context, 0u, data, most) ? most : 0u;
}

static bool can_read(void *context, hal_can_frame_t *frame)
{
    bus_line_t *const line = (bus_line_t *)context;
    if (!came(line)) {
        return false;
    }
    *frame = (hal_can_frame_t){.id = line->next.id, .length = line->next.length};
    for (uint32_t k = 0u; k < frame->length; k++) {
        frame->data[k] = line->next.data[k];
    }
    line->waits = false;
    return true;
}

static bool can_write(void *context, const hal_can_frame_t *frame)
{
    return say((bus_line_t *)context, frame->id, frame->data, frame->length);
}

static bool open_line(bus_line_t *line, const unit_t *unit, const char *heard, const char *said)
{
    line->unit = unit;
    line->heard = semihosting_open(heard, SEMIHOSTING_READ);
    if (line->heard < 0) {
        return false;
    }
    line->said = semihosting_open(said, SEMIHOSTING_WRITE);
    return true;
}

void bus_connect(bus_t *bus, const unit_t *unit)
{
    const bool modbus = open_line(&bus->modbus, unit, PIL_MODBUS_HEARD, PIL_MODBUS_SAID);
    const bool can = open_line(&bus->can, unit, PIL_CAN_HEARD, PIL_CAN_SAID);
    bus->on = modbus || can;
}

void bus_background(bus_t *bus, unit_t *unit)
{
    if (!bus->on) {
        return;
    }
    const hal_serial_t serial = {&bus->modbus, SILENCE_US, serial_read, serial_write, clock_us};
    const hal_can_t can = {&bus->can, can_read, can_write, clock_us};
    fieldbus_slave_background(&bus->slave, unit, &(fieldbus_lines_t){&serial, &can});
    const unit_command_t command = fieldbus_command(&bus->slave.fieldbus, unit);
    unit_post_command(unit, &command);
}
