/* The boot loader on the STM32F405: 16 MHz as after reset, USART3, two slots of a sector each. */
#include "boot_port.h"

#include "stm32_board.h"
#include "stm32_flash.h"
#include "stm32_gpio.h"
#include "stm32_map.h"
#include "stm32_usart.h"

#define CLOCK_HZ      16000000u /* internal, no PLL, buses undivided */
#define BAUD          115200u
#define COUNTER_AT    0x08008000u
#define COUNTER_BYTES 0x4000u
#define SLOT_BYTES    0x20000u
#define RUN_AT        0x08060000u

static stm32_rcc_t *const rcc = (stm32_rcc_t *)STM32_RCC_BASE;
static stm32_usart_t *const usart = (stm32_usart_t *)STM32_USART3_BASE;
static stm32_flash_t *const controller = (stm32_flash_t *)STM32_FLASH_BASE;
static const stm32_board_t board = {(stm32_rcc_t *)STM32_RCC_BASE, (stm32_gpio_t *)STM32_GPIOA_BASE,
                                    (stm32_gpio_t *)STM32_GPIOB_BASE,
                                    (stm32_gpio_t *)STM32_GPIOC_BASE};

static uint32_t address(boot_area_t area, uint32_t offset)
{
    const uint32_t second = (area == BOOT_STAGE) ? SLOT_BYTES : 0u;
    return ((area == BOOT_COUNTER) ? COUNTER_AT : (RUN_AT + second)) + offset;
}

static volatile uint32_t *cell(uint32_t at)
{
    return (volatile uint32_t *)(uintptr_t)at;
}

static bool erase(void *context, boot_area_t slot)
{
    (void)context;
    const uint32_t sector = (slot == BOOT_RUN) ? STM32_FLASH_SECTOR_A : STM32_FLASH_SECTOR_B;
    return (slot != BOOT_COUNTER) &&
           (stm32_flash_erase(controller, sector, STM32_FLASH_POLLS) == STM32_FLASH_OK);
}

static bool program(void *context, boot_area_t area, uint32_t offset, const uint32_t *words)
{
    (void)context;
    for (uint32_t k = 0u; k < 2u; k++) {
        const uint32_t at = address(area, offset) + 4u * k;
        if (stm32_flash_program(controller, at, cell(at), words[k], STM32_FLASH_POLLS) !=
            STM32_FLASH_OK) {
            return false;
        }
    }
    return true;
}

static uint32_t read(void *context, boot_area_t area, uint32_t offset)
{
    (void)context;
    return *cell(address(area, offset));
}

const boot_flash_t boot_port_flash = {.counter_bytes = COUNTER_BYTES,
                                      .slot_bytes = SLOT_BYTES,
                                      .staged = true,
                                      .erase = erase,
                                      .program = program,
                                      .read = read};

void boot_port_gates_off(void)
{
    stm32_board_gates_low(&board);
}

void boot_port_start(void)
{
    rcc->APB1ENR |= RCC_APB1ENR_USART3EN;
    (void)rcc->APB1ENR; /* a device answers some clocks after it got one */
    stm32_gpio_configure(board.port_b, 10u, STM32_GPIO_ALTERNATE, STM32_GPIO_FLOATING, 7u);
    stm32_gpio_configure(board.port_b, 11u, STM32_GPIO_ALTERNATE, STM32_GPIO_PULL_UP, 7u);
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
    return false;
}

uint32_t boot_port_ms_clocks(void)
{
    return CLOCK_HZ / 1000u;
}

uint32_t boot_port_run_address(void)
{
    return RUN_AT;
}
