/* A word of the dc link that drops to stay, and what else a link does. */
#include "link_drop.h"

#include "exact.h"

#define U_DC_V 300.0f

static link_drop_state_t st;

void setUp(void)
{
    st = (link_drop_state_t){0};
}

void tearDown(void)
{
}

static void settle(void)
{
    for (int k = 0; k < 4; k++) {
        TEST_ASSERT_FALSE(link_drop_look(&st, U_DC_V));
    }
}

/* The first look is a beginning, whatever it finds. */
static void test_a_start_is_none(void)
{
    settle();
    ASSERT_SAME_FLOAT(U_DC_V, st.u_dc_V);
}

static void test_a_word_that_stays_low_is_told_in_the_second_look(void)
{
    const float low_V[] = {0.0f, 0.5f * U_DC_V, 209.0f};
    for (size_t k = 0; k < sizeof low_V / sizeof low_V[0]; k++) {
        setUp();
        settle();
        TEST_ASSERT_FALSE(link_drop_look(&st, low_V[k]));
        TEST_ASSERT_TRUE(link_drop_look(&st, low_V[k]));
        TEST_ASSERT_TRUE(link_drop_look(&st, low_V[k]));
    }
}

/* Mains that come back charge the link at once. */
static void test_down_to_seven_tenths_and_up_to_anywhere_is_none(void)
{
    const float other_V[] = {0.7f * U_DC_V, 211.0f, 390.0f, 2.0f * U_DC_V};
    for (size_t k = 0; k < sizeof other_V / sizeof other_V[0]; k++) {
        setUp();
        settle();
        for (int n = 0; n < 4; n++) {
            TEST_ASSERT_FALSE(link_drop_look(&st, other_V[k]));
        }
        ASSERT_SAME_FLOAT(other_V[k], st.u_dc_V);
    }
}

static void test_one_disturbed_sample_is_none(void)
{
    settle();
    for (int k = 0; k < 10; k++) {
        TEST_ASSERT_FALSE(link_drop_look(&st, (k % 2 == 0) ? 100.0f : U_DC_V));
    }
}

/* A sag that takes a few looks. */
static void test_a_link_may_fall(void)
{
    settle();
    for (float u_V = U_DC_V; u_V > 50.0f; u_V *= 0.72f) {
        TEST_ASSERT_FALSE(link_drop_look(&st, u_V));
    }
}

static void test_a_number_that_is_none_heals(void)
{
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        setUp();
        st.u_dc_V = not_finite(k);
        (void)link_drop_look(&st, U_DC_V);
        if (isinf(not_finite(k)) && (not_finite(k) > 0.0f)) { /* or is a fault */
            TEST_ASSERT_TRUE(link_drop_look(&st, U_DC_V));
        } else {
            settle();
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_start_is_none);
    RUN_TEST(test_a_word_that_stays_low_is_told_in_the_second_look);
    RUN_TEST(test_down_to_seven_tenths_and_up_to_anywhere_is_none);
    RUN_TEST(test_one_disturbed_sample_is_none);
    RUN_TEST(test_a_link_may_fall);
    RUN_TEST(test_a_number_that_is_none_heals);
    return UNITY_END();
}
