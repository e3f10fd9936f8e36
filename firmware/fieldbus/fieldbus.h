/* What a fieldbus asks of the drive, and what becomes of it beside the host link.
 *
 * The parameter fieldbus_commands enables it. Run has to be seen low once before it counts: after
 * power-up, after a time-out, and after the host link took over. A host that commands over its link
 * takes the drive from the bus; while it runs the drive, the bus is refused. Silence longer than
 * fieldbus_timeout_s ends the run command: the drive stops as it does when run drops.
 */
#ifndef FIELDBUS_H
#define FIELDBUS_H

#include "unit.h"

typedef enum {
    FIELDBUS_OK = 0,
    FIELDBUS_DISABLED = 1,
    FIELDBUS_TAKEN = 2,       /* the host link runs the drive */
    FIELDBUS_NOT_ARMED = 3,   /* run has to drop first */
    FIELDBUS_OUT_OF_RANGE = 4 /* not finite, beyond speed_max_rad_s, an unknown command */
} fieldbus_status_t;

/* SEQUENCE_CMD_RUN, FAULT_RESET (rising edge), TORQUE_OFF, TORQUE_MODE; nothing else. */
typedef struct {
    uint32_t command;
    float omega_m_ref_rad_s;
    float torque_ref_Nm;
} fieldbus_demand_t;

/* A zeroed state is valid: nothing asked for, and run has to drop first. */
typedef struct {
    fieldbus_demand_t demand; /* accepted last */
    bool armed;               /* run was seen low: it counts */
    bool expired;             /* the last run command expired */
    bool reset;               /* wanted, not posted yet */
    bool resetting;           /* posted, perhaps not seen by a period yet */
    uint32_t reset_at;        /* period in which it was posted */
    uint32_t commands;        /* accepted so far */
    uint32_t commanded_at;    /* period of the last one */
    uint32_t link_commands;   /* those of the host link, when it was looked at last */
} fieldbus_t;

/* Whether the bus may change anything now: enabled, and no host link runs the drive. */
CHECKED fieldbus_status_t fieldbus_allowed(const unit_t *unit);

/* Finite, known, and not beyond speed_max_rad_s. */
bool fieldbus_in_range(const unit_t *unit, const fieldbus_demand_t *demand);

/* A command of the bus. Unless FIELDBUS_OK nothing has changed. */
CHECKED fieldbus_status_t fieldbus_ask(fieldbus_t *fb, const unit_t *unit,
                                       const fieldbus_demand_t *demand);

/* In place of unit_link_command(): the present command of host link and bus, to be posted. */
unit_command_t fieldbus_command(fieldbus_t *fb, unit_t *unit);

#endif
