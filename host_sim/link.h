/* The drive on its rig with its host link: bytes in, bytes out, in steps of control periods. Part
 * of the SIL library; the caller owns line and clock (a socket, a test).
 */
#ifndef ZH_LINK_H
#define ZH_LINK_H

#include "sim.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct zh_link zh_link;

/* A classic CAN data frame. */
typedef struct {
    uint32_t id;     /* 11 bits */
    uint32_t length; /* 0..8 */
    uint8_t data[8];
} zh_can_frame;

typedef struct {
    uint32_t struct_size; /* sizeof(zh_link_state), set by the caller */
    uint32_t gates_on;    /* in the last period */
    uint64_t periods;
    uint64_t digest; /* of duties and gates of every period: equal runs have equal ones */
    double time_s;
    double speed_rpm; /* true, of the shaft */
    double u_dc_V;    /* true, as a meter reads it */
    double i_u_A;     /* at the drive's terminals, as a current clamp reads it */
    double i_v_A;
    double i_w_A;
} zh_link_state;

/* Rig, board, motor, firmware parameters and profiles of the job; it continues beyond the
 * scenario's end. from_link: commands and reference come over the link, else from the scenario.
 * keep: NULL, or a file that holds what survives power-down: the drive's parameters and its fault
 * record. The file is made if missing, and written at each change of the flash and by
 * zh_link_close. NULL when refused: zh_sil_error(). */
ZH_API zh_link *zh_link_open(const zh_sim_job *job, uint32_t from_link, const char *keep);

/* Control periods, with a slice of the background after each. *received_n: bytes for the drive; on
 * return the number taken. *sent_n: space for its answer; on return its length. */
ZH_API int zh_link_run(zh_link *handle, uint32_t periods, const uint8_t *received,
                       uint32_t *received_n, uint8_t *sent, uint32_t *sent_n);

/* The drive's Modbus line (RTU): bytes that reach it together at the next period, a character's
 * time at ZH_LINK_MODBUS_BAUD apart. */
#define ZH_LINK_MODBUS_BAUD 115200u
ZH_API int zh_link_modbus_put(zh_link *handle, const uint8_t *received, uint32_t n);

/* What the drive has said on it. *sent_n: space; on return the length. */
ZH_API int zh_link_modbus_take(zh_link *handle, uint8_t *sent, uint32_t *sent_n);

/* The drive's CAN line: a frame for it, one per period in the order given; and what it has sent:
 * *taken is 1 and *frame the next, or 0. The slave starts with the first call of either. */
ZH_API int zh_link_can_put(zh_link *handle, const zh_can_frame *frame);
ZH_API int zh_link_can_take(zh_link *handle, zh_can_frame *frame, uint32_t *taken);

/* Load, resistances, dc link and faults of another scenario from the next period, as zh_sim_change;
 * its commands are ignored. */
ZH_API int zh_link_change(zh_link *handle, const char *scenario);

ZH_API int zh_link_get_state(const zh_link *handle, zh_link_state *state);

/* NULL is allowed. */
ZH_API void zh_link_close(zh_link *handle);

#ifdef __cplusplus
}
#endif

#endif
