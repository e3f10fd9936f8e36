#include "fieldbus_slave.h"

#include <stddef.h>

void fieldbus_slave_background(fieldbus_slave_t *slave, unit_t *unit, const fieldbus_lines_t *lines)
{
#ifdef FIELDBUS_MODBUS
    if (lines->serial != NULL) {
        modbus_background(&slave->modbus, &slave->fieldbus, unit, lines->serial);
    }
#endif
#ifdef FIELDBUS_CANOPEN
    if (lines->can != NULL) {
        const canopen_drive_t drive = {&slave->fieldbus, unit};
        canopen_background(&slave->canopen, &drive, lines->can);
    }
#endif
}
