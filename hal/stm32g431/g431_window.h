/* WWDG: resets the part when the control interrupt stops, and when it comes too often.
 *
 * Its clock is the bus's (170 MHz / 4096), not that of the independent watchdog, so a carrier of
 * twice the rate shows. Each control interrupt serves it: not before three quarters of a period
 * since the last time, and within 64 counts (1.5 ms). Once started it cannot be stopped. An
 * operation of the flash stalls the core for up to 25 ms: meanwhile its clock is divided by 128,
 * 197 ms, and any time is allowed.
 */
#ifndef G431_WINDOW_H
#define G431_WINDOW_H

#include <stdbool.h>

#include "stm32_registers.h"

#define G431_WINDOW_COUNTS 64u   /* from one service to the reset */
#define G431_WINDOW_TICKS  4096u /* clocks of the bus in one count */

/* False, and nothing started, for a period of less than four counts or more than its half. */
bool g431_window_start(stm32_wwdg_t *wwdg, uint32_t bus_Hz, float period_s);

/* The control interrupt's; not after one that was late, the next comes early. */
static inline void g431_window_serve(stm32_wwdg_t *wwdg)
{
    wwdg->CR = WWDG_CR_WDGA | WWDG_CR_T_Msk;
}

/* Slow and open at any time; returns what g431_window_close takes. */
uint32_t g431_window_open(stm32_wwdg_t *wwdg);
void g431_window_close(stm32_wwdg_t *wwdg, uint32_t window);

#endif
