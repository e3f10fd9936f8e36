/* Template of a Cortex-M port: it links, and stays dark until every FILL IN is done.
 *
 * Copy the folder, give the copy the name of your board, replace the functions one by one
 * (hal/README.md has the order, the checks and the variants), and change nothing outside the
 * folder. All that a finished port calls is called here, against stubs that say what they must do.
 */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "unit.h"
#include "unit_record.h"
#include "cm_config.h"
#include "cm_image.h"
#include "cm_port.h"
#include "cm_registers.h"
#include "hal_access_key.h"
#include "terminals_port.h"

/* FILL IN: number of the interrupt that comes when the ADC is done, and of the timer that opens the
 * gates when that interrupt hangs. A received byte has one too: stm32f405. */
#define CONTROL_IRQ 0u
#define HANG_IRQ    1u

/* The compiler must not see that a stub does nothing, or it would leave out all that follows from
 * it. Goes with the stub. */
#define STUB __attribute__((noipa))

#define TRACE_WORDS 1024u /* 128 rows of 8 signals; 0: no trace */
#define SLOT_BYTES  8192u /* FILL IN: whole pages or sectors, of two slots */
#define MID_SCALE   2048u /* FILL IN: of adc_bits, for what the board does not measure */

/* All file-scope state of a port is in its main.c. */
static unit_t unit;
static cm_image_check_t image_check;
static char identity[CM_IMAGE_BANNER_BYTES];
static uint32_t trace_memory[TRACE_WORDS];
static uint16_t late_periods;
static terminals_port_t terminals; /* none, without ZH_TERMINALS */

/* Start-up leaves it alone: the record of the last fault comes through a reset. */
__attribute__((section(".noinit"))) static fault_memory_t fault_memory;

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

/* FILL IN: the gate pins to their inactive level, before anything else is set up; a driver may be
 * active low. The board needs pull resistors all the same: the part is without a program for some
 * microseconds. */
void port_early(void)
{
}

/* FILL IN: tell fault->code and fault->pc (LED, UART, memory that survives a reset). A watchdog
 * that runs is served here. */
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
 * triggered at the carrier crest. False: the board is not as it should be, the drive stays off.
 *
 * Three converters: one phase current each at the same moment, then the voltages (stm32f405).
 * Two: u and v together, then w and the dc link (stm32g431). One: u, v, w in turn, all of them
 * before the lower switches open, and the order changed from period to period is of no use. */
STUB static bool start_devices(void)
{
    return false;
}

/* FILL IN: the words of this crest, unscaled, positive into the motor, and what the hardware has
 * done by itself (hal_drive_io.h). Zeros are out of range: they trip.
 *
 * Two current sensors: the third word is what the other two leave, 3 * MID_SCALE - u - v. Low-side
 * shunts: a leg is read while its lower switch conducts, so at the crest, where all do; one whose
 * time is too short is what the others leave (stm32g431/g431_shunts.h). No sensors of line
 * voltages: MID_SCALE, and voltage_source = duty in the configuration. */
STUB static void read_adc(hal_sample_t *sample)
{
    *sample = (hal_sample_t){.u_uv_counts = MID_SCALE, .u_vw_counts = MID_SCALE};
}

/* FILL IN: duties to the timer's preload registers; gates_on false acts at once. brake_on is a
 * pin of its own, where the board has a brake resistor. */
STUB static void write_pwm(const hal_output_t *output)
{
    (void)output;
    port_gates_off();
}

/* FILL IN: how many crests have passed since this interrupt began, by a clock that runs on: a hang
 * of many periods must not look like one. */
STUB static uint16_t missed_crests(void)
{
    return 0u;
}

/* FILL IN: the timer of HANG_IRQ begins its 2.5 periods anew. */
STUB static void serve_hang_timer(void)
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
    unit_record_period(&unit, &sample, &output); /* trace and fault record: after the duties */
    late_periods = (uint16_t)(late_periods + missed_crests());
}

/* FILL IN: feeds the watchdog and returns at once; the background calls it only while control
 * periods go on. */
STUB static void serve_watchdog(void *context)
{
    (void)context;
}

/* FILL IN: microseconds of a timer that runs on for ever, 32 bits, wraps. */
STUB static uint32_t clock_us(void *context)
{
    (void)context;
    return 0u;
}

/* FILL IN: the next byte that the serial port's interrupt has stored, 250 of them at least
 * (hal/stm32/stm32_inbox.h); false when there is none. */
STUB static bool link_read(void *context, uint8_t *byte)
{
    (void)context;
    (void)byte;
    return false;
}

/* FILL IN: sends as many of n bytes as go without waiting, and returns how many that were. */
STUB static uint32_t link_write(void *context, const uint8_t *data, uint32_t n)
{
    (void)context;
    (void)data;
    (void)n;
    return 0u;
}

/* FILL IN: 64 bits that nobody can foresee, of the part's generator; false when it fails. With none
 * no session opens: nothing protected can be changed, and nothing runs. */
STUB static bool entropy(void *context, uint64_t *bits)
{
    (void)context;
    (void)bits;
    return false;
}

/* FILL IN: erases slot 0 or 1. Waits for the end, or returns HAL_FLASH_BUSY until it is over. Where
 * the core stalls meanwhile: interrupts masked, hang timer held, watchdogs with time enough; the
 * gates are off, and the port refuses when they are not (stm32g431/g431_store.c). */
STUB static hal_flash_status_t flash_erase(void *context, uint32_t slot)
{
    (void)context;
    (void)slot;
    return HAL_FLASH_FAILED;
}

/* FILL IN: programs unit_words words; DONE only when they read back. Never an address outside the
 * two slots, never the option bytes. */
STUB static hal_flash_status_t flash_program(void *context, uint32_t slot, uint32_t offset,
                                             const uint32_t *words)
{
    (void)context;
    (void)slot;
    (void)offset;
    (void)words;
    return HAL_FLASH_FAILED;
}

/* FILL IN: a word of a slot, from the cells and not from a cache. As if nothing was ever saved. */
STUB static uint32_t flash_read(void *context, uint32_t slot, uint32_t offset)
{
    (void)context;
    (void)slot;
    (void)offset;
    return UINT32_MAX;
}

static const hal_flash_t flash = {.slot_bytes = SLOT_BYTES,
                                  .unit_words = 1u, /* FILL IN: 2 where a double word is the unit */
                                  .erased_word = UINT32_MAX,
                                  .erase = flash_erase,
                                  .program = flash_program,
                                  .read = flash_read};

/* Your own with -DZH_ACCESS_KEY=<file>; else the one that everybody knows. */
static const uint8_t access_key[SIPHASH_KEY_BYTES] = HAL_ACCESS_KEY;

/* Constant, so that the linker sees whom the background calls: a bound of the stack needs it. */
static const hal_devices_t devices = {.watchdog_serve = serve_watchdog,
                                      .clock_us = clock_us,
                                      .link_read = link_read,
                                      .link_write = link_write,
                                      .identity = identity,
                                      .access_key = access_key,
                                      .entropy = entropy,
                                      .flash = &flash};

static bool start(void)
{
    (void)cm_image_banner(identity); /* FILL IN: and print it */
    if (!start_devices()) {
        return false;
    }
    /* Refused, it stands in FAULT with the gates off, and the host link can tell and mend. */
    (void)!unit_start(&unit, &cm_config.params, cm_config.table, &devices);
    if (!terminals_port_start(&terminals, &unit)) {
        return false; /* dark: the board does not have what is asked for */
    }
    unit_record_init(&unit, &(unit_memory_t){trace_memory, TRACE_WORDS, &fault_memory, NULL, 0u});
    cm_nvic_enable(HANG_IRQ, CM_LEVEL_HANG);
    cm_nvic_enable(CONTROL_IRQ, CM_LEVEL_CONTROL);
    cm_irq_on();
    return true;
}

int main(void)
{
    const bool running = start();
    while (true) {
        cm_background_sync();
        if (running) {
            unit_background(&unit, &devices);
            /* FILL IN: add the board's inputs; a safety input is SEQUENCE_CMD_TORQUE_OFF. */
            const unit_command_t command =
                terminals_port_command(&terminals, &unit, unit_link_command(&unit));
            unit_post_command(&unit, &command);
        } else {
            serve_watchdog(NULL); /* dark, and not in a loop of resets */
        }
        if (!cm_image_check_slice(&image_check)) {
            cm_stop(CM_END_IMAGE_CHANGED);
        }
    }
}
