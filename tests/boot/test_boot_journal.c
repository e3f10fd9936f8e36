/* A number that only rises: what counts as a record, where the next goes, what proves one. */
#include "boot_journal.h"

#include "boot_rig.h"
#include "unity.h"

#define END_BYTES 80u /* ten records */

static boot_rig_t rig;
static boot_journal_t journal;

void setUp(void)
{
    rig_init(&rig, true, 2u, 1u);
    journal = (boot_journal_t){&rig.flash, BOOT_COUNTER, 0u, END_BYTES};
}
void tearDown(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, rig.sim.misuses);
}

static void put(uint32_t record, uint32_t number, uint32_t complement)
{
    rig.sim.cell[BOOT_COUNTER][2u * record] = number;
    rig.sim.cell[BOOT_COUNTER][2u * record + 1u] = complement;
}

static void test_blank_flash_is_no_number(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, boot_journal_read(&journal));
    TEST_ASSERT_TRUE(boot_journal_room(&journal));
}

static void test_a_raise_appends_three_equal_records(void)
{
    TEST_ASSERT_TRUE(boot_journal_raise(&journal, 7u));
    TEST_ASSERT_EQUAL_UINT32(7u, boot_journal_read(&journal));
    TEST_ASSERT_EQUAL_UINT32(3u, rig.sim.operations);
    for (uint32_t k = 0u; k < 3u; k++) {
        TEST_ASSERT_EQUAL_HEX32(7u, rig.sim.cell[BOOT_COUNTER][2u * k]);
        TEST_ASSERT_EQUAL_HEX32(~7u, rig.sim.cell[BOOT_COUNTER][2u * k + 1u]);
    }
    TEST_ASSERT_EQUAL_HEX32(BOOT_ERASED, rig.sim.cell[BOOT_COUNTER][6]);
}

static void test_a_proven_number_is_not_written_again(void)
{
    TEST_ASSERT_TRUE(boot_journal_raise(&journal, 7u));
    TEST_ASSERT_TRUE(boot_journal_raise(&journal, 7u));
    TEST_ASSERT_TRUE(boot_journal_raise(&journal, 3u));
    TEST_ASSERT_EQUAL_UINT32(3u, rig.sim.operations);
    TEST_ASSERT_EQUAL_UINT32(7u, boot_journal_read(&journal));
}

static void test_the_highest_counts_wherever_it_stands(void)
{
    put(0u, 9u, ~9u);
    put(1u, 4u, ~4u);
    TEST_ASSERT_EQUAL_UINT32(9u, boot_journal_read(&journal));
}

static void test_a_record_without_its_complement_is_none(void)
{
    put(0u, 9u, ~8u);
    put(1u, 9u, BOOT_ERASED);
    TEST_ASSERT_EQUAL_UINT32(0u, boot_journal_read(&journal));
}

/* Two may be torn, three cannot all be: one whole record, or two with nothing behind, prove
 * nothing. */
static void test_only_the_middle_of_three_is_proven(void)
{
    put(0u, 5u, ~5u);
    put(1u, 5u, ~5u);
    TEST_ASSERT_TRUE(boot_journal_raise(&journal, 5u));
    TEST_ASSERT_EQUAL_UINT32(3u, rig.sim.operations);
    TEST_ASSERT_EQUAL_HEX32(5u, rig.sim.cell[BOOT_COUNTER][4]);
    TEST_ASSERT_EQUAL_HEX32(5u, rig.sim.cell[BOOT_COUNTER][8]);
}

static void test_two_equal_ones_and_anything_behind_are_proven(void)
{
    put(0u, 5u, ~5u);
    put(1u, 5u, ~5u);
    put(2u, 5u, BOOT_ERASED);
    TEST_ASSERT_TRUE(boot_journal_raise(&journal, 5u));
    TEST_ASSERT_EQUAL_UINT32(0u, rig.sim.operations);
}

/* What follows the journal is no record of it. */
static void test_nothing_behind_the_end_proves_the_last(void)
{
    put(8u, 5u, ~5u);
    put(9u, 5u, ~5u);
    put(10u, 5u, ~5u);
    TEST_ASSERT_FALSE(boot_journal_raise(&journal, 5u));
}

static void test_two_different_ones_prove_neither(void)
{
    put(0u, 4u, ~4u);
    put(1u, 5u, ~5u);
    put(2u, 0u, 0u);
    TEST_ASSERT_TRUE(boot_journal_raise(&journal, 5u));
    TEST_ASSERT_EQUAL_UINT32(3u, rig.sim.operations);
}

static void test_a_unit_that_fails_is_left_behind(void)
{
    rig.fails = true;
    sim_flash_arm(&rig.sim, 1u, TORN_GARBAGE);
    TEST_ASSERT_TRUE(boot_journal_raise(&journal, 6u));
    TEST_ASSERT_EQUAL_UINT32(5u, rig.sim.operations);
    TEST_ASSERT_EQUAL_UINT32(6u, boot_journal_read(&journal));
    TEST_ASSERT_EQUAL_HEX32(6u, rig.sim.cell[BOOT_COUNTER][8]);
}

static void test_a_full_journal_refuses_and_keeps_its_number(void)
{
    for (uint32_t n = 1u; n <= 3u; n++) {
        TEST_ASSERT_TRUE(boot_journal_room(&journal));
        TEST_ASSERT_TRUE(boot_journal_raise(&journal, n));
    }
    TEST_ASSERT_FALSE(boot_journal_room(&journal)); /* one record is left, three are needed */
    TEST_ASSERT_FALSE(boot_journal_raise(&journal, 4u));
    TEST_ASSERT_TRUE(boot_journal_raise(&journal, 3u));
}

static void test_exactly_three_free_units_are_room(void)
{
    journal.end = 24u;
    TEST_ASSERT_TRUE(boot_journal_room(&journal));
    TEST_ASSERT_TRUE(boot_journal_raise(&journal, 2u));
    TEST_ASSERT_FALSE(boot_journal_room(&journal));
    TEST_ASSERT_TRUE(boot_journal_raise(&journal, 2u));
}

static void test_it_stays_in_its_part_of_the_area(void)
{
    journal.from = 16u;
    put(0u, 9u, ~9u);
    put(10u, 9u, ~9u);
    TEST_ASSERT_EQUAL_UINT32(0u, boot_journal_read(&journal));
    TEST_ASSERT_TRUE(boot_journal_raise(&journal, 2u));
    TEST_ASSERT_EQUAL_HEX32(2u, rig.sim.cell[BOOT_COUNTER][4]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_blank_flash_is_no_number);
    RUN_TEST(test_a_raise_appends_three_equal_records);
    RUN_TEST(test_a_proven_number_is_not_written_again);
    RUN_TEST(test_the_highest_counts_wherever_it_stands);
    RUN_TEST(test_a_record_without_its_complement_is_none);
    RUN_TEST(test_only_the_middle_of_three_is_proven);
    RUN_TEST(test_two_equal_ones_and_anything_behind_are_proven);
    RUN_TEST(test_nothing_behind_the_end_proves_the_last);
    RUN_TEST(test_two_different_ones_prove_neither);
    RUN_TEST(test_a_unit_that_fails_is_left_behind);
    RUN_TEST(test_a_full_journal_refuses_and_keeps_its_number);
    RUN_TEST(test_exactly_three_free_units_are_room);
    RUN_TEST(test_it_stays_in_its_part_of_the_area);
    return UNITY_END();
}
