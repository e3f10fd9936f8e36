#include "trig.h"

#include "crc32c.h"
#include "exact.h"

/* The bounds the header states. */
#define SINE_ERROR_MAX       1e-7
#define ARCTANGENT_ERROR_RAD 4e-7
#define WRAP_ERROR_RAD       4e-7 /* two roundings near pi, and that of the constant 2 pi */

static const double pi = 3.14159265358979323846;

void setUp(void)
{
}

void tearDown(void)
{
}

static double unit_error(float angle_rad)
{
    const ab_t unit = trig_unit(angle_rad);
    const double c = fabs((double)unit.alpha - cos((double)angle_rad));
    const double s = fabs((double)unit.beta - sin((double)angle_rad));
    return fmax(c, s);
}

static void test_unit_is_cosine_and_sine_over_the_working_range(void)
{
    double worst = 0.0;
    for (int k = -400000; k <= 400000; k++) {
        worst = fmax(worst, unit_error((float)k * 0.0025f));
    }
    TEST_ASSERT_TRUE(worst <= SINE_ERROR_MAX);
}

static void test_unit_is_cosine_and_sine_up_to_the_largest_angle(void)
{
    double worst = 0.0;
    for (int k = -100000; k <= 100000; k++) {
        worst = fmax(worst, unit_error((float)k * (TRIG_ANGLE_MAX_RAD / 100000.0f)));
    }
    TEST_ASSERT_TRUE(worst <= SINE_ERROR_MAX);
}

/* Where cosine or sine is nearly zero, the reduction shows. */
static void test_unit_is_exact_to_rounding_beside_every_quarter_turn(void)
{
    double worst = 0.0;
    for (int quarter = -640; quarter <= 640; quarter++) {
        const float angle = (float)(0.5 * pi * quarter);
        worst = fmax(worst, unit_error(angle));
        worst = fmax(worst, unit_error(nextafterf(angle, INFINITY)));
        worst = fmax(worst, unit_error(nextafterf(angle, -INFINITY)));
    }
    TEST_ASSERT_TRUE(worst <= SINE_ERROR_MAX);
}

static void test_unit_of_zero_is_one(void)
{
    const ab_t unit = trig_unit(0.0f);
    ASSERT_SAME_FLOAT(1.0f, unit.alpha);
    ASSERT_SAME_FLOAT(0.0f, unit.beta);
}

static void test_unit_of_a_small_angle_keeps_its_sine(void)
{
    ASSERT_SAME_FLOAT(1e-5f, trig_unit(1e-5f).beta);
    ASSERT_SAME_FLOAT(-1e-30f, trig_unit(-1e-30f).beta);
}

static void test_a_small_angle_needs_no_reduction(void)
{
    for (int k = -1000; k <= 1000; k++) {
        const float angle = (float)k * (TRIG_SMALL_MAX_RAD / 1000.0f);
        const ab_t small = trig_unit_small(angle);
        const ab_t unit = trig_unit(angle);
        ASSERT_SAME_FLOAT(unit.alpha, small.alpha);
        ASSERT_SAME_FLOAT(unit.beta, small.beta);
    }
}

static void test_unit_mirrors_with_the_angle(void)
{
    for (int k = 1; k < 5000; k++) {
        const float angle = (float)k * 0.0137f;
        const ab_t plus = trig_unit(angle);
        const ab_t minus = trig_unit(-angle);
        ASSERT_SAME_FLOAT(plus.alpha, minus.alpha);
        ASSERT_SAME_FLOAT(-plus.beta, minus.beta);
    }
}

static void test_unit_of_a_non_finite_angle_is_one(void)
{
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        const ab_t unit = trig_unit(not_finite(k));
        ASSERT_SAME_FLOAT(1.0f, unit.alpha);
        ASSERT_SAME_FLOAT(0.0f, unit.beta);
    }
}

static void test_unit_holds_beyond_the_largest_angle(void)
{
    const float beyond[3] = {10000.5f, 1e9f, FLT_MAX};
    for (int k = 0; k < 3; k++) {
        ASSERT_SAME_FLOAT(trig_unit(TRIG_ANGLE_MAX_RAD).beta, trig_unit(beyond[k]).beta);
        ASSERT_SAME_FLOAT(trig_unit(-TRIG_ANGLE_MAX_RAD).beta, trig_unit(-beyond[k]).beta);
        ASSERT_SAME_FLOAT(trig_unit(TRIG_ANGLE_MAX_RAD).alpha, trig_unit(-beyond[k]).alpha);
    }
    TEST_ASSERT_TRUE(trig_unit(9999.5f).beta != trig_unit(TRIG_ANGLE_MAX_RAD).beta);
}

static void test_angle_is_the_arctangent_all_around(void)
{
    const float radius[4] = {1.0f, 0.37f, 1e30f, 1e-30f};
    double worst = 0.0;
    for (int k = 0; k < 200000; k++) {
        const double angle = 2.0 * pi * (k / 200000.0) - pi;
        const float r = radius[k % 4];
        const ab_t x = {r * (float)cos(angle), r * (float)sin(angle)};
        const double truth = atan2((double)x.beta, (double)x.alpha);
        worst = fmax(worst, fabs((double)trig_angle(x) - truth));
    }
    TEST_ASSERT_TRUE(worst <= ARCTANGENT_ERROR_RAD);
}

static void test_angle_on_axes_and_diagonals(void)
{
    for (int eighth = -3; eighth <= 4; eighth++) {
        const double angle = 0.25 * pi * eighth;
        const ab_t x = {(float)round(1.2 * cos(angle)), (float)round(1.2 * sin(angle))};
        ASSERT_NEAR(ARCTANGENT_ERROR_RAD, angle, trig_angle(x));
    }
}

static void test_angle_of_a_small_slope_is_the_slope(void)
{
    ASSERT_SAME_FLOAT(1e-5f, trig_angle((ab_t){1.0f, 1e-5f}));
    ASSERT_SAME_FLOAT(-1e-30f, trig_angle((ab_t){1.0f, -1e-30f}));
}

static void test_angle_of_the_smallest_and_largest_vectors(void)
{
    const float denormal = 1.4e-45f;
    ASSERT_NEAR(ARCTANGENT_ERROR_RAD, 0.25 * pi, trig_angle((ab_t){denormal, denormal}));
    ASSERT_NEAR(ARCTANGENT_ERROR_RAD, -0.75 * pi, trig_angle((ab_t){-FLT_MAX, -FLT_MAX}));
}

static void test_angle_of_no_direction_is_zero(void)
{
    ASSERT_SAME_FLOAT(0.0f, trig_angle((ab_t){0.0f, 0.0f}));
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        ASSERT_SAME_FLOAT(0.0f, trig_angle((ab_t){not_finite(k), 1.0f}));
        ASSERT_SAME_FLOAT(0.0f, trig_angle((ab_t){1.0f, not_finite(k)}));
    }
}

/* Rounding of the angle itself, and of a result of up to pi. */
static double wrap_error(float angle_rad)
{
    const double wrapped = (double)trig_wrap(angle_rad);
    TEST_ASSERT_TRUE((wrapped >= -(double)NUM_PI) && (wrapped <= (double)NUM_PI));
    return fabs(remainder(wrapped - (double)angle_rad, 2.0 * pi));
}

static void test_wrap_takes_off_whole_turns(void)
{
    double worst = 0.0;
    for (int k = -100000; k <= 100000; k++) {
        worst = fmax(worst, wrap_error((float)k * 0.0311f));
    }
    TEST_ASSERT_TRUE(worst <= WRAP_ERROR_RAD);
}

/* The turns are counted in float: beside an odd multiple of pi the count can be one off. */
static void test_wrap_stays_inside_beside_odd_multiples_of_pi(void)
{
    double worst = 0.0;
    for (int turn = -1500; turn <= 1500; turn++) {
        float angle = (float)(pi * (2.0 * turn + 1.0));
        for (int k = 0; k < 4; k++) {
            angle = nextafterf(angle, -INFINITY);
        }
        for (int k = 0; k < 9; k++) {
            worst = fmax(worst, wrap_error(angle));
            angle = nextafterf(angle, INFINITY);
        }
    }
    TEST_ASSERT_TRUE(worst <= WRAP_ERROR_RAD);
}

static void test_wrap_leaves_what_is_inside(void)
{
    for (int k = -314; k <= 314; k++) {
        const float angle = (float)k * 0.01f;
        ASSERT_SAME_FLOAT(angle, trig_wrap(angle));
    }
}

/* Angles whose remainder rounds to pi itself: inside already, no turn is added or taken off. */
static void test_wrap_keeps_pi_of_either_sign(void)
{
    ASSERT_SAME_FLOAT(NUM_PI, trig_wrap(47.1238899f));
    ASSERT_SAME_FLOAT(-NUM_PI, trig_wrap(9.42477798f));
}

static void test_wrap_of_a_non_finite_angle_is_zero(void)
{
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        ASSERT_SAME_FLOAT(0.0f, trig_wrap(not_finite(k)));
    }
}

static void test_wrap_holds_beyond_the_largest_angle(void)
{
    ASSERT_SAME_FLOAT(trig_wrap(TRIG_ANGLE_MAX_RAD), trig_wrap(FLT_MAX));
    ASSERT_SAME_FLOAT(trig_wrap(-TRIG_ANGLE_MAX_RAD), trig_wrap(-FLT_MAX));
    ASSERT_NEAR(WRAP_ERROR_RAD, remainder((double)TRIG_ANGLE_MAX_RAD, 2.0 * pi), trig_wrap(1e6f));
}

/* Host, target and every replayed log rely on these very bits; a change of one is a new version
 * of every recorded trace. */
static void test_bits_are_those_of_every_recorded_trace(void)
{
    uint32_t crc = 0u;
    uint32_t seed = 1u;
    for (int k = 0; k < 20000; k++) {
        const ab_t x = {noise(&seed), noise(&seed)};
        const ab_t diagonal = {x.alpha, x.alpha};
        const ab_t unit = trig_unit(400.0f * x.alpha);
        const float rest[3] = {trig_angle(x), trig_angle(diagonal), trig_wrap(400.0f * x.beta)};
        crc = crc32c_update(crc, &unit, sizeof unit);
        crc = crc32c_update(crc, rest, sizeof rest);
    }
    TEST_ASSERT_EQUAL_HEX32(0xEBB9E4B0u, crc);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_unit_is_cosine_and_sine_over_the_working_range);
    RUN_TEST(test_unit_is_cosine_and_sine_up_to_the_largest_angle);
    RUN_TEST(test_unit_is_exact_to_rounding_beside_every_quarter_turn);
    RUN_TEST(test_unit_of_zero_is_one);
    RUN_TEST(test_unit_of_a_small_angle_keeps_its_sine);
    RUN_TEST(test_a_small_angle_needs_no_reduction);
    RUN_TEST(test_unit_mirrors_with_the_angle);
    RUN_TEST(test_unit_of_a_non_finite_angle_is_one);
    RUN_TEST(test_unit_holds_beyond_the_largest_angle);
    RUN_TEST(test_angle_is_the_arctangent_all_around);
    RUN_TEST(test_angle_on_axes_and_diagonals);
    RUN_TEST(test_angle_of_a_small_slope_is_the_slope);
    RUN_TEST(test_angle_of_the_smallest_and_largest_vectors);
    RUN_TEST(test_angle_of_no_direction_is_zero);
    RUN_TEST(test_wrap_takes_off_whole_turns);
    RUN_TEST(test_wrap_stays_inside_beside_odd_multiples_of_pi);
    RUN_TEST(test_wrap_leaves_what_is_inside);
    RUN_TEST(test_wrap_keeps_pi_of_either_sign);
    RUN_TEST(test_wrap_of_a_non_finite_angle_is_zero);
    RUN_TEST(test_wrap_holds_beyond_the_largest_angle);
    RUN_TEST(test_bits_are_those_of_every_recorded_trace);
    return UNITY_END();
}
