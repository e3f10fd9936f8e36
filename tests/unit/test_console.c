/* Lines of text -> command of the drive (hal/stm32f405/console.h). */
#include "console.h"

#include "drive_state.h"
#include "unity.h"

static console_t console;

void setUp(void)
{
    console = (console_t){0};
}

void tearDown(void)
{
}

static const char *line(const char *text)
{
    for (; *text != '\0'; text++) {
        TEST_ASSERT_EQUAL_STRING("", console_byte(&console, *text));
    }
    return console_byte(&console, '\r');
}

static void assert_running(float rad_s)
{
    TEST_ASSERT_EQUAL_HEX32(DRIVE_STATE_CMD_RUN, console.command);
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, rad_s, console.omega_m_ref_rad_s);
}

static void test_run_takes_a_speed_of_either_sign(void)
{
    TEST_ASSERT_EQUAL_STRING("ok\r\n", line("run 300"));
    assert_running(31.415927f);
    TEST_ASSERT_EQUAL_STRING("ok\r\n", line("run -60"));
    assert_running(-6.2831853f);
    TEST_ASSERT_EQUAL_STRING("ok\r\n", line("run 6000"));
    assert_running(628.31853f);
}

static void test_stop_and_reset(void)
{
    (void)line("run 300");
    TEST_ASSERT_EQUAL_STRING("ok\r\n", line("stop"));
    TEST_ASSERT_EQUAL_HEX32(0u, console.command);
    TEST_ASSERT_EQUAL_STRING("ok\r\n", line("reset"));
    TEST_ASSERT_EQUAL_HEX32(DRIVE_STATE_CMD_FAULT_RESET, console.command);
}

/* The drive takes the edge; a level would swallow the next reset and clear breaks to come. */
static void test_a_reset_is_a_pulse_and_can_be_given_again(void)
{
    for (uint32_t n = 0u; n < 2u; n++) {
        const uint32_t now = 0xFFFFFFFFu + 100u * n; /* the count wraps */
        (void)line("reset");
        for (uint32_t k = 0u; k <= 2u; k++) {
            TEST_ASSERT_EQUAL_HEX32(DRIVE_STATE_CMD_FAULT_RESET,
                                    console_command(&console, now + k));
        }
        TEST_ASSERT_EQUAL_HEX32(0u, console_command(&console, now + 3u));
    }
}

static void test_a_run_command_stands(void)
{
    (void)line("reset");
    (void)console_command(&console, 0u);
    (void)line("run 300");
    for (uint32_t period = 0u; period < 10u; period++) {
        TEST_ASSERT_EQUAL_HEX32(DRIVE_STATE_CMD_RUN, console_command(&console, period));
    }
}

/* The line feed behind a carriage return is no line of its own. */
static void test_an_empty_line_changes_nothing(void)
{
    (void)line("run 300");
    TEST_ASSERT_EQUAL_STRING("", console_byte(&console, '\n'));
    assert_running(31.415927f);
}

static void test_whatever_is_not_understood_stops(void)
{
    const char *const bad[] = {"run",
                               "run ",
                               "run -",
                               "run 12x",
                               "run 6001",
                               "run 99999999999",
                               "run 300 now and fast",
                               "RUN 300",
                               "stopp",
                               "reset ",
                               "r",
                               " run 300",
                               "run 3000000000000"};
    for (size_t k = 0u; k < sizeof bad / sizeof bad[0]; k++) {
        (void)line("run 300");
        TEST_ASSERT_EQUAL_STRING("? run RPM | stop | reset; stopped\r\n", line(bad[k]));
        TEST_ASSERT_EQUAL_HEX32(0u, console.command);
    }
}

static void test_nothing_runs_before_the_first_line(void)
{
    TEST_ASSERT_EQUAL_STRING("", console_byte(&console, 'r'));
    TEST_ASSERT_EQUAL_HEX32(0u, console.command);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_run_takes_a_speed_of_either_sign);
    RUN_TEST(test_stop_and_reset);
    RUN_TEST(test_a_reset_is_a_pulse_and_can_be_given_again);
    RUN_TEST(test_a_run_command_stands);
    RUN_TEST(test_an_empty_line_changes_nothing);
    RUN_TEST(test_whatever_is_not_understood_stops);
    RUN_TEST(test_nothing_runs_before_the_first_line);
    return UNITY_END();
}
