/* The drive on a board with an STM32G431: interrupts and commands; the only file-scope state of the
 * image. README.md has pins and timing. G431_WIRING: g431_esc or g431_ihm08m1. */
#include <stdbool.h>
#include <stdint.h>

#include "unit.h"
#include "unit_record.h"
#include "cm_config.h"
#include "cm_image.h"
#include "cm_loader.h"
#include "cm_port.h"
#include "cm_registers.h"
#include "g431_adc.h"
#include "g431_board.h"
#include "g431_clock.h"
#include "g431_shunts.h"
#include "g431_start.h"
#include "g431_store.h"
#include "stm32_usart.h"
#include "g431_window.h"
#include "hal_access_key.h"
#include "stm32_bus.h"
#include "stm32_hang.h"
#include "stm32_loader.h"
#include "stm32_map.h"
#include "stm32_pwm.h"
#include "stm32_rng.h"
#include "stm32_services.h"
#include "stm32_timebase.h"
#include "stm32_watchdog.h"

#define BAUD              115200u
#define WATCHDOG_MS       100u
#define PERIOD_US         ((uint32_t)(cm_config.params.period_s * 1e6f + 0.5f))
#define BLOCK(type, name) ((stm32_##type##_t *)STM32_##name##_BASE)
#define TRACE_WORDS       1024u /* 128 rows of 8 signals, 25.6 ms */

static stm32_rcc_t *const rcc = BLOCK(rcc, RCC);
static stm32_tim_t *const tim1 = BLOCK(tim, TIM1);
static stm32_tim_t *const tim2 = BLOCK(tim, TIM2);
static stm32_tim_t *const tim7 = BLOCK(tim, TIM7);
static stm32_usart_t *const usart = BLOCK(usart, USART2);
static stm32_iwdg_t *const iwdg = BLOCK(iwdg, IWDG);
static stm32_wwdg_t *const wwdg = BLOCK(wwdg, WWDG);
static stm32_rng_t *const rng = BLOCK(rng, RNG);
static const g431_board_t board = {
    BLOCK(rcc, RCC), {BLOCK(gpio, GPIOA), BLOCK(gpio, GPIOB), BLOCK(gpio, GPIOC)}, &G431_WIRING};
static const g431_adcs_t adcs = {BLOCK(adc, ADC1), BLOCK(adc, ADC2), BLOCK(adc_common, ADC_COMMON),
                                 &G431_WIRING.channels};
static const g431_part_t part = {BLOCK(opamp, OPAMP),   BLOCK(dac, DAC3), BLOCK(comp, COMP),
                                 BLOCK(syscfg, SYSCFG), BLOCK(tim, TIM1), BLOCK(wwdg, WWDG)};

static stm32_inbox_t inbox;
static const stm32_services_t services = {.usart = BLOCK(usart, USART2),
                                          .timebase = BLOCK(tim, TIM2),
                                          .iwdg = BLOCK(iwdg, IWDG),
                                          .rng = BLOCK(rng, RNG),
                                          .inbox = &inbox};
static unit_t unit;
static cm_image_check_t image_check;
static char identity[CM_IMAGE_BANNER_BYTES];
static g431_shunts_t shunts;
static uint32_t trace_memory[TRACE_WORDS]; /* no flights: 32 KB of RAM */
static uint16_t late_periods;
static bool behind_late = true; /* the last period missed a crest, or there was none */
__attribute__((section(".noinit"))) static fault_memory_t fault_memory;

void control_interrupt(void);
void usart_interrupt(void);
void hang_interrupt(void);
void bus_interrupt(void);

__attribute__((section(".vectors.irq"), used)) static const cm_vector_t irq_vectors[] = {
    [STM32_IRQ_ADC] = control_interrupt, [STM32_IRQ_USART2] = usart_interrupt,
    [STM32_IRQ_TIM7] = hang_interrupt,
#ifdef ZH_FIELDBUS
    [STM32_IRQ_USART1] = bus_interrupt,  [STM32_IRQ_CAN] = bus_interrupt,
#endif
};

/* Before the timer has its clock this writes to nobody: the gates are off from reset on. */
void port_gates_off(void)
{
    stm32_pwm_gates_off(tim1);
}

COLD void port_halt(const cm_fault_t *fault)
{
    (void)g431_window_open(wwdg);
    char text[CM_FAULT_TEXT_BYTES];
    char *end = cm_fault_text(text, fault, (tim1->BDTR & TIM_BDTR_MOE) != 0u);
    *end = '\0';
    (void)stm32_usart_send(usart, text);
    (void)stm32_usart_send(usart, "\r\n");
    while (true) {
        port_gates_off();
        stm32_watchdog_serve(iwdg);
        if ((wwdg->CR & WWDG_CR_WDGA) != 0u) {
            g431_window_serve(wwdg);
        }
    }
}

/* A torn word of the parameters, or the crystal failed: gates are off, the core is at 16 MHz now.
 */
void port_nmi(void)
{
    if (g431_flash_forgive(BLOCK(flash, FLASH))) {
        return;
    }
    rcc->CICR = RCC_CICR_CSSC;
    (void)stm32_usart_start(usart, G431_CLOCK_WITHOUT_CRYSTAL_HZ, BAUD);
    cm_stop(CM_END_CLOCK_LOST);
}

/* The break stays latched: a control interrupt that comes back cannot close the gates again. */
void hang_interrupt(void)
{
    stm32_pwm_break(tim1);
    stm32_hang_seen(tim7);
}

void control_interrupt(void)
{
    stm32_hang_serve(tim7);
    if (!behind_late) {
        g431_window_serve(wwdg);
    }
    const uint32_t entry_us = stm32_timebase_us(tim2);
    stm32_pwm_forget_crest(tim1);
    g431_words_t words;
    g431_adc_read(&adcs, &words);
    hal_sample_t sample;
    g431_shunts_words(&shunts, tim1->ARR, &words, &sample);
    sample.late_periods = late_periods;
    sample.inputs = stm32_pwm_broken(tim1) ? HAL_INPUT_BREAK : 0u;
    /* Behind a late period this one may begin anywhere: that is counted and no reason to stop. */
    if (!behind_late && !stm32_pwm_past_crest(tim1)) {
        cm_stop(CM_END_NOT_AT_CREST);
    }
    hal_output_t output;
    unit_control_period(&unit, &sample, &output);
    stm32_pwm_write(tim1, &output);
    g431_shunts_written(&shunts, tim1);
    unit_record_period(&unit, &sample, &output);
    const uint32_t spent_us = stm32_timebase_us(tim2) - entry_us;
    const uint16_t missed = stm32_pwm_missed_crests(tim1, spent_us, PERIOD_US);
    late_periods = (uint16_t)(late_periods + missed);
    behind_late = missed > 0u;
}

void usart_interrupt(void)
{
    stm32_services_received(&services);
}

static g431_store_t store = {
    .slots = {BLOCK(flash, FLASH), (volatile uint32_t *)G431_FLASH_START, G431_FLASH_POLLS},
    .pwm = BLOCK(tim, TIM1),
    .adcs = &adcs,
    .hang = BLOCK(tim, TIM7),
    .iwdg = BLOCK(iwdg, IWDG),
    .wwdg = BLOCK(wwdg, WWDG),
    .behind_late = &behind_late};
static const hal_flash_t flash = G431_STORE_FLASH(&store);
static const uint8_t access_key[SIPHASH_KEY_BYTES] = HAL_ACCESS_KEY;

/* Constant, so that the linker sees whom the background calls: a bound of the stack needs it. */
static const hal_devices_t devices = {.context = (void *)&services,
                                      .watchdog_serve = stm32_services_watchdog,
                                      .clock_us = stm32_services_clock_us,
                                      .link_read = stm32_services_link_read,
                                      .link_write = stm32_services_link_write,
                                      .identity = identity,
                                      .access_key = access_key,
                                      .entropy = stm32_services_entropy,
                                      .flash = &flash,
                                      .loader = CM_LOADER(stm32_loader_call)};

void port_early(void)
{
    g431_board_gates_off(&board);
}

COLD static g431_clock_t start_clock_and_serial_port(void)
{
    const g431_clock_t clock = g431_clock_start(rcc, BLOCK(flash, FLASH), BLOCK(pwr, PWR),
                                                G431_WIRING.crystal_MHz, G431_CLOCK_POLLS);
    g431_board_clocks(&board);
    stm32_rng_start(rng);
    g431_board_pins(&board);
    (void)stm32_usart_start(usart, g431_clock_Hz(clock), BAUD);
    (void)cm_image_banner(identity);
    (void)stm32_usart_send(usart, identity);
    (void)stm32_usart_send(usart, "\r\n");
    return clock;
}

#ifdef ZH_FIELDBUS
static stm32_bus_t bus = {
    .serial = {.usart = BLOCK(usart, USART1),
               .port = BLOCK(gpio, GPIOB),
               .pin = G431_BOARD_DRIVER_ENABLE,
               .timebase = BLOCK(tim, TIM2)},
    .can = {.device = {BLOCK(fdcan, FDCAN1), BLOCK(reg, CAN_RAM)}, .timebase = BLOCK(tim, TIM2)}};

void bus_interrupt(void)
{
    stm32_bus_interrupt(&bus);
}

COLD static void start_bus(void)
{
    const uint32_t clock_Hz = g431_clock_Hz(G431_CLOCK_CRYSTAL);
    g431_board_bus(&board);
    (void)stm32_usart_send(usart, stm32_bus_start(&bus, clock_Hz, clock_Hz));
    cm_nvic_enable(STM32_IRQ_USART1, CM_LEVEL_CONTROL);
    cm_nvic_enable(STM32_IRQ_CAN, CM_LEVEL_CONTROL);
}
#else
static stm32_bus_t bus;

static void start_bus(void)
{
}
#endif

COLD static void start_interrupts(uint32_t clock_Hz)
{
    stm32_usart_interrupt(usart);
    cm_nvic_enable(STM32_IRQ_USART2, CM_LEVEL_CONTROL);
    stm32_timebase_start(tim2, clock_Hz);
    stm32_hang_start(tim7, clock_Hz, 5u * PERIOD_US / 2u);
    cm_nvic_enable(STM32_IRQ_TIM7, CM_LEVEL_HANG);
    cm_nvic_enable(STM32_IRQ_ADC, CM_LEVEL_CONTROL);
    start_bus();
    cm_irq_on();
}

/* Says what is wrong; true when the drive may run. */
COLD static bool start_drive(g431_clock_t clock)
{
    const g431_timing_t timing = {g431_clock_Hz(clock), cm_config.params.period_s,
                                  cm_config.params.dead_time_s, G431_ADC_POLLS};
    const unit_memory_t memory = {trace_memory, TRACE_WORDS, &fault_memory, NULL, 0u};
    const char *wrong = "";
    if (clock != G431_CLOCK_CRYSTAL) {
        wrong = (clock == G431_CLOCK_INTERNAL) ? "no PLL" : "no crystal";
    } else if (!stm32_watchdog_start(iwdg, WATCHDOG_MS)) {
        wrong = "no watchdog";
    } else if (!g431_start_measurement(&part, &board, &adcs, &timing, &shunts)) {
        wrong = "ADC does not start";
    } else {
        /* Refused, it stands in FAULT with the gates off, and the host link can tell and mend. */
        if (!unit_start(&unit, &cm_config.params, cm_config.table, &devices)) {
            (void)stm32_usart_send(usart, "configuration refused; drive off\r\n");
        }
        unit_record_init(&unit, &memory);
        start_interrupts(timing.clock_Hz);
        /* Last: the first crest, half a period later, finds everything waiting for it. */
        wrong = g431_start_carrier(&part, &board, &timing);
    }
    (void)stm32_usart_send(usart, wrong);
    (void)stm32_usart_send(usart, (*wrong == '\0') ? G431_WIRING.crystal_text : "; drive off\r\n");
    return *wrong == '\0';
}

COLD static void follow_commands(void)
{
    unit_command_t command = stm32_bus_command(&bus, &unit);
    if (stm32_pwm_held(tim1, (command.command & SEQUENCE_CMD_FAULT_RESET) != 0u)) {
        command.command |= SEQUENCE_CMD_TORQUE_OFF;
    }
    unit_post_command(&unit, &command);
    g431_board_led(&board, unit.asked.mode != DRIVE_OFF);
}

COLD int main(void)
{
    const g431_clock_t clock = start_clock_and_serial_port();
    (BLOCK(dbg, DBG))->APB2_FZ |= DBG_APB2FZ_DBG_TIM1_STOP; /* halted: gates off */
    if ((rcc->CSR & (RCC_CSR_IWDGRSTF | RCC_CSR_WWDGRSTF)) != 0u) {
        (void)stm32_usart_send(usart, "reset: watchdog\r\n");
    }
    rcc->CSR |= RCC_CSR_RMVF;
    const bool running = start_drive(clock);
    while (true) {
        cm_background_sync();
        if (running) {
            unit_background(&unit, &devices);
            follow_commands();
        } else {
            stm32_watchdog_serve(iwdg);
        }
        if (!cm_image_check_slice(&image_check)) {
            cm_stop(CM_END_IMAGE_CHANGED);
        }
    }
}
