#include "unit.h"

/* The last line before the hardware: whatever went wrong above, a duty is in 0..1. */
static void write_output(const unit_t *unit, bool gates_on, hal_output_t *output)
{
    const uvw_t d = unit->last.duty;
    const bool valid = is_duty(d.u) && is_duty(d.v) && is_duty(d.w);
    const uvw_t duty = valid ? d : (uvw_t){0.5f, 0.5f, 0.5f};
    *output = (hal_output_t){.duty_u = duty.u,
                             .duty_v = duty.v,
                             .duty_w = duty.w,
                             .gates_on = gates_on && valid,
                             .brake_on = unit->drive.limits.link.brake_on};
}

/* The port counts the crests that a period missed; one is told, two in a row end the drive: in two
 * periods, or in one that took as long. */
static uint32_t late_faults(unit_t *unit, uint16_t late_periods)
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

/* Whoever commands has to be alive while the gates are on. */
COLD static uint32_t silence_faults(unit_t *unit, uint32_t count)
{
    if ((count != unit->command_count) || (unit->mode == DRIVE_OFF)) {
        unit->command_count = count;
        unit->silent_periods = 0u;
    } else if (unit->silent_periods < unit_config(unit)->command_timeout_periods) {
        unit->silent_periods++;
    } else {
        return FAULT_COMMAND_TIMEOUT;
    }
    return 0u;
}

static uint32_t command_faults(unit_t *unit, const unit_command_t *command)
{
    const bool numbers = is_finite(command->omega_m_ref_rad_s + command->torque_ref_Nm);
    const bool watched = unit_config(unit)->command_timeout_periods > 0u;
    return (numbers ? 0u : FAULT_NON_FINITE) |
           (watched ? silence_faults(unit, command->count) : 0u);
}

/* Electrical; none against the direction that is allowed, none in a stop. */
static float speed_reference(const unit_t *unit, float omega_m_ref_rad_s)
{
    const unit_config_t *cfg = unit_config(unit);
    const bool against = cfg->one_way && (cfg->direction * omega_m_ref_rad_s < 0.0f);
    if (against || (unit->aim == DRIVE_AIM_STOP)) {
        return 0.0f;
    }
    return cfg->drive.motor.pole_pairs * omega_m_ref_rad_s;
}

/* The state machine, and what follows from it for the next period. */
COLD static void step_state(unit_t *unit, uint32_t command, uint32_t faults)
{
    const unit_config_t *cfg = unit_config(unit);
    const sequence_in_t in = {.command = command,
                              .faults = faults,
                              .i_raw_A = unit->last.meas.i_raw_A,
                              .u_raw_V = unit->last.meas.u_raw_V,
                              .premagnetising = unit->last.mode.busy,
                              .standing = drive_standing(&unit->drive, cfg->stop_speed_rad_s),
                              .commissioned = unit->commissioned.status == COMMISSIONING_DONE};
    const sequence_out_t out = sequence_step(&cfg->state, &unit->machine, &in);
    if (out.offsets_ready) {
        unit->drive.measurement.offset_A = unit->machine.offset_A;
        unit->drive.measurement.offset_V = unit->machine.offset_V;
    }
    if ((out.mode == DRIVE_COMMISSION) && (unit->mode != DRIVE_COMMISSION)) {
        unit->commissioning = (commissioning_state_t){0};
        unit->commissioned = (commissioning_out_t){.status = COMMISSIONING_BUSY};
    }
    unit->mode = out.mode;
    unit->aim = out.aim;
}

/* After the drive's step: current of this sample, and the voltage that acts from it on. */
COLD static uint32_t commission(unit_t *unit)
{
    const commissioning_in_t in = {.i_A = unit->last.meas.i_s_A,
                                   .u_coming_V = unit->drive.acting.acting_V.alpha};
    unit->commissioned =
        commissioning_step(&unit_config(unit)->commissioning, &unit->commissioning, &in);
    return (unit->commissioned.status == COMMISSIONING_REFUSED) ? FAULT_COMMISSIONING : 0u;
}

/* The operator's command word, or the substitute's after a dip. */
COLD static uint32_t substituted(unit_t *unit, uint32_t command, uint32_t faults)
{
    const auto_restart_in_t in = {.command = command,
                                  .id = unit->machine.id,
                                  .latched = unit->machine.faults,
                                  .faults = faults,
                                  .fed = unit->last.meas.u_dc_V >=
                                         unit_config(unit)->drive.modes.vector.mains.u_back_V};
    return auto_restart_step(&unit_config(unit)->restart, &unit->restart, &in);
}

/* The control law with what is asked of it; its faults and those of the command. */
static uint32_t run_law(unit_t *unit, const hal_sample_t *sample, const unit_command_t *command)
{
    const drive_in_t in = {.sample = {sample->i_u_counts, sample->i_v_counts, sample->i_w_counts,
                                      sample->u_uv_counts, sample->u_vw_counts,
                                      sample->u_dc_counts},
                           .mode = unit->mode,
                           .aim = unit->aim,
                           .omega_e_ref_rad_s = speed_reference(unit, command->omega_m_ref_rad_s),
                           .torque_ref_Nm = command->torque_ref_Nm,
                           .i_d_ref_A = unit->commissioned.i_ref_A};
    drive_step(&unit_config(unit)->drive, &unit->drive, &in, &unit->last);
    uint32_t faults = unit->last.faults | command_faults(unit, command);
    if (unit->mode == DRIVE_COMMISSION) {
        faults |= commission(unit);
    }
    return faults;
}

void unit_control_period(unit_t *unit, const hal_sample_t *sample, hal_output_t *output)
{
    const unit_command_t command = unit->mailbox.slot[unit->mailbox.published & 1u];
    if (unit->change_ready) {
        unit->in_force = 1u - unit->in_force;
        unit->change_ready = false;
    }
    uint32_t faults = unit->mailbox.faults | late_faults(unit, sample->late_periods);
    if ((sample->inputs & HAL_INPUT_BREAK) != 0u) {
        faults |= FAULT_BRAKE_INPUT;
    }
    if (unit->configured) {
        faults |= run_law(unit, sample, &command);
    } else {
        unit->last = (drive_out_t){.duty = {0.5f, 0.5f, 0.5f}};
    }
    const uint32_t word = auto_restart_on(&unit_config(unit)->restart)
                              ? substituted(unit, command.command, faults)
                              : command.command;
    if (!sequence_goes_on(&unit->machine, word, faults)) {
        step_state(unit, word, faults);
    }
    write_output(unit, unit->mode != DRIVE_OFF, output);
    unit->period_count++;
}
