/* The recorder: which rows it keeps round its trigger, when it takes one, what it refuses. */
#include "trace.h"

#include <string.h>

#include "unity.h"

#define WORDS 64u

static uint32_t memory[WORDS];
static trace_t trace;
static trace_setup_t setup;

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
    return UNITY_END();
}
