/* Reaction of the drive to a fault: the one list (fault_list.def) as masks, table and texts.
 *
 * Bits that the list does not contain open the gates.
 */
#ifndef FAULT_REACTION_H
#define FAULT_REACTION_H

#include <stdint.h>

/* In order of severity. */
typedef enum {
    FAULT_WARN = 0,
    FAULT_DERATE = 1,
    FAULT_RAMP_DOWN = 2,
    FAULT_GATES_OFF = 3
} fault_reaction_t;

/* Bits of one reaction, folded from the list. */
#define FAULT(name, bit, reaction, text, cause, remedy)                                            \
    | ((FAULT_##reaction == FAULT_WARN) ? ((uint32_t)1u << (bit)) : (uint32_t)0u)
static const uint32_t fault_warn_bits = (uint32_t)0u
#include "fault_list.def"
    ;
#undef FAULT
#define FAULT(name, bit, reaction, text, cause, remedy)                                            \
    | ((FAULT_##reaction == FAULT_DERATE) ? ((uint32_t)1u << (bit)) : (uint32_t)0u)
static const uint32_t fault_derate_bits = (uint32_t)0u
#include "fault_list.def"
    ;
#undef FAULT
#define FAULT(name, bit, reaction, text, cause, remedy)                                            \
    | ((FAULT_##reaction == FAULT_RAMP_DOWN) ? ((uint32_t)1u << (bit)) : (uint32_t)0u)
static const uint32_t fault_ramp_down_bits = (uint32_t)0u
#include "fault_list.def"
    ;
#undef FAULT

/* Faults that end a run, on a ramp or at once. */
static inline uint32_t fault_stopping(uint32_t faults)
{
    return faults & ~(fault_warn_bits | fault_derate_bits);
}

/* Faults that open the gates at once. */
static inline uint32_t fault_opening(uint32_t faults)
{
    return fault_stopping(faults) & ~fault_ramp_down_bits;
}

/* One row of the list, for display; an image that never asks does not contain the texts. */
typedef struct {
    const char *name;
    uint32_t bit;
    fault_reaction_t reaction;
    const char *text;
    const char *cause;
    const char *remedy;
} fault_info_t;

uint32_t fault_count(void);

/* Row `index` < fault_count(); beyond that the first one. */
const fault_info_t *fault_info(uint32_t index);

#endif
