/* Speed of a shaft that may already turn, before the drive is oriented: either direction, with or
 * without residual flux.
 *
 * The search first runs without current: residual flux shows the speed, and nothing brakes the
 * shaft. Only without residual flux does it use direct current. While the stator current is
 * constant (dc_current), the rate of the rotor flux follows one mode, e' = (-tau + j w) e, e = kr
 * lambda'. It makes no difference whether the flux is residual or builds up from the current.
 *
 * One-lag regression of e over a window gives w = arg(cov(e(t), e(t + lag)))/lag. The mean is
 * removed, because the errors of Rs and of the legs' voltage are constant.
 */
#ifndef FLYING_START_H
#define FLYING_START_H

#include <stdbool.h>
#include <stdint.h>

#include "frames.h"
#include "motor.h"

/* e is averaged over blocks: the noise of the difference in it then falls with their length. */
#define FLYING_START_BLOCK_PERIODS 4u
#define FLYING_START_LAG_BLOCKS    2u

typedef struct {
    bool enable;
    float current_A;       /* direct current of the search */
    float settle_s;        /* ramp and settling; not evaluated */
    float window_s;        /* evaluated */
    float stand_rad_s;     /* below this the shaft counts as standing: normal premagnetisation */
    float omega_max_rad_s; /* beyond: refused */
} flying_start_params_t;

typedef struct {
    bool enable;
    float current_A;
    float step_A;
    uint32_t settle_periods;
    uint32_t end_periods;
    float residual_V2; /* variance of e above which there is residual flux */
    float stand_rad_s;
    float omega_max_rad_s;
    float per_lag_per_s;
    float per_turn_s; /* middle of the last block to now */
    float inv_kr;
    float tau_per_s;
    float m_tau_ohm;
} flying_start_config_t;

typedef enum {
    FLYING_START_SEARCH = 0,
    FLYING_START_STANDS = 1,
    FLYING_START_CAUGHT = 2,
    FLYING_START_REFUSED = 3 /* no current, or a speed beyond the largest */
} flying_start_phase_t;

typedef struct {
    flying_start_phase_t phase;
    bool current_on;                        /* no residual flux: search with direct current */
    uint32_t periods;                       /* of this search */
    float current_A;                        /* on its ramp */
    ab_t block_V;                           /* sum of the running block */
    ab_t e_V[FLYING_START_LAG_BLOCKS + 1u]; /* block averages, the newest first */
    float rough_rad_s; /* of the last blocks: for the feed-forward of the EMF */
    float count;
    ab_t sum_before_V;
    ab_t sum_V;
    ab_t product_V2;   /* sum of conj(e(t)) e(t + lag) */
    float square_V2;   /* sum of |e(t)|^2 */
    float omega_rad_s; /* found */
    ab_t lambda_Wb;    /* present flux */
} flying_start_state_t;

/* False for a number that is not finite or of the wrong sign, or a window of fewer than four
 * blocks. When not enabled nothing else is checked. */
CHECKED bool flying_start_init(flying_start_config_t *cfg, const flying_start_params_t *params,
                               const motor_model_t *motor, float period_s);

/* One period of the search. e_V: EMF of the ended interval; i_A: current sampled now. */
COLD void flying_start_step(const flying_start_config_t *cfg, flying_start_state_t *st, ab_t e_V,
                            ab_t i_A);

#endif
