/* The stages of a control period between measurement and duty. drive.c calls them, in its order. */
#ifndef STAGES_H
#define STAGES_H

#include "drive.h"

/* What the drive believes after this sample: the estimator runs, or holds what is imposed. */
void stage_estimate(const drive_config_t *cfg, drive_state_t *st, const mode_in_t *in);

/* Stator resistance from the residual along the flux: slow work, before the mode. */
void stage_track_rs(const drive_config_t *cfg, drive_state_t *st, const mode_in_t *in);

/* Request -> duty. */
void stage_apply(const drive_config_t *cfg, drive_state_t *st, drive_out_t *out);

/* How far the estimate is to be believed, and what follows; temperatures. */
void stage_judge(const drive_config_t *cfg, drive_state_t *st, const mode_in_t *in,
                 drive_out_t *out);

/* Fault bits of the guard; state_sum: a number if all that is remembered is one. */
uint32_t stage_guard(const drive_config_t *cfg, drive_state_t *st, const drive_in_t *asked,
                     const drive_out_t *out, float state_sum);

/* Heats or cools motor and inverter: slow work. */
COLD void stage_heat(const drive_config_t *cfg, drive_state_t *st, drive_mode_t asked,
                     drive_out_t *out);

#endif
