#include "unit_record.h"

#include <stddef.h>

#include "fault_reaction.h"
#include "unit_flight.h"
#include "unit_signal.h"

/* Columns of the fault record; floats of the unit, as the list has them. */
#define FAULT_SIGNALS(COLUMN)                                                                      \
    COLUMN(0, i_s_alpha_A, last.meas.i_s_A.alpha)                                                  \
    COLUMN(1, i_s_beta_A, last.meas.i_s_A.beta)                                                    \
    COLUMN(2, u_dc_V, last.meas.u_dc_V)                                                            \
    COLUMN(3, omega_e_hat_rad_s, drive.estimator.estimate.omega_e_rad_s)                           \
    COLUMN(4, omega_ref_rad_s, drive.modes.vector.speed.omega_ref_rad_s)                           \
    COLUMN(5, i_q_ref_A, last.i_ref_A.q)

#define NUMBER(column, name, path) [column] = UNIT_SIGNAL_##name,
static const uint8_t fault_signal[FAULT_RECORD_SIGNALS] = {FAULT_SIGNALS(NUMBER)};

uint32_t unit_record_fault_signal(uint32_t column)
{
    return (column < FAULT_RECORD_SIGNALS) ? fault_signal[column] : (uint32_t)UNIT_SIGNALS;
}

void unit_record_init(unit_t *unit, const unit_memory_t *memory)
{
    unit_memory_t given = *memory;
    trace_init(&unit->trace, given.trace_word, given.trace_words);
    fault_record_init(&unit->fault_recorder, given.fault);
    flight_init(&unit->flight, given.flight_word, given.flight_words);
}

/* In every period: six loads and stores. */
static inline void write_fault_row(const unit_t *unit, uint32_t *row)
{
#define STORE(column, name, path) row[column] = float_bits(unit->path);
    FAULT_SIGNALS(STORE)
}

COLD static void write_row(const unit_t *unit, trace_t *trace)
{
    uint32_t *row = trace_row(trace);
    for (uint32_t k = 0u; k < trace->setup.signals; k++) {
        row[k] = unit_signal(unit, trace->setup.signal[k]);
    }
    trace_row_done(trace);
}

COLD static void watch_trace(unit_t *unit)
{
    trace_t *trace = &unit->trace;
    const uint32_t word = unit_signal(unit, trace->setup.trigger);
    if (trace_watch(trace, word, unit->period_count)) {
        write_row(unit, trace);
    }
}

void unit_record_period(unit_t *unit, const hal_sample_t *sample, const hal_output_t *output)
{
    unit->output = *output;
    fault_recorder_t *fault = &unit->fault_recorder;
    const uint32_t faults = unit->machine.faults;
    if (fault_record_changed(fault, faults, output->gates_on)) {
        fault_record_look(fault, faults, fault_stopping(faults), output->gates_on,
                          unit->period_count);
    }
    if (fault->row != NULL) {
        write_fault_row(unit, fault->row);
        fault_record_next(fault);
    }
    if (trace_running(&unit->trace)) {
        watch_trace(unit);
    }
    if (unit->flight.state != (uint32_t)FLIGHT_OFF) {
        unit_flight_period(unit, sample, output);
    }
}

void unit_record_background(unit_t *unit)
{
    fault_record_background(&unit->fault_recorder, unit->machine.faults, (uint32_t)unit->machine.id,
                            unit->period_count);
}
