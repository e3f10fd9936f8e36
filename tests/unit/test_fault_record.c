/* The record of the last fault: which rows it keeps, what a reset leaves of it, and the list. */
#include "fault_record.h"

#include "crc32c.h"

#include <stddef.h>
#include <string.h>

#include "unity.h"

static fault_memory_t kept;
static fault_recorder_t recorder;

void setUp(void)
{
    memset(&kept, 0xAB, sizeof kept);
}

void tearDown(void)
{
}

static void drive_period(uint32_t number, uint32_t faults, bool gates_on)
{
    if (fault_record_changed(&recorder, faults, gates_on)) {
        fault_record_look(&recorder, faults, faults, gates_on, number);
    }
    if (recorder.row != NULL) {
        for (uint32_t k = 0u; k < FAULT_RECORD_SIGNALS; k++) {
            recorder.row[k] = 10u * number + k;
        }
        fault_record_next(&recorder);
    }
}

/* Runs, trips in period 100 with the bits, stands tripped until 200. */
static void trip(uint32_t faults)
{
    for (uint32_t n = 0u; n < 200u; n++) {
        const bool tripped = n >= 100u;
        drive_period(n, tripped ? faults : 0u, !tripped);
        fault_record_background(&recorder, tripped ? faults : 0u, tripped ? 8u : 4u, n);
    }
}

static void test_a_fault_that_opens_the_gates_is_kept_with_what_was_before_and_after(void)
{
    fault_record_init(&recorder, &kept);
    TEST_ASSERT_FALSE(recorder.from_before);
    trip(5u);
    const fault_kept_t *k = &kept.kept;
    TEST_ASSERT_EQUAL_UINT32(1u, k->logged);
    TEST_ASSERT_EQUAL_UINT32(5u, k->entry[0].faults);
    TEST_ASSERT_EQUAL_UINT32(8u, k->entry[0].state);
    TEST_ASSERT_EQUAL_UINT32(100u, k->entry[0].period);
    TEST_ASSERT_EQUAL_UINT32(1u, k->number);
    TEST_ASSERT_EQUAL_UINT32(100u, k->period);
    TEST_ASSERT_EQUAL_UINT32(FAULT_RECORD_ROWS, k->rows);
    TEST_ASSERT_EQUAL_UINT32(32u, k->fault_row);
    TEST_ASSERT_EQUAL_UINT32(680u, k->word[0]);
    TEST_ASSERT_EQUAL_UINT32(1005u, k->word[32u * FAULT_RECORD_SIGNALS + 5u]);
    TEST_ASSERT_EQUAL_UINT32(1155u, k->word[47u * FAULT_RECORD_SIGNALS + 5u]);
}

static void test_the_record_comes_through_a_reset(void)
{
    fault_record_init(&recorder, &kept);
    trip(5u);
    const fault_kept_t before = kept.kept;
    fault_record_init(&recorder, &kept);
    TEST_ASSERT_TRUE(recorder.from_before);
    TEST_ASSERT_EQUAL_MEMORY(&before, &kept.kept, sizeof before);
}

static void test_a_lost_bit_empties_the_record(void)
{
    fault_record_init(&recorder, &kept);
    trip(5u);
    const fault_kept_t whole = kept.kept;
    for (size_t at = 0u; at < sizeof whole; at += 7u) {
        kept.kept = whole;
        ((uint8_t *)&kept.kept)[at] ^= 0x10u;
        fault_record_init(&recorder, &kept);
        TEST_ASSERT_FALSE(recorder.from_before);
        TEST_ASSERT_EQUAL_UINT32(0u, kept.kept.logged);
        TEST_ASSERT_EQUAL_UINT32(0u, kept.kept.number);
    }
}

/* Whole by its sum, but of a build with more rows. */
static void test_a_record_of_more_rows_than_there_are_is_emptied(void)
{
    fault_record_init(&recorder, &kept);
    trip(5u);
    kept.kept.rows = FAULT_RECORD_ROWS + 1u;
    kept.kept.crc32c = crc32c(&kept.kept.logged, sizeof kept.kept - offsetof(fault_kept_t, logged));
    fault_record_init(&recorder, &kept);
    TEST_ASSERT_FALSE(recorder.from_before);
    TEST_ASSERT_EQUAL_UINT32(0u, kept.kept.rows);
}

static void test_a_fault_behind_a_reset_is_listed_but_leaves_the_record(void)
{
    fault_record_init(&recorder, &kept);
    trip(5u);
    fault_record_init(&recorder, &kept);
    for (uint32_t n = 0u; n < 100u; n++) {
        drive_period(n, (n > 10u) ? 2u : 0u, false);
        fault_record_background(&recorder, (n > 10u) ? 2u : 0u, 8u, n);
    }
    TEST_ASSERT_EQUAL_UINT32(2u, kept.kept.logged);
    TEST_ASSERT_EQUAL_UINT32(2u, kept.kept.entry[1].faults);
    TEST_ASSERT_EQUAL_UINT32(100u, kept.kept.period);
    TEST_ASSERT_EQUAL_UINT32(1u, kept.kept.number);
    fault_record_init(&recorder, &kept);
    TEST_ASSERT_TRUE(recorder.from_before); /* the list was sealed with it */
}

static void test_the_list_keeps_the_last_eight(void)
{
    fault_record_init(&recorder, &kept);
    for (uint32_t n = 1u; n <= 11u; n++) {
        fault_record_background(&recorder, 0u, 2u, 10u * n);
        fault_record_background(&recorder, n, 8u, 10u * n + 1u);
    }
    TEST_ASSERT_EQUAL_UINT32(11u, kept.kept.logged);
    for (uint32_t n = 4u; n <= 11u; n++) {
        TEST_ASSERT_EQUAL_UINT32(n, kept.kept.entry[(n - 1u) % FAULT_RECORD_LOG].number);
        TEST_ASSERT_EQUAL_UINT32(n, kept.kept.entry[(n - 1u) % FAULT_RECORD_LOG].faults);
    }
}

static void test_a_second_fault_replaces_the_first(void)
{
    fault_record_init(&recorder, &kept);
    trip(5u);
    recorder.listed = 0u;
    trip(6u);
    TEST_ASSERT_EQUAL_UINT32(2u, kept.kept.logged);
    TEST_ASSERT_EQUAL_UINT32(2u, kept.kept.number);
}

static void test_clear_forgets_and_goes_on(void)
{
    fault_record_init(&recorder, &kept);
    trip(5u);
    fault_record_clear(&recorder);
    TEST_ASSERT_EQUAL_UINT32(0u, kept.kept.logged);
    TEST_ASSERT_EQUAL_UINT32(0u, kept.kept.number);
    trip(6u);
    TEST_ASSERT_EQUAL_UINT32(1u, kept.kept.number);
}

static void test_a_port_without_memory_records_nothing(void)
{
    fault_record_init(&recorder, NULL);
    trip(5u);
    fault_record_clear(&recorder);
    TEST_ASSERT_NULL(recorder.row);
}

/* Runs until `at`, then trips, and has its rows after; nobody fetches the record. */
static void trip_unseen(uint32_t at)
{
    fault_record_init(&recorder, &kept);
    for (uint32_t n = 0u; n < at + FAULT_RECORD_AFTER; n++) {
        drive_period(n, (n >= at) ? 5u : 0u, n < at);
    }
}

/* Wherever in the ring it comes, and whether or not the ring has gone round: oldest row first, each
 * the one after the row before, the fault's own where it is said to be. */
static void test_the_ring_wraps_at_any_row(void)
{
    for (uint32_t at = 1u; at < 3u * FAULT_RECORD_ROWS; at++) {
        trip_unseen(at);
        TEST_ASSERT_TRUE(recorder.done);
        fault_record_background(&recorder, 5u, 8u, at + FAULT_RECORD_AFTER);
        const fault_kept_t *k = &kept.kept;
        const uint32_t written = at + FAULT_RECORD_AFTER;
        TEST_ASSERT_EQUAL_UINT32((written < FAULT_RECORD_ROWS) ? written : FAULT_RECORD_ROWS,
                                 k->rows);
        TEST_ASSERT_EQUAL_UINT32(k->rows - FAULT_RECORD_AFTER, k->fault_row);
        TEST_ASSERT_EQUAL_UINT32(at, k->period);
        for (uint32_t row = 0u; row < k->rows; row++) {
            const uint32_t number = at + row - k->fault_row;
            for (uint32_t c = 0u; c < FAULT_RECORD_SIGNALS; c++) {
                TEST_ASSERT_EQUAL_UINT32(10u * number + c, k->word[row * FAULT_RECORD_SIGNALS + c]);
            }
        }
    }
}

/* Until the background has moved it, nothing writes to the ring; then the next record begins. */
static void test_a_complete_record_freezes_until_it_is_kept(void)
{
    const uint32_t at[] = {5u, 32u, 100u}; /* the second ends with the ring */
    for (size_t n = 0u; n < sizeof at / sizeof at[0]; n++) {
        trip_unseen(at[n]);
        const fault_memory_t frozen = kept;
        TEST_ASSERT_NULL(recorder.row);
        for (uint32_t k = 0u; k < 2u * FAULT_RECORD_ROWS; k++) {
            drive_period(1000u + k, 5u, false);
        }
        drive_period(2000u, 0u, true);
        drive_period(2001u, 7u, false); /* another one: too late */
        TEST_ASSERT_EQUAL_MEMORY(&frozen.ring, &kept.ring, sizeof frozen.ring);
        fault_record_background(&recorder, 5u, 8u, 2001u);
        TEST_ASSERT_EQUAL_UINT32(at[n], kept.kept.period);
        TEST_ASSERT_FALSE(recorder.done);
        TEST_ASSERT_TRUE(recorder.row == kept.ring);
        drive_period(3000u, 0u, true);
        TEST_ASSERT_EQUAL_UINT32(30000u, kept.ring[0]);
        TEST_ASSERT_TRUE(recorder.row == &kept.ring[FAULT_RECORD_SIGNALS]);
    }
}

/* The gates stay on, or were off before: nothing to explain. A second fault within the rows that
 * follow moves nothing. */
static void test_only_a_fault_that_opens_the_gates_is_counted_down_for(void)
{
    fault_record_init(&recorder, &kept);
    fault_record_look(&recorder, 0u, 0u, true, 1u);
    fault_record_look(&recorder, 4u, 0u, true, 2u); /* a warning */
    TEST_ASSERT_EQUAL_UINT32(0u, recorder.left);
    TEST_ASSERT_FALSE(fault_record_changed(&recorder, 4u, true));
    TEST_ASSERT_TRUE(fault_record_changed(&recorder, 4u, false));
    TEST_ASSERT_TRUE(fault_record_changed(&recorder, 0u, true));
    fault_record_look(&recorder, 4u, 0u, false, 3u); /* told to stop */
    fault_record_look(&recorder, 5u, 1u, false, 4u);
    TEST_ASSERT_EQUAL_UINT32(0u, recorder.left);
    fault_record_look(&recorder, 0u, 0u, true, 5u);
    fault_record_look(&recorder, 1u, 1u, false, 6u);
    TEST_ASSERT_EQUAL_UINT32(FAULT_RECORD_AFTER, recorder.left);
    for (int k = 0; k < 3; k++) {
        fault_record_next(&recorder);
    }
    fault_record_look(&recorder, 1u, 1u, true, 7u);
    fault_record_look(&recorder, 3u, 3u, false, 8u);
    TEST_ASSERT_EQUAL_UINT32(FAULT_RECORD_AFTER - 3u, recorder.left);
    TEST_ASSERT_EQUAL_UINT32(6u, recorder.period);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_fault_that_opens_the_gates_is_kept_with_what_was_before_and_after);
    RUN_TEST(test_the_record_comes_through_a_reset);
    RUN_TEST(test_a_lost_bit_empties_the_record);
    RUN_TEST(test_a_record_of_more_rows_than_there_are_is_emptied);
    RUN_TEST(test_a_fault_behind_a_reset_is_listed_but_leaves_the_record);
    RUN_TEST(test_the_list_keeps_the_last_eight);
    RUN_TEST(test_a_second_fault_replaces_the_first);
    RUN_TEST(test_clear_forgets_and_goes_on);
    RUN_TEST(test_a_port_without_memory_records_nothing);
    RUN_TEST(test_the_ring_wraps_at_any_row);
    RUN_TEST(test_a_complete_record_freezes_until_it_is_kept);
    RUN_TEST(test_only_a_fault_that_opens_the_gates_is_counted_down_for);
    return UNITY_END();
}
