/* CRC-32C (Castagnoli, reflected polynomial 82F63B78): the checksum of table, store and image.
 *
 * Initial value and final inversion are inside: start with 0, and pass the result of one call to
 * the next. Four bits per look-up: 64 bytes of table.
 */
#ifndef CRC32C_H
#define CRC32C_H

#include <stddef.h>
#include <stdint.h>

/* CRC of everything so far and these bytes; crc is 0 before the first. */
uint32_t crc32c_update(uint32_t crc, const void *data, size_t n);

/* CRC of these bytes alone. */
uint32_t crc32c(const void *data, size_t n);

#endif
