/* State machine around the control law: who may turn the gates on, how a run ends, and what happens
 * after a fault.
 *
 * Numbers are append-only; README.md in this folder has the diagram. Exactly one transition turns
 * the gates on, from READY. It sets a word that every state with the gates on has to find. Faults
 * act by fault_list.def, on a ramp or at once, and are latched until a reset after the cause is
 * gone.
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
#define SEQUENCE_CMD_TORQUE_OFF  (1u << 2) /* level, overrides everything except a fault */
#define SEQUENCE_CMD_COMMISSION  (1u << 3) /* level: identify the motor; run overrides it */
#define SEQUENCE_CMD_TORQUE_MODE (1u << 4) /* level, with run: torque instead of speed */

/* No single upset bit turns another word into this one. */
#define SEQUENCE_ENERGISED 0x5A3C96E1u

typedef enum {
    SEQUENCE_STOP_COAST = 0, /* gates off at once */
    SEQUENCE_STOP_RAMP = 1   /* ramp down first */
} sequence_stop_t;

typedef struct {
    uint32_t offset_periods; /* averaging time of the current offsets; 0: none */
    uint32_t premagnetise_periods;
    uint32_t ramp_down_periods; /* then the gates go off at any speed */
    uint32_t coast_periods;     /* gates stay off this long before READY; 0: no COAST */
    float coast_max_V2;         /* and until the line voltage is below this; 0: not checked */
    sequence_stop_t stop;       /* when the run command drops */
    float offset_max_A;         /* a larger offset is a sensor fault */
    float offset_max_V;         /* a larger one is the voltage of a turning motor: not used */
} sequence_config_t;

typedef struct {
    sequence_id_t id;
    uint32_t energised; /* SEQUENCE_ENERGISED while the gates are on, else 0 */
    uint32_t periods;   /* in this state */
    uint32_t faults;    /* latched */
    uint32_t last_command;
    bool run_blocked; /* after a fault, torque-off or commissioning, until the command drops */
    uvw_t offset_sum_A;
    uvw_t offset_A; /* the mean, once SELF_TEST has finished */
    ab_t offset_sum_V;
    float offset_square_V2; /* sum of |u|^2: an oscillating voltage comes from a turning motor */
    ab_t offset_V;
} sequence_state_t;

typedef struct {
    uint32_t command;
    uint32_t faults;     /* of this period */
    uvw_t i_raw_A;       /* gates off: its mean is the offset */
    ab_t u_raw_V;        /* likewise; and what a turning motor still induces */
    bool premagnetising; /* premagnetisation is not complete: RUN has to wait */
    bool standing;       /* RAMP_DOWN is complete */
    bool commissioned;   /* COMMISSIONING has ended; a failure is a fault */
} sequence_in_t;

typedef struct {
    drive_mode_t mode; /* for the next step of the control law */
    drive_aim_t aim;   /* of DRIVE_RUN */
    bool gates_on;
    bool offsets_ready; /* one period: take the machine's offsets */
} sequence_out_t;

/* A time in periods, rounded. False for one that is negative, no number or too long to count. */
CHECKED bool sequence_periods(uint32_t *periods, float time_s, float period_s);

/* False for a time that sequence_periods refuses, or a full scale that is not positive. */
CHECKED bool sequence_init(sequence_config_t *cfg, const params_t *params);

/* True when running under an unchanged run command with nothing that ends the run. A step would
 * change nothing and may be skipped, which saves most in the state with the least time. */
static inline bool sequence_goes_on(const sequence_state_t *st, uint32_t command, uint32_t faults)
{
    return (st->id == SEQUENCE_RUN) && (st->energised == SEQUENCE_ENERGISED) && (faults == 0u) &&
           (fault_stopping(st->faults) == 0u) && (command == st->last_command) &&
           ((command & ~SEQUENCE_CMD_TORQUE_MODE) == SEQUENCE_CMD_RUN) && !st->run_blocked;
}

sequence_out_t sequence_step(const sequence_config_t *cfg, sequence_state_t *st,
                             const sequence_in_t *in);

#endif
