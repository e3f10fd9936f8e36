/* ADC words -> phase currents, line voltages, dc link, in SI units.
 *
 * i = (code - mid) * scale - offset, and so on; the port's scaling is data. Plausibility is
 * reported as flags, judged by monitor. Phase order may be swapped (motor wired u-w-v).
 */
#ifndef MEASUREMENT_H
#define MEASUREMENT_H

#include <stdbool.h>
#include <stdint.h>

#include "frames.h"

#define MEASUREMENT_SATURATED    1u /* a word at an end of its range or beyond; dc link: upper end */
#define MEASUREMENT_OUT_OF_RANGE 2u /* a word above 2^bits - 1: it did not come from this ADC */
#define MEASUREMENT_CURRENT_SUM  4u /* i_u + i_v + i_w beyond current_sum_max_A */

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

/* What the sensors show at zero, found with the gates off (drive_state). */
typedef struct {
    uvw_t offset_A;
    ab_t offset_V;
} measurement_state_t;

typedef struct {
    uint16_t i_u_counts;
    uint16_t i_v_counts;
    uint16_t i_w_counts;
    uint16_t u_uv_counts;
    uint16_t u_vw_counts;
    uint16_t u_dc_counts;
} measurement_in_t;

typedef struct {
    uvw_t i_raw_A; /* before offset removal, motor phase order: input of the offset averaging */
    uvw_t i_A;
    ab_t i_s_A;
    ab_t u_raw_V;  /* before offset removal */
    ab_t u_line_V; /* stationary-frame voltage from the filtered line-voltage sensors */
    float u_dc_V;
    uint32_t flags;
} measurement_out_t;

/* False unless 8..16 bits, full scales of 1e-3..1e6 and a positive current sum limit. */
CHECKED bool measurement_init(measurement_config_t *cfg, const measurement_params_t *params);

void measurement_step(const measurement_config_t *cfg, const measurement_state_t *st,
                      const measurement_in_t *in, measurement_out_t *out);

#endif
