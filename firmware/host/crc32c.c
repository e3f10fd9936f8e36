#include "crc32c.h"

/* CRC of each nibble; entry 8 is the polynomial. */
static const uint32_t nibble_crc[] = {
    0x00000000u, 0x105EC76Fu, 0x20BD8EDEu, 0x30E349B1u, 0x417B1DBCu, 0x5125DAD3u,
    0x61C69362u, 0x7198540Du, 0x82F63B78u, 0x92A8FC17u, 0xA24BB5A6u, 0xB21572C9u,
    0xC38D26C4u, 0xD3D3E1ABu, 0xE330A81Au, 0xF36E6F75u,
};

uint32_t crc32c_update(uint32_t crc, const void *data, size_t n)
{
    const uint8_t *byte = data;
    uint32_t remainder = ~crc;
    for (size_t k = 0u; k < n; k++) {
        remainder ^= byte[k];
        remainder = (remainder >> 4) ^ nibble_crc[remainder & 15u];
        remainder = (remainder >> 4) ^ nibble_crc[remainder & 15u];
    }
    return ~remainder;
}

uint32_t crc32c(const void *data, size_t n)
{
    return crc32c_update(0u, data, n);
}
