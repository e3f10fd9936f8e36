/* Speed checks: does the shaft follow its reference? Once in sixteen periods, in every mode with
 * the gates on.
 *
 *   deviation  |reference - speed| above its limit, without approaching: time counts twice at twice
 *              the deviation; half the limit counts while all torque is in use, and is told;
 *              any deviation while the field nearly stands under all torque
 *   frequency  |w_s| beyond the over-speed trip: the speed estimate is limited, w_s is not
 *   rotor      a mode imposes the frequency: the rotor has to follow it (rotor_check.h)
 *   unknown    nothing shows the rotor of an imposed frequency: limited time
 *   start      the shaft turns under the direct current of a start (rotor_check.h)
 *
 * Counts rise twice as fast when a check fails as they fall when it passes. So a shaft that swings
 * about its reference is found as well as one that runs away. Electrical speeds.
 */
#ifndef SPEED_GUARD_H
#define SPEED_GUARD_H

#include "fault.h"
#include "rotor_check.h"

/* Source of the drive's speed. */
typedef enum {
    SPEED_BASIS_NONE = 0,       /* gates off */
    SPEED_BASIS_STANDING = 1,   /* direct current along alpha: taken as 0 */
    SPEED_BASIS_ESTIMATE = 2,   /* vector control */
    SPEED_BASIS_TAKEN_OVER = 3, /* a current vector holds the load, at an imposed frequency */
    SPEED_BASIS_CURRENT = 4,    /* a current vector turns at an imposed frequency */
    SPEED_BASIS_VOLTAGE = 5,    /* a voltage vector does */
    SPEED_BASIS_NOBODY = 6      /* dc brake, search */
} speed_basis_t;

typedef struct {
    float deviation_rad_s;
    float deviation_s;
    float unknown_s;
    float over_speed_rad_s;
    float lambda_nominal_Wb;
    float count_V; /* answer of the current controller to one count of the current ADC */
} speed_guard_params_t;

typedef struct {
    float deviation_rad_s;
    float over_speed_rad_s;
    float deviation_s;
    float unexplained_s; /* deviation with torque in reserve */
    float warning_s;
    float approach_s;
    float schedule_s;
    float nearer_share;
    float unknown_s;
    rotor_check_config_t rotor;
} speed_guard_config_t;

typedef struct {
    speed_basis_t basis;
    float omega_slow_rad_s; /* low-passed speed, to see whether the speed changes */
    float omega_ref_rad_s;  /* of the last look */
    float deviation_s;      /* time of deviation, twice as fast at twice the deviation */
    float unexplained_s;    /* likewise, with torque in reserve; beside a ramp plain time */
    float away_s;           /* time of any deviation */
    float approach_s; /* likewise, on the way back too; with all torque in use at half the limit */
    uint32_t frequency; /* count of debounce.h */
    float unknown_s;
    float lost_s; /* time out of step */
    bool speed_unknown;
    rotor_check_state_t rotor;
} speed_guard_state_t;

typedef struct {
    speed_basis_t basis;
    float omega_rad_s;     /* estimated or imposed */
    float omega_ref_rad_s; /* behind the ramp */
    float omega_s_rad_s;
    bool at_limit;       /* at the torque limits */
    bool in_doubt;       /* any speed explains the estimate */
    bool premagnetising; /* only direct current along alpha */
    rotor_check_in_t rotor;
} speed_guard_in_t;

/* False for a number that is not finite or not positive, or a time beyond a million schedules. */
CHECKED bool speed_guard_init(speed_guard_config_t *cfg, const speed_guard_params_t *params,
                              const motor_model_t *motor, float schedule_s);

/* The faults SPEED_DEVIATION, OVER_SPEED and FLYING_START, and DERATED when the current limits
 * leave too little torque, or the speed stays behind. */
uint32_t speed_guard_look(const speed_guard_config_t *cfg, speed_guard_state_t *st,
                          const speed_guard_in_t *in);

#endif
