#include "terminals.h"

#include "lapse.h"

#define STEP_PERIODS_MIN 2u /* the mailbox is read once in each: a reset has to be seen */
#define NS_PER_S         1e9f
#define PERIOD_MIN_NS    1e3f
#define PERIOD_MAX_NS    1e8f
#define LAPSE_MAX_NS     4000000000u /* and a step more fits a word */

/* Steps of a time, at least one. */
static uint32_t steps_of(float time_s)
{
    const float steps = time_s / LAPSE_STEP_S + 0.5f;
    return (steps >= 1.0f) ? (uint32_t)steps : 1u;
}

/* All that is enabled needs. */
static uint32_t needed(const terminal_params_t *p)
{
    const struct {
        bool enabled;
        uint32_t terminals;
    } need[] = {
        {p->start_control != 0u, HAL_TERMINAL_START},
        {p->start_control == (uint32_t)CONTACTS_THREE_WIRE, HAL_TERMINAL_STOP},
        {p->analog_reference != 0u, HAL_TERMINAL_ANALOG},
        {p->brake_control != 0u, HAL_TERMINAL_BRAKE_RELEASE},
        {p->brake_feedback != 0u, HAL_TERMINAL_BRAKE_RELEASED},
        {p->sink_sensor != 0u, HAL_TERMINAL_SINK_SENSOR},
        {p->motor_sensor != 0u, HAL_TERMINAL_MOTOR_SENSOR},
        {p->precharge != 0u, HAL_TERMINAL_CONTACTOR},
        {p->contactor_feedback != 0u, HAL_TERMINAL_CONTACTOR_ON},
        {p->chopper_ohm > 0.0f, HAL_TERMINAL_CHOPPER},
        {p->chopper_feedback != 0u, HAL_TERMINAL_CHOPPER_LEADS},
    };
    uint32_t terminals = 0u;
    for (uint32_t k = 0u; k < sizeof need / sizeof need[0]; k++) {
        terminals |= need[k].enabled ? need[k].terminals : 0u;
    }
    return terminals;
}

static bool analog(terminals_config_t *cfg, const terminal_params_t *p, const hal_terminals_t *hal)
{
    const analog_reference_params_t params = {
        .kind = p->analog_reference,
        .full_scale = hal->analog_full_scale,
        .dead_pu = p->analog_dead_pu,
        .filter_s = p->analog_filter_s,
        .lost_steps = steps_of(p->analog_lost_s),
    };
    cfg->hold = p->analog_lost_action != 0u;
    return analog_reference_init(&cfg->analog, &params);
}

static bool brake(mech_brake_config_t *cfg, const terminal_params_t *p)
{
    *cfg = (mech_brake_config_t){
        .on = p->brake_control != 0u,
        .feedback = p->brake_feedback != 0u,
        .torque_Nm = p->brake_torque_Nm,
        .close_rad_s = p->brake_close_rad_s,
        .prove_steps = steps_of(p->brake_prove_s),
        .release_steps = steps_of(p->brake_release_s),
        .close_steps = steps_of(p->brake_close_s),
        .stop_steps = steps_of(p->brake_stop_s),
    };
    return mech_brake_init(cfg);
}

static bool sensors(terminals_config_t *cfg, const terminal_params_t *p, const hal_terminals_t *hal)
{
    const temperature_config_t both = {.ntc_ohm = p->ntc_ohm,
                                       .ntc_beta_K = p->ntc_beta_K,
                                       .lost_steps = steps_of(p->sensor_lost_s)};
    cfg->sink = both;
    cfg->sink.kind = p->sink_sensor;
    cfg->sink.pullup_ohm = hal->sink_pullup_ohm;
    cfg->sink.derate_degC = p->sink_derate_degC;
    cfg->sink.trip_degC = p->sink_trip_degC;
    cfg->motor = both;
    cfg->motor.kind = p->motor_sensor;
    cfg->motor.pullup_ohm = hal->motor_pullup_ohm;
    cfg->motor.derate_degC = p->motor_derate_degC;
    cfg->motor.trip_degC = p->motor_trip_degC;
    cfg->motor_Rs_degC = p->motor_Rs_degC;
    return temperature_init(&cfg->sink) && temperature_init(&cfg->motor);
}

static bool precharge(precharge_config_t *cfg, const terminal_params_t *p)
{
    *cfg = (precharge_config_t){
        .on = p->precharge != 0u,
        .feedback = p->contactor_feedback != 0u,
        .ready_V = p->precharge_ready_V,
        .charge_steps = steps_of(p->precharge_s),
        .contactor_steps = steps_of(p->contactor_s),
    };
    return precharge_init(cfg);
}

static bool chopper(chopper_watch_config_t *cfg, const terminal_params_t *p)
{
    const chopper_watch_params_t params = {.ohm = p->chopper_ohm,
                                           .rated_W = p->chopper_W,
                                           .tau_s = p->chopper_s,
                                           .step_s = LAPSE_STEP_S,
                                           .feedback = p->chopper_feedback != 0u};
    return chopper_watch_init(cfg, &params);
}

/* Start and stop; a reference beyond the drive's largest would be cut without a word. */
static bool contacts(terminals_config_t *cfg, const terminal_params_t *p, const params_t *drive)
{
    cfg->full_speed_rad_s = p->full_speed_rad_s;
    const bool speed = (p->start_control == 0u) || positivef(p->full_speed_rad_s);
    return speed && (drive->pole_pairs * p->full_speed_rad_s <= drive->speed_max_rad_s) &&
           contacts_init(&cfg->contacts, p->start_control, steps_of(p->contact_debounce_s));
}

terminals_status_t terminals_init(terminals_config_t *cfg, const terminal_params_t *p,
                                  const hal_terminals_t *hal, const params_t *drive)
{
    const float ns = clampf(NS_PER_S * drive->period_s, PERIOD_MIN_NS, PERIOD_MAX_NS);
    const uint32_t period_ns = (uint32_t)(ns + 0.5f);
    const uint32_t periods = (LAPSE_STEP_NS + period_ns - 1u) / period_ns;
    *cfg = (terminals_config_t){.step_periods =
                                    (periods > STEP_PERIODS_MIN) ? periods : STEP_PERIODS_MIN,
                                .most_periods = LAPSE_MAX_NS / period_ns,
                                .period_ns = period_ns};
    if ((needed(p) & ~hal->fitted) != 0u) {
        return TERMINALS_NOT_FITTED;
    }
    if (!contacts(cfg, p, drive)) {
        return TERMINALS_CONTACTS;
    }
    if (!analog(cfg, p, hal)) {
        return TERMINALS_ANALOG;
    }
    if (!brake(&cfg->brake, p)) {
        return TERMINALS_BRAKE;
    }
    if (!sensors(cfg, p, hal)) {
        return TERMINALS_SENSOR;
    }
    if (!precharge(&cfg->precharge, p)) {
        return TERMINALS_PRECHARGE;
    }
    return chopper(&cfg->chopper, p) ? TERMINALS_OK : TERMINALS_CHOPPER;
}
