/* ADC words -> phase currents, line voltages, dc link, in SI units.
 *
 * i = (code - mid) * scale - offset, and so on; the scaling of the port is data. What the offsets
 * have moved since is taken out of the vector alone: the phases are as calibrated. Plausibility is
 * reported as flags; the guard judges them. Phases v and w may be swapped (motor wired u-w-v).
 */
#ifndef MEASUREMENT_H
#define MEASUREMENT_H

#include <stdbool.h>
#include <stdint.h>

#include "hal_drive_io.h"
#include "measured.h"

typedef struct {
    uint32_t adc_bits;
    float current_full_scale_A;      /* code 0 .. 2^n spans -fs .. +fs */
    float line_voltage_full_scale_V; /* likewise */
    float dc_link_full_scale_V;      /* code 0 .. 2^n spans 0 .. fs */
    float current_sum_max_A;
    bool swap_vw;
} measurement_params_t;

typedef struct {
    float A_per_count;
    float V_line_per_count;
    float V_dc_per_count;
    float mid_counts;
    uint32_t max_counts;
    float current_sum_max_A;
    bool swap_vw;
} measurement_config_t;

/* Of the sensors: offsets, measured with the gates off (sequence), and what is tracked. */
typedef struct {
    uvw_t offset_A;
    ab_t offset_V;
    ab_t moved_A;          /* of offset_A, since then (offset_tracking.h) */
    unbalance_t unbalance; /* of the gains (unbalance_tracking.h) */
} measurement_state_t;

/* ADC words from the port; other members of the sample are not read. */
typedef hal_sample_t measurement_in_t;

/* False unless 8..16 bits, full scales of 1e-3..1e6 and a positive current sum limit. */
CHECKED bool measurement_init(measurement_config_t *cfg, const measurement_params_t *params);

/* Currents before offset removal, in motor phase order: input of the offset averaging. */
static inline uvw_t measurement_raw_A(const measurement_state_t *st, uvw_t i_A)
{
    return (uvw_t){i_A.u + st->offset_A.u, i_A.v + st->offset_A.v, i_A.w + st->offset_A.w};
}

/* Sets the sensor offsets, measured with the gates off: at power-up and after a fault, which may
 * have spoiled what was tracked. That begins again. */
static inline void measurement_set_offsets(measurement_state_t *st, uvw_t offset_A, ab_t offset_V)
{
    st->offset_A = offset_A;
    st->offset_V = offset_V;
    st->moved_A = (ab_t){0.0f, 0.0f};
    st->unbalance = (unbalance_t){{0.0f, 0.0f}, {0.0f, 0.0f}};
}

void measurement_step(const measurement_config_t *cfg, const measurement_state_t *st,
                      const measurement_in_t *in, measured_t *out);

#endif
