#include "unit_store.h"

#include "unit.h"
#include "unit_store_background.h"

#include <stddef.h>

#define PERIODS_PER_TICK 512u

static param_store_config_t store_config(const unit_t *unit, const hal_devices_t *devices)
{
    static const param_rename_t renamed[] = {
#define PARAM_RENAMED(before, now) {#before, #now},
#define PARAM_CONSTANT(before, value)
#define PARAM_DROPPED(before, text)
#include "param_former.def"
    };
    param_store_config_t cfg = {.flash = devices->flash,
                                .rename = renamed,
                                .rename_count = sizeof renamed / sizeof renamed[0]};
    if (unit->table != NULL) {
        cfg.table = (gain_table_id_t){unit->table->motor_id, unit->table->crc32c};
    }
    return cfg;
}

static void start_access(unit_t *unit, const hal_devices_t *devices)
{
    const float tick_s = (float)PERIODS_PER_TICK * unit->params.period_s;
    if (!access_init(&unit->store.access_cfg, devices->access_key,
                     1u + (uint32_t)(UNIT_STORE_LOCKOUT_S / tick_s),
                     1u + (uint32_t)(UNIT_STORE_CHALLENGE_S / tick_s),
                     1u + (uint32_t)(UNIT_STORE_UNLOCKED_S / tick_s))) {
        access_lock(&unit->store.access); /* no usable key: it stays locked */
    }
    const uint32_t power_up_ticks = 1u + (uint32_t)(UNIT_STORE_POWER_UP_S / tick_s);
    unit->store.access.waited = unit->store.access_cfg.lockout_ticks - power_up_ticks;
}

static bool refuse(unit_t *unit)
{
    unit->mailbox.faults |= FAULT_STORE;
    unit->configured = false;
    unit->decided = unit_decisions(unit);
    return false;
}

bool unit_start(unit_t *unit, const params_t *image, const gain_table_t *table,
                const hal_devices_t *devices)
{
    const bool good = unit_init(unit, image, table);
    unit->image = image;
    unit_store_t *s = &unit->store;
    start_access(unit, devices);
    const param_store_config_t cfg = store_config(unit, devices);
    s->found = param_store_load(&cfg, &s->store, &unit->params, &s->report);
    if (s->found == PARAM_STORE_EMPTY) {
        return good;
    }
    if (s->found == PARAM_STORE_LOST) {
        return refuse(unit); /* nobody knows what was set, the limits among it */
    }
    /* The timer runs at the image's period, whatever else was stored. */
    if (float_bits(unit->params.period_s) != float_bits(image->period_s)) {
        return refuse(unit);
    }
    return unit_adopt(unit, &s->report.made_for);
}

bool unit_store_save(unit_t *unit, const hal_devices_t *devices)
{
    const param_store_config_t cfg = store_config(unit, devices);
    return param_store_save(&cfg, &unit->store.store, &unit->params);
}

bool unit_store_entry(const unit_t *unit, const hal_devices_t *devices, uint32_t n,
                      param_store_entry_t *entry)
{
    const param_store_config_t cfg = store_config(unit, devices);
    return param_store_entry(&cfg, &unit->store.store, n, entry);
}

void unit_store_background(unit_t *unit, const hal_devices_t *devices)
{
    unit_store_t *s = &unit->store;
    if (unit->period_count - s->tick_at >= PERIODS_PER_TICK) {
        s->tick_at += PERIODS_PER_TICK;
        access_tick(&s->access_cfg, &s->access);
    }
    const param_store_config_t cfg = store_config(unit, devices);
    (void)param_store_step(&cfg, &s->store, unit_at_rest(unit));
}
