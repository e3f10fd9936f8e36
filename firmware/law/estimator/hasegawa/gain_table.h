/* Observer gain L over speed: nearest entry of a table with one entry per 2 elec. min^-1.
 *
 * xh' = A(wh) xh + B u_s + L e1, L = [l1; l2] complex, e1 = i_s_hat - i_s (eq. (3), (17)).
 * L(-w) = conj L(w); beyond the table's end the last entry holds (with weakening drive.c turns it).
 * Designed and proven offline (tools/zh design, tools/zh certify).
 *
 * A table is packed without loss: seen as 32-bit words each column is nearly a straight line, so a
 * block of 16 entries keeps that line and, per entry, what the words lie above it. Flash is what a
 * controller is short of, and this takes 12 KB instead of 28 (gain_tables/README.md).
 */
#ifndef GAIN_TABLE_H
#define GAIN_TABLE_H

#include <stdbool.h>
#include <stdint.h>

#include "num.h"

#define GAIN_TABLE_MAGIC       0x5A48474Cu /* "ZHGL" */
#define GAIN_TABLE_VERSION     2u
#define GAIN_TABLE_MAX_ENTRIES 2048u
#define GAIN_BLOCK_ENTRIES     16u

typedef struct {
    float l1_re_per_s;
    float l1_im_per_s;
    float l2_re_ohm;
    float l2_im_ohm;
} observer_gain_t;

/* A column of a block: the word of its n-th entry is base + n slope + residual, modulo 2^32. */
typedef struct {
    uint32_t base;
    uint32_t slope;
} gain_line_t;

typedef struct {
    uint16_t first;      /* where the residuals of the block begin */
    uint16_t half_words; /* of residuals per entry: 1, 2, 4 or 8, which tells their layout */
    gain_line_t line[4]; /* in the order of observer_gain_t */
} gain_block_t;

typedef struct {
    uint32_t magic;
    uint32_t version;
    uint32_t motor_id; /* CRC-32C of the motor data the table was designed for */
    uint32_t entry_count;
    uint32_t crc32c;  /* of the unpacked entries, little-endian words in order */
    float step_rad_s; /* electrical speed between entries */
    const gain_block_t *block;
    const uint16_t *residual;
    uint32_t residual_count;
} gain_table_t;

/* Which table a set of parameters belongs to. */
typedef struct {
    uint32_t motor_id;
    uint32_t crc32c;
} gain_table_id_t;

/* The same machine and the same gains; table must not be NULL. */
static inline bool gain_table_is(const gain_table_t *table, const gain_table_id_t *id)
{
    return (table->motor_id == id->motor_id) && (table->crc32c == id->crc32c);
}

/* The table can be used: not NULL, header, count, step, every block's residuals inside the table,
 * every gain finite, L(0) real. */
CHECKED bool gain_table_valid(const gain_table_t *table);

/* Entry k < entry_count of a valid table, word for word as it was designed. */
observer_gain_t gain_table_entry(const gain_table_t *table, uint32_t k);

static inline float gain_on_line(gain_line_t line, uint32_t n, uint32_t residual)
{
    return float_of_bits(line.base + n * line.slope + residual);
}

/* Residuals are bit fields, as narrow as the block allows, from the least bit on: in one half-word
 * l1_re 1, l1_im 3, l2_re 4, l2_im 8; in two 5, 5, 9, 13; in four 6, 18, 18, 22; in eight whole
 * words, for where a gain passes zero. The second half-word is read in any case. */
INLINE static inline observer_gain_t gain_unpacked(const gain_block_t *block, uint32_t n,
                                                   const uint16_t *at)
{
    const uint32_t low = at[0] | ((uint32_t)at[1] << 16);
    uint32_t l1_re = low;
    uint32_t l1_im;
    uint32_t l2_re;
    uint32_t l2_im;
    if (block->half_words == 1u) {
        l1_re = low & 1u;
        l1_im = (low >> 1) & 7u;
        l2_re = (low >> 4) & 15u;
        l2_im = (low >> 8) & 255u;
    } else if (block->half_words == 2u) {
        l1_re = low & 31u;
        l1_im = (low >> 5) & 31u;
        l2_re = (low >> 10) & 511u;
        l2_im = low >> 19;
    } else if (block->half_words == 4u) {
        const uint32_t high = at[2] | ((uint32_t)at[3] << 16);
        l1_re = low & 63u;
        l1_im = (low >> 6) & 0x3FFFFu;
        l2_re = ((low >> 24) | (high << 8)) & 0x3FFFFu;
        l2_im = high >> 10;
    } else {
        l1_im = at[2] | ((uint32_t)at[3] << 16);
        l2_re = at[4] | ((uint32_t)at[5] << 16);
        l2_im = at[6] | ((uint32_t)at[7] << 16);
    }
    return (observer_gain_t){.l1_re_per_s = gain_on_line(block->line[0], n, l1_re),
                             .l1_im_per_s = gain_on_line(block->line[1], n, l1_im),
                             .l2_re_ohm = gain_on_line(block->line[2], n, l2_re),
                             .l2_im_ohm = gain_on_line(block->line[3], n, l2_im)};
}

/* gain_table_entry for the control period, where a call would cost as much as the look-up. */
INLINE static inline observer_gain_t gain_table_look_up(const gain_table_t *table, uint32_t k)
{
    const gain_block_t *block = &table->block[k / GAIN_BLOCK_ENTRIES];
    const uint32_t n = k % GAIN_BLOCK_ENTRIES;
    return gain_unpacked(block, n, &table->residual[block->first + n * block->half_words]);
}

/* L at the speed; table must be valid; a NaN speed reads entry 0. */
INLINE static inline observer_gain_t gain_table_at(const gain_table_t *table, float omega_e_rad_s)
{
    const float last = (float)(table->entry_count - 1u);
    float nearest = absf(omega_e_rad_s) / table->step_rad_s + 0.5f;
    if (!(nearest <= last)) {
        nearest = clampf(nearest, 0.0f, last);
    }
    observer_gain_t gain = gain_table_look_up(table, (uint32_t)nearest);
    if (omega_e_rad_s < 0.0f) {
        gain.l1_im_per_s = -gain.l1_im_per_s;
        gain.l2_im_ohm = -gain.l2_im_ohm;
    }
    return gain;
}

#endif
