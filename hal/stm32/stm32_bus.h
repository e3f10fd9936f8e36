/* The fieldbus of an image, as ZH_FIELDBUS has it: slave, lines, interrupt. Without one the host
 * link alone commands.
 */
#ifndef STM32_BUS_H
#define STM32_BUS_H

#include "unit.h"

#ifdef ZH_FIELDBUS
#include "fieldbus_slave.h"
#include "stm32_can_line.h"
#include "stm32_rs485.h"

#define STM32_BUS_BAUD      19200u  /* Modbus: its default */
#define STM32_BUS_CAN_BAUD  500000u /* CANopen */
#define STM32_BUS_CAN_POLLS 100000u /* a frame under way takes .3 ms */

/* Zeroed but for the lines' devices. */
typedef struct {
    fieldbus_slave_t slave;
    stm32_rs485_t serial;
    stm32_can_line_t can;
} stm32_bus_t;

/* What is wrong, or an empty text: the drive runs all the same. Clocks are those of the devices. */
const char *stm32_bus_start(stm32_bus_t *bus, uint32_t serial_Hz, uint32_t can_Hz);

/* In the interrupts of both lines. */
void stm32_bus_interrupt(stm32_bus_t *bus);

/* In place of unit_link_command(), in each round of the background: a slice of the slave, then the
 * present command of host link and bus. */
unit_command_t stm32_bus_command(stm32_bus_t *bus, unit_t *unit);

#else

typedef uint8_t stm32_bus_t;

static inline unit_command_t stm32_bus_command(stm32_bus_t *bus, unit_t *unit)
{
    (void)bus;
    return unit_link_command(unit);
}

#endif
#endif
