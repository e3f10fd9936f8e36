#include "modbus_crc.h"

#define START      0xFFFFu
#define POLYNOMIAL 0xA001u

uint16_t modbus_crc(const uint8_t *byte, uint32_t n)
{
    uint32_t crc = START;
    for (uint32_t k = 0u; k < n; k++) {
        crc ^= byte[k];
        for (uint32_t bit = 0u; bit < 8u; bit++) {
            crc = ((crc & 1u) != 0u) ? ((crc >> 1) ^ POLYNOMIAL) : (crc >> 1);
        }
    }
    return (uint16_t)crc;
}
