/* Temperature of heat sink or motor from a resistor, with derating, trip, and open or short wire.
 *
 *   NTC     1/T = 1/T25 + ln(R/R25)/beta
 *   KTY84   R = 1000 ohm (1 + 6.12e-3 d + 1.1e-5 d^2), d = T - 100 degC
 *   PT1000  R = 1000 ohm (1 + 3.9083e-3 T - 5.775e-7 T^2), IEC 60751
 * The sensor is the lower part of a divider. The median of the last three words counts, through a
 * low-pass filter of 20 ms: one bad word neither trips nor resets. A temperature outside -40 to
 * 250 degC is a wire that is open or shorted; the last good one stays. It trips above trip_degC and
 * has to fall by 10 K.
 */
#ifndef TEMPERATURE_H
#define TEMPERATURE_H

#include <stdbool.h>
#include <stdint.h>

#include "num.h"

#define TEMPERATURE_LOW_DEGC     (-40.0f)
#define TEMPERATURE_HIGH_DEGC    250.0f
#define TEMPERATURE_HYSTERESIS_K 10.0f
#define TEMPERATURE_FILTER_S     20e-3f
#define TEMPERATURE_SHARE_MIN    0.5f /* of the torque current, at the trip */

typedef enum {
    TEMPERATURE_OFF = 0,
    TEMPERATURE_NTC = 1,
    TEMPERATURE_KTY84 = 2,
    TEMPERATURE_PT1000 = 3
} temperature_kind_t;

typedef struct {
    uint32_t kind; /* temperature_kind_t */
    float pullup_ohm;
    float ntc_ohm; /* at 25 degC */
    float ntc_beta_K;
    float derate_degC;
    float trip_degC;
    uint32_t lost_steps; /* at least 1 */
} temperature_config_t;

typedef struct {
    uint16_t before[2]; /* the words before this one */
    uint32_t words;     /* of them, at most 2 */
    bool known;         /* degC has been measured */
    float degC;         /* filtered */
    bool hot;
    bool shorted; /* what was wrong last was a short circuit; else an open one */
    uint32_t wrong;
} temperature_state_t;

/* False for a kind that does not exist or a number outside its range; nothing else is looked at
 * when it is off. */
CHECKED bool temperature_init(const temperature_config_t *cfg);

/* NaN: no resistance that the sensor can have. */
float temperature_degC(const temperature_config_t *cfg, float ohm);

/* True: the sensor is lost. */
bool temperature_step(const temperature_config_t *cfg, temperature_state_t *st, uint16_t counts,
                      uint32_t steps);

/* Of the torque current: 1 up to derate_degC, falling to TEMPERATURE_SHARE_MIN at trip_degC. */
float temperature_share_pu(const temperature_config_t *cfg, const temperature_state_t *st);

#endif
