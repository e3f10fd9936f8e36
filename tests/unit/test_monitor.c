#include "monitor.h"

#include <float.h>
#include <math.h>

#include "exact.h"
#include "unity.h"

static const monitor_config_t cfg = {.i_trip_A = 20.0f,
                                     .u_dc_max_V = 400.0f,
                                     .u_dc_min_V = 200.0f,
                                     .omega_max_rad_s = 500.0f,
                                     .plausibility_periods = 3u};

static measured_t meas;
static monitor_in_t in;
static monitor_state_t st;

void setUp(void)
{
    meas = (measured_t){.i_A = {5.0f, -2.0f, -3.0f},
                        .i_s_A = {6.1f, 0.7f},
                        .u_line_V = {100.0f, -50.0f},
                        .u_dc_V = 283.0f};
    in = (monitor_in_t){.meas = &meas, .state_sum = 7.5f, .omega_e_hat_rad_s = 100.0f};
    st = (monitor_state_t){0};
}

void tearDown(void)
{
}

/* One period with *value set to x; the value is put back. */
static uint32_t faults_with(float *value, float x)
{
    const float before = *value;
    *value = x;
    const uint32_t faults = monitor_step(&cfg, &st, &in);
    *value = before;
    return faults;
}

#define ASSERT_REFUSED(field, value)                                                               \
    do {                                                                                           \
        monitor_config_t bad = cfg;                                                                \
        bad.field = (value);                                                                       \
        TEST_ASSERT_FALSE_MESSAGE(monitor_init(&bad), #field " = " #value);                        \
    } while (0)

static void test_init_accepts_sensible_limits(void)
{
    monitor_config_t edge = cfg;
    TEST_ASSERT_TRUE(monitor_init(&edge));
    edge.u_dc_min_V = 0.0f;
    edge.plausibility_periods = 1u;
    TEST_ASSERT_TRUE(monitor_init(&edge));
}

static void test_init_refuses_every_bad_limit(void)
{
    ASSERT_REFUSED(i_trip_A, 0.0f);
    ASSERT_REFUSED(i_trip_A, -1.0f);
    ASSERT_REFUSED(i_trip_A, NAN);
    ASSERT_REFUSED(i_trip_A, INFINITY);
    ASSERT_REFUSED(u_dc_min_V, -1.0f);
    ASSERT_REFUSED(u_dc_min_V, NAN);
    ASSERT_REFUSED(u_dc_min_V, 400.0f); /* not below the maximum */
    ASSERT_REFUSED(u_dc_max_V, 199.0f);
    ASSERT_REFUSED(u_dc_max_V, NAN);
    ASSERT_REFUSED(u_dc_max_V, INFINITY);
    ASSERT_REFUSED(omega_max_rad_s, 0.0f);
    ASSERT_REFUSED(omega_max_rad_s, -1.0f);
    ASSERT_REFUSED(omega_max_rad_s, NAN);
    ASSERT_REFUSED(omega_max_rad_s, INFINITY);
    ASSERT_REFUSED(plausibility_periods, 0u);
    ASSERT_REFUSED(plausibility_periods, 1000001u);
}

static void test_bits_are_the_numbers_of_the_fault_log(void)
{
    const uint32_t bits[] = {FAULT_OVER_CURRENT, FAULT_DC_OVER_VOLTAGE, FAULT_DC_UNDER_VOLTAGE,
                             FAULT_NON_FINITE,   FAULT_ADC_RANGE,       FAULT_CURRENT_SUM,
                             FAULT_OVER_SPEED,   FAULT_CONFIG};
    for (unsigned i = 0; i < 8u; i++) {
        TEST_ASSERT_EQUAL_UINT32(1u << i, bits[i]);
    }
}

static void test_a_healthy_drive_has_no_fault(void)
{
    for (int k = 0; k < 10; k++) {
        TEST_ASSERT_EQUAL_UINT32(0u, monitor_step(&cfg, &st, &in));
    }
}

static void test_any_phase_beyond_the_trip_level_is_over_current(void)
{
    float *const phase[] = {&meas.i_A.u, &meas.i_A.v, &meas.i_A.w};
    for (unsigned i = 0; i < 3u; i++) {
        TEST_ASSERT_EQUAL_UINT32(0u, faults_with(phase[i], 20.0f));
        TEST_ASSERT_EQUAL_UINT32(0u, faults_with(phase[i], -20.0f));
        TEST_ASSERT_EQUAL_UINT32(FAULT_OVER_CURRENT, faults_with(phase[i], 20.001f));
        TEST_ASSERT_EQUAL_UINT32(FAULT_OVER_CURRENT, faults_with(phase[i], -20.001f));
        TEST_ASSERT_EQUAL_UINT32(FAULT_OVER_CURRENT, faults_with(phase[i], NAN));
        TEST_ASSERT_EQUAL_UINT32(FAULT_OVER_CURRENT, faults_with(phase[i], INFINITY));
    }
}

static void test_the_dc_link_has_an_upper_and_a_lower_limit(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, faults_with(&meas.u_dc_V, 400.0f));
    TEST_ASSERT_EQUAL_UINT32(0u, faults_with(&meas.u_dc_V, 200.0f));
    TEST_ASSERT_EQUAL_UINT32(FAULT_DC_OVER_VOLTAGE, faults_with(&meas.u_dc_V, 400.1f));
    TEST_ASSERT_EQUAL_UINT32(FAULT_DC_UNDER_VOLTAGE, faults_with(&meas.u_dc_V, 199.9f));
}

static void test_the_estimated_speed_is_limited_both_ways(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, faults_with(&in.omega_e_hat_rad_s, 500.0f));
    TEST_ASSERT_EQUAL_UINT32(0u, faults_with(&in.omega_e_hat_rad_s, -500.0f));
    TEST_ASSERT_EQUAL_UINT32(FAULT_OVER_SPEED, faults_with(&in.omega_e_hat_rad_s, 500.1f));
    TEST_ASSERT_EQUAL_UINT32(FAULT_OVER_SPEED, faults_with(&in.omega_e_hat_rad_s, -500.1f));
}

static void test_a_state_that_is_no_number_trips(void)
{
    for (int j = 0; j < NOT_FINITE_COUNT; j++) {
        TEST_ASSERT_EQUAL_UINT32(FAULT_NON_FINITE, faults_with(&in.state_sum, not_finite(j)));
    }
    TEST_ASSERT_EQUAL_UINT32(0u, faults_with(&in.state_sum, FLT_MAX));
    TEST_ASSERT_EQUAL_UINT32(0u, faults_with(&in.state_sum, -FLT_MAX));
    TEST_ASSERT_EQUAL_UINT32(0u, monitor_step(&cfg, &st, &in));
}

static void test_a_nan_trips_every_limit_it_is_compared_with(void)
{
    TEST_ASSERT_EQUAL_UINT32(FAULT_DC_OVER_VOLTAGE | FAULT_DC_UNDER_VOLTAGE,
                             faults_with(&meas.u_dc_V, NAN));
    TEST_ASSERT_EQUAL_UINT32(FAULT_DC_OVER_VOLTAGE, faults_with(&meas.u_dc_V, INFINITY));
    TEST_ASSERT_EQUAL_UINT32(FAULT_OVER_SPEED, faults_with(&in.omega_e_hat_rad_s, NAN));
    TEST_ASSERT_EQUAL_UINT32(FAULT_OVER_SPEED, faults_with(&in.omega_e_hat_rad_s, -INFINITY));
}

/* The flag has to last plausibility_periods; a clean period takes back an eighth of one. */
static void assert_persistence(uint32_t flag, uint32_t fault)
{
    meas.flags = flag;
    TEST_ASSERT_EQUAL_UINT32(0u, monitor_step(&cfg, &st, &in));
    TEST_ASSERT_EQUAL_UINT32(0u, monitor_step(&cfg, &st, &in));
    meas.flags = 0u;
    TEST_ASSERT_EQUAL_UINT32(0u, monitor_step(&cfg, &st, &in));
    meas.flags = flag;
    TEST_ASSERT_EQUAL_UINT32(0u, monitor_step(&cfg, &st, &in));
    TEST_ASSERT_EQUAL_UINT32(fault, monitor_step(&cfg, &st, &in));
    TEST_ASSERT_EQUAL_UINT32(fault, monitor_step(&cfg, &st, &in));
    meas.flags = 0u;
    TEST_ASSERT_EQUAL_UINT32(0u, monitor_step(&cfg, &st, &in));
    for (int k = 0; k < 30; k++) {
        TEST_ASSERT_EQUAL_UINT32(0u, monitor_step(&cfg, &st, &in));
    }
    TEST_ASSERT_EQUAL_UINT32(0u, st.adc_periods | st.sum_periods);
}

static void test_a_word_at_the_end_of_its_range_trips_when_it_lasts(void)
{
    assert_persistence(MEASUREMENT_SATURATED, FAULT_ADC_RANGE);
}

static void test_a_word_beyond_its_range_trips_when_it_lasts(void)
{
    assert_persistence(MEASUREMENT_OUT_OF_RANGE, FAULT_ADC_RANGE);
}

static void test_a_current_sum_trips_when_it_lasts(void)
{
    assert_persistence(MEASUREMENT_CURRENT_SUM, FAULT_CURRENT_SUM);
}

/* Each in one period of two: neither count takes the other's. */
static void test_flags_of_two_kinds_count_apart(void)
{
    for (int k = 0; k < 4; k++) {
        meas.flags = ((k % 2) == 0) ? MEASUREMENT_SATURATED : MEASUREMENT_CURRENT_SUM;
        TEST_ASSERT_EQUAL_UINT32(0u, monitor_step(&cfg, &st, &in));
    }
}

static void test_a_lasting_flag_never_wraps_its_count(void)
{
    monitor_config_t longest = cfg;
    longest.plausibility_periods = 1000000u;
    st = (monitor_state_t){.adc_periods = 7999999u, .sum_periods = 7999999u};
    meas.flags = MEASUREMENT_SATURATED | MEASUREMENT_CURRENT_SUM;
    for (int k = 0; k < 3; k++) {
        TEST_ASSERT_EQUAL_UINT32(FAULT_ADC_RANGE | FAULT_CURRENT_SUM,
                                 monitor_step(&longest, &st, &in));
    }
    TEST_ASSERT_EQUAL_UINT32(8000000u, st.adc_periods);
    TEST_ASSERT_EQUAL_UINT32(8000000u, st.sum_periods);
}

/* Before the plain current sum has lasted, whatever its sign; a NaN is not within. */
static void test_a_large_current_sum_is_an_earth_fault_after_three_periods(void)
{
    monitor_config_t slow = cfg;
    slow.plausibility_periods = 50u;
    const float sum_A[] = {6.1f, -6.1f, NAN};
    for (unsigned n = 0u; n < sizeof sum_A / sizeof *sum_A; n++) {
        st = (monitor_state_t){0};
        meas.i_A = (uvw_t){5.0f, -2.0f, sum_A[n] - 3.0f};
        meas.flags = MEASUREMENT_CURRENT_SUM;
        TEST_ASSERT_EQUAL_UINT32(0u, monitor_step(&slow, &st, &in) & ~FAULT_OVER_CURRENT);
        TEST_ASSERT_EQUAL_UINT32(0u, monitor_step(&slow, &st, &in) & ~FAULT_OVER_CURRENT);
        TEST_ASSERT_EQUAL_UINT32(FAULT_EARTH_FAULT,
                                 monitor_step(&slow, &st, &in) & ~FAULT_OVER_CURRENT);
    }
    st = (monitor_state_t){0};
    meas.i_A = (uvw_t){5.0f, -2.0f, 2.9f};
    for (int k = 0; k < 40; k++) {
        TEST_ASSERT_EQUAL_UINT32(0u, monitor_step(&slow, &st, &in));
    }
}

/* The flag has gone, the current has not quite: what is counted goes on being looked at. */
static void test_an_earth_fault_is_counted_to_its_end(void)
{
    st = (monitor_state_t){.earth_periods = 2u};
    TEST_ASSERT_EQUAL_UINT32(0u, monitor_step(&cfg, &st, &in));
    TEST_ASSERT_EQUAL_UINT32(1u, st.earth_periods);
}

static void test_faults_of_one_period_are_reported_together(void)
{
    const monitor_config_t at_once = {.i_trip_A = 20.0f,
                                      .u_dc_max_V = 400.0f,
                                      .u_dc_min_V = 200.0f,
                                      .omega_max_rad_s = 500.0f,
                                      .plausibility_periods = 1u};
    const uint32_t all_but_one = FAULT_OVER_CURRENT | FAULT_NON_FINITE | FAULT_ADC_RANGE |
                                 FAULT_CURRENT_SUM | FAULT_OVER_SPEED;
    meas.i_A.v = 100.0f;
    meas.flags = MEASUREMENT_OUT_OF_RANGE | MEASUREMENT_CURRENT_SUM;
    in.state_sum = NAN;
    in.omega_e_hat_rad_s = -900.0f;
    meas.u_dc_V = 10.0f;
    TEST_ASSERT_EQUAL_UINT32(all_but_one | FAULT_DC_UNDER_VOLTAGE,
                             monitor_step(&at_once, &st, &in));
    meas.u_dc_V = 500.0f;
    TEST_ASSERT_EQUAL_UINT32(all_but_one | FAULT_DC_OVER_VOLTAGE, monitor_step(&at_once, &st, &in));
}

static void test_two_monitors_count_apart(void)
{
    monitor_state_t other = {0};
    meas.flags = MEASUREMENT_SATURATED;
    for (int k = 0; k < 2; k++) {
        TEST_ASSERT_EQUAL_UINT32(0u, monitor_step(&cfg, &st, &in));
        TEST_ASSERT_EQUAL_UINT32(0u, monitor_step(&cfg, &other, &in));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_accepts_sensible_limits);
    RUN_TEST(test_init_refuses_every_bad_limit);
    RUN_TEST(test_bits_are_the_numbers_of_the_fault_log);
    RUN_TEST(test_a_healthy_drive_has_no_fault);
    RUN_TEST(test_any_phase_beyond_the_trip_level_is_over_current);
    RUN_TEST(test_the_dc_link_has_an_upper_and_a_lower_limit);
    RUN_TEST(test_the_estimated_speed_is_limited_both_ways);
    RUN_TEST(test_a_state_that_is_no_number_trips);
    RUN_TEST(test_a_nan_trips_every_limit_it_is_compared_with);
    RUN_TEST(test_a_word_at_the_end_of_its_range_trips_when_it_lasts);
    RUN_TEST(test_a_word_beyond_its_range_trips_when_it_lasts);
    RUN_TEST(test_a_current_sum_trips_when_it_lasts);
    RUN_TEST(test_flags_of_two_kinds_count_apart);
    RUN_TEST(test_a_large_current_sum_is_an_earth_fault_after_three_periods);
    RUN_TEST(test_an_earth_fault_is_counted_to_its_end);
    RUN_TEST(test_a_lasting_flag_never_wraps_its_count);
    RUN_TEST(test_faults_of_one_period_are_reported_together);
    RUN_TEST(test_two_monitors_count_apart);
    return UNITY_END();
}
