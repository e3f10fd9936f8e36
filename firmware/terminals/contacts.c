#include "contacts.h"

#include "lapse.h"

#define EDGES (HAL_TERMINAL_START | HAL_TERMINAL_RESET) /* inputs of which an edge counts */

bool contacts_init(contacts_config_t *cfg, uint32_t control, uint32_t debounce_steps)
{
    if ((control > (uint32_t)CONTACTS_THREE_WIRE) || (debounce_steps == 0u)) {
        return false;
    }
    *cfg = (contacts_config_t){(contacts_control_t)control, debounce_steps};
    return true;
}

/* True once every level has stood long enough to be known; after power-up without a bounce. */
static bool debounce(const contacts_config_t *cfg, contacts_state_t *st, uint32_t inputs,
                     uint32_t lapse)
{
    for (uint32_t k = 0u; k < HAL_TERMINAL_INPUTS; k++) {
        const uint32_t input = 1u << k;
        const bool changed = ((inputs ^ st->closed) & input) != 0u;
        st->steps[k] = lapse_stood(st->steps[k], changed, lapse);
        if (st->steps[k] >= cfg->debounce_steps) {
            st->closed ^= input;
            st->steps[k] = 0u;
        }
    }
    if (st->age < cfg->debounce_steps) {
        st->age = (((inputs ^ st->inputs) & EDGES) != 0u) ? 0u : (st->age + lapse);
    }
    st->inputs = inputs;
    return st->age >= cfg->debounce_steps;
}

static void two_wires(contacts_state_t *st)
{
    const bool start = contacts_closed(st, HAL_TERMINAL_START);
    st->armed = st->armed || !start;
    st->run = start && st->armed;
}

/* A button pressed while STOP is open is used up. */
static void three_wires(contacts_state_t *st)
{
    const bool start = contacts_closed(st, HAL_TERMINAL_START);
    st->run = contacts_closed(st, HAL_TERMINAL_STOP) && (st->run || (start && st->armed));
    st->armed = !start;
}

void contacts_step(const contacts_config_t *cfg, contacts_state_t *st, uint32_t inputs,
                   uint32_t steps)
{
    if (!debounce(cfg, st, inputs, steps)) {
        return;
    }
    if (cfg->control == CONTACTS_TWO_WIRE) {
        two_wires(st);
    } else if (cfg->control == CONTACTS_THREE_WIRE) {
        three_wires(st);
    } else {
        /* they only show */
    }
    const bool reset = contacts_closed(st, HAL_TERMINAL_RESET);
    st->reset = reset && st->reset_open;
    st->reset_open = !reset;
}
