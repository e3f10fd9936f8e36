/* All modes of the drive: which one acts, and its request. */
#ifndef MODES_H
#define MODES_H

#include "dc_brake.h"
#include "flying_start.h"
#include "i_f.h"
#include "mode.h"
#include "premagnetise.h"
#include "vector.h"
#include "volts_per_hertz.h"

/* Control mode of DRIVE_RUN, by configuration. */
typedef enum {
    MODES_CONTROL_VECTOR = 0,          /* flux-oriented */
    MODES_CONTROL_VOLTS_PER_HERTZ = 1, /* neither observer nor current control */
    MODES_CONTROL_I_F = 2              /* current control, no observer */
} modes_control_t;

typedef struct {
    modes_control_t control;
    bool fixed; /* the request alone decides: vector control, no search, no brake */
    premagnetise_config_t premagnetise;
    vector_config_t vector;
    i_f_config_t i_f;
    flying_start_config_t flying;
    dc_current_config_t dc_current;
    dc_brake_config_t brake;
    volts_per_hertz_config_t volts;
} modes_config_t;

typedef struct {
    vector_state_t vector;
    i_f_state_t i_f;
    premagnetise_state_t premagnetise;
    flying_start_state_t flying;
    dc_current_state_t flying_current;
    dc_brake_state_t brake;
    volts_per_hertz_state_t volts;
} modes_state_t;

/* Chooses the mode of this period. before: the mode of the last one. */
COLD mode_id_t modes_selected(const modes_config_t *cfg, const modes_state_t *st, mode_id_t before,
                              const mode_in_t *in);

/* One period of a mode that is not flux-oriented; FAULT_STATOR_RESISTANCE, FAULT_FLYING_START. */
request_t modes_step(const modes_config_t *cfg, modes_state_t *st, mode_id_t mode,
                     const mode_in_t *in, uint32_t *faults);

/* The mode works without an estimator. */
static inline bool modes_open_loop(mode_id_t mode)
{
    return (mode == MODE_FLYING_START) || (mode >= MODE_I_F);
}

/* Number of a mode without orientation for telemetry: search 1, brake 2, V/f 3, I-f 4; else 0. */
static inline uint32_t modes_open_number(mode_id_t mode)
{
    if (mode == MODE_FLYING_START) {
        return 1u;
    }
    if (mode == MODE_DC_BRAKE) {
        return 2u;
    }
    if (mode == MODE_VOLTS_PER_HERTZ) {
        return 3u;
    }
    return (mode == MODE_I_F) ? 4u : 0u;
}

/* Flux-oriented: with or without torque. */
static inline bool modes_oriented(mode_id_t mode)
{
    return (mode == MODE_VECTOR) || (mode == MODE_REMAGNETISE);
}

/* Without orientation a torque cannot be controlled, but the present speed can be held. */
static inline float modes_open_reference_rad_s(const mode_in_t *in)
{
    return (in->asked->aim == DRIVE_AIM_TORQUE) ? in->estimate->omega_e_rad_s
                                                : in->asked->omega_e_ref_rad_s;
}

#endif
