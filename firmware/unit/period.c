#include "unit.h"

static inline bool duties_valid(uvw_t d)
{
    return is_duty(d.u) && is_duty(d.v) && is_duty(d.w);
}

/* The last line before the hardware: whatever went wrong above, a duty is in 0..1. */
static inline void write_output(const unit_t *unit, bool valid, hal_output_t *output)
{
    const uvw_t duty = valid ? unit->last.duty : (uvw_t){0.5f, 0.5f, 0.5f};
    *output = (hal_output_t){.duty_u = duty.u,
                             .duty_v = duty.v,
                             .duty_w = duty.w,
                             .gates_on = valid && (unit->asked.mode != DRIVE_OFF),
                             .brake_on = unit->drive.limits.link.brake_on};
}

/* The port counts the crests that a period missed; one is told, two in a row end the drive: in two
 * periods, or in one that took as long. */
static inline uint32_t late_faults(unit_t *unit, uint16_t late_periods)
{
    if (late_periods == unit->late_periods) {
        unit->late = false;
        return 0u;
    }
    const uint16_t missed = (uint16_t)(late_periods - unit->late_periods);
    const bool again = unit->late || (missed > 1u);
    unit->late = true;
    unit->late_periods = late_periods;
    return FAULT_PERIOD_LATE | (again ? FAULT_PERIOD_OVERRUN : 0u);
}

/* Whoever commands has to be alive while the gates are on; looked at once in sixteen periods. */
COLD static uint32_t silence_faults(unit_t *unit, const unit_config_t *cfg)
{
    const bool watched = cfg->command_timeout_periods > 0u;
    const uint32_t alive = unit->mailbox.alive;
    if ((alive != unit->command_count) || (unit->asked.mode == DRIVE_OFF) || !watched) {
        unit->command_count = alive;
        unit->silent_periods = 0u;
    } else if (unit->silent_periods < cfg->command_timeout_periods) {
        unit->silent_periods += SLOT_COUNT;
    } else {
        return FAULT_COMMAND_TIMEOUT;
    }
    return 0u;
}

/* Electrical and within the largest; none against the direction that is allowed, none in a stop.
 */
COLD static float speed_reference(const unit_config_t *cfg, const unit_t *unit)
{
    const float omega_m_ref_rad_s = unit->command.omega_m_ref_rad_s;
    const bool against = cfg->one_way && (cfg->direction * omega_m_ref_rad_s < 0.0f);
    if (against || (unit->asked.aim == DRIVE_AIM_STOP) || !is_finite(omega_m_ref_rad_s)) {
        return 0.0f;
    }
    return limitf(cfg->drive.motor.pole_pairs * omega_m_ref_rad_s, cfg->speed_max_rad_s);
}

/* A new command or aim: what follows for the law. */
COLD static void ask(unit_t *unit, const unit_config_t *cfg)
{
    unit->taken = unit->mailbox.published;
    unit->command = unit->mailbox.slot[unit->taken & 1u];
    unit->command_faults = 0u;
    if (!is_finite(unit->command.omega_m_ref_rad_s + unit->command.torque_ref_Nm)) {
        unit->command_faults = FAULT_NON_FINITE;
    }
    unit->asked.omega_e_ref_rad_s = speed_reference(cfg, unit);
    unit->asked.torque_ref_Nm = unit->command.torque_ref_Nm;
    unit->decided = unit_decisions(unit);
}

/* The state machine, and what follows from it for the next period. */
APART static void step_state(unit_t *unit, const unit_config_t *cfg, uint32_t command,
                             uint32_t faults)
{
    sequence_in_t in = {.command = command,
                        .faults = faults,
                        .premagnetising = unit->last.premagnetising,
                        .standing = (unit->machine.id == SEQUENCE_RAMP_DOWN) &&
                                    drive_standing(&unit->drive, cfg->stop_speed_rad_s),
                        .commissioned = unit->commissioned.status == COMMISSIONING_DONE};
    if (unit->asked.mode == DRIVE_OFF) { /* else nobody asks for what the sensors show at zero */
        const measured_t *meas = &unit->last.meas;
        in.i_raw_A = measurement_raw_A(&unit->drive.measurement, meas->i_A);
        in.u_raw_V = ab_add(meas->u_line_V, unit->drive.measurement.offset_V);
    }
    const sequence_out_t out = sequence_step(&cfg->state, &unit->machine, &in);
    if (out.offsets_ready) {
        measurement_set_offsets(&unit->drive.measurement, unit->machine.offset_A,
                                unit->machine.offset_V);
    }
    if ((out.mode == DRIVE_COMMISSION) && (unit->asked.mode != DRIVE_COMMISSION)) {
        unit->commissioning = (commissioning_state_t){0};
        unit->commissioned = (commissioning_out_t){.status = COMMISSIONING_BUSY};
        unit->asked.i_d_ref_A = 0.0f;
    }
    const bool new_aim = out.aim != unit->asked.aim;
    unit->asked.mode = out.mode;
    unit->asked.aim = out.aim;
    if (new_aim) {
        ask(unit, cfg);
    }
    unit->decided = unit_decisions(unit);
}

/* After the drive's step: current of this sample, and the voltage that acts from it on. */
COLD static uint32_t commission(unit_t *unit, const unit_config_t *cfg)
{
    const commissioning_in_t in = {.i_A = unit->last.meas.i_s_A,
                                   .u_coming_V = unit->drive.acting.acting_V.alpha};
    unit->commissioned = commissioning_step(&cfg->commissioning, &unit->commissioning, &in);
    unit->asked.i_d_ref_A = unit->commissioned.i_ref_A;
    return (unit->commissioned.status == COMMISSIONING_REFUSED) ? FAULT_COMMISSIONING : 0u;
}

/* The operator's command word, or the substitute's after a dip. */
COLD static uint32_t substituted(unit_t *unit, const unit_config_t *cfg, uint32_t faults)
{
    const auto_restart_in_t in = {.command = unit->command.command,
                                  .id = unit->machine.id,
                                  .latched = unit->machine.faults,
                                  .faults = faults,
                                  .fed = unit->last.meas.u_dc_V >=
                                         cfg->drive.modes.vector.mains.u_back_V};
    return auto_restart_step(&cfg->restart, &unit->restart, &in);
}

/* The control law with what is asked of it; its faults and those of the command. */
static inline uint32_t run_law(unit_t *unit, const unit_config_t *cfg, const hal_sample_t *sample)
{
    drive_step(&cfg->drive, &unit->drive, sample, &unit->asked, &unit->last);
    uint32_t faults = unit->last.faults | unit->command_faults;
    if (unit->drive.slot == SLOT_COMMAND) {
        faults |= silence_faults(unit, cfg);
    }
    if (unit->asked.mode == DRIVE_COMMISSION) {
        faults |= commission(unit, cfg);
    }
    return faults;
}

/* What has come from the background since the last period; the configuration to use. */
static inline const unit_config_t *take_news(unit_t *unit)
{
    if (unit->change_ready) {
        unit->in_force = 1u - unit->in_force;
        unit->change_ready = false;
        unit->asked.omega_e_ref_rad_s = speed_reference(unit_config(unit), unit);
        unit->decided = unit_decisions(unit);
    }
    const unit_config_t *cfg = unit_config(unit);
    if (unit->mailbox.published != unit->taken) {
        ask(unit, cfg);
    }
    return cfg;
}

void unit_control_period(unit_t *unit, const hal_sample_t *sample, hal_output_t *output)
{
    uint32_t faults = unit->mailbox.faults | late_faults(unit, sample->late_periods);
    if (unit->decided != unit_decisions(unit)) {
        faults |= FAULT_CONFIG; /* between two periods: nobody asked for that */
    }
    if ((sample->inputs & HAL_INPUT_BREAK) != 0u) {
        faults |= FAULT_BRAKE_INPUT;
    }
    const unit_config_t *cfg = take_news(unit);
    const mode_id_t mode = unit->drive.mode;
    if (unit->configured) {
        faults |= run_law(unit, cfg, sample);
    } else {
        unit->last = (drive_out_t){.duty = {0.5f, 0.5f, 0.5f}};
    }
    const bool valid = duties_valid(unit->last.duty);
    faults |= valid ? 0u : FAULT_NON_FINITE;
    const uint32_t command =
        auto_restart_on(&cfg->restart) ? substituted(unit, cfg, faults) : unit->command.command;
    if (!sequence_goes_on(&unit->machine, command, faults)) {
        step_state(unit, cfg, command, faults);
    } else if (unit->drive.mode != mode) {
        unit->decided = unit_decisions(unit);
    } else {
        /* as it was, or as news has it */
    }
    write_output(unit, valid, output);
    unit->period_count++;
}
