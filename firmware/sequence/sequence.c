#include "sequence.h"

/* Longest time that fits a period counter with room to spare. */
#define SEQUENCE_MAX_PERIODS 1000000000.0f

/* Zero-current offset above this share of full scale is a sensor fault, not an offset. */
#define SEQUENCE_OFFSET_MAX_PU 0.02f

/* Standard deviation, over the largest offset, from which the voltage is a turning motor's. */
#define SEQUENCE_SWING_PU 0.25f

bool sequence_periods(uint32_t *periods, float time_s, float period_s)
{
    if (!nonnegativef(time_s) || !positivef(period_s)) {
        return false;
    }
    const float n = time_s / period_s + 0.5f;
    if (!(n < SEQUENCE_MAX_PERIODS)) {
        return false;
    }
    *periods = (uint32_t)n;
    return true;
}

bool sequence_init(sequence_config_t *cfg, const params_t *params)
{
    cfg->offset_max_A = SEQUENCE_OFFSET_MAX_PU * params->current_full_scale_A;
    cfg->offset_max_V = SEQUENCE_OFFSET_MAX_PU * params->line_voltage_full_scale_V;
    cfg->coast_max_V2 = params->coast_V * params->coast_V;
    cfg->stop = (sequence_stop_t)params->stop_mode;
    if ((cfg->stop != SEQUENCE_STOP_COAST) && (cfg->stop != SEQUENCE_STOP_RAMP)) {
        return false;
    }
    return sequence_periods(&cfg->offset_periods, params->offset_calibration_s, params->period_s) &&
           sequence_periods(&cfg->premagnetise_periods, params->premagnetise_s, params->period_s) &&
           sequence_periods(&cfg->ramp_down_periods, params->ramp_down_s, params->period_s) &&
           sequence_periods(&cfg->coast_periods, params->coast_s, params->period_s) &&
           ALL_NONNEGATIVE(params->coast_V, cfg->coast_max_V2) &&
           ALL_POSITIVE(cfg->offset_max_A, cfg->offset_max_V);
}

/* Only in these may the gates be on. */
static bool powered(sequence_id_t id)
{
    return (id == SEQUENCE_PREMAGNETISE) || (id == SEQUENCE_RUN) || (id == SEQUENCE_RAMP_DOWN) ||
           (id == SEQUENCE_COMMISSIONING);
}

COLD static void enter(sequence_state_t *st, sequence_id_t id)
{
    st->id = id;
    st->periods = 0u;
    if (!powered(id)) {
        st->energised = 0u;
    }
}

/* A start command: the one transition that turns the gates on. */
static void energise(sequence_state_t *st, sequence_id_t id)
{
    st->energised = SEQUENCE_ENERGISED;
    enter(st, id);
}

/* Gates off, and what comes next. */
COLD static void let_go(const sequence_config_t *cfg, sequence_state_t *st)
{
    if (fault_stopping(st->faults) != 0u) {
        enter(st, SEQUENCE_FAULT);
    } else {
        enter(st, (cfg->coast_periods > 0u) ? SEQUENCE_COAST : SEQUENCE_READY);
    }
}

/* SELF_TEST: the mean of the currents with the gates off is the sensors' offset. */
static void self_test(const sequence_config_t *cfg, sequence_state_t *st, const sequence_in_t *in,
                      sequence_out_t *out)
{
    if (st->periods < cfg->offset_periods) {
        st->offset_sum_A.u += in->i_raw_A.u;
        st->offset_sum_A.v += in->i_raw_A.v;
        st->offset_sum_A.w += in->i_raw_A.w;
        st->offset_sum_V = ab_add(st->offset_sum_V, in->u_raw_V);
        st->offset_square_V2 += ab_norm2(in->u_raw_V);
        st->periods++;
        return;
    }
    if (cfg->offset_periods > 0u) {
        const float k = 1.0f / (float)cfg->offset_periods;
        const uvw_t offset = {k * st->offset_sum_A.u, k * st->offset_sum_A.v,
                              k * st->offset_sum_A.w};
        if (!(absf(offset.u) <= cfg->offset_max_A) || !(absf(offset.v) <= cfg->offset_max_A) ||
            !(absf(offset.w) <= cfg->offset_max_A)) {
            st->faults |= FAULT_CURRENT_OFFSET;
            enter(st, SEQUENCE_FAULT);
            return;
        }
        const ab_t offset_V = ab_scale(st->offset_sum_V, k);
        const float swing_V = SEQUENCE_SWING_PU * cfg->offset_max_V;
        const float variance_V2 = k * st->offset_square_V2 - ab_norm2(offset_V);
        const bool still = (absf(offset_V.alpha) <= cfg->offset_max_V) &&
                           (absf(offset_V.beta) <= cfg->offset_max_V) &&
                           (variance_V2 <= swing_V * swing_V);
        out->offsets_ready = true;
        st->offset_A = offset;
        st->offset_V = still ? offset_V : (ab_t){0.0f, 0.0f};
    }
    let_go(cfg, st); /* the motor may still turn */
}

static void fault_state(sequence_state_t *st, const sequence_in_t *in, uint32_t rising)
{
    /* Reset is an explicit command, and only once the cause is gone. */
    if (((rising & SEQUENCE_CMD_FAULT_RESET) != 0u) && (fault_stopping(in->faults) == 0u) &&
        ((st->faults & FAULT_CONFIG) == 0u)) {
        st->faults = in->faults;
        st->offset_sum_A = (uvw_t){0.0f, 0.0f, 0.0f};
        st->offset_sum_V = (ab_t){0.0f, 0.0f};
        st->offset_square_V2 = 0.0f;
        enter(st, SEQUENCE_SELF_TEST);
    }
}

static void ready(sequence_state_t *st, uint32_t start)
{
    if ((start & SEQUENCE_CMD_RUN) != 0u) {
        energise(st, SEQUENCE_PREMAGNETISE);
    } else if ((start & SEQUENCE_CMD_COMMISSION) != 0u) {
        energise(st, SEQUENCE_COMMISSIONING);
    } else {
        /* waits */
    }
}

static void premagnetise(const sequence_config_t *cfg, sequence_state_t *st,
                         const sequence_in_t *in, bool run)
{
    if (!run) {
        let_go(cfg, st);
    } else if (in->premagnetising) {
        st->periods = 0u; /* the flux of RUN is built up after the measurement */
    } else if (st->periods >= cfg->premagnetise_periods) {
        enter(st, SEQUENCE_RUN);
    } else {
        st->periods++;
    }
}

/* RUN and RAMP_DOWN: a stop on the ramp may be taken back, a fault's may not. */
static void running(const sequence_config_t *cfg, sequence_state_t *st, const sequence_in_t *in,
                    bool run)
{
    const bool fault = fault_stopping(st->faults) != 0u;
    if (st->id == SEQUENCE_RUN) {
        if (fault || (!run && (cfg->stop == SEQUENCE_STOP_RAMP))) {
            enter(st, SEQUENCE_RAMP_DOWN);
        } else if (!run) {
            let_go(cfg, st);
        } else {
            /* goes on */
        }
    } else if (run && !fault) {
        enter(st, SEQUENCE_RUN);
    } else if (in->standing || (st->periods >= cfg->ramp_down_periods)) {
        let_go(cfg, st);
    } else {
        st->periods++;
    }
}

/* What a motor without a supply still induces would drive a current through the diodes. */
static void coast(const sequence_config_t *cfg, sequence_state_t *st, const sequence_in_t *in)
{
    const bool quiet = !(cfg->coast_max_V2 > 0.0f) || (ab_norm2(in->u_raw_V) <= cfg->coast_max_V2);
    if (st->periods < cfg->coast_periods) {
        st->periods++;
    } else if (quiet) {
        enter(st, SEQUENCE_READY);
    } else {
        /* still turning with flux */
    }
}

/* The states with the gates on. */
static void powered_states(const sequence_config_t *cfg, sequence_state_t *st,
                           const sequence_in_t *in, uint32_t start)
{
    const bool run = (start & SEQUENCE_CMD_RUN) != 0u;
    if (st->id == SEQUENCE_PREMAGNETISE) {
        premagnetise(cfg, st, in, run);
    } else if (st->id != SEQUENCE_COMMISSIONING) {
        running(cfg, st, in, run);
    } else if (((start & SEQUENCE_CMD_COMMISSION) == 0u) || in->commissioned) {
        st->run_blocked = true; /* a command still standing does not begin it again */
        let_go(cfg, st);
    } else {
        /* goes on */
    }
}

/* Transitions of the states that no fault has ended. */
static void normal_states(const sequence_config_t *cfg, sequence_state_t *st,
                          const sequence_in_t *in, sequence_out_t *out)
{
    const uint32_t start = st->run_blocked ? 0u : in->command;
    if (powered(st->id)) {
        powered_states(cfg, st, in, start);
    } else if (st->id == SEQUENCE_BOOT) {
        enter(st, SEQUENCE_SELF_TEST);
    } else if (st->id == SEQUENCE_SELF_TEST) {
        self_test(cfg, st, in, out);
    } else if (st->id == SEQUENCE_READY) {
        ready(st, start);
    } else if (st->id == SEQUENCE_COAST) {
        coast(cfg, st, in);
    } else if (st->id == SEQUENCE_TORQUE_OFF) {
        let_go(cfg, st);
    } else {
        /* FAULT does not come here, and no other state exists. */
        st->faults |= FAULT_CONFIG;
        enter(st, SEQUENCE_FAULT);
    }
}

/* Whether a fault, or a memory that contradicts itself, ends this state now. */
static bool must_end(sequence_state_t *st)
{
    if (st->energised != (powered(st->id) ? SEQUENCE_ENERGISED : 0u)) {
        st->faults |= FAULT_CONFIG;
    }
    const bool ramps = (st->id == SEQUENCE_RUN) || (st->id == SEQUENCE_RAMP_DOWN);
    return (ramps ? fault_opening(st->faults) : fault_stopping(st->faults)) != 0u;
}

/* Faults, commands and transitions of one period. */
static void transitions(const sequence_config_t *cfg, sequence_state_t *st, const sequence_in_t *in,
                        sequence_out_t *out)
{
    const uint32_t rising = in->command & ~st->last_command;
    st->last_command = in->command;
    const bool torque_off = (in->command & SEQUENCE_CMD_TORQUE_OFF) != 0u;

    /* Outside FAULT only what does not end a run is cleared. */
    if ((rising & SEQUENCE_CMD_FAULT_RESET) != 0u) {
        st->faults = fault_stopping(st->faults) | in->faults;
    }
    const bool ends = must_end(st);
    if (st->id == SEQUENCE_FAULT) {
        st->energised = 0u;
        fault_state(st, in, rising);
    } else if (ends) {
        enter(st, SEQUENCE_FAULT);
    } else if (torque_off && (st->id != SEQUENCE_BOOT) && (st->id != SEQUENCE_SELF_TEST)) {
        enter(st, SEQUENCE_TORQUE_OFF);
    } else {
        normal_states(cfg, st, in, out);
    }

    /* A start command still standing after a fault or torque-off must not restart the drive. */
    if ((st->id == SEQUENCE_FAULT) || (st->id == SEQUENCE_TORQUE_OFF)) {
        st->run_blocked = true;
    } else if ((in->command & (SEQUENCE_CMD_RUN | SEQUENCE_CMD_COMMISSION)) == 0u) {
        st->run_blocked = false;
    } else {
        /* blocked stays as it is */
    }
}

static drive_mode_t mode_of(sequence_id_t id)
{
    if (id == SEQUENCE_PREMAGNETISE) {
        return DRIVE_PREMAGNETISE;
    }
    if (id == SEQUENCE_COMMISSIONING) {
        return DRIVE_COMMISSION;
    }
    return powered(id) ? DRIVE_RUN : DRIVE_OFF;
}

sequence_out_t sequence_step(const sequence_config_t *cfg, sequence_state_t *st,
                             const sequence_in_t *in)
{
    sequence_out_t out = {.aim = DRIVE_AIM_SPEED};
    st->faults |= in->faults;
    transitions(cfg, st, in, &out);
    out.mode = mode_of(st->id);
    out.gates_on = out.mode != DRIVE_OFF;
    if (st->id == SEQUENCE_RAMP_DOWN) {
        out.aim = DRIVE_AIM_STOP;
    } else if ((in->command & SEQUENCE_CMD_TORQUE_MODE) != 0u) {
        out.aim = DRIVE_AIM_TORQUE;
    } else {
        /* speed */
    }
    return out;
}
