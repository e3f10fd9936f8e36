/* What the parameters become, number by number: each constant and each unit of unit_config*.c.
 *
 * The parameters are a set in which no two are alike. The numbers expected were worked out once
 * from the formulae and stand here as text; one that changes on purpose is changed here too.
 */
#include "unit_config.h"

#include <math.h>

#include "exact.h"
#include "unity.h"

static params_t params;
static drive_params_t drive;

/* Came later, each between others: the numbers of the rest stay. */
static const char *const later[] = {"speed_max_rad_s",
                                    "speed_deviation_rad_s",
                                    "speed_deviation_s",
                                    "speed_unknown_s",
                                    "voltage_blend_Hz",
                                    "adapt_accel_share",
                                    "mains_V",
                                    "heat_rise",
                                    "heat_s",
                                    "m_track",
                                    "offset_track",
                                    "fieldbus_commands",
                                    "fieldbus_address",
                                    "fieldbus_timeout_s"};

static float number_of(size_t k)
{
    float n = (float)k;
    for (size_t l = 0u; l < sizeof later / sizeof later[0]; l++) {
        n -= (params_find(later[l]) < k) ? 1.0f : 0.0f;
    }
    /* flux_mode stood before it. */
    return (params_find("premagnetise_s") <= k) ? (n + 1.0f) : n;
}

/* Off the default by another share each; what is 0 becomes something, a choice the next one. */
static float another(size_t k)
{
    const param_info_t *info = params_info(k);
    const float initial = params_initial(k);
    if ((param_type_t)info->type != PARAM_FLOAT) {
        return (initial + 1.0f <= info->maximum) ? (initial + 1.0f) : initial;
    }
    const float n = number_of(k);
    const float moved = (initial > 0.0f) ? initial * (1.01f + 0.002f * n) : (0.31f + 0.001f * n);
    return fminf(moved, info->maximum);
}

void setUp(void)
{
    params_default(&params);
    for (size_t k = 0u; k < params_count(); k++) {
        TEST_ASSERT_EQUAL(PARAMS_OK, params_set(&params, k, another(k)));
    }
    unit_config_drive(&drive, &params);
}

void tearDown(void)
{
}

#define EXPECT(field, value)                                                                       \
    TEST_ASSERT_FLOAT_WITHIN_MESSAGE(fabsf(value) * 2e-6f, value, (float)drive.field, #field)

static void test_board_inverter_and_loops_get_their_numbers(void)
{
    EXPECT(period_s, 0.000204399985f);
    EXPECT(motor.Rs_ohm, 0.939300001f);
    EXPECT(motor.Rr_ohm, 0.505999982f);
    EXPECT(motor.Ls_H, 0.11153999f);
    EXPECT(motor.Lr_H, 0.103632003f);
    EXPECT(motor.M_H, 0.103836f);
    EXPECT(motor.pole_pairs, 2.03999996f);
    EXPECT(measurement.adc_bits, 15.0f);
    EXPECT(measurement.current_full_scale_A, 25.6500015f);
    EXPECT(measurement.line_voltage_full_scale_V, 411.200012f);
    EXPECT(measurement.dc_link_full_scale_V, 412.0f);
    EXPECT(measurement.current_sum_max_A, 3.55800009f);
    EXPECT(measurement.swap_vw, 1.0f);
    EXPECT(monitor.i_trip_A, 23.6400013f);
    EXPECT(monitor.u_dc_max_V, 457.079987f);
    EXPECT(monitor.u_dc_min_V, 176.100006f);
    EXPECT(monitor.omega_max_rad_s, 674.880005f);
    EXPECT(monitor.plausibility_periods, 49.0f);
    EXPECT(acting.source, 1.0f);
    EXPECT(acting.filter_comp_s, 0.000188999998f);
    EXPECT(speed.bandwidth_rad_s, 33.355999f);
    EXPECT(speed.ki_factor, 0.270500004f);
    EXPECT(speed.J_kg_m2, 0.0379399993f);
    EXPECT(speed.lambda_Wb, 0.518660784f);
    EXPECT(speed.i_q_max_A, 16.5f);
    EXPECT(speed.i_max_A, 17.3484001f);
    EXPECT(speed.filter_s, 0.0032579999f);
    EXPECT(speed.slew_rad_s2, 1e+09f);
    EXPECT(speed.fast_bandwidth_rad_s, 0.344000012f);
    EXPECT(speed.slow_rad_s, 32.4000015f);
    EXPECT(speed.fast_rad_s, 48.8571434f);
    EXPECT(speed.torque_max_rad_s, 343.515991f);
    EXPECT(speed.torque_min_rad_s, 0.0f);
    EXPECT(speed.torque_slew_Nm_per_s, 1096.0f);
    EXPECT(ramp.acceleration_rad_s2, 1e+09f);
    EXPECT(ramp.jerk_rad_s3, 0.349999994f);
    EXPECT(ramp.stop_rad_s2, 231.600006f);
    EXPECT(delay_comp_periods, 1.66200006f);
    EXPECT(current.bandwidth_rad_s, 440.799988f);
    EXPECT(current.ki_factor, 0.331200004f);
    EXPECT(current.decoupling, 1.0f);
    EXPECT(current.u_max_V, 457.079987f);
    EXPECT(svpwm.min_pulse_s, 4.99999987e-05f);
    EXPECT(svpwm.u_dc_min_V, 89.0500031f);
    EXPECT(svpwm.swap_vw, 1.0f);
    EXPECT(dead_time.fraction, 0.326000005f);
    EXPECT(dead_time.dead_time_s, 2.07599987e-06f);
    EXPECT(dead_time.drop_V, 0.324999988f);
    EXPECT(dead_time.i_threshold_A, 0.261000007f);
    EXPECT(dead_time_identify, 1.0f);
}

static void test_protection_resistance_and_flux_get_their_numbers(void)
{
    EXPECT(link.chopper_on_V, 0.393999994f);
    EXPECT(link.regen_start_V, 0.393000007f);
    EXPECT(link.u_dc_max_V, 457.079987f);
    EXPECT(overload.cont_A[0], 0.398999989f);
    EXPECT(overload.cont_A[1], 0.401000023f);
    EXPECT(overload.tau_s[0], 142.800003f);
    EXPECT(overload.tau_s[1], 10.0f);
    EXPECT(overload.i_max_A, 17.3484001f);
    EXPECT(plausibility.u_V, 0.40200001f);
    EXPECT(plausibility.open_A, 0.402999997f);
    EXPECT(plausibility.e1_A, 0.404000014f);
    EXPECT(plausibility.rate_rad_s2, 0.405000001f);
    EXPECT(plausibility.power_W, 0.406000018f);
    EXPECT(plausibility.stall_s, 0.407000005f);
    EXPECT(plausibility.mains_V, 0.396f);
    EXPECT(plausibility.chopper_on_V, params.chopper_on_V);
    EXPECT(speed_guard.over_speed_rad_s, 674.880005f);
    EXPECT(speed_guard.deviation_rad_s, params.speed_deviation_rad_s);
    EXPECT(speed_guard.deviation_s, params.speed_deviation_s);
    EXPECT(speed_guard.unknown_s, params.speed_unknown_s);
    EXPECT(speed_guard.lambda_nominal_Wb, params.M_H * params.i_d_A);
    EXPECT(rs_measurement.enable, 1.0f);
    EXPECT(rs_measurement.level.A[RS_LEVEL_HIGH], 9.02400017f);
    EXPECT(rs_measurement.level.A[RS_LEVEL_LOW], 5.64000034f);
    EXPECT(rs_measurement.level_s, 1.69499993f);
    EXPECT(rs_measurement.average_s, 0.338999987f);
    EXPECT(rs_measurement.bias, 1.15463996f);
    EXPECT(rs_measurement.ratio_max, 1.91460478f);
    EXPECT(rs_tracking.gain_ohm_per_rad, 0.372000009f);
    EXPECT(rs_tracking.i_0_A, 3.49649978f);
    EXPECT(rs_tracking.min_rad_s, 1.88495576f);
    EXPECT(rs_tracking.max_rad_s, 18.849556f);
    EXPECT(rs_tracking.back_rad_s, 2.2996459f);
    EXPECT(rs_tracking.low_pu, 0.980000019f);
    EXPECT(rs_tracking.high_pu, 1.5f);
    EXPECT(rs_tracking.quiet_s, 0.5f);
    EXPECT(rs_tracking.speed_err_rad_s, 3.0f);
    EXPECT(rs_tracking.slew_rad_s2, 20.0f);
    EXPECT(flux.i_d_A, 4.99499989f);
    EXPECT(flux.i_d_max_A, 8.89599991f);
    EXPECT(steering.min_rad_s, 2.2996459f);
    EXPECT(steering.hysteresis_rad_s, 0.919858396f);
    EXPECT(steering.lambda_nominal_Wb, 0.518660784f);
    EXPECT(steering.lambda_min_Wb, 0.233189881f);
    EXPECT(steering.torque_min_Nm, 1.749248599f);
    EXPECT(steering.torque_filter_s, 0.0320000015f);
    EXPECT(steering.slew_Wb_per_s, 0.368905246f);
    EXPECT(steering.i_q_max_A, 16.5f);
}

/* A leg carries sqrt(2/3) of it: half the threshold; never above half the lower current. */
static void test_the_curve_needs_a_small_current(void)
{
    params.rs_high_A = 8.0f;
    params.dead_time_i_threshold_A = 0.25f;
    unit_config_drive(&drive, &params);
    EXPECT(rs_measurement.level.A[RS_LEVEL_SMALL], 0.0f);
    params.voltage_source = ACTING_VOLTAGE_BLEND;
    unit_config_drive(&drive, &params);
    EXPECT(rs_measurement.by_duty, 0.0f);
    params.voltage_source = ACTING_VOLTAGE_DUTY;
    params.dead_time_identify = 2u;
    unit_config_drive(&drive, &params);
    EXPECT(rs_measurement.level.A[RS_LEVEL_SMALL], 0.075f);
    EXPECT(rs_measurement.level_s, 0.75f * params.rs_level_s);
    EXPECT(rs_measurement.average_s, 0.15f * params.rs_level_s);
    EXPECT(rs_measurement.level.A[RS_LEVEL_BEND], 3.2f);
    EXPECT(dead_time_identify, 1.0f);
    EXPECT(rs_measurement.by_duty, 1.0f);
    params.dead_time_i_threshold_A = 10.0f;
    unit_config_drive(&drive, &params);
    EXPECT(rs_measurement.level.A[RS_LEVEL_SMALL], 2.5f);
}

/* Nothing keeps the field away from zero frequency under load: Rs is tracked faster and further. */
/* .06 ohm beside 40 A: 1 V over 15 A is less than the .1 ohm of a transistor. */
static void test_a_large_motor_is_measured_with_its_transistors(void)
{
    params.Rs_ohm = 0.06f;
    params.rs_high_A = 40.0f;
    unit_config_drive(&drive, &params);
    EXPECT(rs_measurement.ratio_max, 3.26666667f);
    params.rs_high_A = 26.0f;
    unit_config_drive(&drive, &params);
    EXPECT(rs_measurement.ratio_max, 3.30940171f);
}

static void test_without_steering_rs_is_tracked_faster_and_further(void)
{
    params.steer_min_Hz = 0.0f;
    params.rs_track_gain = 0.3f;
    params.i_d_A = 5.0f;
    unit_config_drive(&drive, &params);
    EXPECT(rs_tracking.gain_ohm_per_rad, 1.0f);
    EXPECT(rs_tracking.i_0_A, 2.0f);
    EXPECT(rs_tracking.low_pu, 0.75f);
    EXPECT(rs_tracking.quiet_s, 0.2f);
    EXPECT(rs_tracking.min_rad_s, 1.88495576f);
    EXPECT(rs_tracking.high_pu, 1.5f);
}

/* Above half of one a period more, below none. */
static void test_counts_of_periods_are_rounded(void)
{
    params.period_s = 0.01f / 48.46f;
    unit_config_drive(&drive, &params);
    TEST_ASSERT_EQUAL_UINT32(48u, drive.monitor.plausibility_periods);
    params.period_s = 0.01f / 48.54f;
    unit_config_drive(&drive, &params);
    TEST_ASSERT_EQUAL_UINT32(49u, drive.monitor.plausibility_periods);
}

static void test_the_blend_is_an_angular_frequency(void)
{
    params.voltage_blend_Hz = 2.0f;
    unit_config_drive(&drive, &params);
    EXPECT(acting.blend_rad_s, 6.2831853f * 2.0f);
}

/* Steered from 1.4 Hz on a motor has a large Rs: it tells up to five times that frequency. */
static void test_a_large_resistance_is_tracked_up_to_a_higher_frequency(void)
{
    params.steer_min_Hz = 1.4f;
    unit_config_drive(&drive, &params);
    EXPECT(rs_tracking.max_rad_s, 6.2831853f * 7.0f);
}

/* A fifth of the level, and no more periods than a float adds up. */
static void test_a_long_level_is_averaged_over_what_floats_can_add(void)
{
    params.period_s = 200e-6f;
    params.rs_level_s = 100.0f;
    unit_config_drive(&drive, &params);
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, 1.6382f, drive.rs_measurement.average_s);
}

static void test_supervisor_and_i_f_get_their_numbers(void)
{
    EXPECT(supervisor.corner_rad_s, 3.01592898f);
    EXPECT(supervisor.Rs_uncertainty_pu, 0.0568000041f);
    EXPECT(supervisor.Rr_uncertainty_pu, 0.300000012f);
    EXPECT(supervisor.i_uncertainty_pu, 0.0199999996f);
    EXPECT(supervisor.u_uncertainty_V, 0.102800012f);
    EXPECT(supervisor.residual_pu, 0.430000007f);
    EXPECT(supervisor.lost_pu, 0.600000024f);
    EXPECT(supervisor.confirm_s, 0.5f);
    EXPECT(supervisor.return_s, 0.300000012f);
    EXPECT(supervisor.still_rad_s, 0.5f * 6.2831853f * params.steer_min_Hz);
    EXPECT(supervisor.still_A, 0.2f * params.i_q_max_A);
    EXPECT(supervisor.still_s, 0.300000012f);
    EXPECT(supervisor.lambda_nominal_Wb, 0.518660784f);
    EXPECT(supervisor.omega_max_rad_s, 673.216003f);
    EXPECT(lost_action, 1.0f);
    EXPECT(i_f.current_A, 17.1000004f);
    EXPECT(i_f.slew_A_per_s, 114.0f);
    EXPECT(i_f.slew_rad_s2, 68.6399994f);
    EXPECT(i_f.return_rad_s, 9.42477798f);
    EXPECT(i_f.timeout_s, 5.0f);
    params.speed_slew_rad_s2 = 4.0f; /* a large inertia follows no faster in I-f */
    unit_config_drive(&drive, &params);
    EXPECT(i_f.slew_rad_s2, 4.0f);
    EXPECT(modes.volts.slew_rad_s2, 68.6399994f);
}

static void test_modes_get_their_numbers(void)
{
    EXPECT(modes.flux.voltage_share, 0.363999993f);
    EXPECT(modes.flux.bandwidth_rad_s, 20.0f);
    EXPECT(modes.flux.pull_out_share, 0.800000012f);
    EXPECT(modes.flux.economy_min_pu, 0.36500001f);
    EXPECT(modes.flux.economy_from_rad_s, 31.3999996f);
    EXPECT(modes.flux.economy_filter_s, 0.5f);
    EXPECT(modes.flux.economy_slew_Wb_per_s, 3.15716553f);
    EXPECT(modes.flux.lambda_nominal_Wb, 0.518660784f);
    EXPECT(modes.flux.lambda_min_Wb, 0.0518660806f);
    EXPECT(modes.flux.i_q_max_A, 16.5f);
    EXPECT(modes.control, 1.0f);
    EXPECT(modes.flying.enable, 1.0f);
    EXPECT(modes.flying.current_A, 4.99499989f);
    EXPECT(modes.flying.settle_s, 0.0199999996f);
    EXPECT(modes.flying.window_s, 0.150000006f);
    EXPECT(modes.flying.stand_rad_s, 14.6479836f);
    EXPECT(modes.flying.omega_max_rad_s, 673.216003f);
    EXPECT(modes.volts.psi_Wb, 0.557142258f);
    EXPECT(modes.volts.boost_V, 6.8760004f);
    EXPECT(modes.volts.slew_rad_s2, 68.6399994f);
    EXPECT(modes.volts.i_max_A, 17.3484001f);
    EXPECT(modes.mains.u_lost_V, 0.395000011f);
    EXPECT(modes.mains.u_hold_V, 0.454250008f);
    EXPECT(modes.mains.u_back_V, 0.499675006f);
    EXPECT(modes.mains.back_s, 0.100000001f);
    EXPECT(modes.mains.gain_W_per_V, 21.9599991f);
    EXPECT(modes.mains.stop_rad_s, 14.6479836f);
    EXPECT(modes.mains.lambda_Wb, 0.518660784f);
    EXPECT(modes.mains.i_q_max_A, 16.5f);
    EXPECT(modes.brake.current_A, 0.379999995f);
    EXPECT(modes.brake.from_rad_s, 7.23822927f);
    EXPECT(modes.brake.least_s, 1.15400004f);
    EXPECT(modes.brake.slew_A_per_s, 3.79999995f);
    EXPECT(modes.dc_bandwidth_rad_s, 440.799988f);
}

/* In torque mode the speed against the direction that is allowed is at most zero. */
static void test_a_direction_bounds_the_speed_of_torque_mode(void)
{
    const float least[] = {-500.0f, 0.0f, -500.0f};
    const float most[] = {500.0f, 500.0f, 0.0f};
    params.torque_speed_max_rad_s = 500.0f;
    for (uint32_t direction = 0u; direction <= 2u; direction++) {
        params.direction = direction;
        unit_config_drive(&drive, &params);
        EXPECT(speed.torque_min_rad_s, least[direction]);
        EXPECT(speed.torque_max_rad_s, most[direction]);
    }
}

static void test_dwelling_gets_its_numbers(void)
{
    params.dwell = 2u;
    params.dwell_amplitude = 0.125f;
    params.i_d_A = 5.0f;
    params.Rs_ohm = 0.93f; /* Table 1's */
    params.Rr_ohm = 0.5f;
    params.pole_pairs = 4.0f;
    unit_config_drive(&drive, &params);
    TEST_ASSERT_EQUAL(DWELL_FLUX, drive.dwell.kind);
    EXPECT(dwell.amplitude_pu, 0.125f);
    /* Half of what steering holds; without steering .3 Hz. */
    EXPECT(dwell.window_rad_s, 0.5f * 6.2831853f * params.steer_min_Hz);
    EXPECT(dwell.wait_s, 0.5f);
    EXPECT(dwell.filter_s, 0.3f);
    EXPECT(dwell.fade_s, 0.5f);
    EXPECT(dwell.settle_s, 3.0f);
    EXPECT(dwell.slew_rad_s2, 0.628318531f);
    EXPECT(dwell.load_A, 0.3f);
    EXPECT(rs_tracking.dwell_gain_ohm_per_s, 1.0f);
    params.steer_min_Hz = 0.0f;
    unit_config_drive(&drive, &params);
    EXPECT(dwell.window_rad_s, 1.88495559f);
    /* .01 of the largest torque, 1.67 times: J k tau^2/p. */
    params.speed_J_kg_m2 = 0.5f;
    params.Rr_ohm = 0.5f;
    params.Lr_H = 0.1f;
    params.M_H = 0.08f;
    params.i_q_max_A = 10.0f;
    unit_config_drive(&drive, &params);
    EXPECT(dwell.amplitude_pu, 0.01f * (4.0f * 0.8f * 0.4f * 10.0f) * 4.0f / (0.5f * 25.0f));
}

static void test_the_heat_gets_its_numbers(void)
{
    params.heat_rise = 0.25f;
    params.heat_s = 1250.0f;
    params.com_rated_A = 12.0f;
    params.i_d_A = 5.0f;
    unit_config_drive(&drive, &params);
    EXPECT(heating.winding_pu, 0.25f);
    EXPECT(heating.tau_s, 1250.0f);
    EXPECT(heating.rated_A, 12.0f);
    EXPECT(heating.i_d_A, 5.0f);
    EXPECT(m_tracking.min_rad_s, 94.2477796f);
    TEST_ASSERT_TRUE(drive.m_tracking.on);
    params.m_track = 0u;
    unit_config_drive(&drive, &params);
    TEST_ASSERT_FALSE(drive.m_tracking.on);
}

static void test_offsets_that_move_get_their_sensors_range(void)
{
    params.current_full_scale_A = 25.0f;
    unit_config_drive(&drive, &params);
    EXPECT(offset_tracking.full_scale_A, 25.0f);
    TEST_ASSERT_TRUE(drive.offset_tracking.on);
    params.observer_gain_enable = 0u; /* the residual of L = 0 is turned otherwise */
    unit_config_drive(&drive, &params);
    TEST_ASSERT_FALSE(drive.offset_tracking.on);
    TEST_ASSERT_TRUE(drive.unbalance_tracking); /* no residual tells it */
    params.observer_gain_enable = 1u;
    params.offset_track = 0u;
    unit_config_drive(&drive, &params);
    TEST_ASSERT_FALSE(drive.offset_tracking.on);
    TEST_ASSERT_FALSE(drive.unbalance_tracking);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_board_inverter_and_loops_get_their_numbers);
    RUN_TEST(test_protection_resistance_and_flux_get_their_numbers);
    RUN_TEST(test_the_curve_needs_a_small_current);
    RUN_TEST(test_a_large_motor_is_measured_with_its_transistors);
    RUN_TEST(test_without_steering_rs_is_tracked_faster_and_further);
    RUN_TEST(test_counts_of_periods_are_rounded);
    RUN_TEST(test_the_blend_is_an_angular_frequency);
    RUN_TEST(test_a_large_resistance_is_tracked_up_to_a_higher_frequency);
    RUN_TEST(test_offsets_that_move_get_their_sensors_range);
    RUN_TEST(test_a_long_level_is_averaged_over_what_floats_can_add);
    RUN_TEST(test_supervisor_and_i_f_get_their_numbers);
    RUN_TEST(test_modes_get_their_numbers);
    RUN_TEST(test_a_direction_bounds_the_speed_of_torque_mode);
    RUN_TEST(test_dwelling_gets_its_numbers);
    RUN_TEST(test_the_heat_gets_its_numbers);
    return UNITY_END();
}
