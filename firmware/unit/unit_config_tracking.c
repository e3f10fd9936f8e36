#include "unit_config.h"

/* Rs before the start. */
#define CONFIG_RS_LOW_PU              0.625f
#define CONFIG_RS_BEND_PU             0.4f
#define CONFIG_RS_SMALL_PU            0.3f /* over the threshold: a quarter of it in leg u */
#define CONFIG_IDENTIFY_CURVE         2u
#define CONFIG_RS_CURVE_PU            0.75f /* four levels: Rs bears a flux that moves still */
#define CONFIG_RS_AVERAGE_PU          0.2f
#define CONFIG_RS_AVERAGE_MAX_PERIODS 8191.0f
#define CONFIG_RS_RATIO               1.6f /* of a hot winding: 1.5 */
#define CONFIG_RS_LOSS_V              1.0f /* of the inverter, more at one level than the other */
#define CONFIG_RS_ON_OHM              0.1f /* of a transistor: much for a large motor */

/* Rs tracking: not below this torque current, over i_d; band of the stator frequency; bounds over
 * the start's Rs; frozen so long after a disturbance, a speed error or a reference that moves. */
#define CONFIG_TRACK_I_0_PU      0.7f
#define CONFIG_TRACK_MIN_HZ      0.3f
#define CONFIG_TRACK_MAX_HZ      3.0f
#define CONFIG_TRACK_MAX_STEER   5.0f /* or so many steer_min_Hz: Rs takes more there */
#define CONFIG_TRACK_M_MIN_HZ    15.0f
#define CONFIG_TRACK_LOW_PU      0.98f
#define CONFIG_TRACK_HIGH_PU     1.5f
#define CONFIG_TRACK_QUIET_S     0.5f
#define CONFIG_TRACK_ERR_RAD_S   3.0f
#define CONFIG_TRACK_SLEW_RAD_S2 20.0f
/* While dwelling, over Rs + Rr, as the current misses dRs i/(Rs + Rr): 1 ohm/s for Table 1's motor,
 * an error of Rs dies in a second. */
#define CONFIG_TRACK_DWELL_PER_S 0.6993007f

/* Without flux steering the field may come to rest under load, and then Rs has to be right: tracked
 * this many times as fast, at less torque, sooner after a disturbance, and further down. */
#define CONFIG_TRACK_UNSTEERED_GAIN    3.3333333f
#define CONFIG_TRACK_UNSTEERED_I_0_PU  0.4f
#define CONFIG_TRACK_UNSTEERED_LOW_PU  0.75f
#define CONFIG_TRACK_UNSTEERED_QUIET_S 0.2f

/* Rs at the start and while running. */
static void config_resistance(drive_params_t *d, const params_t *p)
{
    const float low_A = CONFIG_RS_LOW_PU * p->rs_high_A;
    const float small_A = minf(CONFIG_RS_SMALL_PU * p->dead_time_i_threshold_A, 0.5f * low_A);
    const bool curve = p->dead_time_identify == CONFIG_IDENTIFY_CURVE;
    const float level_s = curve ? (CONFIG_RS_CURVE_PU * p->rs_level_s) : p->rs_level_s;
    d->rs_measurement = (rs_measurement_params_t){
        .enable = p->rs_measure != 0u,
        .by_duty = (acting_voltage_source_t)p->voltage_source == ACTING_VOLTAGE_DUTY,
        .level = {{[RS_LEVEL_BEND] = CONFIG_RS_BEND_PU * p->rs_high_A,
                   [RS_LEVEL_HIGH] = p->rs_high_A,
                   [RS_LEVEL_SMALL] = curve ? small_A : 0.0f,
                   [RS_LEVEL_LOW] = low_A}},
        .level_s = level_s,
        .average_s =
            minf(CONFIG_RS_AVERAGE_PU * level_s, CONFIG_RS_AVERAGE_MAX_PERIODS * p->period_s),
        .bias = p->rs_bias,
        .ratio_max = CONFIG_RS_RATIO +
                     maxf(CONFIG_RS_LOSS_V / (p->rs_high_A - low_A), CONFIG_RS_ON_OHM) / p->Rs_ohm};
    d->rs_tracking = (rs_tracking_params_t){
        .gain_ohm_per_rad = p->rs_track_gain,
        .i_0_A = CONFIG_TRACK_I_0_PU * p->i_d_A,
        .min_rad_s = NUM_TWO_PI * CONFIG_TRACK_MIN_HZ,
        .max_rad_s =
            NUM_TWO_PI * maxf(CONFIG_TRACK_MAX_HZ, CONFIG_TRACK_MAX_STEER * p->steer_min_Hz),
        .back_rad_s = NUM_TWO_PI * p->steer_min_Hz,
        .low_pu = CONFIG_TRACK_LOW_PU,
        .high_pu = CONFIG_TRACK_HIGH_PU,
        .quiet_s = CONFIG_TRACK_QUIET_S,
        .speed_err_rad_s = CONFIG_TRACK_ERR_RAD_S,
        .slew_rad_s2 = CONFIG_TRACK_SLEW_RAD_S2,
        .dwell_gain_ohm_per_s = CONFIG_TRACK_DWELL_PER_S * (p->Rs_ohm + p->Rr_ohm)};
    if (!(p->steer_min_Hz > 0.0f)) {
        d->rs_tracking.gain_ohm_per_rad *= CONFIG_TRACK_UNSTEERED_GAIN;
        d->rs_tracking.i_0_A = CONFIG_TRACK_UNSTEERED_I_0_PU * p->i_d_A;
        d->rs_tracking.low_pu = CONFIG_TRACK_UNSTEERED_LOW_PU;
        d->rs_tracking.quiet_s = CONFIG_TRACK_UNSTEERED_QUIET_S;
    }
}

static void config_heating(drive_params_t *d, const params_t *p)
{
    d->m_tracking = (m_tracking_params_t){.on = p->m_track != 0u,
                                          .min_rad_s = NUM_TWO_PI * CONFIG_TRACK_M_MIN_HZ};
    d->offset_tracking =
        (offset_tracking_params_t){.on = (p->offset_track & p->observer_gain_enable) != 0u,
                                   .full_scale_A = p->current_full_scale_A};
    d->unbalance_tracking = p->offset_track != 0u;
    d->heating = (heating_params_t){.winding_pu = p->heat_rise,
                                    .rated_A = p->com_rated_A,
                                    .i_d_A = p->i_d_A,
                                    .tau_s = p->heat_s};
}

void unit_config_tracking(drive_params_t *drive, const params_t *params)
{
    config_resistance(drive, params);
    config_heating(drive, params);
}
