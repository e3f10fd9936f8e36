/* Observer gain L over speed: nearest entry of a table with one entry per 2 elec. min^-1.
 *
 * xh' = A(wh) xh + B u_s + L e1, L = [l1; l2] complex, e1 = i_s_hat - i_s (eq. (3), (17)). L(-w) =
 * conj L(w); beyond the end of the table the last entry applies. Tables are designed and proven
 * offline (tools/zh design, tools/zh certify). The table belongs to the motor, whatever estimator
 * is linked.
 */
#ifndef GAIN_TABLE_H
#define GAIN_TABLE_H

#include <stdbool.h>
#include <stdint.h>

#include "num.h"

#define GAIN_TABLE_MAGIC       0x5A48474Cu /* "ZHGL" */
#define GAIN_TABLE_VERSION     3u
#define GAIN_TABLE_MAX_ENTRIES 2048u

typedef struct {
    float l1_re_per_s;
    float l1_im_per_s;
    float l2_re_ohm;
    float l2_im_ohm;
} observer_gain_t;

typedef struct {
    uint32_t magic;
    uint32_t version;
    uint32_t motor_id; /* CRC-32C of the motor data the table was designed for */
    uint32_t entry_count;
    uint32_t crc32c;  /* of the entries, little-endian words in order */
    float step_rad_s; /* electrical speed between entries */
    const observer_gain_t *entry;
} gain_table_t;

/* Identifies the table that a set of parameters belongs to. */
typedef struct {
    uint32_t motor_id;
    uint32_t crc32c;
} gain_table_id_t;

/* Same machine and same gains; table must not be NULL. */
static inline bool gain_table_is(const gain_table_t *table, const gain_table_id_t *id)
{
    return (table->motor_id == id->motor_id) && (table->crc32c == id->crc32c);
}

/* True if the table is usable: not NULL; header, count and step valid; every gain finite; L(0)
 * real. */
CHECKED bool gain_table_valid(const gain_table_t *table);

/* Number of the last entry. */
static inline float gain_table_last(const gain_table_t *table)
{
    return (float)(table->entry_count - 1u);
}

/* Number of the nearest entry, less than one above it; the table may have fewer. */
static inline float gain_table_nearest(const gain_table_t *table, float omega_e_rad_s)
{
    return absf(omega_e_rad_s) / table->step_rad_s + 0.5f;
}

/* L of the entry of that number, within 0 and the last. */
INLINE static inline observer_gain_t gain_table_entry(const gain_table_t *table, float number,
                                                      float omega_e_rad_s)
{
    observer_gain_t gain = table->entry[(uint32_t)number];
    if (omega_e_rad_s < 0.0f) {
        gain.l1_im_per_s = -gain.l1_im_per_s;
        gain.l2_im_ohm = -gain.l2_im_ohm;
    }
    return gain;
}

/* L at the speed; table must be valid; a NaN speed reads entry 0. */
static inline observer_gain_t gain_table_at(const gain_table_t *table, float omega_e_rad_s)
{
    const float nearest = gain_table_nearest(table, omega_e_rad_s);
    const float number = clampf(nearest, 0.0f, gain_table_last(table));
    return gain_table_entry(table, number, omega_e_rad_s);
}

#endif
