/* Derating by temperature, and Rs for that of the winding: of the configuration, not the
 * parameters.
 */
#include "terminals_adapt.h"

#include "terminal_fixture.h"

static const float rated_A = 15.0f;

void setUp(void)
{
    start_board();
    params.sink_sensor = TEMPERATURE_PT1000;
    params.sink_derate_degC = 80.0f;
    params.sink_trip_degC = 100.0f;
    params.motor_sensor = TEMPERATURE_PT1000;
    params.motor_derate_degC = 100.0f;
    params.motor_trip_degC = 140.0f;
    fit();
    st.sink.known = true;
    st.sink.degC = 20.0f;
    st.motor.known = true;
    st.motor.degC = 20.0f;
    drive_runs();
}
void tearDown(void)
{
}

/* As the next period does. */
static void take(void)
{
    if (unit.change_ready) {
        unit.in_force = 1u - unit.in_force;
        unit.change_ready = false;
    }
}

static float adapted_A(void)
{
    terminals_adapt(&cfg, &st, &unit);
    take();
    return unit_config(&unit)->drive.modes.vector.speed.i_q_max_A;
}

static float adapted_ohm(void)
{
    terminals_adapt(&cfg, &st, &unit);
    take();
    return unit_config(&unit)->drive.motor.Rs_ohm;
}

static void test_cool_nothing_is_made(void)
{
    const uint32_t before = unit.in_force;
    TEST_ASSERT_EQUAL_FLOAT(rated_A, adapted_A());
    TEST_ASSERT_EQUAL_UINT32(before, unit.in_force);
}

static void test_the_limit_falls_in_steps_and_rises_again(void)
{
    const float degC[] = {80.0f, 80.1f, 81.9f, 82.1f, 90.0f, 100.0f, 120.0f, 60.0f};
    const float cut_pu[] = {0.0f, 0.05f, 0.05f, 0.1f, 0.25f, 0.5f, 0.5f, 0.0f};
    for (uint32_t k = 0u; k < 8u; k++) {
        st.sink.degC = degC[k];
        TEST_ASSERT_FLOAT_WITHIN(1e-4f, rated_A * (1.0f - cut_pu[k]), adapted_A());
        TEST_ASSERT_EQUAL_FLOAT(rated_A, unit.params.i_q_max_A);
        TEST_ASSERT_FLOAT_WITHIN(1e-6f, cut_pu[k], st.adapted_cut_pu);
    }
}

static void test_the_hotter_one_counts(void)
{
    st.motor.degC = 120.0f;
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, 0.75f * rated_A, adapted_A());
    st.sink.degC = 100.0f;
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, 0.5f * rated_A, adapted_A());
}

static void test_a_hoist_is_not_derated(void)
{
    cfg.brake.on = true;
    st.sink.degC = 95.0f;
    TEST_ASSERT_EQUAL_FLOAT(rated_A, adapted_A());
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.adapted_cut_pu);
}

static void test_the_same_cut_is_made_once(void)
{
    st.sink.degC = 90.0f;
    (void)adapted_A();
    const uint32_t before = unit.in_force;
    (void)adapted_A();
    TEST_ASSERT_EQUAL_UINT32(before, unit.in_force);
    TEST_ASSERT_FALSE(unit.change_ready);
}

static void test_a_configuration_that_waits_is_taken_first(void)
{
    unit.change_ready = true;
    st.sink.degC = 90.0f;
    terminals_adapt(&cfg, &st, &unit);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.adapted_cut_pu);
}

static void test_a_change_by_somebody_else_is_derated_again(void)
{
    st.sink.degC = 90.0f;
    (void)adapted_A();
    params_t changed = unit.params;
    changed.i_q_max_A = 12.0f;
    TEST_ASSERT_TRUE(unit_reconfigure(&unit, &changed));
    take();
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, 0.75f * 12.0f, adapted_A());
    TEST_ASSERT_EQUAL_FLOAT(12.0f, unit.params.i_q_max_A);
    st.sink.degC = 20.0f;
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, 12.0f, adapted_A());
    changed.i_q_max_A = 11.0f;
    TEST_ASSERT_TRUE(unit_reconfigure(&unit, &changed));
    take();
    const uint32_t before = unit.in_force;
    (void)adapted_A(); /* nothing to adapt any more */
    TEST_ASSERT_EQUAL_UINT32(before, unit.in_force);
}

static void test_a_cut_that_is_refused_leaves_the_owners_limit(void)
{
    unit.params.i_q_max_A = -1.0f; /* no share of it is good either */
    st.sink.degC = 90.0f;
    terminals_adapt(&cfg, &st, &unit);
    TEST_ASSERT_EQUAL_FLOAT(-1.0f, unit.params.i_q_max_A);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 0.25f, st.adapted_cut_pu);
}

static void test_rs_follows_the_winding_while_the_gates_are_off(void)
{
    const float Rs_ohm = unit.params.Rs_ohm;
    drive_rests();
    st.motor.degC = 22.5f; /* 1 % of 254.5 K is 2.545 K */
    TEST_ASSERT_EQUAL_FLOAT(Rs_ohm, adapted_ohm());
    st.motor.degC = 80.0f;
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, Rs_ohm * (234.5f + 80.0f) / 254.5f, adapted_ohm());
    TEST_ASSERT_EQUAL_FLOAT(Rs_ohm, unit.params.Rs_ohm);
    st.motor.degC = 82.0f; /* .8 % */
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, Rs_ohm * (234.5f + 80.0f) / 254.5f, adapted_ohm());
    st.motor.degC = -20.0f;
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, Rs_ohm * (234.5f - 20.0f) / 254.5f, adapted_ohm());
    const uint32_t before = unit.in_force;
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, Rs_ohm * 214.5f / 254.5f, adapted_ohm());
    TEST_ASSERT_EQUAL_UINT32(before, unit.in_force);
    params_t same = unit.params;
    TEST_ASSERT_TRUE(unit_reconfigure(&unit, &same));
    take();
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, Rs_ohm * 214.5f / 254.5f, adapted_ohm());
    cfg.motor_Rs_degC = -20.0f;
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, Rs_ohm, adapted_ohm());
}

static void test_rs_stays_while_the_gates_are_on_or_nothing_is_known(void)
{
    const float Rs_ohm = unit.params.Rs_ohm;
    st.motor.degC = 90.0f;
    TEST_ASSERT_EQUAL_FLOAT(Rs_ohm, adapted_ohm());
    drive_rests();
    st.motor.known = false;
    TEST_ASSERT_EQUAL_FLOAT(Rs_ohm, adapted_ohm());
    st.motor.known = true;
    const float warm_ohm = adapted_ohm();
    TEST_ASSERT_TRUE(warm_ohm > 1.2f * Rs_ohm);
    drive_runs();
    st.motor.degC = 40.0f;
    TEST_ASSERT_EQUAL_FLOAT(warm_ohm, adapted_ohm());
}

static void test_it_comes_once_in_128_steps(void)
{
    in.sink_counts = (uint16_t)(65536.0f * 1344.0f / 3544.0f); /* 89 degC */
    in.motor_counts = (uint16_t)(65536.0f * 1078.0f / 3278.0f);
    rounds(127u);
    TEST_ASSERT_FALSE(unit.change_ready);
    rounds(1u);
    TEST_ASSERT_TRUE(unit.change_ready);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_cool_nothing_is_made);
    RUN_TEST(test_the_limit_falls_in_steps_and_rises_again);
    RUN_TEST(test_the_hotter_one_counts);
    RUN_TEST(test_a_hoist_is_not_derated);
    RUN_TEST(test_the_same_cut_is_made_once);
    RUN_TEST(test_a_configuration_that_waits_is_taken_first);
    RUN_TEST(test_a_change_by_somebody_else_is_derated_again);
    RUN_TEST(test_a_cut_that_is_refused_leaves_the_owners_limit);
    RUN_TEST(test_rs_follows_the_winding_while_the_gates_are_off);
    RUN_TEST(test_rs_stays_while_the_gates_are_on_or_nothing_is_known);
    RUN_TEST(test_it_comes_once_in_128_steps);
    return UNITY_END();
}
