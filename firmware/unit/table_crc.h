/* CRC-32C of a gain table's entries, whole or in slices. */
#ifndef TABLE_CRC_H
#define TABLE_CRC_H

#include "crc32c.h"
#include "gain_table.h"

/* CRC of everything so far and of the entries first..end-1. */
static inline uint32_t table_crc(const gain_table_t *table, uint32_t crc, uint32_t first,
                                 uint32_t end)
{
    return crc32c_update(crc, &table->entry[first], (end - first) * sizeof table->entry[0]);
}

#endif
