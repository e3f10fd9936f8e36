/* What has to run before the first control interrupt, in this order: measurement, then carrier. */
#ifndef G431_START_H
#define G431_START_H

#include "g431_board.h"
#include "g431_shunts.h"

/* The part's blocks that are set up once. */
typedef struct {
    stm32_opamp_t *opamp;
    stm32_dac_t *dac;
    stm32_comp_t *comp;
    stm32_syscfg_t *syscfg;
    stm32_tim_t *tim1;
    stm32_wwdg_t *wwdg;
} g431_part_t;

typedef struct {
    uint32_t clock_Hz;
    float period_s;
    float dead_time_s;
    uint32_t polls;
} g431_timing_t;

/* Amplifiers, comparators, converters; the shunts' words without current. False when a converter
 * does not get ready. */
bool g431_start_measurement(const g431_part_t *part, const g431_board_t *board,
                            const g431_adcs_t *adcs, const g431_timing_t *timing,
                            g431_shunts_t *shunts);

/* TIM1, the window watchdog, and the gates' pins to TIM1. An empty text, or what is wrong: then the
 * pins keep the gates off. */
const char *g431_start_carrier(const g431_part_t *part, const g431_board_t *board,
                               const g431_timing_t *timing);

#endif
