/* Template of a Cortex-M port: it links, and stays dark until every FILL IN is done.
 *
 * Copy the folder, give the copy the name of your board, replace the functions one by one
 * (hal/README.md has the order and the checks), and change nothing outside the folder.
 */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "unit.h"
#include "cm_config.h"
#include "cm_image.h"
#include "cm_port.h"
#include "cm_registers.h"

/* FILL IN: number of the interrupt that comes when the ADC is done, and of the timer that opens the
 * gates when that interrupt hangs. */
#define CONTROL_IRQ 0u
#define HANG_IRQ    1u

static unit_t unit; /* the drive; all file-scope state of a port is in its main.c */
static cm_image_check_t image_check;
static uint16_t late_periods;

void control_interrupt(void);
void hang_interrupt(void);

__attribute__((section(".vectors.irq"), used)) static const cm_vector_t irq_vectors[] = {
    [CONTROL_IRQ] = control_interrupt,
    [HANG_IRQ] = hang_interrupt,
};

/* FILL IN: every switch off, at once; nothing here may depend on RAM or clocks being right. */
void port_gates_off(void)
{
}

/* FILL IN: the gate pins to their inactive level, before anything else is set up. The board needs
 * pull-downs all the same: the part is without a program for some microseconds. */
void port_early(void)
{
}

/* FILL IN: tell fault->code and fault->pc (LED, UART, memory that survives a reset). */
void port_halt(const cm_fault_t *fault)
{
    (void)fault;
    while (true) {
        port_gates_off();
    }
}

/* FILL IN when the part raises one: clock failure, watchdog. */
void port_nmi(void)
{
    cm_stop(CM_END_UNEXPECTED_INTERRUPT);
}

/* FILL IN: clocks; PWM centre-aligned with dead time, preload and break input, outputs off; ADC
 * triggered at the carrier crest. False: the board is not as it should be, the drive stays off. */
static bool start_devices(void)
{
    return false;
}

/* FILL IN: the words of this crest, unscaled, and what the hardware has done by itself
 * (hal_drive_io.h). Zeros are out of range: they trip. */
static void read_adc(hal_sample_t *sample)
{
    *sample = (hal_sample_t){0};
}

/* FILL IN: duties to the timer's preload registers; gates_on false acts at once. brake_on is a
 * pin of its own, where the board has a brake resistor. */
static void write_pwm(const hal_output_t *output)
{
    (void)output;
    port_gates_off();
}

/* FILL IN: how many crests have passed since this interrupt began, by a clock that runs on: a hang
 * of many periods must not look like one. */
static uint16_t missed_crests(void)
{
    return 0u;
}

/* FILL IN. */
static void serve_watchdog(void *context)
{
    (void)context;
}

/* FILL IN: the timer of HANG_IRQ begins its 2.5 periods anew. */
static void serve_hang_timer(void)
{
}

/* FILL IN: acknowledge the timer, and keep the gates off until the drive has opened them as well: a
 * break that stays latched does that. More urgent than the control interrupt, which hangs. */
void hang_interrupt(void)
{
    port_gates_off();
}

void control_interrupt(void)
{
    serve_hang_timer();
    hal_sample_t sample;
    read_adc(&sample);
    sample.late_periods = late_periods;
    hal_output_t output;
    unit_control_period(&unit, &sample, &output);
    write_pwm(&output);
    late_periods = (uint16_t)(late_periods + missed_crests());
}

int main(void)
{
    const hal_devices_t devices = {.watchdog_serve = serve_watchdog};
    const bool running = unit_init(&unit, &cm_config.params, cm_config.table) && start_devices();
    if (running) {
        cm_nvic_level(HANG_IRQ, CM_LEVEL_HANG);
        cm_nvic_enable(HANG_IRQ);
        cm_nvic_level(CONTROL_IRQ, CM_LEVEL_CONTROL);
        cm_nvic_enable(CONTROL_IRQ);
        cm_irq_on();
    }
    while (true) {
        cm_background_sync();
        if (running) {
            unit_background(&unit, &devices);
        } else {
            serve_watchdog(NULL); /* dark, and not in a loop of resets */
        }
        if (!cm_image_check_slice(&image_check)) {
            cm_stop(CM_END_IMAGE_CHANGED);
        }
        /* FILL IN: where commands come from; without one the drive stands in READY. */
        const unit_command_t command = {.command = SEQUENCE_CMD_TORQUE_OFF};
        unit_post_command(&unit, &command);
    }
}
