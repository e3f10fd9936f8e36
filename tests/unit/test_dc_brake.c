/* Braking and holding by direct current: when it is wanted, for how long, and its voltage. */
#include "dc_brake.h"

#include <complex.h>

#include "drive_fixture.h"
#include "exact.h"
#include "mode_fixture.h"

#define PERIOD_S 200e-6f

static dc_brake_config_t cfg;
static dc_brake_params_t params;
static dc_brake_state_t st;
static dc_current_config_t current;

void setUp(void)
{
    const motor_model_t motor = reference_derived(1);
    params = (dc_brake_params_t){
        .current_A = 8.0f, .from_rad_s = 5.0f, .least_s = 1e-3f, .slew_A_per_s = 100.0f};
    TEST_ASSERT_TRUE(dc_brake_init(&cfg, &params, PERIOD_S));
    TEST_ASSERT_TRUE(dc_current_init(&current, 400.0f, &motor, PERIOD_S));
    st = (dc_brake_state_t){0};
    mode_fixture_start();
    in.Rs_ohm = 1.2f;
}

void tearDown(void)
{
}

static bool wanted(bool acts)
{
    return dc_brake_wanted(&cfg, &st, acts, &in);
}

static void test_init_refuses_what_is_no_brake(void)
{
    const dc_brake_params_t good = params;
#define REFUSE_WITH(field, value)                                                                  \
    params = good;                                                                                 \
    params.field = (value);                                                                        \
    TEST_ASSERT_FALSE(dc_brake_init(&cfg, &params, PERIOD_S))
    REFUSE_WITH(current_A, NAN);
    REFUSE_WITH(current_A, -1.0f);
    REFUSE_WITH(current_A, INFINITY);
    REFUSE_WITH(from_rad_s, -1.0f);
    REFUSE_WITH(from_rad_s, NAN);
    REFUSE_WITH(least_s, -1.0f);
    REFUSE_WITH(least_s, 1e9f);
    REFUSE_WITH(least_s, NAN);
    REFUSE_WITH(slew_A_per_s, 0.0f);
#undef REFUSE_WITH
}

/* Nothing else is looked at, and it never acts. */
static void test_without_a_current_it_is_off(void)
{
    params = (dc_brake_params_t){.from_rad_s = NAN, .least_s = -1.0f};
    TEST_ASSERT_TRUE(dc_brake_init(&cfg, &params, PERIOD_S));
    TEST_ASSERT_FALSE(wanted(false));
    TEST_ASSERT_FALSE(wanted(true));
}

static void test_a_small_current_is_a_brake_as_well(void)
{
    params.current_A = 0.5f;
    TEST_ASSERT_TRUE(dc_brake_init(&cfg, &params, PERIOD_S));
    ASSERT_SAME_FLOAT(0.5f, cfg.current_A);
    TEST_ASSERT_TRUE(wanted(false));
}

/* Zero asked for, in speed or by a stop, and slow enough; in both directions. */
static void test_it_begins_where_zero_is_asked_for_at_low_speed(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        estimate.omega_e_rad_s = (float)sign * 5.0f;
        asked.omega_e_ref_rad_s = (float)sign * 1e-3f;
        TEST_ASSERT_TRUE(wanted(false));
        asked.omega_e_ref_rad_s = (float)sign * 1.1e-3f;
        TEST_ASSERT_FALSE(wanted(false));
        asked.omega_e_ref_rad_s = 0.0f;
        estimate.omega_e_rad_s = (float)sign * 5.1f;
        TEST_ASSERT_FALSE(wanted(false));
    }
    estimate.omega_e_rad_s = 0.0f;
    asked.aim = DRIVE_AIM_STOP;
    TEST_ASSERT_TRUE(wanted(false));
    asked.aim = DRIVE_AIM_TORQUE; /* whose speed reference of zero says nothing */
    TEST_ASSERT_FALSE(wanted(false));
}

static void test_what_is_no_number_brakes_nothing(void)
{
    asked.omega_e_ref_rad_s = NAN;
    TEST_ASSERT_FALSE(wanted(false));
    asked.omega_e_ref_rad_s = 0.0f;
    estimate.omega_e_rad_s = NAN;
    TEST_ASSERT_FALSE(wanted(false));
}

/* Five periods at least, whatever is asked for; then as long as zero is, whatever the speed. */
static void test_once_begun_it_lasts_its_time(void)
{
    asked.omega_e_ref_rad_s = 50.0f;
    for (uint32_t k = 0u; k < 5u; k++) {
        TEST_ASSERT_TRUE(wanted(true));
        (void)dc_brake_step(&cfg, &current, &st, &in);
        TEST_ASSERT_EQUAL_UINT32(k + 1u, st.periods);
    }
    TEST_ASSERT_FALSE(wanted(true));
    asked.omega_e_ref_rad_s = 0.0f;
    estimate.omega_e_rad_s = 100.0f;
    TEST_ASSERT_TRUE(wanted(true));
    (void)dc_brake_step(&cfg, &current, &st, &in);
    TEST_ASSERT_EQUAL_UINT32(5u, st.periods); /* counts no further */
}

static void test_it_begins_with_the_current_and_speed_of_then(void)
{
    st = (dc_brake_state_t){.periods = 7u, .current.e_V = {1.0f, 1.0f}};
    dc_brake_start(&st, (ab_t){1.0f, 2.0f}, 31.0f);
    const dc_brake_state_t begun = {
        .current.i_before_A = {1.0f, 2.0f}, .i_ref_A = {1.0f, 2.0f}, .omega_rad_s = 31.0f};
    TEST_ASSERT_EQUAL_MEMORY(&begun, &st, sizeof begun);
}

/* 20 mA per period and axis, towards 8 A along alpha. */
static void test_the_current_goes_to_its_place_on_its_slew(void)
{
    dc_brake_start(&st, (ab_t){7.97f, -0.03f}, 0.0f);
    const float alpha_A[] = {7.99f, 8.0f, 8.0f};
    const float beta_A[] = {-0.01f, 0.0f, 0.0f};
    for (int k = 0; k < 3; k++) {
        (void)dc_brake_step(&cfg, &current, &st, &in);
        ASSERT_NEAR(2e-6, alpha_A[k], st.i_ref_A.alpha);
        ASSERT_NEAR(2e-6, beta_A[k], st.i_ref_A.beta);
    }
}

/* The standing current's own law, told the duties' voltage, the resistance in use and the speed of
 * the beginning. */
static void test_its_voltage_is_that_of_a_standing_current(void)
{
    dc_brake_start(&st, (ab_t){8.0f, 0.0f}, 200.0f);
    estimate.omega_e_rad_s = 3.0f; /* what a mode says, and nobody measures */
    meas.i_s_A = (ab_t){7.5f, 0.25f};
    acting.ended_V = (ab_t){11.0f, -4.0f};
    in.u_s_V = (ab_t){99.0f, 99.0f};
    dc_current_state_t expected = {.i_before_A = {8.0f, 0.0f}};
    const dc_current_in_t current_in = {.i_ref_A = {8.0f, 0.0f},
                                        .i_A = meas.i_s_A,
                                        .u_V = acting.ended_V,
                                        .Rs_ohm = 1.2f,
                                        .omega_rad_s = 200.0f};
    const ab_t expected_V = dc_current_step(&current, &expected, &current_in);
    const ab_t u_V = dc_brake_step(&cfg, &current, &st, &in);
    ASSERT_SAME_FLOAT(expected_V.alpha, u_V.alpha);
    ASSERT_SAME_FLOAT(expected_V.beta, u_V.beta);
    TEST_ASSERT_EQUAL_MEMORY(&expected, &st.current, sizeof expected);
}

/* For the end of a stop: the speed of the beginning, until the time is over. */
static void test_its_reference_is_zero_when_its_time_is_over(void)
{
    dc_brake_start(&st, (ab_t){0.0f, 0.0f}, -31.0f);
    for (int k = 0; k < 5; k++) {
        ASSERT_SAME_FLOAT(-31.0f, dc_brake_reference_rad_s(&cfg, &st));
        (void)dc_brake_step(&cfg, &current, &st, &in);
    }
    ASSERT_SAME_FLOAT(0.0f, dc_brake_reference_rad_s(&cfg, &st));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_what_is_no_brake);
    RUN_TEST(test_without_a_current_it_is_off);
    RUN_TEST(test_a_small_current_is_a_brake_as_well);
    RUN_TEST(test_it_begins_where_zero_is_asked_for_at_low_speed);
    RUN_TEST(test_what_is_no_number_brakes_nothing);
    RUN_TEST(test_once_begun_it_lasts_its_time);
    RUN_TEST(test_it_begins_with_the_current_and_speed_of_then);
    RUN_TEST(test_the_current_goes_to_its_place_on_its_slew);
    RUN_TEST(test_its_voltage_is_that_of_a_standing_current);
    RUN_TEST(test_its_reference_is_zero_when_its_time_is_over);
    return UNITY_END();
}
