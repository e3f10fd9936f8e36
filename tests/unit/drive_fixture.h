/* What the tests of the whole control law share: a drive's parameters and its ADC words.
 *
 * Four-entry gain table, the paper's board, either reference machine. Double precision where the
 * firmware is float.
 */
#ifndef DRIVE_FIXTURE_H
#define DRIVE_FIXTURE_H

#include <complex.h>
#include <math.h>

#include "drive_params.h"
#include "params.h"
#include "reference_machine.h"

typedef double complex cplx;

#define THIRD_TURN 2.0943951023931953 /* 2 pi/3 */

static const observer_gain_t test_gain[4] = {{-300.0f, 0.0f, 0.5f, 0.0f},
                                             {-310.0f, 20.0f, 0.4f, -0.1f},
                                             {-330.0f, 45.0f, 0.3f, -0.2f},
                                             {-360.0f, 70.0f, 0.2f, -0.3f}};

static const gain_table_t test_table = {.magic = GAIN_TABLE_MAGIC,
                                        .version = GAIN_TABLE_VERSION,
                                        .motor_id = 1u,
                                        .entry_count = 4u,
                                        .step_rad_s = 5.0f,
                                        .entry = test_gain};

/* The estimator takes its parameters from the list; params_of() sets it anew. */
static params_t estimator_list;

static inline void list_of(motor_t motor)
{
    params_default(&estimator_list);
    estimator_list.Rs_ohm = motor.Rs_ohm;
    estimator_list.Rr_ohm = motor.Rr_ohm;
    estimator_list.Ls_H = motor.Ls_H;
    estimator_list.Lr_H = motor.Lr_H;
    estimator_list.M_H = motor.M_H;
    estimator_list.i_d_A = 4.0f;
    estimator_list.period_s = 200e-6f;
    estimator_list.current_full_scale_A = 25.0f;
    estimator_list.observer_method = 0u;
    estimator_list.observer_gain_enable = 1u;
    estimator_list.lambda_max_Wb = 3.0f;
    estimator_list.adapt_kp = 1.5f;
    estimator_list.adapt_ki = 30.0f;
    estimator_list.eps1 = 0.7f;
    estimator_list.eps1_unit = 0u; /* literal: 1/(s Wb A) */
    estimator_list.eps1_mode = 1u;
    estimator_list.eps1_on_Hz = 1.6f;
    estimator_list.eps1_off_Hz = 1.9f;
    estimator_list.omega_max_rad_s = 600.0f;
    estimator_list.phi_factor = 0.0f;
    estimator_list.weaken_share = 0.0f;
}

static drive_params_t params_of(motor_t motor)
{
    list_of(motor);
    return (drive_params_t){.list = &estimator_list,
                            .period_s = 200e-6f,
                            .motor = motor,
                            .measurement = {.adc_bits = 14u,
                                            .current_full_scale_A = 25.0f,
                                            .line_voltage_full_scale_V = 800.0f,
                                            .dc_link_full_scale_V = 800.0f,
                                            .current_sum_max_A = 3.0f},
                            .acting = {.source = ACTING_VOLTAGE_SENSORS,
                                       .filter_comp_s = 380e-6f,
                                       .period_s = 200e-6f,
                                       .blend_rad_s = 30.0f},
                            .delay_comp_periods = 1.5f,
                            .speed = {.bandwidth_rad_s = 20.0f,
                                      .ki_factor = 0.25f,
                                      .J_kg_m2 = 0.035f,
                                      .lambda_Wb = 0.45f,
                                      .i_q_max_A = 12.0f,
                                      .i_max_A = 15.0f,
                                      .filter_s = 3e-3f,
                                      .slew_rad_s2 = 4000.0f,
                                      .torque_max_rad_s = 300.0f,
                                      .torque_min_rad_s = -200.0f,
                                      .torque_slew_Nm_per_s = 1000.0f},
                            .ramp = {.acceleration_rad_s2 = 4000.0f, .stop_rad_s2 = 500.0f},
                            .flux = {.i_d_A = 4.0f, .i_d_max_A = 8.0f},
                            .current = {.bandwidth_rad_s = 400.0f,
                                        .ki_factor = 0.3f,
                                        .decoupling = 0.9f,
                                        .u_max_V = 400.0f},
                            .svpwm = {.min_pulse_s = 0.0f, .u_dc_min_V = 20.0f},
                            .dead_time = {.fraction = 0.9f,
                                          .dead_time_s = 2e-6f,
                                          .drop_V = 1.0f,
                                          .i_threshold_A = 0.25f},
                            .monitor = {.i_trip_A = 20.0f,
                                        .u_dc_max_V = 700.0f,
                                        .u_dc_min_V = 100.0f,
                                        .omega_max_rad_s = 700.0f,
                                        .plausibility_periods = 50u},
                            .speed_guard = {.deviation_rad_s = 1e4f, /* the currents are made up */
                                            .deviation_s = 10.0f,
                                            .unknown_s = 60.0f,
                                            .over_speed_rad_s = 1e4f,
                                            .lambda_nominal_Wb = 0.45f},
                            .link = {.u_dc_max_V = 700.0f},
                            .overload = {.tau_s = {100.0f, 10.0f}, .i_max_A = 15.0f},
                            .supervisor = {.corner_rad_s = 3.0f,
                                           .Rs_uncertainty_pu = 0.05f,
                                           .residual_pu = 0.43f,
                                           .lost_pu = 0.6f,
                                           .lambda_nominal_Wb = 0.45f,
                                           .omega_max_rad_s = 600.0f}};
}

static inline void phases_of(cplx x, double out[3])
{
    for (int n = 0; n < 3; n++) {
        out[n] = sqrt(2.0 / 3.0) * creal(x * cexp(-I * THIRD_TURN * n));
    }
}

static inline uint16_t counts(double value, double full_scale)
{
    return (uint16_t)(8192 + (int)lrint(value / full_scale * 8192.0));
}

/* ADC words of a rotating current and voltage; both machines' board. */
static inline measurement_in_t words(const drive_params_t *p, int k, double amps, double volts,
                                     double u_dc)
{
    const cplx i = amps * cexp(I * (0.3 + 0.011 * k));
    const cplx u = volts * cexp(I * (0.9 + 0.012 * k));
    double ip[3], up[3];
    phases_of(i, ip);
    phases_of(u, up);
    const double fs = (double)p->measurement.line_voltage_full_scale_V;
    return (measurement_in_t){.i_u_counts = counts(ip[0], 25.0),
                              .i_v_counts = counts(ip[1], 25.0),
                              .i_w_counts = counts(ip[2], 25.0),
                              .u_uv_counts = counts(up[0] - up[1], fs),
                              .u_vw_counts = counts(up[1] - up[2], fs),
                              .u_dc_counts = (uint16_t)lrint(
                                  u_dc / (double)p->measurement.dc_link_full_scale_V * 16384.0)};
}

static inline drive_params_t both_machines(int n)
{
    return params_of(reference_machine[n]);
}

#endif
