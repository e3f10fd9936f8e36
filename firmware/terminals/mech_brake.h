/* Mechanical brake of a hoist: the motor proves its torque before the brake releases, and holds the
 * load until the brake has closed.
 *
 *   CLOSED -> PROVING -> RELEASING -> RELEASED -> CLOSING -> CLOSED
 *
 * PROVING asks for torque_Nm against the closed brake. RELEASING and CLOSING hold speed zero, and
 * last until the brake's switch, or the time where there is none, says that they are over. Without
 * gates the brake closes at once, and run has to drop before it counts again. Speeds of the shaft.
 *
 * The switch counts once it has stood for MECH_BRAKE_FEEDBACK_STEPS. When it contradicts: RELEASED
 * ends with the brake closed; PROVING becomes CLOSING, and the motor holds; CLOSED starts nothing.
 */
#ifndef MECH_BRAKE_H
#define MECH_BRAKE_H

#include <stdbool.h>
#include <stdint.h>

#include "num.h"

#define MECH_BRAKE_PROVEN_PU      0.9f /* of torque_Nm */
#define MECH_BRAKE_PROVEN_STEPS   20u  /* that it has to stand */
#define MECH_BRAKE_FEEDBACK_STEPS 5u   /* that a level of the switch has to stand */

/* Bits of mech_brake_out_t.faults. */
#define MECH_BRAKE_NO_TORQUE    (1u << 0) /* not proven within prove_steps */
#define MECH_BRAKE_NOT_RELEASED (1u << 1) /* not within release_steps */
#define MECH_BRAKE_LOST         (1u << 2) /* the switch says closed while it is released */
/* the switch says released although it should be closed */
#define MECH_BRAKE_NOT_CLOSED (1u << 3)

typedef enum {
    MECH_BRAKE_CLOSED = 0,
    MECH_BRAKE_PROVING = 1,
    MECH_BRAKE_RELEASING = 2,
    MECH_BRAKE_RELEASED = 3,
    MECH_BRAKE_CLOSING = 4
} mech_brake_id_t;

typedef struct {
    bool on;
    bool feedback;          /* the brake has a switch */
    float torque_Nm;        /* to be proven; positive lifts */
    float close_rad_s;      /* the brake closes below this speed */
    uint32_t prove_steps;   /* longest time in PROVING with the drive in RUN */
    uint32_t release_steps; /* until it has released, or must have */
    uint32_t close_steps;   /* until it has closed, or must have */
    uint32_t stop_steps;    /* after a stop it closes at any speed */
} mech_brake_config_t;

typedef struct {
    mech_brake_id_t id;
    uint32_t steps;   /* in this state */
    uint32_t proven;  /* steps in a row */
    uint32_t differs; /* steps of the switch against `released` */
    bool released;    /* the switch, debounced */
    bool energised;   /* the gates were on since PROVING began */
    bool blocked;     /* run has to drop */
} mech_brake_state_t;

typedef struct {
    uint32_t steps; /* since the last look (lapse.h) */
    bool run;       /* wanted */
    bool off;       /* gates off at once */
    float omega_ref_rad_s;
    bool gates_on;
    bool running;          /* the drive follows its reference */
    float torque_Nm;       /* estimated */
    float omega_hat_rad_s; /* NaN: unknown */
    bool released;         /* the switch, not debounced */
} mech_brake_in_t;

typedef struct {
    bool release;     /* energise the coil */
    bool run;         /* for the drive */
    bool torque_mode; /* with torque_Nm; else speed */
    float torque_Nm;
    float omega_ref_rad_s;
    uint32_t faults; /* MECH_BRAKE_* of this step */
} mech_brake_out_t;

/* False for a number that is not finite or not positive. */
CHECKED bool mech_brake_init(mech_brake_config_t *cfg);

mech_brake_out_t mech_brake_step(const mech_brake_config_t *cfg, mech_brake_state_t *st,
                                 const mech_brake_in_t *in);

#endif
