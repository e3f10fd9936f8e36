/* The host port: clock, watchdog and background cadence; instances do not know each other. */
#include "host_port.h"

#include <string.h>

#include "unity.h"

static params_t params;

void setUp(void)
{
    params_default(&params);
    params.observer_gain_enable = 0u;
}

void tearDown(void)
{
}

static void run(host_port_t *port, uint32_t command, int n, hal_output_t *out)
{
    const unit_command_t c = {.command = command};
    hal_sample_t sample = {8192u, 8192u, 8192u, 8192u, 8192u, 11592u, 0u, 0u};
    for (int k = 0; k < n; k++) {
        sample.i_u_counts ^= 1u; /* as words flicker */
        host_port_period(port, &c, &sample, out);
    }
}

static void test_background_runs_every_tenth_period_and_feeds_the_watchdog(void)
{
    host_port_t port;
    hal_output_t out;
    TEST_ASSERT_TRUE(host_port_init(&port, &params, NULL));
    run(&port, 0u, 9, &out);
    TEST_ASSERT_EQUAL_UINT32(0u, port.watchdog_served);
    run(&port, 0u, 1, &out);
    TEST_ASSERT_EQUAL_UINT32(1u, port.watchdog_served);
    run(&port, 0u, 20, &out);
    TEST_ASSERT_EQUAL_UINT32(3u, port.watchdog_served);
    TEST_ASSERT_EQUAL_UINT32(30u * 200u, port.clock_us);
    TEST_ASSERT_EQUAL_UINT32(port.clock_us, port.devices.clock_us(port.devices.context));
}

static void test_the_command_of_a_period_acts_in_that_period(void)
{
    host_port_t port;
    hal_output_t out;
    TEST_ASSERT_TRUE(host_port_init(&port, &params, NULL));
    run(&port, 0u, 600, &out);
    TEST_ASSERT_FALSE(out.gates_on);
    run(&port, SEQUENCE_CMD_RUN, 1, &out);
    TEST_ASSERT_TRUE(out.gates_on);
    run(&port, SEQUENCE_CMD_TORQUE_OFF, 1, &out);
    TEST_ASSERT_FALSE(out.gates_on);
}

static void test_a_refused_application_can_be_stepped(void)
{
    host_port_t port;
    hal_output_t out;
    params.M_H = 0.2f;
    TEST_ASSERT_FALSE(host_port_init(&port, &params, NULL));
    run(&port, SEQUENCE_CMD_RUN, 30, &out);
    TEST_ASSERT_FALSE(out.gates_on);
}

static void test_two_ports_do_not_know_each_other(void)
{
    host_port_t a, b;
    hal_output_t out;
    TEST_ASSERT_TRUE(host_port_init(&a, &params, NULL));
    TEST_ASSERT_TRUE(host_port_init(&b, &params, NULL));
    run(&a, 0u, 600, &out);
    run(&b, 0u, 600, &out);
    run(&a, SEQUENCE_CMD_RUN, 100, &out);
    TEST_ASSERT_EQUAL(SEQUENCE_PREMAGNETISE, a.unit.machine.id);
    TEST_ASSERT_EQUAL(SEQUENCE_READY, b.unit.machine.id);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, b.unit.drive.estimator.observer.i_s_hat_A.alpha);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_background_runs_every_tenth_period_and_feeds_the_watchdog);
    RUN_TEST(test_the_command_of_a_period_acts_in_that_period);
    RUN_TEST(test_a_refused_application_can_be_stepped);
    RUN_TEST(test_two_ports_do_not_know_each_other);
    return UNITY_END();
}
