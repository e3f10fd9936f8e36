#include "link_limit.h"

#include <math.h>

#include "unity.h"

static const link_limit_params_t all = {
    .chopper_on_V = 350.0f, .regen_start_V = 360.0f, .u_dc_max_V = 400.0f};
static link_limit_config_t cfg;
static link_limit_state_t st;

void setUp(void)
{
    TEST_ASSERT_TRUE(link_limit_init(&cfg, &all));
    st = (link_limit_state_t){0};
}

void tearDown(void)
{
}

#define ASSERT_REFUSED(field, value)                                                               \
    do {                                                                                           \
        link_limit_params_t bad = all;                                                             \
        bad.field = (value);                                                                       \
        TEST_ASSERT_FALSE_MESSAGE(link_limit_init(&cfg, &bad), #field " = " #value);               \
    } while (0)

static void test_init_refuses_levels_in_the_wrong_order(void)
{
    ASSERT_REFUSED(chopper_on_V, -1.0f);
    ASSERT_REFUSED(chopper_on_V, 401.0f);
    ASSERT_REFUSED(regen_start_V, INFINITY);
    ASSERT_REFUSED(regen_start_V, 400.0f);
    ASSERT_REFUSED(u_dc_max_V, 0.0f);
}

/* All of it at every voltage. */
static void test_without_a_level_braking_is_whole(void)
{
    const link_limit_params_t p = {.u_dc_max_V = 400.0f};
    TEST_ASSERT_TRUE(link_limit_init(&cfg, &p));
    TEST_ASSERT_EQUAL_FLOAT(1.0f, cfg.braking_pu);
}

static void test_below_the_first_level_nothing_acts(void)
{
    for (float u_V = 0.0f; u_V < 349.5f; u_V += 0.5f) {
        link_limit_step(&cfg, &st, u_V);
        TEST_ASSERT_FALSE(st.acting);
        TEST_ASSERT_FALSE(st.limiting);
        TEST_ASSERT_FALSE(st.brake_on);
    }
}

/* 0: torque is not limited; any level above is one, without a resistor too. */
static void test_without_a_resistor_the_limit_of_torque_is_the_first_level(void)
{
    const link_limit_params_t p = {.regen_start_V = 0.75f, .u_dc_max_V = 1.0f};
    TEST_ASSERT_TRUE(link_limit_init(&cfg, &p));
    st = (link_limit_state_t){0};
    link_limit_step(&cfg, &st, 0.7f);
    TEST_ASSERT_FALSE(st.acting);
    link_limit_step(&cfg, &st, 0.8f);
    TEST_ASSERT_TRUE(st.acting);
}

/* 0: there is no resistor; any level above is one. */
static void test_a_resistor_acts_from_its_level_on_and_none_does_not(void)
{
    const float on_V[] = {0.0f, 0.5f};
    for (int k = 0; k < 2; k++) {
        const link_limit_params_t p = {
            .chopper_on_V = on_V[k], .regen_start_V = 0.75f, .u_dc_max_V = 1.0f};
        TEST_ASSERT_TRUE(link_limit_init(&cfg, &p));
        st = (link_limit_state_t){0};
        link_limit_step(&cfg, &st, 0.6f);
        TEST_ASSERT_EQUAL(on_V[k] > 0.0f, st.acting);
        TEST_ASSERT_EQUAL(on_V[k] > 0.0f, st.brake_on);
    }
}

static void test_the_brake_resistor_has_a_hysteresis(void)
{
    link_limit_step(&cfg, &st, 350.5f);
    TEST_ASSERT_TRUE(st.brake_on);
    link_limit_step(&cfg, &st, 339.6f);
    TEST_ASSERT_TRUE(st.brake_on);
    link_limit_step(&cfg, &st, 339.4f);
    TEST_ASSERT_FALSE(st.brake_on);
    TEST_ASSERT_FALSE(st.acting);
    link_limit_step(&cfg, &st, 349.5f);
    TEST_ASSERT_FALSE(st.brake_on);
}

/* None is left at 390 V: a quarter of the 40 V before the trip. */
static void test_braking_fades_before_the_trip(void)
{
    link_limit_step(&cfg, &st, 375.0f);
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 0.5f, st.taken_pu);
    TEST_ASSERT_TRUE(st.limiting);
    link_limit_step(&cfg, &st, 390.0f);
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 1.0f, st.taken_pu);
    link_limit_step(&cfg, &st, 399.0f);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, st.taken_pu);
    link_limit_step(&cfg, &st, 345.0f);
    TEST_ASSERT_FALSE(st.limiting);
}

static void test_at_zero_volts_each_is_off(void)
{
    const link_limit_params_t none = {.u_dc_max_V = 400.0f};
    TEST_ASSERT_TRUE(link_limit_init(&cfg, &none));
    const float u_V[] = {0.0f, 100.0f, 399.0f, 450.0f};
    for (unsigned k = 0u; k < sizeof u_V / sizeof *u_V; k++) {
        link_limit_step(&cfg, &st, u_V[k]);
        TEST_ASSERT_FALSE(st.acting);
        TEST_ASSERT_FALSE(st.brake_on);
    }
}

/* A link that is no number allows nothing, and the resistor takes no part in it. */
static void test_a_voltage_that_is_no_number_allows_least(void)
{
    link_limit_step(&cfg, &st, NAN);
    TEST_ASSERT_FALSE(st.brake_on);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, st.taken_pu);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_levels_in_the_wrong_order);
    RUN_TEST(test_without_a_level_braking_is_whole);
    RUN_TEST(test_below_the_first_level_nothing_acts);
    RUN_TEST(test_without_a_resistor_the_limit_of_torque_is_the_first_level);
    RUN_TEST(test_a_resistor_acts_from_its_level_on_and_none_does_not);
    RUN_TEST(test_the_brake_resistor_has_a_hysteresis);
    RUN_TEST(test_braking_fades_before_the_trip);
    RUN_TEST(test_at_zero_volts_each_is_off);
    RUN_TEST(test_a_voltage_that_is_no_number_allows_least);
    return UNITY_END();
}
