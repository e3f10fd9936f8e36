/* What app and link ask of the store; a header of its own because it needs the whole app_t. */
#ifndef APP_STORE_BACKGROUND_H
#define APP_STORE_BACKGROUND_H

#include "app.h"

/* One slice: at most one operation of the flash, and that only at rest. */
void app_store_background(app_t *app, const hal_devices_t *devices);

/* Asks for a save of the set in use; false while one is under way or without a flash for it. */
CHECKED bool app_store_save(app_t *app, const hal_devices_t *devices);

#endif
