/* Terminals of one drive: what contacts, analogue reference, brake, sensors and contactor ask of
 * it, beside host link and fieldbus.
 *
 * Background only. terminals_command() stands last before unit_post_command(): it is given what
 * link or bus command, and returns what the drive gets. It looks at them after 1 ms of control
 * periods, or later where the background comes later: then that time counts (lapse.h), up to 4 s.
 *
 * Who commands: the contacts, while no link or bus runs the drive. A STOP contact that opens, a
 * fault with STOP or OFF, a link that is not charged and a brake that is not proven hold against
 * everybody; then run has to drop before it counts again.
 */
#ifndef TERMINALS_H
#define TERMINALS_H

#include "unit.h"
#include "analog_reference.h"
#include "chopper_watch.h"
#include "contacts.h"
#include "hal_terminals.h"
#include "mech_brake.h"
#include "precharge.h"
#include "temperature.h"
#include "terminal_params.h"

typedef enum {
    TERMINALS_OK = 0,
    TERMINALS_NOT_FITTED = 1, /* something enabled needs what the board does not have */
    TERMINALS_CONTACTS = 2,   /* a parameter of these is refused */
    TERMINALS_ANALOG = 3,
    TERMINALS_BRAKE = 4,
    TERMINALS_SENSOR = 5,
    TERMINALS_PRECHARGE = 6,
    TERMINALS_CHOPPER = 7
} terminals_status_t;

typedef struct {
    uint32_t step_periods; /* control periods from look to look, at least 2 */
    uint32_t most_periods; /* that count between two looks */
    uint32_t period_ns;
    contacts_config_t contacts;
    analog_reference_config_t analog;
    mech_brake_config_t brake;
    temperature_config_t sink;
    temperature_config_t motor;
    precharge_config_t precharge;
    chopper_watch_config_t chopper;
    float full_speed_rad_s;
    float motor_Rs_degC;
    bool hold; /* a lost reference is held */
} terminals_config_t;

/* A zeroed state is valid: every contact open, every output off. */
typedef struct {
    contacts_state_t contacts;
    analog_reference_state_t analog;
    mech_brake_state_t brake;
    temperature_state_t sink;
    temperature_state_t motor;
    precharge_state_t precharge;
    chopper_watch_state_t chopper;
    uint32_t unread;  /* steps without inputs */
    uint32_t faults;  /* TERMINAL_FAULT_*, latched */
    uint32_t outputs; /* as written last */
    bool blocked;     /* run has to drop */
    mech_brake_out_t braked;
    bool reset;             /* for the drive, until the next step */
    bool reset_asked;       /* by link or bus, since the last step */
    uint32_t asked;         /* their command then */
    uint32_t steps;         /* in all */
    uint32_t rest_ns;       /* behind the last whole step */
    uint32_t stepped_at;    /* period of the last look */
    uint32_t link_commands; /* of the host link, when it was looked at last */
    float adapted_cut_pu;   /* of the torque current, in the configuration made last */
    float adapted_rise_pu;  /* of Rs */
    uint32_t adapted_crc;   /* of that configuration */
} terminals_state_t;

/* What the board has, what the parameters say, and the drive behind it. */
CHECKED terminals_status_t terminals_init(terminals_config_t *cfg, const terminal_params_t *params,
                                          const hal_terminals_t *hal, const params_t *drive);

/* The command for the drive, instead of `posted`. Every round of the background. */
unit_command_t terminals_command(const terminals_config_t *cfg, terminals_state_t *st, unit_t *unit,
                                 const hal_terminals_t *hal, unit_command_t posted);

#endif
