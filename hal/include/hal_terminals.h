/* Terminals of a board: contacts, relays, the analogue reference, temperature sensors.
 *
 * Called from the background. What a board does not have is not in `fitted`, and nothing that needs
 * it can be enabled.
 */
#ifndef HAL_TERMINALS_H
#define HAL_TERMINALS_H

#include <stdbool.h>
#include <stdint.h>

/* Inputs: 1 where the contact is closed. */
#define HAL_TERMINAL_START          (1u << 0)
#define HAL_TERMINAL_STOP           (1u << 1) /* normally closed: open stops */
#define HAL_TERMINAL_REVERSE        (1u << 2)
#define HAL_TERMINAL_RESET          (1u << 3)
#define HAL_TERMINAL_BRAKE_RELEASED (1u << 4) /* switch of the mechanical brake */
#define HAL_TERMINAL_CONTACTOR_ON   (1u << 5) /* auxiliary contact of the pre-charge contactor */
#define HAL_TERMINAL_CHOPPER_LEADS  (1u << 6) /* the brake resistor has voltage */
#define HAL_TERMINAL_INPUTS         7u
/* Analogue inputs: bits of `fitted` only. */
#define HAL_TERMINAL_ANALOG       (1u << 7)
#define HAL_TERMINAL_SINK_SENSOR  (1u << 8)
#define HAL_TERMINAL_MOTOR_SENSOR (1u << 9)
/* Outputs: 1 energises. All 0 is the safe state, and that of a board without program or supply. */
#define HAL_TERMINAL_READY         (1u << 16) /* a run command would start, or it runs */
#define HAL_TERMINAL_NO_FAULT      (1u << 17) /* drops on a fault and without supply */
#define HAL_TERMINAL_BRAKE_RELEASE (1u << 18) /* coil of the mechanical brake */
#define HAL_TERMINAL_CONTACTOR     (1u << 19) /* bypasses the pre-charge resistor */
#define HAL_TERMINAL_CHOPPER       (1u << 20) /* enables the driver of the brake transistor */

/* Words are 16 bits, left-aligned whatever the converter: 65536 counts are the full scale. */
#define HAL_TERMINAL_FULL_SCALE 65536.0f

typedef struct {
    uint32_t inputs; /* HAL_TERMINAL_START and the others, as they are: not debounced */
    uint16_t analog_counts;
    uint16_t sink_counts; /* a sensor is the lower part of a divider fed by the reference */
    uint16_t motor_counts;
} hal_terminal_in_t;

typedef struct {
    void *context;
    uint32_t fitted;         /* all that the board has */
    float analog_full_scale; /* V or A, as the input is wired */
    float sink_pullup_ohm;
    float motor_pullup_ohm;

    /* What the terminals show now, with new words of the converter; false: it could not be read,
     * *in does not count. */
    bool (*read)(void *context, hal_terminal_in_t *in);

    /* All outputs; a bit that is not set is de-energised. Returns at once. */
    void (*write)(void *context, uint32_t outputs);
} hal_terminals_t;

#endif
