/* Frames of Modbus RTU: bytes with their times in, a whole and checked frame out.
 *
 * A frame ends with a silence of 3.5 characters. Times wrap; the port says when a byte came.
 */
#ifndef MODBUS_RTU_H
#define MODBUS_RTU_H

#include <stdbool.h>
#include <stdint.h>

#include "num.h"

#define MODBUS_FRAME_MAX 256u /* address, function and data, CRC */
#define MODBUS_CRC_BYTES 2u
#define MODBUS_FRAME_MIN 4u

/* A zeroed state is valid. */
typedef struct {
    uint8_t byte[MODBUS_FRAME_MAX];
    uint32_t length;
    uint32_t last_us; /* time of the last byte */
    bool overlong;
    uint32_t good; /* counters, wrap */
    uint32_t bad;
} modbus_rtu_t;

/* Owned by the receiver; valid until its next byte. */
typedef struct {
    uint8_t address;
    const uint8_t *pdu; /* function and data */
    uint32_t pdu_bytes;
} modbus_frame_t;

/* 3.5 characters of 11 bits; 1750 us above 19 200 baud. baud > 0. */
uint32_t modbus_rtu_silence_us(uint32_t baud);

/* True when the silence before now_us ended a frame with a correct CRC. Asked before every byte,
 * with its time, and when none has come. */
CHECKED bool modbus_rtu_ended(modbus_rtu_t *rtu, uint32_t silence_us, uint32_t now_us,
                              modbus_frame_t *frame);

void modbus_rtu_byte(modbus_rtu_t *rtu, uint8_t byte, uint32_t at_us);

#endif
