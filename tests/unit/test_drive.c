/* The chain as a whole: order, timing and frames against a double-precision chain written anew. */
#include "drive.h"

#include <complex.h>
#include <float.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "drive_fixture.h"
#include "trig.h"
#include "unity.h"

/* ---- The same chain in double-precision complex arithmetic, run mode ---- */

typedef struct {
    cplx i_hat, lam, e1, l2, u_acting, u_pending;
    double w, ws, x, wf, wref, x_speed, x_d, x_q;
    double duty[3];
    double id_ref, iq_ref;
    cplx i_dq, u_s;
    double rs_start, rs_track, torque, below, dead_pu;
    double rate, moved_from, bandwidth;
    double i_q_asked, slow_A, lost, ref_before;
    double flux_pu, i_q_max, target;
    cplx lagging, lag_step, ahead;
    int quiet, slot;
    bool steering, moving, dead_found;
} ref_t;

#define SLOW ((int)SLOT_COUNT)

static double limit(double x, double bound)
{
    return fmax(-bound, fmin(bound, x));
}

static cplx clarke(double u, double v, double w)
{
    return sqrt(2.0 / 3.0) * (u + v * cexp(I * THIRD_TURN) + w * cexp(-I * THIRD_TURN));
}

static void ref_estimate(ref_t *s, const drive_params_t *p, const measurement_in_t *in, cplx *i_s)
{
    const double i_lsb = 25.0 / 8192.0;
    const double u_lsb = (double)p->measurement.line_voltage_full_scale_V / 8192.0;
    *i_s = clarke(i_lsb * (in->i_u_counts - 8192), i_lsb * (in->i_v_counts - 8192),
                  i_lsb * (in->i_w_counts - 8192));
    const double uv = u_lsb * (in->u_uv_counts - 8192);
    const double vw = u_lsb * (in->u_vw_counts - 8192);
    const double d = (double)p->acting.filter_comp_s / (double)p->period_s;
    s->lag_step =
        d / (2.0 + d) * s->lag_step + 2.0 / ((1.0 + d) * (2.0 + d)) * (s->u_acting - s->lagging);
    s->lagging += s->lag_step;
    const cplx late = s->u_acting - s->lagging;
    /* Phase voltages of a floating star with zero sum. */
    cplx u = clarke((2.0 * uv + vw) / 3.0, (vw - uv) / 3.0, -(uv + 2.0 * vw) / 3.0) + late;
    if (p->acting.source == ACTING_VOLTAGE_DUTY) {
        u = s->u_acting;
    }
    s->u_acting = s->u_pending;
    s->u_s = u;

    const double Rs = (double)p->motor.Rs_ohm, Rr = (double)p->motor.Rr_ohm;
    const double Ls = (double)p->motor.Ls_H, Lr = (double)p->motor.Lr_H, M = (double)p->motor.M_H;
    const double sLs = Ls - M * M / Lr, tau = Rr / Lr, eps = sLs * Lr / M;
    cplx l1 = 0.0, l2 = 0.0;
    if (estimator_list.observer_gain_enable != 0u) {
        const int k = (int)fmin(3.0, floor(fabs(s->w) / 5.0 + 0.5));
        const double sign = (s->w < 0.0) ? -1.0 : 1.0;
        l1 = (double)test_gain[k].l1_re_per_s + I * sign * (double)test_gain[k].l1_im_per_s;
        l2 = (double)test_gain[k].l2_re_ohm + I * sign * (double)test_gain[k].l2_im_ohm;
    }
    s->l2 = l2;
    const double T = (double)p->period_s;
    const cplx g = tau - I * s->w;
    u -= (s->rs_start + s->rs_track) * *i_s;
    const cplx di =
        -(Rs + M * M * Rr / (Lr * Lr)) / sLs * s->i_hat + g / eps * s->lam + u / sLs + l1 * s->e1;
    const cplx dl = M * tau * s->i_hat - g * s->lam + l2 * s->e1;
    s->i_hat += T * di;
    s->lam += T * dl;
    s->e1 = s->i_hat - *i_s;

    const double z = cimag(conj(s->lam) * s->e1);
    const double leak = fmin(1.0, T * (double)estimator_list.eps1 * fabs(z));
    s->x += T * (double)estimator_list.adapt_ki * z - leak * s->x;
    s->w = (double)estimator_list.adapt_kp * z + s->x;
}

/* Flux below nominal and its rate; the torque by rotor flux and current. */
static double ref_steer(ref_t *s, const drive_params_t *p)
{
    const flux_steering_params_t *f = &p->steering;
    const double T = SLOW * (double)p->period_s, pp = (double)p->motor.pole_pairs;
    const double kr = (double)p->motor.M_H / (double)p->motor.Lr_H;
    const double nominal = (double)f->lambda_nominal_Wb, least = (double)f->min_rad_s;
    if (!(least > 0.0)) {
        return 0.0;
    }
    s->torque += T / (T + (double)f->torque_filter_s) *
                 (pp * kr * cabs(s->lam) * cimag(s->i_dq) - s->torque);
    const double torque = fabs(s->torque);
    const double way = (s->torque < 0.0) ? -1.0 : 1.0, asked = way * s->wref;
    const double w = (fabs(asked) > 0.0) ? fmin(asked, way * s->wf + 0.4 * least) : asked;
    const double slip_Wb2 = (double)p->motor.Rr_ohm / pp * torque;
    const double field = w + slip_Wb2 / (nominal * nominal);
    const double share = (s->steering || !(fabs(s->wref) > 0.0)) ? 0.5 : 0.99;
    const double within = s->steering ? (least + (double)f->hysteresis_rad_s) : least;
    double target = nominal;
    if ((torque < share * (double)f->torque_min_Nm) || (w >= least) || (fabs(field) > within)) {
        s->steering = false;
    } else {
        const double needed = least - ((w < 0.0) ? (1.25 * w) : w);
        const double lam =
            fmax(sqrt(slip_Wb2 / needed), torque / (pp * kr * 0.95 * (double)f->i_q_max_A));
        const double low = fmax((double)f->lambda_min_Wb, fmin(nominal, lam));
        s->steering = w + slip_Wb2 / (low * low) >= share * least;
        target = s->steering ? low : nominal;
    }
    const double slew = T * (double)f->slew_Wb_per_s;
    const double follow = fmin(4.0 * T / (T + (double)f->torque_filter_s), 1.0);
    const double wanted = follow * (nominal - target - s->below);
    const double step = limit(wanted, slew);
    s->moving = fabs(wanted) >= slew;
    s->below += step;
    return -step / T;
}

/* Tracking of the resistance; moved: the speed reference did. */
static void ref_track(ref_t *s, const drive_params_t *p, double error, double moved)
{
    const rs_tracking_params_t *t = &p->rs_tracking;
    const double start = (double)p->motor.Rs_ohm + s->rs_start, i_q = cimag(s->i_dq);
    const bool fast = fabs(moved) > (double)t->slew_rad_s2 * SLOW * (double)p->period_s;
    if (s->moving || fast || (fabs(error) > (double)t->speed_err_rad_s)) {
        s->quiet = 0;
    } else if (s->quiet < (int)lrint((double)t->quiet_s / (SLOW * (double)p->period_s))) {
        s->quiet++;
    } else if ((fabs(s->ws) >= (double)t->min_rad_s) && (fabs(s->ws) <= (double)t->max_rad_s) &&
               (fabs(i_q) >= (double)t->i_0_A)) {
        const double e1_d = creal(conj(s->lam) * s->e1) / cabs(s->lam);
        s->rs_track += SLOW * (double)p->period_s * (double)t->gain_ohm_per_rad * e1_d * s->ws *
                       i_q / (i_q * i_q + (double)t->i_0_A * (double)t->i_0_A);
        s->rs_track = fmax(start * ((double)t->low_pu - 1.0),
                           fmin(start * ((double)t->high_pu - 1.0), s->rs_track));
    }
}

/* Bandwidth that slip allows, over the one at speed. */
static double ref_fastest(const drive_params_t *p)
{
    const double pp = (double)p->motor.pole_pairs, lambda = (double)p->speed.lambda_Wb;
    const double kr = (double)p->motor.M_H / (double)p->motor.Lr_H;
    const double tau = (double)p->motor.Rr_ohm / (double)p->motor.Lr_H;
    const double slow = (double)p->speed.bandwidth_rad_s;
    const double fast = fmax((double)p->speed.fast_bandwidth_rad_s, slow);
    const double fastest = pp * pp * kr * lambda / (double)p->speed.J_kg_m2 *
                           (double)SPEED_CONTROL_SLIP_MAX * lambda / (tau * (double)p->motor.M_H);
    return fastest / fast;
}

/* What slip leaves of the bandwidth. */
static double ref_bandwidth(const drive_params_t *p, double wanted)
{
    return wanted * fmin(1.0, ref_fastest(p));
}

/* Gain at the bandwidth of low speed. */
static double ref_kp(const drive_params_t *p)
{
    const double pp = (double)p->motor.pole_pairs;
    const double kr = (double)p->motor.M_H / (double)p->motor.Lr_H;
    return (double)p->speed.J_kg_m2 * ref_bandwidth(p, (double)p->speed.bandwidth_rad_s) /
           (pp * pp * kr * (double)p->speed.lambda_Wb);
}

/* The integrator of a loop that slip leaves less than all of it. */
static double ref_quicker(const drive_params_t *p)
{
    const double lost = 1.0 - ref_bandwidth(p, 1.0);
    return 1.0 + lost * lost;
}

/* Slower where slip leaves less than all of it. */
static double ref_speed_filter_s(const drive_params_t *p)
{
    const double slow = (double)p->speed.bandwidth_rad_s;
    const double fast = fmax((double)p->speed.fast_bandwidth_rad_s, slow);
    const double left = ref_bandwidth(p, 1.0);
    return (double)p->speed.filter_s +
           (double)SPEED_CONTROL_FILTER_PU / fast * (1.0 / left - 1.0) * (1.0 - left);
}

static double ref_speed_pi(ref_t *s, const drive_params_t *p)
{
    const double T = (double)p->period_s, pp = (double)p->motor.pole_pairs;
    const double kr = (double)p->motor.M_H / (double)p->motor.Lr_H;
    const double step = limit(s->target - s->wref, T * (double)p->speed.slew_rad_s2);
    s->wref += step;
    s->wf += T / (T + ref_speed_filter_s(p)) * (s->w - s->wf);
    const double wanted = (s->bandwidth > 0.0) ? s->bandwidth : (double)p->speed.bandwidth_rad_s;
    const double bandwidth = ref_bandwidth(p, wanted);
    const double kp =
        (double)p->speed.J_kg_m2 * bandwidth / (pp * pp * kr * (double)p->speed.lambda_Wb);
    const double ki = (double)p->speed.ki_factor * ref_quicker(p) * bandwidth * kp;
    const double e = s->wref - s->wf, asked = kp * e + s->x_speed;
    const double most = s->flux_pu * s->i_q_max, got = limit(asked, most);
    if (e * (got - asked) >= 0.0) {
        s->x_speed = limit(s->x_speed + T * ki * e, most);
    }
    s->i_q_asked = got;
    return got / s->flux_pu;
}

/* Every fourth period: flux current, limit of the torque current, target. */
static void ref_plan(ref_t *s, const drive_params_t *p, double w_ref)
{
    const double M = (double)p->motor.M_H, tau = (double)p->motor.Rr_ohm / (double)p->motor.Lr_H;
    s->target = w_ref;
    s->id_ref = (double)p->flux.i_d_A - (s->below - s->rate / tau) / M;
    s->id_ref = fmax(0.0, fmin((double)p->flux.i_d_max_A, s->id_ref));
    const double room = sqrt((double)(p->speed.i_max_A * p->speed.i_max_A) - s->id_ref * s->id_ref);
    s->i_q_max = fmin((double)p->speed.i_q_max_A, room);
    s->flux_pu = 1.0 - s->below / (M * (double)p->flux.i_d_A);
}

/* Bandwidth with that share of the way to the one at speed; weakened flux takes some away. */
static double ref_on_the_way(const ref_t *s, const drive_params_t *p, double share)
{
    return (1.0 - share) * (double)p->speed.bandwidth_rad_s +
           share * s->flux_pu * (double)p->speed.fast_bandwidth_rad_s;
}

/* An error counts as eight times as much speed, up to half the way. */
static double ref_scheduled(const ref_t *s, const drive_params_t *p)
{
    const double slow = (double)p->speed.slow_rad_s, fast = (double)p->speed.fast_rad_s;
    const double speed = fabs(s->wf), error = 8.0 * fabs(s->wref - s->wf);
    const double share = fmin(1.0, fmax(0.0, (speed - slow) / (fast - slow)));
    const double with_error = fmin(0.5, fmax(0.0, (speed + error - slow) / (fast - slow)));
    return fmax(ref_on_the_way(s, p, share), ref_on_the_way(s, p, with_error));
}

/* Slow work of this slot: the schedule in the 8th, steering in the 10th, tracking in the 13th. */
static void ref_slow_work(ref_t *s, const drive_params_t *p)
{
    if (s->slot == 10) {
        s->rate = ref_steer(s, p);
    } else if ((s->slot == 13) && (p->rs_tracking.gain_ohm_per_rad > 0.0f)) {
        ref_track(s, p, s->wref - s->wf, fabs(s->wref - s->moved_from) > 1e-9);
        s->moved_from = s->wref;
    } else if ((s->slot == 8) && (p->speed.fast_bandwidth_rad_s > 0.0f)) {
        const double fast_A = s->i_q_asked - s->x_speed - s->slow_A;
        const double T = SLOW * (double)p->period_s;
        const double limit_A = 0.007 * (double)p->speed.i_q_max_A;
        const double kp =
            ref_kp(p) * (double)p->speed.fast_bandwidth_rad_s / (double)p->speed.bandwidth_rad_s;
        const double asked_A = fabs(s->wref - s->ref_before) * kp * 0.0064 / T;
        const double swing = fmax(0.0, fmin(3.0, (fabs(fast_A) - asked_A) / limit_A));
        s->ref_before = s->wref;
        s->slow_A += T / 0.0064 * fast_A;
        s->lost += T / 0.6 * (0.5 * (swing - 1.0) - s->lost);
        s->lost = fmax(0.0, fmin(fmax(0.0, 1.0 - 0.3 * fmax(1.0, ref_fastest(p))), s->lost));
        s->bandwidth = ref_scheduled(s, p) * (1.0 - s->lost);
    } else {
        /* nothing this time */
    }
}

static cplx ref_modulate(ref_t *s, const drive_params_t *p, cplx u, cplx i, double u_dc)
{
    double ph[3], lost[3];
    phases_of(i, ph);
    const double dU = (double)p->dead_time.fraction *
                      ((double)p->dead_time.dead_time_s / (double)p->period_s * u_dc +
                       (double)p->dead_time.drop_V);
    const double leg = s->dead_found ? (s->dead_pu * u_dc) : dU;
    for (int n = 0; n < 3; n++) {
        lost[n] = leg * limit(ph[n] / (double)p->dead_time.i_threshold_A, 1.0);
    }
    const cplx u_lost = clarke(lost[0], lost[1], lost[2]);
    double v[3];
    phases_of(u + u_lost, v);
    const double hi = fmax(v[0], fmax(v[1], v[2])), lo = fmin(v[0], fmin(v[1], v[2]));
    const double scale = fmin(1.0, u_dc / (hi - lo));
    for (int n = 0; n < 3; n++) {
        s->duty[n] = 0.5 + scale * (v[n] - 0.5 * (hi + lo)) / u_dc;
    }
    return scale * (u + u_lost) - u_lost;
}

static void ref_step(ref_t *s, const drive_params_t *p, const measurement_in_t *in, double w_ref)
{
    s->slot = (s->slot + 1) % SLOW;
    if (s->slot % 4 == 0) { /* by the frequency the period finds */
        s->ahead =
            cexp(I * limit(s->ws * (double)p->period_s * (double)p->delay_comp_periods, 0.785));
    }
    cplx i_s;
    ref_estimate(s, p, in, &i_s);
    const double T = (double)p->period_s, M = (double)p->motor.M_H;
    const double sLs = (double)p->motor.Ls_H - M * M / (double)p->motor.Lr_H;
    const double tau = (double)p->motor.Rr_ohm / (double)p->motor.Lr_H;
    const cplx axis = s->lam / cabs(s->lam);
    const cplx i = i_s * conj(axis);
    s->i_dq = i;
    /* The rate at which the estimate itself turns. */
    s->ws = s->w + cimag((M * tau * s->i_hat + s->l2 * s->e1) / s->lam);
    ref_slow_work(s, p);
    if (s->slot % 4 == 1) {
        ref_plan(s, p, w_ref);
    }
    s->iq_ref = ref_speed_pi(s, p);

    const double kp = (double)p->current.bandwidth_rad_s * sLs;
    const double ki = (double)p->current.ki_factor * (double)p->current.bandwidth_rad_s * kp;
    const cplx e = (s->id_ref + I * s->iq_ref) - i;
    const cplx dec = I * s->ws * sLs * i + I * s->w * M / (double)p->motor.Lr_H * cabs(s->lam);
    const cplx asked = kp * e + s->x_d + I * s->x_q + (double)p->current.decoupling * dec;
    const cplx ahead = s->ahead;
    const double u_dc = (double)p->measurement.dc_link_full_scale_V * in->u_dc_counts / 16384.0;
    const cplx u = ref_modulate(s, p, asked * axis * ahead, i_s * ahead, u_dc);
    s->u_pending = u;
    const cplx back = u * conj(ahead) * conj(axis) - asked;
    s->x_d += T * ki * creal(e) + T * ki / kp * creal(back);
    s->x_q += T * ki * cimag(e) + T * ki / kp * cimag(back);
}

/* Returns the double chain as it ended. rs_start, dead_pu: what a measurement has found; 0: none.
 */
static ref_t compare_found(const drive_params_t *p, double amps, double volts, double u_dc,
                           double w_ref, int steps, bool expect_limited, double rs_start,
                           double dead_pu)
{
    drive_config_t cfg;
    TEST_ASSERT_TRUE(drive_init(&cfg, p, &test_table));
    drive_state_t st = {
        .modes.premagnetise = {.Rs_delta_ohm = (float)rs_start,
                               .leg_loss_pu = (float)dead_pu,
                               .leg_loss_found = dead_pu > 0.0},
        .estimator.observer = {.lambda_r_hat_Wb = {0.3f, 0.2f}, .i_s_hat_A = {3.0f, 1.0f}},
        .estimator.estimate = {.omega_e_rad_s = 11.0f, .omega_s_rad_s = 14.0f},
        .estimator.adaptation = {.x_rad_s = 9.0f}};
    ref_t ref = {.lam = 0.3f + I * (double)0.2f,
                 .i_hat = 3.0 + 1.0 * I,
                 .w = 11.0,
                 .ws = 14.0,
                 .x = 9.0,
                 .ahead = 1.0,
                 .rs_start = rs_start,
                 .dead_pu = dead_pu,
                 .dead_found = dead_pu > 0.0};
    bool limited = false;
    for (int k = 0; k < steps; k++) {
        const measurement_in_t sample = words(p, k, amps, volts, u_dc);
        const drive_in_t in = {.mode = DRIVE_RUN, .omega_e_ref_rad_s = (float)w_ref};
        drive_out_t out;
        drive_step(&cfg, &st, &sample, &in, &out);
        ref_step(&ref, p, &sample, w_ref);
        /* float against double over some tens of steps: a few parts in 1e5 of full scale. */
        TEST_ASSERT_DOUBLE_WITHIN(5e-5, ref.duty[0], (double)out.duty.u);
        TEST_ASSERT_DOUBLE_WITHIN(5e-5, ref.duty[1], (double)out.duty.v);
        TEST_ASSERT_DOUBLE_WITHIN(5e-5, ref.duty[2], (double)out.duty.w);
        TEST_ASSERT_DOUBLE_WITHIN(2e-3, ref.w, (double)st.estimator.estimate.omega_e_rad_s);
        TEST_ASSERT_DOUBLE_WITHIN(2e-3, ref.ws, (double)st.estimator.estimate.omega_s_rad_s);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, ref.iq_ref, (double)out.i_ref_A.q);
        /* A rounding of .2 Wb of flux, 1.5e-8, is a rate of 7e-5 Wb/s: .15 mA; some of them. */
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, ref.id_ref, (double)out.i_ref_A.d);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, ref.rs_track, (double)st.rs_tracking.delta_ohm);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, ref.below, (double)st.modes.vector.steering.reduction_Wb);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, (double)p->motor.Rs_ohm + ref.rs_start + ref.rs_track,
                                  (double)drive_rs_ohm(&cfg, &st));
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, creal(ref.i_dq), (double)out.i_A.d);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, cimag(ref.i_dq), (double)out.i_A.q);
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, creal(ref.lam),
                                  (double)st.estimator.observer.lambda_r_hat_Wb.alpha);
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, cimag(ref.lam),
                                  (double)st.estimator.observer.lambda_r_hat_Wb.beta);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, creal(ref.e1), (double)st.estimator.observer.e1_A.alpha);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, cimag(ref.e1), (double)st.estimator.observer.e1_A.beta);
        TEST_ASSERT_DOUBLE_WITHIN(5e-3, creal(ref.u_s), (double)out.u_s_V.alpha);
        TEST_ASSERT_DOUBLE_WITHIN(5e-3, cimag(ref.u_s), (double)out.u_s_V.beta);
        TEST_ASSERT_EQUAL_UINT32(0u, out.faults);
        const double hi = fmax(ref.duty[0], fmax(ref.duty[1], ref.duty[2]));
        limited = limited || (hi > 0.9999);
    }
    TEST_ASSERT_EQUAL(expect_limited, limited);
    return ref;
}

static void compare_chain(const drive_params_t *p, double amps, double volts, double u_dc,
                          double w_ref, int steps, bool expect_limited)
{
    (void)compare_found(p, amps, volts, u_dc, w_ref, steps, expect_limited, 0.0, 0.0);
}

void setUp(void)
{
}
void tearDown(void)
{
}

static void test_chain_with_sensed_voltage_equals_the_double_chain(void)
{
    for (int n = 0; n < 2; n++) {
        const drive_params_t p = both_machines(n);
        compare_chain(&p, 5.0, 30.0, 540.0, 20.0, 60, false);
        compare_chain(&p, 5.0, 30.0, 540.0, -20.0, 60, false);
    }
}

static void test_chain_with_duty_voltage_equals_the_double_chain(void)
{
    for (int n = 0; n < 2; n++) {
        drive_params_t p = both_machines(n);
        p.acting.source = ACTING_VOLTAGE_DUTY;
        compare_chain(&p, 5.0, 30.0, 540.0, 25.0, 60, false);
    }
}

static void test_chain_without_gain_needs_no_table(void)
{
    drive_params_t p = both_machines(1);
    estimator_list.observer_gain_enable = 0u;
    compare_chain(&p, 4.0, 20.0, 540.0, 15.0, 40, false);
    drive_config_t cfg;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, NULL));
    TEST_ASSERT_NULL(cfg.estimator.table);
}

static void test_chain_at_the_voltage_limit_equals_the_double_chain(void)
{
    for (int n = 0; n < 2; n++) {
        drive_params_t p = both_machines(n);
        p.current.bandwidth_rad_s = 2000.0f;
        compare_chain(&p, 12.0, 60.0, 120.0, 60.0, 30, true);
    }
}

/* Means that go beyond the paper, as they may be set together; the board and machine as before. */
static drive_params_t with_means(int n)
{
    drive_params_t p = both_machines(n);
    p.speed.fast_bandwidth_rad_s = 35.0f;
    p.speed.slow_rad_s = 2.0f;
    p.speed.fast_rad_s = 40.0f;
    p.rs_tracking = (rs_tracking_params_t){.gain_ohm_per_rad = 0.5f,
                                           .i_0_A = 1.5f,
                                           .min_rad_s = 0.5f,
                                           .max_rad_s = 300.0f,
                                           .low_pu = 0.5f,
                                           .high_pu = 1.5f,
                                           .quiet_s = 1e-3f,
                                           .speed_err_rad_s = 1000.0f,
                                           .slew_rad_s2 = 20.0f};
    p.steering = (flux_steering_params_t){.min_rad_s = 9.0f,
                                          .hysteresis_rad_s = 1.0f,
                                          .lambda_nominal_Wb = p.motor.M_H * p.flux.i_d_A,
                                          .lambda_min_Wb = 0.1f * p.motor.M_H * p.flux.i_d_A,
                                          .torque_min_Nm = 0.1f,
                                          .torque_filter_s = 2e-3f,
                                          .slew_Wb_per_s = 40.0f,
                                          .i_q_max_A = 12.0f};
    return p;
}

static void test_chain_with_every_means_equals_the_double_chain(void)
{
    for (int n = 0; n < 2; n++) {
        const drive_params_t p = with_means(n);
        for (int sign = -1; sign <= 1; sign += 2) {
            const ref_t end =
                compare_found(&p, 5.0, 30.0, 540.0, sign * 3.0, 126, false, 0.21, 0.02);
            /* All of them were at work. */
            TEST_ASSERT_TRUE(fabs(end.rs_track) > 1e-4);
            TEST_ASSERT_TRUE(end.below > 0.01);
        }
    }
}

/* Band around the measured resistance; a slow reference and a speed error of 9 rad/s, which is a
 * disturbance or none. */
static void test_tracking_in_the_chain_is_told_start_error_and_moving_reference(void)
{
    for (int n = 0; n < 2; n++) {
        drive_params_t p = with_means(n);
        p.rs_tracking.low_pu = 0.9998f; /* less than a step of tracking */
        p.rs_tracking.high_pu = 1.0002f;
        p.rs_tracking.speed_err_rad_s = 13.0f;
        p.speed.slew_rad_s2 = 150.0f;
        p.steering.min_rad_s = 0.0f; /* or it would be the flux that moves */
        const ref_t end = compare_found(&p, 5.0, 30.0, 540.0, 3.0, 130, false, 0.21, 0.02);
        const double bound_ohm = 2e-4 * ((double)p.motor.Rs_ohm + 0.21);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, bound_ohm, fabs(end.rs_track));
    }
}

static void test_delay_compensation_angle_is_limited(void)
{
    drive_params_t p = both_machines(0);
    p.delay_comp_periods = 4.0f;
    p.acting.filter_comp_s = 0.0f;
    drive_config_t cfg;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    for (int sign = -1; sign <= 1; sign += 2) {
        /* 500 rad/s on top of a slip of thousands: 4 periods would be far more than 45 degrees. */
        drive_state_t st = {.estimator.observer = {.lambda_r_hat_Wb = {0.3f, 0.0f}},
                            .estimator.estimate.omega_e_rad_s = 10.0f};
        st.estimator.adaptation.x_rad_s = (float)sign * 590.0f;
        measurement_in_t sample = words(&p, 0, 0.0, 0.0, 540.0);
        drive_in_t in = {.mode = DRIVE_RUN};
        sample.i_v_counts = (uint16_t)(8192 + sign * 3000);
        sample.i_w_counts = (uint16_t)(8192 - sign * 3000);
        drive_out_t out;
        drive_step(&cfg, &st, &sample, &in, &out);
        TEST_ASSERT_TRUE(fabsf(st.estimator.estimate.omega_s_rad_s) * cfg.voltage.delay_comp_s <
                         1.0f);
        st.estimator.estimate.omega_s_rad_s = (float)sign * 1e5f;
        st.slot = SLOT_QUARTERS - 1u; /* the next period takes the sines */
        drive_step(&cfg, &st, &sample, &in, &out);
        const double ahead = (double)TRIG_SMALL_MAX_RAD;
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, cos(ahead) - 1.0, (double)st.voltage.ahead.alpha);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, sin(ahead) * sign, (double)st.voltage.ahead.beta);
    }
}

/* Levels of four periods, the last two averaged. */
static drive_params_t with_measurement(int n)
{
    drive_params_t p = both_machines(n);
    p.monitor.i_trip_A = 40.0f;    /* 3 A from one sample to the next are no jump then */
    p.acting.filter_comp_s = 0.0f; /* these duties are none that the sensors show */
    p.rs_measurement = (rs_measurement_params_t){.enable = true,
                                                 .level = {{5.0f, 0.0f, 3.0f, 8.0f}},
                                                 .level_s = 800e-6f,
                                                 .average_s = 400e-6f,
                                                 .bias = 1.25f,
                                                 .ratio_max = 2.0f};
    return p;
}

/* The sines are those of the frequency that the period finds, in one slot of four. */
static void test_delay_angles_follow_the_frequency_in_every_fourth_period(void)
{
    const drive_params_t p = both_machines(0);
    drive_config_t cfg;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    drive_state_t st = {.estimator.observer = {.lambda_r_hat_Wb = {0.3f, 0.0f}}};
    const measurement_in_t sample = words(&p, 0, 0.0, 0.0, 540.0);
    const drive_in_t in = {.mode = DRIVE_RUN};
    drive_out_t out;
    for (int k = 0; k < 32; k++) {
        const float omega_s_rad_s = 10.0f * (float)(k + 1);
        acting_voltage_state_t acting = st.acting;
        voltage_state_t voltage = st.voltage;
        if (slot_next(st.slot) % 4u == 0u) {
            acting_voltage_blend(&cfg.acting, &acting, omega_s_rad_s);
            voltage_angle(&cfg.voltage, &voltage, omega_s_rad_s);
        }
        st.estimator.estimate.omega_s_rad_s = omega_s_rad_s;
        drive_step(&cfg, &st, &sample, &in, &out);
        TEST_ASSERT_EQUAL_MEMORY(&acting.duty_share, &st.acting.duty_share, sizeof(float));
        TEST_ASSERT_EQUAL_MEMORY(&voltage.ahead, &st.voltage.ahead, sizeof voltage.ahead);
    }
}

/* In its slot the dwell says what is modulated; while the field stands Rs is found from all of e1,
 * not from what a torque current leaves along the flux. */
static void test_a_standing_field_is_modulated_and_tells_rs(void)
{
    drive_params_t p = both_machines(0);
    p.rs_tracking = (rs_tracking_params_t){.gain_ohm_per_rad = 0.5f,
                                           .i_0_A = 1.5f,
                                           .min_rad_s = 0.5f,
                                           .max_rad_s = 300.0f,
                                           .low_pu = 0.5f,
                                           .high_pu = 1.5f,
                                           .quiet_s = 1e-3f,
                                           .speed_err_rad_s = 1000.0f,
                                           .slew_rad_s2 = 20.0f,
                                           .dwell_gain_ohm_per_s = 0.3f};
    p.dwell = (dwell_params_t){.kind = DWELL_SPEED,
                               .amplitude_pu = 0.2f,
                               .window_rad_s = 1.9f,
                               .wait_s = 0.5f,
                               .filter_s = 0.3f,
                               .fade_s = 0.5f,
                               .settle_s = 4.0f,
                               .slew_rad_s2 = 0.3f,
                               .load_A = 0.3f};
    drive_config_t cfg;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    const measurement_in_t sample = words(&p, 3, 5.0, 30.0, 540.0);
    const drive_in_t in = {.mode = DRIVE_RUN};
    drive_out_t out;
    float Rs_delta_ohm[3]; /* no dwell, a dwell, one that fades out */
    for (int dwelling = 0; dwelling < 3; dwelling++) {
        drive_state_t st = {.estimator.observer = {.lambda_r_hat_Wb = {0.3f, 0.0f}},
                            .dwell = {.standing = dwelling == 1,
                                      .active = dwelling == 1,
                                      .share = (dwelling == 2) ? 0.5f : (float)dwelling}};
        int modulated = 0;
        for (uint32_t k = 0u; k < 2u * SLOT_COUNT; k++) {
            const float before_rad_s = st.modes.vector.modulation.speed_rad_s;
            drive_step(&cfg, &st, &sample, &in, &out);
            const float now_rad_s = st.modes.vector.modulation.speed_rad_s;
            TEST_ASSERT_TRUE((st.slot == SLOT_DWELL) || (now_rad_s == before_rad_s));
            modulated += (st.slot == SLOT_DWELL) && (now_rad_s != before_rad_s);
            TEST_ASSERT_TRUE(now_rad_s == ((dwelling > 0) ? st.dwell.speed_rad_s : 0.0f));
        }
        TEST_ASSERT_TRUE((dwelling == 2) || (modulated == 2 * dwelling));
        Rs_delta_ohm[dwelling] = st.rs_tracking.delta_ohm;
    }
    TEST_ASSERT_TRUE(Rs_delta_ohm[1] != Rs_delta_ohm[0]);
    TEST_ASSERT_TRUE(Rs_delta_ohm[2] != Rs_delta_ohm[0]);
    TEST_ASSERT_TRUE((Rs_delta_ohm[1] != 0.0f) && (Rs_delta_ohm[2] != 0.0f)); /* both find Rs */
}

/* Nothing of the period before is left in the output: the caller need not clear it. */
static void test_every_field_of_the_output_is_written_in_every_mode(void)
{
    const drive_params_t p = both_machines(0);
    const drive_params_t measuring = with_measurement(0);
    const drive_mode_t modes[] = {DRIVE_OFF, DRIVE_PREMAGNETISE, DRIVE_RUN, DRIVE_COMMISSION};
    for (int m = 0; m < 8; m++) {
        drive_config_t cfg;
        TEST_ASSERT_TRUE(drive_init(&cfg, (m < 4) ? &p : &measuring, &test_table));
        const measurement_in_t sample = words(&p, 3, 5.0, 30.0, 540.0);
        const drive_in_t in = {.mode = modes[m % 4]};
        drive_out_t out[2];
        for (int k = 0; k < 2; k++) {
            /* Off: the period that the gates open in, from RUN. */
            drive_state_t st = {.asked = (m % 4 == 0) ? DRIVE_RUN : DRIVE_OFF,
                                .estimator.observer = {.lambda_r_hat_Wb = {0.3f, 0.2f}}};
            memset(&out[k], (k == 0) ? 0x11 : 0xEE, sizeof out[k]);
            drive_step(&cfg, &st, &sample, &in, &out[k]);
        }
        TEST_ASSERT_EQUAL_MEMORY(&out[0], &out[1], offsetof(drive_out_t, premagnetising));
        TEST_ASSERT_EQUAL(out[0].premagnetising, out[1].premagnetising);
    }
}

/* Sample with current and voltage along alpha. */
static measurement_in_t along_alpha(const drive_params_t *p, double amps, double volts)
{
    const double fs = (double)p->measurement.line_voltage_full_scale_V;
    const uint16_t leg = counts(-amps * sqrt(1.0 / 6.0), 25.0);
    return (measurement_in_t){.i_u_counts = counts(amps * sqrt(2.0 / 3.0), 25.0),
                              .i_v_counts = leg,
                              .i_w_counts = leg,
                              .u_uv_counts = counts(volts * sqrt(1.5), fs),
                              .u_vw_counts = 8192u,
                              .u_dc_counts = (uint16_t)lrint(540.0 / 800.0 * 16384.0)};
}

/* The whole measurement, high_A (of 8 A asked) and 5 A for four periods each, Rs 1.2 ohm at the
 * sensors; the last output, and the mean voltage of the duties in the averaged periods of either
 * level. */
static drive_out_t measure(const drive_config_t *cfg, const drive_params_t *p, drive_state_t *st,
                           double high_A, double duty_V[2])
{
    drive_out_t out = {0};
    duty_V[0] = 0.0;
    duty_V[1] = 0.0;
    for (int k = 0; k < 8; k++) {
        const double amps = (k < 4) ? high_A : 5.0;
        const measurement_in_t sample = along_alpha(p, amps, 1.2 * amps + 3.0);
        const drive_in_t in = {.mode = DRIVE_PREMAGNETISE};
        duty_V[k / 4] += ((k % 4) >= 2) ? 0.5 * (double)st->acting.acting_V.alpha : 0.0;
        drive_step(cfg, st, &sample, &in, &out);
        TEST_ASSERT_TRUE(out.premagnetising);
        TEST_ASSERT_FLOAT_WITHIN(0.81f, (k < 4) ? 8.0f : 5.0f, out.i_ref_A.d); /* dither */
        TEST_ASSERT_EQUAL_FLOAT(0.0f, out.i_ref_A.q);
        TEST_ASSERT_EQUAL_FLOAT(0.0f, st->modes.premagnetise.Rs_delta_ohm);
        TEST_ASSERT_EQUAL_UINT32(0u, out.faults);
    }
    const measurement_in_t sample = along_alpha(p, 5.0, 9.0);
    const drive_in_t in = {.mode = DRIVE_PREMAGNETISE};
    drive_step(cfg, st, &sample, &in, &out);
    return out;
}

static void test_the_measured_resistance_is_used_after_both_levels(void)
{
    for (int n = 0; n < 2; n++) {
        const drive_params_t p = with_measurement(n);
        drive_config_t cfg;
        drive_state_t st = {0};
        double duty_V[2];
        TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
        TEST_ASSERT_EQUAL_FLOAT(p.motor.Rs_ohm, drive_rs_ohm(&cfg, &st));
        const drive_out_t out = measure(&cfg, &p, &st, 8.0, duty_V);
        TEST_ASSERT_FALSE(out.premagnetising);
        TEST_ASSERT_EQUAL_UINT32(0u, out.faults);
        TEST_ASSERT_EQUAL_FLOAT(4.0f, out.i_ref_A.d); /* on to the flux */
        /* 1 LSB of .1 V and of 3 mA in the differences of 3.6 V and 3 A. */
        TEST_ASSERT_DOUBLE_WITHIN(0.04, 1.25 * 1.2, (double)drive_rs_ohm(&cfg, &st));
        TEST_ASSERT_FALSE(st.modes.premagnetise.leg_loss_found);
        /* In the next period it has acted in the observer, and nothing is measured any more. */
        const measurement_in_t sample = along_alpha(&p, 5.0, 9.0);
        const drive_in_t in = {.mode = DRIVE_PREMAGNETISE};
        drive_out_t next;
        drive_step(&cfg, &st, &sample, &in, &next);
        TEST_ASSERT_FALSE(next.premagnetising);
        TEST_ASSERT_DOUBLE_WITHIN(0.04, 1.25 * 1.2, (double)drive_rs_ohm(&cfg, &st));
    }
}

static void test_the_legs_loss_is_identified_when_wanted(void)
{
    drive_params_t p = with_measurement(1);
    p.dead_time_identify = true;
    drive_config_t cfg;
    drive_state_t st = {0};
    double duty_V[2];
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    st.voltage.current.d.x = 20.0f; /* what the duties give for 12.6 and 9 V */
    (void)measure(&cfg, &p, &st, 8.0, duty_V);
    TEST_ASSERT_TRUE(st.modes.premagnetise.leg_loss_found);
    const double Rs_ohm = (double)drive_rs_ohm(&cfg, &st) / 1.25;
    const double lost_V = (duty_V[0] - Rs_ohm * 8.0) / sqrt(8.0 / 3.0);
    TEST_ASSERT_TRUE(lost_V > 1.0);
    /* 3 mA of current, .6 V of dc link. */
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * lost_V + 3e-3, lost_V,
                              540.0 * (double)st.modes.premagnetise.leg_loss_pu);
}

/* The voltage along u is reversed with the small current, at once, and with the next level again.
 * That across it stays: it would look like a rotor that turns. */
static void test_the_voltage_is_reversed_with_the_small_current(void)
{
    const drive_params_t p = with_measurement(1);
    drive_config_t cfg;
    drive_state_t st = {0};
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    rs_measurement_config_t *measurement = &cfg.modes.premagnetise.measurement;
    measurement->curve = true;
    measurement->level.A[RS_LEVEL_SMALL] = 0.5f;
    measurement->level_periods = 96u;
    measurement->average_periods = 64u;
    measurement->dither_turns = 1.0f / 32.0f;
    st.modes.premagnetise.measurement.periods = 96u;
    st.voltage.current.d.x = 20.0f;
    st.voltage.current.q.x = 3.0f;
    float side = 1.0f;
    uint32_t reversals = 0u;
    for (int k = 0; k < 120; k++) {
        const measurement_in_t sample = along_alpha(&p, 0.5 * (double)side, 9.0);
        const drive_in_t in = {.mode = DRIVE_PREMAGNETISE};
        drive_out_t out;
        drive_step(&cfg, &st, &sample, &in, &out);
        reversals += (out.i_ref_A.d * side < 0.0f) ? 1u : 0u;
        side = (out.i_ref_A.d < 0.0f) ? -1.0f : 1.0f;
        TEST_ASSERT_EQUAL_FLOAT(1.0f, out.axis.alpha);
        TEST_ASSERT_FLOAT_WITHIN(3.0f, 20.0f * side, st.voltage.current.d.x);
        TEST_ASSERT_FLOAT_WITHIN(0.5f, 3.0f, st.voltage.current.q.x);
        TEST_ASSERT_FALSE(st.modes.premagnetise.measurement.mirror);
    }
    TEST_ASSERT_EQUAL_UINT32(2u, reversals);
}

/* Duty of leg u after a step whose current stays below .1 A in every leg. */
static double duty_u_near_zero(float leg_threshold_A)
{
    drive_params_t p = with_measurement(0);
    drive_config_t cfg;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    drive_state_t st = {.modes.premagnetise = {.leg_loss_pu = 0.02f,
                                               .leg_threshold_A = leg_threshold_A,
                                               .leg_loss_found = true}};
    const measurement_in_t sample = along_alpha(&p, 0.05, 0.0);
    const drive_in_t in = {.mode = DRIVE_RUN};
    drive_out_t out;
    drive_step(&cfg, &st, &sample, &in, &out);
    return (double)out.duty.u;
}

/* The threshold found counts; without one that of the parameters. */
static void test_the_legs_threshold_that_was_found_counts(void)
{
    const double parameter = duty_u_near_zero(0.0f);
    const double told = duty_u_near_zero(0.1f);
    const double wide = duty_u_near_zero(1.0f);
    TEST_ASSERT_TRUE(told > parameter);
    TEST_ASSERT_TRUE(parameter > wide);
}

static void test_the_resistance_is_that_of_the_duties_when_the_observer_uses_them(void)
{
    drive_params_t p = with_measurement(0);
    p.acting.source = ACTING_VOLTAGE_DUTY;
    p.rs_measurement.ratio_max = 10.0f; /* the samples do not answer to the duties */
    drive_config_t cfg;
    drive_state_t st = {0};
    double duty_V[2];
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    const drive_out_t out = measure(&cfg, &p, &st, 7.0, duty_V);
    const double Rs_ohm = (duty_V[0] - duty_V[1]) / 2.0;
    TEST_ASSERT_TRUE(Rs_ohm > 0.1);
    TEST_ASSERT_FALSE(out.premagnetising);
    TEST_ASSERT_DOUBLE_WITHIN(5e-3 * Rs_ohm, 1.25 * Rs_ohm, (double)drive_rs_ohm(&cfg, &st));
}

static void test_a_refused_resistance_is_a_fault_while_it_is_asked_for(void)
{
    drive_params_t p = with_measurement(0);
    p.rs_measurement.ratio_max = 1.1f; /* 1.2 ohm is no .93 */
    drive_config_t cfg;
    drive_state_t st = {0};
    double duty_V[2];
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    drive_out_t out = measure(&cfg, &p, &st, 8.0, duty_V);
    measurement_in_t sample = along_alpha(&p, 5.0, 9.0);
    drive_in_t in = {.mode = DRIVE_PREMAGNETISE};
    for (int k = 0; k < 3; k++) {
        TEST_ASSERT_FALSE(out.premagnetising);
        TEST_ASSERT_EQUAL_UINT32(FAULT_STATOR_RESISTANCE, out.faults);
        TEST_ASSERT_EQUAL_FLOAT(p.motor.Rs_ohm, drive_rs_ohm(&cfg, &st));
        TEST_ASSERT_FALSE(st.modes.premagnetise.leg_loss_found);
        drive_step(&cfg, &st, &sample, &in, &out);
    }
    in.mode = DRIVE_OFF;
    drive_step(&cfg, &st, &sample, &in, &out);
    TEST_ASSERT_EQUAL_UINT32(0u, out.faults);
    TEST_ASSERT_FALSE(out.premagnetising);
    /* The next start measures anew. */
    in.mode = DRIVE_PREMAGNETISE;
    drive_step(&cfg, &st, &sample, &in, &out);
    TEST_ASSERT_TRUE(out.premagnetising);
}

/* What the legs lose is looked for: the compensation must not hide it. */
static void test_dead_time_is_not_compensated_while_the_resistance_is_measured(void)
{
    drive_params_t p = with_measurement(0);
    drive_config_t with, without;
    TEST_ASSERT_TRUE(drive_init(&with, &p, &test_table));
    p.dead_time.fraction = 0.0f;
    TEST_ASSERT_TRUE(drive_init(&without, &p, &test_table));
    drive_state_t a = {0}, b = {0};
    drive_out_t x = {0}, y = {0};
    for (int k = 0; k < 9; k++) {
        const double amps = (k < 4) ? 8.0 : 5.0;
        const measurement_in_t sample = along_alpha(&p, amps, 1.2 * amps);
        const drive_in_t in = {.mode = DRIVE_PREMAGNETISE};
        drive_step(&with, &a, &sample, &in, &x);
        drive_step(&without, &b, &sample, &in, &y);
        TEST_ASSERT_EQUAL((k == 8), memcmp(&x.duty, &y.duty, sizeof x.duty) != 0);
        /* The duties give what is taken to act at the motor, and nothing else. */
        const double given_V = sqrt(2.0 / 3.0) * 540.0 * (double)(y.duty.u - y.duty.v);
        TEST_ASSERT_DOUBLE_WITHIN(0.03, given_V, (double)b.acting.pending_V.alpha);
    }
}

static void test_premagnetise_holds_axis_and_speed_still(void)
{
    const drive_params_t p = both_machines(1);
    drive_config_t cfg;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    drive_state_t st = {
        .estimator.observer = {.lambda_r_hat_Wb = {0.0f, 0.4f}, .e1_A = {2.0f, 0.0f}}};
    const measurement_in_t sample = words(&p, 0, 0.0, 0.0, 540.0);
    const drive_in_t in = {.mode = DRIVE_PREMAGNETISE, .omega_e_ref_rad_s = 50.0f};
    drive_out_t out;
    drive_step(&cfg, &st, &sample, &in, &out);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.estimator.estimate.omega_e_rad_s);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.estimator.estimate.omega_s_rad_s);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, out.i_ref_A.q);
    TEST_ASSERT_EQUAL_FLOAT(4.0f, out.i_ref_A.d);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.modes.vector.speed.omega_ref_rad_s);
    /* Voltage along alpha: leg u up, v and w equal; zero current has no dead-time voltage. */
    const double M = (double)p.motor.M_H;
    const double sLs = (double)p.motor.Ls_H - M * M / (double)p.motor.Lr_H;
    const double u_alpha = 400.0 * sLs * 4.0;
    const double span = u_alpha * sqrt(1.5) / 540.0;
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.5 + 0.5 * span, (double)out.duty.u);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.5 - 0.5 * span, (double)out.duty.v);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.5 - 0.5 * span, (double)out.duty.w);
}

static void test_run_without_flux_keeps_a_finite_slip_and_the_fixed_axis(void)
{
    drive_params_t p = both_machines(0);
    estimator_list.observer_gain_enable = 0u;
    drive_config_t cfg;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, NULL));
    drive_state_t st = {
        .estimator.observer = {.i_s_hat_A = {0.0f, 5.0f}, .lambda_r_hat_Wb = {0.001f, 0.0f}}};
    measurement_in_t sample = words(&p, 0, 0.0, 0.0, 540.0);
    drive_in_t in = {.mode = DRIVE_RUN};
    sample.i_v_counts = 8192u + 1000u;
    sample.i_w_counts = 8192u - 1000u;
    drive_out_t out;
    drive_step(&cfg, &st, &sample, &in, &out);
    const double i_q = sqrt(0.5) * 2000.0 * 25.0 / 8192.0;
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, i_q, (double)out.i_A.q);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.0, (double)out.i_A.d);
    /* The divisor is the least flux, not the millivolt-seconds that are there. */
    const double lambda_min = 0.05 * (double)p.motor.M_H * 4.0;
    const double m_tau = (double)p.motor.M_H * (double)p.motor.Rr_ohm / (double)p.motor.Lr_H;
    const cplx lam = (double)st.estimator.observer.lambda_r_hat_Wb.alpha +
                     I * (double)st.estimator.observer.lambda_r_hat_Wb.beta;
    const cplx i_hat = (double)st.estimator.observer.i_s_hat_A.alpha +
                       I * (double)st.estimator.observer.i_s_hat_A.beta;
    TEST_ASSERT_DOUBLE_WITHIN(
        1e-3, cimag(conj(lam) * m_tau * i_hat) / (lambda_min * lambda_min),
        (double)(st.estimator.estimate.omega_s_rad_s - st.estimator.estimate.omega_e_rad_s));
}

/* i_d has priority: 8 of 10 A leave 6 A for torque, though i_q alone might be 12 A. */
static void test_torque_current_gets_what_i_d_leaves(void)
{
    drive_params_t p = both_machines(0);
    p.flux.i_d_A = 8.0f;
    p.speed.i_max_A = 10.0f;
    drive_config_t cfg;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    drive_state_t st = {.estimator.observer = {.lambda_r_hat_Wb = {0.4f, 0.0f}},
                        .modes.vector.speed = {.omega_ref_rad_s = 200.0f}};
    const measurement_in_t sample = words(&p, 0, 0.0, 0.0, 540.0);
    const drive_in_t in = {.mode = DRIVE_RUN, .omega_e_ref_rad_s = 200.0f};
    drive_out_t out;
    drive_step(&cfg, &st, &sample, &in, &out);
    TEST_ASSERT_EQUAL_FLOAT(8.0f, out.i_ref_A.d);
    TEST_ASSERT_EQUAL_FLOAT(6.0f, out.i_ref_A.q);
}

/* At rest already nothing is touched but the sample and its judgement, until its slot clears all
 * again: what memory lost meanwhile is gone before the next start. */
static void test_at_rest_the_state_is_cleared_in_one_slot_of_sixteen(void)
{
    const drive_params_t p = both_machines(0);
    drive_config_t cfg;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    const measurement_in_t sample = words(&p, 0, 2.0, 30.0, 540.0);
    const drive_in_t in = {.mode = DRIVE_OFF};
    drive_state_t st = {0};
    drive_out_t out = {0};
    for (int k = 0; k < 48; k++) {
        st.estimator.observer.lambda_r_hat_Wb.alpha = 0.4f;
        out.duty.v = 0.75f;
        drive_step(&cfg, &st, &sample, &in, &out);
        const bool rests = st.slot == SLOT_REST;
        TEST_ASSERT_EQUAL_FLOAT(rests ? 0.0f : 0.4f, st.estimator.observer.lambda_r_hat_Wb.alpha);
        TEST_ASSERT_EQUAL_FLOAT(rests ? 0.5f : 0.75f, out.duty.v);
        TEST_ASSERT_EQUAL_UINT32((uint32_t)(k + 1) % SLOT_COUNT, st.slot);
        TEST_ASSERT_DOUBLE_WITHIN(0.1, 540.0, (double)out.meas.u_dc_V);
        TEST_ASSERT_EQUAL_UINT32(0u, out.faults);
    }
}

static void test_off_rests_everything_but_offsets_and_fault_counters(void)
{
    const drive_params_t p = both_machines(0);
    drive_config_t cfg;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    drive_state_t st = {.measurement = {.offset_A = {0.1f, -0.2f, 0.3f}, .offset_V = {2.0f, -3.0f}},
                        .estimator.observer = {.lambda_r_hat_Wb = {0.4f, 0.0f}},
                        .estimator.estimate = {.omega_e_rad_s = 30.0f, .omega_s_rad_s = 31.0f},
                        .modes.premagnetise = {.Rs_delta_ohm = 0.2f, .leg_loss_found = true},
                        .rs_tracking = {.delta_ohm = 0.1f},
                        .modes.vector.steering = {.reduction_Wb = 0.1f},
                        .acting.pending_V = {5.0f, 5.0f},
                        .guard.monitor = {.adc_periods = 3u},
                        .asked = DRIVE_RUN};
    measurement_in_t sample = words(&p, 0, 2.0, 30.0, 540.0);
    drive_in_t in = {.mode = DRIVE_OFF};
    sample.i_u_counts = 0xFFFFu; /* impossible word: the counter goes on counting */
    drive_out_t out;
    drive_step(&cfg, &st, &sample, &in, &out);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, out.duty.u);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, out.duty.v);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, out.duty.w);
    const float at_rest[] = {out.u_s_V.alpha,
                             out.u_s_V.beta,
                             out.i_ref_A.d,
                             out.i_ref_A.q,
                             out.i_A.d,
                             out.i_A.q,
                             st.estimator.gain.l1_re_per_s,
                             st.estimator.gain.l1_im_per_s,
                             st.estimator.gain.l2_re_ohm,
                             st.estimator.gain.l2_im_ohm};
    for (unsigned k = 0; k < sizeof at_rest / sizeof at_rest[0]; k++) {
        TEST_ASSERT_EQUAL_FLOAT(0.0f, at_rest[k]);
    }
    TEST_ASSERT_EQUAL_UINT32(11u, st.guard.monitor.adc_periods);
    TEST_ASSERT_EQUAL_FLOAT(0.1f, st.measurement.offset_A.u);
    TEST_ASSERT_EQUAL_FLOAT(-0.2f, st.measurement.offset_A.v);
    TEST_ASSERT_EQUAL_FLOAT(0.3f, st.measurement.offset_A.w);
    TEST_ASSERT_EQUAL_FLOAT(2.0f, st.measurement.offset_V.alpha);
    TEST_ASSERT_EQUAL_FLOAT(-3.0f, st.measurement.offset_V.beta);
    TEST_ASSERT_EQUAL_FLOAT(p.motor.Rs_ohm, drive_rs_ohm(&cfg, &st));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.modes.vector.steering.reduction_Wb);
    TEST_ASSERT_FALSE(st.modes.premagnetise.leg_loss_found);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.estimator.estimate.omega_e_rad_s);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.estimator.estimate.omega_s_rad_s);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.estimator.observer.lambda_r_hat_Wb.alpha);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.acting.pending_V.alpha);
}

static void test_faults_are_reported_in_every_mode(void)
{
    const drive_params_t p = both_machines(0);
    drive_config_t cfg;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    for (int mode = DRIVE_OFF; mode <= DRIVE_RUN; mode++) {
        drive_state_t st = {0};
        measurement_in_t sample = words(&p, 0, 0.0, 0.0, 50.0);
        drive_in_t in = {.mode = (drive_mode_t)mode};
        sample.i_u_counts = 16000u; /* 23.8 A */
        sample.i_v_counts = 8192u;
        drive_out_t out;
        drive_step(&cfg, &st, &sample, &in, &out);
        TEST_ASSERT_EQUAL_UINT32(FAULT_OVER_CURRENT | FAULT_DC_UNDER_VOLTAGE, out.faults);
    }
}

static void test_a_lost_estimate_is_a_fault(void)
{
    const drive_params_t p = both_machines(0);
    drive_config_t cfg;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    /* The estimate stays bounded by its clamps; the over-speed limit sees it there. */
    cfg.guard.monitor.omega_max_rad_s = 500.0f;
    drive_state_t st = {.estimator.adaptation = {.x_rad_s = 600.0f}};
    const measurement_in_t sample = words(&p, 0, 0.0, 0.0, 540.0);
    const drive_in_t in = {.mode = DRIVE_RUN};
    drive_out_t out;
    drive_step(&cfg, &st, &sample, &in, &out);
    TEST_ASSERT_EQUAL_UINT32(FAULT_OVER_SPEED, out.faults);
}

/* As the period finds it, whatever its slot: a limit makes a number of it before the period is
 * over.
 */
static void test_monitor_sees_a_state_that_a_limit_heals(void)
{
    const drive_params_t p = both_machines(0);
    drive_config_t cfg;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    const measurement_in_t sample = words(&p, 0, 0.0, 0.0, 540.0);
    const drive_in_t in = {.mode = DRIVE_PREMAGNETISE};
    for (uint32_t slot = 0u; slot < SLOT_COUNT; slot++) {
        drive_state_t st = {.estimator.observer = {.lambda_r_hat_Wb = {0.4f, NAN}},
                            .slot = (slot + SLOT_COUNT - 1u) % SLOT_COUNT};
        drive_out_t out;
        drive_step(&cfg, &st, &sample, &in, &out);
        TEST_ASSERT_EQUAL_UINT32(FAULT_NON_FINITE, out.faults & FAULT_NON_FINITE);
        TEST_ASSERT_TRUE(isfinite(st.estimator.observer.lambda_r_hat_Wb.beta));
        drive_step(&cfg, &st, &sample, &in, &out);
        TEST_ASSERT_EQUAL_UINT32(0u, out.faults & FAULT_NON_FINITE);
    }
}

/* What no limit heals is found within four periods. */
static void test_monitor_sees_a_fast_state_in_every_fourth_period(void)
{
    const drive_params_t p = both_machines(0);
    drive_config_t cfg;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    const measurement_in_t sample = words(&p, 0, 0.0, 0.0, 540.0);
    const drive_in_t in = {.mode = DRIVE_OFF};
    for (uint32_t slot = 0u; slot < SLOT_COUNT; slot++) {
        drive_state_t st = {.measurement.offset_V = {0.0f, NAN},
                            .slot = (slot + SLOT_COUNT - 1u) % SLOT_COUNT};
        drive_out_t out;
        drive_step(&cfg, &st, &sample, &in, &out);
        TEST_ASSERT_EQUAL_UINT32(slot_is_quarter(slot, SLOT_QUARTER_STATE) ? FAULT_NON_FINITE : 0u,
                                 out.faults);
    }
}

#define SLOT_OF_HEAT 6 /* state_sum.c */

/* What changes slowly is looked at in one slot of sixteen, whatever the mode. */
static int period_that_sees_a_heat_of_nan(drive_mode_t mode, const drive_params_t *p)
{
    drive_config_t cfg;
    TEST_ASSERT_TRUE(drive_init(&cfg, p, &test_table));
    const measurement_in_t sample = words(p, 0, 0.0, 0.0, 540.0);
    const drive_in_t in = {.mode = mode};
    drive_state_t st = {.limits.overload = {.heat_pu = {NAN, 0.0f}}};
    drive_out_t out;
    for (int k = 1; k < 100; k++) {
        drive_step(&cfg, &st, &sample, &in, &out);
        if ((out.faults & FAULT_NON_FINITE) != 0u) {
            return k;
        }
    }
    return 0;
}

static void test_monitor_sees_a_slow_state_once_per_turn(void)
{
    drive_params_t p = both_machines(0);
    TEST_ASSERT_EQUAL_INT(SLOT_OF_HEAT, period_that_sees_a_heat_of_nan(DRIVE_OFF, &p));
    TEST_ASSERT_EQUAL_INT(SLOT_OF_HEAT, period_that_sees_a_heat_of_nan(DRIVE_PREMAGNETISE, &p));
    TEST_ASSERT_EQUAL_INT(SLOT_OF_HEAT, period_that_sees_a_heat_of_nan(DRIVE_RUN, &p));
}

/* Motor wired u-w-v: same machine turning the other way, so v and w change places everywhere. */
static void test_mirror_swaps_two_phases_and_turns_the_speed_round(void)
{
    const drive_params_t p = both_machines(1);
    drive_config_t cfg;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    drive_state_t a = {.estimator.observer = {.lambda_r_hat_Wb = {0.4f, 0.1f}}};
    drive_state_t b = {.estimator.observer = {.lambda_r_hat_Wb = {0.4f, -0.1f}}};
    for (int k = 0; k < 50; k++) {
        measurement_in_t sample = words(&p, k, 5.0, 30.0, 540.0);
        drive_in_t in = {.mode = DRIVE_RUN, .omega_e_ref_rad_s = 20.0f};
        drive_out_t x, y;
        drive_step(&cfg, &a, &sample, &in, &x);
        const measurement_in_t s = sample;
        sample.i_v_counts = s.i_w_counts;
        sample.i_w_counts = s.i_v_counts;
        sample.u_uv_counts = (uint16_t)(s.u_uv_counts + s.u_vw_counts - 8192u);
        sample.u_vw_counts = (uint16_t)(16384u - s.u_vw_counts);
        in.omega_e_ref_rad_s = -20.0f;
        drive_step(&cfg, &b, &sample, &in, &y);
        TEST_ASSERT_FLOAT_WITHIN(1e-4f, a.estimator.estimate.omega_e_rad_s,
                                 -b.estimator.estimate.omega_e_rad_s);
        TEST_ASSERT_FLOAT_WITHIN(1e-5f, x.duty.u, y.duty.u);
        TEST_ASSERT_FLOAT_WITHIN(1e-5f, x.duty.v, y.duty.w);
        TEST_ASSERT_FLOAT_WITHIN(1e-5f, x.duty.w, y.duty.v);
    }
}

static void test_two_drives_do_not_know_each_other(void)
{
    const drive_params_t p1 = both_machines(0), p2 = both_machines(1);
    drive_config_t c1, c2;
    TEST_ASSERT_TRUE(drive_init(&c1, &p1, &test_table));
    TEST_ASSERT_TRUE(drive_init(&c2, &p2, &test_table));
    drive_state_t alone = {0}, together = {0}, other = {0};
    drive_out_t x, y, z;
    for (int k = 0; k < 100; k++) {
        const measurement_in_t sample = words(&p1, k, 5.0, 30.0, 540.0);
        const drive_in_t in = {.mode = (k < 20) ? DRIVE_PREMAGNETISE : DRIVE_RUN,
                               .omega_e_ref_rad_s = 20.0f};
        drive_step(&c1, &alone, &sample, &in, &x);
    }
    for (int k = 0; k < 100; k++) {
        const measurement_in_t sample = words(&p1, k, 5.0, 30.0, 540.0);
        const drive_in_t in = {.mode = (k < 20) ? DRIVE_PREMAGNETISE : DRIVE_RUN,
                               .omega_e_ref_rad_s = 20.0f};
        const measurement_in_t sample2 = words(&p2, k + 7, 3.0, 60.0, 500.0);
        const drive_in_t in2 = {.mode = DRIVE_RUN, .omega_e_ref_rad_s = -40.0f};
        drive_step(&c1, &together, &sample, &in, &y);
        drive_step(&c2, &other, &sample2, &in2, &z);
    }
    TEST_ASSERT_EQUAL_MEMORY(&x.duty, &y.duty, sizeof(x.duty));
    TEST_ASSERT_EQUAL_MEMORY(&alone.estimator, &together.estimator, sizeof(alone.estimator));
    TEST_ASSERT_TRUE(memcmp(&together.estimator, &other.estimator, sizeof(other.estimator)) != 0);
}

static void refuse(const drive_params_t *p)
{
    drive_config_t cfg;
    TEST_ASSERT_FALSE(drive_init(&cfg, p, &test_table));
}

/* One wrong value in each part of the chain: the whole is refused. */
static void test_init_refuses_one_bad_value_anywhere(void)
{
    const drive_params_t good = both_machines(1);
    drive_params_t p;
#define REFUSE_WITH(field, value)                                                                  \
    p = good;                                                                                      \
    p.field = (value);                                                                             \
    refuse(&p)
    REFUSE_WITH(period_s, 0.0f);
    REFUSE_WITH(period_s, NAN);
    REFUSE_WITH(acting.filter_comp_s, -1e-6f);
    REFUSE_WITH(delay_comp_periods, -0.1f);
    REFUSE_WITH(motor.Rs_ohm, -1.0f);
    REFUSE_WITH(motor.M_H, 10.0f);
    REFUSE_WITH(acting.source, (acting_voltage_source_t)3);
    REFUSE_WITH(measurement.adc_bits, 0u);
    REFUSE_WITH(speed.J_kg_m2, 0.0f);
    REFUSE_WITH(flux.i_d_A, 0.0f);
    REFUSE_WITH(current.bandwidth_rad_s, 0.0f);
    REFUSE_WITH(svpwm.min_pulse_s, -1.0f);
    REFUSE_WITH(dead_time.i_threshold_A, 0.0f);
    REFUSE_WITH(monitor.i_trip_A, 0.0f);
    REFUSE_WITH(speed_guard.deviation_s, 0.0f);
    REFUSE_WITH(supervisor.corner_rad_s, 0.0f);
    REFUSE_WITH(rs_measurement.enable, true); /* and no levels */
    REFUSE_WITH(rs_tracking.gain_ohm_per_rad, -1.0f);
    REFUSE_WITH(steering.min_rad_s, -1.0f);
#undef REFUSE_WITH
    p = both_machines(1);
    estimator_list.lambda_max_Wb = 0.0f;
    refuse(&p);
    p = both_machines(1);
    estimator_list.adapt_kp = -1.0f;
    refuse(&p);
    p = both_machines(1);
    drive_config_t cfg;
    gain_table_t broken = test_table;
    broken.magic = 0u;
    TEST_ASSERT_FALSE(drive_init(&cfg, &good, &broken));
    TEST_ASSERT_TRUE(drive_init(&cfg, &good, &test_table));
}

static void test_init_turns_parameters_into_coefficients(void)
{
    const drive_params_t p = both_machines(1);
    drive_config_t cfg;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    TEST_ASSERT_EQUAL_PTR(&test_table, cfg.estimator.table);
    TEST_ASSERT_EQUAL_FLOAT(1.5f * 200e-6f, cfg.voltage.delay_comp_s);
    TEST_ASSERT_EQUAL_FLOAT(0.05f * p.motor.M_H * 4.0f, cfg.modes.vector.lambda_min_Wb);
    TEST_ASSERT_EQUAL_FLOAT(0.05f * p.motor.M_H * 4.0f, cfg.estimator.lambda_min_Wb);
    TEST_ASSERT_EQUAL_FLOAT(500.0f * 800e-6f, cfg.modes.vector.ramp.stop_step_rad_s);
    TEST_ASSERT_EQUAL_FLOAT(200e-6f, cfg.estimator.observer.period_s);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 1.0f / (p.motor.M_H * 4.0f),
                             cfg.modes.vector.inv_lambda_ref_per_Wb);
    TEST_ASSERT_EQUAL_FLOAT(50.0f, cfg.estimator.observer.i_max_A); /* twice the ADC's full scale */
    TEST_ASSERT_EQUAL_FLOAT(3.0f, cfg.estimator.observer.lambda_max_Wb);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, p.motor.M_H / p.motor.Lr_H, cfg.guard.kr);
    TEST_ASSERT_EQUAL_FLOAT(144.0f, cfg.guard.i_q_max2_A2);
    TEST_ASSERT_EQUAL_FLOAT(225.0f, cfg.guard.i_max2_A2);
    TEST_ASSERT_EQUAL_FLOAT(FLT_MAX, cfg.estimator.table_end_rad_s);
    TEST_ASSERT_TRUE(cfg.modes.fixed);
    TEST_ASSERT_FALSE(cfg.modes.vector.ride_through);
    TEST_ASSERT_EQUAL_FLOAT(p.motor.Rs_ohm, cfg.modes.premagnetise.Rs_ohm);
}

static void test_reset_keeps_the_offsets_only(void)
{
    drive_state_t st;
    memset(&st, 0x11, sizeof(st));
    st.measurement.offset_A = (uvw_t){0.5f, 0.25f, -0.5f};
    drive_reset(&st);
    drive_state_t expected = {.measurement = {.offset_A = {0.5f, 0.25f, -0.5f}}};
    TEST_ASSERT_EQUAL_FLOAT(0.5f, st.measurement.offset_A.u);
    TEST_ASSERT_EQUAL_FLOAT(expected.estimator.observer.e1_A.alpha,
                            st.estimator.observer.e1_A.alpha);
    TEST_ASSERT_EQUAL(MODE_OFF, st.mode);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.acting.acting_V.alpha);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.voltage.current.q.x);
    TEST_ASSERT_EQUAL_UINT32(0u, st.guard.monitor.adc_periods);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_chain_with_sensed_voltage_equals_the_double_chain);
    RUN_TEST(test_chain_with_duty_voltage_equals_the_double_chain);
    RUN_TEST(test_chain_without_gain_needs_no_table);
    RUN_TEST(test_chain_at_the_voltage_limit_equals_the_double_chain);
    RUN_TEST(test_chain_with_every_means_equals_the_double_chain);
    RUN_TEST(test_tracking_in_the_chain_is_told_start_error_and_moving_reference);
    RUN_TEST(test_delay_compensation_angle_is_limited);
    RUN_TEST(test_delay_angles_follow_the_frequency_in_every_fourth_period);
    RUN_TEST(test_a_standing_field_is_modulated_and_tells_rs);
    RUN_TEST(test_every_field_of_the_output_is_written_in_every_mode);
    RUN_TEST(test_the_measured_resistance_is_used_after_both_levels);
    RUN_TEST(test_the_legs_loss_is_identified_when_wanted);
    RUN_TEST(test_the_voltage_is_reversed_with_the_small_current);
    RUN_TEST(test_the_legs_threshold_that_was_found_counts);
    RUN_TEST(test_the_resistance_is_that_of_the_duties_when_the_observer_uses_them);
    RUN_TEST(test_a_refused_resistance_is_a_fault_while_it_is_asked_for);
    RUN_TEST(test_dead_time_is_not_compensated_while_the_resistance_is_measured);
    RUN_TEST(test_premagnetise_holds_axis_and_speed_still);
    RUN_TEST(test_run_without_flux_keeps_a_finite_slip_and_the_fixed_axis);
    RUN_TEST(test_torque_current_gets_what_i_d_leaves);
    RUN_TEST(test_at_rest_the_state_is_cleared_in_one_slot_of_sixteen);
    RUN_TEST(test_off_rests_everything_but_offsets_and_fault_counters);
    RUN_TEST(test_faults_are_reported_in_every_mode);
    RUN_TEST(test_a_lost_estimate_is_a_fault);
    RUN_TEST(test_monitor_sees_a_state_that_a_limit_heals);
    RUN_TEST(test_monitor_sees_a_fast_state_in_every_fourth_period);
    RUN_TEST(test_monitor_sees_a_slow_state_once_per_turn);
    RUN_TEST(test_mirror_swaps_two_phases_and_turns_the_speed_round);
    RUN_TEST(test_two_drives_do_not_know_each_other);
    RUN_TEST(test_init_refuses_one_bad_value_anywhere);
    RUN_TEST(test_init_turns_parameters_into_coefficients);
    RUN_TEST(test_reset_keeps_the_offsets_only);
    return UNITY_END();
}
