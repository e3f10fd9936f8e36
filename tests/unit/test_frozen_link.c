/* A dc link word that stays as it is while the motor brakes. */
#include "frozen_link.h"

#include "exact.h"

/* 35 W */
#define CHOPPER_ON_V 350.0f
#define TRIP_A       20.0f
#define LOOKS        16u

static frozen_link_config_t cfg;
static frozen_link_state_t st;
static bool brake_on;

void setUp(void)
{
    frozen_link_init(&cfg, CHOPPER_ON_V, TRIP_A);
    st = (frozen_link_state_t){0};
    brake_on = false;
}

void tearDown(void)
{
}

/* Looks until it is told; 0: not within `most`. The word changes by step_V at every look. */
static uint32_t told_after(float u_dc_V, float step_V, float power_W, uint32_t most)
{
    for (uint32_t k = 1u; k <= most; k++) {
        if (frozen_link_look(&cfg, &st, u_dc_V + (float)k * step_V, power_W, brake_on)) {
            return k;
        }
    }
    return 0u;
}

static void test_a_word_that_stays_while_power_comes_back_is_told(void)
{
    /* The first look only learns the word. */
    TEST_ASSERT_EQUAL_UINT32(LOOKS + 1u, told_after(346.0f, 0.0f, -700.0f, 100u));
    setUp();
    TEST_ASSERT_EQUAL_UINT32(LOOKS + 1u, told_after(333.0f, 0.0f, -35.1f, 100u));
    TEST_ASSERT_EQUAL_UINT32(1u, told_after(333.0f, 0.0f, -35.1f, 1u)); /* and stays told */
}

static void test_one_change_of_the_word_is_enough(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, told_after(346.0f, 0.0f, -700.0f, LOOKS));
    TEST_ASSERT_EQUAL_UINT32(0u, told_after(346.03f, 0.0f, -700.0f, LOOKS));
    TEST_ASSERT_EQUAL_UINT32(1u, told_after(346.03f, 0.0f, -700.0f, 1u));
    setUp();
    TEST_ASSERT_EQUAL_UINT32(0u, told_after(346.0f, 0.03f, -700.0f, 1000u));
}

static void test_what_takes_power_or_hardly_returns_any_proves_nothing(void)
{
    const float power_W[] = {700.0f, 0.0f, -34.9f, NAN};
    for (int k = 0; k < 4; k++) {
        setUp();
        TEST_ASSERT_EQUAL_UINT32(0u, told_after(333.0f, 0.0f, power_W[k], 1000u));
        /* Braking has to last. */
        TEST_ASSERT_EQUAL_UINT32(0u, told_after(333.0f, 0.0f, -700.0f, LOOKS - 1u));
        TEST_ASSERT_EQUAL_UINT32(0u, told_after(333.0f, 0.0f, power_W[k], 1u));
        TEST_ASSERT_EQUAL_UINT32(LOOKS, told_after(333.0f, 0.0f, -700.0f, 100u));
    }
}

/* It takes power back and stays as it is. */
static void test_a_supply_is_left_alone(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, told_after(332.4f, 0.0f, -700.0f, 1000u));
    TEST_ASSERT_EQUAL_UINT32(LOOKS + 1u, told_after(332.6f, 0.0f, -700.0f, 1000u));
}

/* It may take just what comes: the link rests. */
static void test_a_resistor_that_is_on_may_hold_the_link(void)
{
    brake_on = true;
    TEST_ASSERT_EQUAL_UINT32(0u, told_after(346.0f, 0.0f, -700.0f, 1000u));
    brake_on = false;
    TEST_ASSERT_EQUAL_UINT32(LOOKS, told_after(346.0f, 0.0f, -700.0f, 100u));
}

static void test_without_a_brake_resistor_nothing_is_asked(void)
{
    frozen_link_init(&cfg, 0.0f, TRIP_A);
    TEST_ASSERT_EQUAL_UINT32(0u, told_after(346.0f, 0.0f, -700.0f, 1000u));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_word_that_stays_while_power_comes_back_is_told);
    RUN_TEST(test_one_change_of_the_word_is_enough);
    RUN_TEST(test_what_takes_power_or_hardly_returns_any_proves_nothing);
    RUN_TEST(test_a_supply_is_left_alone);
    RUN_TEST(test_a_resistor_that_is_on_may_hold_the_link);
    RUN_TEST(test_without_a_brake_resistor_nothing_is_asked);
    return UNITY_END();
}
