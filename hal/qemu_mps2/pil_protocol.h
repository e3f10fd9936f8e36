/* Interface between the emulated image and the plant on the host: little-endian structs on two
 * FIFOs, one exchange per control period.
 *
 *   image -> hello;  plant -> start;  image -> ready (0: accepted)
 *   each period: plant -> in, image -> out;  in with a stop flag: image -> end, and it exits
 */
#ifndef PIL_PROTOCOL_H
#define PIL_PROTOCOL_H

#include <stdint.h>

#include "hal_drive_io.h"
#include "params.h"

#define PIL_MAGIC 0x5A48504Cu /* "ZHPL" */

/* In the folder the emulator runs in. The image opens TO first, so the plant does too. */
#define PIL_FIFO_TO_IMAGE   "to_image"
#define PIL_FIFO_FROM_IMAGE "from_image"

/* An optional file; the host link reads it before its serial port. */
#define PIL_LINK_FILE "link_frames"

/* Optional files of an image with a fieldbus: what the masters say, pil_frame_t by pil_frame_t.
 * With any of them the fieldbus commands, not pil_in_t. The drive's frames go to the other files.
 */
#define PIL_MODBUS_HEARD "modbus_heard"
#define PIL_MODBUS_SAID  "modbus_said"
#define PIL_CAN_HEARD    "can_heard"
#define PIL_CAN_SAID     "can_said"

#define PIL_PERIOD_US 200u

enum {
#define SIGNAL_F(name, path, text)  PIL_SIGNAL_##name,
#define SIGNAL_U(name, path, text)  PIL_SIGNAL_##name,
#define SIGNAL_OF(name, path, text) PIL_SIGNAL_##name,
#define SIGNAL_OU(name, path, text) PIL_SIGNAL_##name,
#define SIGNAL_X(name, value, text) PIL_SIGNAL_##name,
#include "signal_list.def"
#undef SIGNAL_F
#undef SIGNAL_U
#undef SIGNAL_OF
#undef SIGNAL_OU
#undef SIGNAL_X
    PIL_SIGNALS
};

typedef struct {
    uint32_t magic;
    uint32_t params_bytes;
    uint32_t signals;
    uint32_t table_crc32c;
    uint32_t image_crc32c;
    uint32_t clock_Hz; /* of the ticks below */
} pil_hello_t;

typedef struct {
    uint32_t use_params; /* 0: the image's own */
    uint32_t inject;     /* PIL_INJECT_*, at period inject_at */
    uint32_t inject_at;
    uint32_t inject_address; /* PIL_INJECT_SKIP: of the instruction */
    params_t params;
} pil_start_t;

/* Defects that the image can be told to have, for tests of how it ends. */
typedef enum {
    PIL_INJECT_NONE = 0,
    PIL_INJECT_WILD_WRITE = 1,
    PIL_INJECT_NULL_WRITE = 2,
    PIL_INJECT_CODE_WRITE = 3,
    PIL_INJECT_STACK_OVERFLOW = 4,
    PIL_INJECT_DIVISION_BY_ZERO = 5,
    PIL_INJECT_UNDEFINED_INSTRUCTION = 6,
    PIL_INJECT_STUCK_CONTROL = 7, /* the interrupt never ends */
    PIL_INJECT_DEAD_CONTROL = 8,  /* the interrupt no longer comes */
    PIL_INJECT_STUCK_BACKGROUND = 9,
    PIL_INJECT_TABLE_BIT = 10,
    PIL_INJECT_IMAGE_BIT = 11,
    PIL_INJECT_OVERRUN = 12,  /* one period takes too long */
    PIL_INJECT_OVERRUNS = 13, /* two in a row do */
    PIL_INJECT_EXECUTE_RAM = 14,
    PIL_INJECT_HANG = 15, /* one period takes as long as three */
    /* Not a defect: from then on the background changes the parameters again and again, to the same
     * values. */
    PIL_INJECT_LIVE_CHANGE = 16,
    PIL_INJECT_TRACE = 17, /* nor this: from then on eight signals are recorded in every period */
    PIL_INJECT_SKIP = 18,  /* in one period one instruction is skipped */
    PIL_INJECT_COUNT
} pil_inject_t;

#define PIL_STOP (1u << 31) /* in `command`: exit */

typedef struct {
    uint32_t command; /* SEQUENCE_CMD_*, PIL_STOP */
    float omega_m_ref_rad_s;
    float torque_ref_Nm;
    uint32_t command_count;
    hal_sample_t sample; /* late_periods is the image's own */
} pil_in_t;

/* A CAN frame, or up to eight bytes of a serial line. */
typedef struct {
    uint32_t at_us; /* since the first control period */
    uint16_t id;
    uint8_t length;
    uint8_t reserved;
    uint8_t data[8];
} pil_frame_t;

typedef struct {
    uint32_t begin_ticks; /* when the interrupt's own work began and ended: main.c */
    uint32_t end_ticks;
    uint32_t late_periods;  /* so far: the count that comes with the next sample */
    uint32_t latency_ticks; /* from the timer's event to the interrupt's first statement */
    uint32_t command;       /* as the period found it: with a fieldbus not that of pil_in_t */
    float omega_m_ref_rad_s;
    float torque_ref_Nm;
    uint32_t command_count;
    uint32_t signal[PIL_SIGNALS];
} pil_out_t;

typedef struct {
    uint32_t magic;
    uint32_t stack_bytes;
    uint32_t stack_used_bytes;
    uint32_t late_periods;
    uint32_t background_calls;
} pil_end_t;

#endif
