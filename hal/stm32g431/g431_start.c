#include "g431_start.h"

#include "g431_analog.h"
#include "g431_window.h"
#include "num.h"
#include "stm32_pwm.h"

#define SETTLE_S 1.5e-6f /* ringing and the amplifier, behind the dead time */
#define HOLD_S   1.8e-6f /* from the crest until both ranks are held: g431_adc.h */

COLD bool g431_start_measurement(const g431_part_t *part, const g431_board_t *board,
                                 const g431_adcs_t *adcs, const g431_timing_t *timing,
                                 g431_shunts_t *shunts)
{
    const float clock_Hz = (float)timing->clock_Hz;
    if (board->wiring->amplifiers) {
        g431_analog_amplify(part->opamp);
        g431_analog_watch(part->dac, part->comp, board->wiring->trip_code);
    }
    if (!g431_adc_start(adcs, timing->polls)) {
        return false;
    }
    shunts->settle_counts = (uint32_t)((SETTLE_S + timing->dead_time_s) * clock_Hz + 0.5f);
    shunts->hold_counts = (uint32_t)(HOLD_S * clock_Hz + 0.5f);
    /* A level that is off keeps the drive in FAULT by its own check of the sensors' offsets. */
    (void)g431_shunts_measure(shunts, adcs, board->wiring->idle_counts, timing->polls);
    g431_adc_follow_carrier(adcs);
    return true;
}

COLD const char *g431_start_carrier(const g431_part_t *part, const g431_board_t *board,
                                    const g431_timing_t *timing)
{
    const stm32_pwm_params_t pwm = {.clock_Hz = timing->clock_Hz,
                                    .period_s = timing->period_s,
                                    .dead_time_s = timing->dead_time_s,
                                    .break_bits = board->wiring->break_bits,
                                    .lower_inverted = board->wiring->lower_inverted};
    g431_board_break(board, part->tim1, part->syscfg);
    if (!stm32_pwm_start(part->tim1, &pwm)) {
        return "period or dead time beyond the timer";
    }
    if (!g431_window_start(part->wwdg, timing->clock_Hz, timing->period_s)) {
        return "period beyond the window watchdog";
    }
    g431_board_gates_to_timer(board);
    return "";
}
