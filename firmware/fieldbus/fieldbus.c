#include "fieldbus.h"

#define STARTS (SEQUENCE_CMD_RUN | SEQUENCE_CMD_COMMISSION)
#define KNOWN                                                                                      \
    (SEQUENCE_CMD_RUN | SEQUENCE_CMD_FAULT_RESET | SEQUENCE_CMD_TORQUE_OFF |                       \
     SEQUENCE_CMD_TORQUE_MODE)

/* Control periods a reset is held: the mailbox is read once in each. */
#define RESET_PERIODS 2u

static bool link_runs(const unit_t *unit)
{
    return (unit->link.command & STARTS) != 0u;
}

static bool enabled(const unit_t *unit)
{
    return unit->params.fieldbus_commands != 0u;
}

fieldbus_status_t fieldbus_allowed(const unit_t *unit)
{
    if (!enabled(unit)) {
        return FIELDBUS_DISABLED;
    }
    return link_runs(unit) ? FIELDBUS_TAKEN : FIELDBUS_OK;
}

bool fieldbus_in_range(const unit_t *unit, const fieldbus_demand_t *demand)
{
    const float omega_e_rad_s = unit->params.pole_pairs * demand->omega_m_ref_rad_s;
    return ((demand->command & ~KNOWN) == 0u) && is_finite(demand->torque_ref_Nm) &&
           (absf(omega_e_rad_s) <= unit->params.speed_max_rad_s);
}

fieldbus_status_t fieldbus_ask(fieldbus_t *fb, const unit_t *unit, const fieldbus_demand_t *demand)
{
    if (!fieldbus_in_range(unit, demand)) {
        return FIELDBUS_OUT_OF_RANGE;
    }
    const fieldbus_status_t allowed = fieldbus_allowed(unit);
    if (allowed != FIELDBUS_OK) {
        return allowed;
    }
    const bool run = (demand->command & SEQUENCE_CMD_RUN) != 0u;
    if (run && !fb->armed) {
        return FIELDBUS_NOT_ARMED;
    }
    const uint32_t rising = demand->command & ~fb->demand.command;
    fb->armed = true;
    fb->reset = fb->reset || ((rising & SEQUENCE_CMD_FAULT_RESET) != 0u);
    fb->demand = *demand;
    fb->expired = false;
    fb->commands++;
    fb->commanded_at = unit->period_count;
    return FIELDBUS_OK;
}

/* Takes run away: it has to drop before it counts again. */
static void withdraw(fieldbus_t *fb)
{
    fb->demand.command &= ~SEQUENCE_CMD_RUN;
    fb->armed = false;
    fb->reset = false;
}

static bool silent(const fieldbus_t *fb, const unit_t *unit)
{
    const uint32_t periods =
        1u + (uint32_t)(unit->params.fieldbus_timeout_s / unit->params.period_s);
    return (unit->period_count - fb->commanded_at) > periods;
}

/* A reset is a pulse that ends once the control period saw it. */
static uint32_t reset_bit(fieldbus_t *fb, uint32_t now)
{
    if (fb->reset) {
        fb->reset = false;
        fb->resetting = true;
        fb->reset_at = now;
    } else if (now - fb->reset_at > RESET_PERIODS) {
        fb->resetting = false;
    } else {
        /* still to be seen */
    }
    return fb->resetting ? SEQUENCE_CMD_FAULT_RESET : 0u;
}

unit_command_t fieldbus_command(fieldbus_t *fb, unit_t *unit)
{
    unit_command_t posted = unit_link_command(unit);
    const bool runs = (fb->demand.command & SEQUENCE_CMD_RUN) != 0u;
    if (runs && silent(fb, unit)) {
        fb->expired = true;
        withdraw(fb);
    }
    if (unit->link.commands != fb->link_commands) {
        withdraw(fb);
    }
    if (!enabled(unit)) {
        fb->demand = (fieldbus_demand_t){0};
        fb->armed = false;
    }
    fb->link_commands = unit->link.commands;
    posted.count += fb->commands;
    if (fieldbus_allowed(unit) == FIELDBUS_OK) {
        posted.command |= fb->demand.command & ~SEQUENCE_CMD_FAULT_RESET;
        posted.command |= reset_bit(fb, unit->period_count);
        posted.omega_m_ref_rad_s = fb->demand.omega_m_ref_rad_s;
        posted.torque_ref_Nm = fb->demand.torque_ref_Nm;
    }
    return posted;
}
