#include "mech_brake.h"

#include "lapse.h"

bool mech_brake_init(mech_brake_config_t *cfg)
{
    return !cfg->on ||
           (ALL_POSITIVE(cfg->torque_Nm, cfg->close_rad_s) && (cfg->prove_steps > 0u) &&
            (cfg->release_steps > 0u) && (cfg->close_steps > 0u) && (cfg->stop_steps > 0u));
}

static void enter(mech_brake_state_t *st, mech_brake_id_t id)
{
    st->id = id;
    st->steps = 0u;
    st->proven = 0u;
}

/* The brake closes now, whatever the drive does; nobody's standing run command starts it again. */
static void give_up(mech_brake_state_t *st)
{
    enter(st, MECH_BRAKE_CLOSED);
    st->blocked = true;
}

/* Without a switch it never says released. */
static void debounce(const mech_brake_config_t *cfg, mech_brake_state_t *st,
                     const mech_brake_in_t *in)
{
    const bool differs = cfg->feedback && (in->released != st->released);
    st->differs = lapse_stood(st->differs, differs, in->steps);
    if (st->differs >= MECH_BRAKE_FEEDBACK_STEPS) {
        st->released = in->released;
        st->differs = 0u;
    }
}

static bool faster(const mech_brake_config_t *cfg, float omega_rad_s)
{
    return !(absf(omega_rad_s) <= cfg->close_rad_s);
}

static uint32_t closed(const mech_brake_config_t *cfg, mech_brake_state_t *st,
                       const mech_brake_in_t *in)
{
    const bool late = st->steps >= cfg->close_steps;
    st->energised = false;
    st->blocked = st->blocked && in->run;
    st->steps += late ? 0u : in->steps;
    if (st->released) {
        return late ? MECH_BRAKE_NOT_CLOSED : 0u;
    }
    const bool falls = st->differs > 0u; /* the switch may open just now */
    if (in->run && !st->blocked && !falls && faster(cfg, in->omega_ref_rad_s)) {
        enter(st, MECH_BRAKE_PROVING);
    }
    return 0u;
}

/* The brake has let go of the load: the motor holds it, as far as it has gates. */
static uint32_t hold(const mech_brake_config_t *cfg, mech_brake_state_t *st, bool gates_on)
{
    give_up(st);
    if (gates_on) {
        enter(st, MECH_BRAKE_CLOSING);
    }
    st->steps = cfg->close_steps;
    return MECH_BRAKE_NOT_CLOSED;
}

static uint32_t proving(const mech_brake_config_t *cfg, mech_brake_state_t *st,
                        const mech_brake_in_t *in)
{
    const bool enough = in->torque_Nm >= MECH_BRAKE_PROVEN_PU * cfg->torque_Nm;
    st->proven = lapse_stood(st->proven, in->running && enough, in->steps);
    st->steps += in->running ? in->steps : 0u;
    if (st->released) {
        return hold(cfg, st, in->gates_on);
    }
    if (!in->run) {
        enter(st, MECH_BRAKE_CLOSED);
    } else if (st->proven >= MECH_BRAKE_PROVEN_STEPS) {
        enter(st, MECH_BRAKE_RELEASING);
    } else if (st->steps >= cfg->prove_steps) {
        give_up(st);
        return MECH_BRAKE_NO_TORQUE;
    } else {
        /* torque builds up */
    }
    return 0u;
}

static uint32_t releasing(const mech_brake_config_t *cfg, mech_brake_state_t *st,
                          const mech_brake_in_t *in)
{
    st->steps += in->steps;
    const bool late = st->steps >= cfg->release_steps;
    if (!in->run || !in->running) { /* a drive that ramps down by itself soon has no gates */
        enter(st, MECH_BRAKE_CLOSING);
    } else if (cfg->feedback ? st->released : late) {
        enter(st, MECH_BRAKE_RELEASED);
    } else if (late) {
        give_up(st);
        return MECH_BRAKE_NOT_RELEASED;
    } else {
        /* the magnet pulls */
    }
    return 0u;
}

static uint32_t released(const mech_brake_config_t *cfg, mech_brake_state_t *st,
                         const mech_brake_in_t *in)
{
    if (cfg->feedback && !st->released) {
        give_up(st);
        return MECH_BRAKE_LOST;
    }
    const bool stops = !in->run || !in->running;
    st->steps = lapse_stood(st->steps, stops, in->steps);
    const bool slow = !faster(cfg, in->omega_hat_rad_s);
    if ((slow && (stops || !faster(cfg, in->omega_ref_rad_s))) || (st->steps >= cfg->stop_steps)) {
        enter(st, MECH_BRAKE_CLOSING);
    }
    return 0u;
}

/* A brake that does not close leaves the load to the motor. */
static uint32_t closing(const mech_brake_config_t *cfg, mech_brake_state_t *st, uint32_t steps)
{
    st->steps += steps;
    const bool late = st->steps >= cfg->close_steps;
    if (cfg->feedback ? !st->released : late) {
        enter(st, MECH_BRAKE_CLOSED);
        return 0u;
    }
    if (late) {
        st->steps = cfg->close_steps;
        return MECH_BRAKE_NOT_CLOSED;
    }
    return 0u;
}

static uint32_t step_state(const mech_brake_config_t *cfg, mech_brake_state_t *st,
                           const mech_brake_in_t *in)
{
    switch (st->id) {
    case MECH_BRAKE_PROVING:
        return proving(cfg, st, in);
    case MECH_BRAKE_RELEASING:
        return releasing(cfg, st, in);
    case MECH_BRAKE_RELEASED:
        return released(cfg, st, in);
    case MECH_BRAKE_CLOSING:
        return closing(cfg, st, in->steps);
    case MECH_BRAKE_CLOSED:
    default:
        return closed(cfg, st, in);
    }
}

mech_brake_out_t mech_brake_step(const mech_brake_config_t *cfg, mech_brake_state_t *st,
                                 const mech_brake_in_t *in)
{
    if (!cfg->on) {
        return (mech_brake_out_t){.run = in->run, .omega_ref_rad_s = in->omega_ref_rad_s};
    }
    debounce(cfg, st, in);
    if (st->id != MECH_BRAKE_CLOSED) {
        const bool fell = st->energised && !in->gates_on;
        st->energised = in->gates_on;
        if (fell || in->off) {
            give_up(st);
        }
    }
    mech_brake_out_t out = {.faults = step_state(cfg, st, in)};
    out.run = st->id != MECH_BRAKE_CLOSED;
    out.torque_mode = st->id == MECH_BRAKE_PROVING;
    out.torque_Nm = out.torque_mode ? cfg->torque_Nm : 0.0f;
    out.release = (st->id == MECH_BRAKE_RELEASING) || (st->id == MECH_BRAKE_RELEASED);
    if ((st->id == MECH_BRAKE_RELEASED) && in->run) {
        out.omega_ref_rad_s = in->omega_ref_rad_s;
    }
    return out;
}
