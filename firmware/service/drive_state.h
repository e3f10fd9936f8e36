/* State machine around the control law: who may open the gates, and what happens after a fault.
 *
 * Numbers are append-only. BOOT -> SELF_TEST (current offsets) -> READY -> PREMAGNETISE -> RUN;
 * a fault latches FAULT, torque-off holds TORQUE_OFF; both, and everything unexpected, close the
 * gates. RAMP_DOWN, COAST and COMMISSIONING keep their numbers and are not entered yet.
 */
#ifndef DRIVE_STATE_H
#define DRIVE_STATE_H

#include <stdbool.h>
#include <stdint.h>

#include "drive.h"

typedef enum {
    DRIVE_STATE_BOOT = 0,
    DRIVE_STATE_SELF_TEST = 1,
    DRIVE_STATE_READY = 2,
    DRIVE_STATE_PREMAGNETISE = 3,
    DRIVE_STATE_RUN = 4,
    DRIVE_STATE_RAMP_DOWN = 5,
    DRIVE_STATE_COAST = 6,
    DRIVE_STATE_COMMISSIONING = 7,
    DRIVE_STATE_FAULT = 8,
    DRIVE_STATE_TORQUE_OFF = 9
} drive_state_id_t;

#define DRIVE_STATE_CMD_RUN         (1u << 0) /* level */
#define DRIVE_STATE_CMD_FAULT_RESET (1u << 1) /* rising edge */
#define DRIVE_STATE_CMD_TORQUE_OFF  (1u << 2) /* level, wins over everything but a fault */

typedef struct {
    uint32_t offset_periods; /* current offsets are averaged this long; 0: none */
    uint32_t premagnetise_periods;
    float offset_max_A; /* a larger offset is a sensor fault */
    float offset_max_V; /* a larger one is a turning motor's voltage: not taken */
} drive_state_config_t;

typedef struct {
    float offset_s; /* 0: no averaging */
    float premagnetise_s;
    float offset_max_A;
    float offset_max_V;
    float period_s;
} drive_state_params_t;

typedef struct {
    drive_state_id_t id;
    uint32_t periods; /* in this state */
    uint32_t faults;  /* latched */
    uint32_t last_command;
    bool run_blocked; /* after a fault or torque-off, until run was seen low */
    uvw_t offset_sum_A;
    uvw_t offset_A; /* the mean, once SELF_TEST has it */
    ab_t offset_sum_V;
    ab_t offset_V;
} drive_machine_t;

typedef struct {
    uint32_t command;
    uint32_t faults;     /* of this period */
    uvw_t i_raw_A;       /* gates off: its mean is the offset */
    ab_t u_raw_V;        /* likewise */
    bool premagnetising; /* the drive is not done with it: RUN has to wait */
} drive_state_in_t;

typedef struct {
    drive_mode_t mode; /* for the next step of the control law */
    bool gates_on;
    bool offsets_ready; /* one period: take the machine's offsets */
} drive_state_out_t;

/* False for a time that is negative or too long to count, or a limit that is not positive. */
CHECKED bool drive_state_init(drive_state_config_t *cfg, const drive_state_params_t *params);

drive_state_out_t drive_state_step(const drive_state_config_t *cfg, drive_machine_t *st,
                                   const drive_state_in_t *in);

#endif
