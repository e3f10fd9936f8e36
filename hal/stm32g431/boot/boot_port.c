/* The boot loader on the STM32G431: USART2, one slot of 52 pages. */
#include "boot_port.h"

#include "g431_board.h"
#include "g431_flash.h"
#include "stm32_boot.h"
#include "stm32_gpio.h"
#include "stm32_map.h"

#define COUNTER_BYTES G431_FLASH_PAGE_BYTES
#define SLOT_AT       0x08004000u
#define SLOT_BYTES    (52u * G431_FLASH_PAGE_BYTES)
_Static_assert(SLOT_AT + SLOT_BYTES == G431_FLASH_END,
               "the slot ends with the pages that are erased");
#define BLOCK(type, name) ((stm32_##type##_t *)STM32_##name##_BASE)

static stm32_flash_t *const controller = BLOCK(flash, FLASH);
static const g431_board_t board = {
    BLOCK(rcc, RCC), {BLOCK(gpio, GPIOA), BLOCK(gpio, GPIOB), BLOCK(gpio, GPIOC)}, &G431_WIRING};

const stm32_boot_t stm32_boot = {.usart = BLOCK(usart, USART2),
                                 .counter_at = 0x08003800u,
                                 .run_at = SLOT_AT,
                                 .stage_at = SLOT_AT};

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
    const uint32_t at = stm32_boot_address(area, offset);
    return g431_flash_program(controller, at, stm32_boot_cell(at), words, G431_FLASH_POLLS) ==
           G431_FLASH_OK;
}

/* A double word that was torn may not be readable at all: the non-maskable interrupt says so. */
const boot_flash_t boot_port_flash = {.counter_bytes = COUNTER_BYTES,
                                      .slot_bytes = SLOT_BYTES,
                                      .staged = false,
                                      .erase = erase,
                                      .program = program,
                                      .read = stm32_boot_read};

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
    stm32_boot_line_start();
}

bool boot_port_forgive(void)
{
    return g431_flash_forgive(controller);
}
