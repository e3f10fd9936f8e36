/* The rules between parameters: named in full, and the same as what the law's init functions take.
 */
#include "params_check.h"

#include <math.h>
#include <string.h>

#include "host_port.h"
#include "unity.h"

static params_t params;
static params_conflict_t conflict;
static unit_t drive;

void setUp(void)
{
    params_default(&params);
    params.observer_gain_enable = 0u;
}
void tearDown(void)
{
}

static void set(const char *name, float value)
{
    TEST_ASSERT_EQUAL_MESSAGE(PARAMS_OK, params_set(&params, params_find(name), value), name);
}

static void expect(const char *first, params_relation_t relation, float limit, const char *second)
{
    TEST_ASSERT_FALSE_MESSAGE(params_check(&params, &conflict), first);
    TEST_ASSERT_EQUAL_STRING(first, params_name(conflict.first));
    TEST_ASSERT_EQUAL_STRING(second, params_name(conflict.second));
    TEST_ASSERT_EQUAL(relation, conflict.relation);
    TEST_ASSERT_FLOAT_WITHIN(1e-5f * fabsf(limit), limit, conflict.limit);
    TEST_ASSERT_FALSE(unit_init(&drive, &params, NULL));
    TEST_ASSERT_EQUAL_MEMORY(&conflict, &drive.refused, sizeof conflict);
    /* The limit itself is allowed, or the next value beyond it. */
    const bool below = (relation == PARAMS_AT_MOST) || (relation == PARAMS_BELOW);
    const bool strict = (relation == PARAMS_BELOW) || (relation == PARAMS_ABOVE);
    const float inside = strict ? nextafterf(limit, below ? -INFINITY : INFINITY) : limit;
    const float margin = 2e-5f * fabsf(limit);
    set(first, inside + (below ? -margin : margin));
    (void)params_check(&params, &conflict);
    TEST_ASSERT_TRUE((conflict.first == params_count()) ||
                     (strcmp(params_name(conflict.first), first) != 0) ||
                     (strcmp(params_name(conflict.second), second) != 0));
    setUp();
}

static void test_the_defaults_keep_every_rule(void)
{
    TEST_ASSERT_TRUE(params_check(&params, &conflict));
    TEST_ASSERT_EQUAL_size_t(params_count(), conflict.first);
}

static void test_motor_and_times_fit_the_period(void)
{
    set("M_H", 0.2f);
    expect("M_H", PARAMS_BELOW, sqrtf(0.110f * 0.102f), "Ls_H");
    set("Ls_H", 0.103f);
    set("period_s", 1e-3f);
    expect("period_s", PARAMS_BELOW, 1e-3f / 1.43f, "Ls_H");
    /* M/Lr = 1/2: a quarter of Rr counts. */
    set("M_H", 0.1875f);
    set("Lr_H", 0.375f);
    set("Ls_H", 0.09375f + 0.001953125f);
    set("period_s", 2e-3f);
    expect("period_s", PARAMS_BELOW, 0.001953125f / (0.93f + 0.25f * 0.5f), "Ls_H");
    set("period_s", 50e-6f);
    set("min_pulse_s", 30e-6f);
    expect("min_pulse_s", PARAMS_BELOW, 25e-6f, "period_s");
    set("period_s", 20e-6f);
    set("dead_time_s", 20e-6f);
    expect("dead_time_s", PARAMS_BELOW, 20e-6f, "period_s");
    set("current_bandwidth_rad_s", 5000.0f);
    expect("current_bandwidth_rad_s", PARAMS_BELOW, 5000.0f, "period_s");
    set("rs_level_s", 0.01f);
    expect("rs_level_s", PARAMS_AT_LEAST, 0.02f, "period_s");
    set("period_s", 20e-6f);
    set("rs_level_s", 25.0f);
    expect("rs_level_s", PARAMS_AT_MOST, 20.0f, "period_s");
    set("period_s", 20e-6f);
    set("stall_s", 400.0f);
    expect("stall_s", PARAMS_BELOW, 319.8f, "period_s");
    set("period_s", 2e-3f);
    set("com_slip_Hz", 40.0f);
    set("current_bandwidth_rad_s", 400.0f);
    expect("com_slip_Hz", PARAMS_AT_MOST, 31.25f, "period_s");
    set("period_s", 20e-6f);
    set("com_slip_Hz", 0.2f);
    expect("com_slip_Hz", PARAMS_AT_LEAST, 0.25f, "period_s");
}

static void test_currents_fit_each_other(void)
{
    set("i_d_A", 500.0f);
    expect("i_d_A", PARAMS_AT_MOST, 8.0f, "i_d_max_A");
    set("overload_motor_A", 16.0f);
    expect("overload_motor_A", PARAMS_AT_MOST, 15.8f, "i_max_A");
    set("overload_inverter_A", 16.0f);
    expect("overload_inverter_A", PARAMS_AT_MOST, 15.8f, "i_max_A");
}

static void test_ramps_flux_and_adaptation(void)
{
    set("eps1_on_Hz", 5.0f);
    expect("eps1_off_Hz", PARAMS_AT_LEAST, 5.0f, "eps1_on_Hz");
    set("speed_slew_rad_s2", 100.0f);
    set("speed_jerk_rad_s3", 1.5e5f);
    expect("speed_jerk_rad_s3", PARAMS_AT_MOST, 1.25e5f, "speed_slew_rad_s2");
    set("speed_jerk_rad_s3", 5e5f);
    expect("speed_jerk_rad_s3", PARAMS_AT_MOST, 2.5e5f, "ramp_down_rad_s2");
    set("economy_flux_min", 0.05f);
    expect("economy_flux_min", PARAMS_AT_LEAST, 0.1f, "economy_flux_min");
}

static void set_speed_limits(float most_rad_s)
{
    set("speed_max_rad_s", most_rad_s);
    set("over_speed_rad_s", 1.1f * most_rad_s);
    set("torque_speed_max_rad_s", 0.5f * most_rad_s);
    set("speed_deviation_rad_s", 0.15f * most_rad_s);
}

static void test_a_mode_has_what_it_needs(void)
{
    set("i_f_A", 0.0f);
    TEST_ASSERT_TRUE(params_check(&params, &conflict));
    set("lost_action", 2.0f);
    expect("i_f_A", PARAMS_ABOVE, 0.0f, "lost_action");
    set("i_f_A", 0.0f);
    set("control_mode", 2.0f);
    expect("i_f_A", PARAMS_ABOVE, 0.0f, "control_mode");
    set_speed_limits(8.0f);
    set("omega_max_rad_s", 10.0f);
    TEST_ASSERT_TRUE(params_check(&params, &conflict));
    set("flying_start", 1.0f);
    expect("omega_max_rad_s", PARAMS_ABOVE, 3.0f * 0.5f / 0.102f, "Rr_ohm");
    set("omega_max_rad_s", 2000.0f);
    set("flying_start", 1.0f);
    expect("omega_max_rad_s", PARAMS_BELOW, NUM_PI / 8.0f / 200e-6f, "period_s");
}

static void test_levels_of_the_dc_link_stand_in_order(void)
{
    set("u_dc_min_V", 400.0f);
    expect("u_dc_min_V", PARAMS_BELOW, 390.0f, "u_dc_max_V");
    set("regen_start_V", 390.0f);
    expect("regen_start_V", PARAMS_BELOW, 390.0f, "u_dc_max_V");
    set("chopper_on_V", 395.0f);
    expect("chopper_on_V", PARAMS_AT_MOST, 390.0f, "u_dc_max_V");
    set("mains_lost_V", 140.0f);
    expect("mains_lost_V", PARAMS_ABOVE, 150.0f, "u_dc_min_V");
    set("mains_lost_V", 320.0f);
    expect("mains_lost_V", PARAMS_BELOW, 308.1f, "u_dc_max_V");
}

/* Each pair would leave a protection without teeth. */
static void test_an_over_speed_trip_can_act(void)
{
    set("over_speed_rad_s", 700.0f);
    set("speed_max_rad_s", 640.0f);
    expect("over_speed_rad_s", PARAMS_BELOW, 628.0f, "omega_max_rad_s");
    set("omega_max_rad_s", 800.0f);
    set("over_speed_rad_s", 700.0f);
    expect("over_speed_rad_s", PARAMS_AT_MOST, 575.0f, "speed_max_rad_s");
    set("torque_speed_max_rad_s", 520.0f);
    expect("torque_speed_max_rad_s", PARAMS_AT_MOST, 500.0f, "speed_max_rad_s");
    set("i_d_A", 5.5f);
    expect("speed_max_rad_s", PARAMS_AT_MOST, 390.0f / (sqrtf(2.0f) * 0.102f * 5.5f), "u_dc_max_V");
    set("i_d_A", 5.5f);
    set("weaken_share", 0.9f);
    TEST_ASSERT_TRUE(params_check(&params, &conflict));
}

static void test_a_speed_deviation_can_be_found(void)
{
    set("speed_deviation_rad_s", 200.0f);
    expect("speed_deviation_rad_s", PARAMS_AT_MOST, 100.0f, "speed_max_rad_s");
    set("speed_filter_s", 0.7f);
    expect("speed_filter_s", PARAMS_AT_MOST, 0.5f / 31.0f, "speed_bandwidth_rad_s");
    set("speed_filter_s", 0.016f);
    set("speed_fast_bandwidth_rad_s", 70.0f);
    expect("speed_filter_s", PARAMS_AT_MOST, 0.5f / 70.0f, "speed_fast_bandwidth_rad_s");
    set("period_s", 20e-6f);
    set("speed_unknown_s", 1000.0f);
    expect("speed_unknown_s", PARAMS_BELOW, 319.8f, "period_s");
    set("regen_start_V", 350.0f);
    set("chopper_on_V", 360.0f);
    expect("chopper_on_V", PARAMS_AT_MOST, 350.0f, "regen_start_V");
}

static void test_the_trip_of_a_phase_is_beyond_every_current_asked_for(void)
{
    static const char *const asked[] = {"i_max_A",    "i_q_max_A", "i_d_max_A",    "i_f_A",
                                        "dc_brake_A", "rs_high_A", "observer_e1_A"};
    for (size_t k = 0u; k < sizeof asked / sizeof asked[0]; k++) {
        set(asked[k], 30.0f);
        set("rs_measure", 1.0f);
        set("lost_action", 2.0f);
        expect(asked[k], PARAMS_BELOW, sqrtf(1.5f) * 20.0f, "i_trip_A");
    }
    set("rs_high_A", 30.0f); /* nobody asks for them */
    set("i_f_A", 30.0f);
    TEST_ASSERT_TRUE(params_check(&params, &conflict));
    set("control_mode", 2.0f);
    expect("i_f_A", PARAMS_BELOW, sqrtf(1.5f) * 20.0f, "i_trip_A");
    setUp();
    set("i_trip_A", 30.0f);
    expect("i_trip_A", PARAMS_BELOW, 25.0f, "current_full_scale_A");
    set("current_sum_max_A", 7.0f);
    expect("current_sum_max_A", PARAMS_AT_MOST, 6.0f, "i_trip_A");
    set("open_phase_A", 4.0f);
    expect("open_phase_A", PARAMS_BELOW, sqrtf(2.0f / 3.0f) * 4.5f, "i_d_A");
    set("lambda_max_Wb", 0.5f);
    expect("lambda_max_Wb", PARAMS_ABOVE, 1.5f * 0.102f * 4.5f, "i_d_A");
}

static void test_the_trips_of_the_link_are_in_reach(void)
{
    set("u_dc_max_V", 420.0f);
    expect("u_dc_max_V", PARAMS_BELOW, 400.0f, "dc_link_full_scale_V");
    set("line_voltage_full_scale_V", 350.0f);
    expect("u_dc_max_V", PARAMS_AT_MOST, 350.0f, "line_voltage_full_scale_V");
    set("u_dc_min_V", 10.0f);
    expect("u_dc_min_V", PARAMS_AT_LEAST, sqrtf(2.0f) * 0.93f * 15.8f, "i_max_A");
    set("voltage_check_V", 80.0f);
    expect("voltage_check_V", PARAMS_BELOW, 75.0f, "u_dc_min_V");
    set("mains_V", 251.0f);
    expect("mains_V", PARAMS_BELOW, 0.6428f * 390.0f, "u_dc_max_V");
}

static uint32_t draw(uint32_t *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return *seed >> 8u;
}

/* Anywhere in its range, mostly near where it was: sets on both sides of every rule. */
static void draw_set(uint32_t *seed)
{
    setUp();
    const uint32_t changes = 1u + draw(seed) % 12u;
    for (uint32_t k = 0u; k < changes; k++) {
        const size_t index = draw(seed) % params_count();
        const param_info_t *info = params_info(index);
        const float share = (float)draw(seed) / 16777216.0f;
        float value = info->minimum + share * (info->maximum - info->minimum);
        if ((draw(seed) % 4u) != 0u) {
            value = params_get(&params, index) * expf(4.0f * share - 2.0f);
        }
        if (info->type != PARAM_FLOAT) {
            value = floorf(value);
        }
        (void)!params_set(&params, index, clampf(value, info->minimum, info->maximum));
    }
    params.observer_gain_enable = 0u;
}

static void test_what_the_rules_pass_the_law_takes(void)
{
    uint32_t seed = 2005u;
    uint32_t passed = 0u;
    for (uint32_t k = 0u; k < 20000u; k++) {
        draw_set(&seed);
        if (params_check(&params, &conflict)) {
            passed++;
            TEST_ASSERT_TRUE(unit_init(&drive, &params, NULL));
        }
    }
    TEST_ASSERT_TRUE((passed > 4000u) && (passed < 19000u));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_defaults_keep_every_rule);
    RUN_TEST(test_motor_and_times_fit_the_period);
    RUN_TEST(test_currents_fit_each_other);
    RUN_TEST(test_ramps_flux_and_adaptation);
    RUN_TEST(test_a_mode_has_what_it_needs);
    RUN_TEST(test_levels_of_the_dc_link_stand_in_order);
    RUN_TEST(test_an_over_speed_trip_can_act);
    RUN_TEST(test_a_speed_deviation_can_be_found);
    RUN_TEST(test_the_trip_of_a_phase_is_beyond_every_current_asked_for);
    RUN_TEST(test_the_trips_of_the_link_are_in_reach);
    RUN_TEST(test_what_the_rules_pass_the_law_takes);
    return UNITY_END();
}
