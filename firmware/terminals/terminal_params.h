/* Parameters and faults of the terminals as structs and lists, from terminal_params.def and
 * terminal_faults.def.
 */
#ifndef TERMINAL_PARAMS_H
#define TERMINAL_PARAMS_H

#include <stdbool.h>
#include <stdint.h>

#include "num.h"

typedef struct {
#define TERMINAL_F(name, unit, minimum, maximum, initial, text) float name;
#define TERMINAL_E(name, highest, choices, text)                uint32_t name;
#include "terminal_params.def"
} terminal_params_t;

typedef enum {
#define TERMINAL_FAULT(name, bit, reaction, text, cause, remedy)                                   \
    TERMINAL_FAULT_##name = (1 << (bit)),
#include "terminal_faults.def"
} terminal_fault_t;

typedef enum {
    TERMINAL_WARN = 0,
    TERMINAL_STOP = 1,
    TERMINAL_OFF = 2
} terminal_reaction_t;

/* Every fault that ends a run, and those of them that open the gates at once. */
#define TERMINAL_FAULT(name, bit, reaction, text, cause, remedy)                                   \
    | ((TERMINAL_##reaction != TERMINAL_WARN) ? ((uint32_t)1u << (bit)) : (uint32_t)0u)
static const uint32_t terminal_stopping = (uint32_t)0u
#include "terminal_faults.def"
    ;
#define TERMINAL_FAULT(name, bit, reaction, text, cause, remedy)                                   \
    | ((TERMINAL_##reaction == TERMINAL_OFF) ? ((uint32_t)1u << (bit)) : (uint32_t)0u)
static const uint32_t terminal_opening = (uint32_t)0u
#include "terminal_faults.def"
    ;

/* Everything off. */
void terminal_params_default(terminal_params_t *params);

/* Number of the parameter with this name; terminal_params_count() when there is none. */
uint32_t terminal_params_count(void);
uint32_t terminal_params_find(const char *name);

/* Empty for a number that does not exist. */
const char *terminal_params_name(uint32_t index);

/* Of each parameter; 0 for a number that does not exist. */
float terminal_params_get(const terminal_params_t *params, uint32_t index);

/* False, and nothing changed: out of its range, not whole, or no such parameter. */
CHECKED bool terminal_params_set(terminal_params_t *params, uint32_t index, float value);

#endif
