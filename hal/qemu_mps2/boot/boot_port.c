/* The boot loader on the emulated board: code RAM in place of flash, kept as long as the emulator
 * runs; two slots as on the STM32F405. */
#include "boot_port.h"

#include "mps2_registers.h"

#define BAUD_DIVIDER  217u /* 115200; the emulator does not wait */
#define COUNTER_AT    0x00410000u
#define COUNTER_BYTES 4096u
#define RUN_AT        0x00420000u
#define STAGE_AT      0x00440000u
#define SLOT_BYTES    0x00020000u

static volatile uint32_t *cell(boot_area_t area, uint32_t offset)
{
    const uint32_t start = (area == BOOT_COUNTER) ? COUNTER_AT
                           : (area == BOOT_RUN)   ? RUN_AT
                                                  : STAGE_AT;
    return (volatile uint32_t *)(uintptr_t)(start + offset);
}

static void clear(boot_area_t area, uint32_t bytes)
{
    for (uint32_t at = 0u; at < bytes; at += 4u) {
        *cell(area, at) = BOOT_ERASED;
    }
}

static bool erase(void *context, boot_area_t slot)
{
    (void)context;
    clear(slot, SLOT_BYTES);
    return true;
}

/* As flash does it: bits only go from 1 to 0. */
static bool program(void *context, boot_area_t area, uint32_t offset, const uint32_t *words)
{
    (void)context;
    *cell(area, offset) &= words[0];
    *cell(area, offset + 4u) &= words[1];
    return true;
}

static uint32_t read(void *context, boot_area_t area, uint32_t offset)
{
    (void)context;
    return *cell(area, offset);
}

const boot_flash_t boot_port_flash = {.counter_bytes = COUNTER_BYTES,
                                      .slot_bytes = SLOT_BYTES,
                                      .staged = true,
                                      .erase = erase,
                                      .program = program,
                                      .read = read};

void boot_port_gates_off(void)
{
    MPS2_LEDS = 0u;
}

/* Memory begins with zeros, flash is delivered blank. */
void boot_port_start(void)
{
    if ((*cell(BOOT_COUNTER, 0u) | *cell(BOOT_COUNTER, 4u)) == 0u) {
        clear(BOOT_COUNTER, COUNTER_BYTES);
    }
    MPS2_UART_BAUDDIV = BAUD_DIVIDER;
    MPS2_UART_CTRL = MPS2_UART_TXEN | MPS2_UART_RXEN;
}

void boot_port_stop(void)
{
    MPS2_UART_CTRL = 0u;
}

bool boot_port_receive(uint8_t *byte)
{
    if ((MPS2_UART_STATE & MPS2_UART_RXFULL) == 0u) {
        return false;
    }
    *byte = (uint8_t)MPS2_UART_DATA;
    return true;
}

bool boot_port_put(uint8_t byte)
{
    if ((MPS2_UART_STATE & MPS2_UART_TXFULL) != 0u) {
        return false;
    }
    MPS2_UART_DATA = byte;
    return true;
}

bool boot_port_forgive(void)
{
    return false;
}

uint32_t boot_port_ms_clocks(void)
{
    return MPS2_CLOCK_HZ / 1000u;
}

uint32_t boot_port_run_address(void)
{
    return RUN_AT;
}
