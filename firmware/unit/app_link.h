/* The host link: requests in, answers out, one at a time. firmware/host/README.md has the
 * frames.
 *
 * Runs in the background and only talks: a parameter goes to the control law by app_reconfigure, a
 * command stands here until the port fetches it (app_link_command) and posts it.
 */
#ifndef APP_LINK_H
#define APP_LINK_H

#include <stdbool.h>
#include <stdint.h>

#include "command.h"

#define APP_LINK_PROTOCOL 1u

/* Requests; an answer is the same with APP_LINK_ANSWER. Append-only. */
enum {
    APP_LINK_HELLO = 0x01,
    APP_LINK_SESSION = 0x02,
    APP_LINK_PARAM_INFO = 0x03,
    APP_LINK_SIGNAL_INFO = 0x04,
    APP_LINK_GET = 0x10,
    APP_LINK_SET = 0x11,
    APP_LINK_SAVE = 0x12,
    APP_LINK_STORE = 0x13,
    APP_LINK_CHALLENGE = 0x14,
    APP_LINK_UNLOCK = 0x15,
    APP_LINK_COMMAND = 0x20,
    APP_LINK_STATUS = 0x21,
    APP_LINK_SAMPLE = 0x22,
    APP_LINK_COMMISSIONING = 0x23,
    APP_LINK_TRACE_ARM = 0x30,
    APP_LINK_TRACE_STATE = 0x31,
    APP_LINK_TRACE_READ = 0x32,
    APP_LINK_TRACE_STOP = 0x33,
    APP_LINK_FAULT_LOG = 0x40,
    APP_LINK_FAULT_RECORD = 0x41,
    APP_LINK_FAULT_READ = 0x42,
    APP_LINK_FAULT_CLEAR = 0x43
};

#define APP_LINK_ANSWER 0x80u

/* First byte of every answer's body; 1..4 are params_status_t. Append-only. */
typedef enum {
    APP_LINK_OK = 0,
    APP_LINK_NOT_FINITE = 1,
    APP_LINK_OUT_OF_RANGE = 2,
    APP_LINK_NOT_WHOLE = 3,
    APP_LINK_NO_SUCH = 4, /* parameter, signal, row */
    APP_LINK_NO_SUCH_OP = 5,
    APP_LINK_BAD_LENGTH = 6,
    APP_LINK_NO_SESSION = 7, /* somebody else's, or of before a reset */
    APP_LINK_NOT_NOW = 8,    /* only with the gates off and no run command standing; locked out */
    APP_LINK_PROTECTED = 9,
    APP_LINK_REFUSED = 10 /* in range, but not together with the rest */
} app_link_status_t;

/* Zeroed is a valid beginning. */
typedef struct {
    command_parser_t parser;
    command_writer_t answer;
    uint32_t sent; /* of the answer's bytes */
    bool answered; /* the answer is that to last_* */
    uint8_t last_sequence;
    uint32_t last_crc32c;

    uint32_t session; /* 0: nobody's */
    uint32_t command; /* DRIVE_STATE_CMD_* */
    float omega_m_ref_rad_s;
    float torque_ref_Nm;
    uint32_t commands;      /* so many came */
    uint32_t valid_periods; /* 0: the command stands without further notice */
    uint32_t commanded_at;  /* period of the last command */
    uint32_t reset_at;      /* period in which a reset was fetched */
    bool reset;             /* one was asked for and not fetched yet */
    bool expired;           /* the last command ran out */
} app_link_t;

#endif
