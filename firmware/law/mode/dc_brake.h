/* Braking and holding by direct current while the reference is zero.
 *
 * Small currents hold a shaft at standstill, large ones brake a turning one. Once started it lasts
 * its minimum time.
 */
#ifndef DC_BRAKE_H
#define DC_BRAKE_H

#include "dc_current.h"
#include "mode.h"

typedef struct {
    float current_A;  /* 0: off */
    float from_rad_s; /* from this speed downward, electrical */
    float least_s;    /* at least so long */
    float slew_A_per_s;
} dc_brake_params_t;

typedef struct {
    float current_A;
    float from_rad_s;
    float step_A;
    uint32_t least_periods;
} dc_brake_config_t;

typedef struct {
    dc_current_state_t current;
    uint32_t periods;
    ab_t i_ref_A;
    float omega_rad_s; /* speed at its beginning: how fast the EMF turns */
} dc_brake_state_t;

/* False for a number that is not finite or of the wrong sign. With current 0 nothing else is
 * checked. */
CHECKED bool dc_brake_init(dc_brake_config_t *cfg, const dc_brake_params_t *params, float period_s);

/* True if it has to act in this period. acting: it already does. */
COLD bool dc_brake_wanted(const dc_brake_config_t *cfg, const dc_brake_state_t *st, bool acting,
                          const mode_in_t *in);

COLD void dc_brake_start(dc_brake_state_t *st, ab_t i_s_A, float omega_e_rad_s);

/* One period: the voltage reference. */
COLD ab_t dc_brake_step(const dc_brake_config_t *cfg, const dc_current_config_t *current,
                        dc_brake_state_t *st, const mode_in_t *in);

/* The speed reference for the end of a stop: the initial speed until the minimum time is over. */
static inline float dc_brake_reference_rad_s(const dc_brake_config_t *cfg,
                                             const dc_brake_state_t *st)
{
    return (st->periods < cfg->least_periods) ? st->omega_rad_s : 0.0f;
}

#endif
