#include "svpwm.h"

#include <float.h>
#include <math.h>

#include "exact.h"
#include "unity.h"

#define PERIOD_S 0.0002f
#define U_DC_V   283.0f

static const double pi = 3.14159265358979323846;
static svpwm_config_t plain;

/* Roundings of a duty, and of a voltage relative to the dc link. */
#define DUTY_TOLERANCE       3e-7
#define VOLTAGE_TOLERANCE_PU 6e-7

/* No pulse shorter than this, as a share of the period. */
static svpwm_config_t with_shortest(float shortest)
{
    const svpwm_params_t params = {.min_pulse_s = shortest, .u_dc_min_V = 50.0f};
    svpwm_config_t cfg = {0};
    TEST_ASSERT_TRUE(svpwm_init(&cfg, &params, 1.0f));
    return cfg;
}

void setUp(void)
{
    plain = with_shortest(0.0f);
}

void tearDown(void)
{
}

static ab_t polar(double magnitude_V, double angle_rad)
{
    return (ab_t){(float)(magnitude_V * cos(angle_rad)), (float)(magnitude_V * sin(angle_rad))};
}

/* Phase voltages of a vector in double precision, zero sequence 0. */
static void phases_V(ab_t x, double out[3])
{
    for (int k = 0; k < 3; k++) {
        const double axis = 2.0 * pi / 3.0 * k;
        out[k] = sqrt(2.0 / 3.0) * ((double)x.alpha * cos(axis) + (double)x.beta * sin(axis));
    }
}

static double highest(const double x[3])
{
    return fmax(fmax(x[0], x[1]), x[2]);
}

static double lowest(const double x[3])
{
    return fmin(fmin(x[0], x[1]), x[2]);
}

/* Stationary-frame voltage of three legs at duty times dc link, in double precision. */
static void assert_voltage_of_duty(uvw_t duty, double u_dc_V, ab_t u_V)
{
    const double tolerance_V = VOLTAGE_TOLERANCE_PU * u_dc_V;
    const double alpha_V =
        sqrt(2.0 / 3.0) * u_dc_V * ((double)duty.u - 0.5 * ((double)duty.v + (double)duty.w));
    const double beta_V = sqrt(0.5) * u_dc_V * ((double)duty.v - (double)duty.w);
    TEST_ASSERT_DOUBLE_WITHIN(tolerance_V, alpha_V, (double)u_V.alpha);
    TEST_ASSERT_DOUBLE_WITHIN(tolerance_V, beta_V, (double)u_V.beta);
}

static void assert_neutral(svpwm_out_t out)
{
    ASSERT_SAME_FLOAT(0.5f, out.duty.u);
    ASSERT_SAME_FLOAT(0.5f, out.duty.v);
    ASSERT_SAME_FLOAT(0.5f, out.duty.w);
    ASSERT_SAME_FLOAT(0.0f, out.u_realised_V.alpha);
    ASSERT_SAME_FLOAT(0.0f, out.u_realised_V.beta);
}

static void test_init_derives_the_shortest_duty(void)
{
    const svpwm_params_t params = {.min_pulse_s = 5e-6f, .u_dc_min_V = 40.0f, .swap_vw = true};
    svpwm_config_t cfg = {0};
    TEST_ASSERT_TRUE(svpwm_init(&cfg, &params, PERIOD_S));
    TEST_ASSERT_FLOAT_WITHIN(1e-8f, 0.025f, cfg.min_duty);
    TEST_ASSERT_FLOAT_WITHIN(2e-6f, 0.95f, cfg.inside_pu);
    TEST_ASSERT_TRUE(cfg.inside_pu < 0.95f);
    ASSERT_SAME_FLOAT(40.0f, cfg.u_dc_min_V);
    ASSERT_SAME_FLOAT(-1.0f, cfg.beta_sign);
}

#define ASSERT_REFUSED(field, value)                                                               \
    do {                                                                                           \
        svpwm_params_t bad = {.min_pulse_s = 5e-6f, .u_dc_min_V = 40.0f};                          \
        bad.field = (value);                                                                       \
        TEST_ASSERT_FALSE_MESSAGE(svpwm_init(&untouched, &bad, PERIOD_S), #field " = " #value);    \
    } while (0)

static void test_init_refuses_every_bad_number_and_leaves_the_config(void)
{
    const svpwm_params_t good = {.min_pulse_s = 5e-6f, .u_dc_min_V = 40.0f};
    svpwm_config_t untouched = {.min_duty = 77.0f};

    ASSERT_REFUSED(min_pulse_s, -1e-9f);
    ASSERT_REFUSED(min_pulse_s, 0.5f * PERIOD_S);
    ASSERT_REFUSED(min_pulse_s, NAN);
    ASSERT_REFUSED(min_pulse_s, INFINITY);
    ASSERT_REFUSED(u_dc_min_V, 0.0f);
    ASSERT_REFUSED(u_dc_min_V, -40.0f);
    ASSERT_REFUSED(u_dc_min_V, NAN);
    ASSERT_REFUSED(u_dc_min_V, INFINITY);
    for (int i = 0; i < NOT_POSITIVE_COUNT; i++) {
        TEST_ASSERT_FALSE(svpwm_init(&untouched, &good, not_positive(i)));
    }
    ASSERT_SAME_FLOAT(77.0f, untouched.min_duty);
}

static void test_init_accepts_the_ends_of_the_ranges(void)
{
    svpwm_params_t params = {.min_pulse_s = 0.0f, .u_dc_min_V = 1.0f};
    svpwm_config_t cfg = {0};
    TEST_ASSERT_TRUE(svpwm_init(&cfg, &params, PERIOD_S));
    ASSERT_SAME_FLOAT(0.0f, cfg.min_duty);
    params.min_pulse_s = 0.499f * PERIOD_S;
    TEST_ASSERT_TRUE(svpwm_init(&cfg, &params, PERIOD_S));
}

static void test_no_voltage_is_half_of_the_period_on_every_leg(void)
{
    const svpwm_out_t out = svpwm_step(&plain, (ab_t){0.0f, 0.0f}, U_DC_V);
    assert_neutral(out);
    TEST_ASSERT_FALSE(out.limited);
}

static void test_one_vector_agrees_with_double_arithmetic(void)
{
    const ab_t u_V = {71.0f, -93.0f};
    double x_V[3];
    phases_V(u_V, x_V);
    const double mid_V = 0.5 * (highest(x_V) + lowest(x_V));
    const svpwm_out_t out = svpwm_step(&plain, u_V, U_DC_V);
    TEST_ASSERT_DOUBLE_WITHIN(DUTY_TOLERANCE, 0.5 + (x_V[0] - mid_V) / 283.0, (double)out.duty.u);
    TEST_ASSERT_DOUBLE_WITHIN(DUTY_TOLERANCE, 0.5 + (x_V[1] - mid_V) / 283.0, (double)out.duty.v);
    TEST_ASSERT_DOUBLE_WITHIN(DUTY_TOLERANCE, 0.5 + (x_V[2] - mid_V) / 283.0, (double)out.duty.w);
    TEST_ASSERT_FALSE(out.limited);
}

static void assert_inside(ab_t u_V, double u_dc_V, const svpwm_out_t *out)
{
    const double duty[3] = {(double)out->duty.u, (double)out->duty.v, (double)out->duty.w};
    TEST_ASSERT_FALSE(out->limited);
    TEST_ASSERT_DOUBLE_WITHIN(VOLTAGE_TOLERANCE_PU * u_dc_V, (double)u_V.alpha,
                              (double)out->u_realised_V.alpha);
    TEST_ASSERT_DOUBLE_WITHIN(VOLTAGE_TOLERANCE_PU * u_dc_V, (double)u_V.beta,
                              (double)out->u_realised_V.beta);
    /* Centred: as much room above as below. */
    TEST_ASSERT_DOUBLE_WITHIN(2.0 * DUTY_TOLERANCE, 1.0, highest(duty) + lowest(duty));
}

static void assert_outside(ab_t u_V, double u_dc_V, const svpwm_out_t *out)
{
    const double duty[3] = {(double)out->duty.u, (double)out->duty.v, (double)out->duty.w};
    const double asked_V = hypot((double)u_V.alpha, (double)u_V.beta);
    TEST_ASSERT_TRUE(out->limited);
    /* Across and along the reference. */
    TEST_ASSERT_DOUBLE_WITHIN(2.0 * VOLTAGE_TOLERANCE_PU * u_dc_V, 0.0,
                              (double)ab_cross(u_V, out->u_realised_V) / asked_V);
    TEST_ASSERT_TRUE((double)ab_dot(u_V, out->u_realised_V) / asked_V >= 0.7071 * u_dc_V);
    TEST_ASSERT_DOUBLE_WITHIN(2.0 * DUTY_TOLERANCE, 1.0, highest(duty) - lowest(duty));
}

static void test_every_vector_is_realised_inside_the_hexagon_and_shortened_outside(void)
{
    const double u_dc_V[] = {51.0, 283.0, 540.0};
    for (unsigned d = 0; d < 3u; d++) {
        for (int degree = 0; degree < 360; degree++) {
            for (int step = 0; step <= 30; step++) {
                /* 0 .. 1.5 dc link; the hexagon reaches from .707 to .816. */
                const ab_t u_V = polar(0.05 * step * u_dc_V[d], degree * pi / 180.0);
                const svpwm_out_t out = svpwm_step(&plain, u_V, (float)u_dc_V[d]);
                double x_V[3];
                phases_V(u_V, x_V);
                const double span_pu = (highest(x_V) - lowest(x_V)) / u_dc_V[d];
                const double duty[3] = {(double)out.duty.u, (double)out.duty.v, (double)out.duty.w};
                TEST_ASSERT_TRUE((lowest(duty) >= 0.0) && (highest(duty) <= 1.0));
                assert_voltage_of_duty(out.duty, u_dc_V[d], out.u_realised_V);
                if (span_pu < 1.0 - 1e-6) {
                    assert_inside(u_V, u_dc_V[d], &out);
                }
                if (span_pu > 1.0 + 1e-6) {
                    assert_outside(u_V, u_dc_V[d], &out);
                }
            }
        }
    }
}

static void test_the_hexagon_itself_is_still_inside(void)
{
    const ab_t u_V = {100.0f, 120.0f};
    const uvw_t x_V = uvw_from_ab(u_V); /* u and v above, w below */
    const float span_V = fmaxf(x_V.u, x_V.v) - x_V.w;
    TEST_ASSERT_FALSE(svpwm_step(&plain, u_V, span_V).limited);
    TEST_ASSERT_TRUE(svpwm_step(&plain, u_V, nextafterf(span_V, 0.0f)).limited);
}

static void test_the_corner_and_the_side_of_the_hexagon_are_reached(void)
{
    /* Corner on alpha: sqrt(2/3) dc link. Side on beta: sqrt(1/2) dc link. */
    const svpwm_out_t corner = svpwm_step(&plain, (ab_t){1000.0f, 0.0f}, U_DC_V);
    const svpwm_out_t side = svpwm_step(&plain, (ab_t){0.0f, 1000.0f}, U_DC_V);
    TEST_ASSERT_DOUBLE_WITHIN(2e-4, sqrt(2.0 / 3.0) * 283.0, (double)corner.u_realised_V.alpha);
    TEST_ASSERT_DOUBLE_WITHIN(2e-4, 0.0, (double)corner.u_realised_V.beta);
    TEST_ASSERT_DOUBLE_WITHIN(2e-4, 0.0, (double)side.u_realised_V.alpha);
    TEST_ASSERT_DOUBLE_WITHIN(2e-4, sqrt(0.5) * 283.0, (double)side.u_realised_V.beta);
}

static void test_turning_the_vector_by_120_degrees_passes_the_duties_on(void)
{
    for (int degree = 0; degree < 360; degree += 13) {
        const double angle_rad = degree * pi / 180.0;
        const svpwm_out_t a = svpwm_step(&plain, polar(150.0, angle_rad), U_DC_V);
        const svpwm_out_t b = svpwm_step(&plain, polar(150.0, angle_rad + 2.0 * pi / 3.0), U_DC_V);
        TEST_ASSERT_DOUBLE_WITHIN(DUTY_TOLERANCE, (double)a.duty.u, (double)b.duty.v);
        TEST_ASSERT_DOUBLE_WITHIN(DUTY_TOLERANCE, (double)a.duty.v, (double)b.duty.w);
        TEST_ASSERT_DOUBLE_WITHIN(DUTY_TOLERANCE, (double)a.duty.w, (double)b.duty.u);
    }
}

static void test_the_mirrored_vector_exchanges_v_and_w(void)
{
    const svpwm_out_t a = svpwm_step(&plain, (ab_t){80.0f, 60.0f}, U_DC_V);
    const svpwm_out_t b = svpwm_step(&plain, (ab_t){80.0f, -60.0f}, U_DC_V);
    ASSERT_SAME_FLOAT(a.duty.u, b.duty.u);
    ASSERT_SAME_FLOAT(a.duty.v, b.duty.w);
    ASSERT_SAME_FLOAT(a.duty.w, b.duty.v);
}

static void test_the_opposite_vector_exchanges_on_and_off(void)
{
    const svpwm_out_t a = svpwm_step(&plain, (ab_t){80.0f, 60.0f}, U_DC_V);
    const svpwm_out_t b = svpwm_step(&plain, (ab_t){-80.0f, -60.0f}, U_DC_V);
    TEST_ASSERT_DOUBLE_WITHIN(DUTY_TOLERANCE, 1.0 - (double)a.duty.u, (double)b.duty.u);
    TEST_ASSERT_DOUBLE_WITHIN(DUTY_TOLERANCE, 1.0 - (double)a.duty.v, (double)b.duty.v);
    TEST_ASSERT_DOUBLE_WITHIN(DUTY_TOLERANCE, 1.0 - (double)a.duty.w, (double)b.duty.w);
}

static void test_twice_the_voltage_on_twice_the_dc_link_is_the_same_duty(void)
{
    const svpwm_out_t a = svpwm_step(&plain, (ab_t){80.0f, 60.0f}, U_DC_V);
    const svpwm_out_t b = svpwm_step(&plain, (ab_t){160.0f, 120.0f}, 2.0f * U_DC_V);
    TEST_ASSERT_EQUAL_MEMORY(&a.duty, &b.duty, sizeof a.duty);
    ASSERT_SAME_FLOAT(2.0f * a.u_realised_V.alpha, b.u_realised_V.alpha);
    ASSERT_SAME_FLOAT(2.0f * a.u_realised_V.beta, b.u_realised_V.beta);
}

static void test_swapped_legs_leave_the_motor_its_voltage(void)
{
    svpwm_config_t swapped = plain;
    swapped.beta_sign = -1.0f;
    const svpwm_out_t a = svpwm_step(&plain, (ab_t){80.0f, 60.0f}, U_DC_V);
    const svpwm_out_t b = svpwm_step(&swapped, (ab_t){80.0f, 60.0f}, U_DC_V);
    ASSERT_SAME_FLOAT(a.duty.u, b.duty.u);
    ASSERT_SAME_FLOAT(a.duty.v, b.duty.w);
    ASSERT_SAME_FLOAT(a.duty.w, b.duty.v);
    TEST_ASSERT_TRUE(a.duty.v > a.duty.w + 0.1f);
    TEST_ASSERT_EQUAL_MEMORY(&a.u_realised_V, &b.u_realised_V, sizeof a.u_realised_V);
}

/* On alpha, where v and w have the shortest on pulse and u the shortest off pulse:
 * duty.v = .5 - .75 u_u/u_dc. */
static ab_t alpha_for_short_pulses(float pulse_pu)
{
    return (ab_t){(0.5f - pulse_pu) / 0.75f * U_DC_V * 1.2247449f, 0.0f};
}

static void assert_short_pulse(float wanted, float shortest, double expected)
{
    const svpwm_config_t cfg = with_shortest(shortest);
    const svpwm_out_t out = svpwm_step(&cfg, alpha_for_short_pulses(wanted), U_DC_V);
    TEST_ASSERT_DOUBLE_WITHIN(DUTY_TOLERANCE, expected, (double)out.duty.v);
    TEST_ASSERT_DOUBLE_WITHIN(DUTY_TOLERANCE, expected, (double)out.duty.w);
    TEST_ASSERT_DOUBLE_WITHIN(DUTY_TOLERANCE, 1.0 - expected, (double)out.duty.u);
    assert_voltage_of_duty(out.duty, (double)U_DC_V, out.u_realised_V);
    TEST_ASSERT_FALSE(out.limited);
}

static void test_a_pulse_shorter_than_half_the_shortest_is_dropped(void)
{
    assert_short_pulse(0.0099f, 0.02f, 0.0);
    assert_short_pulse(0.001f, 0.02f, 0.0);
}

static void test_a_pulse_shorter_than_the_shortest_is_lengthened(void)
{
    assert_short_pulse(0.0101f, 0.02f, 0.02);
    assert_short_pulse(0.0199f, 0.02f, 0.02);
    /* However long the shortest is. */
    assert_short_pulse(0.35f, 0.4f, 0.4);
    assert_short_pulse(0.48f, 0.49f, 0.49);
}

static void test_a_pulse_longer_than_the_shortest_is_kept(void)
{
    assert_short_pulse(0.0201f, 0.02f, 0.0201);
    assert_short_pulse(0.3f, 0.02f, 0.3);
}

static void test_half_of_the_shortest_pulse_is_lengthened_and_not_dropped(void)
{
    const ab_t u_V = alpha_for_short_pulses(0.015f);
    const svpwm_out_t free = svpwm_step(&plain, u_V, U_DC_V);

    svpwm_config_t cfg = with_shortest(2.0f * free.duty.v);
    ASSERT_SAME_FLOAT(cfg.min_duty, svpwm_step(&cfg, u_V, U_DC_V).duty.v);
    cfg = with_shortest(nextafterf(cfg.min_duty, 1.0f));
    ASSERT_SAME_FLOAT(0.0f, svpwm_step(&cfg, u_V, U_DC_V).duty.v);

    cfg = with_shortest(2.0f * (1.0f - free.duty.u));
    ASSERT_SAME_FLOAT(1.0f - cfg.min_duty, svpwm_step(&cfg, u_V, U_DC_V).duty.u);
    cfg = with_shortest(nextafterf(cfg.min_duty, 1.0f));
    ASSERT_SAME_FLOAT(1.0f, svpwm_step(&cfg, u_V, U_DC_V).duty.u);
}

static void test_a_leg_that_does_not_switch_needs_no_pulse(void)
{
    const svpwm_config_t cfg = with_shortest(0.02f);
    const svpwm_out_t out = svpwm_step(&cfg, (ab_t){1000.0f, 0.0f}, U_DC_V);
    ASSERT_SAME_FLOAT(1.0f, out.duty.u);
    ASSERT_SAME_FLOAT(0.0f, out.duty.v);
    ASSERT_SAME_FLOAT(0.0f, out.duty.w);
}

static void test_no_pulse_is_ever_shorter_than_the_shortest(void)
{
    const float shortest = 0.04f;
    const svpwm_config_t cfg = with_shortest(shortest);
    for (int degree = 0; degree < 360; degree++) {
        for (int step = 0; step <= 40; step++) {
            const ab_t u_V = polar(8.0 * step, degree * pi / 180.0);
            const svpwm_out_t out = svpwm_step(&cfg, u_V, U_DC_V);
            const float duty[3] = {out.duty.u, out.duty.v, out.duty.w};
            for (int x = 0; x < 3; x++) {
                const bool on = (duty[x] >= shortest) || (duty[x] == 0.0f);
                const bool off = (duty[x] <= 1.0f - shortest) || (duty[x] == 1.0f);
                TEST_ASSERT_TRUE(on && off);
            }
            assert_voltage_of_duty(out.duty, (double)U_DC_V, out.u_realised_V);
        }
    }
}

static void test_a_low_dc_link_gives_no_voltage(void)
{
    const float low_V[] = {nextafterf(50.0f, 0.0f), 0.0f, -283.0f, NAN, INFINITY, -INFINITY};
    for (unsigned i = 0; i < 6u; i++) {
        const svpwm_out_t out = svpwm_step(&plain, (ab_t){20.0f, 10.0f}, low_V[i]);
        assert_neutral(out);
        TEST_ASSERT_TRUE(out.limited);
    }
}

static void test_the_lowest_dc_link_is_still_used(void)
{
    const svpwm_out_t out = svpwm_step(&plain, (ab_t){20.0f, 10.0f}, 50.0f);
    TEST_ASSERT_FALSE(out.limited);
    TEST_ASSERT_FLOAT_WITHIN(5e-5f, 20.0f, out.u_realised_V.alpha);
    TEST_ASSERT_FLOAT_WITHIN(5e-5f, 10.0f, out.u_realised_V.beta);
}

static void test_a_reference_that_is_no_number_gives_no_voltage(void)
{
    /* FLT_MAX overflows inside: it is treated like infinity. */
    const float bad[] = {NAN, INFINITY, -INFINITY, FLT_MAX, -FLT_MAX};
    for (unsigned i = 0; i < 5u; i++) {
        const ab_t u_V[] = {{bad[i], 10.0f}, {10.0f, bad[i]}, {bad[i], bad[i]}};
        for (unsigned j = 0; j < 3u; j++) {
            const svpwm_out_t out = svpwm_step(&plain, u_V[j], U_DC_V);
            assert_neutral(out);
            TEST_ASSERT_TRUE(out.limited);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_derives_the_shortest_duty);
    RUN_TEST(test_init_refuses_every_bad_number_and_leaves_the_config);
    RUN_TEST(test_init_accepts_the_ends_of_the_ranges);
    RUN_TEST(test_no_voltage_is_half_of_the_period_on_every_leg);
    RUN_TEST(test_one_vector_agrees_with_double_arithmetic);
    RUN_TEST(test_every_vector_is_realised_inside_the_hexagon_and_shortened_outside);
    RUN_TEST(test_the_hexagon_itself_is_still_inside);
    RUN_TEST(test_the_corner_and_the_side_of_the_hexagon_are_reached);
    RUN_TEST(test_turning_the_vector_by_120_degrees_passes_the_duties_on);
    RUN_TEST(test_the_mirrored_vector_exchanges_v_and_w);
    RUN_TEST(test_the_opposite_vector_exchanges_on_and_off);
    RUN_TEST(test_twice_the_voltage_on_twice_the_dc_link_is_the_same_duty);
    RUN_TEST(test_swapped_legs_leave_the_motor_its_voltage);
    RUN_TEST(test_a_pulse_shorter_than_half_the_shortest_is_dropped);
    RUN_TEST(test_a_pulse_shorter_than_the_shortest_is_lengthened);
    RUN_TEST(test_a_pulse_longer_than_the_shortest_is_kept);
    RUN_TEST(test_half_of_the_shortest_pulse_is_lengthened_and_not_dropped);
    RUN_TEST(test_a_leg_that_does_not_switch_needs_no_pulse);
    RUN_TEST(test_no_pulse_is_ever_shorter_than_the_shortest);
    RUN_TEST(test_a_low_dc_link_gives_no_voltage);
    RUN_TEST(test_the_lowest_dc_link_is_still_used);
    RUN_TEST(test_a_reference_that_is_no_number_gives_no_voltage);
    return UNITY_END();
}
