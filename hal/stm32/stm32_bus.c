#include "stm32_bus.h"

#include <stddef.h>

#include "num.h"

#ifdef FIELDBUS_MODBUS
#include "modbus_rtu.h"
#endif

COLD const char *stm32_bus_start(stm32_bus_t *bus, uint32_t serial_Hz, uint32_t can_Hz)
{
    const char *wrong = "";
#ifdef FIELDBUS_MODBUS
    if (!stm32_rs485_start(&bus->serial, serial_Hz, STM32_BUS_BAUD)) {
        wrong = "Modbus: no such rate\r\n";
    }
#endif
#ifdef FIELDBUS_CANOPEN
    stm32_can_timing_t timing;
    if (!stm32_can_timing(can_Hz, STM32_BUS_CAN_BAUD, &timing) ||
        !stm32_can_start(&bus->can.device, &timing, STM32_BUS_CAN_POLLS)) {
        wrong = "CAN: does not start, or no such rate\r\n";
    }
#endif
    (void)serial_Hz;
    (void)can_Hz;
    (void)bus;
    return wrong;
}

void stm32_bus_interrupt(stm32_bus_t *bus)
{
#ifdef FIELDBUS_MODBUS
    stm32_rs485_interrupt(&bus->serial);
#endif
#ifdef FIELDBUS_CANOPEN
    stm32_can_line_interrupt(&bus->can);
#endif
    (void)bus;
}

COLD unit_command_t stm32_bus_command(stm32_bus_t *bus, unit_t *unit)
{
    fieldbus_lines_t lines = {NULL, NULL};
#ifdef FIELDBUS_MODBUS
    const hal_serial_t serial = {.context = &bus->serial,
                                 .silence_us = modbus_rtu_silence_us(STM32_BUS_BAUD),
                                 .read = stm32_rs485_read,
                                 .write = stm32_rs485_write,
                                 .clock_us = stm32_rs485_clock_us};
    lines.serial = &serial;
#endif
#ifdef FIELDBUS_CANOPEN
    const hal_can_t can = {.context = &bus->can,
                           .read = stm32_can_line_read,
                           .write = stm32_can_line_write,
                           .clock_us = stm32_can_line_clock_us};
    lines.can = &can;
#endif
    fieldbus_slave_background(&bus->slave, unit, &lines);
    return fieldbus_command(&bus->slave.fieldbus, unit);
}
