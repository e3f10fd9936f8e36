/* The drive on an inverter board with an STM32F405: pins, interrupts, commands. README.md has the
 * pin table and the timing. The only file-scope state of the image. */
#include <stdbool.h>
#include <stdint.h>

#include "unit.h"
#include "unit_record.h"
#include "cm_config.h"
#include "cm_image.h"
#include "cm_loader.h"
#include "cm_port.h"
#include "cm_registers.h"
#include "hal_access_key.h"
#include "stm32_adc.h"
#include "stm32_board.h"
#include "stm32_bus.h"
#include "stm32_clock.h"
#include "stm32_hang.h"
#include "stm32_loader.h"
#include "stm32_map.h"
#include "stm32_pwm.h"
#include "stm32_rng.h"
#include "stm32_services.h"
#include "stm32_store.h"
#include "stm32_timebase.h"
#include "stm32_usart.h"
#include "stm32_watchdog.h"

#define BAUD        115200u
#define WATCHDOG_MS 100u
#define PERIOD_US   ((uint32_t)(cm_config.params.period_s * 1e6f + 0.5f))
#define TRACE_WORDS 1024u /* 128 rows of 8 signals, 25.6 ms */

static stm32_rcc_t *const rcc = (stm32_rcc_t *)STM32_RCC_BASE;
static stm32_tim_t *const tim1 = (stm32_tim_t *)STM32_TIM1_BASE;
static stm32_tim_t *const tim7 = (stm32_tim_t *)STM32_TIM7_BASE;
static stm32_tim_t *const tim5 = (stm32_tim_t *)STM32_TIM5_BASE;
static stm32_usart_t *const usart = (stm32_usart_t *)STM32_USART3_BASE;
static stm32_iwdg_t *const iwdg = (stm32_iwdg_t *)STM32_IWDG_BASE;
static stm32_rng_t *const rng = (stm32_rng_t *)STM32_RNG_BASE;
static const stm32_board_t board = {(stm32_rcc_t *)STM32_RCC_BASE, (stm32_gpio_t *)STM32_GPIOA_BASE,
                                    (stm32_gpio_t *)STM32_GPIOB_BASE,
                                    (stm32_gpio_t *)STM32_GPIOC_BASE};
static const stm32_adcs_t adcs = {(stm32_adc_t *)STM32_ADC1_BASE, (stm32_adc_t *)STM32_ADC2_BASE,
                                  (stm32_adc_t *)STM32_ADC3_BASE,
                                  (stm32_adc_common_t *)STM32_ADC_COMMON_BASE};

static stm32_inbox_t inbox;
static const stm32_services_t services = {.usart = (stm32_usart_t *)STM32_USART3_BASE,
                                          .timebase = (stm32_tim_t *)STM32_TIM5_BASE,
                                          .iwdg = (stm32_iwdg_t *)STM32_IWDG_BASE,
                                          .rng = (stm32_rng_t *)STM32_RNG_BASE,
                                          .inbox = &inbox};
static unit_t unit;
static cm_image_check_t image_check;
static char identity[CM_IMAGE_BANNER_BYTES];
static uint32_t trace_memory[TRACE_WORDS];
static uint32_t flight_memory[8192u * FLIGHT_ROW_WORDS]; /* 1.6 s */
static uint16_t late_periods;
static bool behind_late; /* the last period missed a crest */

__attribute__((section(".noinit"))) static fault_memory_t fault_memory;

void control_interrupt(void);
void usart_interrupt(void);
void hang_interrupt(void);
void bus_interrupt(void);

__attribute__((section(".vectors.irq"), used)) static const cm_vector_t irq_vectors[] = {
    [STM32_IRQ_ADC] = control_interrupt, [STM32_IRQ_USART3] = usart_interrupt,
    [STM32_IRQ_TIM7] = hang_interrupt,
#ifdef ZH_FIELDBUS
    [STM32_IRQ_UART4] = bus_interrupt,   [STM32_IRQ_CAN] = bus_interrupt,
#endif
};

/* Before the timer has its clock this writes to nobody: the gates are off from reset on. */
void port_gates_off(void)
{
    stm32_pwm_gates_off(tim1);
}

/* Stays here, dark and served: a reset would hide why, and start the drive again. */
COLD void port_halt(const cm_fault_t *fault)
{
    char text[CM_FAULT_TEXT_BYTES];
    char *end = cm_fault_text(text, fault, (tim1->BDTR & TIM_BDTR_MOE) != 0u);
    *end = '\0';
    (void)stm32_usart_send(usart, text);
    (void)stm32_usart_send(usart, "\r\n");
    stm32_board_led_fault(&board, true);
    while (true) {
        port_gates_off();
        stm32_watchdog_serve(iwdg);
    }
}

/* The crystal failed; the timer's break has already opened the gates. The core goes on at 16 MHz
 * with the bus dividers it had: the serial port needs its divider anew to tell. */
void port_nmi(void)
{
    rcc->CIR |= RCC_CIR_CSSC;
    (void)stm32_usart_start(usart, STM32_CLOCK_APB1_WITHOUT_CRYSTAL_HZ, BAUD);
    cm_stop(CM_END_CLOCK_LOST);
}

/* More urgent than the control interrupt, which hangs: opens the gates and does nothing else. The
 * break stays latched: a control interrupt that comes back cannot close them again. */
void hang_interrupt(void)
{
    stm32_pwm_break(tim1);
    stm32_hang_seen(tim7);
}

void control_interrupt(void)
{
    stm32_hang_serve(tim7);
    const uint32_t entry_us = stm32_timebase_us(tim5);
    stm32_pwm_forget_crest(tim1);
    hal_sample_t sample;
    stm32_adc_read(&adcs, &sample);
    sample.late_periods = late_periods;
    sample.inputs = stm32_pwm_broken(tim1) ? HAL_INPUT_BREAK : 0u;
    /* Behind a late period this one may begin anywhere: that is counted and no reason to stop. */
    if (!behind_late && !stm32_pwm_past_crest(tim1)) {
        cm_stop(CM_END_NOT_AT_CREST);
    }
    hal_output_t output;
    unit_control_period(&unit, &sample, &output);
    stm32_pwm_write(tim1, &output);
    unit_record_period(&unit, &sample, &output);
    const uint32_t spent_us = stm32_timebase_us(tim5) - entry_us;
    const uint16_t missed = stm32_pwm_missed_crests(tim1, spent_us, PERIOD_US);
    late_periods = (uint16_t)(late_periods + missed);
    behind_late = missed > 0u;
}

void usart_interrupt(void)
{
    stm32_services_received(&services);
}

static stm32_store_t store = {
    .slots = {(stm32_flash_t *)STM32_FLASH_BASE,
              {(volatile uint32_t *)0x08020000u, (volatile uint32_t *)0x08040000u},
              STM32_FLASH_POLLS},
    .adcs = &adcs,
    .hang = (stm32_tim_t *)STM32_TIM7_BASE,
    .iwdg = (stm32_iwdg_t *)STM32_IWDG_BASE,
    .watchdog_ms = WATCHDOG_MS,
    .behind_late = &behind_late};
static const hal_flash_t flash = {.context = &store,
                                  .slot_bytes = STM32_SLOTS_BYTES,
                                  .unit_words = 1u,
                                  .erased_word = UINT32_MAX,
                                  .erase = stm32_store_erase,
                                  .program = stm32_store_program,
                                  .read = stm32_store_read};
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
    stm32_board_gates_low(&board);
}

/* Serial port and clock first, so that whatever fails afterwards can be told. */
COLD static stm32_clock_t start_clock_and_serial_port(void)
{
    const stm32_clock_t clock = stm32_clock_start(rcc, (stm32_flash_t *)STM32_FLASH_BASE,
                                                  (stm32_pwr_t *)STM32_PWR_BASE, STM32_CLOCK_POLLS);
    stm32_board_clocks(&board);
    stm32_rng_start(rng);
    stm32_board_pins(&board);
    (void)stm32_usart_start(usart, stm32_clock_apb1_Hz(clock), BAUD);
    (void)cm_image_banner(identity);
    (void)stm32_usart_send(usart, identity);
    (void)stm32_usart_send(usart, "\r\n");
    return clock;
}

#ifdef ZH_FIELDBUS
static stm32_bus_t bus = {.serial = {.usart = (stm32_usart_t *)STM32_UART4_BASE,
                                     .port = (stm32_gpio_t *)STM32_GPIOC_BASE,
                                     .pin = STM32_BOARD_DRIVER_ENABLE,
                                     .timebase = (stm32_tim_t *)STM32_TIM5_BASE},
                          .can = {.device = {(stm32_can_t *)STM32_CAN1_BASE},
                                  .timebase = (stm32_tim_t *)STM32_TIM5_BASE}};

void bus_interrupt(void)
{
    stm32_bus_interrupt(&bus);
}

COLD static void start_bus(void)
{
    const uint32_t clock_Hz = stm32_clock_apb1_Hz(STM32_CLOCK_CRYSTAL);
    stm32_board_bus(&board);
    (void)stm32_usart_send(usart, stm32_bus_start(&bus, clock_Hz, clock_Hz));
    cm_nvic_enable(STM32_IRQ_UART4, CM_LEVEL_CONTROL);
    cm_nvic_enable(STM32_IRQ_CAN, CM_LEVEL_CONTROL);
}
#else
static stm32_bus_t bus;

static void start_bus(void)
{
}
#endif

/* Says what is wrong; true when the drive may run. */
COLD static bool start_drive(stm32_clock_t clock)
{
    const stm32_pwm_params_t pwm = {.clock_Hz = stm32_clock_core_Hz(clock),
                                    .period_s = cm_config.params.period_s,
                                    .dead_time_s = cm_config.params.dead_time_s};
    const char *wrong = "";
    if (clock != STM32_CLOCK_CRYSTAL) {
        wrong = (clock == STM32_CLOCK_INTERNAL) ? "no PLL" : "no crystal";
    } else if (!stm32_watchdog_start(iwdg, WATCHDOG_MS)) {
        wrong = "no watchdog";
    } else {
        /* Refused, it stands in FAULT with the gates off, and the host link can tell and mend. */
        if (!unit_start(&unit, &cm_config.params, cm_config.table, &devices)) {
            (void)stm32_usart_send(usart, "configuration refused; drive off\r\n");
        }
        unit_record_init(&unit, &(unit_memory_t){trace_memory, TRACE_WORDS, &fault_memory,
                                                 flight_memory, sizeof flight_memory / 4u});
        stm32_usart_interrupt(usart);
        cm_nvic_enable(STM32_IRQ_USART3, CM_LEVEL_CONTROL);
        stm32_timebase_start(tim5, 2u * stm32_clock_apb1_Hz(clock));
        stm32_adc_start(&adcs);
        stm32_hang_start(tim7, 2u * stm32_clock_apb1_Hz(clock), 5u * PERIOD_US / 2u);
        cm_nvic_enable(STM32_IRQ_TIM7, CM_LEVEL_HANG);
        cm_nvic_enable(STM32_IRQ_ADC, CM_LEVEL_CONTROL);
        start_bus();
        cm_irq_on();
        /* Last: the first crest, half a period later, finds everything waiting for it. */
        if (stm32_pwm_start(tim1, &pwm)) {
            stm32_board_gates_to_timer(&board);
        } else {
            wrong = "period or dead time beyond the timer";
        }
    }
    (void)stm32_usart_send(usart, wrong);
    (void)stm32_usart_send(usart, (*wrong == '\0') ? "168 MHz\r\n" : "; drive off\r\n");
    return *wrong == '\0';
}

/* What the host asks for, the break input and what it means for the drive. */
COLD static void follow_commands(void)
{
    unit_command_t command = stm32_bus_command(&bus, &unit);
    if (stm32_pwm_held(tim1, (command.command & SEQUENCE_CMD_FAULT_RESET) != 0u)) {
        command.command |= SEQUENCE_CMD_TORQUE_OFF;
    }
    unit_post_command(&unit, &command);
    stm32_board_led_run(&board, unit.asked.mode != DRIVE_OFF);
    stm32_board_led_fault(&board, unit.machine.faults != 0u);
}

COLD int main(void)
{
    const stm32_clock_t clock = start_clock_and_serial_port();
    ((stm32_dbg_t *)STM32_DBG_BASE)->DBGMCU_APB2_FZ |=
        DBG_APB2FZ_DBG_TIM1_STOP; /* halted: gates off */
    const bool watchdog = (rcc->CSR & RCC_CSR_WDGRSTF) != 0u;
    rcc->CSR |= RCC_CSR_RMVF;
    if (watchdog) {
        (void)stm32_usart_send(usart, "reset: watchdog\r\n");
    }
    const bool running = start_drive(clock);
    stm32_board_led_fault(&board, !running);
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
