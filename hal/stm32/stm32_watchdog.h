/* IWDG: resets the part unless served; once started it cannot be stopped. It has its own clock (32
 * kHz nominal, 17..47 kHz), so the time is between 2/3 and 2 times the requested one.
 */
#ifndef STM32_WATCHDOG_H
#define STM32_WATCHDOG_H

#include <stdbool.h>

#include "stm32_registers.h"

#define STM32_WATCHDOG_MAX_MS 4096u /* one count is a millisecond */

/* Polls of "register update done", five cycles of the slow clock: about 100 us. */
#define STM32_WATCHDOG_POLLS 100000u

/* Also changes the time of a running one. False for a time out of range, or when the registers do
 * not accept it; it may then run with another time. */
bool stm32_watchdog_start(stm32_iwdg_t *iwdg, uint32_t time_ms);

static inline void stm32_watchdog_serve(stm32_iwdg_t *iwdg)
{
    iwdg->KR = 0xAAAAu;
}

#endif
