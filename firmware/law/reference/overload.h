/* I2t of motor and inverter: a first-order thermal model each, x' = ((i/i_cont)^2 - x) / tau.
 *
 * x = 1 is the steady state at the continuous current. Above it the current limit falls linearly,
 * from its full value to the continuous current at 1.05, where x then stays: an overloaded drive
 * becomes weaker but does not stop. It stops at 1.2, which only a current outside the limit's reach
 * can cause. Currents power invariant; step once per schedule.
 */
#ifndef OVERLOAD_H
#define OVERLOAD_H

#include <stdbool.h>

#include "num.h"

#define OVERLOAD_MOTOR    0
#define OVERLOAD_INVERTER 1
#define OVERLOAD_MODELS   2

typedef struct {
    float cont_A[OVERLOAD_MODELS]; /* continuous; 0: not watched */
    float tau_s[OVERLOAD_MODELS];
    float i_max_A; /* of the drive, without derating */
} overload_params_t;

typedef struct {
    float cont_A[OVERLOAD_MODELS];
    float warm_per_A2[OVERLOAD_MODELS]; /* T / (tau i_cont^2); 0: not watched */
    float fade[OVERLOAD_MODELS];        /* T / tau */
    float i_max_A;
} overload_config_t;

typedef struct {
    float heat_pu[OVERLOAD_MODELS];
    float i_max_A; /* while derating */
    bool derating;
} overload_state_t;

/* False for a current that is negative, not finite or above i_max, or a time constant that is
 * shorter than the schedule or not finite. */
CHECKED bool overload_init(overload_config_t *cfg, const overload_params_t *params,
                           float schedule_s);

/* True: stop the drive. */
bool overload_step(const overload_config_t *cfg, overload_state_t *st, float i2_A2);

#endif
