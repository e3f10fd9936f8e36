#include "debounce.h"

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static void test_it_lasts_after_as_many_times_on_end_as_the_limit(void)
{
    uint32_t count = 0u;
    for (int k = 0; k < 4; k++) {
        TEST_ASSERT_FALSE(debounce_elapsed(count, 5u));
        count = debounce_count(count, true, 5u);
    }
    TEST_ASSERT_FALSE(debounce_elapsed(count, 5u));
    count = debounce_count(count, true, 5u);
    TEST_ASSERT_TRUE(debounce_elapsed(count, 5u));
}

static void test_one_good_time_takes_back_an_eighth_of_a_bad_one(void)
{
    uint32_t count = debounce_count(0u, true, 5u);
    TEST_ASSERT_EQUAL_UINT32(DEBOUNCE_WEIGHT, count);
    for (uint32_t k = 1u; k <= DEBOUNCE_WEIGHT; k++) {
        count = debounce_count(count, false, 5u);
        TEST_ASSERT_EQUAL_UINT32(DEBOUNCE_WEIGHT - k, count);
    }
    TEST_ASSERT_EQUAL_UINT32(0u, debounce_count(count, false, 5u));
}

/* One in five is found, one in ten never. */
static void test_a_loose_contact_is_found_and_a_rare_disturbance_is_not(void)
{
    uint32_t loose = 0u;
    uint32_t rare = 0u;
    bool found = false;
    for (int k = 0; k < 1000; k++) {
        loose = debounce_count(loose, (k % 5) == 0, 8u);
        rare = debounce_count(rare, (k % 10) == 0, 8u);
        found = found || debounce_elapsed(loose, 8u);
        TEST_ASSERT_FALSE(debounce_elapsed(rare, 8u));
    }
    TEST_ASSERT_TRUE(found);
}

static void test_a_sign_that_all_is_well_takes_back_a_bad_one(void)
{
    TEST_ASSERT_EQUAL_UINT32(3u, debounce_refute(DEBOUNCE_WEIGHT + 3u));
    TEST_ASSERT_EQUAL_UINT32(0u, debounce_refute(DEBOUNCE_WEIGHT));
    TEST_ASSERT_EQUAL_UINT32(0u, debounce_refute(3u));
}

static void test_the_count_stops_at_the_limit(void)
{
    TEST_ASSERT_EQUAL_UINT32(40u, debounce_count(40u, true, 5u));
    TEST_ASSERT_EQUAL_UINT32(40u, debounce_count(33u, true, 5u));
    TEST_ASSERT_EQUAL_UINT32(40u, debounce_count(32u, true, 5u));
    TEST_ASSERT_EQUAL_UINT32(39u, debounce_count(31u, true, 5u));
    TEST_ASSERT_EQUAL_UINT32(39u, debounce_count(40u, false, 5u));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_it_lasts_after_as_many_times_on_end_as_the_limit);
    RUN_TEST(test_one_good_time_takes_back_an_eighth_of_a_bad_one);
    RUN_TEST(test_a_loose_contact_is_found_and_a_rare_disturbance_is_not);
    RUN_TEST(test_a_sign_that_all_is_well_takes_back_a_bad_one);
    RUN_TEST(test_the_count_stops_at_the_limit);
    return UNITY_END();
}
