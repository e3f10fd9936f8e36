/* Clock tree: 8 MHz crystal -> PLL -> 168 MHz, APB1 42 MHz, APB2 84 MHz (their timers twice that).
 *
 * Every wait for a ready bit has a limit. Without the crystal the PLL runs from the internal
 * oscillator, without the PLL the core stays on that (16 MHz). Only the crystal is exact enough for
 * a drive, because dead time, period and speed scale with it. Any other result means "stay off".
 */
#ifndef STM32_CLOCK_H
#define STM32_CLOCK_H

#include <stdint.h>

#include "stm32_registers.h"

typedef enum {
    STM32_CLOCK_CRYSTAL = 0,      /* 168 MHz as intended; crystal failure raises the NMI */
    STM32_CLOCK_INTERNAL_PLL = 1, /* 168 MHz +-1 %: only to report the reason */
    STM32_CLOCK_INTERNAL = 2      /* 16 MHz */
} stm32_clock_t;

/* Polls of a ready bit before giving up, on the target: about 50 ms at 16 MHz. */
#define STM32_CLOCK_POLLS 100000u

stm32_clock_t stm32_clock_start(stm32_rcc_t *rcc, stm32_flash_t *flash, stm32_pwr_t *pwr,
                                uint32_t polls);

/* After the crystal has failed: the internal oscillator with the dividers of the PLL. */
#define STM32_CLOCK_APB1_WITHOUT_CRYSTAL_HZ 4000000u

/* Of the core, and of the bus of USART3 and TIM5. */
uint32_t stm32_clock_core_Hz(stm32_clock_t clock);
uint32_t stm32_clock_apb1_Hz(stm32_clock_t clock);

#endif
