/* A drive that does nothing by itself, and a board with every terminal: one round is a step. */
#ifndef TERMINAL_FIXTURE_H
#define TERMINAL_FIXTURE_H

#include <math.h>

#include "terminals.h"
#include "unity.h"

static unit_t unit;
static params_t drive;
static terminal_params_t params;
static terminals_config_t cfg;
static terminals_state_t st;
static hal_terminal_in_t in;
static uint32_t written;
static uint32_t writes;
static bool answers;
static unit_command_t posted;
static unit_command_t out;

static bool read_in(void *context, hal_terminal_in_t *to)
{
    (void)context;
    if (answers) {
        *to = in;
    }
    return answers;
}

static void write_out(void *context, uint32_t outputs)
{
    (void)context;
    written = outputs;
    writes++;
}

static hal_terminals_t hal;

static void start_board(void)
{
    params_default(&drive);
    drive.observer_gain_enable = 0u;
    TEST_ASSERT_TRUE(unit_init(&unit, &drive, NULL));
    unit.machine = (sequence_state_t){.id = SEQUENCE_READY};
    hal = (hal_terminals_t){.fitted = 0xFFFFFFFFu,
                            .analog_full_scale = 25e-3f,
                            .sink_pullup_ohm = 2200.0f,
                            .motor_pullup_ohm = 2200.0f,
                            .read = read_in,
                            .write = write_out};
    terminal_params_default(&params);
    params.contact_debounce_s = 0.001f;
    params.full_speed_rad_s = 50.0f;
    in = (hal_terminal_in_t){0};
    posted = (unit_command_t){0};
    answers = true;
    writes = 0u;
}

static inline void fit(void)
{
    TEST_ASSERT_EQUAL(TERMINALS_OK, terminals_init(&cfg, &params, &hal, &drive));
    st = (terminals_state_t){0};
}

static inline void command(void)
{
    out = terminals_command(&cfg, &st, &unit, &hal, posted);
}

static inline void rounds(uint32_t n)
{
    for (uint32_t k = 0u; k < n; k++) {
        unit.period_count += cfg.step_periods;
        command();
    }
}

/* Armed: every contact was seen as it is. */
static inline void two_wires(void)
{
    params.start_control = CONTACTS_TWO_WIRE;
    fit();
    rounds(1u);
}

static inline void close_contacts(uint32_t inputs)
{
    in.inputs = inputs;
    rounds(1u);
}

static inline void drive_runs(void)
{
    unit.machine.id = SEQUENCE_RUN;
    unit.asked.mode = DRIVE_RUN;
}

static inline void drive_rests(void)
{
    unit.machine.id = SEQUENCE_READY;
    unit.asked.mode = DRIVE_OFF;
}

#endif
