#include "cia402.h"

#include <stddef.h>

/* Commands of the control word: its bits 0..3 under a mask. */
typedef enum {
    SHUTDOWN,
    SWITCH_ON,
    ENABLE_OPERATION,
    DISABLE_VOLTAGE,
    QUICK_STOP,
    COMMANDS
} command_t;

static const struct {
    uint8_t mask;
    uint8_t bits;
} patterns[COMMANDS] = {[SHUTDOWN] = {0x7u, 0x6u},
                        [SWITCH_ON] = {0xFu, 0x7u},
                        [ENABLE_OPERATION] = {0xFu, 0xFu},
                        [DISABLE_VOLTAGE] = {0x2u, 0x0u},
                        [QUICK_STOP] = {0x6u, 0x2u}};

/* Transitions by command; enabling from READY passes SWITCHED ON. */
static const struct {
    uint8_t from;
    uint8_t command;
    uint8_t to;
} transitions[] = {
    {CIA402_SWITCH_ON_DISABLED, SHUTDOWN, CIA402_READY_TO_SWITCH_ON},        /* 2 */
    {CIA402_READY_TO_SWITCH_ON, SWITCH_ON, CIA402_SWITCHED_ON},              /* 3 */
    {CIA402_READY_TO_SWITCH_ON, ENABLE_OPERATION, CIA402_OPERATION_ENABLED}, /* 3, 4 */
    {CIA402_SWITCHED_ON, ENABLE_OPERATION, CIA402_OPERATION_ENABLED},        /* 4 */
    {CIA402_OPERATION_ENABLED, SWITCH_ON, CIA402_SWITCHED_ON},               /* 5 */
    {CIA402_SWITCHED_ON, SHUTDOWN, CIA402_READY_TO_SWITCH_ON},               /* 6 */
    {CIA402_READY_TO_SWITCH_ON, DISABLE_VOLTAGE, CIA402_SWITCH_ON_DISABLED}, /* 7 */
    {CIA402_READY_TO_SWITCH_ON, QUICK_STOP, CIA402_SWITCH_ON_DISABLED},      /* 7 */
    {CIA402_OPERATION_ENABLED, SHUTDOWN, CIA402_READY_TO_SWITCH_ON},         /* 8 */
    {CIA402_OPERATION_ENABLED, DISABLE_VOLTAGE, CIA402_SWITCH_ON_DISABLED},  /* 9 */
    {CIA402_SWITCHED_ON, DISABLE_VOLTAGE, CIA402_SWITCH_ON_DISABLED},        /* 10 */
    {CIA402_SWITCHED_ON, QUICK_STOP, CIA402_SWITCH_ON_DISABLED},             /* 10 */
    {CIA402_OPERATION_ENABLED, QUICK_STOP, CIA402_QUICK_STOP_ACTIVE},        /* 11 */
    {CIA402_QUICK_STOP_ACTIVE, DISABLE_VOLTAGE, CIA402_SWITCH_ON_DISABLED}   /* 12 */
};

/* States that the drive imposes; else the one it was in, or SWITCH ON DISABLED behind them. */
static cia402_state_id_t imposed(cia402_state_id_t id, const cia402_drive_t *drive)
{
    if (drive->fault) {
        return CIA402_FAULT;
    }
    if (drive->reacting) {
        return CIA402_FAULT_REACTION_ACTIVE;
    }
    if (!drive->ready) {
        return CIA402_NOT_READY;
    }
    const bool behind =
        (id == CIA402_NOT_READY) || (id == CIA402_FAULT) || (id == CIA402_FAULT_REACTION_ACTIVE);
    return behind ? CIA402_SWITCH_ON_DISABLED : id;
}

void cia402_follow(cia402_state_t *st, const cia402_drive_t *drive)
{
    st->id = imposed(st->id, drive);
    if ((st->id == CIA402_OPERATION_ENABLED) && !drive->runs) {
        st->id = CIA402_QUICK_STOP_ACTIVE; /* silence, or the host took over */
    }
    if ((st->id == CIA402_QUICK_STOP_ACTIVE) && !drive->gates_on) {
        st->id = CIA402_SWITCH_ON_DISABLED;
    }
}

bool cia402_control(cia402_state_t *st, uint32_t control)
{
    const uint32_t rising = control & ~st->control;
    const cia402_state_id_t from = st->id;
    st->control = control;
    for (size_t k = 0u; k < sizeof transitions / sizeof transitions[0]; k++) {
        const uint32_t command = transitions[k].command;
        if ((transitions[k].from == (uint8_t)from) &&
            ((control & patterns[command].mask) == patterns[command].bits)) {
            st->id = (cia402_state_id_t)transitions[k].to;
        }
    }
    return (from == CIA402_FAULT) && ((rising & CIA402_RESET) != 0u);
}

uint32_t cia402_status(cia402_state_id_t id)
{
    static const uint8_t bits[] = {[CIA402_NOT_READY] = 0x00u,
                                   [CIA402_SWITCH_ON_DISABLED] = 0x40u,
                                   [CIA402_READY_TO_SWITCH_ON] = 0x21u,
                                   [CIA402_SWITCHED_ON] = 0x23u,
                                   [CIA402_OPERATION_ENABLED] = 0x27u,
                                   [CIA402_QUICK_STOP_ACTIVE] = 0x07u,
                                   [CIA402_FAULT_REACTION_ACTIVE] = 0x0Fu,
                                   [CIA402_FAULT] = 0x08u};
    return bits[id];
}
