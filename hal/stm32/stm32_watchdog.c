#include "stm32_watchdog.h"

#define KEY_START    0xCCCCu
#define KEY_ACCESS   0x5555u
#define DIVIDE_BY_32 3u /* 32 kHz / 32 */

bool stm32_watchdog_start(stm32_iwdg_t *iwdg, uint32_t time_ms)
{
    if ((time_ms == 0u) || (time_ms > STM32_WATCHDOG_MAX_MS)) {
        return false;
    }
    iwdg->KR = KEY_START;
    iwdg->KR = KEY_ACCESS;
    iwdg->PR = DIVIDE_BY_32;
    iwdg->RLR = time_ms - 1u;
    for (uint32_t n = 0u; n < STM32_WATCHDOG_POLLS; n++) {
        if ((iwdg->SR & (IWDG_SR_PVU | IWDG_SR_RVU)) == 0u) {
            stm32_watchdog_serve(iwdg);
            return true;
        }
    }
    return false;
}
