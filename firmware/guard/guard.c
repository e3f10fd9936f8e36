#include "guard.h"

/* Torque current from this share of its limit on is all there is (square of .95). */
#define GUARD_AT_LIMIT_PU2 0.9f

/* No more flux is expected than has this EMF over the dc link at the speed of the rotor: Table
 * 1's nominal flux has .58 at nominal speed. Field weakening asks for more than twice the flux that
 * is there where the leakage is larger than known (zh envelope). */
#define GUARD_EMF_PU 0.6f

bool guard_init(guard_config_t *cfg, const monitor_config_t *monitor,
                const plausibility_params_t *plausibility, const guard_sensor_params_t *sensors)
{
    const float schedule_s = (float)SLOT_COUNT * sensors->period_s;
    const liveness_params_t liveness = {.period_s = sensors->period_s,
                                        .Rs_ohm = sensors->Rs_ohm,
                                        .sigma_Ls_H = sensors->sigma_Ls_H,
                                        .i_trip_A = monitor->i_trip_A,
                                        .A_per_count = sensors->A_per_count};
    const current_fit_params_t current_fit = {.period_s = sensors->period_s,
                                              .Rs_ohm = sensors->Rs_ohm,
                                              .sigma_Ls_H = sensors->sigma_Ls_H,
                                              .flux_Wb = sensors->flux_Wb,
                                              .M_H = sensors->M_H};
    cfg->monitor = *monitor;
    frozen_link_init(&cfg->frozen_link, plausibility->chopper_on_V, monitor->i_trip_A);
    current_jump_init(&cfg->current_jump, sensors->period_s, sensors->sigma_Ls_H,
                      monitor->i_trip_A);
    return monitor_init(monitor) &&
           plausibility_init(&cfg->plausibility, plausibility, schedule_s) &&
           mains_check_init(&cfg->mains, plausibility->mains_V, schedule_s) &&
           liveness_init(&cfg->liveness, &liveness) &&
           current_fit_init(&cfg->current_fit, &current_fit);
}

/* What the estimate claims of power: that of its torque at the speed of its field. */
static bool estimate_wrong(const guard_config_t *cfg, guard_state_t *st, const guard_look_t *in)
{
    const estimate_t *e = in->estimate;
    const ab_t i_A = in->meas->i_s_A;
    const float heat_W = in->Rs_ohm * ab_norm2(i_A);
    const float force_Wb_A = cfg->kr * ab_cross(e->lambda_r_hat_Wb, i_A);
    const float room_Wb = GUARD_EMF_PU * in->meas->u_dc_V / absf(e->omega_e_rad_s);
    const plausibility_estimate_t claim = {.e1_A = e->i_residual_A,
                                           .lambda_Wb = e->lambda_Wb,
                                           .lambda_ref_Wb = minf(room_Wb, in->lambda_ref_Wb),
                                           .omega_rad_s = e->omega_e_rad_s,
                                           .air_gap_W = ab_dot(in->u_s_V, i_A) - heat_W,
                                           .torque_power_W = force_Wb_A * e->omega_s_rad_s};
    return plausibility_estimate_wrong(&cfg->plausibility, &st->plausibility, &claim);
}

static bool stalled(const guard_config_t *cfg, guard_state_t *st, const guard_look_t *in)
{
    const dq_t i_ref_A = in->i_ref_A;
    const float room_A2 = minf(cfg->i_q_max2_A2, cfg->i_max2_A2 - i_ref_A.d * i_ref_A.d);
    const bool at_limit = (i_ref_A.q * i_ref_A.q) >= (GUARD_AT_LIMIT_PU2 * room_A2);
    return plausibility_stalled(&cfg->plausibility, &st->plausibility, at_limit,
                                in->estimate->omega_e_rad_s, in->omega_ref_rad_s);
}

static uint32_t look_at_voltage(const guard_config_t *cfg, guard_state_t *st,
                                const guard_look_t *in)
{
    const bool wrong = in->controlled && in->sensed &&
                       plausibility_voltage_wrong(&cfg->plausibility, &st->plausibility, in->u_s_V,
                                                  in->u_duty_V, in->meas->i_A);
    const float power_W = ab_dot(in->u_duty_V, in->meas->i_s_A);
    const float u_dc_V = in->meas->u_dc_V;
    const bool link = mains_check_look(&cfg->mains, &st->mains, u_dc_V, power_W);
    const bool frozen =
        frozen_link_look(&cfg->frozen_link, &st->frozen_link, u_dc_V, power_W, in->brake_on);
    return (wrong || link || frozen) ? FAULT_VOLTAGE_SENSOR : 0u;
}

static uint32_t look_at_phases(const guard_config_t *cfg, guard_state_t *st, const guard_look_t *in)
{
    const bool open =
        in->controlled && plausibility_phase_open(&cfg->plausibility, &st->plausibility,
                                                  in->meas->i_A, ab_from_dq(in->i_ref_A, in->axis));
    return open ? FAULT_OPEN_PHASE : 0u;
}

static uint32_t look_at_estimate(const guard_config_t *cfg, guard_state_t *st,
                                 const guard_look_t *in)
{
    if (!in->oriented) {
        return 0u;
    }
    const uint32_t observer = estimate_wrong(cfg, st, in) ? FAULT_OBSERVER : 0u;
    return observer | (stalled(cfg, st, in) ? FAULT_STALL : 0u);
}

uint32_t guard_look(const guard_config_t *cfg, guard_state_t *st, const guard_look_t *in)
{
    uint32_t faults = liveness_word_frozen(&st->liveness, in->meas->i_A) ? FAULT_ADC_FROZEN : 0u;
    if (link_drop_look(&st->link_drop, in->meas->u_dc_V)) {
        faults |= FAULT_VOLTAGE_SENSOR;
    }
    switch (in->slot) {
    case SLOT_GUARD_VOLTAGE:
        return faults | look_at_voltage(cfg, st, in);
    case SLOT_GUARD_PHASES:
        return faults | look_at_phases(cfg, st, in);
    default: /* SLOT_GUARD_ESTIMATE */
        return faults | look_at_estimate(cfg, st, in);
    }
}

/* A vector as long as the trip: its largest phase is at .7 to .8 of it. */
uint32_t guard_standing(const guard_config_t *cfg, guard_state_t *st, ab_t i_s_A, ab_t i_residual_A)
{
    const bool mirrored = plausibility_current_mirrored(
        &st->plausibility, i_s_A, ab_add(i_s_A, i_residual_A), cfg->monitor.i_trip_A);
    return mirrored ? FAULT_CURRENT_SENSOR : 0u;
}

uint32_t guard_repeated(const guard_config_t *cfg, guard_state_t *st, const measured_t *meas,
                        ab_t u_V)
{
    const liveness_in_t spell = {
        .i_s_A = meas->i_s_A, .u_V = u_V, .emf_V = st->current_fit.emf_V, .u_dc_V = meas->u_dc_V};
    return liveness_frozen(&cfg->liveness, &st->liveness, &spell) ? FAULT_ADC_FROZEN : 0u;
}

uint32_t guard_jumped(uint32_t flags, bool motor_known)
{
    const bool one_sensor = (flags & MEASUREMENT_CURRENT_SUM) != 0u;
    return (motor_known && !one_sensor) ? FAULT_CURRENT_SENSOR : 0u;
}

uint32_t guard_look_at_current(const guard_config_t *cfg, guard_state_t *st, const measured_t *meas,
                               bool motor_known)
{
    const bool fits = current_fit_holds(&cfg->current_fit, &st->current_fit, meas->i_s_A,
                                        meas->u_dc_V, motor_known);
    return fits ? 0u : FAULT_CURRENT_SENSOR;
}
