/* Speed error -> torque current: PI on the filtered speed estimate, limited with priority of i_d.
 *
 * i_q limit = min(i_q_max, sqrt(i_max^2 - i_d^2)). Gains from bandwidth and inertia: Kp = J bw/(p^2
 * kr lambda) per electrical rad/s, Ki = ki_factor bw Kp. For a large inertia Kp is bounded by Kp
 * slip/i_q <= SPEED_CONTROL_SLIP_MAX, which also limits the bandwidth. A loop slower than .2 Rr/Lr
 * bears up to twice that bound (2.2 kW with 14 times its inertia is 45 min^-1 off 1.5 s after a
 * load step with the single one); every loop with twice the bound swung at 2 to 4 Hz. Ki is then up
 * to twice ki_factor bw Kp, by 1 + (1 - Kp/Kp unbounded)^2: a loop that is left with little would
 * take seconds to recover from a load step, one that keeps most of it would overshoot. At a limit
 * the integrator holds. Electrical speeds. Internally i_q is the value at nominal flux. The
 * bandwidth may grow with speed: at low speed the estimate is slow, and the loop has to be slower.
 *
 * An error of the speed raises the gain as well: a load step at low speed dips by a fifth less.
 * Near zero frequency noise is too small to raise it, and what is held there stays as it is. More
 * bandwidth for every error lost runs there and swung more (zh envelope). An error raises the gain
 * by half of what speed may at most: with all of it a reversal from 120 min^-1 overshot by 6 %
 * instead of 4. The expected acceleration does not grow with the error.
 *
 * A bounded Kp makes the filter of the speed slower as well. With a leakage less than told the
 * estimate takes each change of the torque current for one of the speed. Without the slower filter
 * the loop swings at 50 to 80 Hz.
 *
 * With weakened flux the same torque slips more, as 1/flux^2, and a gain that slip allows at
 * nominal flux is too large. An estimate with an Rr of .7 of what was told takes .3 of the slip for
 * speed, which the loop answers with more torque: it swung at 2 to 8 Hz, up to the limits of the
 * torque. So at high speed bandwidth and gain fall with the flux f, as f; and as f 1.25 r f_w where
 * that is less: r is slip_room, f_w the flux that weakening leaves. 1.25: with the whole bound load
 * steps at twice the rated speed dip too far. Economy alone makes f smaller than f_w: it acts with
 * little torque, and a load step has to be met at once (zh modes). At low speed they do not fall at
 * all, because there it is steering that lowers the flux. Nor do they with one bandwidth for every
 * speed.
 *
 * The gain falls while the torque swings. With a leakage, a resistance or an inertia other than
 * told the loop may swing with the whole gain. What the proportional part does above 25 Hz is the
 * sign. The loop slows down until that is about SPEED_CONTROL_SWING_PU i_q_max, and at most to .3
 * of the gain that slip allows: a small inertia has less than that anyhow, and keeps it. A load
 * step is too short to count. What a reference that moves may ask for is taken off: the highest Kp
 * times its movement within 6.4 ms, the time constant of the 25 Hz. At the slew limit of a derived
 * drive swings count from a sixth of i_q_max on with ten times the inertia, from half of it with
 * three times. A ramp must not hide a swing altogether: an elastic shaft with eight times the
 * inertia swung at 17 Hz with all torque until SPEED_DEVIATION (run 223 of envelope seed
 * 1983621623).
 *
 * The integrator is the load torque; i_q beyond it accelerates. The estimator may use the change of
 * speed expected from that. At low speed, where the bandwidth is not raised, it gets none: near
 * zero stator frequency an estimate with less of this information holds large motors better.
 */
#ifndef SPEED_CONTROL_H
#define SPEED_CONTROL_H

#include <stdbool.h>

#include "motor.h"
#include "pi.h"

#define SPEED_CONTROL_AT_LIMIT_PU 0.95f

/* Largest slip, over the speed error, of the torque that the error demands. */
#define SPEED_CONTROL_SLIP_MAX 2.0f

/* Bandwidth over Rr/Lr up to which a loop bears more slip, twice that at most. */
#define SPEED_CONTROL_SLOWER_PU 0.2f

/* Over the bound of slip, with weakened flux. */
#define SPEED_CONTROL_WEAKENED 1.25f

/* For the gain, an error of the speed counts as so many times as much speed, and raises it by at
 * most this share of what speed may. */
#define SPEED_CONTROL_ERROR_SPEED 8.0f
#define SPEED_CONTROL_ERROR_MAX   0.5f

/* Filter that the bound of the gain adds, over the 1/bandwidth that is left, where that is much
 * longer than without the bound. */
#define SPEED_CONTROL_FILTER_PU 0.35f

/* A swing counts in units of this share of i_q_max: mean over .6 s of what is faster than 25 Hz:
 * near zero frequency the torque swings more slowly, and there less gain loses the shaft. */
#define SPEED_CONTROL_SWING_PU   0.007f
#define SPEED_CONTROL_SWING_S    0.0064f
#define SPEED_CONTROL_SWING_MEAN (SPEED_CONTROL_SWING_S / 0.6f)
#define SPEED_CONTROL_SWING_MAX  3.0f /* more counts as this much */
#define SPEED_CONTROL_SWING_GAIN 0.3f /* left at least, of the gain that slip allows */

typedef struct {
    float bandwidth_rad_s;
    float ki_factor;
    float J_kg_m2;
    float lambda_Wb; /* flux for which the gains hold */
    float i_q_max_A;
    float i_max_A;              /* |i_s| limit; i_d has priority */
    float filter_s;             /* first-order filter on the speed estimate; 0: none */
    float slew_rad_s2;          /* slew limit of the reference */
    float fast_bandwidth_rad_s; /* above fast_rad_s; 0: the same everywhere */
    float slow_rad_s;           /* |speed| up to which bandwidth_rad_s holds ... */
    float fast_rad_s;           /* ... and from which fast_bandwidth_rad_s does */
    float torque_max_rad_s;     /* torque mode: highest speed, >= 0 ... */
    float torque_min_rad_s;     /* ... and lowest, <= 0 */
    float torque_slew_Nm_per_s;
} speed_control_params_t;

typedef struct {
    pi_config_t pi;
    float i_q_max_A;
    float i_q_max2_A2;
    float i_max2_A2;
    float filter_gain; /* T/(T + filter_s) */
    float slew_step_rad_s;
    float gain_extra_per_rad_s; /* bandwidth over that of slow speed: 1 + this (|w| - slow) ... */
    float gain_extra_max;       /* ... up to 1 + this */
    float weakening; /* gain_extra falls by so much of itself as the gain falls from 1 to 0 */
    float slip_room; /* the gain that slip allows at nominal flux over Kp, >= 1 */
    float slow_rad_s;
    float swing_share;       /* of the new value, per schedule */
    float swing_per_A;       /* 0: not looked at */
    float asked_A_per_rad_s; /* what a reference that moves so far in a schedule asks for at most */
    float lost_max;          /* of the gain, to a swing */
    float A_per_Nm;          /* torque to current at nominal flux */
    float step_rad_s_per_A;  /* change of the speed in one period per ampere that accelerates, and
                                per gain_extra: all of it where that has its greatest value */
    float torque_step_A;
    float torque_max_rad_s;
    float torque_min_rad_s;
} speed_control_config_t;

typedef struct {
    pi_state_t pi;
    float gain_extra;          /* bandwidth at this speed over that of slow speed: 1 + this, > -1 */
    float gain_change;         /* the same with an error of speed and what a swing leaves of it */
    float ref_before_rad_s;    /* a schedule ago */
    float lost;                /* of the gain, to a swing: 0 to lost_max */
    float expected_step_rad_s; /* what that current does to the speed until the next period */
    float omega_filtered_rad_s;
    float omega_ref_rad_s; /* after the slew limit */
    float slow_A;          /* low-passed i_q less the integrator */
    float i_q_A;           /* allowed last, at nominal flux: where torque mode begins */
    float low_A;           /* what is allowed, at nominal flux */
    float high_A;
} speed_control_state_t;

/* Limits of the torque current beyond the configured ones, low <= high. */
typedef struct {
    float low_A;
    float high_A;
} torque_window_t;

/* Requests and limits; need not be updated every period. */
typedef struct {
    float omega_ref_rad_s;
    float i_d_ref_A;   /* has priority in the current limit */
    float flux_pu;     /* flux reference over the one the gains are meant for, > 0 */
    float inv_flux_pu; /* 1 over that: a division the caller makes seldom */
    float torque_ref_Nm;
    bool torque;                   /* torque mode, not speed mode */
    const torque_window_t *window; /* NULL: none */
} speed_control_in_t;

/* False, and *cfg untouched, for a number that is not finite, of the wrong sign, or zero where it
 * divides or limits. */
CHECKED bool speed_control_init(speed_control_config_t *cfg, const speed_control_params_t *params,
                                const motor_model_t *motor, float period_s);

/* Bandwidth at the present speed, its error, swing and flux: once per schedule of 16 periods. Over
 * nominal, and > 0: flux_pu, the flux reference, and weakened_pu, what the voltage limit leaves. */
COLD void speed_control_schedule(const speed_control_config_t *cfg, speed_control_state_t *st,
                                 float flux_pu, float weakened_pu);

/* i_q reference in A. In torque mode that is the slew-limited i_q of the torque. The speed
 * controller takes over where the speed would pass a limit, whatever drives it. The speed reference
 * follows the speed, so that speed mode continues from it. A reference or estimate that is not
 * finite leaves the last one in force. */
float speed_control_step(const speed_control_config_t *cfg, speed_control_state_t *st,
                         const speed_control_in_t *in, float omega_hat_rad_s);

/* Sets the limits of the torque current from now on. */
COLD void speed_control_limit(const speed_control_config_t *cfg, speed_control_state_t *st,
                              const speed_control_in_t *in);

/* True when i_q is at its limits, or nearly. */
static inline bool speed_control_at_limit(const speed_control_state_t *st)
{
    return (st->i_q_A >= SPEED_CONTROL_AT_LIMIT_PU * st->high_A) ||
           (st->i_q_A <= SPEED_CONTROL_AT_LIMIT_PU * st->low_A);
}

/* With one bandwidth for every speed nothing is expected. */
static inline bool speed_control_expects(const speed_control_config_t *cfg)
{
    return float_bits(cfg->step_rad_s_per_A) != 0u;
}

/* Change of speed in a period with the torque current i_q_A (at nominal flux). The flowing current
 * may be less than the reference, for example at the voltage limit. */
static inline float speed_control_expected_rad_s(const speed_control_config_t *cfg,
                                                 const speed_control_state_t *st, float i_q_A)
{
    return cfg->step_rad_s_per_A * maxf(st->gain_extra, 0.0f) * (i_q_A - st->pi.x);
}

/* Another module sets the torque current i_q_A (at nominal flux): integrator and reference follow,
 * so that the controller takes over from there. */
static inline void speed_control_track(speed_control_state_t *st, float i_q_A)
{
    st->pi.x = i_q_A;
    st->i_q_A = i_q_A;
    st->expected_step_rad_s = 0.0f;
    st->omega_ref_rad_s = st->omega_filtered_rad_s;
}

/* Another mode sets the speed: the reference follows it. */
static inline void speed_control_follow(speed_control_state_t *st, float omega_ref_rad_s)
{
    st->omega_ref_rad_s = omega_ref_rad_s;
}

/* No torque while the shaft turns at omega_hat: the controller starts from there. */
static inline void speed_control_wait(speed_control_state_t *st, float omega_hat_rad_s)
{
    st->pi.x = 0.0f;
    st->expected_step_rad_s = 0.0f;
    st->omega_ref_rad_s = omega_hat_rad_s;
    st->omega_filtered_rad_s = omega_hat_rad_s;
}

/* Starts with a torque current at nominal flux, a reference and a speed. */
static inline void speed_control_seed(const speed_control_config_t *cfg, speed_control_state_t *st,
                                      float i_q_A, float omega_ref_rad_s, float omega_hat_rad_s)
{
    st->pi.x = limitf(i_q_A, cfg->i_q_max_A);
    st->i_q_A = st->pi.x;
    st->expected_step_rad_s = 0.0f;
    st->omega_ref_rad_s = omega_ref_rad_s;
    st->omega_filtered_rad_s = omega_hat_rad_s;
}

#endif
