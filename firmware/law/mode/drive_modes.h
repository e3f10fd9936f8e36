/* What the drive does beside flux-oriented control: which of it acts, and the voltage it wants.
 *
 * Search for the speed of a turning shaft (flying_start), braking and holding by direct current,
 * V/f and I-f operation. Each is off until its parameter says otherwise. The first two let the
 * current stand still, the third needs none: no observer runs meanwhile.
 */
#ifndef DRIVE_MODES_H
#define DRIVE_MODES_H

#include <stdbool.h>
#include <stdint.h>

#include "flux_reference.h"
#include "flying_start.h"
#include "i_f.h"
#include "mains_loss.h"
#include "dc_current.h"
#include "volts_per_hertz.h"

typedef enum {
    DRIVE_CONTROL_VECTOR = 0,          /* flux-oriented */
    DRIVE_CONTROL_VOLTS_PER_HERTZ = 1, /* neither observer nor current control */
    DRIVE_CONTROL_IMPRESSED = 2        /* I-f: current control, no observer */
} drive_control_t;

/* What acts in this period without an orientation. */
typedef enum {
    DRIVE_OPEN_NONE = 0,
    DRIVE_OPEN_SEARCH = 1,
    DRIVE_OPEN_BRAKE = 2,
    DRIVE_OPEN_VOLTS = 3,
    DRIVE_OPEN_IMPRESSED = 4
} drive_open_t;

typedef struct {
    drive_control_t control;
    flux_reference_params_t level;
    flying_start_params_t flying;
    volts_per_hertz_params_t volts;
    mains_loss_params_t mains;
    float brake_A;          /* direct current while the reference is zero; 0: off */
    float brake_from_rad_s; /* from this speed downward, electrical: small holds, large brakes */
    float brake_s;          /* at least so long */
    float brake_slew_A_per_s;
    float standing_bandwidth_rad_s; /* of the standing current's control */
} drive_modes_params_t;

typedef struct {
    drive_control_t control;
    /* The questions of a period when all is off: what acts without orientation, what in a dip. */
    bool any_open;
    bool ride_through;
    flux_reference_config_t level;
    flying_start_config_t flying;
    dc_current_config_t standing;
    volts_per_hertz_config_t volts;
    mains_loss_config_t mains;
    float brake_A;
    float brake_from_rad_s;
    float brake_step_A;
    uint32_t brake_periods;
} drive_modes_config_t;

typedef struct {
    drive_open_t open;
    ab_t u_V; /* wanted by it */
    flux_reference_state_t level;
    flying_start_state_t flying;
    dc_current_state_t standing;
    volts_per_hertz_state_t volts;
    mains_loss_state_t mains;
    uint32_t brake_periods;
    ab_t brake_i_ref_A;
    float brake_omega_rad_s; /* speed at its beginning: how fast the EMF turns */
} drive_modes_state_t;

typedef struct {
    bool running; /* RUN, not the premagnetisation */
    bool torque;  /* is asked for: a reference of zero is no stop */
    bool lost;    /* impressed current holds what orientation lost: no brake takes over */
    float omega_ref_rad_s;
    float omega_hat_rad_s;
    ab_t lambda_Wb;
    ab_t i_A;
    ab_t u_V; /* of the duties that acted in the interval that ended */
    float u_dc_V;
    float Rs_ohm;
} drive_modes_in_t;

/* False for an unknown control, or what one of the parts refuses; impressed control needs
 * impressed_current on. */
CHECKED bool drive_modes_init(drive_modes_config_t *cfg, const drive_modes_params_t *params,
                              const motor_model_t *motor, float period_s);

/* Decides what acts in this period: st->open. True when a direct-current brake has just let go: the
 * motor stands, with the flux of that current along alpha. */
COLD bool drive_modes_select(const drive_modes_config_t *cfg, drive_modes_state_t *st,
                             const drive_modes_in_t *in);

/* One period of SEARCH, BRAKE or VOLTS: the voltage wanted. */
COLD ab_t drive_modes_voltage(const drive_modes_config_t *cfg, drive_modes_state_t *st,
                              const drive_modes_in_t *in);

#endif
