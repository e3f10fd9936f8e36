/* Tracking of the stator resistance: Rs' = k e1_d w_s i_q/(i_q^2 + i_0^2), inside a window.
 *
 * With Rs_hat off by dRs and the speed adapted, e1 along the flux is about -c dRs i_q/w_s. On Table
 * 1's machine with its designed gains c is some 6 rad/s per ohm; L = 0 has another sign in
 * regeneration. The error therefore decays as e^{-k c t}, whatever the speed and load. The usual
 * law, Re(conj(i_s_hat) e1), changes its sign in regeneration and gets small before.
 *
 * Near zero frequency a field that generates is lost with an Rs too low, one that drives with an Rs
 * too high. So below a frequency Rs comes back to the start's, which is 2 % high on purpose, while
 * the field generates under load, in .1 s (tracking takes a second). Above it Rs stays as tracked:
 * steering takes the field through zero, and beyond it drives. Without steering Rs does not come
 * back at all: the field may stay on either side.
 *
 * Rs is frozen below the torque current i_0: an error of M or of the leakage affects e1 more than
 * Rs does there. Tracked at no load, Rs ran 8 % high, and crossings of zero frequency were lost. At
 * zero frequency the gain fades out. Rs is also frozen outside a band of stator frequency, and for
 * a while after any change except a slow ramp of the reference. It never leaves a band around the
 * resistance measured at the start.
 */
#ifndef RS_TRACKING_H
#define RS_TRACKING_H

#include <stdbool.h>
#include <stdint.h>

#include "frames.h"

typedef struct {
    float gain_ohm_per_rad; /* k; 0: off */
    float i_0_A;
    float min_rad_s; /* band of |w_s| */
    float max_rad_s;
    float back_rad_s; /* below this |w_s| Rs comes back while the field generates; 0: never */
    float low_pu;     /* band of Rs over the start's */
    float high_pu;
    float quiet_s;              /* frozen this long after a disturbance */
    float speed_err_rad_s;      /* a larger speed error is a disturbance ... */
    float slew_rad_s2;          /* ... and so is a faster reference; a slow crossing is not */
    float dwell_gain_ohm_per_s; /* k_0: while dwelling, rs_tracking_dwell */
} rs_tracking_params_t;

typedef struct {
    float gain_T_ohm_s_per_rad; /* k T */
    float i_0_A2;
    float min_rad_s;
    float max_rad_s;
    float back_rad_s;
    float down_pu; /* ends of the band, less 1 */
    float up_pu;
    float speed_err_rad_s;
    float moved_rad_s; /* by the reference in a period */
    uint32_t quiet_periods;
    float dwell_gain_T_ohm; /* k_0 T */
} rs_tracking_config_t;

typedef struct {
    float delta_ohm;  /* Rs in use minus the start's */
    uint32_t periods; /* since the last disturbance, up to quiet_periods */
} rs_tracking_state_t;

typedef struct {
    float Rs_start_ohm;
    float e1_d_A; /* along the estimated flux */
    float i_q_A;
    float omega_s_hat_rad_s;
    float speed_err_rad_s;
    float moved_rad_s; /* the reference, since the last period */
    bool changing;     /* the flux is changing */
} rs_tracking_in_t;

/* False for a number that is not finite or of the wrong sign, or bands in the wrong order. With
 * gain 0 nothing else is checked. */
CHECKED bool rs_tracking_init(rs_tracking_config_t *cfg, const rs_tracking_params_t *params,
                              float period_s);

static inline bool rs_tracking_on(const rs_tracking_config_t *cfg)
{
    return cfg->gain_T_ohm_s_per_rad > 0.0f;
}

void rs_tracking_step(const rs_tracking_config_t *cfg, rs_tracking_state_t *st,
                      const rs_tracking_in_t *in);

typedef struct {
    float Rs_start_ohm;
    float tau_per_s;
    float omega_e_hat_rad_s;
    ab_t i_s_A;
    ab_t e1_A;
} rs_tracking_dwell_in_t;

/* Replaces the law above at zero stator frequency: Rs' = k_0 Re(conj(i (tau - j w)) e1)/(|tau - j
 * w| |i|^2). There u = Rs i, and an error dRs leaves e1 = dRs i (tau - j w)/(sigma Ls D), D = det(A
 * + L C1) at s = 0, real with the designed gains: the projection is that error alone. */
void rs_tracking_dwell(const rs_tracking_config_t *cfg, rs_tracking_state_t *st,
                       const rs_tracking_dwell_in_t *in);

#endif
