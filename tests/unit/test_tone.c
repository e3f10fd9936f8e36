/* One frequency out of two signals: against the exact discrete answer of a winding, and free of
 * everything that is not at that frequency. */
#include "tone.h"

#include <complex.h>
#include <math.h>

#include "exact.h"
#include "unity.h"

#define PERIOD_S 0.0002f
#define PI       3.14159265358979323846

static tone_config_t cfg;
static tone_state_t st;

void setUp(void)
{
    st = (tone_state_t){0};
    TEST_ASSERT_TRUE(tone_init(&cfg, 312.5f, 2u, 10u, PERIOD_S));
}

void tearDown(void)
{
}

static void test_init_counts_whole_turns(void)
{
    TEST_ASSERT_EQUAL_UINT32(16u, cfg.turn_periods);
    TEST_ASSERT_EQUAL_UINT32(32u, cfg.quiet_periods);
    TEST_ASSERT_EQUAL_UINT32(192u, cfg.periods);
    ASSERT_NEAR(1e-6, cos(PI / 8.0), cfg.turn.alpha);
    ASSERT_NEAR(1e-6, sin(PI / 8.0), cfg.turn.beta);
    ASSERT_NEAR(1e-2, 2.0 / 0.0002 * tan(PI / 16.0), cfg.omega_rad_s);
}

static void test_init_refuses_what_is_no_tone(void)
{
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        TEST_ASSERT_FALSE(tone_init(&cfg, not_positive(k), 1u, 1u, PERIOD_S));
        TEST_ASSERT_FALSE(tone_init(&cfg, 100.0f, 1u, 1u, not_positive(k)));
    }
    TEST_ASSERT_FALSE(tone_init(&cfg, 100.0f, 1u, 0u, PERIOD_S));
    TEST_ASSERT_TRUE(tone_init(&cfg, 0.125f, 0u, 4u, 1.0f));
    TEST_ASSERT_FALSE(tone_init(&cfg, 0.126f, 0u, 4u, 1.0f));      /* 7.9 periods */
    TEST_ASSERT_FALSE(tone_init(&cfg, 0.0049f, 0u, 1u, PERIOD_S)); /* more than a million */
}

/* u and i at the tone, a constant and a harmonic beside them; true after so many steps. */
static int run(double complex z_ohm, double constant, double harmonic)
{
    for (int k = 0; k < 1000; k++) {
        const double angle = 2.0 * PI * k / 16.0;
        const double other = constant + harmonic * sin(3.0 * angle + 1.0);
        const double complex unit = cos(angle) + I * sin(angle);
        const float i_A = (float)(0.5 * creal(unit) + 2.0 * other);
        const float u_V = (float)(creal(0.5 * z_ohm * unit) - 7.0 * other);
        if (tone_step(&cfg, &st, i_A, u_V)) {
            return k + 1;
        }
    }
    return 0;
}

static void test_impedance_is_what_relates_them(void)
{
    TEST_ASSERT_EQUAL_INT(192, run(1.5 + 16.0 * I, 0.0, 0.0));
    ASSERT_NEAR(1e-4, 1.5, tone_impedance_ohm(&st).alpha);
    ASSERT_NEAR(1e-4, 16.0, tone_impedance_ohm(&st).beta);
}

static void test_constants_and_harmonics_drop_out(void)
{
    (void)run(0.7 - 2.0 * I, 3.0, 1.0);
    ASSERT_NEAR(1e-3, 0.7, tone_impedance_ohm(&st).alpha);
    ASSERT_NEAR(1e-3, -2.0, tone_impedance_ohm(&st).beta);
}

static void test_a_winding_shows_its_inductance_exactly(void)
{
    /* L di/dt = u, u constant over a period: i(k) = i(k-1) + u T/L; the mean of both ends. */
    double i = 0.0;
    for (int k = 0; k < 192; k++) {
        const double u = 10.0 * cos(2.0 * PI * k / 16.0);
        const double before = i;
        i += u * 0.0002 / 0.008;
        (void)tone_step(&cfg, &st, (float)(0.5 * (before + i)), (float)u);
    }
    ASSERT_NEAR(1e-6, 0.008, tone_impedance_ohm(&st).beta / cfg.omega_rad_s);
    ASSERT_NEAR(1e-4, 0.0, tone_impedance_ohm(&st).alpha);
}

static void test_quiet_turns_are_not_summed(void)
{
    for (int k = 0; k < 32; k++) {
        TEST_ASSERT_FALSE(tone_step(&cfg, &st, 100.0f, -100.0f));
    }
    ASSERT_SAME_FLOAT(0.0f, st.i_A.alpha);
    ASSERT_SAME_FLOAT(0.0f, st.u_V.alpha);
    (void)tone_step(&cfg, &st, 2.0f, 3.0f);
    ASSERT_NEAR(1e-5, 2.0, st.i_A.alpha);
    ASSERT_NEAR(1e-5, 3.0, st.u_V.alpha);
}

static void test_no_current_is_no_impedance(void)
{
    for (int k = 0; k < 192; k++) {
        (void)tone_step(&cfg, &st, 0.0f, 1.0f);
    }
    ASSERT_SAME_FLOAT(0.0f, tone_impedance_ohm(&st).alpha);
    ASSERT_SAME_FLOAT(0.0f, tone_impedance_ohm(&st).beta);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_counts_whole_turns);
    RUN_TEST(test_init_refuses_what_is_no_tone);
    RUN_TEST(test_impedance_is_what_relates_them);
    RUN_TEST(test_constants_and_harmonics_drop_out);
    RUN_TEST(test_a_winding_shows_its_inductance_exactly);
    RUN_TEST(test_quiet_turns_are_not_summed);
    RUN_TEST(test_no_current_is_no_impedance);
    return UNITY_END();
}
