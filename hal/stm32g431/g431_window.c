#include "g431_window.h"

#include "num.h"

#define TOP        0x7Fu
#define SLOWEST    7u /* divides by 128 */
#define COUNTS_MIN 4.0f

COLD bool g431_window_start(stm32_wwdg_t *wwdg, uint32_t bus_Hz, float period_s)
{
    const float counts = period_s * (float)bus_Hz / (float)G431_WINDOW_TICKS;
    if (!((counts >= COUNTS_MIN) && (counts <= 0.5f * (float)G431_WINDOW_COUNTS))) {
        return false;
    }
    wwdg->CFR = TOP - (uint32_t)(0.75f * counts);
    g431_window_serve(wwdg);
    return true;
}

COLD uint32_t g431_window_open(stm32_wwdg_t *wwdg)
{
    const uint32_t window = wwdg->CFR;
    wwdg->CFR = (SLOWEST << WWDG_CFR_WDGTB_Pos) | TOP; /* open first: served at any time */
    if ((wwdg->CR & WWDG_CR_WDGA) != 0u) {
        g431_window_serve(wwdg);
    }
    return window;
}

COLD void g431_window_close(stm32_wwdg_t *wwdg, uint32_t window)
{
    if ((wwdg->CR & WWDG_CR_WDGA) != 0u) {
        g431_window_serve(wwdg);
    }
    wwdg->CFR = window;
}
