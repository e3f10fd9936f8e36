/* Unequal gains of the sensors: by hand, in their limits, and to the end. */
#include "unbalance_tracking.h"

#include <math.h>

#include "exact.h"
#include "unity.h"

#define MIN_RAD_S 12.566371f /* 2 Hz */
#define STEP_S    0.0032

static const unbalance_tracking_config_t simple = {.gain_s = 0.5f};
static const ab_t nothing = {0.0f, 0.0f};

static unbalance_tracking_config_t cfg;
static unbalance_tracking_in_t in;
static unbalance_t found;

void setUp(void)
{
    cfg = simple;
    found = (unbalance_t){nothing, nothing};
    /* n' = g r u/|u|^2 with (1 + 2 j)(2 + 4 j)/20 = (-6 + 8 j)/20, g = .5 / 64 */
    in = (unbalance_tracking_in_t){.residual_V = {1.0f / 64.0f, 2.0f / 64.0f},
                                   .expected_V = {2.0f, 4.0f},
                                   .omega_s_hat_rad_s = MIN_RAD_S + 1.0f};
}

void tearDown(void)
{
}

static void test_init_derives_its_coefficient(void)
{
    unbalance_tracking_init(&cfg, true, 0.5f);
    TEST_ASSERT_TRUE(unbalance_tracking_on(&cfg));
    ASSERT_SAME_FLOAT(0.02f, cfg.gain_s);
    unbalance_tracking_init(&cfg, false, 0.5f);
    TEST_ASSERT_FALSE(unbalance_tracking_on(&cfg));
}

static void test_the_residual_of_the_voltage_is_turned_and_added_up(void)
{
    found.u = (ab_t){0.001f, -0.002f};
    unbalance_tracking_step(&cfg, &found, &in);
    ASSERT_NEAR(1e-8, 0.001 - 0.5 / 64.0 * 0.3, found.u.alpha);
    ASSERT_NEAR(1e-8, -0.002 + 0.5 / 64.0 * 0.4, found.u.beta);
    TEST_ASSERT_EQUAL_MEMORY(&nothing, &found.i, sizeof nothing); /* no current */
}

/* n' = g (2/sqrt(6) s conj(i)/|i|^2 - n) */
static void test_the_sum_of_the_currents_shows_theirs(void)
{
    in.i_s_A = (ab_t){3.0f, 4.0f};
    in.i_sum_A = 0.05f;
    found.i = (ab_t){0.004f, 0.002f};
    unbalance_tracking_step(&cfg, &found, &in);
    const double seen = 2.0 / sqrt(6.0) * 0.05 / 25.0;
    ASSERT_NEAR(1e-8, 0.004 + 0.5 * (3.0 * seen - 0.004), found.i.alpha);
    ASSERT_NEAR(1e-8, 0.002 + 0.5 * (-4.0 * seen - 0.002), found.i.beta);
}

static void test_below_two_hertz_what_was_found_holds(void)
{
    const float held_rad_s[] = {0.0f, 5.0f, -MIN_RAD_S, MIN_RAD_S, NAN};
    in.i_s_A = (ab_t){3.0f, 4.0f};
    in.i_sum_A = 1.0f;
    for (unsigned k = 0; k < 5u; k++) {
        in.omega_s_hat_rad_s = held_rad_s[k];
        unbalance_tracking_step(&cfg, &found, &in);
        TEST_ASSERT_EQUAL_MEMORY(&nothing, &found.u, sizeof nothing);
        TEST_ASSERT_EQUAL_MEMORY(&nothing, &found.i, sizeof nothing);
    }
}

/* In proportion to the frequency above 2 Hz, either way round, up to that of 10 Hz. */
static void test_the_rate_grows_with_the_frequency(void)
{
    const double omega_rad_s[] = {-30.0, 62.8, -63.0, 400.0};
    const double above_rad_s[] = {30.0, 62.8, 62.831853, 62.831853};
    cfg.gain_s = 0.01f;
    for (unsigned k = 0; k < 4u; k++) {
        found.u = nothing;
        in.omega_s_hat_rad_s = (float)omega_rad_s[k];
        unbalance_tracking_step(&cfg, &found, &in);
        const double rate_rad_s = above_rad_s[k] - (double)MIN_RAD_S;
        ASSERT_NEAR(1e-7, 0.01 * rate_rad_s / 64.0 * 0.4, found.u.beta);
    }
}

static void test_no_more_than_two_percent_is_believed(void)
{
    in.residual_V = (ab_t){-10.0f, 10.0f};
    in.i_s_A = (ab_t){1.0f, 1.0f};
    in.i_sum_A = 3.0f;
    unbalance_tracking_step(&cfg, &found, &in);
    ASSERT_SAME_FLOAT(-0.02f, found.u.alpha);
    ASSERT_SAME_FLOAT(-0.02f, found.u.beta);
    ASSERT_SAME_FLOAT(0.02f, found.i.alpha);
    ASSERT_SAME_FLOAT(-0.02f, found.i.beta);
}

static void test_what_is_no_number_stays_in_the_limits(void)
{
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        const float x = not_finite(k);
        in.residual_V.alpha = x;
        in.i_s_A = (ab_t){1.0f, 1.0f};
        in.i_sum_A = x;
        unbalance_tracking_step(&cfg, &found, &in);
        const ab_t both[] = {found.u, found.i};
        for (unsigned m = 0; m < 2u; m++) {
            TEST_ASSERT_TRUE((absf(both[m].alpha) <= 0.02f) && (absf(both[m].beta) <= 0.02f));
        }
    }
}

static void test_without_voltage_or_current_its_part_holds(void)
{
    in.residual_V = (ab_t){1.0f, 1.0f};
    in.expected_V = nothing;
    in.i_sum_A = 1.0f;
    found = (unbalance_t){{0.001f, 0.002f}, {0.003f, 0.004f}};
    const unbalance_t before = found;
    unbalance_tracking_step(&cfg, &found, &in);
    TEST_ASSERT_EQUAL_MEMORY(&before, &found, sizeof found);
}

/* Phases through three gains, line voltages through two, and the loss of an inverter, 5 % of the
 * voltage and behind it, and offsets. What is found takes the negative sequence away. */
static void test_the_gains_are_found(void)
{
    const double gain[] = {1.01, 0.993, 0.998}, line[] = {0.99, 1.01};
    const double third = 2.0943951023931953;
    unbalance_tracking_init(&cfg, true, (float)STEP_S);
    const double omega_rad_s = -30.0;
    for (int k = 0; k < 6250; k++) { /* 20 s */
        const double angle = omega_rad_s * STEP_S * (double)k;
        const double lag = angle - 0.4;
        const double scale = sqrt(2.0 / 3.0);
        const uvw_t i_A = {(float)(gain[0] * scale * 10.0 * cos(lag) + 0.05),
                           (float)(gain[1] * scale * 10.0 * cos(lag - third) - 0.02),
                           (float)(gain[2] * scale * 10.0 * cos(lag + third))};
        const double u_V = 50.0, alpha = u_V * cos(angle) - 2.5 * cos(lag);
        const double beta = u_V * sin(angle) - 2.5 * sin(lag);
        const double vw_V = sqrt(2.0) * beta;
        const double uv_V = alpha / scale - 0.5 * vw_V;
        const ab_t seen_V =
            ab_from_line((float)(line[0] * uv_V + 0.3), (float)(line[1] * vw_V - 0.4));
        in.expected_V = (ab_t){(float)(u_V * cos(angle)), (float)(u_V * sin(angle))};
        const ab_t taken_V = ab_sub(seen_V, ab_mul(found.u, ab_conj(seen_V)));
        in.residual_V = ab_sub(taken_V, in.expected_V);
        in.i_s_A = ab_from_uvw(i_A);
        in.i_sum_A = i_A.u + i_A.v + i_A.w;
        in.omega_s_hat_rad_s = (float)omega_rad_s;
        unbalance_tracking_step(&cfg, &found, &in);
    }
    /* Of the lines (-d/2)(1 - j/sqrt(3)), d their difference; of the phases conj(sum g a^k)/3. */
    ASSERT_NEAR(6e-4, -0.01, found.u.alpha);
    ASSERT_NEAR(6e-4, 0.01 / sqrt(3.0), found.u.beta);
    ASSERT_NEAR(3e-4, (0.01 + 0.5 * 0.007 + 0.5 * 0.002) / 3.0, found.i.alpha);
    ASSERT_NEAR(3e-4, -sqrt(0.75) * (-0.007 + 0.002) / 3.0, found.i.beta);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_derives_its_coefficient);
    RUN_TEST(test_the_residual_of_the_voltage_is_turned_and_added_up);
    RUN_TEST(test_the_sum_of_the_currents_shows_theirs);
    RUN_TEST(test_below_two_hertz_what_was_found_holds);
    RUN_TEST(test_the_rate_grows_with_the_frequency);
    RUN_TEST(test_no_more_than_two_percent_is_believed);
    RUN_TEST(test_what_is_no_number_stays_in_the_limits);
    RUN_TEST(test_without_voltage_or_current_its_part_holds);
    RUN_TEST(test_the_gains_are_found);
    return UNITY_END();
}
