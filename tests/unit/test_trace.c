/* The recorder: which rows it keeps round its trigger, when it takes one, what it refuses; and the
 * fault record built on it. */
#include "trace.h"

#include <string.h>

#include "fault_record.h"
#include "unity.h"

#define WORDS 64u

static uint32_t memory[WORDS];
static trace_t trace;
static trace_setup_t setup;
static fault_memory_t kept;
static fault_recorder_t recorder;

void setUp(void)
{
    memset(memory, 0xEE, sizeof memory);
    trace_init(&trace, memory, WORDS);
    setup = (trace_setup_t){.signals = 2u,
                            .decimation = 1u,
                            .edge = TRACE_RISING,
                            .level = 10u,
                            .before_pu = 0.25f,
                            .rows = 8u};
    memset(&kept, 0xAB, sizeof kept);
}

void tearDown(void)
{
}

/* One period: column 0 is the period, column 1 the trigger's word. */
static void period(uint32_t number, uint32_t word)
{
    if (trace_running(&trace) && trace_watch(&trace, word, number)) {
        uint32_t *row = trace_row(&trace);
        row[0] = number;
        if (trace.setup.signals > 1u) {
            row[1] = word;
        }
        trace_row_done(&trace);
    }
}

static void test_keeps_the_share_before_the_trigger_and_the_rest_after(void)
{
    TEST_ASSERT_TRUE(trace_arm(&trace, &setup));
    for (uint32_t k = 0u; k < 100u; k++) {
        period(k, (k >= 50u) ? 10u : 9u);
    }
    TEST_ASSERT_EQUAL_UINT32(TRACE_DONE, trace.state);
    TEST_ASSERT_EQUAL_UINT32(8u, trace_rows(&trace));
    TEST_ASSERT_EQUAL_UINT32(2u, trace_trigger_row(&trace));
    TEST_ASSERT_EQUAL_UINT32(50u, trace.trigger_period);
    for (uint32_t row = 0u; row < 8u; row++) {
        TEST_ASSERT_EQUAL_UINT32(48u + row, trace_word(&trace, row, 0u));
        TEST_ASSERT_EQUAL_UINT32((row >= 2u) ? 10u : 9u, trace_word(&trace, row, 1u));
    }
}

static void test_a_trigger_before_the_share_is_full_keeps_what_there_was(void)
{
    TEST_ASSERT_TRUE(trace_arm(&trace, &setup));
    for (uint32_t k = 0u; k < 20u; k++) {
        period(k, (k >= 1u) ? 10u : 0u);
    }
    TEST_ASSERT_EQUAL_UINT32(7u, trace_rows(&trace));
    TEST_ASSERT_EQUAL_UINT32(1u, trace_trigger_row(&trace));
    TEST_ASSERT_EQUAL_UINT32(0u, trace_word(&trace, 0u, 0u));
    TEST_ASSERT_EQUAL_UINT32(6u, trace_word(&trace, 6u, 0u));
}

static void test_edges_of_both_directions(void)
{
    const uint32_t word[] = {10u, 12u, 9u, 8u, 10u, 11u};
    const struct {
        trace_edge_t edge;
        uint32_t at;
    } expected[] = {{TRACE_NOW, 0u}, {TRACE_RISING, 4u}, {TRACE_FALLING, 2u}, {TRACE_EITHER, 2u}};
    for (uint32_t k = 0u; k < 4u; k++) {
        setup.edge = expected[k].edge;
        TEST_ASSERT_TRUE(trace_arm(&trace, &setup));
        for (uint32_t n = 0u; n < 6u; n++) {
            period(n, word[n]);
        }
        TEST_ASSERT_NOT_EQUAL_UINT32(TRACE_ARMED, trace.state);
        TEST_ASSERT_EQUAL_UINT32(expected[k].at, trace.trigger_period);
    }
}

static void test_a_level_that_stands_from_the_start_is_no_edge(void)
{
    TEST_ASSERT_TRUE(trace_arm(&trace, &setup));
    for (uint32_t n = 0u; n < 30u; n++) {
        period(n, 99u);
    }
    TEST_ASSERT_EQUAL_UINT32(TRACE_ARMED, trace.state);
    TEST_ASSERT_EQUAL_UINT32(0u, trace_rows(&trace));
}

/* As words -1.0 is above +1.0. */
static void test_a_float_trigger_compares_numbers(void)
{
    setup.trigger_is_float = true;
    setup.level = float_bits(0.5f);
    TEST_ASSERT_TRUE(trace_arm(&trace, &setup));
    period(0u, float_bits(-1.0f));
    period(1u, float_bits(-2.0f));
    TEST_ASSERT_EQUAL_UINT32(TRACE_ARMED, trace.state);
    period(2u, float_bits(0.5f));
    TEST_ASSERT_EQUAL_UINT32(TRACE_TRIGGERED, trace.state);
}

static void test_decimation_spaces_the_rows_and_starts_anew_at_the_trigger(void)
{
    setup.decimation = 3u;
    TEST_ASSERT_TRUE(trace_arm(&trace, &setup));
    for (uint32_t n = 0u; n < 100u; n++) {
        period(n, (n >= 31u) ? 10u : 0u);
    }
    TEST_ASSERT_EQUAL_UINT32(8u, trace_rows(&trace));
    const uint32_t expected[] = {27u, 30u, 31u, 34u, 37u, 40u, 43u, 46u};
    for (uint32_t row = 0u; row < 8u; row++) {
        TEST_ASSERT_EQUAL_UINT32(expected[row], trace_word(&trace, row, 0u));
    }
}

static void test_all_before_keeps_the_triggers_own_row(void)
{
    setup.before_pu = 1.0f;
    TEST_ASSERT_TRUE(trace_arm(&trace, &setup));
    for (uint32_t n = 0u; n < 40u; n++) {
        period(n, (n >= 20u) ? 10u : 0u);
    }
    TEST_ASSERT_EQUAL_UINT32(7u, trace_trigger_row(&trace));
    TEST_ASSERT_EQUAL_UINT32(20u, trace_word(&trace, 7u, 0u));
}

static void test_zero_rows_means_all_that_fit(void)
{
    setup.signals = 5u;
    setup.rows = 0u;
    TEST_ASSERT_TRUE(trace_arm(&trace, &setup));
    TEST_ASSERT_EQUAL_UINT32(12u, trace.rows); /* 64 words */
}

static void test_refuses_what_makes_no_sense_and_stays_as_it_was(void)
{
    TEST_ASSERT_TRUE(trace_arm(&trace, &setup));
    const trace_t before = trace;
    const trace_setup_t good = setup;
    const float nan = float_of_bits(0x7FC00000u);
    trace_setup_t bad[9];
    for (uint32_t k = 0u; k < 9u; k++) {
        bad[k] = good;
    }
    bad[0].signals = 0u;
    bad[1].signals = 9u;
    bad[2].decimation = 0u;
    bad[3].edge = TRACE_EDGES;
    bad[4].before_pu = -0.1f;
    bad[5].before_pu = 1.1f;
    bad[6].before_pu = nan;
    bad[7].rows = 33u; /* of 2 signals in 64 words */
    bad[8].trigger_is_float = true;
    bad[8].level = 0x7FC00000u;
    for (uint32_t k = 0u; k < 9u; k++) {
        TEST_ASSERT_FALSE(trace_arm(&trace, &bad[k]));
        TEST_ASSERT_EQUAL_MEMORY(&before, &trace, sizeof before);
    }
    setup.decimation = 1000001u;
    TEST_ASSERT_FALSE(trace_arm(&trace, &setup));
}

static void test_without_memory_nothing_can_be_armed(void)
{
    trace_init(&trace, NULL, WORDS);
    TEST_ASSERT_FALSE(trace_arm(&trace, &setup));
    setup.rows = 0u;
    TEST_ASSERT_FALSE(trace_arm(&trace, &setup));
}

static void test_a_stopped_trace_is_not_read(void)
{
    setup.edge = TRACE_NOW;
    TEST_ASSERT_TRUE(trace_arm(&trace, &setup));
    period(0u, 0u);
    trace_stop(&trace);
    TEST_ASSERT_FALSE(trace_running(&trace));
    TEST_ASSERT_EQUAL_UINT32(0u, trace_rows(&trace));
    TEST_ASSERT_EQUAL_UINT32(0u, trace_word(&trace, 0u, 0u));
}

static void test_words_beyond_the_record_are_zero(void)
{
    setup.edge = TRACE_NOW;
    TEST_ASSERT_TRUE(trace_arm(&trace, &setup));
    for (uint32_t n = 0u; n < 8u; n++) {
        period(n + 1u, 7u);
    }
    TEST_ASSERT_EQUAL_UINT32(6u, trace_rows(&trace)); /* nothing was before the first */
    TEST_ASSERT_EQUAL_UINT32(7u, trace_word(&trace, 5u, 1u));
    TEST_ASSERT_EQUAL_UINT32(0u, trace_word(&trace, 6u, 1u));
    TEST_ASSERT_EQUAL_UINT32(0u, trace_word(&trace, 0u, 2u));
}

/* --- fault record --------------------------------------------------------------------------- */

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

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_keeps_the_share_before_the_trigger_and_the_rest_after);
    RUN_TEST(test_a_trigger_before_the_share_is_full_keeps_what_there_was);
    RUN_TEST(test_edges_of_both_directions);
    RUN_TEST(test_a_level_that_stands_from_the_start_is_no_edge);
    RUN_TEST(test_a_float_trigger_compares_numbers);
    RUN_TEST(test_decimation_spaces_the_rows_and_starts_anew_at_the_trigger);
    RUN_TEST(test_all_before_keeps_the_triggers_own_row);
    RUN_TEST(test_zero_rows_means_all_that_fit);
    RUN_TEST(test_refuses_what_makes_no_sense_and_stays_as_it_was);
    RUN_TEST(test_without_memory_nothing_can_be_armed);
    RUN_TEST(test_a_stopped_trace_is_not_read);
    RUN_TEST(test_words_beyond_the_record_are_zero);
    RUN_TEST(test_a_fault_that_opens_the_gates_is_kept_with_what_was_before_and_after);
    RUN_TEST(test_the_record_comes_through_a_reset);
    RUN_TEST(test_a_lost_bit_empties_the_record);
    RUN_TEST(test_a_fault_behind_a_reset_is_listed_but_leaves_the_record);
    RUN_TEST(test_the_list_keeps_the_last_eight);
    RUN_TEST(test_a_second_fault_replaces_the_first);
    RUN_TEST(test_clear_forgets_and_goes_on);
    RUN_TEST(test_a_port_without_memory_records_nothing);
    return UNITY_END();
}
