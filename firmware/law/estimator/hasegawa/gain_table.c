#include "gain_table.h"

#include <stddef.h>

static bool gain_finite(const observer_gain_t *gain)
{
    return is_finite(gain->l1_re_per_s) && is_finite(gain->l1_im_per_s) &&
           is_finite(gain->l2_re_ohm) && is_finite(gain->l2_im_ohm);
}

/* Zero of either sign, without comparing floats for equality. */
static bool is_zero(float x)
{
    return absf(x) <= 0.0f;
}

observer_gain_t gain_table_entry(const gain_table_t *table, uint32_t k)
{
    return gain_table_look_up(table, k);
}

/* A whole block's residuals and the half-word behind them are there to be read. */
static bool block_inside(const gain_table_t *table, const gain_block_t *block)
{
    const uint32_t half_words = block->half_words;
    const bool known =
        (half_words == 1u) || (half_words == 2u) || (half_words == 4u) || (half_words == 8u);
    return known && (block->first + GAIN_BLOCK_ENTRIES * half_words < table->residual_count);
}

bool gain_table_valid(const gain_table_t *table)
{
    if ((table == NULL) || (table->block == NULL) || (table->residual == NULL)) {
        return false;
    }
    if ((table->magic != GAIN_TABLE_MAGIC) || (table->version != GAIN_TABLE_VERSION)) {
        return false;
    }
    if ((table->entry_count == 0u) || (table->entry_count > GAIN_TABLE_MAX_ENTRIES)) {
        return false;
    }
    for (uint32_t k = 0u; k < table->entry_count; k++) {
        if (!block_inside(table, &table->block[k / GAIN_BLOCK_ENTRIES])) {
            return false;
        }
        const observer_gain_t gain = gain_table_entry(table, k);
        if (!gain_finite(&gain)) {
            return false;
        }
    }
    /* L(-w) = conj L(w) leaves no choice at w = 0. */
    const observer_gain_t still = gain_table_entry(table, 0u);
    return positivef(table->step_rad_s) && is_zero(still.l1_im_per_s) && is_zero(still.l2_im_ohm);
}
