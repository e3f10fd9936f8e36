#include "unit_config.h"

/* Sensors: a flag that lasts so long is a fault. */
#define CONFIG_PLAUSIBILITY_S 0.01f

/* Speed loop: the bandwidth changes from speed_slow_rad_s to so many times that. */
#define CONFIG_SPEED_FAST_PU 1.5079365f

/* Overload of the inverter: a heat sink with its own fan or a cold plate is slower. */
#define CONFIG_INVERTER_S 10.0f

/* Supervisor: firmware/law/README.md says how the thresholds follow from these. */
#define CONFIG_SUP_CORNER_HZ   0.48f
#define CONFIG_SUP_RR_PU       0.3f
#define CONFIG_SUP_I_PU        0.02f
#define CONFIG_SUP_U_PU        0.00025f /* of the line-voltage sensors' full scale */
#define CONFIG_SUP_RESIDUAL_PU 0.43f
#define CONFIG_SUP_LOST_PU     0.6f
#define CONFIG_SUP_CONFIRM_S   0.5f
#define CONFIG_SUP_RETURN_S    0.3f
/* The flux stands although it is steered: below this share of steer_min_Hz (.9 of it while all
 * torque is in use), at this share of the largest torque current, for so long. */
#define CONFIG_SUP_STILL_PU   0.5f
#define CONFIG_SUP_STILL_I_PU 0.2f
#define CONFIG_SUP_STILL_S    0.3f

/* I-f after a lost orientation. */
#define CONFIG_I_F_PER_S     6.6666667f /* share of the current by which its length changes */
#define CONFIG_I_F_RETURN_HZ 1.5f       /* above, the estimator may take back */
#define CONFIG_I_F_TIMEOUT_S 5.0f       /* lost, and no rotor seen, above that for so long: fault */

/* Flux steering: hysteresis over steer_min_Hz, torque at which it begins over that of i_q_max_A,
 * rate over nominal flux. */
#define CONFIG_STEER_HYSTERESIS_PU 0.4f
#define CONFIG_STEER_TORQUE_PU     0.1f
#define CONFIG_STEER_FILTER_S      0.032f
#define CONFIG_STEER_PER_S         0.71126497f

/* Dwelling at zero stator frequency: window over steer_min_Hz, or in Hz without steering (the drive
 * dwells on up to twice the window, no further than steering holds the field); time inside it,
 * filter, time of fading in, time in which the larger modulation of the beginning settles; a
 * reference that moves this fast crosses; torque current over i_d that is load. */
#define CONFIG_DWELL_WINDOW_PU  0.5f
#define CONFIG_DWELL_WINDOW_HZ  0.3f
#define CONFIG_DWELL_WAIT_S     0.5f
#define CONFIG_DWELL_FILTER_S   0.3f
#define CONFIG_DWELL_FADE_S     0.5f
#define CONFIG_DWELL_SETTLE_S   3.0f
#define CONFIG_DWELL_SLEW_RPM_S 1.5f
#define CONFIG_DWELL_LOAD_PU    0.06f
#define CONFIG_DWELL_TORQUE     (0.01f / CONFIG_STEER_TORQUE_PU) /* of the largest: 3 % of rated */

static void config_board(drive_params_t *d, const params_t *p)
{
    d->list = p;
    d->period_s = p->period_s;
    d->motor = (motor_t){.Rs_ohm = p->Rs_ohm,
                         .Rr_ohm = p->Rr_ohm,
                         .Ls_H = p->Ls_H,
                         .Lr_H = p->Lr_H,
                         .M_H = p->M_H,
                         .pole_pairs = p->pole_pairs};
    d->measurement =
        (measurement_params_t){.adc_bits = p->adc_bits,
                               .current_full_scale_A = p->current_full_scale_A,
                               .line_voltage_full_scale_V = p->line_voltage_full_scale_V,
                               .dc_link_full_scale_V = p->dc_link_full_scale_V,
                               .current_sum_max_A = p->current_sum_max_A,
                               .swap_vw = p->swap_vw != 0u};
    d->monitor = (monitor_config_t){.i_trip_A = p->i_trip_A,
                                    .u_dc_max_V = p->u_dc_max_V,
                                    .u_dc_min_V = p->u_dc_min_V,
                                    .omega_max_rad_s = p->over_speed_rad_s,
                                    .plausibility_periods =
                                        (uint32_t)(CONFIG_PLAUSIBILITY_S / p->period_s + 0.5f)};
}

static void config_source(drive_params_t *d, const params_t *p)
{
    d->acting = (acting_voltage_params_t){.source = (acting_voltage_source_t)p->voltage_source,
                                          .filter_comp_s = p->voltage_filter_comp_s,
                                          .blend_rad_s = NUM_TWO_PI * p->voltage_blend_Hz,
                                          .period_s = p->period_s};
}

static void config_speed(drive_params_t *d, const params_t *p)
{
    d->speed = (speed_control_params_t){.bandwidth_rad_s = p->speed_bandwidth_rad_s,
                                        .ki_factor = p->speed_ki_factor,
                                        .J_kg_m2 = p->speed_J_kg_m2,
                                        .lambda_Wb = p->M_H * p->i_d_A,
                                        .i_q_max_A = p->i_q_max_A,
                                        .i_max_A = p->i_max_A,
                                        .filter_s = p->speed_filter_s,
                                        .slew_rad_s2 = p->speed_slew_rad_s2,
                                        .fast_bandwidth_rad_s = p->speed_fast_bandwidth_rad_s,
                                        .slow_rad_s = p->speed_slow_rad_s,
                                        .fast_rad_s = CONFIG_SPEED_FAST_PU * p->speed_slow_rad_s,
                                        .torque_max_rad_s = p->torque_speed_max_rad_s,
                                        .torque_min_rad_s = -p->torque_speed_max_rad_s,
                                        .torque_slew_Nm_per_s = p->torque_slew_Nm_s};
    if (p->direction == 1u) {
        d->speed.torque_min_rad_s = 0.0f;
    } else if (p->direction == 2u) {
        d->speed.torque_max_rad_s = 0.0f;
    } else {
        /* both */
    }
    d->ramp = (speed_ramp_params_t){.acceleration_rad_s2 = p->speed_slew_rad_s2,
                                    .jerk_rad_s3 = p->speed_jerk_rad_s3,
                                    .stop_rad_s2 = p->ramp_down_rad_s2};
}

static void config_voltage(drive_params_t *d, const params_t *p)
{
    d->delay_comp_periods = p->delay_comp_periods;
    /* The integrators never need more than the largest dc link gives. */
    d->current = (current_control_params_t){.bandwidth_rad_s = p->current_bandwidth_rad_s,
                                            .ki_factor = p->current_ki_factor,
                                            .decoupling = p->decoupling,
                                            .u_max_V = p->u_dc_max_V};
    d->svpwm = (svpwm_params_t){.min_pulse_s = p->min_pulse_s,
                                .u_dc_min_V = 0.5f * p->u_dc_min_V + 1.0f,
                                .swap_vw = p->swap_vw != 0u};
    d->dead_time = (inverter_error_params_t){.fraction = p->dead_time_fraction,
                                             .dead_time_s = p->dead_time_s,
                                             .drop_V = p->device_drop_V,
                                             .i_threshold_A = p->dead_time_i_threshold_A};
    d->dead_time_identify = p->dead_time_identify != 0u;
}

/* What protects motor, inverter and dc link, and what judges the sensors. */
static void config_protection(drive_params_t *d, const params_t *p)
{
    d->link = (link_limit_params_t){.chopper_on_V = p->chopper_on_V,
                                    .regen_start_V = p->regen_start_V,
                                    .u_dc_max_V = p->u_dc_max_V};
    d->overload = (overload_params_t){.cont_A = {p->overload_motor_A, p->overload_inverter_A},
                                      .tau_s = {p->overload_motor_s, CONFIG_INVERTER_S},
                                      .i_max_A = p->i_max_A};
    d->plausibility = (plausibility_params_t){.u_V = p->voltage_check_V,
                                              .open_A = p->open_phase_A,
                                              .e1_A = p->observer_e1_A,
                                              .rate_rad_s2 = p->observer_rate_rad_s2,
                                              .power_W = p->observer_power_W,
                                              .stall_s = p->stall_s,
                                              .mains_V = p->mains_V,
                                              .chopper_on_V = p->chopper_on_V};
    d->speed_guard = (speed_guard_params_t){.deviation_rad_s = p->speed_deviation_rad_s,
                                            .deviation_s = p->speed_deviation_s,
                                            .unknown_s = p->speed_unknown_s,
                                            .over_speed_rad_s = p->over_speed_rad_s,
                                            .lambda_nominal_Wb = p->M_H * p->i_d_A};
}

static void config_flux(drive_params_t *d, const params_t *p)
{
    d->flux = (flux_control_params_t){.i_d_A = p->i_d_A, .i_d_max_A = p->i_d_max_A};
    const float lambda_Wb = p->M_H * p->i_d_A;
    const float torque_Nm = p->pole_pairs * (p->M_H / p->Lr_H) * lambda_Wb * p->i_q_max_A;
    d->steering = (flux_steering_params_t){.min_rad_s = NUM_TWO_PI * p->steer_min_Hz,
                                           .hysteresis_rad_s = CONFIG_STEER_HYSTERESIS_PU *
                                                               (NUM_TWO_PI * p->steer_min_Hz),
                                           .lambda_nominal_Wb = p->M_H * p->i_d_A,
                                           .lambda_min_Wb = p->M_H * p->i_d_A * p->steer_flux_min,
                                           .torque_min_Nm = CONFIG_STEER_TORQUE_PU * torque_Nm,
                                           .torque_filter_s = CONFIG_STEER_FILTER_S,
                                           .slew_Wb_per_s = CONFIG_STEER_PER_S * lambda_Wb,
                                           .i_q_max_A = p->i_q_max_A};
}

/* A swing of the speed by k tau at 1.67 tau takes 1.67 k tau^2 J/p of torque: of a large inertia
 * the speed swings less. */
static void config_dwell(drive_params_t *d, const params_t *p)
{
    const float tau_per_s = p->Rr_ohm / p->Lr_H;
    const float most_pu = CONFIG_DWELL_TORQUE * d->steering.torque_min_Nm * p->pole_pairs /
                          (p->speed_J_kg_m2 * tau_per_s * tau_per_s);
    const float window_Hz = (p->steer_min_Hz > 0.0f) ? (CONFIG_DWELL_WINDOW_PU * p->steer_min_Hz)
                                                     : CONFIG_DWELL_WINDOW_HZ;
    d->dwell = (dwell_params_t){.kind = (dwell_kind_t)p->dwell,
                                .amplitude_pu = minf(p->dwell_amplitude, most_pu),
                                .window_rad_s = NUM_TWO_PI * window_Hz,
                                .wait_s = CONFIG_DWELL_WAIT_S,
                                .filter_s = CONFIG_DWELL_FILTER_S,
                                .fade_s = CONFIG_DWELL_FADE_S,
                                .settle_s = CONFIG_DWELL_SETTLE_S,
                                .slew_rad_s2 =
                                    CONFIG_DWELL_SLEW_RPM_S * p->pole_pairs * (NUM_TWO_PI / 60.0f),
                                .load_A = CONFIG_DWELL_LOAD_PU * p->i_d_A};
}

/* What judges the estimate, and what takes over when it is lost. */
static void config_confidence(drive_params_t *d, const params_t *p)
{
    d->supervisor =
        (supervisor_params_t){.corner_rad_s = NUM_TWO_PI * CONFIG_SUP_CORNER_HZ,
                              .Rs_uncertainty_pu = p->sup_Rs_uncertainty,
                              .Rr_uncertainty_pu = CONFIG_SUP_RR_PU,
                              .i_uncertainty_pu = CONFIG_SUP_I_PU,
                              .u_uncertainty_V = CONFIG_SUP_U_PU * p->line_voltage_full_scale_V,
                              .residual_pu = CONFIG_SUP_RESIDUAL_PU,
                              .lost_pu = CONFIG_SUP_LOST_PU,
                              .confirm_s = CONFIG_SUP_CONFIRM_S,
                              .return_s = CONFIG_SUP_RETURN_S,
                              .still_rad_s = NUM_TWO_PI * CONFIG_SUP_STILL_PU * p->steer_min_Hz,
                              .still_A = CONFIG_SUP_STILL_I_PU * p->i_q_max_A,
                              .still_s = CONFIG_SUP_STILL_S,
                              .lambda_nominal_Wb = p->M_H * p->i_d_A,
                              .omega_max_rad_s = p->omega_max_rad_s};
    d->lost_action = (drive_lost_action_t)p->lost_action;
    d->i_f = (i_f_params_t){.current_A = p->i_f_A,
                            .slew_A_per_s = CONFIG_I_F_PER_S * p->i_f_A,
                            .slew_rad_s2 = minf(p->open_loop_slew_rad_s2, p->speed_slew_rad_s2),
                            .return_rad_s = NUM_TWO_PI * CONFIG_I_F_RETURN_HZ,
                            .timeout_s = CONFIG_I_F_TIMEOUT_S};
}

void unit_config_drive(drive_params_t *drive, const params_t *params)
{
    config_board(drive, params);
    config_source(drive, params);
    unit_config_tracking(drive, params);
    config_confidence(drive, params);
    config_speed(drive, params);
    config_flux(drive, params);
    config_dwell(drive, params);
    config_voltage(drive, params);
    config_protection(drive, params);
    unit_config_modes(&drive->modes, params);
}
