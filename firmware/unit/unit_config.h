/* Parameter list -> configuration of the control law: units and names at the edge, nothing else.
 */
#ifndef UNIT_CONFIG_H
#define UNIT_CONFIG_H

#include "drive_params.h"
#include "params.h"

void unit_config_drive(drive_params_t *drive, const params_t *params);

/* Its modes, and the flux reference. */
void unit_config_modes(modes_params_t *m, const params_t *p);

/* What it finds out before and while it runs: Rs, M, heat, offsets and gains of
 * the sensors. */
void unit_config_tracking(drive_params_t *drive, const params_t *params);

#endif
