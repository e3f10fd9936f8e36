/* Commands as lines of text: "run 300" (mechanical min^-1, sign is direction), "stop", "reset".
 *
 * For the first turns on a bench. Nothing runs before the first "run"; "stop" and any line that is
 * none of these open the gates. A reset is a pulse of some control periods.
 */
#ifndef CONSOLE_H
#define CONSOLE_H

#include <stdbool.h>
#include <stdint.h>

#define CONSOLE_LINE_BYTES    16u
#define CONSOLE_SPEED_MAX_RPM 6000

typedef struct {
    char line[CONSOLE_LINE_BYTES];
    uint32_t reset_at; /* control period */
    bool reset;        /* to be given */
    uint32_t length;   /* beyond the line's end: too long, refused as a whole */
    uint32_t command;  /* DRIVE_STATE_CMD_* */
    float omega_m_ref_rad_s;
} console_t;

/* DRIVE_STATE_CMD_* for this moment; a reset ends by itself once the control period saw it. */
uint32_t console_command(console_t *console, uint32_t period_count);

/* One byte received; the answer to send, empty inside a line. */
const char *console_byte(console_t *console, char byte);

#endif
