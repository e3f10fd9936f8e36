#include "unit_flight.h"

static bool stands_ready(const unit_t *unit)
{
    return (unit->machine.id == SEQUENCE_READY) && (unit->asked.mode == DRIVE_OFF);
}

bool unit_flight_allowed(const unit_t *unit)
{
    return stands_ready(unit) && unit_at_rest(unit) &&
           (unit->params.adc_bits <= FLIGHT_ADC_BITS_MAX);
}

uint32_t unit_flight_digest(const unit_t *unit, const hal_output_t *output, uint32_t before)
{
    const uint32_t word[] = {float_bits(output->duty_u), float_bits(output->duty_v),
                             float_bits(output->duty_w),
                             (uint32_t)unit->machine.id | (output->gates_on ? 0x100u : 0u) |
                                 (output->brake_on ? 0x200u : 0u),
                             unit->machine.faults};
    uint32_t digest = before;
    for (size_t k = 0u; k < sizeof word / sizeof word[0]; k++) {
        digest = flight_fold(digest, word[k]);
    }
    return digest;
}

/* As from unit_init, but for the heat; the next period takes the command that stands. */
static void start_anew(unit_t *unit)
{
    float heat_pu[OVERLOAD_MODELS];
    for (size_t k = 0u; k < (size_t)OVERLOAD_MODELS; k++) {
        heat_pu[k] = unit->drive.limits.overload.heat_pu[k];
    }
    unit->drive = (drive_state_t){0};
    unit->last = (drive_out_t){0};
    unit->machine = (sequence_state_t){0};
    unit->commissioned = (commissioning_out_t){0};
    unit->restart = (auto_restart_state_t){0};
    unit->asked = (drive_in_t){0};
    unit->command = (unit_command_t){0};
    unit->taken = unit->mailbox.published - 1u;
    unit->command_faults = 0u;
    unit->command_count = unit->mailbox.alive;
    unit->silent_periods = 0u;
    unit->late = false;
    for (size_t k = 0u; k < (size_t)OVERLOAD_MODELS; k++) {
        unit->drive.limits.overload.heat_pu[k] = heat_pu[k];
    }
    unit->decided = unit_decisions(unit);
}

/* The gates have been off in READY; what has come since the request may have changed that. */
static void begin(unit_t *unit)
{
    flight_t *f = &unit->flight;
    if (!stands_ready(unit)) {
        flight_stop(f);
        return;
    }
    start_anew(unit);
    f->command = unit->taken;
    f->alive = unit->command_count;
    f->in_force = unit->in_force;
    f->faults = 0u;
    f->late_periods = unit->late_periods;
    const float *heat_pu = unit->drive.limits.overload.heat_pu;
    flight_put_kind(f, FLIGHT_START, f->changes, float_bits(heat_pu[OVERLOAD_MOTOR]),
                    float_bits(heat_pu[OVERLOAD_INVERTER]));
    f->state = (uint32_t)FLIGHT_ON;
}

/* What this period was given beside its sample. */
static void put_news(flight_t *f, const unit_t *unit)
{
    if (unit->in_force != f->in_force) {
        f->in_force = unit->in_force;
        flight_put_kind(f, FLIGHT_PARAMETER, f->changed,
                        float_bits(params_get(&unit->params, f->changed)), f->changes);
    }
    if (unit->taken != f->command) {
        f->command = unit->taken;
        flight_put_kind(f, FLIGHT_COMMAND, unit->command.command,
                        float_bits(unit->command.omega_m_ref_rad_s),
                        float_bits(unit->command.torque_ref_Nm));
    }
    const uint32_t missed = (uint32_t)unit->late_periods - f->late_periods;
    const uint32_t faults = unit->mailbox.faults;
    if ((missed != 0u) || (faults != f->faults)) {
        f->late_periods = unit->late_periods;
        f->faults = faults;
        flight_put_kind(f, FLIGHT_EVENT, missed, faults, 0u);
    }
}

static void put_sample(flight_t *f, const unit_t *unit, const hal_sample_t *s)
{
    const uint32_t alive = unit->mailbox.alive;
    const uint32_t mark = FLIGHT_MARK;
    const uint32_t lives = (alive != f->alive) ? mark : 0u;
    const uint32_t broken = ((s->inputs & HAL_INPUT_BREAK) != 0u) ? mark : 0u;
    f->alive = alive;
    const uint32_t bits = mark - 1u;
    const uint32_t i_u_counts = s->i_u_counts;
    const uint32_t i_v_counts = s->i_v_counts;
    const uint32_t i_w_counts = s->i_w_counts;
    const uint32_t u_uv_counts = s->u_uv_counts;
    const uint32_t u_vw_counts = s->u_vw_counts;
    const uint32_t u_dc_counts = s->u_dc_counts;
    flight_put(f, (i_u_counts & bits) | (((i_v_counts & bits) | lives) << 16u),
               (i_w_counts & bits) | broken | (u_uv_counts << 16u),
               u_vw_counts | (u_dc_counts << 16u));
}

void unit_flight_period(unit_t *unit, const hal_sample_t *sample, const hal_output_t *output)
{
    flight_t *f = &unit->flight;
    if (f->state == (uint32_t)FLIGHT_ASKED) {
        begin(unit);
        return;
    }
    if ((f->state == (uint32_t)FLIGHT_LOST) || !flight_room(f)) {
        f->state = (uint32_t)FLIGHT_LOST;
        f->lost++;
        return;
    }
    put_news(f, unit);
    put_sample(f, unit, sample);
    f->samples++;
    f->digest = unit_flight_digest(unit, output, f->digest);
    if ((f->samples % FLIGHT_CHECK_SAMPLES) == 0u) {
        flight_put_kind(f, FLIGHT_CHECK, 0u, f->digest, f->samples);
    }
}
