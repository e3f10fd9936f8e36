/* 0 to 10 V and 4 to 20 mA: scale, dead band, filter, wire break. */
#include "analog_reference.h"

#include <math.h>

#include "unity.h"

#define FULL_A 25e-3f
#define FULL_V 12.5f
#define LOST   10u

static analog_reference_config_t cfg;
static analog_reference_state_t st;
static analog_reference_params_t params;

static void start(analog_reference_kind_t kind, float full_scale)
{
    params = (analog_reference_params_t){.kind = (uint32_t)kind,
                                         .full_scale = full_scale,
                                         .dead_pu = 0.02f,
                                         .filter_s = 0.0f,
                                         .lost_steps = LOST};
    TEST_ASSERT_TRUE(analog_reference_init(&cfg, &params));
    st = (analog_reference_state_t){0};
}

void setUp(void)
{
    start(ANALOG_REFERENCE_CURRENT, FULL_A);
}
void tearDown(void)
{
}

static bool give(float value)
{
    const float full_scale = params.full_scale;
    return analog_reference_step(&cfg, &st, (uint16_t)lroundf(value / full_scale * 65536.0f), 1u);
}

static void refused(float *number, float wrong)
{
    const float right = *number;
    *number = wrong;
    TEST_ASSERT_FALSE(analog_reference_init(&cfg, &params));
    *number = right;
    TEST_ASSERT_TRUE(analog_reference_init(&cfg, &params));
}

static void test_init_refuses_what_is_outside_its_range(void)
{
    refused(&params.full_scale, 21e-3f);
    refused(&params.full_scale, INFINITY);
    refused(&params.full_scale, NAN);
    refused(&params.dead_pu, -0.1f);
    refused(&params.dead_pu, 1.0f);
    refused(&params.filter_s, -1e-6f);
    refused(&params.filter_s, NAN);
    params.lost_steps = 0u;
    TEST_ASSERT_FALSE(analog_reference_init(&cfg, &params));
    params.lost_steps = 1u;
    TEST_ASSERT_TRUE(analog_reference_init(&cfg, &params));
    params.kind = 3u;
    TEST_ASSERT_FALSE(analog_reference_init(&cfg, &params));
    start(ANALOG_REFERENCE_VOLTAGE, FULL_V);
    refused(&params.full_scale, 11.0f);
}

static void test_off_it_needs_no_input_and_gives_nothing(void)
{
    start(ANALOG_REFERENCE_OFF, 0.0f);
    for (uint32_t k = 0u; k < 10u * LOST; k++) {
        TEST_ASSERT_FALSE(analog_reference_step(&cfg, &st, 0u, 1u));
    }
    TEST_ASSERT_FALSE(analog_reference_step(&cfg, &st, 30000u, 1u));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.share_pu);
}

static void test_4_to_20_mA_are_0_to_1(void)
{
    const float given_A[] = {3.7e-3f, 4e-3f, 8e-3f, 12e-3f, 20e-3f, 20.9e-3f};
    const float share_pu[] = {0.0f, 0.0f, 0.25f, 0.5f, 1.0f, 1.0f};
    for (uint32_t k = 0u; k < 6u; k++) {
        TEST_ASSERT_FALSE(give(given_A[k]));
        TEST_ASSERT_FLOAT_WITHIN(3e-5f, share_pu[k], st.share_pu);
    }
}

static void test_0_to_10_V_are_0_to_1(void)
{
    start(ANALOG_REFERENCE_VOLTAGE, FULL_V);
    const float given_V[] = {0.0f, 2.5f, 5.0f, 10.0f, 10.9f};
    const float share_pu[] = {0.0f, 0.25f, 0.5f, 1.0f, 1.0f};
    for (uint32_t k = 0u; k < 5u; k++) {
        TEST_ASSERT_FALSE(give(given_V[k]));
        TEST_ASSERT_FLOAT_WITHIN(3e-5f, share_pu[k], st.share_pu);
    }
    TEST_ASSERT_EQUAL_UINT32(0u, st.wrong);
    (void)give(11.1f);
    TEST_ASSERT_NOT_EQUAL_UINT32(0u, st.wrong);
}

static void test_below_the_dead_band_it_is_zero(void)
{
    (void)give(4e-3f + 0.019f * 16e-3f);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.share_pu);
    (void)give(4e-3f + 0.021f * 16e-3f);
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, 0.021f, st.share_pu);
}

static void test_a_share_at_the_dead_band_counts(void)
{
    start(ANALOG_REFERENCE_VOLTAGE, 16.0f); /* exact in binary */
    cfg.dead_pu = 0.5f;
    cfg.per_unit = 0.125f;
    (void)give(4.0f);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, st.share_pu);
}

static void test_the_filter_goes_its_share_of_the_way(void)
{
    cfg.filter_s = 3e-3f;
    (void)give(20e-3f);
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, 0.25f, st.share_pu);
    (void)give(20e-3f);
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, 0.4375f, st.share_pu);
}

static void test_a_broken_wire_is_lost_after_the_time(void)
{
    (void)give(12e-3f);
    const float before_pu = st.share_pu;
    for (uint32_t k = 0u; k < LOST - 1u; k++) {
        TEST_ASSERT_FALSE(give(3.5e-3f));
    }
    TEST_ASSERT_TRUE(give(3.5e-3f));
    TEST_ASSERT_EQUAL_FLOAT(before_pu, st.share_pu);
    TEST_ASSERT_FALSE(give(12e-3f));
}

static void test_a_short_is_lost_too(void)
{
    for (uint32_t k = 0u; k < LOST - 1u; k++) {
        TEST_ASSERT_FALSE(give(21.1e-3f));
    }
    TEST_ASSERT_TRUE(give(21.1e-3f));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.share_pu);
}

static void test_the_current_of_a_short_itself_is_none_yet(void)
{
    start(ANALOG_REFERENCE_VOLTAGE, 16.0f); /* exact in binary */
    cfg.break_high = 8.0f;
    (void)give(8.0f);
    TEST_ASSERT_EQUAL_UINT32(0u, st.wrong);
    (void)give(8.001f);
    TEST_ASSERT_NOT_EQUAL_UINT32(0u, st.wrong);
}

static void test_a_loose_contact_is_lost_and_a_single_value_is_not(void)
{
    bool lost = false;
    for (uint32_t k = 0u; k < 20u * LOST; k++) {
        lost = lost || give((k % 16u == 0u) ? 0.0f : 12e-3f);
    }
    TEST_ASSERT_FALSE(lost);
    for (uint32_t k = 0u; k < 40u * LOST; k++) {
        lost = lost || give((k % 4u == 0u) ? 0.0f : 12e-3f);
    }
    TEST_ASSERT_TRUE(lost);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_what_is_outside_its_range);
    RUN_TEST(test_off_it_needs_no_input_and_gives_nothing);
    RUN_TEST(test_4_to_20_mA_are_0_to_1);
    RUN_TEST(test_0_to_10_V_are_0_to_1);
    RUN_TEST(test_below_the_dead_band_it_is_zero);
    RUN_TEST(test_a_share_at_the_dead_band_counts);
    RUN_TEST(test_the_filter_goes_its_share_of_the_way);
    RUN_TEST(test_a_broken_wire_is_lost_after_the_time);
    RUN_TEST(test_a_short_is_lost_too);
    RUN_TEST(test_the_current_of_a_short_itself_is_none_yet);
    RUN_TEST(test_a_loose_contact_is_lost_and_a_single_value_is_not);
    return UNITY_END();
}
