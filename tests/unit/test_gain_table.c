#include "gain_table.h"

#include <stddef.h>

#include "exact.h"
#include "whole_words.h"

#define ENTRIES    5u
#define STEP_RAD_S 0.25f /* a power of two: half steps are exact */

static const observer_gain_t gains[ENTRIES] = {
    {10.0f, 0.0f, 20.0f, -0.0f},    {11.0f, 31.0f, 21.0f, 41.0f},   {12.0f, 32.0f, 22.0f, 42.0f},
    {13.0f, -33.0f, 23.0f, -43.0f}, {-14.0f, 34.0f, -24.0f, 44.0f},
};

static gain_table_t table;
static observer_gain_t entries[ENTRIES];
static whole_words_t packed;

void setUp(void)
{
    memcpy(entries, gains, sizeof entries);
    table = (gain_table_t){.magic = GAIN_TABLE_MAGIC,
                           .version = GAIN_TABLE_VERSION,
                           .motor_id = 1u,
                           .entry_count = ENTRIES,
                           .crc32c = 2u,
                           .step_rad_s = STEP_RAD_S};
    whole_words(&packed, &table, entries);
}

void tearDown(void)
{
}

static void assert_entry(uint32_t expected, float omega_e_rad_s)
{
    const observer_gain_t gain = gain_table_at(&table, omega_e_rad_s);
    ASSERT_SAME_FLOAT(entries[expected].l1_re_per_s, gain.l1_re_per_s);
    ASSERT_SAME_FLOAT(entries[expected].l1_im_per_s, gain.l1_im_per_s);
    ASSERT_SAME_FLOAT(entries[expected].l2_re_ohm, gain.l2_re_ohm);
    ASSERT_SAME_FLOAT(entries[expected].l2_im_ohm, gain.l2_im_ohm);
}

static void assert_conjugate(uint32_t expected, float omega_e_rad_s)
{
    const observer_gain_t gain = gain_table_at(&table, omega_e_rad_s);
    ASSERT_SAME_FLOAT(entries[expected].l1_re_per_s, gain.l1_re_per_s);
    ASSERT_SAME_FLOAT(-entries[expected].l1_im_per_s, gain.l1_im_per_s);
    ASSERT_SAME_FLOAT(entries[expected].l2_re_ohm, gain.l2_re_ohm);
    ASSERT_SAME_FLOAT(-entries[expected].l2_im_ohm, gain.l2_im_ohm);
}

static void test_speed_of_an_entry_gives_the_entry(void)
{
    for (uint32_t k = 0u; k < ENTRIES; k++) {
        assert_entry(k, (float)k * STEP_RAD_S);
    }
}

static void test_speed_between_entries_gives_the_nearer_one(void)
{
    for (uint32_t k = 1u; k < ENTRIES; k++) {
        const float middle = ((float)k - 0.5f) * STEP_RAD_S;
        assert_entry(k - 1u, middle - 0.01f);
        assert_entry(k, middle + 0.01f);
    }
}

static void test_half_a_step_is_rounded_up(void)
{
    for (uint32_t k = 1u; k < ENTRIES; k++) {
        assert_entry(k, ((float)k - 0.5f) * STEP_RAD_S);
    }
}

static void test_negative_speed_gives_the_conjugate(void)
{
    for (uint32_t k = 1u; k < ENTRIES; k++) {
        assert_conjugate(k, -(float)k * STEP_RAD_S);
    }
    assert_conjugate(0u, -0.01f);
}

static void test_zero_of_either_sign_gives_entry_0(void)
{
    assert_entry(0u, 0.0f);
    assert_entry(0u, -0.0f);
}

static void test_last_entry_holds_beyond_the_end(void)
{
    assert_entry(ENTRIES - 1u, 5.0f * STEP_RAD_S);
    assert_entry(ENTRIES - 1u, FLT_MAX);
    assert_entry(ENTRIES - 1u, INFINITY);
    assert_conjugate(ENTRIES - 1u, -5.0f * STEP_RAD_S);
    assert_conjugate(ENTRIES - 1u, -INFINITY);
}

static void test_nan_speed_gives_entry_0(void)
{
    assert_entry(0u, NAN);
}

/* The real grid, 2 elec. min^-1 = 2 * 2 pi/60 rad/s, is not exact in float. */
static void test_every_entry_of_the_real_grid_is_found(void)
{
    static observer_gain_t many[1801];
    table.entry_count = 1801u;
    table.step_rad_s = 0.209439510f;
    for (uint32_t k = 0u; k < 1801u; k++) {
        many[k].l1_re_per_s = (float)k;
    }
    whole_words(&packed, &table, many);
    for (uint32_t k = 0u; k < 1801u; k++) {
        const double omega = k * 2.0 * 2.0 * 3.14159265358979323846 / 60.0;
        ASSERT_SAME_FLOAT((float)k, gain_table_at(&table, (float)omega).l1_re_per_s);
        ASSERT_SAME_FLOAT((float)k, gain_table_at(&table, (float)(omega + 0.1)).l1_re_per_s);
    }
}

static void test_sound_table_is_valid(void)
{
    TEST_ASSERT_TRUE(gain_table_valid(&table));
}

static void test_missing_table_is_refused(void)
{
    TEST_ASSERT_FALSE(gain_table_valid(NULL));
    table.block = NULL;
    TEST_ASSERT_FALSE(gain_table_valid(&table));
    whole_words(&packed, &table, entries);
    table.residual = NULL;
    TEST_ASSERT_FALSE(gain_table_valid(&table));
}

static void test_foreign_header_is_refused(void)
{
    table.magic ^= 1u;
    TEST_ASSERT_FALSE(gain_table_valid(&table));
    table.magic = GAIN_TABLE_MAGIC;
    table.version++;
    TEST_ASSERT_FALSE(gain_table_valid(&table));
}

static void test_entry_count_is_between_one_and_the_maximum(void)
{
    table.entry_count = 0u;
    TEST_ASSERT_FALSE(gain_table_valid(&table));
    table.entry_count = 1u;
    TEST_ASSERT_TRUE(gain_table_valid(&table));
    table.entry_count = GAIN_TABLE_MAX_ENTRIES;
    TEST_ASSERT_TRUE(gain_table_valid(&table));
    table.entry_count = GAIN_TABLE_MAX_ENTRIES + 1u;
    TEST_ASSERT_FALSE(gain_table_valid(&table));
}

static void test_step_has_to_be_positive(void)
{
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        table.step_rad_s = not_positive(k);
        TEST_ASSERT_FALSE(gain_table_valid(&table));
    }
}

static void test_every_gain_has_to_be_finite(void)
{
    for (uint32_t k = 0u; k < ENTRIES; k++) {
        for (int bad = 0; bad < NOT_FINITE_COUNT; bad++) {
            float *const field[4] = {&entries[k].l1_re_per_s, &entries[k].l1_im_per_s,
                                     &entries[k].l2_re_ohm, &entries[k].l2_im_ohm};
            for (int f = 0; f < 4; f++) {
                const float good = *field[f];
                *field[f] = not_finite(bad);
                whole_words(&packed, &table, entries);
                TEST_ASSERT_FALSE(gain_table_valid(&table));
                *field[f] = good;
            }
        }
    }
    whole_words(&packed, &table, entries);
    TEST_ASSERT_TRUE(gain_table_valid(&table));
}

static void test_only_the_entries_that_count_are_judged(void)
{
    entries[ENTRIES - 1u].l1_re_per_s = NAN;
    whole_words(&packed, &table, entries);
    table.entry_count = ENTRIES - 1u;
    TEST_ASSERT_TRUE(gain_table_valid(&table));
}

static void test_gain_at_standstill_has_to_be_real(void)
{
    const float imaginary[2] = {1e-30f, -1e-30f};
    for (int k = 0; k < 2; k++) {
        entries[0] = gains[0];
        entries[0].l1_im_per_s = imaginary[k];
        whole_words(&packed, &table, entries);
        TEST_ASSERT_FALSE(gain_table_valid(&table));
        entries[0] = gains[0];
        entries[0].l2_im_ohm = imaginary[k];
        whole_words(&packed, &table, entries);
        TEST_ASSERT_FALSE(gain_table_valid(&table));
    }
}

/* Two blocks, the second one not full, residuals of which the test says what they are. */
static uint16_t residuals[2u * GAIN_BLOCK_ENTRIES * 8u + 1u];
static gain_block_t blocks[2];

#define BASE(c)  (0xFFFFFFF0u + 0x01000000u * (c)) /* wraps round within the block */
#define SLOPE(c) (((c) % 2u == 0u) ? 0x00100001u + (c) : 0xFFF00001u - (c))

static void lay_out(uint16_t half_words)
{
    for (uint32_t b = 0u; b < 2u; b++) {
        blocks[b].first = (uint16_t)(b * GAIN_BLOCK_ENTRIES * half_words);
        blocks[b].half_words = half_words;
        for (uint32_t c = 0u; c < 4u; c++) {
            blocks[b].line[c] = (gain_line_t){BASE(c) + 77u * b, SLOPE(c) - 5u * b};
        }
    }
    memset(residuals, 0, sizeof residuals);
    table.block = blocks;
    table.residual = residuals;
    table.residual_count = 2u * GAIN_BLOCK_ENTRIES * half_words + 1u;
    table.entry_count = GAIN_BLOCK_ENTRIES + 3u;
}

/* Entry k, whose residuals are these four. */
static void assert_above_lines(uint32_t k, const uint32_t residual[4])
{
    const observer_gain_t gain = gain_table_entry(&table, k);
    const float found[4] = {gain.l1_re_per_s, gain.l1_im_per_s, gain.l2_re_ohm, gain.l2_im_ohm};
    const uint32_t b = k / 16u;
    const uint32_t n = k % 16u;
    for (uint32_t c = 0u; c < 4u; c++) {
        const uint32_t on_line = BASE(c) + 77u * b + n * (SLOPE(c) - 5u * b);
        TEST_ASSERT_EQUAL_HEX32(on_line + residual[c], exact_bits(found[c]));
    }
}

/* An entry at the start and the end of a block, and in one that is not full. */
static void assert_layout(uint16_t half_words, const uint16_t word[8], const uint32_t residual[4])
{
    const uint32_t none[4] = {0u, 0u, 0u, 0u};
    const uint32_t at[5] = {0u, 1u, 15u, 16u, 18u};
    for (int k = 0; k < 5; k++) {
        lay_out(half_words);
        memcpy(&residuals[at[k] * half_words], word, 2u * (size_t)half_words);
        for (uint32_t other = 0u; other < table.entry_count; other++) {
            assert_above_lines(other, (other == at[k]) ? residual : none);
        }
    }
}

static void test_lines_and_their_residuals_in_each_layout(void)
{
    assert_layout(1u, (uint16_t[8]){0xA59Bu}, (uint32_t[4]){1u, 5u, 9u, 0xA5u});
    assert_layout(1u, (uint16_t[8]){0xFFFFu}, (uint32_t[4]){1u, 7u, 15u, 255u});
    assert_layout(1u, (uint16_t[8]){0x5A64u}, (uint32_t[4]){0u, 2u, 6u, 0x5Au});
    /* 21 | 10 << 5 | 0x155 << 10 | 0x1001 << 19 */
    assert_layout(2u, (uint16_t[8]){0x5555u, 0x800Du}, (uint32_t[4]){21u, 10u, 0x155u, 0x1001u});
    assert_layout(2u, (uint16_t[8]){0xFFFFu, 0xFFFFu}, (uint32_t[4]){31u, 31u, 511u, 8191u});
    /* 0x2A | 0x2AAA5 << 6 | 0x15A5A << 24 | 0x2A5A5A << 42 */
    assert_layout(4u, (uint16_t[8]){0xA96Au, 0x5AAAu, 0x695Au, 0xA969u},
                  (uint32_t[4]){0x2Au, 0x2AAA5u, 0x15A5Au, 0x2A5A5Au});
    assert_layout(4u, (uint16_t[8]){0xFFFFu, 0xFFFFu, 0xFFFFu, 0xFFFFu},
                  (uint32_t[4]){0x3Fu, 0x3FFFFu, 0x3FFFFu, 0x3FFFFFu});
    assert_layout(
        8u, (uint16_t[8]){0x1234u, 0x5678u, 0x9ABCu, 0xDEF0u, 0x0FEDu, 0xCBA9u, 0x8765u, 0x4321u},
        (uint32_t[4]){0x56781234u, 0xDEF09ABCu, 0xCBA90FEDu, 0x43218765u});
}

/* Gains that are on a line already: nothing of these tests depends on what they are. */
static void lay_out_flat(uint16_t half_words)
{
    lay_out(half_words);
    for (uint32_t b = 0u; b < 2u; b++) {
        memset(blocks[b].line, 0, sizeof blocks[b].line);
    }
}

static void test_only_the_four_layouts_are_known(void)
{
    for (uint32_t half_words = 0u; half_words < 20u; half_words++) {
        lay_out_flat((uint16_t)((half_words <= 8u) ? half_words : 8u));
        blocks[1].half_words = (uint16_t)half_words;
        table.residual_count = 16u * 40u; /* room for any of them */
        const bool known =
            (half_words == 1u) || (half_words == 2u) || (half_words == 4u) || (half_words == 8u);
        TEST_ASSERT_EQUAL(known, gain_table_valid(&table));
    }
}

/* Nothing is read before it is known to lie inside: a sanitizer would tell. */
static void test_block_that_points_outside_is_refused(void)
{
    const uint16_t layout[4] = {1u, 2u, 4u, 8u};
    for (int k = 0; k < 4; k++) {
        lay_out_flat(layout[k]);
        TEST_ASSERT_TRUE(gain_table_valid(&table));
        table.residual_count--;
        TEST_ASSERT_FALSE(gain_table_valid(&table));
        table.residual_count++;
        blocks[1].first++;
        TEST_ASSERT_FALSE(gain_table_valid(&table));
        blocks[1].first = 0xFFFFu;
        TEST_ASSERT_FALSE(gain_table_valid(&table));
        blocks[1].first = 0u; /* blocks may share residuals */
        TEST_ASSERT_TRUE(gain_table_valid(&table));
        blocks[0].first = 0x8000u;
        TEST_ASSERT_FALSE(gain_table_valid(&table));
        table.entry_count = 0u;
        TEST_ASSERT_FALSE(gain_table_valid(&table));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_speed_of_an_entry_gives_the_entry);
    RUN_TEST(test_speed_between_entries_gives_the_nearer_one);
    RUN_TEST(test_half_a_step_is_rounded_up);
    RUN_TEST(test_negative_speed_gives_the_conjugate);
    RUN_TEST(test_zero_of_either_sign_gives_entry_0);
    RUN_TEST(test_last_entry_holds_beyond_the_end);
    RUN_TEST(test_nan_speed_gives_entry_0);
    RUN_TEST(test_every_entry_of_the_real_grid_is_found);
    RUN_TEST(test_sound_table_is_valid);
    RUN_TEST(test_missing_table_is_refused);
    RUN_TEST(test_foreign_header_is_refused);
    RUN_TEST(test_entry_count_is_between_one_and_the_maximum);
    RUN_TEST(test_step_has_to_be_positive);
    RUN_TEST(test_every_gain_has_to_be_finite);
    RUN_TEST(test_only_the_entries_that_count_are_judged);
    RUN_TEST(test_gain_at_standstill_has_to_be_real);
    RUN_TEST(test_lines_and_their_residuals_in_each_layout);
    RUN_TEST(test_only_the_four_layouts_are_known);
    RUN_TEST(test_block_that_points_outside_is_refused);
    return UNITY_END();
}
