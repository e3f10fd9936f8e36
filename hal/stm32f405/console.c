#include "console.h"

#include <stdbool.h>

#include "drive_state.h"
#include "num.h"

#define RESET_PERIODS 2u /* the mailbox is read once per period */

static bool starts_with(const char *line, const char *word)
{
    while ((*word != '\0') && (*line == *word)) {
        line++;
        word++;
    }
    return *word == '\0';
}

/* A whole number and nothing behind it. */
static bool number(const char *text, int32_t *value)
{
    const bool negative = *text == '-';
    text += negative ? 1 : 0;
    if (*text == '\0') {
        return false;
    }
    int32_t sum = 0;
    for (; *text != '\0'; text++) {
        if ((*text < '0') || (*text > '9') || (sum > CONSOLE_SPEED_MAX_RPM)) {
            return false;
        }
        sum = 10 * sum + (*text - '0');
    }
    *value = negative ? -sum : sum;
    return sum <= CONSOLE_SPEED_MAX_RPM;
}

static bool same(const char *line, const char *word)
{
    return starts_with(line, word) && starts_with(word, line);
}

static const char *execute(console_t *console)
{
    int32_t rpm = 0;
    console->command = 0u;
    if (starts_with(console->line, "run ") && number(&console->line[4], &rpm)) {
        console->command = DRIVE_STATE_CMD_RUN;
        console->omega_m_ref_rad_s = (float)rpm * (NUM_PI / 30.0f);
    } else if (same(console->line, "reset")) {
        console->command = DRIVE_STATE_CMD_FAULT_RESET;
        console->reset = true;
    } else if (!same(console->line, "stop")) {
        return "? run RPM | stop | reset; stopped\r\n";
    } else {
        /* stopped */
    }
    return "ok\r\n";
}

uint32_t console_command(console_t *console, uint32_t period_count)
{
    if (console->reset) {
        console->reset = false;
        console->reset_at = period_count;
    } else if (period_count - console->reset_at > RESET_PERIODS) {
        console->command &= ~DRIVE_STATE_CMD_FAULT_RESET;
    } else {
        /* still to be seen */
    }
    return console->command;
}

const char *console_byte(console_t *console, char byte)
{
    if ((byte != '\r') && (byte != '\n')) {
        if (console->length < CONSOLE_LINE_BYTES) {
            console->line[console->length] = byte;
            console->length++;
        }
        return "";
    }
    if (console->length == 0u) {
        return ""; /* the second of CR LF */
    }
    /* A full line has no room for its end: it was too long. */
    const uint32_t end = (console->length < CONSOLE_LINE_BYTES) ? console->length : 0u;
    console->line[end] = '\0';
    console->length = 0u;
    return execute(console);
}
