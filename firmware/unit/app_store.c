#include "app_store.h"

#include "app.h"
#include "app_store_background.h"

#include <stddef.h>

#define PERIODS_PER_TICK 512u

static param_store_config_t store_config(const app_t *app, const hal_devices_t *devices)
{
    param_store_config_t cfg = {.flash = devices->flash};
    if (app->table != NULL) {
        cfg.table = (gain_table_id_t){app->table->motor_id, app->table->crc32c};
    }
    return cfg;
}

static void start_access(app_t *app, const hal_devices_t *devices)
{
    const float tick_s = (float)PERIODS_PER_TICK * app->params.period_s;
    if (!access_init(&app->store.access_cfg, devices->access_key,
                     1u + (uint32_t)(APP_STORE_LOCKOUT_S / tick_s),
                     1u + (uint32_t)(APP_STORE_CHALLENGE_S / tick_s),
                     1u + (uint32_t)(APP_STORE_UNLOCKED_S / tick_s))) {
        access_lock(&app->store.access); /* no usable key: it stays locked */
    }
}

static bool refuse(app_t *app)
{
    app->mailbox.faults |= MONITOR_STORE;
    app->configured = false;
    return false;
}

bool app_start(app_t *app, const params_t *image, const gain_table_t *table,
               const hal_devices_t *devices)
{
    const bool good = app_init(app, image, table);
    app->image = image;
    app_store_t *s = &app->store;
    start_access(app, devices);
    const param_store_config_t cfg = store_config(app, devices);
    s->found = param_store_load(&cfg, &s->store, &app->params, &s->report);
    if (s->found == PARAM_STORE_EMPTY) {
        return good;
    }
    if (s->found == PARAM_STORE_LOST) {
        return refuse(app); /* nobody knows what was set, the limits among it */
    }
    /* The timer runs at the image's period, whatever else was stored. */
    if (float_bits(app->params.period_s) != float_bits(image->period_s)) {
        return refuse(app);
    }
    return app_adopt(app, &s->report.made_for);
}

bool app_store_save(app_t *app, const hal_devices_t *devices)
{
    const param_store_config_t cfg = store_config(app, devices);
    return param_store_save(&cfg, &app->store.store, &app->params);
}

void app_store_background(app_t *app, const hal_devices_t *devices)
{
    app_store_t *s = &app->store;
    if (app->period_count - s->tick_at >= PERIODS_PER_TICK) {
        s->tick_at += PERIODS_PER_TICK;
        access_tick(&s->access_cfg, &s->access);
    }
    const param_store_config_t cfg = store_config(app, devices);
    (void)param_store_step(&cfg, &s->store, app_at_rest(app));
}
