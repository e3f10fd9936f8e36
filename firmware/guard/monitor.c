#include "monitor.h"

#include "debounce.h"

/* Current into earth rises until something gives: no longer than a sample may be disturbed. */
#define MONITOR_EARTH_PERIODS 3u
#define MONITOR_EARTH_PU      0.3f /* of the trip: what no gain or offset of a sensor amounts to */
#define MONITOR_PERIODS_MAX   1000000u

bool monitor_init(const monitor_config_t *cfg)
{
    return positivef(cfg->i_trip_A) && nonnegativef(cfg->u_dc_min_V) &&
           (cfg->u_dc_min_V < cfg->u_dc_max_V) && is_finite(cfg->u_dc_max_V) &&
           positivef(cfg->omega_max_rad_s) && (cfg->plausibility_periods > 0u) &&
           (cfg->plausibility_periods <= MONITOR_PERIODS_MAX);
}

/* |x| <= limit; a NaN trips and does not pass. Compared as bits, without the sign: half the
 * instructions, as in every period nothing else is done with these numbers. */
static inline bool within(float x, float limit)
{
    return (float_bits(x) << 1) <= (float_bits(limit) << 1);
}

static inline bool currents_within(uvw_t i_A, float limit_A)
{
    return within(i_A.u, limit_A) && within(i_A.v, limit_A) && within(i_A.w, limit_A);
}

static uint32_t limit_faults(const monitor_config_t *cfg, const monitor_in_t *in)
{
    const bool current = currents_within(in->meas->i_A, cfg->i_trip_A);
    const bool below_max = in->meas->u_dc_V <= cfg->u_dc_max_V;
    const bool above_min = in->meas->u_dc_V >= cfg->u_dc_min_V;
    const bool speed = within(in->omega_e_hat_rad_s, cfg->omega_max_rad_s);

    if (current && below_max && above_min && speed) {
        return 0u;
    }
    return (current ? 0u : FAULT_OVER_CURRENT) | (below_max ? 0u : FAULT_DC_OVER_VOLTAGE) |
           (above_min ? 0u : FAULT_DC_UNDER_VOLTAGE) | (speed ? 0u : FAULT_OVER_SPEED);
}

/* One disturbed sample is no broken sensor: a flag is a fault when it lasts. */
COLD static uint32_t debounced_faults(const monitor_config_t *cfg, monitor_state_t *st,
                                      const measured_t *meas)
{
    const uint32_t flags = meas->flags;
    const uint32_t limit = cfg->plausibility_periods;
    const bool range = (flags & (MEASUREMENT_SATURATED | MEASUREMENT_OUT_OF_RANGE)) != 0u;
    const bool sum = (flags & MEASUREMENT_CURRENT_SUM) != 0u;
    const float sum_A = meas->i_A.u + meas->i_A.v + meas->i_A.w;
    st->adc_periods = debounce_count(st->adc_periods, range, limit);
    st->sum_periods = debounce_count(st->sum_periods, sum, limit);
    st->earth_periods = debounce_count(
        st->earth_periods, !within(sum_A, MONITOR_EARTH_PU * cfg->i_trip_A), MONITOR_EARTH_PERIODS);
    return (debounce_elapsed(st->adc_periods, limit) ? FAULT_ADC_RANGE : 0u) |
           (debounce_elapsed(st->sum_periods, limit) ? FAULT_CURRENT_SUM : 0u) |
           (debounce_elapsed(st->earth_periods, MONITOR_EARTH_PERIODS) ? FAULT_EARTH_FAULT : 0u);
}

uint32_t monitor_step(const monitor_config_t *cfg, monitor_state_t *st, const monitor_in_t *in)
{
    const uint32_t flags = in->meas->flags;
    uint32_t faults = limit_faults(cfg, in);

    if (!is_finite(in->state_sum)) {
        faults |= FAULT_NON_FINITE;
    }
    /* Nothing odd now nor before: nothing to count. */
    if ((flags | st->adc_periods | st->sum_periods | st->earth_periods) != 0u) {
        faults |= debounced_faults(cfg, st, in->meas);
    }
    return faults;
}
