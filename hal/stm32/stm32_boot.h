/* What the boot loaders of these parts share: the serial port, 16 MHz as after reset, and flash
 * that is read at its address. A part's boot/boot_port.c adds its pins and its flash controller.
 */
#ifndef STM32_BOOT_H
#define STM32_BOOT_H

#include "boot_port.h"
#include "stm32_usart.h"

#define STM32_BOOT_CLOCK_HZ 16000000u /* internal, no PLL, buses undivided */

typedef struct {
    stm32_usart_t *usart;
    uint32_t counter_at;
    uint32_t run_at;
    uint32_t stage_at; /* the same on a part with one slot */
} stm32_boot_t;

/* The part's. */
extern const stm32_boot_t stm32_boot;

/* Behind its clock and its pins. */
void stm32_boot_line_start(void);

uint32_t stm32_boot_address(boot_area_t area, uint32_t offset);

volatile uint32_t *stm32_boot_cell(uint32_t address);

/* Operation of boot_flash_t. */
uint32_t stm32_boot_read(void *context, boot_area_t area, uint32_t offset);

#endif
