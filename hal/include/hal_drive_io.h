/* Interface between a port and the control period: plain values, hardware units in, duties out.
 *
 * The port samples all six channels at the carrier crest and passes them unscaled. The duties it
 * gets back act from the NEXT crest on for one period (timer preload). gates_on = false acts at
 * once. Called only from the control interrupt.
 */
#ifndef HAL_DRIVE_IO_H
#define HAL_DRIVE_IO_H

#include <stdbool.h>
#include <stdint.h>

/* Bits of hal_sample_t.inputs. */
#define HAL_INPUT_BREAK 1u /* hardware has opened the gates: comparator, driver fault */

typedef struct {
    uint16_t i_u_counts;
    uint16_t i_v_counts;
    uint16_t i_w_counts;
    uint16_t u_uv_counts;
    uint16_t u_vw_counts;
    uint16_t u_dc_counts;
    uint16_t late_periods; /* running count of missed crests: a period ended after the next one */
    uint16_t inputs;       /* HAL_INPUT_*; 0 on a board without them */
} hal_sample_t;

typedef struct {
    float duty_u; /* 0..1 of the upper switch, leg order of the inverter */
    float duty_v;
    float duty_w;
    bool gates_on;
    bool brake_on; /* switch of the brake resistor across the dc link */
} hal_output_t;

#endif
