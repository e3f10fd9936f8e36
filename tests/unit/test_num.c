#include "num.h"

#include <math.h>

#include "exact.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static void test_constants_are_the_nearest_floats(void)
{
    ASSERT_SAME_FLOAT((float)acos(-1.0), NUM_PI);
    ASSERT_SAME_FLOAT((float)(2.0 * acos(-1.0)), NUM_TWO_PI);
    ASSERT_SAME_FLOAT((float)acos(0.0), NUM_HALF_PI);
    ASSERT_SAME_FLOAT((float)sqrt(0.5), NUM_SQRT_1_2);
    ASSERT_SAME_FLOAT((float)sqrt(2.0 / 3.0), NUM_SQRT_2_3);
}

static void test_clamp_keeps_what_is_inside(void)
{
    ASSERT_SAME_FLOAT(0.5f, clampf(0.5f, -1.0f, 2.0f));
    ASSERT_SAME_FLOAT(-1.0f, clampf(-1.0f, -1.0f, 2.0f));
    ASSERT_SAME_FLOAT(2.0f, clampf(2.0f, -1.0f, 2.0f));
}

static void test_clamp_limits_what_is_outside(void)
{
    ASSERT_SAME_FLOAT(-1.0f, clampf(-1.5f, -1.0f, 2.0f));
    ASSERT_SAME_FLOAT(2.0f, clampf(2.5f, -1.0f, 2.0f));
    ASSERT_SAME_FLOAT(-1.0f, clampf(-INFINITY, -1.0f, 2.0f));
    ASSERT_SAME_FLOAT(2.0f, clampf(INFINITY, -1.0f, 2.0f));
}

static void test_clamp_turns_nan_into_the_lower_limit(void)
{
    ASSERT_SAME_FLOAT(-1.0f, clampf(NAN, -1.0f, 2.0f));
}

static void test_symmetric_limit_keeps_what_is_inside_and_its_sign_outside(void)
{
    ASSERT_SAME_FLOAT(0.5f, limitf(0.5f, 2.0f));
    ASSERT_SAME_FLOAT(-0.5f, limitf(-0.5f, 2.0f));
    ASSERT_SAME_FLOAT(2.0f, limitf(2.0f, 2.0f));
    ASSERT_SAME_FLOAT(-2.0f, limitf(-2.0f, 2.0f));
    ASSERT_SAME_FLOAT(2.0f, limitf(2.5f, 2.0f));
    ASSERT_SAME_FLOAT(-2.0f, limitf(-2.5f, 2.0f));
    ASSERT_SAME_FLOAT(2.0f, limitf(INFINITY, 2.0f));
    ASSERT_SAME_FLOAT(-2.0f, limitf(-INFINITY, 2.0f));
    ASSERT_SAME_FLOAT(-2.0f, limitf(NAN, 2.0f));
    ASSERT_SAME_FLOAT(-0.5f, limitf(-0.7f, 0.5f));
    ASSERT_SAME_FLOAT(0.0f, limitf(0.1f, 0.0f));
}

static void test_absolute_value_drops_the_sign(void)
{
    ASSERT_SAME_FLOAT(3.0f, absf(3.0f));
    ASSERT_SAME_FLOAT(3.0f, absf(-3.0f));
    ASSERT_SAME_FLOAT(0.0f, absf(0.0f));
    TEST_ASSERT_TRUE(isnan(absf(NAN)));
}

static void test_larger_and_smaller_are_picked(void)
{
    ASSERT_SAME_FLOAT(2.0f, maxf(1.0f, 2.0f));
    ASSERT_SAME_FLOAT(2.0f, maxf(2.0f, 1.0f));
    ASSERT_SAME_FLOAT(1.0f, minf(1.0f, 2.0f));
    ASSERT_SAME_FLOAT(1.0f, minf(2.0f, 1.0f));
}

static void test_second_argument_wins_against_nan(void)
{
    ASSERT_SAME_FLOAT(1.0f, maxf(NAN, 1.0f));
    ASSERT_SAME_FLOAT(1.0f, minf(NAN, 1.0f));
}

static void test_finite_is_all_but_nan_and_infinity(void)
{
    TEST_ASSERT_TRUE(is_finite(0.0f));
    TEST_ASSERT_TRUE(is_finite(FLT_MAX));
    TEST_ASSERT_TRUE(is_finite(-FLT_MAX));
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        TEST_ASSERT_FALSE(is_finite(not_finite(k)));
    }
}

static void test_positive_is_finite_and_above_zero(void)
{
    TEST_ASSERT_TRUE(positivef(FLT_MAX));
    TEST_ASSERT_TRUE(positivef(FLT_MIN));
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        TEST_ASSERT_FALSE(positivef(not_positive(k)));
    }
}

static void test_effective_is_finite_and_at_least_the_smallest_normal(void)
{
    TEST_ASSERT_TRUE(effectivef(FLT_MAX));
    TEST_ASSERT_TRUE(effectivef(FLT_MIN));
    TEST_ASSERT_FALSE(effectivef(0.5f * FLT_MIN));
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        TEST_ASSERT_FALSE(effectivef(not_positive(k)));
    }
}

static void test_zero_is_zero_of_either_sign_and_nothing_else(void)
{
    TEST_ASSERT_TRUE(is_zero(0.0f));
    TEST_ASSERT_TRUE(is_zero(-0.0f));
    TEST_ASSERT_FALSE(is_zero(float_of_bits(1u)));
    TEST_ASSERT_FALSE(is_zero(-FLT_MIN));
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        TEST_ASSERT_FALSE(is_zero(not_finite(k)));
    }
}

static void test_above_zero_are_all_numbers_above_it(void)
{
    TEST_ASSERT_TRUE(above_zerof(FLT_MAX));
    TEST_ASSERT_TRUE(above_zerof(float_of_bits(1u))); /* the smallest there is */
    TEST_ASSERT_FALSE(above_zerof(0.0f));
    TEST_ASSERT_FALSE(above_zerof(-0.0f));
    TEST_ASSERT_FALSE(above_zerof(-FLT_MIN));
    TEST_ASSERT_FALSE(above_zerof(-FLT_MAX));
}

static void test_bits_are_those_of_ieee_754(void)
{
    TEST_ASSERT_EQUAL_HEX32(0x3F800000u, float_bits(1.0f));
    TEST_ASSERT_EQUAL_HEX32(0xC0490FDBu, float_bits(-NUM_PI));
    TEST_ASSERT_TRUE(float_of_bits(0x3F800000u) == 1.0f);
    TEST_ASSERT_TRUE(float_of_bits(0xC0490FDBu) == -NUM_PI);
}

static void test_duty_is_zero_to_one(void)
{
    TEST_ASSERT_TRUE(is_duty(0.0f));
    TEST_ASSERT_TRUE(is_duty(0.5f));
    TEST_ASSERT_TRUE(is_duty(1.0f));
    TEST_ASSERT_FALSE(is_duty(nextafterf(1.0f, 2.0f)));
    TEST_ASSERT_FALSE(is_duty(nextafterf(0.0f, -1.0f)));
    TEST_ASSERT_FALSE(is_duty(-0.0f));
    TEST_ASSERT_FALSE(is_duty(-0.5f));
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        TEST_ASSERT_FALSE(is_duty(not_finite(k)));
    }
}

static void test_nonnegative_is_positive_or_zero(void)
{
    TEST_ASSERT_TRUE(nonnegativef(FLT_MAX));
    TEST_ASSERT_TRUE(nonnegativef(0.0f));
    TEST_ASSERT_FALSE(nonnegativef(-FLT_MIN));
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        TEST_ASSERT_FALSE(nonnegativef(not_finite(k)));
    }
}

/* One bad number at any place is enough; no number is none. */
static void test_a_list_is_judged_by_its_worst_number(void)
{
    TEST_ASSERT_TRUE(ALL_FINITE(-1.0f, 0.0f, FLT_MAX));
    TEST_ASSERT_TRUE(ALL_NONNEGATIVE(0.0f, 1.0f, FLT_MAX));
    TEST_ASSERT_TRUE(ALL_POSITIVE(FLT_MIN, 1.0f, FLT_MAX));
    for (size_t at = 0u; at < 3u; at++) {
        float x[3] = {1.0f, 2.0f, 3.0f};
        x[at] = -1.0f;
        TEST_ASSERT_TRUE(all_finite(x, 3u));
        TEST_ASSERT_FALSE(all_nonnegative(x, 3u));
        TEST_ASSERT_FALSE(all_positive(x, 3u));
        x[at] = 0.0f;
        TEST_ASSERT_TRUE(all_nonnegative(x, 3u));
        TEST_ASSERT_FALSE(all_positive(x, 3u));
        for (int k = 0; k < NOT_FINITE_COUNT; k++) {
            x[at] = not_finite(k);
            TEST_ASSERT_FALSE(all_finite(x, 3u));
            TEST_ASSERT_FALSE(all_nonnegative(x, 3u));
            TEST_ASSERT_FALSE(all_positive(x, 3u));
            TEST_ASSERT_TRUE(all_finite(x, at));
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_constants_are_the_nearest_floats);
    RUN_TEST(test_clamp_keeps_what_is_inside);
    RUN_TEST(test_clamp_limits_what_is_outside);
    RUN_TEST(test_clamp_turns_nan_into_the_lower_limit);
    RUN_TEST(test_symmetric_limit_keeps_what_is_inside_and_its_sign_outside);
    RUN_TEST(test_absolute_value_drops_the_sign);
    RUN_TEST(test_larger_and_smaller_are_picked);
    RUN_TEST(test_second_argument_wins_against_nan);
    RUN_TEST(test_finite_is_all_but_nan_and_infinity);
    RUN_TEST(test_positive_is_finite_and_above_zero);
    RUN_TEST(test_effective_is_finite_and_at_least_the_smallest_normal);
    RUN_TEST(test_zero_is_zero_of_either_sign_and_nothing_else);
    RUN_TEST(test_above_zero_are_all_numbers_above_it);
    RUN_TEST(test_bits_are_those_of_ieee_754);
    RUN_TEST(test_duty_is_zero_to_one);
    RUN_TEST(test_nonnegative_is_positive_or_zero);
    RUN_TEST(test_a_list_is_judged_by_its_worst_number);
    return UNITY_END();
}
