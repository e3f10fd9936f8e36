/* Offsets that move, from what the field does not turn: by hand, in its limits, and to the end. */
#include "offset_tracking.h"

#include <math.h>

#include "exact.h"
#include "unity.h"

static const offset_tracking_config_t simple = {.gain_s = 0.5f, .max_A = 8.0f, .tau_per_s = 3.0f};
static const offset_tracking_in_t turning = {
    .e1_A = {1.0f, 2.0f}, .omega_e_hat_rad_s = 4.0f, .omega_s_hat_rad_s = 26.0f};
static const ab_t moved = {1.0f, 1.0f};

static motor_model_t motor;
static offset_tracking_config_t cfg;

void setUp(void)
{
    motor = (motor_model_t){.tau_per_s = 4.0f};
    cfg = simple;
}

void tearDown(void)
{
}

static void expect(float alpha, float beta, const offset_tracking_in_t *in)
{
    const ab_t found = offset_tracking_step(&cfg, moved, in);
    ASSERT_SAME_FLOAT(alpha, found.alpha);
    ASSERT_SAME_FLOAT(beta, found.beta);
}

static void test_init_derives_its_coefficients(void)
{
    const offset_tracking_params_t on = {.on = true, .full_scale_A = 20.0f};
    offset_tracking_init(&cfg, &on, &motor, 0.5f);
    TEST_ASSERT_TRUE(offset_tracking_on(&cfg));
    ASSERT_SAME_FLOAT(0.015f, cfg.gain_s);
    TEST_ASSERT_FLOAT_WITHIN(1e-7f, 0.3f, cfg.max_A);
    ASSERT_SAME_FLOAT(4.0f, cfg.tau_per_s);
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

static void test_near_zero_frequency_what_was_found_holds(void)
{
    offset_tracking_in_t in = turning;
    in.omega_s_hat_rad_s = -12.566371f;
    expect(1.0f, 1.0f, &in);
    in.omega_s_hat_rad_s = -12.56f;
    expect(1.0f, 1.0f, &in);
    in.omega_s_hat_rad_s = 12.56f;
    expect(1.0f, 1.0f, &in);
    in.omega_s_hat_rad_s = NAN;
    expect(1.0f, 1.0f, &in);
}

static void test_between_two_and_four_hertz_it_is_followed_in_part(void)
{
    offset_tracking_in_t in = turning;
    in.omega_s_hat_rad_s = -18.849556f; /* 3 Hz: half of it */
    const ab_t half = offset_tracking_step(&cfg, moved, &in);
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 2.25f, half.alpha);
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, -1.5f, half.beta);
    in.omega_s_hat_rad_s = 25.132742f;
    expect(3.5f, -4.0f, &in);
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
        for (int n = 0; n < 200; n++) {
            const ab_t seen = ab_mul(ab_sub(found_A, offset_A), (ab_t){3.0f, -w});
            const offset_tracking_in_t in = {
                .e1_A = ab_scale(seen, 0.001f), .omega_e_hat_rad_s = w, .omega_s_hat_rad_s = w};
            found_A = offset_tracking_step(&cfg, found_A, &in);
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
    RUN_TEST(test_near_zero_frequency_what_was_found_holds);
    RUN_TEST(test_between_two_and_four_hertz_it_is_followed_in_part);
    RUN_TEST(test_no_coordinate_moves_further_than_a_sensor_drifts);
    RUN_TEST(test_an_offset_is_found_in_both_directions_of_rotation);
    return UNITY_END();
}
