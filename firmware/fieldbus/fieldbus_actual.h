/* What the drive does, in the units of a fieldbus. */
#ifndef FIELDBUS_ACTUAL_H
#define FIELDBUS_ACTUAL_H

#include "fieldbus.h"

/* Status word. */
#define FIELDBUS_READY   (1u << 0)
#define FIELDBUS_GATES   (1u << 1) /* the gates are on */
#define FIELDBUS_RUNS    (1u << 2) /* follows its reference */
#define FIELDBUS_FAULT   (1u << 3) /* in FAULT, to be reset */
#define FIELDBUS_WARNING (1u << 4) /* a fault bit is latched that did not end the run */
#define FIELDBUS_REMOTE  (1u << 5) /* the bus may command */
#define FIELDBUS_ARMED   (1u << 6) /* run was low: it counts */
#define FIELDBUS_EXPIRED (1u << 7) /* the bus was silent for fieldbus_timeout_s */
#define FIELDBUS_UNKNOWN (1u << 8) /* the speed is unknown */

typedef struct {
    uint32_t status;
    uint32_t state;  /* sequence_id_t */
    uint32_t faults; /* latched */
    float speed_rpm; /* estimated, of the shaft; NaN when unknown */
    float torque_Nm; /* estimated, air gap */
    float current_A; /* rms of a phase */
    float u_dc_V;
} fieldbus_actual_t;

void fieldbus_actual(const fieldbus_t *fb, const unit_t *unit, fieldbus_actual_t *actual);

/* At the edge: rpm is min^-1. */
float fieldbus_rad_s_from_rpm(float speed_rpm);
float fieldbus_rpm_from_rad_s(float omega_rad_s);

#endif
