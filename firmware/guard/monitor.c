#include "monitor.h"

#include "debounce.h"

/* Current into earth rises until something gives: no longer than a sample may be disturbed. */
#define MONITOR_EARTH_PERIODS 3u
#define MONITOR_EARTH_PU      0.3f /* of the trip: what no gain or offset of a sensor amounts to */
#define MONITOR_PERIODS_MAX   1000000u

bool monitor_init(const monitor_config_t *cfg)
{
    return ALL_POSITIVE(cfg->i_trip_A, cfg->u_dc_max_V, cfg->omega_max_rad_s) &&
           nonnegativef(cfg->u_dc_min_V) && (cfg->u_dc_min_V < cfg->u_dc_max_V) &&
           (cfg->plausibility_periods > 0u) && (cfg->plausibility_periods <= MONITOR_PERIODS_MAX);
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

/* Some limit is passed: which. */
static uint32_t limit_faults(const monitor_config_t *cfg, const measured_t *meas,
                             float omega_e_hat_rad_s)
{
    const bool current = currents_within(meas->i_A, cfg->i_trip_A);
    const bool below_max = meas->u_dc_V <= cfg->u_dc_max_V;
    const bool above_min = meas->u_dc_V >= cfg->u_dc_min_V;
    const bool speed = within(omega_e_hat_rad_s, cfg->omega_max_rad_s);
    return (current ? 0u : FAULT_OVER_CURRENT) | (below_max ? 0u : FAULT_DC_OVER_VOLTAGE) |
           (above_min ? 0u : FAULT_DC_UNDER_VOLTAGE) | (speed ? 0u : FAULT_OVER_SPEED);
}

/* The usual case; a link that is no number, or that only looks negative, is not in it. */
static inline bool all_within(const monitor_config_t *cfg, const monitor_in_t *in)
{
    const uint32_t u_dc = float_bits(in->meas->u_dc_V);
    return currents_within(in->meas->i_A, cfg->i_trip_A) && (u_dc <= float_bits(cfg->u_dc_max_V)) &&
           (u_dc >= float_bits(cfg->u_dc_min_V)) &&
           within(in->omega_e_hat_rad_s, cfg->omega_max_rad_s);
}

/* Nothing odd now nor before: nothing to count. */
static inline bool quiet(const monitor_state_t *st, const measured_t *meas)
{
    return (meas->flags | st->adc_periods | st->sum_periods | st->earth_periods) == 0u;
}

/* One disturbed sample is no broken sensor: a flag is a fault when it lasts. */
static uint32_t debounced_faults(const monitor_config_t *cfg, monitor_state_t *st,
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

/* Not the usual case. Numbers one by one: `in` would be written to memory every period. */
COLD static uint32_t odd_faults(const monitor_config_t *cfg, monitor_state_t *st,
                                const measured_t *meas, float omega_e_hat_rad_s, float state_sum)
{
    return limit_faults(cfg, meas, omega_e_hat_rad_s) |
           (is_finite(state_sum) ? 0u : FAULT_NON_FINITE) |
           (quiet(st, meas) ? 0u : debounced_faults(cfg, st, meas));
}

uint32_t monitor_step(const monitor_config_t *cfg, monitor_state_t *st, const monitor_in_t *in)
{
    if (quiet(st, in->meas) && all_within(cfg, in) && is_finite(in->state_sum)) {
        return 0u;
    }
    return odd_faults(cfg, st, in->meas, in->omega_e_hat_rad_s, in->state_sum);
}
