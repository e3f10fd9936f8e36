/* The generated C tables as the compiler reads them. */
#include "hasegawa2005/l_gain.h"
#include "hasegawa2005_paper/l_gain.h"
#include "hasegawa2005_recommended/l_gain.h"
#include "im_4kw_400v/l_gain.h"

#include "crc32c.h"
#include "unity.h"

static const gain_table_t *const tables[] = {
    &l_gain_hasegawa2005,
    &l_gain_im_4kw_400v,
    &l_gain_hasegawa2005_paper,
    &l_gain_hasegawa2005_recommended,
};

#define TABLES (sizeof(tables) / sizeof(tables[0]))

void setUp(void)
{
}

void tearDown(void)
{
}

static void test_every_table_can_be_used(void)
{
    for (size_t k = 0u; k < TABLES; k++) {
        TEST_ASSERT_TRUE(gain_table_valid(tables[k]));
    }
}

/* The checksum was taken of the gains in l_gain.json. */
static void test_every_entry_has_the_designed_bits(void)
{
    for (size_t k = 0u; k < TABLES; k++) {
        const size_t bytes = tables[k]->entry_count * sizeof tables[k]->entry[0];
        TEST_ASSERT_EQUAL_HEX32(tables[k]->crc32c, crc32c(tables[k]->entry, bytes));
    }
}

/* 2 elec. min^-1 = 2 * 2 pi / 60 rad/s; the nearest float, as the generator rounds. */
static void test_every_table_stands_on_the_grid_of_2_per_min(void)
{
    for (size_t k = 0u; k < TABLES; k++) {
        const float step_rad_s = (float)(4.0 * 3.14159265358979323846 / 60.0);
        TEST_ASSERT_EQUAL_MEMORY(&step_rad_s, &tables[k]->step_rad_s, sizeof(float));
    }
}

/* A drive must not run with another motor's gains. */
static void test_every_motor_has_its_own_identity(void)
{
    TEST_ASSERT_NOT_EQUAL(tables[0]->motor_id, tables[1]->motor_id);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_table_can_be_used);
    RUN_TEST(test_every_entry_has_the_designed_bits);
    RUN_TEST(test_every_table_stands_on_the_grid_of_2_per_min);
    RUN_TEST(test_every_motor_has_its_own_identity);
    return UNITY_END();
}
