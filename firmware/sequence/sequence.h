/* State machine around the control law: who may turn the gates on, how a run ends, and what happens
 * after a fault.
 *
 * Numbers are append-only; README.md beside this has the diagram. Exactly one transition turns the
 * gates on, out of READY; it leaves a word that every state with the gates on has to find. Faults
 * act by fault_list.def: on a ramp or at once, latched until a reset with the cause gone.
 */
#ifndef SEQUENCE_H
#define SEQUENCE_H

#include <stdbool.h>
#include <stdint.h>

#include "drive.h"
#include "fault_reaction.h"
#include "params.h"

typedef enum {
    SEQUENCE_BOOT = 0,
    SEQUENCE_SELF_TEST = 1,
    SEQUENCE_READY = 2,
    SEQUENCE_PREMAGNETISE = 3,
    SEQUENCE_RUN = 4,
    SEQUENCE_RAMP_DOWN = 5,
    SEQUENCE_COAST = 6,
    SEQUENCE_COMMISSIONING = 7,
    SEQUENCE_FAULT = 8,
    SEQUENCE_TORQUE_OFF = 9
} sequence_id_t;

#define SEQUENCE_CMD_RUN         (1u << 0) /* level */
#define SEQUENCE_CMD_FAULT_RESET (1u << 1) /* rising edge */
#define SEQUENCE_CMD_TORQUE_OFF  (1u << 2) /* level, wins over everything but a fault */
#define SEQUENCE_CMD_COMMISSION  (1u << 3) /* level: find the motor; run wins */
#define SEQUENCE_CMD_TORQUE_MODE (1u << 4) /* level, beside run: torque instead of speed */

/* No single upset bit makes this of a word that is not it. */
#define SEQUENCE_ENERGISED 0x5A3C96E1u

typedef enum {
    SEQUENCE_STOP_COAST = 0, /* gates off at once */
    SEQUENCE_STOP_RAMP = 1   /* speed down first */
} sequence_stop_t;

typedef struct {
    uint32_t offset_periods; /* current offsets are averaged this long; 0: none */
    uint32_t premagnetise_periods;
    uint32_t ramp_down_periods; /* then the gates go off, whatever the speed */
    uint32_t coast_periods;     /* gates stay off this long before READY; 0: no COAST */
    float coast_max_V2;         /* and until the line voltage is below; 0: not looked at */
    sequence_stop_t stop;       /* when the run command drops */
    float offset_max_A;         /* a larger offset is a sensor fault */
    float offset_max_V;         /* a larger one is a turning motor's voltage: not taken */
} sequence_config_t;

typedef struct {
    sequence_id_t id;
    uint32_t energised; /* SEQUENCE_ENERGISED while the gates are on, else 0 */
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
} sequence_state_t;

typedef struct {
    uint32_t command;
    uint32_t faults;     /* of this period */
    uvw_t i_raw_A;       /* gates off: its mean is the offset */
    ab_t u_raw_V;        /* likewise; and what a turning motor still induces */
    bool premagnetising; /* the drive is not done with it: RUN has to wait */
    bool standing;       /* RAMP_DOWN has nothing left to bring down */
    bool commissioned;   /* COMMISSIONING is over; that it failed is a fault */
} sequence_in_t;

typedef struct {
    drive_mode_t mode; /* for the next step of the control law */
    drive_aim_t aim;   /* of DRIVE_RUN */
    bool gates_on;
    bool offsets_ready; /* one period: take the machine's offsets */
} sequence_out_t;

/* False for a time that is negative or too long to count, or a full scale that is not positive. */
CHECKED bool sequence_init(sequence_config_t *cfg, const params_t *params);

/* Running, told to run as before, and nothing that ends it: a step would change nothing, and need
 * not be taken. In the state in which time is short that saves most of it. */
static inline bool sequence_goes_on(const sequence_state_t *st, uint32_t command, uint32_t faults)
{
    return (st->id == SEQUENCE_RUN) && (st->energised == SEQUENCE_ENERGISED) && (faults == 0u) &&
           (fault_stopping(st->faults) == 0u) && (command == st->last_command) &&
           ((command & ~SEQUENCE_CMD_TORQUE_MODE) == SEQUENCE_CMD_RUN) && !st->run_blocked;
}

sequence_out_t sequence_step(const sequence_config_t *cfg, sequence_state_t *st,
                             const sequence_in_t *in);

#endif
