/* The list of the terminals' parameters, and the masks of their faults. */
#include "terminal_params.h"

#include <math.h>

#include "unity.h"

static terminal_params_t params;

void setUp(void)
{
    terminal_params_default(&params);
}
void tearDown(void)
{
}

static uint32_t find(const char *name)
{
    const uint32_t index = terminal_params_find(name);
    TEST_ASSERT_TRUE(index < terminal_params_count());
    return index;
}

static void test_every_feature_is_off_by_default(void)
{
    const char *const choices[] = {"start_control", "analog_reference", "analog_lost_action",
                                   "brake_control", "brake_feedback",   "sink_sensor",
                                   "motor_sensor",  "precharge",        "contactor_feedback",
                                   "chopper_ohm",   "chopper_feedback", "full_speed_rad_s"};
    for (uint32_t k = 0u; k < sizeof choices / sizeof choices[0]; k++) {
        TEST_ASSERT_EQUAL_FLOAT(0.0f, terminal_params_get(&params, find(choices[k])));
    }
    TEST_ASSERT_EQUAL_FLOAT(0.01f, terminal_params_get(&params, find("contact_debounce_s")));
    TEST_ASSERT_EQUAL_FLOAT(3435.0f, params.ntc_beta_K);
}

static void test_every_name_is_found_and_nothing_else(void)
{
    for (uint32_t k = 0u; k < terminal_params_count(); k++) {
        TEST_ASSERT_EQUAL_UINT32(k, terminal_params_find(terminal_params_name(k)));
        TEST_ASSERT_TRUE(terminal_params_name(k)[0] != '\0');
    }
    TEST_ASSERT_EQUAL_UINT32(sizeof params / sizeof(uint32_t), terminal_params_count());
    TEST_ASSERT_EQUAL_UINT32(terminal_params_count(), terminal_params_find("start"));
    TEST_ASSERT_EQUAL_UINT32(terminal_params_count(), terminal_params_find("start_controls"));
    TEST_ASSERT_EQUAL_STRING("", terminal_params_name(terminal_params_count()));
}

static void test_a_number_is_set_within_its_range(void)
{
    const uint32_t index = find("brake_close_rad_s");
    TEST_ASSERT_TRUE(terminal_params_set(&params, index, 100.0f));
    TEST_ASSERT_EQUAL_FLOAT(100.0f, params.brake_close_rad_s);
    TEST_ASSERT_TRUE(terminal_params_set(&params, index, 0.5f));
    TEST_ASSERT_EQUAL_FLOAT(0.5f, params.brake_close_rad_s);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, terminal_params_get(&params, index));
    TEST_ASSERT_TRUE(terminal_params_set(&params, index, 0.0f));
    TEST_ASSERT_FALSE(terminal_params_set(&params, index, 100.1f));
    TEST_ASSERT_FALSE(terminal_params_set(&params, index, -0.1f));
    TEST_ASSERT_FALSE(terminal_params_set(&params, index, NAN));
    TEST_ASSERT_FALSE(terminal_params_set(&params, index, INFINITY));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, params.brake_close_rad_s);
}

static void test_a_choice_is_a_whole_number(void)
{
    const uint32_t index = find("motor_sensor");
    TEST_ASSERT_TRUE(terminal_params_set(&params, index, 3.0f));
    TEST_ASSERT_EQUAL_UINT32(3u, params.motor_sensor);
    TEST_ASSERT_EQUAL_FLOAT(3.0f, terminal_params_get(&params, index));
    TEST_ASSERT_FALSE(terminal_params_set(&params, index, 1.5f));
    TEST_ASSERT_FALSE(terminal_params_set(&params, index, 4.0f));
    TEST_ASSERT_EQUAL_UINT32(3u, params.motor_sensor);
}

static void test_what_does_not_exist_is_refused(void)
{
    const terminal_params_t before = params;
    TEST_ASSERT_FALSE(terminal_params_set(&params, terminal_params_count(), 0.0f));
    TEST_ASSERT_EQUAL_MEMORY(&before, &params, sizeof params);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, terminal_params_get(&params, terminal_params_count()));
}

static void test_reactions_are_those_of_the_list(void)
{
    TEST_ASSERT_EQUAL_UINT32(terminal_opening, terminal_opening & terminal_stopping);
    const uint32_t opening = TERMINAL_FAULT_BRAKE_TORQUE | TERMINAL_FAULT_BRAKE_NOT_RELEASED |
                             TERMINAL_FAULT_BRAKE_FEEDBACK | TERMINAL_FAULT_SINK_HOT |
                             TERMINAL_FAULT_PRECHARGE | TERMINAL_FAULT_CONTACTOR |
                             TERMINAL_FAULT_CHOPPER_SHORT | TERMINAL_FAULT_LINK_LOW;
    const uint32_t stopping = TERMINAL_FAULT_REFERENCE_LOST | TERMINAL_FAULT_INPUTS_LOST |
                              TERMINAL_FAULT_SINK_SENSOR | TERMINAL_FAULT_MOTOR_HOT |
                              TERMINAL_FAULT_CHOPPER_HOT;
    TEST_ASSERT_EQUAL_HEX32(opening, terminal_opening);
    TEST_ASSERT_EQUAL_HEX32(opening | stopping, terminal_stopping);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_feature_is_off_by_default);
    RUN_TEST(test_every_name_is_found_and_nothing_else);
    RUN_TEST(test_a_number_is_set_within_its_range);
    RUN_TEST(test_a_choice_is_a_whole_number);
    RUN_TEST(test_what_does_not_exist_is_refused);
    RUN_TEST(test_reactions_are_those_of_the_list);
    return UNITY_END();
}
