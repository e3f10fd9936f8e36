#include "modbus_rtu.h"

#include "modbus_crc.h"

#define HALF_BITS    77u /* of 3.5 characters of 11 bits */
#define FAST_BAUD    19200u
#define FAST_US      1750u
#define HALF_BITS_US 500000u

uint32_t modbus_rtu_silence_us(uint32_t baud)
{
    if (baud > FAST_BAUD) {
        return FAST_US;
    }
    return (HALF_BITS * HALF_BITS_US + baud - 1u) / baud;
}

static bool check(const modbus_rtu_t *rtu, modbus_frame_t *frame)
{
    if (rtu->overlong || (rtu->length < MODBUS_FRAME_MIN)) {
        return false;
    }
    const uint32_t covered = rtu->length - MODBUS_CRC_BYTES;
    const uint32_t crc = (uint32_t)rtu->byte[covered] | ((uint32_t)rtu->byte[covered + 1u] << 8);
    *frame =
        (modbus_frame_t){.address = rtu->byte[0], .pdu = &rtu->byte[1], .pdu_bytes = covered - 1u};
    return crc == modbus_crc(rtu->byte, covered);
}

bool modbus_rtu_ended(modbus_rtu_t *rtu, uint32_t silence_us, uint32_t now_us,
                      modbus_frame_t *frame)
{
    if ((rtu->length == 0u) || ((now_us - rtu->last_us) < silence_us)) {
        return false;
    }
    const bool good = check(rtu, frame);
    rtu->good += good ? 1u : 0u;
    rtu->bad += good ? 0u : 1u;
    rtu->length = 0u;
    rtu->overlong = false;
    return good;
}

void modbus_rtu_byte(modbus_rtu_t *rtu, uint8_t byte, uint32_t at_us)
{
    rtu->last_us = at_us;
    if (rtu->length < MODBUS_FRAME_MAX) {
        rtu->byte[rtu->length] = byte;
        rtu->length++;
    } else {
        rtu->overlong = true;
    }
}
