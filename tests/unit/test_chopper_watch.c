/* Heat of the brake resistor against its closed form; a transistor that fails. */
#include "chopper_watch.h"

#include <math.h>

#include "unity.h"

#define OHM   50.0f
#define W     200.0f
#define TAU_S 2.0f
#define STEP  1e-3f

static chopper_watch_params_t params;
static chopper_watch_config_t cfg;
static chopper_watch_state_t st;
static chopper_watch_in_t in;

void setUp(void)
{
    params = (chopper_watch_params_t){
        .ohm = OHM, .rated_W = W, .tau_s = TAU_S, .step_s = STEP, .feedback = false};
    TEST_ASSERT_TRUE(chopper_watch_init(&cfg, &params));
    st = (chopper_watch_state_t){0};
    in = (chopper_watch_in_t){.steps = 1u, .u_dc_V = 400.0f}; /* 3200 W: 16 times the rating */
}
void tearDown(void)
{
}

static uint32_t steps(uint32_t n)
{
    uint32_t faults = 0u;
    for (uint32_t k = 0u; k < n; k++) {
        faults = chopper_watch_step(&cfg, &st, &in);
    }
    return faults;
}

static void refused(float *number, float wrong)
{
    const float right = *number;
    *number = wrong;
    TEST_ASSERT_FALSE(chopper_watch_init(&cfg, &params));
    TEST_ASSERT_FALSE(cfg.on && (cfg.fade <= 0.1f));
    *number = right;
    TEST_ASSERT_TRUE(chopper_watch_init(&cfg, &params));
}

static void test_init_refuses_what_is_outside_its_range(void)
{
    refused(&params.ohm, -1.0f);
    refused(&params.ohm, NAN);
    refused(&params.rated_W, 0.0f);
    refused(&params.tau_s, 0.0f);
    refused(&params.tau_s, 9.9e-3f);
    refused(&params.step_s, 0.0f);
    params.tau_s = 10.1e-3f;
    TEST_ASSERT_TRUE(chopper_watch_init(&cfg, &params));
    params.rated_W = 1e38f; /* 1/(R W) underflows */
    params.ohm = 1e38f;
    TEST_ASSERT_FALSE(chopper_watch_init(&cfg, &params));
}

static void test_without_a_resistor_nothing_is_watched(void)
{
    params = (chopper_watch_params_t){0};
    TEST_ASSERT_TRUE(chopper_watch_init(&cfg, &params));
    in.switched_on = true;
    TEST_ASSERT_EQUAL_UINT32(0u, steps(1000u));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.heat_pu);
}

static void test_the_heat_rises_as_its_closed_form(void)
{
    in.switched_on = true;
    TEST_ASSERT_EQUAL_UINT32(0u, steps(100u));
    const float closed_pu = 16.0f * (1.0f - expf(-0.1f / TAU_S));
    TEST_ASSERT_FLOAT_WITHIN(1e-3f * closed_pu, closed_pu, st.heat_pu);
    in.switched_on = false;
    TEST_ASSERT_EQUAL_UINT32(0u, steps(2000u));
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, closed_pu * expf(-1.0f), st.heat_pu);
}

static void test_a_late_look_heats_for_all_its_time(void)
{
    in.switched_on = true;
    in.steps = 10u;
    TEST_ASSERT_EQUAL_UINT32(0u, steps(10u));
    const float closed_pu = 16.0f * (1.0f - expf(-0.1f / TAU_S));
    TEST_ASSERT_FLOAT_WITHIN(4e-3f * closed_pu, closed_pu, st.heat_pu);
    in.steps = 4000u; /* longer than its time constant: it is where it ends */
    TEST_ASSERT_EQUAL_UINT32(CHOPPER_WATCH_HOT, steps(1u));
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 16.0f, st.heat_pu);
}

static void test_it_is_hot_at_its_rating_until_it_has_cooled(void)
{
    in.switched_on = true;
    uint32_t n = 0u;
    while (chopper_watch_step(&cfg, &st, &in) == 0u) {
        n++;
    }
    TEST_ASSERT_EQUAL_UINT32(129u, n); /* 2 s ln(16/15) */
    TEST_ASSERT_TRUE(st.hot);
    in.switched_on = false;
    while (st.heat_pu >= 0.81f) {
        TEST_ASSERT_EQUAL_UINT32(CHOPPER_WATCH_HOT, steps(1u));
    }
    (void)steps(40u);
    TEST_ASSERT_FALSE(st.hot);
    in.switched_on = true;
    TEST_ASSERT_EQUAL_UINT32(0u, steps(1u));
}

static void feedback(void)
{
    params.feedback = true;
    params.rated_W = 1e6f;
    TEST_ASSERT_TRUE(chopper_watch_init(&cfg, &params));
}

static void test_a_shorted_transistor_is_seen_and_heats(void)
{
    feedback();
    in.leads = true;
    TEST_ASSERT_EQUAL_UINT32(0u, steps(19u));
    TEST_ASSERT_EQUAL_UINT32(CHOPPER_WATCH_SHORT, steps(1u));
    TEST_ASSERT_TRUE(st.heat_pu > 0.0f);
}

static void test_a_resistor_that_does_not_lead_is_seen_and_stays_cool(void)
{
    feedback();
    in.switched_on = true;
    TEST_ASSERT_EQUAL_UINT32(0u, steps(19u));
    TEST_ASSERT_EQUAL_UINT32(CHOPPER_WATCH_OPEN, steps(1u));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.heat_pu);
}

static void test_switching_between_two_looks_is_no_fault(void)
{
    feedback();
    for (uint32_t k = 0u; k < 10000u; k++) {
        in.switched_on = (k % 20u) < 10u;
        in.leads = ((k + 1u) % 20u) < 10u; /* a look too late, either way */
        TEST_ASSERT_EQUAL_UINT32(0u, steps(1u));
    }
}

static void test_without_feedback_it_goes_by_the_switch(void)
{
    in.leads = true;
    TEST_ASSERT_EQUAL_UINT32(0u, steps(100u));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.heat_pu);
    in.leads = false;
    in.switched_on = true;
    TEST_ASSERT_EQUAL_UINT32(0u, steps(100u));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_what_is_outside_its_range);
    RUN_TEST(test_without_a_resistor_nothing_is_watched);
    RUN_TEST(test_the_heat_rises_as_its_closed_form);
    RUN_TEST(test_a_late_look_heats_for_all_its_time);
    RUN_TEST(test_it_is_hot_at_its_rating_until_it_has_cooled);
    RUN_TEST(test_a_shorted_transistor_is_seen_and_heats);
    RUN_TEST(test_a_resistor_that_does_not_lead_is_seen_and_stays_cool);
    RUN_TEST(test_switching_between_two_looks_is_no_fault);
    RUN_TEST(test_without_feedback_it_goes_by_the_switch);
    return UNITY_END();
}
