/* Stator resistance while running: Rs' = k e1_d w_s i_q/(i_q^2 + i_0^2), inside a window.
 *
 * With Rs_hat off by dRs, and the speed adapted, e1 along the flux is about -c dRs i_q/w_s (c: some
 * 6 rad/s per ohm on Table 1's machine with its designed gains; L = 0 has another sign in
 * regeneration), so that the error dies as e^{-k c t} whatever the speed and load. The usual law,
 * Re(conj(i_s_hat) e1), loses its sign in regeneration and its size on the way there. Below the
 * torque current i_0 nothing moves: there an M or a leakage that is off makes more of e1 than Rs
 * does (tracked at no load, Rs ran 8 % high, and crossings of zero frequency were lost). At zero
 * frequency it fades out. Frozen outside a band of stator frequency and for a while after anything
 * changed but for a slow ramp of the reference; never outside a band around the resistance measured
 * at the start.
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
    float low_pu; /* band of Rs over the start's */
    float high_pu;
    float quiet_s;              /* frozen this long after a disturbance */
    float speed_err_rad_s;      /* a speed error above this is a disturbance ... */
    float slew_rad_s2;          /* ... and a reference that moves faster; a slow crossing is none */
    float dwell_gain_ohm_per_s; /* k_0: while dwelling, rs_tracking_dwell */
} rs_tracking_params_t;

typedef struct {
    float gain_T_ohm_s_per_rad; /* k T */
    float i_0_A2;
    float min_rad_s;
    float max_rad_s;
    float low_pu;
    float high_pu;
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
    bool changing;     /* the flux is on the move */
} rs_tracking_in_t;

/* False for a number that is not finite or of the wrong sign, or bands the wrong way round; nothing
 * else is looked at with the gain 0. */
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

/* At zero stator frequency instead of the above: Rs' = k_0 Re(conj(i (tau - j w)) e1)/(|tau - j w|
 * |i|^2). There u = Rs i, and an Rs that is off by dRs leaves e1 = dRs i (tau - j w)/(sigma Ls D),
 * D = det(A + L C1) at s = 0, real with the designed gains: the projection is that error alone.
 */
void rs_tracking_dwell(const rs_tracking_config_t *cfg, rs_tracking_state_t *st,
                       const rs_tracking_dwell_in_t *in);

#endif
