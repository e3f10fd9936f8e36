/* Debounce, start and stop with two and three wires, reset. */
#include "contacts.h"

#include "unity.h"

#define STEPS 5u

static contacts_config_t cfg;
static contacts_state_t st;

void setUp(void)
{
    TEST_ASSERT_TRUE(contacts_init(&cfg, CONTACTS_TWO_WIRE, STEPS));
    st = (contacts_state_t){0};
}
void tearDown(void)
{
}

static void stand(uint32_t inputs, uint32_t steps)
{
    for (uint32_t k = 0u; k < steps; k++) {
        contacts_step(&cfg, &st, inputs, 1u);
    }
}

static void three_wires(void)
{
    TEST_ASSERT_TRUE(contacts_init(&cfg, CONTACTS_THREE_WIRE, STEPS));
    stand(HAL_TERMINAL_STOP, STEPS);
    TEST_ASSERT_FALSE(contacts_stop(&cfg, &st));
}

static void test_init_wants_a_control_that_exists_and_a_step(void)
{
    TEST_ASSERT_FALSE(contacts_init(&cfg, 3u, STEPS));
    TEST_ASSERT_FALSE(contacts_init(&cfg, CONTACTS_TWO_WIRE, 0u));
    TEST_ASSERT_TRUE(contacts_init(&cfg, CONTACTS_OFF, 1u));
    TEST_ASSERT_EQUAL(CONTACTS_OFF, cfg.control);
    TEST_ASSERT_EQUAL_UINT32(1u, cfg.debounce_steps);
}

/* Seen first after a gap it counts one step, then the time that passes. */
static void test_a_late_look_counts_its_time(void)
{
    contacts_step(&cfg, &st, 0u, 1u);
    contacts_step(&cfg, &st, HAL_TERMINAL_REVERSE, 100u * STEPS);
    TEST_ASSERT_EQUAL_UINT32(0u, st.closed);
    contacts_step(&cfg, &st, HAL_TERMINAL_REVERSE, STEPS - 2u);
    TEST_ASSERT_EQUAL_UINT32(0u, st.closed);
    contacts_step(&cfg, &st, HAL_TERMINAL_REVERSE, 1u);
    TEST_ASSERT_EQUAL_UINT32(HAL_TERMINAL_REVERSE, st.closed);
}

static void test_a_level_counts_once_it_has_stood(void)
{
    for (uint32_t k = 0u; k < HAL_TERMINAL_INPUTS; k++) {
        const uint32_t input = 1u << k;
        setUp();
        stand(input, STEPS - 1u);
        TEST_ASSERT_EQUAL_UINT32(0u, st.closed);
        stand(input, 1u);
        TEST_ASSERT_EQUAL_UINT32(input, st.closed);
        TEST_ASSERT_TRUE(contacts_closed(&st, input));
        TEST_ASSERT_FALSE(contacts_closed(&st, ~input));
        stand(0u, STEPS - 1u);
        TEST_ASSERT_EQUAL_UINT32(input, st.closed);
        stand(0u, 1u);
        TEST_ASSERT_EQUAL_UINT32(0u, st.closed);
    }
}

static void test_what_is_no_input_is_ignored(void)
{
    stand(~((1u << HAL_TERMINAL_INPUTS) - 1u), 3u * STEPS);
    TEST_ASSERT_EQUAL_UINT32(0u, st.closed);
}

static void test_a_bounce_begins_anew(void)
{
    stand(0u, STEPS);
    for (uint32_t k = 0u; k < 10u; k++) {
        stand(HAL_TERMINAL_START, STEPS - 1u);
        stand(0u, 1u);
    }
    TEST_ASSERT_FALSE(st.run);
    stand(HAL_TERMINAL_START, STEPS);
    TEST_ASSERT_TRUE(st.run);
}

static void test_two_wires_run_while_start_is_closed(void)
{
    stand(0u, STEPS);
    stand(HAL_TERMINAL_START, STEPS);
    TEST_ASSERT_TRUE(st.run);
    stand(HAL_TERMINAL_START, 100u);
    TEST_ASSERT_TRUE(st.run);
    stand(0u, STEPS);
    TEST_ASSERT_FALSE(st.run);
    stand(HAL_TERMINAL_START, STEPS);
    TEST_ASSERT_TRUE(st.run);
}

static void test_two_wires_do_not_look_at_stop(void)
{
    TEST_ASSERT_FALSE(contacts_stop(&cfg, &st));
    stand(HAL_TERMINAL_STOP, STEPS);
    TEST_ASSERT_FALSE(contacts_stop(&cfg, &st));
    TEST_ASSERT_FALSE(st.run);
}

static void test_start_that_is_closed_at_power_up_has_to_open(void)
{
    stand(HAL_TERMINAL_START, 20u * STEPS);
    TEST_ASSERT_FALSE(st.run);
    stand(0u, STEPS);
    stand(HAL_TERMINAL_START, STEPS);
    TEST_ASSERT_TRUE(st.run);
}

/* One look at an open contact is a bounce. */
static void test_start_that_bounces_at_power_up_has_to_open(void)
{
    stand(HAL_TERMINAL_START, STEPS - 1u);
    stand(0u, 1u);
    stand(HAL_TERMINAL_START, 20u * STEPS);
    TEST_ASSERT_FALSE(st.run);
    stand(0u, STEPS);
    stand(HAL_TERMINAL_START, STEPS);
    TEST_ASSERT_TRUE(st.run);
}

static void test_nothing_is_known_before_every_level_could_stand(void)
{
    stand(0u, STEPS - 1u);
    TEST_ASSERT_FALSE(st.armed);
    TEST_ASSERT_FALSE(st.reset_open);
    stand(0u, 1u);
    TEST_ASSERT_TRUE(st.armed);
    TEST_ASSERT_TRUE(st.reset_open);
    TEST_ASSERT_EQUAL_UINT32(STEPS, st.age);
    stand(0u, 10u);
    TEST_ASSERT_EQUAL_UINT32(STEPS, st.age);
}

static void test_run_that_was_taken_away_has_to_drop(void)
{
    stand(0u, STEPS);
    stand(HAL_TERMINAL_START, STEPS);
    contacts_withdraw(&st);
    TEST_ASSERT_FALSE(st.run);
    stand(HAL_TERMINAL_START, 10u * STEPS);
    TEST_ASSERT_FALSE(st.run);
    stand(0u, STEPS);
    stand(HAL_TERMINAL_START, STEPS);
    TEST_ASSERT_TRUE(st.run);
}

static void test_three_wires_start_by_a_button_and_stop_by_an_open_contact(void)
{
    three_wires();
    stand(HAL_TERMINAL_STOP | HAL_TERMINAL_START, STEPS);
    TEST_ASSERT_TRUE(st.run);
    stand(HAL_TERMINAL_STOP, 10u * STEPS);
    TEST_ASSERT_TRUE(st.run);
    stand(0u, STEPS);
    TEST_ASSERT_FALSE(st.run);
    TEST_ASSERT_TRUE(contacts_stop(&cfg, &st));
    stand(HAL_TERMINAL_STOP, 10u * STEPS);
    TEST_ASSERT_FALSE(st.run);
    TEST_ASSERT_FALSE(contacts_stop(&cfg, &st));
}

static void test_a_button_that_is_held_starts_once(void)
{
    three_wires();
    stand(HAL_TERMINAL_STOP | HAL_TERMINAL_START, STEPS);
    stand(HAL_TERMINAL_START, STEPS);
    TEST_ASSERT_FALSE(st.run);
    stand(HAL_TERMINAL_STOP | HAL_TERMINAL_START, 10u * STEPS);
    TEST_ASSERT_FALSE(st.run);
    contacts_withdraw(&st);
    stand(HAL_TERMINAL_STOP, STEPS);
    stand(HAL_TERMINAL_STOP | HAL_TERMINAL_START, STEPS);
    TEST_ASSERT_TRUE(st.run);
}

static void test_a_button_pressed_at_an_open_stop_is_used_up(void)
{
    three_wires();
    stand(0u, STEPS);
    stand(HAL_TERMINAL_START, STEPS);
    stand(HAL_TERMINAL_STOP | HAL_TERMINAL_START, 10u * STEPS);
    TEST_ASSERT_FALSE(st.run);
}

static void test_without_control_nothing_runs(void)
{
    TEST_ASSERT_TRUE(contacts_init(&cfg, CONTACTS_OFF, STEPS));
    stand(0u, STEPS);
    stand(HAL_TERMINAL_STOP, STEPS);
    stand(HAL_TERMINAL_STOP | HAL_TERMINAL_START, 3u * STEPS);
    TEST_ASSERT_FALSE(st.run);
    TEST_ASSERT_FALSE(st.armed);
    TEST_ASSERT_FALSE(contacts_stop(&cfg, &st));
}

static void test_reset_is_the_step_in_which_it_closes(void)
{
    stand(0u, STEPS);
    stand(HAL_TERMINAL_RESET, STEPS - 1u);
    TEST_ASSERT_FALSE(st.reset);
    stand(HAL_TERMINAL_RESET, 1u);
    TEST_ASSERT_TRUE(st.reset);
    stand(HAL_TERMINAL_RESET, 1u);
    TEST_ASSERT_FALSE(st.reset);
    stand(HAL_TERMINAL_RESET, 10u);
    TEST_ASSERT_FALSE(st.reset);
    stand(0u, STEPS);
    stand(HAL_TERMINAL_RESET, STEPS);
    TEST_ASSERT_TRUE(st.reset);
}

static void test_reset_that_is_closed_at_power_up_is_none(void)
{
    for (uint32_t k = 0u; k < 3u * STEPS; k++) {
        stand(HAL_TERMINAL_RESET, 1u);
        TEST_ASSERT_FALSE(st.reset);
    }
}

static void test_reset_that_bounces_at_power_up_is_none(void)
{
    stand(HAL_TERMINAL_RESET, STEPS - 1u);
    stand(0u, 1u);
    for (uint32_t k = 0u; k < 3u * STEPS; k++) {
        stand(HAL_TERMINAL_RESET, 1u);
        TEST_ASSERT_FALSE(st.reset);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_wants_a_control_that_exists_and_a_step);
    RUN_TEST(test_a_late_look_counts_its_time);
    RUN_TEST(test_a_level_counts_once_it_has_stood);
    RUN_TEST(test_what_is_no_input_is_ignored);
    RUN_TEST(test_a_bounce_begins_anew);
    RUN_TEST(test_two_wires_run_while_start_is_closed);
    RUN_TEST(test_two_wires_do_not_look_at_stop);
    RUN_TEST(test_start_that_is_closed_at_power_up_has_to_open);
    RUN_TEST(test_start_that_bounces_at_power_up_has_to_open);
    RUN_TEST(test_nothing_is_known_before_every_level_could_stand);
    RUN_TEST(test_run_that_was_taken_away_has_to_drop);
    RUN_TEST(test_three_wires_start_by_a_button_and_stop_by_an_open_contact);
    RUN_TEST(test_a_button_that_is_held_starts_once);
    RUN_TEST(test_a_button_pressed_at_an_open_stop_is_used_up);
    RUN_TEST(test_without_control_nothing_runs);
    RUN_TEST(test_reset_is_the_step_in_which_it_closes);
    RUN_TEST(test_reset_that_is_closed_at_power_up_is_none);
    RUN_TEST(test_reset_that_bounces_at_power_up_is_none);
    return UNITY_END();
}
