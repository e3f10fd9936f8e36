#include "unit.h"

#include <stddef.h>

#include "crc32c.h"
#include "handover.h"
#include "table_crc.h"
#include "unit_config.h"

/* A stop is over below this electrical speed. */
#define UNIT_STANDING_RAD_S 6.0f

/* False: *cfg is not to be used, and *why says what was refused. */
COLD static bool build(unit_config_t *cfg, const params_t *params, const gain_table_t *table,
                       params_conflict_t *why)
{
    if (!params_check(params, why)) {
        return false;
    }
    drive_params_t drive;
    unit_config_drive(&drive, params);
    cfg->one_way = params->direction != 0u;
    cfg->direction = (params->direction == 1u) ? 1.0f : -1.0f;
    cfg->speed_max_rad_s = params->speed_max_rad_s;
    cfg->stop_speed_rad_s = UNIT_STANDING_RAD_S;
    cfg->command_timeout_periods = (uint32_t)(params->command_timeout_s / params->period_s + 0.5f);
    return drive_init(&cfg->drive, &drive, table) && sequence_init(&cfg->state, params) &&
           auto_restart_init(&cfg->restart, params) &&
           commissioning_init(&cfg->commissioning, params);
}

/* The memory as it lies, padding and all: nobody writes it any more. */
static void remember(unit_t *unit, uint32_t index)
{
    unit->config_crc[index] = crc32c(&unit->config[index], sizeof unit->config[index]);
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
    remember(unit, unit->in_force);
    unit->decided = unit_decisions(unit);
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
    remember(unit, 1u - unit->in_force);
    handover();
    unit->change_ready = unit->configured; /* else for the next start, once saved */
    return good;
}
