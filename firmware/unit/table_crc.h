/* CRC-32C of a gain table's entries, whole or in slices. */
#ifndef TABLE_CRC_H
#define TABLE_CRC_H

#include "crc32c.h"
#include "gain_table.h"

/* CRC of everything so far and of the entries first..end-1. */
static inline uint32_t table_crc(const gain_table_t *table, uint32_t crc, uint32_t first,
                                 uint32_t end)
{
    for (uint32_t k = first; k < end; k++) {
        const observer_gain_t gain = gain_table_entry(table, k);
        crc = crc32c_update(crc, &gain, sizeof gain);
    }
    return crc;
}

#endif
