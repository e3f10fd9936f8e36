#include "drive_state.h"

#include "fault_reaction.h"

/* Longest time that fits a period counter with room to spare. */
#define DRIVE_STATE_MAX_PERIODS 1000000000.0f

static bool whole_periods(uint32_t *periods, float time_s, float period_s)
{
    if (!nonnegativef(time_s) || !positivef(period_s)) {
        return false;
    }
    const float n = time_s / period_s + 0.5f;
    if (!(n < DRIVE_STATE_MAX_PERIODS)) {
        return false;
    }
    *periods = (uint32_t)n;
    return true;
}

bool drive_state_init(drive_state_config_t *cfg, const drive_state_params_t *params)
{
    cfg->offset_max_A = params->offset_max_A;
    cfg->offset_max_V = params->offset_max_V;
    return whole_periods(&cfg->offset_periods, params->offset_s, params->period_s) &&
           whole_periods(&cfg->premagnetise_periods, params->premagnetise_s, params->period_s) &&
           positivef(params->offset_max_A) && positivef(params->offset_max_V);
}

static void enter(drive_machine_t *st, drive_state_id_t id)
{
    st->id = id;
    st->periods = 0u;
}

/* SELF_TEST: the mean of the currents with the gates off is the sensors' offset. */
static void self_test(const drive_state_config_t *cfg, drive_machine_t *st,
                      const drive_state_in_t *in, drive_state_out_t *out)
{
    if (st->periods < cfg->offset_periods) {
        st->offset_sum_A.u += in->i_raw_A.u;
        st->offset_sum_A.v += in->i_raw_A.v;
        st->offset_sum_A.w += in->i_raw_A.w;
        st->offset_sum_V = ab_add(st->offset_sum_V, in->u_raw_V);
        st->periods++;
        return;
    }
    if (cfg->offset_periods > 0u) {
        const float k = 1.0f / (float)cfg->offset_periods;
        const uvw_t offset = {k * st->offset_sum_A.u, k * st->offset_sum_A.v,
                              k * st->offset_sum_A.w};
        if (!(absf(offset.u) <= cfg->offset_max_A) || !(absf(offset.v) <= cfg->offset_max_A) ||
            !(absf(offset.w) <= cfg->offset_max_A)) {
            st->faults |= MONITOR_CURRENT_OFFSET;
            enter(st, DRIVE_STATE_FAULT);
            return;
        }
        const ab_t offset_V = ab_scale(st->offset_sum_V, k);
        const bool still = (absf(offset_V.alpha) <= cfg->offset_max_V) &&
                           (absf(offset_V.beta) <= cfg->offset_max_V);
        out->offsets_ready = true;
        st->offset_A = offset;
        st->offset_V = still ? offset_V : (ab_t){0.0f, 0.0f};
    }
    enter(st, DRIVE_STATE_READY);
}

static void fault_state(drive_machine_t *st, const drive_state_in_t *in, uint32_t rising)
{
    /* Reset is an explicit command, and only once the cause is gone. */
    if (((rising & DRIVE_STATE_CMD_FAULT_RESET) != 0u) && (in->faults == 0u) &&
        ((st->faults & MONITOR_CONFIG) == 0u)) {
        st->faults = 0u;
        st->offset_sum_A = (uvw_t){0.0f, 0.0f, 0.0f};
        st->offset_sum_V = (ab_t){0.0f, 0.0f};
        enter(st, DRIVE_STATE_SELF_TEST);
    }
}

/* Transitions of the states in which nothing is wrong. */
static void normal_states(const drive_state_config_t *cfg, drive_machine_t *st,
                          const drive_state_in_t *in, drive_state_out_t *out)
{
    const bool run = !st->run_blocked && ((in->command & DRIVE_STATE_CMD_RUN) != 0u);

    switch (st->id) {
    case DRIVE_STATE_BOOT:
        enter(st, DRIVE_STATE_SELF_TEST);
        break;
    case DRIVE_STATE_SELF_TEST:
        self_test(cfg, st, in, out);
        break;
    case DRIVE_STATE_READY:
        if (run) {
            enter(st, DRIVE_STATE_PREMAGNETISE); /* the one transition that turns the gates on */
        }
        break;
    case DRIVE_STATE_PREMAGNETISE:
        if (!run) {
            enter(st, DRIVE_STATE_READY);
        } else if (in->premagnetising) {
            st->periods = 0u; /* the flux level of RUN is built up after the measurement */
        } else if (st->periods >= cfg->premagnetise_periods) {
            enter(st, DRIVE_STATE_RUN);
        } else {
            st->periods++;
        }
        break;
    case DRIVE_STATE_RUN:
        if (!run) {
            enter(st, DRIVE_STATE_READY);
        }
        break;
    case DRIVE_STATE_TORQUE_OFF:
        enter(st, DRIVE_STATE_READY);
        break;
    case DRIVE_STATE_RAMP_DOWN:
    case DRIVE_STATE_COAST:
    case DRIVE_STATE_COMMISSIONING:
    case DRIVE_STATE_FAULT:
    default:
        /* Not entered by this version, or a corrupted number: stop and say so. */
        st->faults |= MONITOR_CONFIG;
        enter(st, DRIVE_STATE_FAULT);
        break;
    }
}

/* Faults, commands and transitions of one period. */
static void transitions(const drive_state_config_t *cfg, drive_machine_t *st,
                        const drive_state_in_t *in, drive_state_out_t *out)
{
    const uint32_t rising = in->command & ~st->last_command;
    st->last_command = in->command;
    const bool torque_off = (in->command & DRIVE_STATE_CMD_TORQUE_OFF) != 0u;

    /* Outside FAULT only warnings can be latched; those a reset clears at any time. */
    if ((st->id != DRIVE_STATE_FAULT) && ((rising & DRIVE_STATE_CMD_FAULT_RESET) != 0u)) {
        st->faults = 0u;
    }
    st->faults |= in->faults;
    if ((fault_stopping(in->faults) != 0u) && (st->id != DRIVE_STATE_FAULT)) {
        enter(st, DRIVE_STATE_FAULT);
    }
    if (st->id == DRIVE_STATE_FAULT) {
        fault_state(st, in, rising);
    } else if (torque_off && (st->id != DRIVE_STATE_BOOT) && (st->id != DRIVE_STATE_SELF_TEST)) {
        enter(st, DRIVE_STATE_TORQUE_OFF);
    } else {
        normal_states(cfg, st, in, out);
    }

    /* A run command still standing after a fault or torque-off must not restart the drive. */
    if ((st->id == DRIVE_STATE_FAULT) || (st->id == DRIVE_STATE_TORQUE_OFF)) {
        st->run_blocked = true;
    } else if ((in->command & DRIVE_STATE_CMD_RUN) == 0u) {
        st->run_blocked = false;
    } else {
        /* blocked stays as it is */
    }
}

/* Running, told to run as before, and no fault: no transition has anything to do. Only saves time,
 * in the state in which time is short. */
static bool goes_on(const drive_machine_t *st, const drive_state_in_t *in)
{
    return (st->id == DRIVE_STATE_RUN) && (in->faults == 0u) &&
           (in->command == DRIVE_STATE_CMD_RUN) && (st->last_command == DRIVE_STATE_CMD_RUN) &&
           !st->run_blocked;
}

drive_state_out_t drive_state_step(const drive_state_config_t *cfg, drive_machine_t *st,
                                   const drive_state_in_t *in)
{
    drive_state_out_t out = {.mode = DRIVE_OFF};
    if (!goes_on(st, in)) {
        transitions(cfg, st, in, &out);
    }
    if (st->id == DRIVE_STATE_RUN) {
        out.mode = DRIVE_RUN;
    } else if (st->id == DRIVE_STATE_PREMAGNETISE) {
        out.mode = DRIVE_PREMAGNETISE;
    } else {
        out.mode = DRIVE_OFF;
    }
    out.gates_on = out.mode != DRIVE_OFF;
    return out;
}
