#include "unit_link_params.h"

#include "handover.h"
#include "unit_store_background.h"

#include <stddef.h>

unit_link_status_t unit_link_param_info(const unit_t *unit, command_reader_t *body,
                                        command_writer_t *w)
{
    const uint16_t index = command_take_u16(body);
    const param_info_t *info = params_info(index);
    if (info == NULL) {
        return UNIT_LINK_NO_SUCH;
    }
    command_put_u8(w, (uint8_t)((info->type == (uint32_t)PARAM_FLOAT) ? PARAM_FLOAT : PARAM_UINT));
    command_put_u8(w, (uint8_t)info->access);
    command_put_float(w, info->minimum);
    command_put_float(w, info->maximum);
    command_put_float(w, params_get((unit->image != NULL) ? unit->image : &unit->params, index));
    command_put_text(w, params_name(index));
    command_put_text(w, param_unit(info));
    command_put_text(w, params_group_name(info->group));
    const char *const *choices = param_choices(info);
    const uint32_t count = (choices != NULL) ? ((uint32_t)info->maximum + 1u) : 0u;
    command_put_u8(w, (uint8_t)count);
    for (uint32_t k = 0u; k < count; k++) {
        command_put_text(w, choices[k]);
    }
    return UNIT_LINK_OK;
}

unit_link_status_t unit_link_get(const unit_t *unit, command_reader_t *body, command_writer_t *w)
{
    while (body->left >= 2u) {
        const uint16_t index = command_take_u16(body);
        if (params_info(index) == NULL) {
            return UNIT_LINK_NO_SUCH;
        }
        command_put_float(w, params_get(&unit->params, index));
    }
    return UNIT_LINK_OK;
}

static unit_link_status_t of_params(params_status_t status)
{
    switch (status) {
    case PARAMS_GATES_ON:
        return UNIT_LINK_NOT_NOW;
    case PARAMS_LOCKED:
        return UNIT_LINK_PROTECTED;
    case PARAMS_OK:
    case PARAMS_NOT_FINITE:
    case PARAMS_OUT_OF_RANGE:
    case PARAMS_NOT_WHOLE:
    case PARAMS_NO_SUCH:
    default:
        return (unit_link_status_t)status; /* the same numbers */
    }
}

unit_link_status_t unit_link_set(unit_t *unit, command_reader_t *body)
{
    const uint16_t index = command_take_u16(body);
    const float value = command_take_float(body);
    params_t changed = unit->params;
    const params_status_t status =
        access_write(&unit->store.access, &changed, index, value, !unit_at_rest(unit));
    if (status != PARAMS_OK) {
        return of_params(status);
    }
    if (float_bits(changed.period_s) != float_bits(unit->params.period_s)) {
        unit->refused =
            (params_conflict_t){index, params_count(), PARAMS_FIXED, unit->params.period_s};
        return UNIT_LINK_REFUSED;
    }
    unit->flight.changed = index;
    unit->flight.changes++;
    handover();
    return unit_reconfigure(unit, &changed) ? UNIT_LINK_OK : UNIT_LINK_REFUSED;
}

/* No parameter is 0xFFFF on the wire. */
static uint16_t number_of(size_t index)
{
    return (index < params_count()) ? (uint16_t)index : UINT16_MAX;
}

static void put_conflict(const params_conflict_t *c, command_writer_t *w)
{
    command_put_u16(w, number_of(c->first));
    command_put_u16(w, number_of(c->second));
    command_put_u8(w, (uint8_t)c->relation);
    command_put_float(w, c->limit);
}

void unit_link_put_refused(const unit_t *unit, command_writer_t *w)
{
    put_conflict(&unit->refused, w);
}

unit_link_status_t unit_link_store(const unit_t *unit, command_writer_t *w)
{
    const unit_store_t *s = &unit->store;
    const uint32_t words[] = {(uint32_t)s->found,        s->store.wanted ? 1u : 0u,
                              s->store.failed ? 1u : 0u, s->access.unlocked ? 1u : 0u,
                              s->report.taken,           s->report.missing,
                              s->report.unknown,         s->report.refused};
    for (size_t k = 0u; k < sizeof words / sizeof words[0]; k++) {
        command_put_u32(w, words[k]);
    }
    params_conflict_t conflict; /* of the set in use: it was refused at start */
    (void)params_check(&unit->params, &conflict);
    put_conflict(&conflict, w);
    command_put_u32(w, s->report.renamed);
    command_put_u32(w, s->store.present ? s->store.used.entries : 0u);
    return UNIT_LINK_OK;
}

/* An entry of the record in the flash: what it was saved under, and what became of it. */
unit_link_status_t unit_link_store_entry(const unit_t *unit, const hal_devices_t *devices,
                                         command_reader_t *body, command_writer_t *w)
{
    param_store_entry_t entry;
    if (!unit_store_entry(unit, devices, command_take_u16(body), &entry)) {
        return UNIT_LINK_NO_SUCH;
    }
    command_put_u32(w, entry.key);
    command_put_float(w, entry.value);
    command_put_u16(w, number_of(entry.index));
    command_put_u8(w, (uint8_t)entry.fate);
    return UNIT_LINK_OK;
}
