/* The dc link against the mains that the user told. */
#include "mains_check.h"

#include "exact.h"

#define SCHEDULE_S 3.2e-3f
#define LOOKS      1250u /* 4 s */

/* Its peak is 282.84 V: 197.99 to 339.41 V. */
#define MAINS_V 200.0f

static mains_check_config_t cfg;
static mains_check_state_t st;

void setUp(void)
{
    TEST_ASSERT_TRUE(mains_check_init(&cfg, MAINS_V, SCHEDULE_S));
    st = (mains_check_state_t){0};
}

void tearDown(void)
{
}

/* Looks until it is told; 0: not within `most`. */
static uint32_t told_after(float u_dc_V, float power_W, uint32_t most)
{
    for (uint32_t k = 1u; k <= most; k++) {
        if (mains_check_look(&cfg, &st, u_dc_V, power_W)) {
            return k;
        }
    }
    return 0u;
}

static void test_init_refuses_what_is_no_mains(void)
{
    const float bad[] = {-1.0f, NAN, INFINITY};
    for (int k = 0; k < 3; k++) {
        TEST_ASSERT_FALSE(mains_check_init(&cfg, bad[k], SCHEDULE_S));
    }
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        TEST_ASSERT_FALSE(mains_check_init(&cfg, MAINS_V, not_positive(k)));
    }
    TEST_ASSERT_TRUE(mains_check_init(&cfg, MAINS_V, 1e-30f));
    TEST_ASSERT_EQUAL_UINT32(1000000u, cfg.most);
    TEST_ASSERT_TRUE(mains_check_init(&cfg, MAINS_V, SCHEDULE_S));
    TEST_ASSERT_EQUAL_UINT32(LOOKS, cfg.most);
}

static void test_of_an_unknown_mains_nothing_is_asked(void)
{
    TEST_ASSERT_TRUE(mains_check_init(&cfg, 0.0f, SCHEDULE_S));
    TEST_ASSERT_EQUAL_UINT32(0u, told_after(500.0f, 100.0f, 2u * LOOKS));
    TEST_ASSERT_EQUAL_UINT32(0u, told_after(1.0f, -100.0f, 2u * LOOKS));
}

static void test_a_link_that_fits_its_mains(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, told_after(198.1f, 100.0f, 2u * LOOKS));
    TEST_ASSERT_EQUAL_UINT32(0u, told_after(339.3f, 100.0f, 2u * LOOKS));
    TEST_ASSERT_EQUAL_UINT32(0u, told_after(cfg.low_V, 100.0f, 2u * LOOKS));
    TEST_ASSERT_EQUAL_UINT32(0u, told_after(cfg.high_V, 100.0f, 2u * LOOKS));
}

/* Half of it, as with an ADC's reference that is twice too large. */
static void test_a_link_that_stays_low_is_told_after_four_seconds(void)
{
    TEST_ASSERT_EQUAL_UINT32(LOOKS + 1u, told_after(197.9f, 100.0f, 2u * LOOKS));
    TEST_ASSERT_EQUAL_UINT32(1u, told_after(141.0f, -100.0f, 1u));
    setUp();
    TEST_ASSERT_TRUE(mains_check_init(&cfg, 0.5f, SCHEDULE_S)); /* as small as it may be */
    TEST_ASSERT_EQUAL_UINT32(LOOKS + 1u, told_after(0.1f, 100.0f, 2u * LOOKS));
}

static void test_a_link_that_stays_high_is_told_while_power_is_taken(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, told_after(339.5f, -1.0f, 2u * LOOKS));
    TEST_ASSERT_EQUAL_UINT32(0u, told_after(339.5f, 0.0f, 2u * LOOKS));
    TEST_ASSERT_EQUAL_UINT32(LOOKS + 1u, told_after(339.5f, 1.0f, 2u * LOOKS));
}

static void test_a_sag_heals_as_fast_as_it_came(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, told_after(141.0f, 1.0f, LOOKS));
    TEST_ASSERT_EQUAL_UINT32(0u, told_after(283.0f, 1.0f, 10u));
    TEST_ASSERT_EQUAL_UINT32(0u, told_after(141.0f, 1.0f, 10u));
    TEST_ASSERT_EQUAL_UINT32(1u, told_after(141.0f, 1.0f, 1u));
    TEST_ASSERT_EQUAL_UINT32(1u, told_after(141.0f, 1.0f, 1u)); /* and goes no further */
    TEST_ASSERT_EQUAL_UINT32(LOOKS + 1u, st.looks);
    TEST_ASSERT_EQUAL_UINT32(0u, told_after(283.0f, 1.0f, 2u * LOOKS));
    TEST_ASSERT_EQUAL_UINT32(0u, st.looks);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_what_is_no_mains);
    RUN_TEST(test_of_an_unknown_mains_nothing_is_asked);
    RUN_TEST(test_a_link_that_fits_its_mains);
    RUN_TEST(test_a_link_that_stays_low_is_told_after_four_seconds);
    RUN_TEST(test_a_link_that_stays_high_is_told_while_power_is_taken);
    RUN_TEST(test_a_sag_heals_as_fast_as_it_came);
    return UNITY_END();
}
