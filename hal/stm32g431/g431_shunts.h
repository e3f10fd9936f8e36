/* Words of three low-side shunts -> words of hal_drive_io.h.
 *
 * A shunt carries its leg's current only while the lower switch conducts. The sample is taken at
 * the crest, in the middle of that time. The half before the crest has the duties written two
 * interrupts ago, the half behind it those of the last interrupt. A leg is read when its lower
 * switch conducts for settle_counts before the crest (dead time, ringing, the amplifier) and for
 * hold_counts behind it (until the converter holds). Of a leg that cannot be read the current is
 * what the other two leave: their sum is zero. With two such legs the one with the shorter time is
 * calculated and the other read all the same, so keep the modulation below that: min_pulse_s.
 *
 * Current into the motor lowers the amplifier's output. Its level without current is measured at
 * start, as the resistors that set it are off by more than a sensor may be.
 */
#ifndef G431_SHUNTS_H
#define G431_SHUNTS_H

#include <stdbool.h>
#include <stdint.h>

#include "g431_adc.h"
#include "hal_drive_io.h"

#define G431_SHUNTS_MID      2048u
#define G431_SHUNTS_MAX      4095u
#define G431_SHUNTS_AVERAGED 64u  /* conversions of the level without current */
#define G431_SHUNTS_OFF_MAX  300u /* counts that it may be off: more is a fault of the board */

typedef struct {
    uint32_t settle_counts; /* of TIM1 */
    uint32_t hold_counts;
    uint16_t idle[3];   /* word without current */
    uint32_t before[3]; /* compare value until the crest, of u, v, w */
    uint32_t behind[3]; /* and from then on */
} g431_shunts_t;

/* Gates off, before the carrier runs. False when a level is not where the board has it (nominal),
 * within G431_SHUNTS_OFF_MAX; nominal is kept then, and the drive's own check of offsets tells. */
bool g431_shunts_measure(g431_shunts_t *shunts, const g431_adcs_t *adcs, uint16_t nominal,
                         uint32_t polls);

/* In the control interrupt: words of this crest, late_periods and inputs stay the caller's. */
void g431_shunts_words(const g431_shunts_t *shunts, uint32_t arr, const g431_words_t *words,
                       hal_sample_t *sample);

/* Behind it: what was written to the timer acts from the next crest on. */
void g431_shunts_written(g431_shunts_t *shunts, const stm32_tim_t *tim);

#endif
