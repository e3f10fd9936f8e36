/* The host link: requests in, answers out, one at a time. firmware/host/README.md has the frames.
 *
 * It runs in the background and only communicates. A parameter goes to the control law by
 * unit_reconfigure. A command stays here until the port fetches it (unit_link_command) and posts
 * it.
 */
#ifndef UNIT_LINK_H
#define UNIT_LINK_H

#include <stdbool.h>
#include <stdint.h>

#include "command.h"

#define UNIT_LINK_PROTOCOL 1u

/* Requests; an answer is the same with UNIT_LINK_ANSWER. Append-only. */
enum {
    UNIT_LINK_HELLO = 0x01,
    UNIT_LINK_SESSION = 0x02,
    UNIT_LINK_PARAM_INFO = 0x03,
    UNIT_LINK_SIGNAL_INFO = 0x04,
    UNIT_LINK_GET = 0x10,
    UNIT_LINK_SET = 0x11,
    UNIT_LINK_SAVE = 0x12,
    UNIT_LINK_STORE = 0x13,
    UNIT_LINK_CHALLENGE = 0x14,
    UNIT_LINK_UNLOCK = 0x15,
    UNIT_LINK_STORE_ENTRY = 0x16,
    UNIT_LINK_COMMAND = 0x20,
    UNIT_LINK_STATUS = 0x21,
    UNIT_LINK_SAMPLE = 0x22,
    UNIT_LINK_COMMISSIONING = 0x23,
    UNIT_LINK_LOADER = 0x24,
    UNIT_LINK_TRACE_ARM = 0x30,
    UNIT_LINK_TRACE_STATE = 0x31,
    UNIT_LINK_TRACE_READ = 0x32,
    UNIT_LINK_TRACE_STOP = 0x33,
    UNIT_LINK_FLIGHT_ARM = 0x34,
    UNIT_LINK_FLIGHT_STATE = 0x35,
    UNIT_LINK_FLIGHT_READ = 0x36,
    UNIT_LINK_FAULT_LOG = 0x40,
    UNIT_LINK_FAULT_RECORD = 0x41,
    UNIT_LINK_FAULT_READ = 0x42,
    UNIT_LINK_FAULT_CLEAR = 0x43,
    UNIT_LINK_SEALED = 0x50 /* another request with counter and MAC */
};

#define UNIT_LINK_ANSWER 0x80u

/* First byte of every answer's body; 1..4 are params_status_t. Append-only. */
typedef enum {
    UNIT_LINK_OK = 0,
    UNIT_LINK_NOT_FINITE = 1,
    UNIT_LINK_OUT_OF_RANGE = 2,
    UNIT_LINK_NOT_WHOLE = 3,
    UNIT_LINK_NO_SUCH = 4, /* parameter, signal, row */
    UNIT_LINK_NO_SUCH_OP = 5,
    UNIT_LINK_BAD_LENGTH = 6,
    UNIT_LINK_NO_SESSION = 7, /* another host's, or from before a reset */
    UNIT_LINK_NOT_NOW = 8,    /* needs the gates off and no run command; or locked out */
    UNIT_LINK_PROTECTED = 9,
    UNIT_LINK_REFUSED = 10,   /* in range, but excluded by other values */
    UNIT_LINK_NOT_SEALED = 11 /* needs a sealed request: counter, MAC, session */
} unit_link_status_t;

/* A zeroed state is valid. */
typedef struct {
    command_parser_t parser;
    command_writer_t answer;
    uint32_t sent; /* of the answer's bytes */
    bool answered; /* the answer is that to last_* */
    uint8_t last_sequence;
    uint32_t last_crc32c;

    uint32_t session; /* 0: none */
    uint32_t command; /* SEQUENCE_CMD_* */
    float omega_m_ref_rad_s;
    float torque_ref_Nm;
    uint32_t commands;      /* number of commands received */
    uint32_t valid_periods; /* 0: no time limit */
    uint32_t commanded_at;  /* period of the last command */
    uint32_t reset_at;      /* period in which a reset was fetched */
    bool reset;             /* a reset is requested and not fetched yet */
    bool expired;           /* the last command expired */
    bool leaving;           /* into the boot loader, once the answer is sent */

    uint32_t terminal_faults; /* TERMINAL_FAULT_* of a board that has terminals; shown */
} unit_link_t;

#endif
