/* The firmware's CRC-32C at four bytes per look-up, in place of its own four bits: nine tenths of a
 * campaign's time went there. powercut.c compares it with the published check value. */
#include "crc32c.h"

#include <stdbool.h>
#include <string.h>

static uint32_t table[4][256];
static bool made;

static void make(void)
{
    for (uint32_t n = 0u; n < 256u; n++) {
        uint32_t crc = n;
        for (int bit = 0; bit < 8; bit++) {
            crc = ((crc & 1u) != 0u) ? ((crc >> 1) ^ 0x82F63B78u) : (crc >> 1);
        }
        table[0][n] = crc;
    }
    for (uint32_t k = 1u; k < 4u; k++) {
        for (uint32_t n = 0u; n < 256u; n++) {
            table[k][n] = (table[k - 1u][n] >> 8) ^ table[0][table[k - 1u][n] & 255u];
        }
    }
    made = true;
}

uint32_t crc32c_update(uint32_t crc, const void *data, size_t n)
{
    if (!made) {
        make();
    }
    const uint8_t *byte = data;
    uint32_t remainder = ~crc;
    for (; n >= 4u; n -= 4u, byte += 4) {
        uint32_t word;
        memcpy(&word, byte, sizeof word);
        remainder ^= word;
        remainder = table[3][remainder & 255u] ^ table[2][(remainder >> 8) & 255u] ^
                    table[1][(remainder >> 16) & 255u] ^ table[0][remainder >> 24];
    }
    for (; n > 0u; n--, byte++) {
        remainder = (remainder >> 8) ^ table[0][(remainder ^ *byte) & 255u];
    }
    return ~remainder;
}

uint32_t crc32c(const void *data, size_t n)
{
    return crc32c_update(0u, data, n);
}
