#include "frames.h"

#include <complex.h>

#include "exact.h"

static const double two_thirds_pi = 2.0943951023931953;

/* A few roundings of numbers of this size. */
#define TOLERANCE 1e-6

static double complex complex_of(ab_t x)
{
    return (double)x.alpha + I * (double)x.beta;
}

static void assert_ab(double complex expected, ab_t actual)
{
    ASSERT_NEAR(TOLERANCE, creal(expected), actual.alpha);
    ASSERT_NEAR(TOLERANCE, cimag(expected), actual.beta);
}

static const ab_t a = {1.25f, -0.75f};
static const ab_t b = {-0.5f, 2.0f};

void setUp(void)
{
}

void tearDown(void)
{
}

static void test_sum_and_difference_are_those_of_complex_numbers(void)
{
    assert_ab(complex_of(a) + complex_of(b), ab_add(a, b));
    assert_ab(complex_of(a) - complex_of(b), ab_sub(a, b));
}

static void test_scaling_stretches_both_components(void)
{
    assert_ab(-3.0 * complex_of(a), ab_scale(a, -3.0f));
}

static void test_product_is_that_of_complex_numbers(void)
{
    assert_ab(complex_of(a) * complex_of(b), ab_mul(a, b));
}

static void test_product_with_j_turns_by_90_degrees(void)
{
    const ab_t turned = ab_mul((ab_t){0.0f, 1.0f}, (ab_t){3.0f, 4.0f});
    ASSERT_SAME_FLOAT(-4.0f, turned.alpha);
    ASSERT_SAME_FLOAT(3.0f, turned.beta);
}

static void test_conjugate_mirrors_beta(void)
{
    assert_ab(conj(complex_of(a)), ab_conj(a));
}

static void test_dot_and_cross_are_the_parts_of_conj_a_b(void)
{
    const double complex product = conj(complex_of(a)) * complex_of(b);
    ASSERT_NEAR(TOLERANCE, creal(product), ab_dot(a, b));
    ASSERT_NEAR(TOLERANCE, cimag(product), ab_cross(a, b));
}

static void test_norm2_is_the_square_of_the_length(void)
{
    ASSERT_SAME_FLOAT(25.0f, ab_norm2((ab_t){3.0f, -4.0f}));
}

static void test_finite_needs_both_components(void)
{
    TEST_ASSERT_TRUE(ab_finite(a));
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        TEST_ASSERT_FALSE(ab_finite((ab_t){not_finite(k), 0.0f}));
        TEST_ASSERT_FALSE(ab_finite((ab_t){0.0f, not_finite(k)}));
    }
}

static void test_clamp_limits_each_component(void)
{
    const ab_t high = ab_clamp((ab_t){3.0f, 0.5f}, 1.0f);
    ASSERT_SAME_FLOAT(1.0f, high.alpha);
    ASSERT_SAME_FLOAT(0.5f, high.beta);
    const ab_t low = ab_clamp((ab_t){-0.5f, -3.0f}, 1.0f);
    ASSERT_SAME_FLOAT(-0.5f, low.alpha);
    ASSERT_SAME_FLOAT(-1.0f, low.beta);
    const ab_t other = ab_clamp((ab_t){-3.0f, 3.0f}, 1.0f);
    ASSERT_SAME_FLOAT(-1.0f, other.alpha);
    ASSERT_SAME_FLOAT(1.0f, other.beta);
}

static void test_clamp_leaves_no_nan(void)
{
    const ab_t clamped = ab_clamp((ab_t){NAN, NAN}, 1.0f);
    ASSERT_SAME_FLOAT(-1.0f, clamped.alpha);
    ASSERT_SAME_FLOAT(-1.0f, clamped.beta);
}

/* Power-invariant space vector: sqrt(2/3) (u + v e^{j 120} + w e^{j 240}). */
static double complex space_vector(uvw_t x)
{
    return sqrt(2.0 / 3.0) * ((double)x.u + (double)x.v * cexp(I * two_thirds_pi) +
                              (double)x.w * cexp(-I * two_thirds_pi));
}

static void test_clarke_is_the_space_vector(void)
{
    const uvw_t x = {1.5f, -0.25f, 0.625f};
    assert_ab(space_vector(x), ab_from_uvw(x));
}

static void test_clarke_drops_the_zero_sequence(void)
{
    assert_ab(0.0, ab_from_uvw((uvw_t){2.0f, 2.0f, 2.0f}));
}

static void test_clarke_keeps_power(void)
{
    const uvw_t i = {3.0f, -1.0f, -2.0f};
    const uvw_t u = {0.5f, 1.5f, -2.0f};
    const double power = 3.0 * 0.5 - 1.0 * 1.5 + 2.0 * 2.0;
    ASSERT_NEAR(TOLERANCE, power, ab_dot(ab_from_uvw(u), ab_from_uvw(i)));
}

static void test_clarke_of_line_voltages_is_that_of_the_phases(void)
{
    const uvw_t x = {1.5f, -0.25f, 0.625f};
    assert_ab(space_vector(x), ab_from_line(x.u - x.v, x.v - x.w));
}

static void test_inverse_clarke_restores_the_phases(void)
{
    const uvw_t x = {1.5f, -0.25f, -1.25f};
    const uvw_t back = uvw_from_ab(ab_from_uvw(x));
    ASSERT_NEAR(TOLERANCE, x.u, back.u);
    ASSERT_NEAR(TOLERANCE, x.v, back.v);
    ASSERT_NEAR(TOLERANCE, x.w, back.w);
}

static void test_park_turns_back_by_the_angle_of_the_axis(void)
{
    const double angle = 0.7;
    const ab_t axis = {(float)cos(angle), (float)sin(angle)};
    const dq_t x = dq_from_ab(a, axis);
    const double complex expected = complex_of(a) * cexp(-I * angle);
    ASSERT_NEAR(TOLERANCE, creal(expected), x.d);
    ASSERT_NEAR(TOLERANCE, cimag(expected), x.q);
}

static void test_inverse_park_turns_forward(void)
{
    const double angle = 0.7;
    const ab_t axis = {(float)cos(angle), (float)sin(angle)};
    const dq_t x = {a.alpha, a.beta};
    assert_ab(complex_of(a) * cexp(I * angle), ab_from_dq(x, axis));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_sum_and_difference_are_those_of_complex_numbers);
    RUN_TEST(test_scaling_stretches_both_components);
    RUN_TEST(test_product_is_that_of_complex_numbers);
    RUN_TEST(test_product_with_j_turns_by_90_degrees);
    RUN_TEST(test_conjugate_mirrors_beta);
    RUN_TEST(test_dot_and_cross_are_the_parts_of_conj_a_b);
    RUN_TEST(test_norm2_is_the_square_of_the_length);
    RUN_TEST(test_finite_needs_both_components);
    RUN_TEST(test_clamp_limits_each_component);
    RUN_TEST(test_clamp_leaves_no_nan);
    RUN_TEST(test_clarke_is_the_space_vector);
    RUN_TEST(test_clarke_drops_the_zero_sequence);
    RUN_TEST(test_clarke_keeps_power);
    RUN_TEST(test_clarke_of_line_voltages_is_that_of_the_phases);
    RUN_TEST(test_inverse_clarke_restores_the_phases);
    RUN_TEST(test_park_turns_back_by_the_angle_of_the_axis);
    RUN_TEST(test_inverse_park_turns_forward);
    return UNITY_END();
}
