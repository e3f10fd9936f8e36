#include "stm32_boot.h"

#define BAUD 115200u

void stm32_boot_line_start(void)
{
    (void)stm32_usart_start(stm32_boot.usart, STM32_BOOT_CLOCK_HZ, BAUD);
}

uint32_t stm32_boot_address(boot_area_t area, uint32_t offset)
{
    if (area == BOOT_COUNTER) {
        return stm32_boot.counter_at + offset;
    }
    return ((area == BOOT_RUN) ? stm32_boot.run_at : stm32_boot.stage_at) + offset;
}

volatile uint32_t *stm32_boot_cell(uint32_t address)
{
    return (volatile uint32_t *)(uintptr_t)address;
}

uint32_t stm32_boot_read(void *context, boot_area_t area, uint32_t offset)
{
    (void)context;
    return *stm32_boot_cell(stm32_boot_address(area, offset));
}

void boot_port_stop(void)
{
    stm32_boot.usart->CR1 = 0u;
}

bool boot_port_receive(uint8_t *byte)
{
    return stm32_usart_receive(stm32_boot.usart, byte);
}

bool boot_port_put(uint8_t byte)
{
    return stm32_usart_put(stm32_boot.usart, byte);
}

uint32_t boot_port_ms_clocks(void)
{
    return STM32_BOOT_CLOCK_HZ / 1000u;
}

uint32_t boot_port_run_address(void)
{
    return stm32_boot.run_at;
}
