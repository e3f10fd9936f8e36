#include "unit.h"

#include <stddef.h>

#include "handover.h"
#include "table_crc.h"
#include "unit_config.h"

/* Zero-current offset above this share of full scale is a sensor fault, not an offset. */
#define UNIT_OFFSET_MAX_PU 0.02f

/* A stop is over below this electrical speed. */
#define UNIT_STANDING_RAD_S 6.0f

/* Having run for so long after an automatic restart, the drive may use all of them again. */
#define UNIT_RESTART_FORGIVE_S 60.0f

/* False: *cfg is not to be used, and *why says what was refused. */
COLD static bool build(unit_config_t *cfg, const params_t *params, const gain_table_t *table,
                       params_conflict_t *why)
{
    if (!params_check(params, why)) {
        return false;
    }
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
    cfg->stop_speed_rad_s = UNIT_STANDING_RAD_S;
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

/* What speaks against the table; with L = 0 none is used. */
static uint32_t table_faults(const unit_t *unit, const gain_table_id_t *made_for)
{
    if (estimator_table(&unit_config(unit)->drive.estimator) == NULL) {
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
    unit_config_t *cfg = &unit->config[unit->in_force];
    const bool built = build(cfg, &unit->params, unit->table, &unit->refused);
    unit->mailbox.faults = built ? table_faults(unit, made_for) : FAULT_CONFIG;
    unit->configured = unit->mailbox.faults == 0u;
    return unit->configured;
}

bool unit_init(unit_t *unit, const params_t *params, const gain_table_t *table)
{
    *unit = (unit_t){.table = table};
    unit->params = *params;
    return unit_adopt(unit, NULL);
}

bool unit_reconfigure(unit_t *unit, const params_t *params)
{
    /* From here on no period changes in_force: a change that none has taken yet is replaced. */
    unit->change_ready = false;
    handover();
    unit_config_t *next = &unit->config[1u - unit->in_force];
    const bool good = build(next, params, unit->table, &unit->refused);
    params_conflict_t before;
    if (good) {
        unit->params = *params;
    } else if (!build(next, &unit->params, unit->table, &before)) {
        return false; /* without a configuration that was ever taken */
    } else {
        /* what was in force, or about to be, stays */
    }
    handover();
    unit->change_ready = unit->configured; /* else for the next start, once saved */
    return good;
}
