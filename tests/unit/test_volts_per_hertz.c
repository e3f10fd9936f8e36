/* The voltage vector alone: length by speed, turns at the wanted speed, waits for the current. */
#include "volts_per_hertz.h"

#include <complex.h>
#include <math.h>

#include "exact.h"
#include "unity.h"

static const volts_per_hertz_params_t good = {
    .psi_Wb = 0.5f, .boost_V = 6.0f, .slew_rad_s2 = 100.0f, .i_max_A = 15.0f};

static volts_per_hertz_config_t cfg;
static volts_per_hertz_state_t st;
static const ab_t no_A = {0.0f, 0.0f};

void setUp(void)
{
    TEST_ASSERT_TRUE(volts_per_hertz_init(&cfg, &good, 0.0002f));
    st = (volts_per_hertz_state_t){0};
}

void tearDown(void)
{
}

static double complex of(ab_t x)
{
    return (double)x.alpha + I * (double)x.beta;
}

static void test_init_refuses_each_bad_number(void)
{
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        volts_per_hertz_params_t p = good;
        p.psi_Wb = not_positive(k);
        TEST_ASSERT_FALSE(volts_per_hertz_init(&cfg, &p, 0.0002f));
        p = good;
        p.slew_rad_s2 = not_positive(k);
        TEST_ASSERT_FALSE(volts_per_hertz_init(&cfg, &p, 0.0002f));
        p = good;
        p.i_max_A = not_positive(k);
        TEST_ASSERT_FALSE(volts_per_hertz_init(&cfg, &p, 0.0002f));
        TEST_ASSERT_FALSE(volts_per_hertz_init(&cfg, &good, not_positive(k)));
    }
    volts_per_hertz_params_t p = good;
    p.boost_V = -1.0f;
    TEST_ASSERT_FALSE(volts_per_hertz_init(&cfg, &p, 0.0002f));
    p.boost_V = 0.0f;
    TEST_ASSERT_TRUE(volts_per_hertz_init(&cfg, &p, 0.0002f));
}

static void test_the_boost_comes_up_along_alpha(void)
{
    ab_t u_V = no_A;
    for (int k = 0; k < 500; k++) {
        u_V = volts_per_hertz_step(&cfg, &st, 0.0f, no_A, 283.0f);
    }
    ASSERT_NEAR(0.01, 3.0, u_V.alpha); /* half of .2 s */
    for (int k = 0; k < 1000; k++) {
        u_V = volts_per_hertz_step(&cfg, &st, 0.0f, no_A, 283.0f);
    }
    ASSERT_NEAR(1e-4, 6.0, u_V.alpha);
    ASSERT_NEAR(1e-6, 0.0, u_V.beta);
}

/* Angle and length after minutes: nothing drifts. */
static void test_turns_at_the_wanted_speed_with_the_voltage_of_the_flux(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        setUp();
        ab_t u_V = no_A;
        for (int k = 0; k < 100000; k++) {
            u_V = volts_per_hertz_step(&cfg, &st, (float)sign * 100.0f, no_A, 283.0f);
        }
        const ab_t next_V = volts_per_hertz_step(&cfg, &st, (float)sign * 100.0f, no_A, 283.0f);
        ASSERT_NEAR(0.01, 56.0, cabs(of(u_V)));
        ASSERT_NEAR(1e-5, sign * 0.02, carg(of(next_V) / of(u_V)));
    }
}

static void test_slews_and_stops_at_the_dc_link(void)
{
    (void)volts_per_hertz_step(&cfg, &st, 700.0f, no_A, 283.0f);
    ASSERT_NEAR(1e-6, 0.02, st.omega_rad_s);
    st.omega_rad_s = 700.0f;
    st.boost_V = 6.0f;
    ASSERT_NEAR(0.02, 283.0 / sqrt(2.0),
                cabs(of(volts_per_hertz_step(&cfg, &st, 700.0f, no_A, 283.0f))));
    ASSERT_NEAR(1e-6, 0.0, cabs(of(volts_per_hertz_step(&cfg, &st, 700.0f, no_A, -1.0f))));
}

/* Beyond the current limit only towards standstill. */
static void test_waits_while_the_current_is_beyond_its_limit(void)
{
    const ab_t much_A = {12.0f, 12.0f};
    st.omega_rad_s = 100.0f;
    (void)volts_per_hertz_step(&cfg, &st, 200.0f, much_A, 283.0f);
    ASSERT_SAME_FLOAT(100.0f, st.omega_rad_s);
    (void)volts_per_hertz_step(&cfg, &st, 200.0f, no_A, 283.0f);
    TEST_ASSERT_TRUE(st.omega_rad_s > 100.0f);
    (void)volts_per_hertz_step(&cfg, &st, 0.0f, much_A, 283.0f);
    ASSERT_SAME_FLOAT(100.0f, st.omega_rad_s);
    st.omega_rad_s = -100.0f;
    (void)volts_per_hertz_step(&cfg, &st, -200.0f, much_A, 283.0f);
    ASSERT_SAME_FLOAT(-100.0f, st.omega_rad_s);
    /* From standstill either way is none. */
    st.omega_rad_s = 0.0f;
    (void)volts_per_hertz_step(&cfg, &st, 200.0f, much_A, 283.0f);
    TEST_ASSERT_TRUE(st.omega_rad_s > 0.0f);
}

static void test_a_reference_that_is_no_number_moves_nothing(void)
{
    st.omega_rad_s = 100.0f;
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        (void)volts_per_hertz_step(&cfg, &st, not_finite(k), no_A, 283.0f);
        ASSERT_SAME_FLOAT(100.0f, st.omega_rad_s);
    }
}

/* A quarter turn ahead of the flux, whichever way that turns, with all the boost. */
static void test_start_goes_on_with_a_motor_that_turns(void)
{
    const float speeds[] = {200.0f, -200.0f};
    for (int n = 0; n < 2; n++) {
        volts_per_hertz_start(&cfg, &st, (ab_t){0.3f, 0.4f}, speeds[n]);
        ASSERT_SAME_FLOAT(speeds[n], st.omega_rad_s);
        const double complex u_V = of(volts_per_hertz_step(&cfg, &st, speeds[n], no_A, 283.0f));
        const double complex turn = I * copysign(1.0, (double)speeds[n]);
        const double complex expected = turn * (0.6 + 0.8 * I) * cexp(I * (double)speeds[n] * 2e-4);
        ASSERT_NEAR(1e-5, 0.0, cabs(u_V / cabs(u_V) - expected));
        ASSERT_NEAR(1e-3, (double)cfg.boost_V + (double)cfg.psi_Wb * 200.0, cabs(u_V));
    }
}

static void test_start_without_flux_or_speed_is_from_rest(void)
{
    const ab_t fluxes_Wb[] = {{0.0f, 0.0f}, {NAN, 0.3f}, {0.3f, 0.4f}};
    const float speeds[] = {200.0f, 200.0f, NAN};
    for (int n = 0; n < 3; n++) {
        volts_per_hertz_start(&cfg, &st, fluxes_Wb[n], speeds[n]);
        ASSERT_SAME_FLOAT(0.0f, st.omega_rad_s);
        ASSERT_SAME_FLOAT(0.0f, st.off_axis.beta);
        ASSERT_SAME_FLOAT(0.0f, st.boost_V);
    }
}

static void test_a_start_that_knows_nothing_begins_at_rest(void)
{
    st = (volts_per_hertz_state_t){.omega_rad_s = 5.0f, .boost_V = 3.0f, .off_axis = {1.0f, 1.0f}};
    volts_per_hertz_start(&cfg, &st, (ab_t){0.0f, 0.0f}, 100.0f);
    ASSERT_SAME_FLOAT(0.0f, st.omega_rad_s);
    ASSERT_SAME_FLOAT(0.0f, st.boost_V);
    ASSERT_SAME_FLOAT(0.0f, st.off_axis.beta);
}

static void test_too_much_current_never_keeps_it_from_slowing_down(void)
{
    st.omega_rad_s = 1.0f;
    (void)volts_per_hertz_step(&cfg, &st, 0.0f, (ab_t){100.0f, 0.0f}, 283.0f);
    ASSERT_NEAR(1e-6, 0.98, st.omega_rad_s);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_each_bad_number);
    RUN_TEST(test_the_boost_comes_up_along_alpha);
    RUN_TEST(test_turns_at_the_wanted_speed_with_the_voltage_of_the_flux);
    RUN_TEST(test_slews_and_stops_at_the_dc_link);
    RUN_TEST(test_waits_while_the_current_is_beyond_its_limit);
    RUN_TEST(test_a_reference_that_is_no_number_moves_nothing);
    RUN_TEST(test_start_goes_on_with_a_motor_that_turns);
    RUN_TEST(test_start_without_flux_or_speed_is_from_rest);
    RUN_TEST(test_a_start_that_knows_nothing_begins_at_rest);
    RUN_TEST(test_too_much_current_never_keeps_it_from_slowing_down);
    return UNITY_END();
}
