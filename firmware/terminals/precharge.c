#include "precharge.h"

#include "lapse.h"

bool precharge_init(const precharge_config_t *cfg)
{
    return !cfg->on ||
           (positivef(cfg->ready_V) && (cfg->charge_steps > 0u) && (cfg->contactor_steps > 0u));
}

static void enter(precharge_state_t *st, precharge_id_t id)
{
    *st = (precharge_state_t){.id = id};
}

static uint32_t fail(precharge_state_t *st, uint32_t fault)
{
    enter(st, PRECHARGE_FAILED);
    return fault;
}

/* The coil drops once nothing flows any more. */
static void let_open(precharge_state_t *st, precharge_id_t then)
{
    enter(st, PRECHARGE_OPENING);
    st->then = then;
}

static bool contradicted(const precharge_config_t *cfg, precharge_state_t *st, bool wrong,
                         uint32_t steps)
{
    st->wrong = lapse_stood(st->wrong, cfg->feedback && wrong, steps);
    return st->wrong >= PRECHARGE_BOUNCE_STEPS;
}

/* Once in so many steps: the rise since the last look. */
static bool level(precharge_state_t *st, const precharge_in_t *in)
{
    st->level_steps += in->steps;
    if (st->level_steps < PRECHARGE_LEVEL_STEPS) {
        return false;
    }
    const bool flat = in->u_dc_V <= PRECHARGE_LEVEL_PU * st->before_V;
    st->level_steps = 0u;
    st->before_V = in->u_dc_V;
    return flat;
}

/* Open: the contactor must not stick. */
static uint32_t waiting(const precharge_config_t *cfg, precharge_state_t *st,
                        const precharge_in_t *in)
{
    if (contradicted(cfg, st, in->closed, in->steps)) {
        return fail(st, PRECHARGE_CONTACTOR);
    }
    if (in->u_dc_V >= PRECHARGE_PRESENT_PU * cfg->ready_V) {
        const uint32_t wrong = st->wrong;
        enter(st, PRECHARGE_CHARGING);
        st->wrong = wrong;
    }
    return 0u;
}

static uint32_t charging(const precharge_config_t *cfg, precharge_state_t *st,
                         const precharge_in_t *in)
{
    st->steps += in->steps;
    if (contradicted(cfg, st, in->closed, in->steps)) {
        return fail(st, PRECHARGE_CONTACTOR);
    }
    if (level(st, in) && (in->u_dc_V >= cfg->ready_V)) {
        enter(st, PRECHARGE_CLOSING);
    } else if (in->u_dc_V < PRECHARGE_PRESENT_PU * cfg->ready_V) {
        enter(st, PRECHARGE_WAITING);
    } else if (st->steps >= cfg->charge_steps) {
        return fail(st, PRECHARGE_TOO_SLOW);
    } else {
        /* rises */
    }
    return 0u;
}

static uint32_t closing(const precharge_config_t *cfg, precharge_state_t *st,
                        const precharge_in_t *in)
{
    st->steps += in->steps;
    const bool late = st->steps >= cfg->contactor_steps;
    if (cfg->feedback ? in->closed : late) {
        enter(st, PRECHARGE_CLOSED);
    } else if (late) {
        return fail(st, PRECHARGE_CONTACTOR);
    } else {
        /* pulls in */
    }
    return 0u;
}

/* A link that is low under load is a fault: it takes the gates off. */
static uint32_t opening(precharge_state_t *st, const precharge_in_t *in)
{
    st->steps = lapse_stood(st->steps, !in->gates_on, in->steps);
    if (in->gates_on) {
        return (st->then == PRECHARGE_WAITING) ? PRECHARGE_LINK_LOW : 0u;
    }
    if (!in->current || (st->steps >= PRECHARGE_DECAY_STEPS)) {
        enter(st, st->then);
    }
    return 0u;
}

static uint32_t closed(const precharge_config_t *cfg, precharge_state_t *st,
                       const precharge_in_t *in)
{
    const bool low = in->u_dc_V < PRECHARGE_OPEN_PU * cfg->ready_V;
    st->steps = lapse_stood(st->steps, low, in->steps);
    if (contradicted(cfg, st, !in->closed, in->steps)) {
        let_open(st, PRECHARGE_FAILED);
        return PRECHARGE_CONTACTOR | opening(st, in);
    }
    if (st->steps >= PRECHARGE_LOW_STEPS) {
        let_open(st, PRECHARGE_WAITING);
        return opening(st, in);
    }
    return 0u;
}

static uint32_t failed(precharge_state_t *st, const precharge_in_t *in)
{
    if (in->reset && !in->open) {
        enter(st, PRECHARGE_WAITING);
    }
    return 0u;
}

/* The chopper does not switch off. */
static void demand_open(precharge_state_t *st)
{
    if (st->id == PRECHARGE_OPENING) {
        st->then = PRECHARGE_FAILED;
    } else if (precharge_close(st)) {
        let_open(st, PRECHARGE_FAILED);
    } else {
        enter(st, PRECHARGE_FAILED);
    }
}

uint32_t precharge_step(const precharge_config_t *cfg, precharge_state_t *st,
                        const precharge_in_t *in)
{
    if (!cfg->on) {
        return 0u;
    }
    if (in->open) {
        demand_open(st);
    }
    switch (st->id) {
    case PRECHARGE_CHARGING:
        return charging(cfg, st, in);
    case PRECHARGE_CLOSING:
        return closing(cfg, st, in);
    case PRECHARGE_CLOSED:
        return closed(cfg, st, in);
    case PRECHARGE_OPENING:
        return opening(st, in);
    case PRECHARGE_FAILED:
        return failed(st, in);
    case PRECHARGE_WAITING:
    default:
        return waiting(cfg, st, in);
    }
}
