/* The voltage of the interval that ended: from the sensors, turned ahead, or from the duties of two
 * periods ago. */
#include "acting_voltage.h"

#include <complex.h>
#include <math.h>

#include "exact.h"
#include "trig.h"

#define FILTER_S    380e-6f
#define BLEND_RAD_S 30.0f

static acting_voltage_config_t cfg;
static acting_voltage_state_t st;

static bool init(acting_voltage_source_t source, float filter_comp_s, float blend_rad_s)
{
    const acting_voltage_params_t params = {
        .source = source, .filter_comp_s = filter_comp_s, .blend_rad_s = blend_rad_s};
    return acting_voltage_init(&cfg, &params);
}

static void configure(acting_voltage_source_t source)
{
    TEST_ASSERT_TRUE(init(source, FILTER_S, BLEND_RAD_S));
    st = (acting_voltage_state_t){0};
}

void setUp(void)
{
    configure(ACTING_VOLTAGE_SENSORS);
}

void tearDown(void)
{
}

static void assert_same_ab(ab_t expected, ab_t actual)
{
    ASSERT_SAME_FLOAT(expected.alpha, actual.alpha);
    ASSERT_SAME_FLOAT(expected.beta, actual.beta);
}

static void test_init_refuses_an_unknown_source_and_a_senseless_delay(void)
{
    TEST_ASSERT_FALSE(init((acting_voltage_source_t)3, FILTER_S, BLEND_RAD_S));
    TEST_ASSERT_FALSE(init(ACTING_VOLTAGE_SENSORS, -1e-6f, BLEND_RAD_S));
    TEST_ASSERT_FALSE(init(ACTING_VOLTAGE_BLEND, FILTER_S, 0.0f));
    TEST_ASSERT_FALSE(init(ACTING_VOLTAGE_BLEND, FILTER_S, -1.0f));
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        TEST_ASSERT_FALSE(init(ACTING_VOLTAGE_DUTY, not_finite(k), BLEND_RAD_S));
        TEST_ASSERT_FALSE(init(ACTING_VOLTAGE_BLEND, FILTER_S, not_finite(k)));
    }
    TEST_ASSERT_TRUE(init(ACTING_VOLTAGE_DUTY, 0.0f, BLEND_RAD_S));
}

/* Duties of step k act from t_(k+1) on: they are the ended interval of step k + 2. */
static void test_the_duties_of_two_periods_ago_have_acted(void)
{
    const acting_voltage_source_t sources[] = {ACTING_VOLTAGE_SENSORS, ACTING_VOLTAGE_DUTY};
    for (int n = 0; n < 2; n++) {
        configure(sources[n]);
        for (int k = 0; k < 6; k++) {
            const ab_t u_s_V = acting_voltage_step(&cfg, &st, (ab_t){7.0f, 8.0f});
            const float of_then_V = (k < 2) ? 0.0f : (float)(k - 2 + 1);
            const ab_t ended_V = {of_then_V, 2.0f * of_then_V};
            assert_same_ab(ended_V, st.ended_V);
            assert_same_ab((n == 0) ? (ab_t){7.0f, 8.0f} : ended_V, u_s_V);
            st.pending_V = (ab_t){(float)(k + 1), 2.0f * (float)(k + 1)};
        }
    }
}

static void test_the_duty_source_asks_no_sensor(void)
{
    configure(ACTING_VOLTAGE_DUTY);
    st = (acting_voltage_state_t){.acting_V = {3.0f, -4.0f}, .pending_V = {5.0f, 6.0f}};
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        acting_voltage_state_t next = st;
        acting_voltage_angle(&cfg, &next, not_finite(k));
        const ab_t u_s_V = acting_voltage_step(&cfg, &next, (ab_t){not_finite(k), 1.0f});
        assert_same_ab((ab_t){3.0f, -4.0f}, u_s_V);
        assert_same_ab((ab_t){5.0f, 6.0f}, next.acting_V);
    }
}

/* The filter lags by w_s times its delay; in either direction, against double precision. */
static void test_the_sensed_voltage_is_turned_ahead_by_the_filters_angle(void)
{
    const float speeds[] = {0.0f, 100.0f, -100.0f, 600.0f, -600.0f};
    const double complex u_V = 120.0 - 75.0 * I;
    for (int n = 0; n < 5; n++) {
        acting_voltage_angle(&cfg, &st, speeds[n]);
        const ab_t u_s_V = acting_voltage_step(&cfg, &st, (ab_t){120.0f, -75.0f});
        const double complex expected_V = u_V * cexp(I * (double)speeds[n] * (double)FILTER_S);
        ASSERT_NEAR(3e-5, creal(expected_V), u_s_V.alpha); /* 1e-7 of 140 V, twice */
        ASSERT_NEAR(3e-5, cimag(expected_V), u_s_V.beta);
    }
}

static void test_a_wild_speed_turns_by_an_eighth_of_a_turn_at_most(void)
{
    const float speeds[] = {1e5f, -1e5f, INFINITY, -INFINITY};
    for (int n = 0; n < 4; n++) {
        acting_voltage_angle(&cfg, &st, speeds[n]);
        const ab_t u_s_V = acting_voltage_step(&cfg, &st, (ab_t){100.0f, 0.0f});
        const double angle_rad = copysign((double)TRIG_SMALL_MAX_RAD, (double)speeds[n]);
        ASSERT_NEAR(3e-5, 100.0 * cos(angle_rad), u_s_V.alpha);
        ASSERT_NEAR(3e-5, 100.0 * sin(angle_rad), u_s_V.beta);
    }
    acting_voltage_angle(&cfg, &st, NAN);
    const ab_t u_s_V = acting_voltage_step(&cfg, &st, (ab_t){100.0f, 0.0f});
    TEST_ASSERT_TRUE(ab_finite(u_s_V));
}

/* Zeroed, the unit vector is (1, 0): what is sensed passes bit for bit. */
static void test_a_zeroed_state_turns_nothing(void)
{
    const ab_t u_V = {123.456f, -0.789f};
    assert_same_ab(u_V, acting_voltage_step(&cfg, &st, u_V));
    acting_voltage_angle(&cfg, &st, 0.0f);
    assert_same_ab((ab_t){0.0f, 0.0f}, st.lag);
}

/* The angle holds until it is set again, and is none of the duties' business. */
static void test_the_angle_holds_from_one_setting_to_the_next(void)
{
    acting_voltage_angle(&cfg, &st, 600.0f);
    const ab_t lag = st.lag;
    TEST_ASSERT_TRUE(lag.beta > 0.2f);
    const ab_t first_V = acting_voltage_step(&cfg, &st, (ab_t){100.0f, 0.0f});
    st.pending_V = (ab_t){40.0f, 50.0f};
    for (int k = 0; k < 4; k++) {
        assert_same_ab(first_V, acting_voltage_step(&cfg, &st, (ab_t){100.0f, 0.0f}));
        assert_same_ab(lag, st.lag);
    }
    assert_same_ab((ab_t){40.0f, 50.0f}, st.ended_V);
}

/* Sensors up to the blend frequency, the duty from twice that on, a straight line between. */
static void test_the_blend_goes_from_the_sensors_to_the_duty(void)
{
    const float speeds[] = {0.0f, 0.999f, 1.25f, -1.5f, 1.75f, 2.0f, -5.0f};
    const float shares[] = {0.0f, 0.0f, 0.25f, 0.5f, 0.75f, 1.0f, 1.0f};
    configure(ACTING_VOLTAGE_BLEND);
    cfg.filter_comp_s = 0.0f;
    for (int n = 0; n < 7; n++) {
        acting_voltage_angle(&cfg, &st, speeds[n] * BLEND_RAD_S);
        st.acting_V = (ab_t){20.0f, -40.0f};
        const ab_t u_s_V = acting_voltage_step(&cfg, &st, (ab_t){100.0f, 0.0f});
        ASSERT_NEAR(1e-4, 100.0f - 80.0f * shares[n], u_s_V.alpha);
        ASSERT_NEAR(1e-4, -40.0f * shares[n], u_s_V.beta);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_an_unknown_source_and_a_senseless_delay);
    RUN_TEST(test_the_duties_of_two_periods_ago_have_acted);
    RUN_TEST(test_the_duty_source_asks_no_sensor);
    RUN_TEST(test_the_sensed_voltage_is_turned_ahead_by_the_filters_angle);
    RUN_TEST(test_a_wild_speed_turns_by_an_eighth_of_a_turn_at_most);
    RUN_TEST(test_a_zeroed_state_turns_nothing);
    RUN_TEST(test_the_angle_holds_from_one_setting_to_the_next);
    RUN_TEST(test_the_blend_goes_from_the_sensors_to_the_duty);
    return UNITY_END();
}
