/* CRC-16 of Modbus: polynomial 0x8005 reflected, start 0xFFFF. Bit by bit: a frame is short. */
#ifndef MODBUS_CRC_H
#define MODBUS_CRC_H

#include <stdint.h>

/* Goes on the line low byte first. */
uint16_t modbus_crc(const uint8_t *byte, uint32_t n);

#endif
