/* Offsets that move, from what the field does not turn: by hand, in its limits, and to the end. */
#include "offset_tracking.h"

#include <math.h>

#include "exact.h"
#include "unity.h"

static const offset_tracking_config_t simple = {
    .gain_s = 0.5f, .average_gain = 0.25f, .max_A = 8.0f, .tau_per_s = 3.0f};
static const offset_tracking_in_t turning = {
    .e1_A = {1.0f, 2.0f}, .omega_e_hat_rad_s = 4.0f, .omega_s_hat_rad_s = 26.0f};
static const ab_t moved = {1.0f, 1.0f};

static motor_model_t motor;
static offset_tracking_config_t cfg;
static offset_tracking_state_t st;

void setUp(void)
{
    motor = (motor_model_t){.tau_per_s = 4.0f};
    cfg = simple;
    st = (offset_tracking_state_t){.turning = 2.0f}; /* for a long time */
}

void tearDown(void)
{
}

static void expect(float alpha, float beta, const offset_tracking_in_t *in)
{
    const ab_t found = offset_tracking_step(&cfg, &st, moved, in);
    ASSERT_SAME_FLOAT(alpha, found.alpha);
    ASSERT_SAME_FLOAT(beta, found.beta);
}

static void test_init_derives_its_coefficients(void)
{
    const offset_tracking_params_t on = {.on = true, .full_scale_A = 20.0f};
    offset_tracking_init(&cfg, &on, &motor, 0.5f);
    TEST_ASSERT_TRUE(offset_tracking_on(&cfg));
    ASSERT_SAME_FLOAT(0.015f, cfg.gain_s);
    ASSERT_SAME_FLOAT(0.5f, cfg.average_gain);
    TEST_ASSERT_FLOAT_WITHIN(1e-7f, 0.3f, cfg.max_A);
    ASSERT_SAME_FLOAT(4.0f, cfg.tau_per_s);
    offset_tracking_init(&cfg, &on, &motor, 2.0f);
    ASSERT_SAME_FLOAT(1.0f, cfg.average_gain);
}

static void test_off_it_is_off(void)
{
    const offset_tracking_params_t off = {.full_scale_A = 20.0f};
    offset_tracking_init(&cfg, &off, &motor, 0.5f);
    TEST_ASSERT_FALSE(offset_tracking_on(&cfg));
    ASSERT_SAME_FLOAT(0.0f, cfg.gain_s);
}

static void test_the_residual_is_turned_back_and_added_up(void)
{
    expect(3.5f, -4.0f, &turning); /* (3 + 4 j) (1 + 2 j) = -5 + 10 j */
}

/* On average over 1 s: .6 Hz is 3.77 rad/s. */
static void test_where_the_field_stands_what_was_found_holds(void)
{
    offset_tracking_in_t in = turning;
    for (int direction = -1; direction <= 1; direction += 2) {
        in.omega_s_hat_rad_s = 3.7699111f * (float)direction;
        st.turning = (float)direction;
        expect(1.0f, 1.0f, &in);
        TEST_ASSERT_FLOAT_WITHIN(1e-6f, (float)direction, st.turning);
    }
}

static void test_between_one_and_two_limits_it_is_followed_in_part(void)
{
    offset_tracking_in_t in = turning;
    in.omega_s_hat_rad_s = -1.5f * 3.7699112f;
    st.turning = -1.5f;
    const ab_t half = offset_tracking_step(&cfg, &st, moved, &in);
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 2.25f, half.alpha);
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, -1.5f, half.beta);
}

static void test_the_average_follows_within_both_limits(void)
{
    offset_tracking_in_t in = turning;
    st.turning = 0.0f;
    in.omega_s_hat_rad_s = 300.0f; /* counts as twice the limit */
    expect(1.0f, 1.0f, &in);
    ASSERT_SAME_FLOAT(0.5f, st.turning);
    in.omega_s_hat_rad_s = -300.0f;
    expect(1.0f, 1.0f, &in);
    ASSERT_SAME_FLOAT(-0.125f, st.turning);
}

static void test_a_frequency_that_is_not_finite_leaves_the_average_finite(void)
{
    const float wrong[] = {NAN, INFINITY, -INFINITY};
    for (int k = 0; k < 3; k++) {
        offset_tracking_in_t in = turning;
        in.omega_s_hat_rad_s = wrong[k];
        st.turning = 0.0f;
        expect(1.0f, 1.0f, &in);
        TEST_ASSERT_TRUE(fabsf(st.turning) <= 0.5f);
        st.turning = wrong[k];
        (void)offset_tracking_step(&cfg, &st, moved, &turning);
        ASSERT_SAME_FLOAT(0.0f, st.turning);
    }
}

static void test_after_a_stop_what_was_found_holds_again(void)
{
    offset_tracking_in_t in = turning;
    in.omega_s_hat_rad_s = 0.0f;
    for (int n = 0; n < 2; n++) { /* 1.5, 1.125 */
        TEST_ASSERT_TRUE(offset_tracking_step(&cfg, &st, moved, &in).alpha > 1.0f);
    }
    expect(1.0f, 1.0f, &in);
    ASSERT_SAME_FLOAT(0.84375f, st.turning);
}

/* A field that swings about zero, beyond the limit for half of the time. */
static void test_a_swing_about_zero_is_no_turning(void)
{
    const float swing[] = {6.0f, 0.0f, -6.0f, 0.0f};
    cfg.average_gain = 0.01f;
    st.turning = 0.0f;
    for (int n = 0; n < 400; n++) {
        offset_tracking_in_t in = turning;
        in.omega_s_hat_rad_s = swing[n % 4];
        expect(1.0f, 1.0f, &in);
    }
}

static void test_no_coordinate_moves_further_than_a_sensor_drifts(void)
{
    offset_tracking_in_t in = turning;
    in.e1_A = (ab_t){10.0f, 20.0f}; /* -50 + 100 j */
    expect(8.0f, -8.0f, &in);
    in.e1_A = (ab_t){-10.0f, -20.0f};
    expect(-8.0f, 8.0f, &in);
}

/* What the observer shows of an offset: e1 = -c o (tau - j w). Found whatever the speed. */
static void test_an_offset_is_found_in_both_directions_of_rotation(void)
{
    const ab_t offset_A = {1.0f, -2.0f};
    for (int direction = -1; direction <= 1; direction += 2) {
        const float w = 40.0f * (float)direction;
        ab_t found_A = {0.0f, 0.0f};
        st.turning = 2.0f * (float)direction;
        for (int n = 0; n < 200; n++) {
            const ab_t seen = ab_mul(ab_sub(found_A, offset_A), (ab_t){3.0f, -w});
            const offset_tracking_in_t in = {
                .e1_A = ab_scale(seen, 0.001f), .omega_e_hat_rad_s = w, .omega_s_hat_rad_s = w};
            found_A = offset_tracking_step(&cfg, &st, found_A, &in);
        }
        TEST_ASSERT_FLOAT_WITHIN(1e-4f, offset_A.alpha, found_A.alpha);
        TEST_ASSERT_FLOAT_WITHIN(1e-4f, offset_A.beta, found_A.beta);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_derives_its_coefficients);
    RUN_TEST(test_off_it_is_off);
    RUN_TEST(test_the_residual_is_turned_back_and_added_up);
    RUN_TEST(test_where_the_field_stands_what_was_found_holds);
    RUN_TEST(test_between_one_and_two_limits_it_is_followed_in_part);
    RUN_TEST(test_the_average_follows_within_both_limits);
    RUN_TEST(test_a_frequency_that_is_not_finite_leaves_the_average_finite);
    RUN_TEST(test_after_a_stop_what_was_found_holds_again);
    RUN_TEST(test_a_swing_about_zero_is_no_turning);
    RUN_TEST(test_no_coordinate_moves_further_than_a_sensor_drifts);
    RUN_TEST(test_an_offset_is_found_in_both_directions_of_rotation);
    return UNITY_END();
}
