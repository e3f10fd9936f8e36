/* The fieldbuses of an image, as ZH_FIELDBUS has them, on the lines that its port has.
 *
 * In each round of its background a port calls fieldbus_slave_background() and posts what
 * fieldbus_command(&slave.fieldbus, ...) returns. Another source of commands adds its own to that
 * unit_command_t before it is posted.
 */
#ifndef FIELDBUS_SLAVE_H
#define FIELDBUS_SLAVE_H

#include "fieldbus.h"
#include "hal_can.h"
#include "hal_serial.h"

#ifdef FIELDBUS_MODBUS
#include "modbus.h"
#endif
#ifdef FIELDBUS_CANOPEN
#include "canopen.h"
#endif

/* NULL: no such line. */
typedef struct {
    const hal_serial_t *serial;
    const hal_can_t *can;
} fieldbus_lines_t;

/* A zeroed state is valid. */
typedef struct {
    fieldbus_t fieldbus;
#ifdef FIELDBUS_MODBUS
    modbus_t modbus;
#endif
#ifdef FIELDBUS_CANOPEN
    canopen_t canopen;
#endif
} fieldbus_slave_t;

/* One slice: at most one request of each bus. */
void fieldbus_slave_background(fieldbus_slave_t *slave, unit_t *unit,
                               const fieldbus_lines_t *lines);

#endif
