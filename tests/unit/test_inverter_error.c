#include "inverter_error.h"

#include <float.h>
#include <math.h>

#include "exact.h"
#include "unity.h"

#define PERIOD_S 0.0002f

/* Lost per phase at 283 V: .75 (3 us/200 us 283 V + 1.5 V) = 4.30875 V. */
static const inverter_error_params_t good = {
    .fraction = 0.75f, .dead_time_s = 3e-6f, .drop_V = 1.5f, .i_threshold_A = 0.25f};
static const double lost_V = 0.75 * (3e-6 / 2e-4 * 283.0 + 1.5);

static inverter_error_config_t cfg;

static ab_t voltage(const inverter_error_config_t *c, ab_t i_A, float u_dc_V)
{
    return inverter_error_voltage(inverter_error_loss(c, u_dc_V), i_A);
}

void setUp(void)
{
    TEST_ASSERT_TRUE(inverter_error_init(&cfg, &good, PERIOD_S));
}

void tearDown(void)
{
}

static void assert_ab(double alpha, double beta, ab_t x)
{
    /* Some roundings of a few volts. */
    TEST_ASSERT_DOUBLE_WITHIN(4e-6, alpha, (double)x.alpha);
    TEST_ASSERT_DOUBLE_WITHIN(4e-6, beta, (double)x.beta);
}

/* The header's formula in double precision, by phases. */
static void expected_V(double i_alpha_A, double i_beta_A, double out[2])
{
    const double i_A[3] = {sqrt(2.0 / 3.0) * i_alpha_A,
                           -sqrt(1.0 / 6.0) * i_alpha_A + sqrt(0.5) * i_beta_A,
                           -sqrt(1.0 / 6.0) * i_alpha_A - sqrt(0.5) * i_beta_A};
    double u_V[3];
    for (int x = 0; x < 3; x++) {
        u_V[x] = lost_V * fmax(-1.0, fmin(1.0, i_A[x] / 0.25));
    }
    out[0] = sqrt(2.0 / 3.0) * (u_V[0] - 0.5 * u_V[1] - 0.5 * u_V[2]);
    out[1] = sqrt(0.5) * (u_V[1] - u_V[2]);
}

static void test_init_derives_the_compensated_share(void)
{
    TEST_ASSERT_FLOAT_WITHIN(1e-9f, 0.01125f, cfg.k);
    ASSERT_SAME_FLOAT(1.125f, cfg.drop_V);
    ASSERT_SAME_FLOAT(0.25f, cfg.i_threshold_A);
}

#define ASSERT_REFUSED(field, value)                                                               \
    do {                                                                                           \
        inverter_error_params_t bad = good;                                                        \
        bad.field = (value);                                                                       \
        TEST_ASSERT_FALSE_MESSAGE(inverter_error_init(&untouched, &bad, PERIOD_S),                 \
                                  #field " " #value);                                              \
    } while (0)

static void test_init_refuses_every_bad_number_and_leaves_the_config(void)
{
    inverter_error_config_t untouched = {.k = 77.0f};

    ASSERT_REFUSED(fraction, -0.01f);
    ASSERT_REFUSED(fraction, 1.01f);
    ASSERT_REFUSED(fraction, NAN);
    ASSERT_REFUSED(dead_time_s, -1e-6f);
    ASSERT_REFUSED(dead_time_s, PERIOD_S);
    ASSERT_REFUSED(dead_time_s, NAN);
    ASSERT_REFUSED(dead_time_s, INFINITY);
    ASSERT_REFUSED(drop_V, -0.1f);
    ASSERT_REFUSED(drop_V, NAN);
    ASSERT_REFUSED(drop_V, INFINITY);
    ASSERT_REFUSED(i_threshold_A, 0.0f);
    ASSERT_REFUSED(i_threshold_A, -0.1f);
    ASSERT_REFUSED(i_threshold_A, NAN);
    ASSERT_REFUSED(i_threshold_A, INFINITY);
    ASSERT_REFUSED(i_threshold_A, 1e-39f); /* its inverse is infinite */
    for (int i = 0; i < NOT_POSITIVE_COUNT; i++) {
        TEST_ASSERT_FALSE(inverter_error_init(&untouched, &good, not_positive(i)));
    }
    ASSERT_SAME_FLOAT(77.0f, untouched.k);
}

static void test_init_accepts_the_ends_of_the_ranges(void)
{
    inverter_error_params_t p = {
        .fraction = 1.0f, .dead_time_s = 0.0f, .drop_V = 0.0f, .i_threshold_A = 0.25f};
    TEST_ASSERT_TRUE(inverter_error_init(&cfg, &p, PERIOD_S));
    p.fraction = 0.0f;
    TEST_ASSERT_TRUE(inverter_error_init(&cfg, &p, PERIOD_S));
}

static void test_voltage_is_zero_without_current(void)
{
    assert_ab(0.0, 0.0, voltage(&cfg, (ab_t){0.0f, 0.0f}, 283.0f));
}

static void test_voltage_is_proportional_below_the_threshold(void)
{
    /* Phase current .1 A of .25: alpha = .1 sqrt(3/2), two fifths of the lost voltage. */
    const ab_t u_V = voltage(&cfg, (ab_t){0.1f * sqrtf(1.5f), 0.0f}, 283.0f);
    assert_ab(0.4 * lost_V * sqrt(1.5), 0.0, u_V);
}

static void test_voltage_saturates_to_the_hexagon_of_the_signs(void)
{
    /* Signs + - -: sqrt(2/3) (1 + 1/2 + 1/2) lost volts on alpha. */
    assert_ab(sqrt(2.0 / 3.0) * 2.0 * lost_V, 0.0, voltage(&cfg, (ab_t){10.0f, 0.0f}, 283.0f));
    /* Signs 0 + -: sqrt(1/2) 2 lost volts on beta. */
    assert_ab(0.0, sqrt(2.0) * lost_V, voltage(&cfg, (ab_t){0.0f, 10.0f}, 283.0f));
}

static void test_voltage_agrees_with_double_arithmetic_all_around(void)
{
    for (int k = 0; k < 360; k += 7) {
        const double a = k * acos(-1.0) / 180.0;
        const double amplitude_A = 0.2 + 0.02 * k;
        double u_V[2];
        expected_V(amplitude_A * cos(a), amplitude_A * sin(a), u_V);
        const ab_t i_A = {(float)(amplitude_A * cos(a)), (float)(amplitude_A * sin(a))};
        const ab_t got_V = voltage(&cfg, i_A, 283.0f);
        /* 17 V/A below the threshold times the roundings of some amperes. */
        TEST_ASSERT_DOUBLE_WITHIN(3e-5, u_V[0], (double)got_V.alpha);
        TEST_ASSERT_DOUBLE_WITHIN(3e-5, u_V[1], (double)got_V.beta);
    }
}

static void test_voltage_turns_with_the_current_by_120_degrees(void)
{
    const ab_t third = {-0.5f, 0.86602540f};
    const ab_t i_A = {0.21f, -0.13f};
    const ab_t turned_V = ab_mul(third, voltage(&cfg, i_A, 283.0f));
    assert_ab((double)turned_V.alpha, (double)turned_V.beta,
              voltage(&cfg, ab_mul(third, i_A), 283.0f));
}

static void test_voltage_is_odd_in_the_current(void)
{
    const ab_t plus_V = voltage(&cfg, (ab_t){0.21f, -3.0f}, 283.0f);
    const ab_t minus_V = voltage(&cfg, (ab_t){-0.21f, 3.0f}, 283.0f);
    assert_ab(-(double)plus_V.alpha, -(double)plus_V.beta, minus_V);
}

static void test_voltage_follows_the_measured_dc_link(void)
{
    const double at_540_V = 0.75 * (3e-6 / 2e-4 * 540.0 + 1.5);
    assert_ab(0.0, sqrt(2.0) * at_540_V, voltage(&cfg, (ab_t){0.0f, 10.0f}, 540.0f));
}

static void test_switched_off_it_adds_exactly_zero(void)
{
    const float u_dc_V[] = {283.0f, 0.0f, -1.0f, NAN, INFINITY, -INFINITY};
    inverter_error_params_t off = good;
    off.fraction = 0.0f;
    TEST_ASSERT_TRUE(inverter_error_init(&cfg, &off, PERIOD_S));
    for (unsigned i = 0; i < 6u; i++) {
        const ab_t u_V = voltage(&cfg, (ab_t){7.0f, -3.0f}, u_dc_V[i]);
        TEST_ASSERT_TRUE((u_V.alpha == 0.0f) && (u_V.beta == 0.0f));
    }
}

static void test_a_dc_link_that_is_no_number_adds_nothing(void)
{
    const float u_dc_V[] = {NAN, INFINITY, -INFINITY, -FLT_MAX};
    for (unsigned i = 0; i < 4u; i++) {
        const ab_t u_V = voltage(&cfg, (ab_t){7.0f, -3.0f}, u_dc_V[i]);
        TEST_ASSERT_TRUE((u_V.alpha == 0.0f) && (u_V.beta == 0.0f));
    }
}

static void test_a_current_that_is_no_number_gives_a_bounded_voltage(void)
{
    const float bad[] = {NAN, INFINITY, -INFINITY, FLT_MAX, -FLT_MAX};
    for (unsigned i = 0; i < 5u; i++) {
        const ab_t alpha_V = voltage(&cfg, (ab_t){bad[i], 1.0f}, 283.0f);
        const ab_t beta_V = voltage(&cfg, (ab_t){1.0f, bad[i]}, 283.0f);
        /* Corner of the hexagon of the signs. */
        TEST_ASSERT_TRUE(hypotf(alpha_V.alpha, alpha_V.beta) <= 1.634f * (float)lost_V);
        TEST_ASSERT_TRUE(hypotf(beta_V.alpha, beta_V.beta) <= 1.634f * (float)lost_V);
    }
}

/* Loss of a leg with capacitance: u^2 C/(2 T i) is missing of the whole. */
static double with_tail_V(double i_A)
{
    const double size_A = fabs(i_A);
    const double share = (size_A > 0.5) ? (1.0 - 0.25 / size_A) : size_A;
    return copysign(3.0 * share, i_A);
}

static void test_a_curve_with_a_tail_loses_less_than_the_whole_of_every_current(void)
{
    const leg_loss_t loss = {.whole_V = 3.0f, .threshold_A = 0.5f, .tail_A = 0.25f};
    for (int k = 0; k < 360; k += 7) {
        const double a = k * acos(-1.0) / 180.0;
        const double i_A = 0.2 + 0.02 * k;
        const double u_V = with_tail_V(sqrt(2.0 / 3.0) * i_A * cos(a));
        const double v_V = with_tail_V(sqrt(2.0 / 3.0) * i_A * cos(a - 2.0 * acos(-0.5)));
        const double w_V = with_tail_V(sqrt(2.0 / 3.0) * i_A * cos(a - acos(-0.5)));
        const ab_t got_V =
            inverter_error_voltage(loss, (ab_t){(float)(i_A * cos(a)), (float)(-i_A * sin(a))});
        TEST_ASSERT_DOUBLE_WITHIN(3e-5, sqrt(2.0 / 3.0) * (u_V - 0.5 * (v_V + w_V)),
                                  (double)got_V.alpha);
        TEST_ASSERT_DOUBLE_WITHIN(3e-5, sqrt(0.5) * (v_V - w_V), (double)got_V.beta);
    }
    const float bad[] = {NAN, INFINITY, -INFINITY, FLT_MAX, -FLT_MAX};
    for (unsigned i = 0; i < 5u; i++) {
        const ab_t got_V = inverter_error_voltage(loss, (ab_t){bad[i], 1.0f});
        TEST_ASSERT_TRUE(hypotf(got_V.alpha, got_V.beta) <= 1.634f * 3.0f);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_derives_the_compensated_share);
    RUN_TEST(test_init_refuses_every_bad_number_and_leaves_the_config);
    RUN_TEST(test_init_accepts_the_ends_of_the_ranges);
    RUN_TEST(test_voltage_is_zero_without_current);
    RUN_TEST(test_voltage_is_proportional_below_the_threshold);
    RUN_TEST(test_voltage_saturates_to_the_hexagon_of_the_signs);
    RUN_TEST(test_voltage_agrees_with_double_arithmetic_all_around);
    RUN_TEST(test_voltage_turns_with_the_current_by_120_degrees);
    RUN_TEST(test_voltage_is_odd_in_the_current);
    RUN_TEST(test_voltage_follows_the_measured_dc_link);
    RUN_TEST(test_switched_off_it_adds_exactly_zero);
    RUN_TEST(test_a_dc_link_that_is_no_number_adds_nothing);
    RUN_TEST(test_a_current_that_is_no_number_gives_a_bounded_voltage);
    RUN_TEST(test_a_curve_with_a_tail_loses_less_than_the_whole_of_every_current);
    return UNITY_END();
}
