/* The contract of a mode: its inputs and its request. A mode decides what the drive wants in a
 * period. Exactly one mode acts at a time, and none looks at another.
 */
#ifndef MODE_H
#define MODE_H

#include <stdbool.h>
#include <stdint.h>

#include "acting_voltage.h"
#include "estimate.h"
#include "measurement.h"
#include "slots.h"
#include "torque_limits.h"

/* Request of the sequence. */
typedef enum {
    DRIVE_OFF = 0,          /* gates off: estimator and controllers reset, currents still watched */
    DRIVE_PREMAGNETISE = 1, /* i_d along a fixed axis, no torque, speed taken as 0 */
    DRIVE_RUN = 2,          /* follows the aim, in the configured mode */
    DRIVE_COMMISSION = 3    /* i_d as asked along phase u, nothing estimated or compensated */
} drive_mode_t;

/* Aim of DRIVE_RUN. */
typedef enum {
    DRIVE_AIM_SPEED = 0,
    DRIVE_AIM_TORQUE = 1, /* within two speed limits */
    DRIVE_AIM_STOP = 2    /* speed 0, on the ramp of a stop */
} drive_aim_t;

typedef enum {
    MODE_OFF = 0,
    MODE_PREMAGNETISE = 1,
    MODE_COMMISSIONING = 2,
    MODE_FLYING_START = 3, /* searches for the speed of a turning shaft */
    MODE_REMAGNETISE = 4,  /* motor turned at the start: flux-oriented, no torque */
    MODE_VECTOR = 5,
    MODE_TAKE_OVER = 6, /* orientation lost: I-f holds the load, the estimator runs in parallel */
    MODE_I_F = 7,
    MODE_VOLTS_PER_HERTZ = 8,
    MODE_DC_BRAKE = 9
} mode_id_t;

typedef enum {
    REQUEST_CURRENT = 0, /* i_ref_A in the frame of axis */
    REQUEST_VOLTAGE = 1  /* u_ref_V unchanged; the current controllers follow */
} request_kind_t;

typedef struct {
    request_kind_t kind;
    ab_t axis; /* d axis of the frame */
    dq_t i_ref_A;
    ab_t u_ref_V;        /* stationary, for when the duties act */
    bool busy;           /* measuring or searching: RUN has to wait, no dead-time compensation */
    float omega_e_rad_s; /* imposed by a mode that rotates the frame or needs no speed */
} request_t;

/* Request to the drive. */
typedef struct {
    drive_mode_t mode;
    drive_aim_t aim;
    float omega_e_ref_rad_s; /* 0 with DRIVE_AIM_STOP */
    float torque_ref_Nm;
    float i_d_ref_A; /* DRIVE_COMMISSION alone */
} drive_in_t;

/* Input of a mode. */
typedef struct {
    const drive_in_t *asked;
    const measured_t *meas;
    const estimate_t *estimate;
    const torque_limits_state_t *limits;
    const acting_voltage_state_t *acting;
    ab_t u_s_V;   /* of the interval that ended, from the voltage source in use */
    float Rs_ohm; /* in use */
    float M_pu;   /* M and Rr as far as they are known, over the parameters */
    float Rr_pu;
    bool torque_surges; /* supervisor.h */
    uint32_t slot;
} mode_in_t;

static inline bool mode_running(const mode_in_t *in)
{
    return in->asked->mode == DRIVE_RUN;
}

/* d axis along the flux if that exceeds `least`; otherwise fixed. A NaN counts as no flux. */
static inline ab_t mode_flux_axis(const estimate_t *e, float least_Wb)
{
    return (e->lambda_Wb > least_Wb) ? ab_scale(e->lambda_r_hat_Wb, 1.0f / e->lambda_Wb)
                                     : (ab_t){1.0f, 0.0f};
}

#endif
