/* Parameters that survive power-down, and access to them: the store and the access control of one
 * drive, with its devices. Background only.
 */
#ifndef UNIT_STORE_H
#define UNIT_STORE_H

#include "access.h"
#include "param_store.h"

/* Times of the access control, in the drive's own time. */
#define UNIT_STORE_LOCKOUT_S   10.0f /* after three wrong answers */
#define UNIT_STORE_POWER_UP_S  1.0f  /* from power-up */
#define UNIT_STORE_CHALLENGE_S 10.0f /* an answer has to come within */
#define UNIT_STORE_UNLOCKED_S                                                                      \
    600.0f /* then it locks by itself; a session, after such a silence                             \
            */

/* A zeroed state is valid: locked, nothing found, nothing to save. */
typedef struct {
    param_store_t store;
    param_store_found_t found; /* at start */
    param_store_report_t report;
    access_config_t access_cfg;
    access_t access;
    uint32_t tick_at; /* period of the guard's last tick */
} unit_store_t;

#endif
