/* The tests that the contract sets for every rival. A test program defines `within`, its
 * tolerances, before it includes this, and calls run_contract() between UNITY_BEGIN() and
 * UNITY_END().
 */
#ifndef ESTIMATOR_CONTRACT_H
#define ESTIMATOR_CONTRACT_H

#include "estimator_fixture.h"

void setUp(void)
{
    configure(0);
}

void tearDown(void)
{
}

static void test_it_stays_with_the_motor(void)
{
    check_stays_with_the_motor(within.flux_pu, within.speed_rad_s);
}

static void test_it_finds_the_speed(void)
{
    check_finds_the_speed(20.0, within.flux_pu, within.speed_rad_s);
    check_finds_the_speed(-20.0, within.flux_pu, within.speed_rad_s);
}

static void test_an_imposed_speed_is_taken(void)
{
    check_hold(within.flux_pu, within.held_rad_s);
}

static void test_it_magnetises_at_rest(void)
{
    check_magnetises(2e-3, 1e-3);
}

static void test_extra_slip_is_taken_off(void)
{
    check_takes_off_the_extra_slip(within.extra_slip_rad_s);
}

static void test_the_frame_may_be_imposed(void)
{
    check_takes_the_imposed_frame();
}

static void test_off_forgets_the_flux(void)
{
    check_off_forgets_the_flux();
}

static void test_states_are_bounded(void)
{
    check_bounds();
}

static void test_it_mirrors(void)
{
    check_mirror();
}

static void test_no_table_is_wanted(void)
{
    TEST_ASSERT_NULL(estimator_table(&cfg));
}

static void test_bad_parameters_are_refused(void)
{
    float *const parameter[] = {&list.period_s, &list.i_d_A, &list.omega_max_rad_s,
                                &list.lambda_max_Wb};
    check_refuses(parameter, sizeof parameter / sizeof parameter[0]);
}

static inline void run_contract(void)
{
    RUN_TEST(test_it_stays_with_the_motor);
    RUN_TEST(test_it_finds_the_speed);
    RUN_TEST(test_an_imposed_speed_is_taken);
    RUN_TEST(test_it_magnetises_at_rest);
    RUN_TEST(test_extra_slip_is_taken_off);
    RUN_TEST(test_the_frame_may_be_imposed);
    RUN_TEST(test_off_forgets_the_flux);
    RUN_TEST(test_states_are_bounded);
    RUN_TEST(test_it_mirrors);
    RUN_TEST(test_no_table_is_wanted);
    RUN_TEST(test_bad_parameters_are_refused);
}

#endif
