#include "auto_restart.h"

#include "fault_reaction.h"

/* Having run for so long after a restart, the drive may use all of them again. */
#define AUTO_RESTART_FORGIVE_S 60.0f

bool auto_restart_init(auto_restart_config_t *cfg, const params_t *params)
{
    const float period_s = params->period_s;
    cfg->count = params->restart_count;
    return sequence_periods(&cfg->delay_periods, params->restart_delay_s, period_s) &&
           sequence_periods(&cfg->forgive_periods, AUTO_RESTART_FORGIVE_S, period_s);
}

/* FAULT, and nothing but a dip behind it: true when the cause has been gone long enough. */
static bool due(const auto_restart_config_t *cfg, auto_restart_state_t *st,
                const auto_restart_in_t *in)
{
    const bool dip = (fault_stopping(in->latched) & ~AUTO_RESTART_FAULTS) == 0u;
    const bool cause = (fault_stopping(in->faults) != 0u) || !in->fed;
    if (!st->ran || !dip || cause || (st->used >= cfg->count)) {
        st->periods = 0u;
        return false;
    }
    st->periods++;
    return st->periods > cfg->delay_periods;
}

/* A run long enough clears the count of restarts. */
static void forgive_after_run(const auto_restart_config_t *cfg, auto_restart_state_t *st)
{
    st->periods++;
    if (st->periods > cfg->forgive_periods) {
        st->used = 0u;
    }
}

uint32_t auto_restart_step(const auto_restart_config_t *cfg, auto_restart_state_t *st,
                           const auto_restart_in_t *in)
{
    if (!auto_restart_on(cfg)) {
        return in->command;
    }
    if ((in->command & ~SEQUENCE_CMD_TORQUE_MODE) != SEQUENCE_CMD_RUN) {
        /* The operator has let go, or acts himself. */
        *st = (auto_restart_state_t){0};
        return in->command;
    }
    if (in->id != st->id) {
        st->id = in->id;
        st->periods = 0u;
    }
    st->ran = st->ran || (in->id == SEQUENCE_PREMAGNETISE) || (in->id == SEQUENCE_RUN);
    if (in->id == SEQUENCE_FAULT) {
        if (due(cfg, st, in)) {
            st->periods = 0u;
            st->used++;
            return SEQUENCE_CMD_FAULT_RESET;
        }
    } else if ((in->id == SEQUENCE_RUN) && (st->used > 0u)) {
        forgive_after_run(cfg, st);
    } else {
        /* on the way */
    }
    return in->command;
}
