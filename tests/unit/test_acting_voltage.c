/* The voltage of the interval that ended: from the sensors and what they are late by, or from the
 * duties of two periods ago. */
#include "acting_voltage.h"

#include <complex.h>
#include <math.h>

#include "exact.h"

#define FILTER_S    300e-6f
#define PERIOD_S    200e-6f
#define BLEND_RAD_S 30.0f

static acting_voltage_config_t cfg;
static acting_voltage_state_t st;

static bool init(acting_voltage_source_t source, float filter_comp_s, float blend_rad_s)
{
    const acting_voltage_params_t params = {.source = source,
                                            .filter_comp_s = filter_comp_s,
                                            .period_s = PERIOD_S,
                                            .blend_rad_s = blend_rad_s};
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
    const acting_voltage_params_t params = {.blend_rad_s = BLEND_RAD_S};
    TEST_ASSERT_FALSE(acting_voltage_init(&cfg, &params));
}

/* Duties of step k act from t_(k+1) on: they are the ended interval of step k + 2. */
static void test_the_duties_of_two_periods_ago_have_acted(void)
{
    const acting_voltage_source_t sources[] = {ACTING_VOLTAGE_SENSORS, ACTING_VOLTAGE_DUTY};
    for (int n = 0; n < 2; n++) {
        configure(sources[n]);
        TEST_ASSERT_TRUE(init(sources[n], 0.0f, BLEND_RAD_S)); /* sensors that are not late */
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
        acting_voltage_blend(&cfg, &next, not_finite(k));
        const ab_t u_s_V = acting_voltage_step(&cfg, &next, (ab_t){not_finite(k), 1.0f});
        assert_same_ab((ab_t){3.0f, -4.0f}, u_s_V);
        assert_same_ab((ab_t){5.0f, 6.0f}, next.acting_V);
    }
}

/* Sensors behind the same filter, whatever the duties do, against double precision: the voltage of
 * the duties less what the inverter loses of it, in time. */
static void test_what_the_sensors_do_not_show_yet_comes_from_the_duty(void)
{
    const double d = (double)FILTER_S / (double)PERIOD_S;
    const double complex lost_V = 3.0 - 2.0 * I;
    double complex shown_V = -lost_V;
    double complex step_V = 0.0;
    for (int k = 0; k < 200; k++) {
        const float swing = (k % 7 < 3) ? 150.0f : -90.0f;
        st.acting_V = (ab_t){swing * (float)cos(0.3 * k), swing * (float)sin(0.5 * k)};
        const double complex ended_V = (double)st.acting_V.alpha + I * (double)st.acting_V.beta;
        step_V =
            d / (2.0 + d) * step_V + 2.0 / ((1.0 + d) * (2.0 + d)) * (ended_V - lost_V - shown_V);
        shown_V += step_V;
        const ab_t line_V = {(float)creal(shown_V), (float)cimag(shown_V)};
        const ab_t u_s_V = acting_voltage_step(&cfg, &st, line_V);
        ASSERT_NEAR(2e-4, creal(ended_V - lost_V), u_s_V.alpha);
        ASSERT_NEAR(2e-4, cimag(ended_V - lost_V), u_s_V.beta);
    }
}

/* In steady state that turns the reading of an 800 Hz filter ahead by w_s times its delay from the
 * middle of the interval, in either direction, and changes nothing of its size: 50 Hz. */
static void test_a_rotating_voltage_is_turned_ahead_by_the_delay(void)
{
    const double speeds[] = {314.0, -314.0};
    const double cutoff_rad_s = 2.0 * 3.14159265 * 800.0;
    for (int n = 0; n < 2; n++) {
        const double complex s = I * speeds[n] / cutoff_rad_s;
        const double complex middle = cexp(I * speeds[n] * 0.5 * (double)PERIOD_S);
        const double complex shown = middle / (1.0 + sqrt(2.0) * s + s * s);
        const double delay_s = sqrt(2.0) / cutoff_rad_s - 0.5 * (double)PERIOD_S;
        TEST_ASSERT_TRUE(init(ACTING_VOLTAGE_SENSORS, (float)delay_s, BLEND_RAD_S));
        st = (acting_voltage_state_t){0};
        ab_t u_s_V = {0.0f, 0.0f};
        double complex shown_V = 0.0;
        for (int k = 0; k < 100; k++) {
            const double complex ended_V = 100.0 * cexp(I * speeds[n] * (double)PERIOD_S * k);
            shown_V = ended_V * shown;
            st.acting_V = (ab_t){(float)creal(ended_V), (float)cimag(ended_V)};
            u_s_V = acting_voltage_step(&cfg, &st,
                                        (ab_t){(float)creal(shown_V), (float)cimag(shown_V)});
        }
        const double complex found = ((double)u_s_V.alpha + I * (double)u_s_V.beta) / shown_V;
        ASSERT_NEAR(3e-4, speeds[n] * delay_s, carg(found));
        ASSERT_NEAR(3e-4, 1.0, cabs(found));
    }
}

/* Duties that stand: what is sensed passes bit for bit. */
static void test_a_voltage_that_stands_passes(void)
{
    const ab_t u_V = {123.456f, -0.789f};
    assert_same_ab(u_V, acting_voltage_step(&cfg, &st, u_V));
    st = (acting_voltage_state_t){.acting_V = {40.0f, 50.0f}, .lagging_V = {40.0f, 50.0f}};
    assert_same_ab(u_V, acting_voltage_step(&cfg, &st, u_V));
    assert_same_ab((ab_t){40.0f, 50.0f}, st.lagging_V);
}

/* Sensors up to the blend frequency, the duty from twice that on, a straight line between. */
static void test_the_blend_goes_from_the_sensors_to_the_duty(void)
{
    const float speeds[] = {0.0f, 0.999f, 1.25f, -1.5f, 1.75f, 2.0f, -5.0f};
    const float shares[] = {0.0f, 0.0f, 0.25f, 0.5f, 0.75f, 1.0f, 1.0f};
    configure(ACTING_VOLTAGE_BLEND);
    TEST_ASSERT_TRUE(init(ACTING_VOLTAGE_BLEND, 0.0f, BLEND_RAD_S));
    for (int n = 0; n < 7; n++) {
        acting_voltage_blend(&cfg, &st, speeds[n] * BLEND_RAD_S);
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
    RUN_TEST(test_what_the_sensors_do_not_show_yet_comes_from_the_duty);
    RUN_TEST(test_a_rotating_voltage_is_turned_ahead_by_the_delay);
    RUN_TEST(test_a_voltage_that_stands_passes);
    RUN_TEST(test_the_blend_goes_from_the_sensors_to_the_duty);
    return UNITY_END();
}
