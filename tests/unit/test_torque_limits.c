/* What dc link, temperatures and pull-out leave of the torque current, in both directions. */
#include "torque_limits.h"

#include "exact.h"

#define MOST_A 12.0f

static torque_limits_config_t cfg;
static torque_limits_state_t st;
static torque_limits_params_t params;

void setUp(void)
{
    params = (torque_limits_params_t){
        .link = {.regen_start_V = 600.0f, .u_dc_max_V = 700.0f},
        .overload = {.cont_A = {5.0f, 0.0f}, .tau_s = {10.0f, 10.0f}, .i_max_A = 15.0f},
        .i_q_max_A = MOST_A};
    TEST_ASSERT_TRUE(torque_limits_init(&cfg, &params, 3.2e-3f));
    st = (torque_limits_state_t){0};
}

void tearDown(void)
{
}

static void assert_window(float low_A, float high_A, float omega_rad_s, float i_d_A,
                          float pull_out_A)
{
    const torque_window_t w = torque_limits_window(&cfg, &st, omega_rad_s, i_d_A, pull_out_A);
    ASSERT_NEAR(1e-5, low_A, w.low_A);
    ASSERT_NEAR(1e-5, high_A, w.high_A);
}

static void test_init_refuses_what_a_part_refuses(void)
{
    params.link.u_dc_max_V = 0.0f;
    TEST_ASSERT_FALSE(torque_limits_init(&cfg, &params, 3.2e-3f));
    setUp();
    params.overload.cont_A[0] = -1.0f;
    TEST_ASSERT_FALSE(torque_limits_init(&cfg, &params, 3.2e-3f));
    setUp();
    TEST_ASSERT_FALSE(torque_limits_init(&cfg, &params, 0.0f));
}

static void test_nothing_limits_a_healthy_drive(void)
{
    TEST_ASSERT_FALSE(torque_limits_active(&st));
    assert_window(-12.0f, 12.0f, 100.0f, 4.0f, 0.0f);
    assert_window(-12.0f, 12.0f, -100.0f, 4.0f, 0.0f);
}

static void test_pull_out_takes_from_both_directions(void)
{
    assert_window(-9.5f, 9.5f, 100.0f, 4.0f, 2.5f);
}

/* i_d has priority: 3 of 5 A magnetise, 4 are left; none where i_d takes all. */
static void test_heat_leaves_what_the_magnetising_current_does(void)
{
    st.overload = (overload_state_t){.derating = true, .i_max_A = 5.0f};
    TEST_ASSERT_TRUE(torque_limits_active(&st));
    assert_window(-4.0f, 4.0f, 100.0f, 3.0f, 0.0f);
    assert_window(0.0f, 0.0f, 100.0f, 6.0f, 0.0f);
    assert_window(-3.5f, 3.5f, 100.0f, 3.0f, 8.5f); /* the smaller of the two */
    assert_window(-4.0f, 4.0f, 100.0f, 3.0f, 7.5f);
}

/* Braking is against the speed, in either direction. Up to .4 less flux is to do it, 1 is nothing;
 * .85 is a quarter of the way from 1 to .4. */
static void test_a_full_link_limits_what_brakes(void)
{
    st.link = (link_limit_state_t){.limiting = true, .taken_pu = 0.39f};
    assert_window(-12.0f, 12.0f, 100.0f, 4.0f, 0.0f);
    st.link.taken_pu = 0.41f;
    assert_window(-11.8f, 12.0f, 100.0f, 4.0f, 0.0f);
    st.link.taken_pu = 1.0f;
    assert_window(0.0f, 12.0f, 100.0f, 4.0f, 0.0f);
    st.link.taken_pu = 0.85f;
    TEST_ASSERT_TRUE(torque_limits_active(&st));
    assert_window(-3.0f, 12.0f, 100.0f, 4.0f, 0.0f);
    assert_window(-12.0f, 3.0f, -100.0f, 4.0f, 0.0f);
    assert_window(-12.0f, 3.0f, -0.5f, 4.0f, 0.0f);
    assert_window(-3.0f, 12.0f, 0.0f, 4.0f, 0.0f);
}

/* The shares are of what heat and pull-out leave. */
static void test_link_and_heat_limit_together(void)
{
    st.link = (link_limit_state_t){.limiting = true, .taken_pu = 0.7f};
    st.overload = (overload_state_t){.derating = true, .i_max_A = 5.0f};
    assert_window(-2.0f, 4.0f, 100.0f, 3.0f, 0.0f);
    assert_window(-4.0f, 2.0f, -100.0f, 3.0f, 0.0f);
}

static void test_a_current_that_is_no_number_leaves_numbers(void)
{
    st.overload = (overload_state_t){.derating = true, .i_max_A = 5.0f};
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        const torque_window_t w = torque_limits_window(&cfg, &st, 100.0f, not_finite(k), 0.0f);
        ASSERT_SAME_FLOAT(0.0f, w.high_A);
        TEST_ASSERT_EQUAL_FLOAT(0.0f, w.low_A);
    }
}

static void test_warnings_say_which_limit_acts(void)
{
    TEST_ASSERT_EQUAL_HEX32(0u, torque_limits_warnings(&st, true));
    st.link.limiting = true;
    TEST_ASSERT_EQUAL_HEX32(FAULT_REGENERATION, torque_limits_warnings(&st, true));
    TEST_ASSERT_EQUAL_HEX32(0u, torque_limits_warnings(&st, false));
    st.overload.derating = true;
    TEST_ASSERT_EQUAL_HEX32(FAULT_REGENERATION | FAULT_DERATED, torque_limits_warnings(&st, true));
    TEST_ASSERT_EQUAL_HEX32(FAULT_DERATED, torque_limits_warnings(&st, false));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_what_a_part_refuses);
    RUN_TEST(test_nothing_limits_a_healthy_drive);
    RUN_TEST(test_pull_out_takes_from_both_directions);
    RUN_TEST(test_heat_leaves_what_the_magnetising_current_does);
    RUN_TEST(test_a_full_link_limits_what_brakes);
    RUN_TEST(test_link_and_heat_limit_together);
    RUN_TEST(test_a_current_that_is_no_number_leaves_numbers);
    RUN_TEST(test_warnings_say_which_limit_acts);
    return UNITY_END();
}
