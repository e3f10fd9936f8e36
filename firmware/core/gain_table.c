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

bool gain_table_valid(const gain_table_t *table)
{
    if ((table == NULL) || (table->entry == NULL)) {
        return false;
    }
    if ((table->magic != GAIN_TABLE_MAGIC) || (table->version != GAIN_TABLE_VERSION)) {
        return false;
    }
    if ((table->entry_count == 0u) || (table->entry_count > GAIN_TABLE_MAX_ENTRIES)) {
        return false;
    }
    bool finite = positivef(table->step_rad_s);
    for (uint32_t k = 0u; k < table->entry_count; k++) {
        finite = finite && gain_finite(&table->entry[k]);
    }
    /* L(-w) = conj L(w) leaves no choice at w = 0. */
    return finite && is_zero(table->entry[0].l1_im_per_s) && is_zero(table->entry[0].l2_im_ohm);
}

observer_gain_t gain_table_at(const gain_table_t *table, float omega_e_rad_s)
{
    const float last = (float)(table->entry_count - 1u);
    float nearest = absf(omega_e_rad_s) / table->step_rad_s + 0.5f;
    if (!(nearest <= last)) {
        nearest = clampf(nearest, 0.0f, last);
    }
    const observer_gain_t *gain = &table->entry[(uint32_t)nearest];
    const bool backward = omega_e_rad_s < 0.0f;
    return (observer_gain_t){.l1_re_per_s = gain->l1_re_per_s,
                             .l1_im_per_s = backward ? -gain->l1_im_per_s : gain->l1_im_per_s,
                             .l2_re_ohm = gain->l2_re_ohm,
                             .l2_im_ohm = backward ? -gain->l2_im_ohm : gain->l2_im_ohm};
}
