/* State machine of CiA 402, as far as it decides about the drive.
 *
 * A control word acts when it is given; what the drive does acts in between. Transition 16 (from
 * quick stop back to operation) does not exist: quick stop ends in SWITCH ON DISABLED.
 */
#ifndef CIA402_H
#define CIA402_H

#include <stdbool.h>
#include <stdint.h>

typedef enum {
    CIA402_NOT_READY = 0,
    CIA402_SWITCH_ON_DISABLED = 1,
    CIA402_READY_TO_SWITCH_ON = 2,
    CIA402_SWITCHED_ON = 3,
    CIA402_OPERATION_ENABLED = 4,
    CIA402_QUICK_STOP_ACTIVE = 5,
    CIA402_FAULT_REACTION_ACTIVE = 6,
    CIA402_FAULT = 7
} cia402_state_id_t;

/* Control word. */
#define CIA402_ENABLE_VOLTAGE (1u << 1)
#define CIA402_RESET          (1u << 7) /* rising edge */
#define CIA402_HALT           (1u << 8)
#define CIA402_RAMP           (7u << 4) /* vl: enable, unlock, reference; all three to follow it */

/* A zeroed state is valid. */
typedef struct {
    cia402_state_id_t id;
    uint32_t control; /* the last control word */
} cia402_state_t;

/* What the drive does. */
typedef struct {
    bool ready; /* self-test is over */
    bool gates_on;
    bool reacting; /* a fault ends the run, gates still on */
    bool fault;    /* in its fault state */
    bool runs;     /* the run command of this bus stands */
} cia402_drive_t;

/* The drive's own transitions, in each slice. */
void cia402_follow(cia402_state_t *st, const cia402_drive_t *drive);

/* A control word; true when it asks for a fault reset. */
bool cia402_control(cia402_state_t *st, uint32_t control);

/* State bits of the status word: 0..3, 5, 6. */
uint32_t cia402_status(cia402_state_id_t id);

#endif
