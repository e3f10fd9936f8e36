/* Modbus RTU slave of one drive: functions 3, 4, 6, 16, and 8 with sub-function 0.
 *
 * Broadcasts (address 0) write and are not answered. A frame with a wrong CRC, or for another
 * address, gets no answer and changes nothing.
 */
#ifndef MODBUS_H
#define MODBUS_H

#include "hal_serial.h"
#include "modbus_map.h"
#include "modbus_rtu.h"

/* A zeroed state is valid. */
typedef struct {
    modbus_rtu_t rtu;
    uint8_t answer[MODBUS_FRAME_MAX];
    uint32_t answer_n;
    uint32_t sent; /* of the answer's bytes */
} modbus_t;

/* The answer to a PDU into `answer`, at least MODBUS_FRAME_MAX bytes; its length. */
uint32_t modbus_answer(fieldbus_t *fb, unit_t *unit, const modbus_frame_t *frame, uint8_t *answer);

/* One slice of the background: at most one request. */
void modbus_background(modbus_t *modbus, fieldbus_t *fb, unit_t *unit, const hal_serial_t *line);

#endif
