/* A gain table of any gains, packed the plain way: lines of zero, the words themselves above them.
 */
#ifndef WHOLE_WORDS_H
#define WHOLE_WORDS_H

#include "exact.h"
#include "gain_table.h"

#define WHOLE_BLOCKS (GAIN_TABLE_MAX_ENTRIES / GAIN_BLOCK_ENTRIES + 1u)

typedef struct {
    gain_block_t block[WHOLE_BLOCKS];
    uint16_t residual[WHOLE_BLOCKS * GAIN_BLOCK_ENTRIES * 8u + 1u];
} whole_words_t;

/* table->entry_count of them. */
static inline void whole_words(whole_words_t *words, gain_table_t *table,
                               const observer_gain_t *entry)
{
    for (uint32_t b = 0u; b < WHOLE_BLOCKS; b++) {
        words->block[b] =
            (gain_block_t){.first = (uint16_t)(b * GAIN_BLOCK_ENTRIES * 8u), .half_words = 8u};
    }
    for (uint32_t k = 0u; k < table->entry_count; k++) {
        const float gain[4] = {entry[k].l1_re_per_s, entry[k].l1_im_per_s, entry[k].l2_re_ohm,
                               entry[k].l2_im_ohm};
        for (uint32_t c = 0u; c < 4u; c++) {
            words->residual[8u * k + 2u * c] = (uint16_t)(exact_bits(gain[c]) & 0xFFFFu);
            words->residual[8u * k + 2u * c + 1u] = (uint16_t)(exact_bits(gain[c]) >> 16);
        }
    }
    table->block = words->block;
    table->residual = words->residual;
    table->residual_count = sizeof words->residual / sizeof words->residual[0];
}

#endif
