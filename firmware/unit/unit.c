#include "unit.h"

#include "unit_config.h"
#include "unit_link_requests.h"
#include "unit_record.h"
#include "unit_store_background.h"
#include "crc32c.h"
#include "handover.h"
#include "trig.h"

#include <math.h>

/* Zero-current offset above this share of full scale is a sensor fault, not an offset. */
#define UNIT_OFFSET_MAX_PU 0.02f

/* Having run for so long after an automatic restart, the drive may use all of them again. */
#define UNIT_RESTART_FORGIVE_S 60.0f

/* Table entries per background slice: a full check of 1801 entries takes 76 slices, and a
 * slice beside the control period no more than two or three periods of the slowest core here. */
#define UNIT_CRC_ENTRIES_PER_SLICE 24u

/* False: *cfg is not to be used. */
COLD static bool build(unit_config_t *cfg, const params_t *params, const gain_table_t *table)
{
    drive_params_t drive;
    unit_config_drive(&drive, params);
    const sequence_params_t state = {
        .offset_s = params->offset_calibration_s,
        .premagnetise_s = params->premagnetise_s,
        .ramp_down_s = params->ramp_down_s,
        .coast_s = params->coast_s,
        .coast_max_V = params->coast_V,
        .stop = (sequence_stop_t)params->stop_mode,
        .offset_max_A = UNIT_OFFSET_MAX_PU * params->current_full_scale_A,
        .offset_max_V = UNIT_OFFSET_MAX_PU * params->line_voltage_full_scale_V,
        .period_s = params->period_s};
    cfg->one_way = params->direction != 0u;
    cfg->direction = (params->direction == 1u) ? 1.0f : -1.0f;
    cfg->stop_speed_rad_s = params->stop_speed_rad_s;
    cfg->command_timeout_periods = (uint32_t)(params->command_timeout_s / params->period_s + 0.5f);
    commissioning_params_t commissioning;
    unit_config_commissioning(&commissioning, params);
    const auto_restart_params_t restart = {.count = params->restart_count,
                                           .delay_s = params->restart_delay_s,
                                           .forgive_s = UNIT_RESTART_FORGIVE_S,
                                           .period_s = params->period_s};
    return drive_init(&cfg->drive, &drive, table) && sequence_init(&cfg->state, &state) &&
           auto_restart_init(&cfg->restart, &restart) &&
           commissioning_init(&cfg->commissioning, &commissioning);
}

/* CRC of everything so far and of the entries first..end-1. */
static uint32_t table_crc(const gain_table_t *table, uint32_t crc, uint32_t first, uint32_t end)
{
    for (uint32_t k = first; k < end; k++) {
        const observer_gain_t gain = gain_table_entry(table, k);
        crc = crc32c_update(crc, &gain, sizeof gain);
    }
    return crc;
}

/* What speaks against the table; with L = 0 none is used. */
static uint32_t table_faults(const unit_t *unit, const gain_table_id_t *made_for)
{
    if (unit->config.drive.estimator.table == NULL) {
        return 0u;
    }
    if (table_crc(unit->table, 0u, 0u, unit->table->entry_count) != unit->table->crc32c) {
        return FAULT_TABLE_CRC;
    }
    const bool other = (made_for != NULL) && !gain_table_is(unit->table, made_for);
    return other ? FAULT_STORE : 0u;
}

bool unit_adopt(unit_t *unit, const gain_table_id_t *made_for)
{
    const bool built = build(&unit->config, &unit->params, unit->table);
    unit->mailbox.faults = built ? table_faults(unit, made_for) : FAULT_CONFIG;
    unit->configured = unit->mailbox.faults == 0u;
    return unit->configured;
}

bool unit_init(unit_t *unit, const params_t *params, const gain_table_t *table)
{
    *unit = (unit_t){.table = table, .mode = DRIVE_OFF};
    unit->params = *params;
    return unit_adopt(unit, NULL);
}

bool unit_reconfigure(unit_t *unit, const params_t *params)
{
    if (!unit->configured) {
        /* For the next start, once saved. */
        const bool fits = build(&unit->next, params, unit->table);
        unit->params = fits ? *params : unit->params;
        return fits;
    }
    unit->next_ready = false; /* one that no period has taken yet is replaced */
    handover();
    const bool good = build(&unit->next, params, unit->table);
    if (good) {
        unit->params = *params;
    } else if (!build(&unit->next, &unit->params, unit->table)) {
        return false; /* they were taken before: cannot be */
    } else {
        /* what was in force, or about to be, stays */
    }
    handover();
    unit->next_ready = true;
    return good;
}

bool unit_at_rest(const unit_t *unit)
{
    const uint32_t command = unit->mailbox.slot[unit->mailbox.published & 1u].command;
    const uint32_t harmless = SEQUENCE_CMD_FAULT_RESET | SEQUENCE_CMD_TORQUE_OFF;
    return (unit->mode == DRIVE_OFF) && ((command & ~harmless) == 0u);
}

void unit_post_command(unit_t *unit, const unit_command_t *command)
{
    const uint32_t next = 1u - (unit->mailbox.published & 1u);
    unit->mailbox.slot[next] = *command;
    unit->mailbox.published = next;
}

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
    } else if (unit->silent_periods < unit->config.command_timeout_periods) {
        unit->silent_periods++;
    } else {
        return FAULT_COMMAND_TIMEOUT;
    }
    return 0u;
}

static uint32_t command_faults(unit_t *unit, const unit_command_t *command)
{
    const bool numbers = is_finite(command->omega_m_ref_rad_s + command->torque_ref_Nm);
    const bool watched = unit->config.command_timeout_periods > 0u;
    return (numbers ? 0u : FAULT_NON_FINITE) |
           (watched ? silence_faults(unit, command->count) : 0u);
}

/* Electrical; none against the direction that is allowed, none in a stop. */
static float speed_reference(const unit_t *unit, float omega_m_ref_rad_s)
{
    const unit_config_t *cfg = &unit->config;
    const bool against = cfg->one_way && (cfg->direction * omega_m_ref_rad_s < 0.0f);
    if (against || (unit->aim == DRIVE_AIM_STOP)) {
        return 0.0f;
    }
    return cfg->drive.motor.pole_pairs * omega_m_ref_rad_s;
}

/* The state machine, and what follows from it for the next period. */
COLD static void step_state(unit_t *unit, uint32_t command, uint32_t faults)
{
    const unit_config_t *cfg = &unit->config;
    const sequence_in_t in = {.command = command,
                              .faults = faults,
                              .i_raw_A = unit->last.meas.i_raw_A,
                              .u_raw_V = unit->last.meas.u_raw_V,
                              .premagnetising = unit->last.premagnetising,
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
    unit->commissioned = commissioning_step(&unit->config.commissioning, &unit->commissioning, &in);
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
                                         unit->config.drive.modes.vector.mains.u_back_V};
    return auto_restart_step(&unit->config.restart, &unit->restart, &in);
}

void unit_control_period(unit_t *unit, const hal_sample_t *sample, hal_output_t *output)
{
    const unit_config_t *cfg = &unit->config;
    const unit_command_t command = unit->mailbox.slot[unit->mailbox.published & 1u];
    if (unit->next_ready) {
        unit->config = unit->next;
        unit->next_ready = false;
    }
    uint32_t faults = unit->mailbox.faults | late_faults(unit, sample->late_periods);
    if ((sample->inputs & HAL_INPUT_BREAK) != 0u) {
        faults |= FAULT_BRAKE_INPUT;
    }

    if (unit->configured) {
        const drive_in_t in = {
            .sample = {sample->i_u_counts, sample->i_v_counts, sample->i_w_counts,
                       sample->u_uv_counts, sample->u_vw_counts, sample->u_dc_counts},
            .mode = unit->mode,
            .aim = unit->aim,
            .omega_e_ref_rad_s = speed_reference(unit, command.omega_m_ref_rad_s),
            .torque_ref_Nm = command.torque_ref_Nm,
            .i_d_ref_A = unit->commissioned.i_ref_A};
        drive_step(&cfg->drive, &unit->drive, &in, &unit->last);
        faults |= unit->last.faults | command_faults(unit, &command);
        if (unit->mode == DRIVE_COMMISSION) {
            faults |= commission(unit);
        }
    } else {
        unit->last = (drive_out_t){.duty = {0.5f, 0.5f, 0.5f}};
    }

    const uint32_t word = auto_restart_on(&cfg->restart)
                              ? substituted(unit, command.command, faults)
                              : command.command;
    if (!sequence_goes_on(&unit->machine, word, faults)) {
        step_state(unit, word, faults);
    }
    write_output(unit, unit->mode != DRIVE_OFF, output);
    unit->period_count++;
}

/* Running check of the table: flash can lose a bit after the check at start. */
static void check_table_slice(unit_t *unit)
{
    const gain_table_t *table = unit->config.drive.estimator.table;
    if (table == NULL) {
        return;
    }
    uint32_t end = unit->crc_entry + UNIT_CRC_ENTRIES_PER_SLICE;
    if (end > table->entry_count) {
        end = table->entry_count;
    }
    unit->crc = table_crc(table, unit->crc, unit->crc_entry, end);
    unit->crc_entry = end;
    if (unit->crc_entry >= table->entry_count) {
        if (unit->crc != table->crc32c) {
            unit->mailbox.faults |= FAULT_TABLE_CRC;
        }
        unit->crc_entry = 0u;
        unit->crc = 0u;
    }
}

COLD void unit_background(unit_t *unit, const hal_devices_t *devices)
{
    if (unit->configured) {
        check_table_slice(unit);
    }
    unit_record_background(unit);
    if (devices != NULL) {
        unit_link_background(unit, devices);
        unit_store_background(unit, devices);
    }
    /* The watchdog is fed only while the control period lives. */
    const uint32_t count = unit->period_count;
    if ((devices != NULL) && (devices->watchdog_serve != NULL) && (count != unit->served_count)) {
        unit->served_count = count;
        devices->watchdog_serve(devices->context);
    }
}

COLD void unit_telemetry(const unit_t *unit, unit_telemetry_t *t)
{
    const unit_config_t *cfg = &unit->config;
    const drive_out_t *o = &unit->last;
    const drive_state_t *d = &unit->drive;
    const estimate_t *e = &d->estimator.estimate;
    const float p = unit->configured ? cfg->drive.motor.pole_pairs : 1.0f;
    *t = (unit_telemetry_t){.state = (uint32_t)unit->machine.id,
                            .faults = unit->machine.faults,
                            .omega_m_hat_rad_s = e->omega_e_rad_s / p,
                            .lambda_hat_Wb = sqrtf(ab_norm2(e->lambda_r_hat_Wb)),
                            .lambda_angle_rad = trig_angle(e->lambda_r_hat_Wb),
                            .i_d_A = o->i_A.d,
                            .i_q_A = o->i_A.q,
                            .i_q_ref_A = o->i_ref_A.q,
                            .e1_alpha_A = e->i_residual_A.alpha,
                            .e1_beta_A = e->i_residual_A.beta,
                            .stator_frequency_Hz = e->omega_s_rad_s / NUM_TWO_PI,
                            .Rs_hat_ohm = unit->configured ? drive_rs_ohm(&cfg->drive, d) : 0.0f,
                            .confidence = (uint32_t)d->supervisor.confidence,
                            .supervisor_reasons = d->supervisor.reasons,
                            .omega_m_bound_rad_s = d->supervisor.omega_bound_rad_s / p,
                            .gain = d->estimator.gain};
}
