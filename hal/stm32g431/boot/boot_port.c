/* The boot loader on the STM32G431: 16 MHz as after reset, USART2, one slot of 48 pages. */
#include "boot_port.h"

#include "g431_board.h"
#include "g431_flash.h"
#include "stm32_gpio.h"
#include "stm32_map.h"
#include "stm32_usart.h"

#define CLOCK_HZ          16000000u /* internal, no PLL, buses undivided */
#define BAUD              115200u
#define COUNTER_AT        0x08003800u
#define COUNTER_BYTES     G431_FLASH_PAGE_BYTES
#define RUN_AT            0x08004000u
#define SLOT_BYTES        (48u * G431_FLASH_PAGE_BYTES)
#define BLOCK(type, name) ((stm32_##type##_t *)STM32_##name##_BASE)

static stm32_usart_t *const usart = BLOCK(usart, USART2);
static stm32_flash_t *const controller = BLOCK(flash, FLASH);
static const g431_board_t board = {
    BLOCK(rcc, RCC), {BLOCK(gpio, GPIOA), BLOCK(gpio, GPIOB), BLOCK(gpio, GPIOC)}, &G431_WIRING};

static uint32_t address(boot_area_t area, uint32_t offset)
{
    return ((area == BOOT_COUNTER) ? COUNTER_AT : RUN_AT) + offset;
}

static volatile uint32_t *cell(uint32_t at)
{
    return (volatile uint32_t *)(uintptr_t)at;
}

static bool erase(void *context, boot_area_t slot)
{
    (void)context;
    bool done = slot == BOOT_RUN;
    for (uint32_t page = G431_FLASH_PAGE_FIRST; done && (page <= G431_FLASH_PAGE_LAST); page++) {
        done = g431_flash_erase(controller, page, G431_FLASH_POLLS) == G431_FLASH_OK;
    }
    return done;
}

static bool program(void *context, boot_area_t area, uint32_t offset, const uint32_t *words)
{
    (void)context;
    const uint32_t at = address(area, offset);
    return g431_flash_program(controller, at, cell(at), words, G431_FLASH_POLLS) == G431_FLASH_OK;
}

/* A double word that was torn may not be readable at all: the non-maskable interrupt says so. */
static uint32_t read(void *context, boot_area_t area, uint32_t offset)
{
    (void)context;
    return *cell(address(area, offset));
}

const boot_flash_t boot_port_flash = {.counter_bytes = COUNTER_BYTES,
                                      .slot_bytes = SLOT_BYTES,
                                      .staged = false,
                                      .erase = erase,
                                      .program = program,
                                      .read = read};

void boot_port_gates_off(void)
{
    g431_board_gates_off(&board);
}

static void pin(g431_pin_t pin, stm32_gpio_pull_t pull)
{
    stm32_gpio_configure(board.port[pin.port], pin.pin, STM32_GPIO_ALTERNATE, pull, pin.function);
}

void boot_port_start(void)
{
    board.rcc->APB1ENR1 |= RCC_APB1ENR1_USART2EN;
    (void)board.rcc->APB1ENR1; /* a device answers some clocks after it got one */
    pin(board.wiring->tx, STM32_GPIO_FLOATING);
    pin(board.wiring->rx, STM32_GPIO_PULL_UP);
    (void)stm32_usart_start(usart, CLOCK_HZ, BAUD);
}

void boot_port_stop(void)
{
    usart->CR1 = 0u;
}

bool boot_port_receive(uint8_t *byte)
{
    return stm32_usart_receive(usart, byte);
}

bool boot_port_put(uint8_t byte)
{
    return stm32_usart_put(usart, byte);
}

bool boot_port_forgive(void)
{
    return g431_flash_forgive(controller);
}

uint32_t boot_port_ms_clocks(void)
{
    return CLOCK_HZ / 1000u;
}

uint32_t boot_port_run_address(void)
{
    return RUN_AT;
}
