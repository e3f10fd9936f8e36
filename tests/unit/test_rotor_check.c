/* The EMF of a rotor that follows, slips or is gone, against the equations in double precision. */
#include "rotor_check.h"

#include <complex.h>
#include <math.h>

#include "exact.h"
#include "reference_machine.h"
#include "unity.h"

#define STEP_S  3.2e-3f
#define COUNT_V 0.02f
#define LOOKS   200 /* six times the time of the mean */

static rotor_check_config_t cfg;
static rotor_check_state_t st;
static motor_model_t motor;

static void use(motor_t data)
{
    TEST_ASSERT_TRUE(motor_derive(&motor, &data));
    rotor_check_init(&cfg, &motor, 0.45f, COUNT_V, STEP_S);
    st = (rotor_check_state_t){0};
}

void setUp(void)
{
    use(reference_machine[1]);
}

void tearDown(void)
{
}

/* Steady state of a current turned at omega_s, the rotor behind by x of 1/Tr. */
static rotor_check_in_t turned(double omega_s_rad_s, double x, double i_A, double angle_rad)
{
    const double complex i = i_A * cexp(I * angle_rad);
    const double complex lambda = (double)motor.M_H * i / (1.0 + I * x);
    const double complex e =
        I * omega_s_rad_s * ((double)motor.sigma_Ls_H * i + (double)motor.kr * lambda);
    const double complex u = (double)motor.Rs_ohm * i + e;
    return (rotor_check_in_t){.omega_s_rad_s = (float)omega_s_rad_s,
                              .u_V = {(float)creal(u), (float)cimag(u)},
                              .i_A = {(float)creal(i), (float)cimag(i)},
                              .Rs_ohm = motor.Rs_ohm};
}

static rotor_check_t after_looks(rotor_check_in_t in)
{
    rotor_check_t last = ROTOR_NOT_SEEN;
    for (int k = 0; k < LOOKS; k++) {
        last = rotor_check_step(&cfg, &st, &in);
    }
    return last;
}

/* Where the EMF of the flux is as large as Rs i, times a quarter and two. */
static void test_frequencies_from_which_the_emf_tells(void)
{
    for (int k = 0; k < REFERENCE_MACHINES; k++) {
        use(reference_machine[k]);
        const float even_rad_s = motor.Rs_ohm / (motor.kr * motor.M_H);
        TEST_ASSERT_FLOAT_WITHIN(1e-4f * even_rad_s, 0.25f * even_rad_s, cfg.current_rad_s);
        TEST_ASSERT_FLOAT_WITHIN(1e-3f * even_rad_s, 2.0f * even_rad_s, cfg.voltage_rad_s);
    }
}

/* With next to no resistance the EMF tells below 1 rad/s, in either direction. */
static void test_a_slow_rotor_of_a_large_motor_follows(void)
{
    motor_t large = reference_machine[1];
    large.Rs_ohm *= 0.02f;
    use(large);
    TEST_ASSERT_TRUE(cfg.current_rad_s < 0.5f);
    TEST_ASSERT_EQUAL(ROTOR_FOLLOWS, after_looks(turned(0.5, 0.3, 10.0, 0.4)));
    use(large);
    TEST_ASSERT_EQUAL(ROTOR_FOLLOWS, after_looks(turned(-0.5, -0.3, 10.0, 0.4)));
}

static void test_a_rotor_within_its_pull_out_follows_and_one_far_beyond_does_not(void)
{
    static const double frequency_rad_s[] = {-300.0, -12.0, 12.0, 300.0};
    for (size_t k = 0u; k < 4u * REFERENCE_MACHINES; k++) {
        const motor_t machine = reference_machine[k / 4u];
        const double omega_rad_s = frequency_rad_s[k % 4u];
        for (double x = -1.25; x <= 1.25; x += 0.25) {
            use(machine);
            TEST_ASSERT_EQUAL(ROTOR_FOLLOWS, after_looks(turned(omega_rad_s, x, 9.0, 0.3 + x)));
        }
        for (double x = 1.38; x <= 50.0; x *= 1.5) {
            use(machine);
            TEST_ASSERT_EQUAL(ROTOR_LOST, after_looks(turned(omega_rad_s, x, 9.0, 1.0)));
            use(machine);
            TEST_ASSERT_EQUAL(ROTOR_LOST, after_looks(turned(omega_rad_s, -x, 15.0, 1.0)));
        }
    }
}

/* 40 A on a motor whose M is then next to nothing, with so much flux along them. */
static rotor_check_in_t saturated(double along_Wb, double x)
{
    const double i_A = 40.0;
    const motor_model_t linear = motor;
    motor.M_H = (float)(along_Wb * (1.0 + x * x) / i_A);
    const rotor_check_in_t in = turned(12.0, x, i_A, 0.7);
    motor = linear;
    return in;
}

/* Half of the .45 Wb of V/f is enough, as M i is several times that; half a percent of it less is
 * not, nor is a rotor that lags. */
static void test_a_rotor_that_a_long_current_saturates_follows(void)
{
    const struct {
        double along_pu, x;
        rotor_check_t found;
    } of[] = {{0.503, 0.0, ROTOR_FOLLOWS},   {0.503, 1.35, ROTOR_FOLLOWS},
              {0.503, -1.35, ROTOR_FOLLOWS}, {0.497, 0.0, ROTOR_LOST},
              {0.8, 1.37, ROTOR_LOST},       {0.8, -1.37, ROTOR_LOST}};
    for (size_t k = 0u; k < REFERENCE_MACHINES * sizeof of / sizeof of[0]; k++) {
        const size_t n = k / REFERENCE_MACHINES;
        use(reference_machine[k % REFERENCE_MACHINES]);
        TEST_ASSERT_TRUE(0.35f * motor.M_H * 40.0f > 0.8f * 0.45f);
        TEST_ASSERT_EQUAL(of[n].found, after_looks(saturated(of[n].along_pu * 0.45, of[n].x)));
    }
}

/* Rs and dead time are in phase with the current; neither makes a lost rotor of one that follows.
 */
static void test_a_wrong_resistance_does_not_matter_to_a_current_vector(void)
{
    rotor_check_in_t in = turned(12.0, 0.8, 9.0, 0.5);
    in.Rs_ohm *= 1.5f;
    TEST_ASSERT_EQUAL(ROTOR_FOLLOWS, after_looks(in));
    setUp();
    in = turned(12.0, 5.0, 9.0, 0.5);
    in.Rs_ohm *= 0.5f;
    TEST_ASSERT_EQUAL(ROTOR_LOST, after_looks(in));
}

/* The price of the saturated motor: without saturation, at the lowest frequency and three and a
 * half times the magnetising current, 4 % too much of Rs hide a lag of 2.4. At ten times that
 * frequency they do not. */
static void test_a_wrong_resistance_may_hide_a_lag_where_the_emf_is_least(void)
{
    for (int n = 0; n < 2; n++) {
        setUp();
        const double omega_rad_s = ((n == 0) ? 1.01 : 10.0) * (double)cfg.current_rad_s;
        const double i_A = 3.5 * 0.45 / (double)motor.M_H;
        rotor_check_in_t in = turned(omega_rad_s, 2.4, i_A, 0.5);
        TEST_ASSERT_EQUAL(ROTOR_LOST, after_looks(in));
        setUp();
        in.Rs_ohm *= 1.04f;
        TEST_ASSERT_EQUAL((n == 0) ? ROTOR_FOLLOWS : ROTOR_LOST, after_looks(in));
    }
}

static void test_too_slow_to_tell(void)
{
    const float least_rad_s = 0.25f * motor.Rs_ohm / (motor.kr * motor.M_H);
    TEST_ASSERT_EQUAL_FLOAT(least_rad_s, cfg.current_rad_s);
    TEST_ASSERT_EQUAL(ROTOR_NOT_SEEN, after_looks(turned(0.99 * (double)least_rad_s, 0, 9, 0)));
    TEST_ASSERT_EQUAL(ROTOR_FOLLOWS, after_looks(turned(1.01 * (double)least_rad_s, 0, 9, 0)));
    rotor_check_in_t in = turned(7.9 * (double)least_rad_s, 0.0, 4.5, 0.0);
    in.voltage = true;
    TEST_ASSERT_EQUAL(ROTOR_NOT_SEEN, after_looks(in));
    in.omega_s_rad_s = NAN;
    TEST_ASSERT_EQUAL(ROTOR_NOT_SEEN, after_looks(in));
}

/* V/f: nominal flux of .45 Wb may take a large slip; at half of it the rotor is gone. */
static void test_the_flux_of_a_voltage_vector_collapses(void)
{
    const double i_for_flux_A = 0.45 / (double)motor.M_H;
    rotor_check_in_t in = turned(100.0, 0.0, i_for_flux_A, 0.0);
    in.voltage = true;
    TEST_ASSERT_EQUAL(ROTOR_FOLLOWS, after_looks(in));
    const double x = 3.0;
    setUp();
    in = turned(100.0, x, 0.55 * i_for_flux_A * sqrt(1.0 + x * x), 0.0);
    in.voltage = true;
    TEST_ASSERT_EQUAL(ROTOR_FOLLOWS, after_looks(in));
    setUp();
    in = turned(-100.0, x, 0.45 * i_for_flux_A * sqrt(1.0 + x * x), 0.0);
    in.voltage = true;
    TEST_ASSERT_EQUAL(ROTOR_LOST, after_looks(in));
}

static void test_no_number_is_lost(void)
{
    rotor_check_in_t in = turned(100.0, 0.0, 9.0, 0.0);
    in.u_V.alpha = NAN;
    TEST_ASSERT_EQUAL(ROTOR_LOST, rotor_check_step(&cfg, &st, &in));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.power_VA.alpha);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.power_VA.beta);
    in.voltage = true;
    TEST_ASSERT_EQUAL(ROTOR_LOST, rotor_check_step(&cfg, &st, &in));
    in = turned(100.0, 0.0, 9.0, 0.0); /* and none is remembered */
    TEST_ASSERT_EQUAL(ROTOR_FOLLOWS, after_looks(in));
}

/* The mean is first order: after its time constant 1 - 1/e of the value. */
static void test_one_look_against_complex_arithmetic(void)
{
    const rotor_check_in_t in = turned(50.0, 0.7, 9.0, 0.4);
    (void)rotor_check_step(&cfg, &st, &in);
    const double share = (double)STEP_S / ((double)STEP_S + 0.1);
    const double base = 50.0 * (double)motor.kr * (double)motor.M_H * 81.0 / (1.0 + 0.49);
    TEST_ASSERT_FLOAT_WITHIN(2e-4f * (float)base, (float)(share * base * 0.7), st.power_VA.alpha);
    TEST_ASSERT_FLOAT_WITHIN(2e-4f * (float)base, (float)(share * base), st.power_VA.beta);
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, (float)(share * 81.0), st.i2_A2);
}

static bool turns_after(double omega_rad_s, double amplitude_V, int looks)
{
    bool turns = false;
    for (int k = 0; k < looks; k++) {
        const double t_s = k * (double)STEP_S;
        const double e_V = amplitude_V * exp(-5.0 * t_s) * sin(omega_rad_s * t_s);
        rotor_check_in_t in = {.u_V = {8.0f, (float)e_V + 0.2f * motor.Rs_ohm},
                               .i_A = {8.0f, 0.2f},
                               .Rs_ohm = motor.Rs_ohm};
        turns = rotor_turns(&cfg, &st, &in) || turns;
    }
    return turns;
}

static void test_a_shaft_that_turns_at_a_start_is_seen_and_one_at_rest_is_not(void)
{
    const double built_V = 10.0 * (double)cfg.start_V; /* what begins to build flux up */
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 0.1f * motor.kr * 0.45f * motor.tau_per_s, cfg.start_V);
    for (double omega = 15.0; omega < 500.0; omega *= 1.3) {
        setUp();
        TEST_ASSERT_TRUE(turns_after(omega, built_V, 200));
        setUp();
        TEST_ASSERT_TRUE(turns_after(-omega, built_V, 200));
    }
    setUp();
    TEST_ASSERT_FALSE(turns_after(0.0, built_V, 500));
    setUp();
    TEST_ASSERT_FALSE(turns_after(100.0, 0.9 * (double)cfg.start_V, 500)); /* noise */
}

/* A large motor builds up its flux with little EMF: a coarse ADC's steps hide the smallest part. */
static void test_the_steps_of_a_coarse_adc_are_no_turning_shaft(void)
{
    rotor_check_init(&cfg, &motor, 0.45f, 10.0f, STEP_S);
    TEST_ASSERT_EQUAL_FLOAT(15.0f, cfg.start_V);
    for (int k = 0; k < 500; k++) {
        const float e_V = ((k % 5) < 2) ? 10.0f : (((k % 5) < 4) ? -10.0f : 0.0f);
        const rotor_check_in_t in = {.u_V = {8.0f, e_V}, .Rs_ohm = motor.Rs_ohm};
        TEST_ASSERT_FALSE(rotor_turns(&cfg, &st, &in));
    }
}

/* What moves the shaft half a second later is the load. */
static void test_a_start_is_looked_at_for_half_a_second(void)
{
    TEST_ASSERT_FALSE(turns_after(0.0, 0.0, (int)cfg.start_looks));
    TEST_ASSERT_FLOAT_WITHIN(STEP_S, 0.5f, (float)cfg.start_looks * STEP_S);
    TEST_ASSERT_FALSE(turns_after(50.0, 10.0 * (double)cfg.start_V, 200));
}

static void test_residual_flux_of_a_rotor_at_rest_is_no_turning_one(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        setUp();
        for (int k = 0; k < 500; k++) {
            const float e_V = (float)sign * 2.0f * expf(-5.0f * (float)k * STEP_S);
            const rotor_check_in_t in = {.u_V = {8.0f, e_V}, .Rs_ohm = motor.Rs_ohm};
            TEST_ASSERT_FALSE(rotor_turns(&cfg, &st, &in));
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_frequencies_from_which_the_emf_tells);
    RUN_TEST(test_a_slow_rotor_of_a_large_motor_follows);
    RUN_TEST(test_a_rotor_within_its_pull_out_follows_and_one_far_beyond_does_not);
    RUN_TEST(test_a_rotor_that_a_long_current_saturates_follows);
    RUN_TEST(test_a_wrong_resistance_does_not_matter_to_a_current_vector);
    RUN_TEST(test_a_wrong_resistance_may_hide_a_lag_where_the_emf_is_least);
    RUN_TEST(test_too_slow_to_tell);
    RUN_TEST(test_the_flux_of_a_voltage_vector_collapses);
    RUN_TEST(test_no_number_is_lost);
    RUN_TEST(test_one_look_against_complex_arithmetic);
    RUN_TEST(test_a_shaft_that_turns_at_a_start_is_seen_and_one_at_rest_is_not);
    RUN_TEST(test_the_steps_of_a_coarse_adc_are_no_turning_shaft);
    RUN_TEST(test_a_start_is_looked_at_for_half_a_second);
    RUN_TEST(test_residual_flux_of_a_rotor_at_rest_is_no_turning_one);
    return UNITY_END();
}
