/* Does the shaft do what was asked of it? Once in sixteen periods, in every mode with the gates on.
 *
 *   deviation  |reference - speed| beyond its limit, and the speed does not come nearer: time
 *              counts twice where it is twice as far
 *   frequency  |w_s| beyond the over-speed trip: the estimate of the speed is bounded, this is not
 *   rotor      a mode that imposes the frequency: the rotor has to follow it (rotor_check.h)
 *   unknown    nobody knows the speed: a limit of time
 *   start      the shaft turns under the direct current of a start (rotor_check.h)
 *
 * Counts rise twice as fast when something is wrong as they fall when it is not: a shaft that
 * swings about its reference is found as well as one that runs away. Electrical speeds.
 */
#ifndef SPEED_GUARD_H
#define SPEED_GUARD_H

#include "fault.h"
#include "rotor_check.h"

/* Where the drive has its speed from. */
typedef enum {
    SPEED_BASIS_NONE = 0,     /* gates off */
    SPEED_BASIS_STANDING = 1, /* direct current along alpha: taken as 0 */
    SPEED_BASIS_ESTIMATE = 2, /* vector control */
    SPEED_BASIS_CURRENT = 3,  /* a current vector turns at an imposed frequency */
    SPEED_BASIS_VOLTAGE = 4,  /* a voltage vector does */
    SPEED_BASIS_NOBODY = 5    /* dc brake, search */
} speed_basis_t;

typedef struct {
    float deviation_rad_s;
    float deviation_s;
    float unknown_s;
    float over_speed_rad_s;
    float lambda_nominal_Wb;
} speed_guard_params_t;

typedef struct {
    float deviation_rad_s;
    float over_speed_rad_s;
    float deviation_s;
    float unexplained_s; /* deviation without a limit of torque */
    float warning_s;
    float schedule_s;
    float nearer_share;
    float unknown_s;
    float doubt_s; /* of a rotor that does not follow: the speed counts as unknown */
    rotor_check_config_t rotor;
} speed_guard_config_t;

typedef struct {
    speed_basis_t basis;
    float omega_slow_rad_s; /* the speed, low-passed: what it is compared with to see it move */
    float deviation_s;      /* time away, twice as fast where twice as far */
    float unexplained_s;    /* likewise, with torque to spare */
    float away_s;           /* time away, wherever */
    uint32_t frequency;     /* count of debounce.h */
    float unknown_s;
    float lost_s; /* the rotor does not follow */
    bool speed_unknown;
    rotor_check_state_t rotor;
} speed_guard_state_t;

typedef struct {
    speed_basis_t basis;
    float omega_rad_s;     /* estimated or imposed */
    float omega_ref_rad_s; /* behind the ramp */
    float omega_s_rad_s;
    bool at_limit;       /* all the torque that the limits allow */
    bool premagnetising; /* nothing but direct current along alpha */
    rotor_check_in_t rotor;
} speed_guard_in_t;

/* False for a number that is not finite or not positive, or a time beyond a million schedules. */
CHECKED bool speed_guard_init(speed_guard_config_t *cfg, const speed_guard_params_t *params,
                              const motor_model_t *motor, float schedule_s);

/* SPEED_DEVIATION, OVER_SPEED, FLYING_START; DERATED: the limits of the current leave too little.
 */
uint32_t speed_guard_look(const speed_guard_config_t *cfg, speed_guard_state_t *st,
                          const speed_guard_in_t *in);

#endif
