#include "unit_link_records.h"

#include "unit_flight.h"
#include "unit_record.h"
#include "unit_signal.h"
#include "handover.h"

#include <stddef.h>

unit_link_status_t unit_link_trace_setup(unit_t *unit, command_reader_t *body, command_writer_t *w)
{
    trace_setup_t s = {.signals = command_take_u8(body)};
    if (s.signals > TRACE_SIGNALS_MAX) {
        return UNIT_LINK_OUT_OF_RANGE;
    }
    for (uint32_t k = 0u; k < s.signals; k++) {
        s.signal[k] = command_take_u8(body);
        if (s.signal[k] >= (uint32_t)UNIT_SIGNALS) {
            return UNIT_LINK_NO_SUCH;
        }
    }
    s.decimation = command_take_u32(body);
    s.trigger = command_take_u8(body);
    s.trigger_is_float = unit_signal_is_float(s.trigger);
    const uint8_t edge = command_take_u8(body);
    s.level = command_take_u32(body);
    s.before_pu = command_take_float(body);
    s.rows = command_take_u32(body);
    if (!command_all_taken(body)) {
        return UNIT_LINK_BAD_LENGTH;
    }
    if (s.trigger >= (uint32_t)UNIT_SIGNALS) {
        return UNIT_LINK_NO_SUCH;
    }
    if (edge >= (uint8_t)TRACE_EDGES) {
        return UNIT_LINK_OUT_OF_RANGE;
    }
    s.edge = (trace_edge_t)edge;
    if (!trace_arm(&unit->trace, &s)) {
        return UNIT_LINK_REFUSED;
    }
    command_put_u32(w, unit->trace.rows);
    command_put_u32(w, unit->trace.rows - unit->trace.rows_after);
    return UNIT_LINK_OK;
}

static unit_link_status_t trace_status(const unit_t *unit, command_writer_t *w)
{
    const trace_t *t = &unit->trace;
    const uint32_t words[] = {t->state,          trace_rows(t),       trace_trigger_row(t),
                              t->trigger_period, t->setup.decimation, t->setup.signals};
    for (size_t k = 0u; k < sizeof words / sizeof words[0]; k++) {
        command_put_u32(w, words[k]);
    }
    for (uint32_t k = 0u; k < t->setup.signals; k++) {
        command_put_u8(w, t->setup.signal[k]);
    }
    return UNIT_LINK_OK;
}

/* Rows from the one asked for, as many whole ones as fit. */
static unit_link_status_t trace_read(const unit_t *unit, command_reader_t *body,
                                     command_writer_t *w)
{
    const trace_t *t = &unit->trace;
    uint32_t row = command_take_u32(body);
    if (row >= trace_rows(t)) {
        return UNIT_LINK_NO_SUCH;
    }
    while ((row < trace_rows(t)) && (command_room(w) >= 4u * t->setup.signals)) {
        for (uint32_t k = 0u; k < t->setup.signals; k++) {
            command_put_u32(w, trace_word(t, row, k));
        }
        row++;
    }
    return UNIT_LINK_OK;
}

unit_link_status_t unit_link_flight_arm(unit_t *unit, command_reader_t *body)
{
    if (command_take_u8(body) == 0u) {
        flight_stop(&unit->flight);
        return UNIT_LINK_OK;
    }
    if (!unit_flight_allowed(unit)) {
        return UNIT_LINK_NOT_NOW;
    }
    return flight_arm(&unit->flight) ? UNIT_LINK_OK : UNIT_LINK_REFUSED;
}

static unit_link_status_t flight_state(const unit_t *unit, command_writer_t *w)
{
    const flight_t *f = &unit->flight;
    const uint32_t words[] = {f->state, f->rows, f->written, f->taken, f->changes, f->lost};
    for (size_t k = 0u; k < sizeof words / sizeof words[0]; k++) {
        command_put_u32(w, words[k]);
    }
    return UNIT_LINK_OK;
}

unit_link_status_t unit_link_flight_read(unit_t *unit, command_reader_t *body, command_writer_t *w)
{
    flight_t *f = &unit->flight;
    uint32_t row = command_take_u32(body);
    if (!flight_take(f, row)) {
        return UNIT_LINK_NO_SUCH;
    }
    command_put_u8(w, (uint8_t)f->state);
    const uint32_t end = f->written;
    handover();
    while ((row != end) && (command_room(w) >= 4u * FLIGHT_ROW_WORDS)) {
        const uint32_t *words = flight_row(f, row);
        for (uint32_t k = 0u; k < FLIGHT_ROW_WORDS; k++) {
            command_put_u32(w, words[k]);
        }
        row++;
    }
    return UNIT_LINK_OK;
}

static unit_link_status_t commissioning(const unit_t *unit, command_writer_t *w)
{
    const commissioning_state_t *c = &unit->commissioning;
    const commissioning_result_t *r = &c->result;
    command_put_u32(w, (uint32_t)unit->commissioned.status);
    command_put_u32(w, (uint32_t)c->refusal);
    command_put_u32(w, (uint32_t)c->stage);
    command_put_u32(w, c->level);
    handover(); /* once the status says that all is found, what follows does not change any more */
    const float found[] = {r->Rs_ohm,       r->lost_V,    r->sigma_Ls_H,
                           r->Rr_gamma_ohm, r->M_gamma_H, r->bias_A};
    for (size_t k = 0u; k < sizeof found / sizeof found[0]; k++) {
        command_put_float(w, found[k]);
    }
    for (size_t k = 0u; k < COMMISSIONING_LEVELS; k++) {
        command_put_float(w, r->level_A[k]);
        command_put_float(w, r->flux_Wb[k]);
        command_put_float(w, r->error_V[k]);
    }
    return UNIT_LINK_OK;
}

static unit_link_status_t fault_log(const unit_t *unit, command_writer_t *w)
{
    const fault_memory_t *memory = unit->fault_recorder.memory;
    if (memory == NULL) {
        return UNIT_LINK_NO_SUCH;
    }
    const uint32_t logged = memory->kept.logged;
    command_put_u32(w, logged);
    for (uint32_t k = 0u; (k < FAULT_RECORD_LOG) && (k < logged); k++) {
        const fault_entry_t *e = &memory->kept.entry[(logged - 1u - k) % FAULT_RECORD_LOG];
        command_put_u32(w, e->number);
        command_put_u32(w, e->faults);
        command_put_u32(w, e->state);
        command_put_u32(w, e->period);
    }
    return UNIT_LINK_OK;
}

static unit_link_status_t fault_record(const unit_t *unit, command_writer_t *w)
{
    const fault_recorder_t *r = &unit->fault_recorder;
    if ((r->memory == NULL) || (r->memory->kept.number == 0u)) {
        return UNIT_LINK_NO_SUCH;
    }
    const fault_kept_t *k = &r->memory->kept;
    const uint32_t words[] = {k->number, k->period, k->rows, k->fault_row,
                              r->from_before ? 1u : 0u};
    for (size_t n = 0u; n < sizeof words / sizeof words[0]; n++) {
        command_put_u32(w, words[n]);
    }
    for (uint32_t n = 0u; n < FAULT_RECORD_SIGNALS; n++) {
        command_put_u8(w, (uint8_t)unit_record_fault_signal(n));
    }
    return UNIT_LINK_OK;
}

static unit_link_status_t fault_read(const unit_t *unit, command_reader_t *body,
                                     command_writer_t *w)
{
    const fault_memory_t *memory = unit->fault_recorder.memory;
    uint32_t row = command_take_u32(body);
    if ((memory == NULL) || (row >= memory->kept.rows)) {
        return UNIT_LINK_NO_SUCH;
    }
    while ((row < memory->kept.rows) && (command_room(w) >= 4u * FAULT_RECORD_SIGNALS)) {
        for (uint32_t n = 0u; n < FAULT_RECORD_SIGNALS; n++) {
            command_put_u32(w, memory->kept.word[row * FAULT_RECORD_SIGNALS + n]);
        }
        row++;
    }
    return UNIT_LINK_OK;
}

unit_link_status_t unit_link_records(const unit_t *unit, uint8_t op, command_reader_t *body,
                                     command_writer_t *w)
{
    switch (op) {
    case UNIT_LINK_COMMISSIONING:
        return commissioning(unit, w);
    case UNIT_LINK_TRACE_STATE:
        return trace_status(unit, w);
    case UNIT_LINK_TRACE_READ:
        return trace_read(unit, body, w);
    case UNIT_LINK_FLIGHT_STATE:
        return flight_state(unit, w);
    case UNIT_LINK_FAULT_LOG:
        return fault_log(unit, w);
    case UNIT_LINK_FAULT_RECORD:
        return fault_record(unit, w);
    case UNIT_LINK_FAULT_READ:
        return fault_read(unit, body, w);
    default:
        return UNIT_LINK_NO_SUCH_OP;
    }
}
