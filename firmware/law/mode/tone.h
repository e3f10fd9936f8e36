/* Impedance at one frequency, from a voltage and a current, unaffected by other frequencies.
 *
 * Sums of u and i times exp(-j k theta) over whole turns; Z = U / I. The voltage is the mean over
 * the interval that ended, the current the mean of its two ends. For a constant voltage behind an
 * inductance that gives Z = R + j (2/T) tan(theta/2) L, exactly. A constant part of either cancels,
 * such as the loss in dead time while no phase current changes its sign.
 */
#ifndef TONE_H
#define TONE_H

#include <stdbool.h>
#include <stdint.h>

#include "frames.h"

typedef struct {
    uint32_t turn_periods;  /* of one turn; theta = 2 pi over this */
    uint32_t quiet_periods; /* the first turns are not summed: the current settles */
    uint32_t periods;       /* both together */
    ab_t turn;              /* exp(j theta) */
    float omega_rad_s;      /* (2/T) tan(theta/2) */
} tone_config_t;

typedef struct {
    uint32_t periods;
    uint32_t in_turn;
    ab_t unit; /* exp(j k theta) */
    ab_t i_A;  /* sums */
    ab_t u_V;
} tone_state_t;

/* At least 8 periods per turn; whole turns, `quiet` of them before the `turns` that count. False
 * for a frequency that is not positive or too high, or a tone longer than a million periods. */
CHECKED bool tone_init(tone_config_t *cfg, float frequency_Hz, uint32_t quiet, uint32_t turns,
                       float period_s);

/* True when all turns are summed. The waveform of the reference is st->unit.alpha. */
bool tone_step(const tone_config_t *cfg, tone_state_t *st, float i_A, float u_V);

/* U / I; zero when there was no current. */
ab_t tone_impedance_ohm(const tone_state_t *st);

#endif
