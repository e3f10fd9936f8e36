#include "gain_table.h"

#include <stddef.h>

static bool head_valid(const gain_table_t *table)
{
    return (table->entry != NULL) && (table->magic == GAIN_TABLE_MAGIC) &&
           (table->version == GAIN_TABLE_VERSION) && (table->entry_count > 0u) &&
           (table->entry_count <= GAIN_TABLE_MAX_ENTRIES);
}

static bool gain_finite(const observer_gain_t *gain)
{
    return ALL_FINITE(gain->l1_re_per_s, gain->l1_im_per_s, gain->l2_re_ohm, gain->l2_im_ohm);
}

bool gain_table_valid(const gain_table_t *table)
{
    if ((table == NULL) || !head_valid(table)) {
        return false;
    }
    for (uint32_t k = 0u; k < table->entry_count; k++) {
        if (!gain_finite(&table->entry[k])) {
            return false;
        }
    }
    /* L(-w) = conj L(w) leaves no choice at w = 0. */
    return positivef(table->step_rad_s) && is_zero(table->entry[0].l1_im_per_s) &&
           is_zero(table->entry[0].l2_im_ohm);
}
