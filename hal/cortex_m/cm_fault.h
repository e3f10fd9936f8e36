/* Ends of the program: why the drive stopped for good, with the state of the core.
 *
 * Codes are append-only; the emulated port returns them as exit code, a board reports them.
 */
#ifndef CM_FAULT_H
#define CM_FAULT_H

#include <stdbool.h>
#include <stdint.h>

typedef enum {
    CM_END_HARD_FAULT = 101,
    CM_END_WILD_ACCESS = 110,    /* access that the MPU forbids: code, null page, no memory */
    CM_END_STACK_OVERFLOW = 111, /* MPU guard below the stack */
    CM_END_DIVISION_BY_ZERO = 112,
    CM_END_UNDEFINED_INSTRUCTION = 113,
    CM_END_BUS_FAULT = 114,
    CM_END_USAGE_FAULT = 115,
    CM_END_CONTROL_STUCK = 116,    /* the watchdog saw no control period end */
    CM_END_BACKGROUND_STUCK = 117, /* the watchdog was not served while periods continued */
    CM_END_TABLE_CHANGED = 118,
    CM_END_IMAGE_CHANGED = 119,
    CM_END_UNEXPECTED_INTERRUPT = 121,
    CM_END_CLOCK_LOST = 122,  /* the crystal failed while the drive ran */
    CM_END_NOT_AT_CREST = 123 /* sampling and carrier are out of step */
} cm_end_t;

typedef struct {
    cm_end_t code;
    uint32_t pc; /* of the instruction at fault; 0: not known */
    uint32_t lr;
    uint32_t address; /* that was accessed; 0: not known */
    uint32_t cfsr;    /* configurable fault status, as read */
} cm_fault_t;

/* Room for cm_fault_text and a port's own words behind it. */
#define CM_FAULT_TEXT_BYTES 80u

/* `end CODE gates G pc X address X`, not terminated; returns the end. */
char *cm_fault_text(char *to, const cm_fault_t *fault, bool gates_on);

/* Opens the gates, then hands over to the port; from any context. */
_Noreturn void cm_stop(cm_end_t code);

/* Watchdog expired (a port's NMI or early interrupt): reports the cause. `progressed` when control
 * periods continued all the time it was not served. */
_Noreturn void cm_watchdog_expired(int progressed);

#endif
