#include "app.h"

#include "app_config.h"
#include "app_link_requests.h"
#include "app_record.h"
#include "app_store_background.h"
#include "crc32c.h"
#include "handover.h"
#include "trig.h"

#include <math.h>

/* Zero-current offset above this share of full scale is a sensor fault, not an offset. */
#define APP_OFFSET_MAX_PU 0.02f

/* Having run for so long after an automatic restart, the drive may use all of them again. */
#define APP_RESTART_FORGIVE_S 60.0f

/* Table entries per background slice: a full check of 1801 entries takes 76 slices, and a
 * slice beside the control period no more than two or three periods of the slowest core here. */
#define APP_CRC_ENTRIES_PER_SLICE 24u

/* False: *cfg is not to be used. */
COLD static bool build(app_config_t *cfg, const params_t *params, const gain_table_t *table)
{
    drive_params_t drive;
    app_config_drive(&drive, params);
    const drive_state_params_t state = {
        .offset_s = params->offset_calibration_s,
        .premagnetise_s = params->premagnetise_s,
        .ramp_down_s = params->ramp_down_s,
        .coast_s = params->coast_s,
        .coast_max_V = params->coast_V,
        .stop = (drive_state_stop_t)params->stop_mode,
        .offset_max_A = APP_OFFSET_MAX_PU * params->current_full_scale_A,
        .offset_max_V = APP_OFFSET_MAX_PU * params->line_voltage_full_scale_V,
        .period_s = params->period_s};
    cfg->one_way = params->direction != 0u;
    cfg->direction = (params->direction == 1u) ? 1.0f : -1.0f;
    cfg->stop_speed_rad_s = params->stop_speed_rad_s;
    cfg->command_timeout_periods = (uint32_t)(params->command_timeout_s / params->period_s + 0.5f);
    commissioning_params_t commissioning;
    app_config_commissioning(&commissioning, params);
    const auto_restart_params_t restart = {.count = params->restart_count,
                                           .delay_s = params->restart_delay_s,
                                           .forgive_s = APP_RESTART_FORGIVE_S,
                                           .period_s = params->period_s};
    return drive_init(&cfg->drive, &drive, table) && drive_state_init(&cfg->state, &state) &&
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
static uint32_t table_faults(const app_t *app, const gain_table_id_t *made_for)
{
    if (app->config.drive.table == NULL) {
        return 0u;
    }
    if (table_crc(app->table, 0u, 0u, app->table->entry_count) != app->table->crc32c) {
        return MONITOR_TABLE_CRC;
    }
    const bool other = (made_for != NULL) && !gain_table_is(app->table, made_for);
    return other ? MONITOR_STORE : 0u;
}

bool app_adopt(app_t *app, const gain_table_id_t *made_for)
{
    const bool built = build(&app->config, &app->params, app->table);
    app->mailbox.faults = built ? table_faults(app, made_for) : MONITOR_CONFIG;
    app->configured = app->mailbox.faults == 0u;
    return app->configured;
}

bool app_init(app_t *app, const params_t *params, const gain_table_t *table)
{
    *app = (app_t){.table = table, .mode = DRIVE_OFF};
    app->params = *params;
    return app_adopt(app, NULL);
}

bool app_reconfigure(app_t *app, const params_t *params)
{
    if (!app->configured) {
        /* For the next start, once saved. */
        const bool fits = build(&app->next, params, app->table);
        app->params = fits ? *params : app->params;
        return fits;
    }
    app->next_ready = false; /* one that no period has taken yet is replaced */
    handover();
    const bool good = build(&app->next, params, app->table);
    if (good) {
        app->params = *params;
    } else if (!build(&app->next, &app->params, app->table)) {
        return false; /* they were taken before: cannot be */
    } else {
        /* what was in force, or about to be, stays */
    }
    handover();
    app->next_ready = true;
    return good;
}

bool app_at_rest(const app_t *app)
{
    const uint32_t command = app->mailbox.slot[app->mailbox.published & 1u].command;
    const uint32_t harmless = DRIVE_STATE_CMD_FAULT_RESET | DRIVE_STATE_CMD_TORQUE_OFF;
    return (app->mode == DRIVE_OFF) && ((command & ~harmless) == 0u);
}

void app_post_command(app_t *app, const app_command_t *command)
{
    const uint32_t next = 1u - (app->mailbox.published & 1u);
    app->mailbox.slot[next] = *command;
    app->mailbox.published = next;
}

/* The last line before the hardware: whatever went wrong above, a duty is in 0..1. */
static void write_output(const app_t *app, bool gates_on, hal_output_t *output)
{
    const uvw_t d = app->last.duty;
    const bool valid = is_duty(d.u) && is_duty(d.v) && is_duty(d.w);
    const uvw_t duty = valid ? d : (uvw_t){0.5f, 0.5f, 0.5f};
    *output = (hal_output_t){.duty_u = duty.u,
                             .duty_v = duty.v,
                             .duty_w = duty.w,
                             .gates_on = gates_on && valid,
                             .brake_on = app->drive.link.brake_on};
}

/* The port counts the crests that a period missed; one is told, two in a row end the drive: in two
 * periods, or in one that took as long. */
static uint32_t late_faults(app_t *app, uint16_t late_periods)
{
    if (late_periods == app->late_periods) {
        app->late = false;
        return 0u;
    }
    const uint16_t missed = (uint16_t)(late_periods - app->late_periods);
    const bool again = app->late || (missed > 1u);
    app->late = true;
    app->late_periods = late_periods;
    return MONITOR_PERIOD_LATE | (again ? MONITOR_PERIOD_OVERRUN : 0u);
}

/* Whoever commands has to be alive while the gates are on. */
COLD static uint32_t silence_faults(app_t *app, uint32_t count)
{
    if ((count != app->command_count) || (app->mode == DRIVE_OFF)) {
        app->command_count = count;
        app->silent_periods = 0u;
    } else if (app->silent_periods < app->config.command_timeout_periods) {
        app->silent_periods++;
    } else {
        return MONITOR_COMMAND_TIMEOUT;
    }
    return 0u;
}

static uint32_t command_faults(app_t *app, const app_command_t *command)
{
    const bool numbers = is_finite(command->omega_m_ref_rad_s + command->torque_ref_Nm);
    const bool watched = app->config.command_timeout_periods > 0u;
    return (numbers ? 0u : MONITOR_NON_FINITE) |
           (watched ? silence_faults(app, command->count) : 0u);
}

/* Electrical; none against the direction that is allowed, none in a stop. */
static float speed_reference(const app_t *app, float omega_m_ref_rad_s)
{
    const app_config_t *cfg = &app->config;
    const bool against = cfg->one_way && (cfg->direction * omega_m_ref_rad_s < 0.0f);
    if (against || (app->aim == DRIVE_AIM_STOP)) {
        return 0.0f;
    }
    return cfg->drive.motor.pole_pairs * omega_m_ref_rad_s;
}

/* The state machine, and what follows from it for the next period. */
COLD static void step_state(app_t *app, uint32_t command, uint32_t faults)
{
    const app_config_t *cfg = &app->config;
    const drive_state_in_t in = {.command = command,
                                 .faults = faults,
                                 .i_raw_A = app->last.meas.i_raw_A,
                                 .u_raw_V = app->last.meas.u_raw_V,
                                 .premagnetising = app->last.rs_measurement == RS_MEASUREMENT_BUSY,
                                 .standing = drive_standing(&app->drive, cfg->stop_speed_rad_s),
                                 .commissioned = app->commissioned.status == COMMISSIONING_DONE};
    const drive_state_out_t out = drive_state_step(&cfg->state, &app->machine, &in);
    if (out.offsets_ready) {
        app->drive.measurement.offset_A = app->machine.offset_A;
        app->drive.measurement.offset_V = app->machine.offset_V;
    }
    if ((out.mode == DRIVE_COMMISSION) && (app->mode != DRIVE_COMMISSION)) {
        app->commissioning = (commissioning_state_t){0};
        app->commissioned = (commissioning_out_t){.status = COMMISSIONING_BUSY};
    }
    app->mode = out.mode;
    app->aim = out.aim;
}

/* After the drive's step: current of this sample, and the voltage that acts from it on. */
COLD static uint32_t commission(app_t *app)
{
    const commissioning_in_t in = {.i_A = app->last.meas.i_s_A,
                                   .u_coming_V = app->drive.u_acting_V.alpha};
    app->commissioned = commissioning_step(&app->config.commissioning, &app->commissioning, &in);
    return (app->commissioned.status == COMMISSIONING_REFUSED) ? MONITOR_COMMISSIONING : 0u;
}

/* The operator's command word, or the substitute's after a dip. */
COLD static uint32_t substituted(app_t *app, uint32_t command, uint32_t faults)
{
    const auto_restart_in_t in = {.command = command,
                                  .id = app->machine.id,
                                  .latched = app->machine.faults,
                                  .faults = faults,
                                  .fed = app->last.meas.u_dc_V >=
                                         app->config.drive.modes.mains.u_back_V};
    return auto_restart_step(&app->config.restart, &app->restart, &in);
}

void app_control_period(app_t *app, const hal_sample_t *sample, hal_output_t *output)
{
    const app_config_t *cfg = &app->config;
    const app_command_t command = app->mailbox.slot[app->mailbox.published & 1u];
    if (app->next_ready) {
        app->config = app->next;
        app->next_ready = false;
    }
    uint32_t faults = app->mailbox.faults | late_faults(app, sample->late_periods);
    if ((sample->inputs & HAL_INPUT_BREAK) != 0u) {
        faults |= MONITOR_BRAKE_INPUT;
    }

    if (app->configured) {
        const drive_in_t in = {.sample = {sample->i_u_counts, sample->i_v_counts,
                                          sample->i_w_counts, sample->u_uv_counts,
                                          sample->u_vw_counts, sample->u_dc_counts},
                               .mode = app->mode,
                               .aim = app->aim,
                               .omega_e_ref_rad_s = speed_reference(app, command.omega_m_ref_rad_s),
                               .torque_ref_Nm = command.torque_ref_Nm,
                               .i_d_ref_A = app->commissioned.i_ref_A};
        drive_step(&cfg->drive, &app->drive, &in, &app->last);
        faults |= app->last.faults | command_faults(app, &command);
        if (app->mode == DRIVE_COMMISSION) {
            faults |= commission(app);
        }
    } else {
        app->last = (drive_out_t){.duty = {0.5f, 0.5f, 0.5f}};
    }

    const uint32_t word = auto_restart_on(&cfg->restart) ? substituted(app, command.command, faults)
                                                         : command.command;
    if (!drive_state_goes_on(&app->machine, word, faults)) {
        step_state(app, word, faults);
    }
    write_output(app, app->mode != DRIVE_OFF, output);
    app->period_count++;
}

/* Running check of the table: flash can lose a bit after the check at start. */
static void check_table_slice(app_t *app)
{
    const gain_table_t *table = app->config.drive.table;
    if (table == NULL) {
        return;
    }
    uint32_t end = app->crc_entry + APP_CRC_ENTRIES_PER_SLICE;
    if (end > table->entry_count) {
        end = table->entry_count;
    }
    app->crc = table_crc(table, app->crc, app->crc_entry, end);
    app->crc_entry = end;
    if (app->crc_entry >= table->entry_count) {
        if (app->crc != table->crc32c) {
            app->mailbox.faults |= MONITOR_TABLE_CRC;
        }
        app->crc_entry = 0u;
        app->crc = 0u;
    }
}

COLD void app_background(app_t *app, const hal_devices_t *devices)
{
    if (app->configured) {
        check_table_slice(app);
    }
    app_record_background(app);
    if (devices != NULL) {
        app_link_background(app, devices);
        app_store_background(app, devices);
    }
    /* The watchdog is fed only while the control period lives. */
    const uint32_t count = app->period_count;
    if ((devices != NULL) && (devices->watchdog_serve != NULL) && (count != app->served_count)) {
        app->served_count = count;
        devices->watchdog_serve(devices->context);
    }
}

COLD void app_telemetry(const app_t *app, app_telemetry_t *t)
{
    const app_config_t *cfg = &app->config;
    const drive_out_t *o = &app->last;
    const drive_state_t *d = &app->drive;
    const float p = app->configured ? cfg->drive.motor.pole_pairs : 1.0f;
    *t = (app_telemetry_t){.state = (uint32_t)app->machine.id,
                           .faults = app->machine.faults,
                           .omega_m_hat_rad_s = d->omega_e_hat_rad_s / p,
                           .lambda_hat_Wb = sqrtf(ab_norm2(d->observer.lambda_r_hat_Wb)),
                           .lambda_angle_rad = trig_angle(d->observer.lambda_r_hat_Wb),
                           .i_d_A = o->i_A.d,
                           .i_q_A = o->i_A.q,
                           .i_q_ref_A = o->i_ref_A.q,
                           .e1_alpha_A = d->observer.e1_A.alpha,
                           .e1_beta_A = d->observer.e1_A.beta,
                           .stator_frequency_Hz = d->omega_s_hat_rad_s / NUM_TWO_PI,
                           .Rs_hat_ohm = app->configured ? drive_rs_ohm(&cfg->drive, d) : 0.0f,
                           .confidence = (uint32_t)d->supervisor.confidence,
                           .supervisor_reasons = d->supervisor.reasons,
                           .omega_m_bound_rad_s = d->supervisor.omega_bound_rad_s / p,
                           .gain = o->gain};
}
