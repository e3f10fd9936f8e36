/* Automatic restart after a dip of the dc link: acknowledges the fault and runs again, a limited
 * number of times.
 *
 * It stands between the operator's command word and the state machine, and acts like an operator:
 * fault reset with run low for a period, then the operator's command again. It acts only on faults
 * of the dc link, and only after the cause has been gone for a while. Nothing but run may have been
 * requested since the drive ran: a run command that torque-off or a fault reset left active starts
 * nothing. Off by default.
 */
#ifndef AUTO_RESTART_H
#define AUTO_RESTART_H

#include <stdbool.h>
#include <stdint.h>

#include "sequence.h"

/* The faults that a dip leaves. */
#define AUTO_RESTART_FAULTS (FAULT_DC_UNDER_VOLTAGE | FAULT_MAINS_LOST)

typedef struct {
    uint32_t count;
    uint32_t delay_periods;
    uint32_t forgive_periods;
} auto_restart_config_t;

typedef struct {
    uint32_t used;    /* restarts so far */
    uint32_t periods; /* without a cause in FAULT, or of running */
    sequence_id_t id; /* in which these are counted */
    bool ran;         /* under the command that is still active */
} auto_restart_state_t;

typedef struct {
    uint32_t command; /* from the operator */
    sequence_id_t id;
    uint32_t latched; /* faults of the machine */
    uint32_t faults;  /* present faults */
    bool fed;         /* the dc link is at the level of the mains */
} auto_restart_in_t;

/* False for a time that sequence_periods refuses. */
CHECKED bool auto_restart_init(auto_restart_config_t *cfg, const params_t *params);

static inline bool auto_restart_on(const auto_restart_config_t *cfg)
{
    return cfg->count > 0u;
}

/* The command word for the state machine. */
COLD uint32_t auto_restart_step(const auto_restart_config_t *cfg, auto_restart_state_t *st,
                                const auto_restart_in_t *in);

#endif
