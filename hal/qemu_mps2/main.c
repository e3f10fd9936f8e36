/* The drive on the emulated MPS2 board, with the plant behind two FIFOs (pil_protocol.h).
 *
 * CMSDK timer 0 is the control interrupt, timer 1 counts instructions, the watchdog is the NMI, LED
 * lines stand for gate enable and fault. The only file-scope state of the image.
 */
#include <stdbool.h>
#include <stdint.h>

#include "unit.h"
#include "unit_record.h"
#include "bus.h"
#include "cm_config.h"
#include "cm_image.h"
#include "cm_loader.h"
#include "cm_port.h"
#include "cm_registers.h"
#include "cm_stack.h"
#include "cm_text.h"
#include "hal_access_key.h"
#include "host_link.h"
#include "inject.h"
#include "mps2_registers.h"
#include "pil_protocol.h"
#include "plant.h"
#include "ram_flash.h"
#include "semihosting.h"

#define CONTROL_TICKS    (MPS2_CLOCK_HZ / 5000u)   /* 200 us */
#define HANG_TICKS       (5u * CONTROL_TICKS / 2u) /* since a control interrupt began */
#define WATCHDOG_PERIODS 500u                      /* 100 ms */
#define EXIT_DONE        50u
#define EXIT_NO_PLANT    51u
#define TRACE_WORDS      1024u /* 128 rows of 8 signals; 25.6 ms */
#define BAUD_DIVIDER     217u  /* 115200; the emulator does not wait */

static unit_t unit;
static bus_t bus;
static cm_image_check_t image_check;
static plant_t plant;
static host_link_t link;
static int32_t random_file;
static pil_start_t asked; /* its parameters stand for the image's */
static uint32_t background_calls;
/* Of the control interrupt; one struct, so that one register reaches all of it. */
static struct {
    uint32_t inject; /* as asked */
    uint32_t late_periods;
    volatile uint32_t periods;
    volatile bool hung; /* the gates went off, as it did not come back, hung_ticks later */
} control;
static volatile uint32_t control_entry; /* of the last control interrupt, MPS2_TIMER1 */
static volatile uint32_t hung_ticks;
static uint32_t trace_memory[TRACE_WORDS];
static uint32_t flight_memory[32768u * FLIGHT_ROW_WORDS]; /* 6.5 s */
static char identity[CM_IMAGE_BANNER_BYTES];
static inject_patch_t patch;
__attribute__((section(".noinit"))) static fault_memory_t fault_memory;
__attribute__((section(".device"))) static ram_flash_t flash_memory;

void control_interrupt(void);
void hang_interrupt(void);

__attribute__((section(".vectors.irq"), used)) static const cm_vector_t irq_vectors[] = {
    [MPS2_TIMER0_IRQ] = control_interrupt,
    [MPS2_HANG_IRQ] = hang_interrupt,
};

void port_gates_off(void)
{
    MPS2_LEDS = 0u;
}

void port_early(void)
{
}

/* `end CODE gates G pc X address X hang X`, and the code as the emulator's own exit code. */
void port_halt(const cm_fault_t *fault)
{
    MPS2_LEDS |= MPS2_LEDS_FAULT;
    char text[CM_FAULT_TEXT_BYTES];
    char *at = cm_fault_text(text, fault, (MPS2_LEDS & MPS2_LEDS_GATES) != 0u);
    at = cm_text(at, " hang ");
    at = cm_text_hex(at, hung_ticks);
    at = cm_text(at, "\n");
    *at = '\0';
    semihosting_print(text);
    semihosting_exit((uint32_t)fault->code);
}

void port_nmi(void)
{
    /* A background call takes some periods: only many without service are its own failure. */
    cm_watchdog_expired(unit.period_count - unit.served_count > WATCHDOG_PERIODS / 2u);
}

static void serve_watchdog(void *context)
{
    (void)context;
    MPS2_WATCHDOG_LOCK = MPS2_WATCHDOG_UNLOCK;
    MPS2_WATCHDOG_INTCLR = 1u;
    MPS2_WATCHDOG_LOCK = 0u;
}

static uint32_t clock_us(void *context)
{
    (void)context;
    return (UINT32_MAX - MPS2_TIMER_VALUE(MPS2_TIMER1)) / (MPS2_CLOCK_HZ / 1000000u);
}

/* The emulator has no generator; the host behind it has. */
static bool entropy(void *context, uint64_t *bits)
{
    (void)context;
    return (random_file >= 0) && semihosting_read(random_file, bits, sizeof *bits);
}

static const uint8_t access_key[SIPHASH_KEY_BYTES] = HAL_ACCESS_KEY;
static const hal_flash_t flash = RAM_FLASH(&flash_memory);

/* Constant, so that the linker sees whom the background calls: a bound of the stack needs it. */
static const hal_devices_t devices = {.context = &link,
                                      .watchdog_serve = serve_watchdog,
                                      .clock_us = clock_us,
                                      .link_read = host_link_read,
                                      .link_write = host_link_write,
                                      .identity = identity,
                                      .access_key = access_key,
                                      .entropy = entropy,
                                      .flash = &flash,
                                      .loader = CM_LOADER(cm_loader_call)};

_Noreturn static void leave(void)
{
    const pil_end_t end = {.magic = PIL_MAGIC,
                           .stack_bytes = cm_stack_size(),
                           .stack_used_bytes = cm_stack_used(),
                           .late_periods = control.late_periods,
                           .background_calls = background_calls};
    (void)plant_leave(&plant, &end);
    semihosting_exit(EXIT_DONE);
}

/* More urgent than the control interrupt, which hangs: opens the gates and does nothing else. */
void hang_interrupt(void)
{
    port_gates_off();
    MPS2_HANG_INTCLR = 1u;
    hung_ticks = control.hung ? hung_ticks : (control_entry - MPS2_TIMER_VALUE(MPS2_TIMER1));
    control.hung = true;
}

/* After a hang the gates stay off until the drive, told of a late period, has opened them too. */
static inline void write_gates(bool on)
{
    if (control.hung) {
        control.hung = on;
        on = false;
    }
    MPS2_LEDS = on ? MPS2_LEDS_GATES : 0u;
}

/* Events since the interrupt began at `entry`; the timer itself only remembers one. */
static uint32_t missed_events(uint32_t entry)
{
    const uint32_t whole = (entry - MPS2_TIMER_VALUE(MPS2_TIMER1)) / CONTROL_TICKS;
    return (whole > 0u) ? whole : (MPS2_TIMER_INTCLR(MPS2_TIMER0) & 1u);
}

/* What the interrupt of a board does between its entry and its exit. This call is what is counted;
 * around it stands what this board has in place of a converter. */
__attribute__((noinline, used)) static void counted_interrupt(const hal_sample_t *sample,
                                                              uint32_t entry, hal_output_t *output)
{
    MPS2_TIMER_INTCLR(MPS2_TIMER0) = 1u;
    MPS2_HANG_LOAD = HANG_TICKS;
    unit_control_period(&unit, sample, output);
    write_gates(output->gates_on);
    unit_record_period(&unit, sample, output);
    if (control.inject != PIL_INJECT_NONE) {
        inject_delay(control.inject, control.periods - asked.inject_at, entry, CONTROL_TICKS);
    }
    control.late_periods += missed_events(entry);
    control.periods++;
}

_Noreturn static void no_plant(void)
{
    port_gates_off();
    semihosting_exit(EXIT_NO_PLANT);
}

/* The next sample, and what the operator wants; or the word to leave. */
static void take_sample(hal_sample_t *sample)
{
    pil_in_t in;
    if (!plant_ask(&plant, &in)) {
        no_plant();
    }
    if ((in.command & PIL_STOP) != 0u) {
        leave();
    }
    *sample = in.sample;
    sample->late_periods = (uint16_t)control.late_periods;
    const unit_command_t command = {.command = in.command,
                                    .omega_m_ref_rad_s = in.omega_m_ref_rad_s,
                                    .torque_ref_Nm = in.torque_ref_Nm,
                                    .count = in.command_count};
    if (!bus.on) {
        unit_post_command(&unit, &command);
    }
}

void control_interrupt(void)
{
    pil_out_t out;
    out.latency_ticks = CONTROL_TICKS - MPS2_TIMER_VALUE(MPS2_TIMER0);
    const uint32_t entry = MPS2_TIMER_VALUE(MPS2_TIMER1);
    control_entry = entry;

    hal_sample_t sample;
    take_sample(&sample);
    if (control.periods == asked.inject_at) {
        inject(&asked, &unit, &patch);
    }
    hal_output_t output;
    out.begin_ticks = UINT32_MAX - MPS2_TIMER_VALUE(MPS2_TIMER1);
    counted_interrupt(&sample, entry, &output);
    out.end_ticks = UINT32_MAX - MPS2_TIMER_VALUE(MPS2_TIMER1);
    out.late_periods = control.late_periods;
    inject_take_out(&patch);
    if (!plant_answer(&plant, &unit, &output, &out)) {
        no_plant();
    }
}

static bool connect(void)
{
    link.file = semihosting_open(PIL_LINK_FILE, SEMIHOSTING_READ);
    random_file = semihosting_open("/dev/urandom", SEMIHOSTING_READ);
    if (!plant_connect(&plant, &asked)) {
        return false;
    }
    control.inject = asked.inject;
    const params_t *params = (asked.use_params != 0u) ? &asked.params : &cm_config.params;
    ram_flash_start(&flash_memory);
    const bool taken = unit_start(&unit, params, cm_config.table, &devices);
    unit_record_init(&unit, &(unit_memory_t){trace_memory, TRACE_WORDS, &fault_memory,
                                             flight_memory, sizeof flight_memory / 4u});
    bus_connect(&bus, &unit);
    return plant_ready(&plant, !taken);
}

static void start_devices(void)
{
    MPS2_TIMER_RELOAD(MPS2_TIMER1) = UINT32_MAX;
    MPS2_TIMER_VALUE(MPS2_TIMER1) = UINT32_MAX;
    MPS2_TIMER_CTRL(MPS2_TIMER1) = MPS2_TIMER_ENABLE;
    MPS2_UART_BAUDDIV = BAUD_DIVIDER;
    MPS2_UART_CTRL = MPS2_UART_TXEN | MPS2_UART_RXEN;
    MPS2_WATCHDOG_LOCK = MPS2_WATCHDOG_UNLOCK;
    MPS2_WATCHDOG_LOAD = WATCHDOG_PERIODS * CONTROL_TICKS;
    MPS2_WATCHDOG_CTRL = MPS2_WATCHDOG_INTEN | MPS2_WATCHDOG_RESEN;
    MPS2_WATCHDOG_LOCK = 0u;
    MPS2_HANG_CTRL = MPS2_HANG_RUN;
    MPS2_HANG_LOAD = HANG_TICKS;
    cm_nvic_enable(MPS2_HANG_IRQ, CM_LEVEL_HANG);
    MPS2_TIMER_RELOAD(MPS2_TIMER0) = CONTROL_TICKS - 1u;
    MPS2_TIMER_VALUE(MPS2_TIMER0) = CONTROL_TICKS - 1u;
    MPS2_TIMER_CTRL(MPS2_TIMER0) = MPS2_TIMER_ENABLE | MPS2_TIMER_INTERRUPT;
    cm_nvic_enable(MPS2_TIMER0_IRQ, CM_LEVEL_CONTROL);
}

int main(void)
{
    (void)cm_image_banner(identity);
    semihosting_print(identity);
    semihosting_print("\n");
    if (!connect()) {
        semihosting_exit(EXIT_NO_PLANT);
    }
    start_devices();
    cm_irq_on();
    while (true) {
        cm_background_sync();
        unit_background(&unit, &devices);
        bus_background(&bus, &unit);
        if (!cm_image_check_slice(&image_check)) {
            cm_stop(CM_END_IMAGE_CHANGED);
        }
        if ((unit.mailbox.faults & FAULT_TABLE_CRC) != 0u) {
            /* The drive has opened the gates by itself; say so in this port's way. */
            cm_stop(CM_END_TABLE_CHANGED);
        }
        inject_background(asked.inject, control.periods - asked.inject_at, &unit);
        background_calls++;
    }
}
