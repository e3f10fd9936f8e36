/* Parameter list -> configuration of the control law: units and names at the edge, nothing else.
 */
#ifndef APP_CONFIG_H
#define APP_CONFIG_H

#include "commissioning.h"
#include "drive.h"
#include "params.h"

void app_config_drive(drive_params_t *drive, const params_t *params);

void app_config_commissioning(commissioning_params_t *c, const params_t *p);

#endif
