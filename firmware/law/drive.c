#include "drive.h"

#include <stddef.h>

#include <math.h>

#include "state_sum.h"
#include "trig.h"

/* Below this share of the flux reference the estimate does not say where the flux is. */
#define DRIVE_LAMBDA_MIN_PU 0.05f

/* And of that, the share from which a motor caught in turning is followed. */
#define DRIVE_CAUGHT_MIN_PU 0.01f

/* Periods of the slow turn; the supervisor's own turn ends in period 0. */
#define DRIVE_TURN_LEVEL    2u
#define DRIVE_TURN_STEERING 4u
#define DRIVE_TURN_TRACKING 8u
#define DRIVE_TURN_SCHEDULE 12u

/* Likewise of the supervisor's turn, which goes on in impressed current. */
#define DRIVE_CHECK_VOLTAGE 2u
#define DRIVE_CHECK_STATE   5u
#define DRIVE_CHECK_PHASES  6u
#define DRIVE_CHECK_REST    10u

/* With weakening L's imaginary parts grow with the speed beyond the table's end, up to so many
 * times: no motor runs at more. Without, the last entry holds, as the paper's estimate at its
 * bounds has it. */
#define DRIVE_BEYOND_TABLE_MAX 3.0f

/* Torque current from this share of its limit on is all there is (square of .95). */
#define DRIVE_AT_LIMIT_PU2 0.9f

/* Slower than a slip of so many 1/Tr a motor that brakes takes from the dc link. */
#define DRIVE_FEEDS_TAU 3.0f

static bool init_estimator(drive_config_t *cfg, const drive_params_t *params)
{
    return measurement_init(&cfg->measurement, &params->measurement) &&
           observer_init(&cfg->observer, &cfg->motor, params->period_s,
                         2.0f * params->measurement.current_full_scale_A, params->lambda_max_Wb,
                         params->observer_method) &&
           speed_adaptation_init(&cfg->adaptation, &params->adaptation, &cfg->motor,
                                 params->period_s);
}

static bool init_control(drive_config_t *cfg, const drive_params_t *params)
{
    return speed_control_init(&cfg->speed, &params->speed, &cfg->motor, params->period_s) &&
           speed_ramp_init(&cfg->ramp, &params->ramp, params->period_s) &&
           flux_control_init(&cfg->flux, &params->flux, &cfg->motor, params->period_s) &&
           current_control_init(&cfg->current, &params->current, &cfg->motor, params->period_s) &&
           svpwm_init(&cfg->svpwm, &params->svpwm, params->period_s) &&
           inverter_error_init(&cfg->dead_time, &params->dead_time, params->period_s) &&
           monitor_init(&params->monitor) && link_limit_init(&cfg->link, &params->link) &&
           overload_init(&cfg->overload, &params->overload,
                         (float)DRIVE_SLOW_PERIODS * params->period_s) &&
           plausibility_init(&cfg->plausibility, &params->plausibility,
                             (float)DRIVE_SLOW_PERIODS * params->period_s) &&
           supervisor_init(&cfg->supervisor, &params->supervisor, &cfg->motor, params->period_s);
}

/* The means that go beyond the paper; each is off by its own parameter. */
static bool init_means(drive_config_t *cfg, const drive_params_t *params)
{
    const float turn_s = (float)DRIVE_SLOW_PERIODS * params->period_s;
    return rs_measurement_init(&cfg->rs_measurement, &params->rs_measurement, params->motor.Rs_ohm,
                               params->period_s) &&
           rs_tracking_init(&cfg->rs_tracking, &params->rs_tracking, turn_s) &&
           flux_steering_init(&cfg->steering, &params->steering, &cfg->motor, turn_s) &&
           i_f_init(&cfg->impressed, &params->impressed, &cfg->motor, params->period_s) &&
           drive_modes_init(&cfg->modes, &params->modes, &cfg->motor, params->period_s) &&
           (((params->lost_action != DRIVE_LOST_IMPRESS) &&
             (params->modes.control != DRIVE_CONTROL_IMPRESSED)) ||
            i_f_on(&cfg->impressed));
}

bool drive_init(drive_config_t *cfg, const drive_params_t *params, const gain_table_t *table)
{
    *cfg = (drive_config_t){0};
    if (!positivef(params->period_s) || !nonnegativef(params->voltage_filter_comp_s) ||
        !nonnegativef(params->delay_comp_periods) || !motor_derive(&cfg->motor, &params->motor)) {
        return false;
    }
    if ((params->voltage_source != DRIVE_VOLTAGE_SENSORS) &&
        (params->voltage_source != DRIVE_VOLTAGE_DUTY)) {
        return false;
    }
    if (params->observer_gain_enable) {
        if (!gain_table_valid(table)) {
            return false;
        }
        cfg->table = table;
        cfg->table_end_rad_s = (params->modes.level.voltage_share > 0.0f)
                                   ? (table->step_rad_s * (float)(table->entry_count - 1u))
                                   : FLT_MAX;
    }
    cfg->period_s = params->period_s;
    cfg->voltage_source = params->voltage_source;
    cfg->voltage_filter_comp_s = params->voltage_filter_comp_s;
    cfg->delay_comp_s = params->delay_comp_periods * params->period_s;
    cfg->lambda_min_Wb = DRIVE_LAMBDA_MIN_PU * params->motor.M_H * params->flux.i_d_A;
    cfg->monitor = params->monitor;
    if ((params->lost_action != DRIVE_LOST_TELL) && (params->lost_action != DRIVE_LOST_STOP) &&
        (params->lost_action != DRIVE_LOST_IMPRESS)) {
        return false;
    }
    cfg->lost_action = params->lost_action;
    cfg->dead_time_identify = params->dead_time_identify;
    cfg->inv_lambda_ref_per_Wb = 1.0f / (params->motor.M_H * params->flux.i_d_A);
    return init_estimator(cfg, params) && init_control(cfg, params) && init_means(cfg, params);
}

void drive_reset(drive_state_t *st)
{
    const measurement_state_t measurement = st->measurement;
    *st = (drive_state_t){0};
    st->measurement = measurement;
}

/* Unit vector turned by w t ahead, by an eighth of a turn at most: a wild speed estimate must not
 * spin the voltage. */
static inline ab_t turn_ahead(float omega_rad_s, float time_s)
{
    return trig_unit_small(limitf(omega_rad_s * time_s, TRIG_SMALL_MAX_RAD));
}

/* Beyond the table's end: l1 = .. - j w no longer fits, a braking motor would swing (zh modes). */
COLD static void turn_gain(const drive_config_t *cfg, observer_gain_t *gain, float omega_e_rad_s)
{
    const float turn = minf(absf(omega_e_rad_s) / cfg->table_end_rad_s, DRIVE_BEYOND_TABLE_MAX);
    gain->l1_im_per_s *= turn;
    gain->l2_im_ohm *= turn;
}

static observer_gain_t gain_at(const drive_config_t *cfg, float omega_e_rad_s)
{
    if (cfg->table == NULL) {
        return (observer_gain_t){0.0f, 0.0f, 0.0f, 0.0f};
    }
    observer_gain_t gain = gain_table_at(cfg->table, omega_e_rad_s);
    if (absf(omega_e_rad_s) > cfg->table_end_rad_s) {
        turn_gain(cfg, &gain, omega_e_rad_s);
    }
    return gain;
}

float drive_rs_ohm(const drive_config_t *cfg, const drive_state_t *st)
{
    return cfg->motor.Rs_ohm + st->rs_start_delta_ohm + st->rs_tracking.delta_ohm;
}

COLD bool drive_standing(const drive_state_t *st, float omega_e_max_rad_s)
{
    /* Impressed current does not go by the speed controller's reference. */
    const float reference_rad_s =
        st->impressed.active ? st->impressed.omega_rad_s : st->speed.omega_ref_rad_s;
    return (absf(reference_rad_s) <= omega_e_max_rad_s) &&
           (absf(st->omega_e_hat_rad_s) <= omega_e_max_rad_s);
}

/* Mean voltage over the interval that ended at this sample. */
static ab_t ended_voltage(const drive_config_t *cfg, drive_state_t *st, ab_t u_from_duty,
                          drive_out_t *out)
{
    if (cfg->voltage_source == DRIVE_VOLTAGE_DUTY) {
        return u_from_duty;
    }
    /* The 800 Hz filter delays the reading: at w_s that is an angle (THEORY 4). */
    const ab_t u_V =
        ab_mul(turn_ahead(st->omega_s_hat_rad_s, cfg->voltage_filter_comp_s), out->meas.u_line_V);
    /* After a flying start nobody knows what the legs lose, if that was to be found. */
    if ((st->supervisor.periods == DRIVE_CHECK_VOLTAGE) &&
        (st->dead_time_found || !cfg->dead_time_identify) &&
        plausibility_voltage_wrong(&cfg->plausibility, &st->plausibility, u_V, u_from_duty)) {
        out->faults |= FAULT_VOLTAGE_SENSOR;
    }
    return u_V;
}

/* Premagnetisation: the dc measurement, as far as it is wanted. Commissioning measures itself, and
 * like it looks for what the legs lose. */
static void measure_rs(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *drive_in,
                       ab_t u_from_duty, drive_out_t *out)
{
    if (drive_in->mode == DRIVE_COMMISSION) {
        out->rs_measurement = RS_MEASUREMENT_BUSY;
        out->i_ref_A = (dq_t){drive_in->i_d_ref_A, 0.0f};
        return;
    }
    const rs_measurement_in_t in = {
        .i_A = out->meas.i_s_A.alpha, .u_V = out->u_s_V.alpha, .u_duty_V = u_from_duty.alpha};
    const rs_measurement_out_t rs =
        rs_measurement_step(&cfg->rs_measurement, &st->rs_measurement, &in);
    out->rs_measurement = rs.status;
    out->i_ref_A = (dq_t){rs.i_ref_A, 0.0f};
    if (rs.status == RS_MEASUREMENT_DONE) {
        st->rs_start_delta_ohm = rs.Rs_ohm - cfg->motor.Rs_ohm;
        if (cfg->dead_time_identify) {
            st->dead_time_found = true;
            st->dead_time_pu = rs.lost_V / out->meas.u_dc_V;
        }
    } else if (rs.status == RS_MEASUREMENT_REFUSED) {
        out->faults |= FAULT_STATOR_RESISTANCE;
    } else {
        /* busy, or nothing to do */
    }
}

/* The lower of the two flux references counts: steering acts near zero frequency, the level far
 * from it. */
static void set_flux(const drive_config_t *cfg, drive_state_t *st)
{
    const bool level = st->modes.level.below_Wb > st->steer.below_Wb;
    const float rate_Wb_per_s = level ? st->modes.level.rate_Wb_per_s : st->steer.rate_Wb_per_s;
    st->flux_below_Wb = level ? st->modes.level.below_Wb : st->steer.below_Wb;
    const float less_pu = st->flux_below_Wb * cfg->inv_lambda_ref_per_Wb;
    st->torque_more_pu = less_pu / (1.0f - less_pu);
    st->i_d_less_A = flux_control_less_A(&cfg->flux, st->flux_below_Wb, rate_Wb_per_s);
    st->pull_out_near = st->modes.level.i_q_less_A > 0.0f;
}

/* In RUN, and in the premagnetisation of a motor that was caught in turning. */
static inline bool follows_flux(const drive_state_t *st, const drive_in_t *in)
{
    return (in->mode == DRIVE_RUN) || (st->modes.flying.phase == FLYING_START_CAUGHT);
}

/* The standing current along alpha goes on as magnetising current; all else starts from rest. */
COLD static void stand_still(const drive_config_t *cfg, drive_state_t *st, float i_A)
{
    st->speed = (speed_control_state_t){0};
    st->adaptation = (speed_adaptation_state_t){0};
    st->omega_e_hat_rad_s = 0.0f;
    st->omega_s_hat_rad_s = 0.0f;
    st->observer = (observer_state_t){
        .i_s_hat_A = {i_A, 0.0f},
        .lambda_r_hat_Wb = {minf(cfg->motor.M_H * i_A, cfg->observer.lambda_max_Wb), 0.0f}};
}

/* The search knows speed and flux: the estimator goes on from there. */
COLD static void catch_motor(const drive_config_t *cfg, drive_state_t *st, const drive_out_t *out)
{
    const float omega_rad_s = st->modes.flying.omega_rad_s;
    st->observer = (observer_state_t){.i_s_hat_A = out->meas.i_s_A,
                                      .lambda_r_hat_Wb = st->modes.flying.lambda_Wb};
    st->adaptation = (speed_adaptation_state_t){.x_rad_s = omega_rad_s};
    st->omega_e_hat_rad_s = omega_rad_s;
    st->omega_s_hat_rad_s = omega_rad_s;
    flux_reference_start(&cfg->modes.level, &st->modes.level, omega_rad_s, out->meas.u_dc_V);
    set_flux(cfg, st);
}

COLD static void search(const drive_config_t *cfg, drive_state_t *st, drive_out_t *out)
{
    switch (st->modes.flying.phase) {
    case FLYING_START_STANDS:
        stand_still(cfg, st, st->modes.flying.current_A);
        break;
    case FLYING_START_CAUGHT:
        catch_motor(cfg, st, out);
        break;
    case FLYING_START_REFUSED:
        out->faults |= FAULT_FLYING_START;
        break;
    case FLYING_START_SEARCH:
    default:
        out->rs_measurement = RS_MEASUREMENT_BUSY; /* premagnetisation has to wait */
        break;
    }
}

/* A torque cannot be held without orientation: the speed of now can. */
static float open_reference_rad_s(const drive_state_t *st, const drive_in_t *in)
{
    return (in->aim == DRIVE_AIM_TORQUE) ? st->omega_e_hat_rad_s : in->omega_e_ref_rad_s;
}

/* The speed that counts as wanted, for the end of a stop: in a brake that of its beginning, until
 * its time is over. */
static float open_wanted_rad_s(const drive_config_t *cfg, const drive_state_t *st)
{
    if (st->modes.open != DRIVE_OPEN_BRAKE) {
        return st->omega_e_hat_rad_s;
    }
    return (st->modes.brake_periods < cfg->modes.brake_periods) ? st->modes.brake_omega_rad_s
                                                                : 0.0f;
}

/* I-f begins at the speed a flying start has found; the integrator takes over what the decoupling
 * knew of the EMF. */
COLD static void impress(const drive_config_t *cfg, drive_state_t *st, ab_t i_s_A, ab_t lambda_Wb)
{
    const float omega_rad_s = st->omega_e_hat_rad_s;
    i_f_start(&st->impressed, i_s_A, omega_rad_s);
    st->current.q.x +=
        cfg->current.decoupling * cfg->current.kr * omega_rad_s * sqrtf(ab_norm2(lambda_Wb));
}

/* What acts without orientation, if anything does: then there is nothing to estimate. */
COLD static bool open_loop(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *in,
                           drive_out_t *out)
{
    if (in->mode == DRIVE_COMMISSION) {
        return false;
    }
    const drive_modes_in_t modes_in = {.running = in->mode == DRIVE_RUN,
                                       .torque = in->aim == DRIVE_AIM_TORQUE,
                                       .lost = st->impressed.active,
                                       .omega_ref_rad_s = open_reference_rad_s(st, in),
                                       .omega_hat_rad_s = st->omega_e_hat_rad_s,
                                       .lambda_Wb = st->observer.lambda_r_hat_Wb,
                                       .i_A = out->meas.i_s_A,
                                       .u_V = st->u_acting_V,
                                       .u_dc_V = out->meas.u_dc_V,
                                       .Rs_ohm = drive_rs_ohm(cfg, st)};
    if (drive_modes_select(&cfg->modes, &st->modes, &modes_in)) {
        stand_still(cfg, st, out->meas.i_s_A.alpha);
    }
    if (st->modes.open == DRIVE_OPEN_NONE) {
        return false;
    }
    out->u_s_V = st->u_acting_V;
    st->u_acting_V = st->u_pending_V;
    out->gain = (observer_gain_t){0.0f, 0.0f, 0.0f, 0.0f};
    st->observer = (observer_state_t){.i_s_hat_A = out->meas.i_s_A};
    if (st->modes.open == DRIVE_OPEN_IMPRESSED) {
        if (!st->impressed.active) {
            impress(cfg, st, out->meas.i_s_A, modes_in.lambda_Wb);
        }
        st->omega_e_hat_rad_s = st->impressed.omega_rad_s;
    } else {
        st->modes.u_V = drive_modes_voltage(&cfg->modes, &st->modes, &modes_in);
        st->omega_e_hat_rad_s = st->modes.volts.omega_rad_s; /* 0 where nobody knows */
        st->omega_s_hat_rad_s = st->omega_e_hat_rad_s;
        st->speed.omega_ref_rad_s = open_wanted_rad_s(cfg, st);
    }
    if (st->modes.open == DRIVE_OPEN_SEARCH) {
        search(cfg, st, out);
    }
    return true;
}

/* Observer, stator frequency and adaptation: what the drive believes after this sample. */
static void estimate(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *in,
                     drive_out_t *out)
{
    const ab_t u_from_duty = st->u_acting_V;
    st->u_acting_V = st->u_pending_V;
    out->u_s_V = ended_voltage(cfg, st, u_from_duty, out);
    out->gain = gain_at(cfg, st->omega_e_hat_rad_s);
    const float rs_more_ohm = st->rs_start_delta_ohm + st->rs_tracking.delta_ohm;
    const ab_t u_V = ab_sub(out->u_s_V, ab_scale(out->meas.i_s_A, rs_more_ohm));
    const observer_in_t obs_in = {.u_s_V = u_V,
                                  .i_s_A = out->meas.i_s_A,
                                  .omega_e_hat_rad_s = st->omega_e_hat_rad_s,
                                  .gain = out->gain};
    observer_step(&cfg->observer, &st->observer, &obs_in);

    if (!follows_flux(st, in)) {
        measure_rs(cfg, st, in, u_from_duty, out);
        if (plausibility_current_mirrored(&st->plausibility, out->meas.i_s_A,
                                          st->observer.i_s_hat_A, cfg->monitor.i_trip_A)) {
            /* A vector as long as the trip: its largest phase is at .7 to .8 of it. */
            out->faults |= FAULT_CURRENT_SENSOR;
        }
    } else if (st->impressed.active && !i_f_observable(&cfg->impressed, &st->impressed)) {
        /* Nothing to see: the rotor follows what is impressed, or nothing helps. */
        st->omega_e_hat_rad_s = st->impressed.omega_rad_s;
        st->adaptation.x_rad_s = st->impressed.omega_rad_s;
    } else {
        /* What is imposed is a better guess than what was wanted when the angle was lost. */
        const float prior_rad_s =
            st->impressed.active ? st->impressed.omega_rad_s : st->speed.omega_ref_rad_s;
        const speed_adaptation_in_t ad_in = {.lambda_r_hat_Wb = st->observer.lambda_r_hat_Wb,
                                             .e1_A = st->observer.e1_A,
                                             .omega_s_hat_rad_s = st->omega_s_hat_rad_s,
                                             .omega_e_hat_rad_s = st->omega_e_hat_rad_s,
                                             .prior_rad_s = prior_rad_s,
                                             .gain = out->gain};
        st->omega_e_hat_rad_s =
            speed_adaptation_step(&cfg->adaptation, &st->adaptation, &ad_in).omega_e_hat_rad_s;
    }
}

/* How fast the estimated flux turns, by the flux row of eq. (3): the speed, and the slip that the
 * estimated current and the correction make. With e1 = 0 that is w + (M Rr/Lr) i_q / lambda. */
static inline float flux_frequency(const drive_config_t *cfg, const drive_state_t *st,
                                   observer_gain_t gain, float base_Wb)
{
    const ab_t l2_ohm = {gain.l2_re_ohm, gain.l2_im_ohm};
    const ab_t pull_V = ab_add(ab_scale(st->observer.i_s_hat_A, cfg->observer.m_tau_ohm),
                               ab_mul(l2_ohm, st->observer.e1_A));
    return st->omega_e_hat_rad_s +
           ab_cross(st->observer.lambda_r_hat_Wb, pull_V) / (base_Wb * base_Wb);
}

/* Found at the start, or by the parameters. While the resistance is measured, nothing is added:
 * what the legs lose is looked for. */
static float leg_loss_V(const drive_config_t *cfg, const drive_state_t *st, float u_dc_V)
{
    return st->dead_time_found ? (st->dead_time_pu * u_dc_V)
                               : inverter_error_lost_V(&cfg->dead_time, u_dc_V);
}

/* Voltage reference and current, both turned to when the duty acts -> duty; returns the voltage (at
 * the motor) that the duty gives. */
static ab_t modulate(const drive_config_t *cfg, const drive_state_t *st, ab_t u_ref_V,
                     ab_t i_predicted_A, drive_out_t *out)
{
    const float lost_V =
        (out->rs_measurement == RS_MEASUREMENT_BUSY) ? 0.0f : leg_loss_V(cfg, st, out->meas.u_dc_V);
    const ab_t u_lost_V = inverter_error_voltage(&cfg->dead_time, i_predicted_A, lost_V);
    const svpwm_out_t pwm = svpwm_step(&cfg->svpwm, ab_add(u_ref_V, u_lost_V), out->meas.u_dc_V);
    out->duty = pwm.duty;
    return ab_sub(pwm.u_realised_V, u_lost_V);
}

static void steer_flux(const drive_config_t *cfg, drive_state_t *st, float lambda_Wb, float i_q_A)
{
    st->steer = flux_steering_step(&cfg->steering, &st->steering, st->speed.omega_ref_rad_s,
                                   motor_torque_Nm(&cfg->motor, lambda_Wb, i_q_A));
    set_flux(cfg, st);
}

/* What voltage and torque of now leave of the nominal flux. */
COLD static void level_flux(const drive_config_t *cfg, drive_state_t *st, const drive_out_t *out,
                            float lambda_Wb)
{
    const flux_reference_in_t in = {.u_V = sqrtf(ab_norm2(st->u_pending_V)),
                                    .u_dc_V = out->meas.u_dc_V,
                                    .omega_s_rad_s = st->omega_s_hat_rad_s,
                                    .torque_Nm =
                                        motor_torque_Nm(&cfg->motor, lambda_Wb, out->i_A.q)};
    flux_reference_step(&cfg->modes.level, &st->modes.level, &in);
    set_flux(cfg, st);
}

static void track_rs(const drive_config_t *cfg, drive_state_t *st, ab_t axis, float i_q_A)
{
    const float reference_rad_s = st->speed.omega_ref_rad_s;
    const float moved_rad_s = absf(reference_rad_s - st->omega_ref_before_rad_s);
    const rs_tracking_in_t in = {.Rs_start_ohm = cfg->motor.Rs_ohm + st->rs_start_delta_ohm,
                                 .e1_d_A = ab_dot(axis, st->observer.e1_A),
                                 .i_q_A = i_q_A,
                                 .omega_s_hat_rad_s = st->omega_s_hat_rad_s,
                                 .speed_err_rad_s =
                                     reference_rad_s - st->speed.omega_filtered_rad_s,
                                 .changing = st->steer.moving || (moved_rad_s > 0.0f)};
    rs_tracking_step(&cfg->rs_tracking, &st->rs_tracking, &in);
    st->omega_ref_before_rad_s = reference_rad_s;
}

/* Slow work, each kind in its own period of the turn; the supervisor judges in the last one. */
static void slow_turn(const drive_config_t *cfg, drive_state_t *st, const drive_out_t *out,
                      float lambda_Wb, ab_t axis)
{
    st->slow_period = (st->slow_period + 1u) % DRIVE_SLOW_PERIODS;
    switch (st->slow_period) {
    case DRIVE_TURN_LEVEL:
        if (flux_reference_on(&cfg->modes.level) || (st->modes.level.below_Wb > 0.0f)) {
            level_flux(cfg, st, out, lambda_Wb);
        }
        break;
    case DRIVE_TURN_STEERING:
        if (flux_steering_on(&cfg->steering)) {
            steer_flux(cfg, st, lambda_Wb, out->i_A.q);
        }
        break;
    case DRIVE_TURN_TRACKING:
        if (rs_tracking_on(&cfg->rs_tracking)) {
            track_rs(cfg, st, axis, out->i_A.q);
        }
        break;
    case DRIVE_TURN_SCHEDULE:
        speed_control_schedule(&cfg->speed, &st->speed);
        break;
    default:
        /* nothing this time */
        break;
    }
}

/* Usually the target itself: jerk limit and stop are what makes a difference. */
static float next_reference(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *in)
{
    const bool stop = in->aim == DRIVE_AIM_STOP;
    if (!cfg->ramp.on && !stop) {
        return in->omega_e_ref_rad_s;
    }
    return speed_ramp_step(&cfg->ramp, &st->ramp, st->speed.omega_ref_rad_s, in->omega_e_ref_rad_s,
                           stop);
}

/* What the dc link, the temperatures and pull-out leave of the torque current. */
COLD static torque_window_t torque_window(const drive_config_t *cfg, const drive_state_t *st,
                                          float i_d_A)
{
    float most_A = cfg->speed.i_q_max_A - st->modes.level.i_q_less_A;
    if (st->overload.derating) {
        const float i_A = st->overload.i_max_A;
        most_A = minf(most_A, sqrtf(maxf(i_A * i_A - i_d_A * i_d_A, 0.0f)));
    }
    torque_window_t w = {-most_A, most_A};
    if (st->link.limiting) {
        const float braking_A = st->link.braking_pu * most_A;
        const bool feeds = absf(st->omega_e_hat_rad_s) >= (DRIVE_FEEDS_TAU * cfg->motor.tau_per_s);
        const float motoring_A = maxf(st->link.motoring_pu, feeds ? -1.0f : 0.0f) * most_A;
        w = (st->omega_e_hat_rad_s < 0.0f) ? (torque_window_t){-motoring_A, braking_A}
                                           : (torque_window_t){-braking_A, motoring_A};
    }
    return w;
}

/* Flux control and speed control: the current that is wanted. */
static dq_t torque_current(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *in,
                           float lambda_Wb)
{
    const flux_control_in_t flux_in = {
        .lambda_hat_Wb = lambda_Wb, .below_Wb = st->flux_below_Wb, .less_A = st->i_d_less_A};
    const float i_d_A = flux_control_step(&cfg->flux, &st->flux, &flux_in);
    torque_window_t window;
    const bool limited = st->link.limiting || st->overload.derating || st->pull_out_near;
    if (limited) {
        window = torque_window(cfg, st, i_d_A);
    }
    const bool torque = in->aim == DRIVE_AIM_TORQUE;
    if (torque) {
        st->ramp = (speed_ramp_state_t){0}; /* speed mode will begin without acceleration */
    }
    const speed_control_in_t speed_in = {
        .omega_ref_rad_s = torque ? 0.0f : next_reference(cfg, st, in),
        .omega_hat_rad_s = st->omega_e_hat_rad_s,
        .i_d_ref_A = i_d_A,
        .flux_pu = 1.0f - st->flux_below_Wb * cfg->inv_lambda_ref_per_Wb,
        .inv_flux_pu = 1.0f + st->torque_more_pu,
        .torque = torque,
        .torque_ref_Nm = in->torque_ref_Nm,
        .window = limited ? &window : NULL};
    return (dq_t){i_d_A, speed_control_step(&cfg->speed, &st->speed, &speed_in)};
}

/* No mains: the speed controller follows, and is there with torque and speed of then. i_q: what it
 * wants, and gets while the shaft need not or cannot feed the link. */
COLD static float ride_through(const drive_config_t *cfg, drive_state_t *st, drive_out_t *out,
                               float i_q_A)
{
    mains_loss_step(&cfg->modes.mains, &st->modes.mains, out->meas.u_dc_V, st->omega_e_hat_rad_s);
    if (!st->modes.mains.active) {
        return i_q_A;
    }
    if (st->modes.mains.over) {
        out->faults |= FAULT_MAINS_LOST;
    }
    st->speed.pi.x = st->modes.mains.i_q_A;
    st->speed.i_q_A = st->modes.mains.i_q_A; /* where a torque mode's slew goes on */
    st->ramp = (speed_ramp_state_t){0};
    st->speed.omega_ref_rad_s = st->speed.omega_filtered_rad_s;
    return limitf(st->modes.mains.i_q_A * (1.0f + st->torque_more_pu), cfg->speed.i_q_max_A);
}

/* RUN, or caught in turning: then flux without torque, and a speed controller that waits. */
static dq_t oriented_current(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *in,
                             drive_out_t *out, float lambda_Wb)
{
    dq_t i_ref_A = torque_current(cfg, st, in, lambda_Wb);
    if (in->mode != DRIVE_RUN) {
        st->speed.pi.x = 0.0f;
        st->speed.omega_ref_rad_s = st->omega_e_hat_rad_s;
        st->speed.omega_filtered_rad_s = st->omega_e_hat_rad_s;
        i_ref_A.q = 0.0f;
    } else if (cfg->modes.ride_through &&
               !mains_loss_idle(&cfg->modes.mains, &st->modes.mains, out->meas.u_dc_V)) {
        i_ref_A.q = ride_through(cfg, st, out, i_ref_A.q);
    } else {
        /* as the speed controller says */
    }
    return i_ref_A;
}

/* The voltage comes from elsewhere: the current controllers' integrators follow it, in whatever
 * frame, and take over without a step. */
COLD static dq_t follow(drive_state_t *st, dq_t asked_V, dq_t wanted_V)
{
    st->current.d.x += wanted_V.d - asked_V.d;
    st->current.q.x += wanted_V.q - asked_V.q;
    return wanted_V;
}

/* open: by what acts without orientation. */
static void control(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *in, bool open,
                    drive_out_t *out)
{
    const bool oriented = follows_flux(st, in);
    const ab_t lambda_Wb = st->observer.lambda_r_hat_Wb;
    const float magnitude_Wb = sqrtf(ab_norm2(lambda_Wb));
    /* d axis of the controllers: along the flux, fixed while there is none to follow, as in
     * premagnetisation. A NaN is no flux. */
    float least_Wb = cfg->lambda_min_Wb;
    if (in->mode != DRIVE_RUN) {
        /* Caught without flux: it says where it is from the first, nothing else builds it up. */
        least_Wb = DRIVE_CAUGHT_MIN_PU * cfg->lambda_min_Wb;
    }
    const bool flux = magnitude_Wb > least_Wb;
    ab_t axis = {1.0f, 0.0f};
    if (st->impressed.active) {
        axis = st->impressed.axis;
    } else if (oriented && flux) {
        axis = ab_scale(lambda_Wb, 1.0f / magnitude_Wb);
    } else {
        /* fixed */
    }
    out->i_A = dq_from_ab(out->meas.i_s_A, axis);
    if (st->impressed.active) {
        st->omega_s_hat_rad_s = st->impressed.omega_rad_s;
        out->i_ref_A = (dq_t){st->impressed.current_A, 0.0f};
    } else if (open) {
        out->i_ref_A = out->i_A; /* no error: the controllers only follow */
    } else if (oriented) {
        st->omega_s_hat_rad_s = flux_frequency(cfg, st, out->gain, flux ? magnitude_Wb : least_Wb);
        slow_turn(cfg, st, out, magnitude_Wb, axis);
        out->i_ref_A = oriented_current(cfg, st, in, out, magnitude_Wb);
    } else if (out->rs_measurement != RS_MEASUREMENT_BUSY) {
        const flux_control_in_t flux_in = {.lambda_hat_Wb = magnitude_Wb};
        out->i_ref_A = (dq_t){flux_control_step(&cfg->flux, &st->flux, &flux_in), 0.0f};
    } else {
        /* the measurement has said which current it wants */
    }

    if ((st->supervisor.periods == DRIVE_CHECK_PHASES) && (in->mode == DRIVE_RUN) &&
        plausibility_phase_open(&cfg->plausibility, &st->plausibility, out->meas.i_A,
                                ab_from_dq(out->i_ref_A, axis))) {
        out->faults |= FAULT_OPEN_PHASE;
    }
    const current_control_in_t cc_in = {.i_ref_A = out->i_ref_A,
                                        .i_A = out->i_A,
                                        .omega_s_rad_s = st->omega_s_hat_rad_s,
                                        .omega_e_rad_s = st->omega_e_hat_rad_s,
                                        .lambda_Wb = magnitude_Wb};
    dq_t asked_V = current_control_output(&cfg->current, &st->current, &cc_in);
    /* The duties act later: voltage and current are turned to where the frame will be by then. */
    const ab_t ahead = turn_ahead(st->omega_s_hat_rad_s, cfg->delay_comp_s);
    const ab_t axis_ahead = ab_mul(ahead, axis);
    if (open && !st->impressed.active) {
        asked_V = follow(st, asked_V, dq_from_ab(st->modes.u_V, axis_ahead));
    }
    st->u_pending_V =
        modulate(cfg, st, ab_from_dq(asked_V, axis_ahead), ab_mul(ahead, out->meas.i_s_A), out);
    current_control_update(&cfg->current, &st->current, &cc_in, asked_V,
                           dq_from_ab(st->u_pending_V, axis_ahead));
}

/* The estimate starts again from what is known: the current, nominal flux along it, and the speed
 * that was wanted; a lost one may be anywhere, at its limits included. */
static void take_over(const drive_config_t *cfg, drive_state_t *st, const drive_out_t *out)
{
    const float omega_rad_s = st->speed.omega_ref_rad_s;
    i_f_start(&st->impressed, out->meas.i_s_A, omega_rad_s);
    st->observer = (observer_state_t){
        .i_s_hat_A = out->meas.i_s_A,
        .lambda_r_hat_Wb = ab_scale(st->impressed.axis, 1.0f / cfg->inv_lambda_ref_per_Wb)};
    st->adaptation = (speed_adaptation_state_t){.x_rad_s = omega_rad_s};
    st->omega_e_hat_rad_s = omega_rad_s;
    st->omega_s_hat_rad_s = omega_rad_s;
    st->steering = (flux_steering_state_t){0};
    st->steer = (flux_steering_out_t){0};
    st->rs_tracking = (rs_tracking_state_t){0}; /* what a lost angle made of it */
    set_flux(cfg, st);
}

/* Back to flux orientation with the torque that acts; the current controllers' integrators turn
 * with the frame. */
static void hand_back(const drive_config_t *cfg, drive_state_t *st, const drive_out_t *out)
{
    const ab_t lambda_Wb = st->observer.lambda_r_hat_Wb;
    const float inv_Wb = 1.0f / maxf(sqrtf(ab_norm2(lambda_Wb)), cfg->lambda_min_Wb);
    const ab_t axis = ab_scale(lambda_Wb, inv_Wb);
    const ab_t u_V = ab_from_dq((dq_t){st->current.d.x, st->current.q.x}, st->impressed.axis);
    const dq_t x_V = dq_from_ab(u_V, axis);
    st->current.d.x = x_V.d;
    st->current.q.x = x_V.q;
    /* Torque, as current at nominal flux. */
    const float i_q_A = dq_from_ab(out->meas.i_s_A, axis).q;
    st->speed.pi.x = limitf(i_q_A * cfg->inv_lambda_ref_per_Wb / inv_Wb, cfg->speed.i_q_max_A);
    st->speed.i_q_A = st->speed.pi.x;
    st->speed.omega_ref_rad_s = st->impressed.omega_rad_s;
    st->ramp = (speed_ramp_state_t){0};
    st->speed.omega_filtered_rad_s = st->omega_e_hat_rad_s;
    st->slow_period = st->supervisor.periods; /* it stood still: no part meets another */
    st->impressed = (i_f_state_t){0};
}

/* Lost, or impressed until now: what follows from the supervisor's judgement. */
static void react(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *in,
                  drive_out_t *out)
{
    const bool lost = st->supervisor.confidence == SUPERVISOR_IMPRESSED;
    if (st->impressed.active) {
        /* A torque cannot be held by it: the speed of then can. */
        const float target_rad_s =
            (in->aim == DRIVE_AIM_TORQUE) ? st->speed.omega_ref_rad_s : in->omega_e_ref_rad_s;
        const i_f_in_t imp_in = {
            .omega_ref_rad_s = target_rad_s, .u_dc_V = out->meas.u_dc_V, .lost = lost};
        if (!lost && i_f_observable(&cfg->impressed, &st->impressed)) {
            hand_back(cfg, st, out);
        } else if (i_f_step(&cfg->impressed, &st->impressed, &imp_in)) {
            out->faults |= FAULT_ORIENTATION_LOST;
        } else {
            /* it holds */
        }
    } else if (cfg->lost_action == DRIVE_LOST_IMPRESS) {
        take_over(cfg, st, out);
    } else if (cfg->lost_action == DRIVE_LOST_STOP) {
        out->faults |= FAULT_ORIENTATION_LOST;
    } else {
        /* told only */
    }
}

/* What the estimate claims of power: that of its torque at the speed of its field. */
COLD static bool estimate_wrong(const drive_config_t *cfg, drive_state_t *st,
                                const drive_out_t *out)
{
    const ab_t i_A = out->meas.i_s_A;
    const float heat_W = drive_rs_ohm(cfg, st) * ab_norm2(i_A);
    const float force_Wb_A = cfg->motor.kr * ab_cross(st->observer.lambda_r_hat_Wb, i_A);
    const plausibility_estimate_t in = {.e1_A = st->observer.e1_A,
                                        .lambda_Wb = sqrtf(ab_norm2(st->observer.lambda_r_hat_Wb)),
                                        .lambda_ref_Wb =
                                            cfg->flux.lambda_ref_Wb - st->flux_below_Wb,
                                        .omega_rad_s = st->omega_e_hat_rad_s,
                                        .air_gap_W = ab_dot(out->u_s_V, i_A) - heat_W,
                                        .torque_power_W = force_Wb_A * st->omega_s_hat_rad_s};
    return plausibility_estimate_wrong(&cfg->plausibility, &st->plausibility, &in);
}

/* Temperatures, estimate and stall, once per turn. */
COLD static void look_after(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *in,
                            drive_out_t *out)
{
    const speed_control_config_t *limit = &cfg->speed;
    if (overload_step(&cfg->overload, &st->overload, ab_norm2(out->meas.i_s_A))) {
        out->faults |= FAULT_OVERLOAD;
    }
    if (st->impressed.active) {
        return; /* the estimate is known to be wrong, and the speed is what is impressed */
    }
    if (estimate_wrong(cfg, st, out)) {
        out->faults |= FAULT_OBSERVER;
    }
    const dq_t i_ref_A = out->i_ref_A;
    const float room_A2 = minf(limit->i_q_max2_A2, limit->i_max2_A2 - i_ref_A.d * i_ref_A.d);
    const bool at_limit = (i_ref_A.q * i_ref_A.q) >= (DRIVE_AT_LIMIT_PU2 * room_A2);
    if (plausibility_stalled(&cfg->plausibility, &st->plausibility, at_limit, st->omega_e_hat_rad_s,
                             in->omega_e_ref_rad_s)) {
        out->faults |= FAULT_STALL;
    }
}

/* Nothing estimated, nothing to judge but the temperatures; I-f operation goes on for good. */
COLD static void supervise_open(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *in,
                                drive_out_t *out)
{
    st->supervisor = (supervisor_state_t){0};
    st->slow_period = (st->slow_period + 1u) % DRIVE_SLOW_PERIODS;
    if ((st->slow_period == 0u) &&
        overload_step(&cfg->overload, &st->overload, ab_norm2(out->meas.i_s_A))) {
        out->faults |= FAULT_OVERLOAD;
    }
    if (st->modes.open == DRIVE_OPEN_IMPRESSED) {
        const i_f_in_t imp_in = {.omega_ref_rad_s = open_reference_rad_s(st, in),
                                 .u_dc_V = out->meas.u_dc_V};
        (void)i_f_step(&cfg->impressed, &st->impressed, &imp_in);
    }
}

/* How far all that is to be believed. */
static void supervise(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *in, bool open,
                      drive_out_t *out)
{
    if (in->mode != DRIVE_RUN) {
        st->supervisor = (supervisor_state_t){0};
        st->impressed = (i_f_state_t){0};
        return;
    }
    if (open) {
        supervise_open(cfg, st, in, out);
        return;
    }
    const supervisor_in_t sup_in = {.u_s_V = out->u_s_V,
                                    .i_s_A = out->meas.i_s_A,
                                    .lambda_r_hat_Wb = st->observer.lambda_r_hat_Wb,
                                    .e1_A = st->observer.e1_A,
                                    .l2_ohm = {out->gain.l2_re_ohm, out->gain.l2_im_ohm},
                                    .Rs_ohm = drive_rs_ohm(cfg, st),
                                    .omega_e_hat_rad_s = st->omega_e_hat_rad_s,
                                    .omega_s_hat_rad_s = st->omega_s_hat_rad_s};
    supervisor_step(&cfg->supervisor, &st->supervisor, &sup_in);
    if (st->supervisor.periods == DRIVE_CHECK_REST) {
        look_after(cfg, st, in, out);
    }
    if ((st->supervisor.confidence == SUPERVISOR_IMPRESSED) || st->impressed.active) {
        react(cfg, st, in, out);
    }
}

/* Gates off: nothing to estimate or control; monitor goes on counting. */
static void rest(drive_state_t *st, drive_out_t *out)
{
    const monitor_state_t monitor = st->monitor;
    const link_limit_state_t link = st->link;
    overload_state_t overload;
    overload = st->overload; /* cppcheck takes an initialiser here for a list (rule 9.3) */
    const uint32_t idle_periods = st->idle_periods;
    drive_reset(st);
    st->monitor = monitor;
    st->link = link;
    st->overload = overload;
    st->idle_periods = idle_periods;
    out->duty = (uvw_t){0.5f, 0.5f, 0.5f};
    out->u_s_V = (ab_t){0.0f, 0.0f};
    out->i_ref_A = (dq_t){0.0f, 0.0f};
    out->i_A = (dq_t){0.0f, 0.0f};
    out->gain = (observer_gain_t){0.0f, 0.0f, 0.0f, 0.0f};
}

/* Outside RUN the supervisor's turn stands still, but motor and inverter cool, or are magnetised;
 * with the gates off nothing has to stop for it. */
COLD static void cool(const drive_config_t *cfg, drive_state_t *st, drive_mode_t mode,
                      drive_out_t *out)
{
    st->idle_periods = (st->idle_periods + 1u) % DRIVE_SLOW_PERIODS;
    if ((st->idle_periods == 0u) &&
        overload_step(&cfg->overload, &st->overload, ab_norm2(out->meas.i_s_A)) &&
        (mode != DRIVE_OFF)) {
        out->faults |= FAULT_OVERLOAD;
    }
}

/* Once per turn of whatever counts now. */
static inline bool state_is_due(const drive_state_t *st, const drive_in_t *in, bool open)
{
    const uint32_t turn = (in->mode != DRIVE_RUN) ? st->idle_periods
                          : open                  ? st->slow_period
                                                  : st->supervisor.periods;
    return turn == DRIVE_CHECK_STATE;
}

void drive_step(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *in,
                drive_out_t *out)
{
    float state_sum = state_sum_fast(st);
    bool open = false;
    measurement_step(&cfg->measurement, &st->measurement, &in->sample, &out->meas);
    link_limit_step(&cfg->link, &st->link, out->meas.u_dc_V);
    out->faults = 0u;
    out->rs_measurement = RS_MEASUREMENT_IDLE;
    if (in->mode == DRIVE_OFF) {
        rest(st, out);
    } else {
        open = cfg->modes.any_open && open_loop(cfg, st, in, out);
        if (!open) {
            estimate(cfg, st, in, out);
        }
        control(cfg, st, in, open, out);
        supervise(cfg, st, in, open, out);
    }
    if (in->mode != DRIVE_RUN) {
        cool(cfg, st, in->mode, out);
    }
    if (state_is_due(st, in, open)) {
        state_sum += state_sum_slow(st);
    }
    const monitor_in_t mon_in = {.meas = &out->meas,
                                 .duty = out->duty,
                                 .state_sum = state_sum,
                                 .omega_e_hat_rad_s = st->omega_e_hat_rad_s};
    out->faults |= monitor_step(&cfg->monitor, &st->monitor, &mon_in);
    if (st->link.limiting && (in->mode == DRIVE_RUN)) {
        out->faults |= FAULT_REGENERATION;
    }
    if (st->overload.derating) {
        out->faults |= FAULT_DERATED;
    }
}
