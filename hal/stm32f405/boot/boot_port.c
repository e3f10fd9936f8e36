/* The boot loader on the STM32F405: USART3, two slots of a sector each. */
#include "boot_port.h"

#include "stm32_board.h"
#include "stm32_boot.h"
#include "stm32_flash.h"
#include "stm32_gpio.h"
#include "stm32_map.h"

#define COUNTER_BYTES 0x4000u
#define SLOT_BYTES    0x20000u

static stm32_rcc_t *const rcc = (stm32_rcc_t *)STM32_RCC_BASE;
static stm32_flash_t *const controller = (stm32_flash_t *)STM32_FLASH_BASE;
static const stm32_board_t board = {(stm32_rcc_t *)STM32_RCC_BASE, (stm32_gpio_t *)STM32_GPIOA_BASE,
                                    (stm32_gpio_t *)STM32_GPIOB_BASE,
                                    (stm32_gpio_t *)STM32_GPIOC_BASE};

const stm32_boot_t stm32_boot = {.usart = (stm32_usart_t *)STM32_USART3_BASE,
                                 .counter_at = 0x08008000u,
                                 .run_at = 0x08060000u,
                                 .stage_at = 0x08080000u};

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
        const uint32_t at = stm32_boot_address(area, offset) + 4u * k;
        if (stm32_flash_program(controller, at, stm32_boot_cell(at), words[k], STM32_FLASH_POLLS) !=
            STM32_FLASH_OK) {
            return false;
        }
    }
    return true;
}

const boot_flash_t boot_port_flash = {.counter_bytes = COUNTER_BYTES,
                                      .slot_bytes = SLOT_BYTES,
                                      .staged = true,
                                      .erase = erase,
                                      .program = program,
                                      .read = stm32_boot_read};

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
    stm32_boot_line_start();
}

bool boot_port_forgive(void)
{
    return false;
}
