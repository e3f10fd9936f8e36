/* What a mode sees in a period, as values that a test sets. */
#ifndef MODE_FIXTURE_H
#define MODE_FIXTURE_H

#include "mode.h"

static drive_in_t asked;
static measured_t meas;
static acting_voltage_state_t acting;
static estimate_t estimate;
static torque_limits_state_t limits;
static mode_in_t in;

/* RUN is asked for, on a healthy dc link; nothing flows and nothing turns. */
static inline void mode_fixture_start(void)
{
    asked = (drive_in_t){.mode = DRIVE_RUN};
    meas = (measured_t){.u_dc_V = 540.0f};
    acting = (acting_voltage_state_t){0};
    estimate = (estimate_t){0};
    limits = (torque_limits_state_t){0};
    in = (mode_in_t){.asked = &asked,
                     .meas = &meas,
                     .estimate = &estimate,
                     .limits = &limits,
                     .acting = &acting,
                     .Rs_ohm = 1.5f,
                     .M_pu = 1.0f,
                     .Rr_pu = 1.0f};
}

#endif
