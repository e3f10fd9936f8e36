#include "app_record.h"

#include "app_signal.h"
#include "fault_reaction.h"

/* Columns of the fault record. */
#define FAULT_SIGNALS(COLUMN)                                                                      \
    COLUMN(0, i_s_alpha_A)                                                                         \
    COLUMN(1, i_s_beta_A)                                                                          \
    COLUMN(2, u_dc_V)                                                                              \
    COLUMN(3, omega_e_hat_rad_s)                                                                   \
    COLUMN(4, omega_ref_rad_s)                                                                     \
    COLUMN(5, i_q_ref_A)

#define NUMBER(column, name) [column] = APP_SIGNAL_##name,
static const uint8_t fault_signal[FAULT_RECORD_SIGNALS] = {FAULT_SIGNALS(NUMBER)};

uint32_t app_record_fault_signal(uint32_t column)
{
    return (column < FAULT_RECORD_SIGNALS) ? fault_signal[column] : (uint32_t)APP_SIGNALS;
}

void app_record_init(app_t *app, const app_memory_t *memory)
{
    app_memory_t given = *memory;
    trace_init(&app->trace, given.trace_word, given.trace_words);
    fault_record_init(&app->fault_recorder, given.fault);
}

/* In every period: six loads and stores. */
static void write_fault_row(const app_t *app, const hal_output_t *output, trace_t *trace)
{
    uint32_t *row = trace_row(trace);
#define STORE(column, name) row[column] = app_signal_value(app, output, APP_SIGNAL_##name);
    FAULT_SIGNALS(STORE)
    trace_row_done(trace);
}

static void write_row(const app_t *app, const hal_output_t *output, trace_t *trace)
{
    uint32_t *row = trace_row(trace);
    for (uint32_t k = 0u; k < trace->setup.signals; k++) {
        row[k] = app_signal(app, output, trace->setup.signal[k]);
    }
    trace_row_done(trace);
}

void app_record_period(app_t *app, const hal_output_t *output)
{
    app->output = *output;
    fault_recorder_t *fault = &app->fault_recorder;
    const uint32_t faults = fault_stopping(app->machine.faults);
    if (fault_record_watch(fault, faults, output->gates_on, app->period_count)) {
        write_fault_row(app, output, &fault->trace);
    }
    trace_t *trace = &app->trace;
    if (trace_running(trace)) {
        const uint32_t word = app_signal(app, output, trace->setup.trigger);
        if (trace_watch(trace, word, app->period_count)) {
            write_row(app, output, trace);
        }
    }
}

void app_record_background(app_t *app)
{
    fault_record_background(&app->fault_recorder, app->machine.faults, (uint32_t)app->machine.id,
                            app->period_count);
}
