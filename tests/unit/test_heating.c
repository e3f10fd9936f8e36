/* Two bodies against their equations, and the slip of a rotor that is warmer than the observer's.
 */
#include "heating.h"

#include <math.h>

#include "exact.h"
#include "unity.h"

static const heating_params_t good = {
    .winding_pu = 0.5f, .rated_A = 5.0f, .i_d_A = 3.0f, .tau_s = 8.0f};

/* Short binary fractions: expected results are exact. */
static const heating_config_t simple = {
    .fade = 0.0625f, .winding_per_A2 = 0.125f, .rotor_per_A2 = 0.03125f, .slip_gain = 0.25f};

static heating_config_t cfg;
static heating_state_t st;

void setUp(void)
{
    cfg = simple;
    st = (heating_state_t){0};
}

void tearDown(void)
{
}

static void test_without_a_rise_nothing_is_looked_at(void)
{
    const heating_params_t off = {.tau_s = -1.0f};
    TEST_ASSERT_TRUE(heating_init(&cfg, &off, 0.5f));
    TEST_ASSERT_FALSE(heating_on(&cfg));
    ASSERT_NEAR(1e-7, 0.5 / 0.8, cfg.slip_gain);
}

/* Off, but the start found a rotor of 1.25 of the parameter: only the slip follows. */
static void test_without_a_rise_what_the_start_found_makes_the_slip(void)
{
    const heating_params_t off = {0};
    TEST_ASSERT_TRUE(heating_init(&cfg, &off, 0.1f));
    const heating_in_t in = {
        .i2_A2 = 16.0f, .i_q_A = 3.0f, .Rs_ohm = 1.0f, .slip_rad_s = 8.0f, .Rr_extra_pu = 0.25f};
    ASSERT_SAME_FLOAT(0.0f, heating_step(&cfg, &st, &in));
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 0.5f, st.slip_rad_s); /* a quarter of .25 * 8 */
    for (int k = 0; k < 100; k++) {
        ASSERT_SAME_FLOAT(0.0f, heating_step(&cfg, &st, &in));
    }
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 2.0f, st.slip_rad_s);
    ASSERT_SAME_FLOAT(0.0f, st.rotor_pu);
}

static void test_init_derives_its_coefficients(void)
{
    TEST_ASSERT_TRUE(heating_init(&cfg, &good, 0.5f));
    TEST_ASSERT_TRUE(heating_on(&cfg));
    ASSERT_SAME_FLOAT(0.0625f, cfg.fade);
    ASSERT_NEAR(1e-8, 0.5 / 25.0, cfg.winding_per_A2);
    ASSERT_NEAR(1e-8, 0.125 / 16.0, cfg.rotor_per_A2);
    ASSERT_NEAR(1e-7, 0.5 / 0.8, cfg.slip_gain);
}

static void refuse(const heating_params_t *p, float step_s)
{
    TEST_ASSERT_FALSE(heating_init(&cfg, p, step_s));
}

static void test_init_refuses_what_is_no_motor(void)
{
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        heating_params_t p = good;
        p.winding_pu = not_positive(k);
        if (!(p.winding_pu >= 0.0f) || (p.winding_pu > 1.0f)) {
            refuse(&p, 0.5f);
        }
        p = good;
        p.rated_A = not_positive(k);
        if (!(p.rated_A < 0.0f)) { /* its square counts */
            refuse(&p, 0.5f);
        }
        p = good;
        p.tau_s = not_positive(k);
        refuse(&p, 0.5f);
        refuse(&good, not_positive(k));
    }
    heating_params_t p = good;
    p.i_d_A = 5.0f; /* all of it magnetises */
    refuse(&p, 0.5f);
    p = good;
    p.tau_s = 0.75f; /* the rotor in one step */
    refuse(&p, 0.5f);
    p.tau_s = 0.751f;
    TEST_ASSERT_TRUE(heating_init(&cfg, &p, 0.5f));
    p = good;
    p.rated_A = 1e-20f;
    p.i_d_A = 0.0f; /* per A^2 there is no number */
    refuse(&p, 0.5f);
    p = good;
    p.tau_s = 3e38f;
    refuse(&p, 1e-20f);
}

/* By hand: what the first start finds is cold; a quarter above it is the winding's .25. */
static void test_a_step_is_the_two_equations(void)
{
    heating_in_t in = {.i2_A2 = 8.0f, .i_q_A = 2.0f, .Rs_ohm = 2.0f, .slip_rad_s = 16.0f};
    ASSERT_SAME_FLOAT(0.125f, heating_step(&cfg, &st, &in)); /* 2 (.125 8)/16 */
    ASSERT_SAME_FLOAT(2.0f, st.Rs_cold_ohm);
    ASSERT_SAME_FLOAT(0.0625f, st.winding_pu);
    ASSERT_SAME_FLOAT(0.01171875f, st.rotor_pu); /* 1.5 .125/16 */
    ASSERT_SAME_FLOAT(0.046875f, st.slip_rad_s); /* (.01171875 16)/4 */
    in = (heating_in_t){.Rs_ohm = 2.5f};
    st.rotor_pu = 0.5f;
    ASSERT_SAME_FLOAT(-0.03125f, heating_step(&cfg, &st, &in)); /* -2 .25/16 */
    ASSERT_SAME_FLOAT(2.0f, st.Rs_cold_ohm);
    ASSERT_SAME_FLOAT(0.234375f, st.winding_pu);
    ASSERT_SAME_FLOAT(0.4765625f, st.rotor_pu); /* .5 + 1.5 (.25 - .5)/16 */
    ASSERT_SAME_FLOAT(0.03515625f, st.slip_rad_s);
}

/* The same torque braking: the rotor loses the same, the slip has the other sign. */
static void test_braking_mirrors_the_slip_and_not_the_heat(void)
{
    heating_state_t other = {0};
    heating_in_t in = {.i2_A2 = 8.0f, .i_q_A = 2.0f, .Rs_ohm = 2.0f, .slip_rad_s = 16.0f};
    (void)heating_step(&cfg, &st, &in);
    in.i_q_A = -2.0f;
    in.slip_rad_s = -16.0f;
    (void)heating_step(&cfg, &other, &in);
    ASSERT_SAME_FLOAT(st.rotor_pu, other.rotor_pu);
    ASSERT_SAME_FLOAT(-st.slip_rad_s, other.slip_rad_s);
}

/* Nobody knows Rs: the model goes on from the winding of then. */
static void test_without_rs_the_model_goes_on_alone(void)
{
    const heating_in_t in = {.i2_A2 = 8.0f};
    ASSERT_SAME_FLOAT(0.0f, heating_step(&cfg, &st, &in)); /* of no Rs yet */
    ASSERT_SAME_FLOAT(0.0f, st.Rs_cold_ohm);
    ASSERT_SAME_FLOAT(0.0625f, st.winding_pu);
    st = (heating_state_t){.Rs_cold_ohm = 2.0f, .winding_pu = 0.5f};
    ASSERT_SAME_FLOAT(0.0625f, heating_step(&cfg, &st, &in));
    ASSERT_SAME_FLOAT(0.53125f, st.winding_pu);
}

/* 18 time constants at the rated current. */
static void test_the_rated_current_ends_at_the_rise_that_was_told(void)
{
    TEST_ASSERT_TRUE(heating_init(&cfg, &good, 0.01f));
    float Rs_ohm = 2.0f;
    for (int k = 0; k < 14400; k++) {
        const heating_in_t in = {
            .i2_A2 = 25.0f, .i_q_A = -4.0f, .Rs_ohm = Rs_ohm, .slip_rad_s = 10.0f};
        Rs_ohm += heating_step(&cfg, &st, &in);
    }
    ASSERT_NEAR(1e-3, 3.0, Rs_ohm);
    ASSERT_NEAR(1e-3, 0.625, st.rotor_pu);
    ASSERT_NEAR(1e-2, 6.25, st.slip_rad_s);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_without_a_rise_nothing_is_looked_at);
    RUN_TEST(test_without_a_rise_what_the_start_found_makes_the_slip);
    RUN_TEST(test_init_derives_its_coefficients);
    RUN_TEST(test_init_refuses_what_is_no_motor);
    RUN_TEST(test_a_step_is_the_two_equations);
    RUN_TEST(test_braking_mirrors_the_slip_and_not_the_heat);
    RUN_TEST(test_without_rs_the_model_goes_on_alone);
    RUN_TEST(test_the_rated_current_ends_at_the_rise_that_was_told);
    return UNITY_END();
}
