/* Clock tree: crystal -> PLL -> 170 MHz (boost mode), the same for both buses and their timers.
 *
 * Every wait for a ready bit has a limit. Without the crystal the PLL runs from the internal
 * oscillator, without the PLL the core stays on that (16 MHz). Only the crystal is exact enough for
 * a drive, because dead time, period and speed scale with it. Any other result means "stay off".
 */
#ifndef G431_CLOCK_H
#define G431_CLOCK_H

#include <stdint.h>

#include "stm32_registers.h"

typedef enum {
    G431_CLOCK_CRYSTAL = 0,      /* 170 MHz as intended; crystal failure raises the NMI */
    G431_CLOCK_INTERNAL_PLL = 1, /* 170 MHz +-1 %: only to report the reason */
    G431_CLOCK_INTERNAL = 2      /* 16 MHz */
} g431_clock_t;

/* Polls of a ready bit before giving up, on the target: about 50 ms at 16 MHz. */
#define G431_CLOCK_POLLS 100000u

/* Of the core and both buses after the crystal has failed: the internal oscillator. */
#define G431_CLOCK_WITHOUT_CRYSTAL_HZ 16000000u

/* crystal_MHz: 8 or 24, a multiple of 4. */
g431_clock_t g431_clock_start(stm32_rcc_t *rcc, stm32_flash_t *flash, stm32_pwr_t *pwr,
                              uint32_t crystal_MHz, uint32_t polls);

/* Of the core, both buses and all timers. */
uint32_t g431_clock_Hz(g431_clock_t clock);

#endif
