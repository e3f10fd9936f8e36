#include "gain_table.h"

#include <stddef.h>

#include "exact.h"

#define ENTRIES    5u
#define STEP_RAD_S 0.25f /* a power of two: half steps are exact */

static const observer_gain_t gains[ENTRIES] = {
    {10.0f, 0.0f, 20.0f, -0.0f},    {11.0f, 31.0f, 21.0f, 41.0f},   {12.0f, 32.0f, 22.0f, 42.0f},
    {13.0f, -33.0f, 23.0f, -43.0f}, {-14.0f, 34.0f, -24.0f, 44.0f},
};

static gain_table_t table;
static observer_gain_t entries[ENTRIES];

void setUp(void)
{
    memcpy(entries, gains, sizeof entries);
    table = (gain_table_t){.magic = GAIN_TABLE_MAGIC,
                           .version = GAIN_TABLE_VERSION,
                           .motor_id = 1u,
                           .entry_count = ENTRIES,
                           .crc32c = 2u,
                           .step_rad_s = STEP_RAD_S,
                           .entry = entries};
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
    table.entry = many;
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
    table.entry = NULL;
    TEST_ASSERT_FALSE(gain_table_valid(&table));
}

static void test_foreign_header_is_refused(void)
{
    table.magic ^= 1u;
    TEST_ASSERT_FALSE(gain_table_valid(&table));
    table.magic = 0x5A48474Cu; /* as in every table that was ever made */
    TEST_ASSERT_TRUE(gain_table_valid(&table));
    table.version++;
    TEST_ASSERT_FALSE(gain_table_valid(&table));
}

static void test_entry_count_is_between_one_and_the_maximum(void)
{
    static const observer_gain_t zeros[GAIN_TABLE_MAX_ENTRIES];
    table.entry = zeros;
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
                TEST_ASSERT_FALSE(gain_table_valid(&table));
                *field[f] = good;
            }
        }
    }
    TEST_ASSERT_TRUE(gain_table_valid(&table));
}

static void test_only_the_entries_that_count_are_judged(void)
{
    entries[ENTRIES - 1u].l1_re_per_s = NAN;
    table.entry_count = ENTRIES - 1u;
    TEST_ASSERT_TRUE(gain_table_valid(&table));
}

static void test_gain_at_standstill_has_to_be_real(void)
{
    const float imaginary[2] = {1e-30f, -1e-30f};
    for (int k = 0; k < 2; k++) {
        entries[0] = gains[0];
        entries[0].l1_im_per_s = imaginary[k];
        TEST_ASSERT_FALSE(gain_table_valid(&table));
        entries[0] = gains[0];
        entries[0].l2_im_ohm = imaginary[k];
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
    return UNITY_END();
}
