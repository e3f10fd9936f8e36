#include "terminals.h"

#include "lapse.h"
#include "terminals_adapt.h"

#define STARTS       (SEQUENCE_CMD_RUN | SEQUENCE_CMD_COMMISSION)
#define UNREAD_STEPS 100u
#define CURRENT_PU   0.02f /* of full scale: what noise and the rest of an offset do not reach */
#define ADAPT_STEPS  128u  /* power of two: the steps may wrap */

/* What the drive does, as far as terminals ask. */
typedef struct {
    bool fault;
    bool ready;
    bool gates_on;
    bool running;
    float omega_m_hat_rad_s;
    float torque_Nm;
} actual_t;

static actual_t look(const unit_t *unit)
{
    unit_telemetry_t t;
    unit_telemetry(unit, &t);
    const params_t *p = &unit->params;
    const float torque_Nm =
        p->pole_pairs * (p->M_H / p->Lr_H) *
        ab_cross(unit->drive.estimator.estimate.lambda_r_hat_Wb, unit->last.meas.i_s_A);
    return (actual_t){.fault = t.state == (uint32_t)SEQUENCE_FAULT,
                      .ready = t.state == (uint32_t)SEQUENCE_READY,
                      .gates_on = unit->asked.mode != DRIVE_OFF,
                      .running = t.state == (uint32_t)SEQUENCE_RUN,
                      .omega_m_hat_rad_s = t.omega_m_hat_rad_s,
                      .torque_Nm = torque_Nm};
}

static uint32_t bit(bool set, uint32_t mask)
{
    return set ? mask : 0u;
}

/* Link or bus take the drive from the contacts; a stop of theirs holds. */
static void note_posted(terminals_state_t *st, const unit_t *unit, uint32_t command)
{
    const uint32_t taken = STARTS | SEQUENCE_CMD_TORQUE_OFF;
    if (((command & taken) != 0u) || (unit->link.commands != st->link_commands)) {
        contacts_withdraw(&st->contacts);
    }
    const uint32_t rising = command & ~st->asked;
    st->reset_asked = st->reset_asked || ((rising & SEQUENCE_CMD_FAULT_RESET) != 0u);
    st->asked = command;
    st->link_commands = unit->link.commands;
}

/* Nobody may run now; a hoist not in torque mode. */
static bool withheld(const terminals_config_t *cfg, const terminals_state_t *st)
{
    const uint32_t torque = SEQUENCE_CMD_RUN | SEQUENCE_CMD_TORQUE_MODE;
    return ((st->faults & terminal_stopping) != 0u) ||
           contacts_stop(&cfg->contacts, &st->contacts) ||
           !precharge_ready(&cfg->precharge, &st->precharge) ||
           (cfg->brake.on && ((st->asked & torque) == torque));
}

/* Run, or commissioning, as far as it is wanted and allowed: RUN of link, bus and contacts. A hoist
 * is not commissioned: the drive gives its motor no torque that holds. */
static uint32_t allowed(const terminals_config_t *cfg, terminals_state_t *st)
{
    const uint32_t starts = cfg->brake.on ? SEQUENCE_CMD_RUN : STARTS;
    const uint32_t wanted = (st->asked & starts) | bit(st->contacts.run, SEQUENCE_CMD_RUN);
    if (withheld(cfg, st)) {
        contacts_withdraw(&st->contacts);
        st->blocked = true;
    } else if (wanted == 0u) {
        st->blocked = false;
    } else {
        /* blocked stays as it is */
    }
    return st->blocked ? 0u : wanted;
}

static float reference_rad_s(const terminals_config_t *cfg, const terminals_state_t *st,
                             const unit_command_t *posted)
{
    if (!st->contacts.run) {
        return posted->omega_m_ref_rad_s;
    }
    const float speed_rad_s = cfg->full_speed_rad_s * (cfg->analog.on ? st->analog.share_pu : 1.0f);
    return contacts_closed(&st->contacts, HAL_TERMINAL_REVERSE) ? -speed_rad_s : speed_rad_s;
}

/* Contacts, reference and sensors; what is wrong with them. Without inputs all stays as it was. */
static uint32_t step_inputs(const terminals_config_t *cfg, terminals_state_t *st,
                            const hal_terminals_t *hal, uint32_t steps)
{
    hal_terminal_in_t in = {0};
    if (!hal->read(hal->context, &in)) {
        st->unread = lapse_stood(st->unread, true, (st->unread < UNREAD_STEPS) ? steps : 0u);
        st->contacts.reset = false;
        return bit(st->unread >= UNREAD_STEPS, TERMINAL_FAULT_INPUTS_LOST);
    }
    st->unread = 0u;
    contacts_step(&cfg->contacts, &st->contacts, in.inputs & hal->fitted, steps);
    const bool lost = analog_reference_step(&cfg->analog, &st->analog, in.analog_counts, steps);
    const bool sink_lost = temperature_step(&cfg->sink, &st->sink, in.sink_counts, steps);
    const bool motor_lost = temperature_step(&cfg->motor, &st->motor, in.motor_counts, steps);
    return bit(lost, cfg->hold ? TERMINAL_FAULT_REFERENCE_HELD : TERMINAL_FAULT_REFERENCE_LOST) |
           bit(sink_lost, TERMINAL_FAULT_SINK_SENSOR) | bit(st->sink.hot, TERMINAL_FAULT_SINK_HOT) |
           bit(sink_lost && st->sink.shorted, TERMINAL_FAULT_SINK_SHORT) |
           bit(motor_lost && st->motor.shorted, TERMINAL_FAULT_MOTOR_SHORT) |
           bit(motor_lost, TERMINAL_FAULT_MOTOR_SENSOR) |
           bit(st->motor.hot, TERMINAL_FAULT_MOTOR_HOT);
}

/* Brake resistor, contactor; a link that was just charged is no under-voltage any more. */
static uint32_t step_supply(const terminals_config_t *cfg, terminals_state_t *st,
                            const unit_t *unit, uint32_t steps)
{
    const float u_dc_V = unit->last.meas.u_dc_V;
    const chopper_watch_in_t chopper = {
        .steps = steps,
        .u_dc_V = u_dc_V,
        .switched_on =
            unit->drive.limits.link.brake_on && ((st->outputs & HAL_TERMINAL_CHOPPER) != 0u),
        /* Not debounced: it switches faster than a contact. */
        .leads = (st->contacts.inputs & HAL_TERMINAL_CHOPPER_LEADS) != 0u};
    const uint32_t resistor = chopper_watch_step(&cfg->chopper, &st->chopper, &chopper);
    const bool was_ready = precharge_ready(&cfg->precharge, &st->precharge);
    const float zero_A = CURRENT_PU * unit->params.current_full_scale_A;
    const precharge_in_t in = {.steps = steps,
                               .u_dc_V = u_dc_V,
                               .closed = contacts_closed(&st->contacts, HAL_TERMINAL_CONTACTOR_ON),
                               .reset = st->reset,
                               .open = (resistor & CHOPPER_WATCH_SHORT) != 0u,
                               .gates_on = unit->asked.mode != DRIVE_OFF,
                               .current = ab_norm2(unit->last.meas.i_s_A) > zero_A * zero_A};
    const uint32_t charging = precharge_step(&cfg->precharge, &st->precharge, &in);
    const uint32_t others = fault_stopping(unit->machine.faults) & ~FAULT_DC_UNDER_VOLTAGE;
    if (!was_ready && precharge_ready(&cfg->precharge, &st->precharge) && (others == 0u)) {
        st->reset = true;
    }
    return bit((resistor & CHOPPER_WATCH_HOT) != 0u, TERMINAL_FAULT_CHOPPER_HOT) |
           bit((resistor & CHOPPER_WATCH_SHORT) != 0u, TERMINAL_FAULT_CHOPPER_SHORT) |
           bit((resistor & CHOPPER_WATCH_OPEN) != 0u, TERMINAL_FAULT_CHOPPER_OPEN) |
           bit((charging & PRECHARGE_TOO_SLOW) != 0u, TERMINAL_FAULT_PRECHARGE) |
           bit((charging & PRECHARGE_CONTACTOR) != 0u, TERMINAL_FAULT_CONTACTOR) |
           bit((charging & PRECHARGE_LINK_LOW) != 0u, TERMINAL_FAULT_LINK_LOW);
}

static uint32_t step_brake(const terminals_config_t *cfg, terminals_state_t *st,
                           const actual_t *actual, const unit_command_t *posted, uint32_t steps)
{
    const bool off = ((st->faults & terminal_opening) != 0u) ||
                     ((posted->command & SEQUENCE_CMD_TORQUE_OFF) != 0u);
    const mech_brake_in_t in = {.steps = steps,
                                .run = (allowed(cfg, st) & SEQUENCE_CMD_RUN) != 0u,
                                .off = off,
                                .omega_ref_rad_s = reference_rad_s(cfg, st, posted),
                                .gates_on = actual->gates_on,
                                .running = actual->running,
                                .torque_Nm = actual->torque_Nm,
                                .omega_hat_rad_s = actual->omega_m_hat_rad_s,
                                /* Debounced there: contact_debounce_s may be too long. */
                                .released =
                                    (st->contacts.inputs & HAL_TERMINAL_BRAKE_RELEASED) != 0u};
    st->braked = mech_brake_step(&cfg->brake, &st->brake, &in);
    const uint32_t faults = st->braked.faults;
    return bit((faults & MECH_BRAKE_NO_TORQUE) != 0u, TERMINAL_FAULT_BRAKE_TORQUE) |
           bit((faults & MECH_BRAKE_NOT_RELEASED) != 0u, TERMINAL_FAULT_BRAKE_NOT_RELEASED) |
           bit((faults & MECH_BRAKE_LOST) != 0u, TERMINAL_FAULT_BRAKE_FEEDBACK) |
           bit((faults & MECH_BRAKE_NOT_CLOSED) != 0u, TERMINAL_FAULT_BRAKE_NOT_CLOSED) |
           bit(cfg->brake.on && ((st->asked & SEQUENCE_CMD_COMMISSION) != 0u),
               TERMINAL_FAULT_COMMISSION_REFUSED);
}

static uint32_t relays(const terminals_config_t *cfg, const terminals_state_t *st,
                       const actual_t *actual)
{
    const bool fault = actual->fault || ((st->faults & terminal_stopping) != 0u);
    const bool ready = actual->gates_on || (actual->ready && !withheld(cfg, st));
    const bool chopper = cfg->chopper.on && !st->chopper.hot &&
                         ((st->faults & (uint32_t)TERMINAL_FAULT_CHOPPER_SHORT) == 0u);
    return bit(ready, HAL_TERMINAL_READY) | bit(!fault, HAL_TERMINAL_NO_FAULT) |
           bit(st->braked.release, HAL_TERMINAL_BRAKE_RELEASE) |
           bit(precharge_close(&st->precharge), HAL_TERMINAL_CONTACTOR) |
           bit(chopper, HAL_TERMINAL_CHOPPER);
}

/* Whole steps since the last look; the first one knows of none before. */
static uint32_t lapse(const terminals_config_t *cfg, terminals_state_t *st, uint32_t now)
{
    const uint32_t periods = now - st->stepped_at;
    const uint32_t counted = (periods < cfg->most_periods) ? periods : cfg->most_periods;
    const uint32_t ns = counted * cfg->period_ns + st->rest_ns;
    st->stepped_at = now;
    if (st->steps == 0u) {
        return 1u;
    }
    st->rest_ns = ns % LAPSE_STEP_NS;
    return ns / LAPSE_STEP_NS;
}

static void step(const terminals_config_t *cfg, terminals_state_t *st, unit_t *unit,
                 const hal_terminals_t *hal, const unit_command_t *posted)
{
    const actual_t actual = look(unit);
    const uint32_t before = st->steps;
    const uint32_t steps = lapse(cfg, st, unit->period_count);
    st->steps = before + steps;
    uint32_t present = step_inputs(cfg, st, hal, steps);
    const bool reset = st->contacts.reset || st->reset_asked;
    st->reset = reset;
    st->reset_asked = false;
    present |= step_supply(cfg, st, unit, steps);
    st->faults = (reset ? 0u : st->faults) | present;
    st->faults |= step_brake(cfg, st, &actual, posted, steps);
    unit->link.terminal_faults = st->faults;
    if ((st->steps / ADAPT_STEPS) != (before / ADAPT_STEPS)) {
        terminals_adapt(cfg, st, unit);
    }
    st->outputs = relays(cfg, st, &actual) & hal->fitted;
    hal->write(hal->context, st->outputs);
}

/* With a brake its sequence runs the drive. */
static void through_brake(const terminals_state_t *st, unit_command_t *command)
{
    const mech_brake_out_t *out = &st->braked;
    command->command &= ~(SEQUENCE_CMD_RUN | SEQUENCE_CMD_TORQUE_MODE);
    command->command |=
        bit(out->run, SEQUENCE_CMD_RUN) | bit(out->torque_mode, SEQUENCE_CMD_TORQUE_MODE);
    command->omega_m_ref_rad_s = out->omega_ref_rad_s;
    command->torque_ref_Nm = out->torque_Nm;
}

unit_command_t terminals_command(const terminals_config_t *cfg, terminals_state_t *st, unit_t *unit,
                                 const hal_terminals_t *hal, unit_command_t posted)
{
    note_posted(st, unit, posted.command);
    if ((unit->period_count - st->stepped_at) >= cfg->step_periods) {
        step(cfg, st, unit, hal, &posted);
    }
    unit_command_t command = posted;
    command.omega_m_ref_rad_s = reference_rad_s(cfg, st, &posted);
    command.command = (posted.command & ~STARTS) | allowed(cfg, st);
    command.count += ((posted.command & STARTS) == 0u) ? st->steps : 0u; /* no other is alive */
    if (st->contacts.run) {
        command.command &= ~SEQUENCE_CMD_TORQUE_MODE;
    }
    if (cfg->brake.on) {
        through_brake(st, &command);
    }
    command.command |= bit(st->reset, SEQUENCE_CMD_FAULT_RESET) |
                       bit((st->faults & terminal_opening) != 0u, SEQUENCE_CMD_TORQUE_OFF);
    return command;
}
