#include "overload.h"

#include <math.h>

#include "unity.h"

#define TURN_S 3.2e-3f

static const overload_params_t both = {
    .cont_A = {10.0f, 12.0f}, .tau_s = {120.0f, 10.0f}, .i_max_A = 15.0f};
static overload_config_t cfg;
static overload_state_t st;

void setUp(void)
{
    TEST_ASSERT_TRUE(overload_init(&cfg, &both, TURN_S));
    st = (overload_state_t){0};
}

void tearDown(void)
{
}

#define ASSERT_REFUSED(field, value)                                                               \
    do {                                                                                           \
        overload_params_t bad = both;                                                              \
        bad.field = (value);                                                                       \
        TEST_ASSERT_FALSE_MESSAGE(overload_init(&cfg, &bad, TURN_S), #field " = " #value);         \
    } while (0)

static void test_init_refuses_what_makes_no_image(void)
{
    ASSERT_REFUSED(cont_A[OVERLOAD_MOTOR], -1.0f);
    ASSERT_REFUSED(cont_A[OVERLOAD_MOTOR], NAN);
    ASSERT_REFUSED(cont_A[OVERLOAD_MOTOR], 15.1f);
    ASSERT_REFUSED(cont_A[OVERLOAD_MOTOR], 1e-30f); /* its square is no number to divide by */
    ASSERT_REFUSED(tau_s[OVERLOAD_MOTOR], -1.0f);
    ASSERT_REFUSED(tau_s[OVERLOAD_MOTOR], TURN_S);
    ASSERT_REFUSED(cont_A[OVERLOAD_INVERTER], INFINITY);
    ASSERT_REFUSED(tau_s[OVERLOAD_INVERTER], 0.0f);
    ASSERT_REFUSED(tau_s[OVERLOAD_INVERTER], NAN);
    ASSERT_REFUSED(tau_s[OVERLOAD_INVERTER], INFINITY);
    ASSERT_REFUSED(i_max_A, 0.0f);
    TEST_ASSERT_FALSE(overload_init(&cfg, &both, 0.0f));
    TEST_ASSERT_FALSE(overload_init(&cfg, &both, NAN));
}

static void run_for(float time_s, float i_A)
{
    for (int k = 0; k < (int)lroundf(time_s / TURN_S); k++) {
        (void)overload_step(&cfg, &st, i_A * i_A);
    }
}

/* x(t) = (i/i_c)^2 (1 - exp(-t/tau)): single precision over 37500 turns loses a few 1e-4. */
static void test_an_image_warms_up_as_the_closed_form(void)
{
    run_for(60.0f, 8.0f);
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, 0.64f * (1.0f - expf(-0.5f)), st.heat_pu[OVERLOAD_MOTOR]);
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, (64.0f / 144.0f) * (1.0f - expf(-6.0f)),
                             st.heat_pu[OVERLOAD_INVERTER]);
    run_for(60.0f, 0.0f);
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, 0.64f * (1.0f - expf(-0.5f)) * expf(-0.5f),
                             st.heat_pu[OVERLOAD_MOTOR]);
    TEST_ASSERT_FALSE(st.derating);
}

static void test_the_continuous_current_may_flow_for_ever(void)
{
    run_for(1500.0f, 9.9f);
    TEST_ASSERT_FALSE(st.derating);
}

static void test_the_limit_falls_in_a_line_and_holds_at_the_continuous_current(void)
{
    st.heat_pu[OVERLOAD_MOTOR] = 1.0f;
    TEST_ASSERT_FALSE(overload_step(&cfg, &st, 100.0f));
    st.heat_pu[OVERLOAD_MOTOR] = 1.025f;
    TEST_ASSERT_FALSE(overload_step(&cfg, &st, 102.5f));
    TEST_ASSERT_TRUE(st.derating);
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, 12.5f, st.i_max_A);
    st.heat_pu[OVERLOAD_MOTOR] = 1.1f;
    TEST_ASSERT_FALSE(overload_step(&cfg, &st, 110.0f));
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 10.0f, st.i_max_A);
    st = (overload_state_t){.heat_pu = {0.0f, 1.1f}};
    TEST_ASSERT_FALSE(overload_step(&cfg, &st, 144.0f));
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 12.0f, st.i_max_A);
    /* Just as warm as the continuous current makes it: nothing is taken away. */
    for (int n = 0; n < OVERLOAD_MODELS; n++) {
        cfg.warm_per_A2[n] = 0.0f;
        cfg.fade[n] = 0.0f;
    }
    st = (overload_state_t){.heat_pu = {1.0f, 1.0f}};
    TEST_ASSERT_FALSE(overload_step(&cfg, &st, 100.0f));
    TEST_ASSERT_FALSE(st.derating);
}

/* A drive that obeys its limit is never stopped. */
static void test_derating_keeps_an_obedient_drive_from_tripping(void)
{
    float i_A = 15.0f;
    for (int k = 0; k < 300000; k++) {
        TEST_ASSERT_FALSE(overload_step(&cfg, &st, i_A * i_A));
        i_A = st.derating ? st.i_max_A : 15.0f;
    }
    TEST_ASSERT_TRUE(st.derating);
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 1.045f, st.heat_pu[OVERLOAD_MOTOR]);
}

static void test_a_current_that_does_not_obey_stops_the_drive(void)
{
    bool stop = false;
    int turns = 0;
    while (!stop && (turns < 100000)) {
        stop = overload_step(&cfg, &st, 15.0f * 15.0f);
        turns++;
    }
    /* The inverter: 1.5625 (1 - exp(-t/10 s)) = 1.2. */
    TEST_ASSERT_FLOAT_WITHIN(0.05f, -10.0f * logf(1.0f - 1.2f / 1.5625f), (float)turns * TURN_S);
}

static void test_an_image_at_zero_current_is_off(void)
{
    overload_params_t none = both;
    none.cont_A[OVERLOAD_MOTOR] = 0.0f;
    none.cont_A[OVERLOAD_INVERTER] = 0.0f;
    TEST_ASSERT_TRUE(overload_init(&cfg, &none, TURN_S));
    run_for(10.0f, 1000.0f);
    TEST_ASSERT_FALSE(st.derating);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.heat_pu[OVERLOAD_MOTOR]);
}

static void test_a_current_that_is_no_number_stops_the_drive(void)
{
    TEST_ASSERT_TRUE(overload_step(&cfg, &st, NAN));
    TEST_ASSERT_TRUE(st.derating);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_what_makes_no_image);
    RUN_TEST(test_an_image_warms_up_as_the_closed_form);
    RUN_TEST(test_the_continuous_current_may_flow_for_ever);
    RUN_TEST(test_the_limit_falls_in_a_line_and_holds_at_the_continuous_current);
    RUN_TEST(test_derating_keeps_an_obedient_drive_from_tripping);
    RUN_TEST(test_a_current_that_does_not_obey_stops_the_drive);
    RUN_TEST(test_an_image_at_zero_current_is_off);
    RUN_TEST(test_a_current_that_is_no_number_stops_the_drive);
    return UNITY_END();
}
