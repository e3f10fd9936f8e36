/* State machine around the control law: who may turn the gates on, how a run ends, and what happens
 * after a fault.
 *
 * Numbers are append-only; README.md beside this has the diagram. Exactly one transition turns the
 * gates on, out of READY; it leaves a word that every state with the gates on has to find. Faults
 * act by fault_list.def: on a ramp or at once, latched until a reset with the cause gone.
 */
#ifndef DRIVE_STATE_H
#define DRIVE_STATE_H

#include <stdbool.h>
#include <stdint.h>

#include "drive.h"
#include "fault_reaction.h"

typedef enum {
    DRIVE_STATE_BOOT = 0,
    DRIVE_STATE_SELF_TEST = 1,
    DRIVE_STATE_READY = 2,
    DRIVE_STATE_PREMAGNETISE = 3,
    DRIVE_STATE_RUN = 4,
    DRIVE_STATE_RAMP_DOWN = 5,
    DRIVE_STATE_COAST = 6,
    DRIVE_STATE_COMMISSIONING = 7,
    DRIVE_STATE_FAULT = 8,
    DRIVE_STATE_TORQUE_OFF = 9
} drive_state_id_t;

#define DRIVE_STATE_CMD_RUN         (1u << 0) /* level */
#define DRIVE_STATE_CMD_FAULT_RESET (1u << 1) /* rising edge */
#define DRIVE_STATE_CMD_TORQUE_OFF  (1u << 2) /* level, wins over everything but a fault */
#define DRIVE_STATE_CMD_COMMISSION  (1u << 3) /* level: find the motor; run wins */
#define DRIVE_STATE_CMD_TORQUE_MODE (1u << 4) /* level, beside run: torque instead of speed */

/* No single upset bit makes this of a word that is not it. */
#define DRIVE_STATE_ENERGISED 0x5A3C96E1u

typedef enum {
    DRIVE_STATE_STOP_COAST = 0, /* gates off at once */
    DRIVE_STATE_STOP_RAMP = 1   /* speed down first */
} drive_state_stop_t;

typedef struct {
    uint32_t offset_periods; /* current offsets are averaged this long; 0: none */
    uint32_t premagnetise_periods;
    uint32_t ramp_down_periods; /* then the gates go off, whatever the speed */
    uint32_t coast_periods;     /* gates stay off this long before READY; 0: no COAST */
    float coast_max_V2;         /* and until the line voltage is below; 0: not looked at */
    drive_state_stop_t stop;    /* when the run command drops */
    float offset_max_A;         /* a larger offset is a sensor fault */
    float offset_max_V;         /* a larger one is a turning motor's voltage: not taken */
} drive_state_config_t;

typedef struct {
    float offset_s; /* 0: no averaging */
    float premagnetise_s;
    float ramp_down_s;
    float coast_s;
    float coast_max_V;
    drive_state_stop_t stop;
    float offset_max_A;
    float offset_max_V;
    float period_s;
} drive_state_params_t;

typedef struct {
    drive_state_id_t id;
    uint32_t energised; /* DRIVE_STATE_ENERGISED while the gates are on, else 0 */
    uint32_t periods;   /* in this state */
    uint32_t faults;    /* latched */
    uint32_t last_command;
    bool
        run_blocked; /* after a fault, torque-off or commissioning, until no start command stands */
    uvw_t offset_sum_A;
    uvw_t offset_A; /* the mean, once SELF_TEST has it */
    ab_t offset_sum_V;
    float offset_square_V2; /* sum of |u|^2: a voltage that swings is a turning motor's */
    ab_t offset_V;
} drive_machine_t;

typedef struct {
    uint32_t command;
    uint32_t faults;     /* of this period */
    uvw_t i_raw_A;       /* gates off: its mean is the offset */
    ab_t u_raw_V;        /* likewise; and what a turning motor still induces */
    bool premagnetising; /* the drive is not done with it: RUN has to wait */
    bool standing;       /* RAMP_DOWN has nothing left to bring down */
    bool commissioned;   /* COMMISSIONING is over; that it failed is a fault */
} drive_state_in_t;

typedef struct {
    drive_mode_t mode; /* for the next step of the control law */
    drive_aim_t aim;   /* of DRIVE_RUN */
    bool gates_on;
    bool offsets_ready; /* one period: take the machine's offsets */
} drive_state_out_t;

/* False for a time that is negative or too long to count, or a limit that is not positive. */
CHECKED bool drive_state_init(drive_state_config_t *cfg, const drive_state_params_t *params);

/* Running, told to run as before, and nothing that ends it: a step would change nothing, and need
 * not be taken. In the state in which time is short that saves most of it. */
static inline bool drive_state_goes_on(const drive_machine_t *st, uint32_t command, uint32_t faults)
{
    return (st->id == DRIVE_STATE_RUN) && (st->energised == DRIVE_STATE_ENERGISED) &&
           (faults == 0u) && (fault_stopping(st->faults) == 0u) && (command == st->last_command) &&
           ((command & ~DRIVE_STATE_CMD_TORQUE_MODE) == DRIVE_STATE_CMD_RUN) && !st->run_blocked;
}

drive_state_out_t drive_state_step(const drive_state_config_t *cfg, drive_machine_t *st,
                                   const drive_state_in_t *in);

#endif
