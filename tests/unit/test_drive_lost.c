/* What the whole law does when its field angle is lost: tell, stop, or impress a current. */
#include "drive.h"

#include <complex.h>
#include <math.h>
#include <string.h>

#include "drive_fixture.h"
#include "exact.h"
#include "unity.h"

#define NOMINAL_A  4.0 /* magnetising current of the fixture */
#define SIXTH_TURN (0.5 * THIRD_TURN)

static drive_config_t cfg;
static drive_params_t p;
static drive_in_t in;
static measurement_in_t sample;
static drive_out_t out;
static drive_state_t st;

static cplx of(ab_t x)
{
    return (double)x.alpha + I * (double)x.beta;
}

static ab_t ab(cplx x)
{
    return (ab_t){(float)creal(x), (float)cimag(x)};
}

/* ADC words of one current and voltage. */
static measurement_in_t sampled(cplx i_A, cplx u_V)
{
    double i[3], u[3];
    phases_of(i_A, i);
    phases_of(u_V, u);
    const double fs = (double)p.measurement.line_voltage_full_scale_V;
    return (measurement_in_t){.i_u_counts = counts(i[0], 25.0),
                              .i_v_counts = counts(i[1], 25.0),
                              .i_w_counts = counts(i[2], 25.0),
                              .u_uv_counts = counts(u[0] - u[1], fs),
                              .u_vw_counts = counts(u[1] - u[2], fs),
                              .u_dc_counts = (uint16_t)lrint(540.0 / 800.0 * 16384.0)};
}

/* A machine, and what the drive does when lost. Current controllers without feed-forward and a
 * speed that only a test moves: what is left is what changes hands. */
static void configure(int machine, drive_lost_action_t action)
{
    p = both_machines(machine);
    p.lost_action = action;
    p.i_f = (i_f_params_t){.current_A = 10.0f,
                           .slew_A_per_s = 100.0f,
                           .slew_rad_s2 = 500.0f,
                           .return_rad_s = 12.0f,
                           .timeout_s = 2e-3f};
    estimator_list.adapt_kp = 0.0f;
    estimator_list.adapt_ki = 0.0f;
    estimator_list.eps1 = 0.0f;
    p.current.decoupling = 0.0f;
    estimator_list.observer_gain_enable = 0u;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, NULL));
}

static double nominal_Wb(void)
{
    return (double)p.motor.M_H * NOMINAL_A;
}

/* Running at 20 rad/s of 25 wanted, 5.8 A, judged as given. The next slot asks for the verdict, the
 * next judgement is far away. */
static void run_judged(supervisor_confidence_t confidence)
{
    const cplx i_A = 5.0 + 3.0 * I;
    in = (drive_in_t){.mode = DRIVE_RUN, .omega_e_ref_rad_s = 25.0f};
    sample = sampled(i_A, 10.0 + 20.0 * I);
    st = (drive_state_t){
        .estimator.observer = {.lambda_r_hat_Wb = {0.3f, -0.2f}, .i_s_hat_A = {4.0f, 3.5f}},
        .estimator.adaptation = {.x_rad_s = 20.0f, .near_zero = true},
        .modes.vector.speed = {.omega_ref_rad_s = 25.0f,
                               .omega_filtered_rad_s = 20.0f,
                               .pi = {2.0f}},
        .voltage.current = {.d = {12.0f}, .q = {-30.0f}},
        .modes.vector.steering = {.torque_Nm = 3.0f, .reduction_Wb = 0.05f, .steering = true},
        .modes.vector.steer = {.reduction_Wb = 0.05f},
        .rs_tracking = {.delta_ohm = 0.2f},
        .modes.vector.torque_gain_extra_pu = 0.1f,
        .modes.vector.i_d_reduction_A = 0.3f,
        .supervisor = {.confidence = confidence},
        .slot = SLOT_QUARTER_SUPERVISOR - 1u,
        .estimator.estimate = {.omega_e_rad_s = 20.0f, .omega_s_rad_s = 22.0f}};
}

/* The vector along a current of 8 A at 30 rad/s, 60 degrees ahead of a flux of `flux_pu`. */
static void run_impressed(supervisor_confidence_t confidence, float omega_rad_s, double flux_pu)
{
    const cplx axis = cexp(0.7 * I);
    run_judged(confidence);
    sample = sampled(2.0 * NOMINAL_A * axis, 0.0);
    in.omega_e_ref_rad_s = omega_rad_s;
    st.rs_tracking = (rs_tracking_state_t){0}; /* as take-over left it */
    st.modes.vector.steering = (flux_steering_state_t){0};
    st.modes.vector.steer = (flux_steering_out_t){0};
    st.modes.vector.torque_gain_extra_pu = 0.0f;
    st.modes.vector.i_d_reduction_A = 0.0f;
    st.modes.i_f = (i_f_state_t){
        .active = true, .axis = ab(axis), .current_A = 8.0f, .omega_rad_s = omega_rad_s};
    st.estimator.observer.lambda_r_hat_Wb =
        ab(flux_pu * nominal_Wb() * axis * cexp(-I * SIXTH_TURN));
    st.estimator.observer.i_s_hat_A = ab(2.0 * NOMINAL_A * axis);
    st.estimator.adaptation.x_rad_s = omega_rad_s;
    st.estimator.estimate.omega_e_rad_s = omega_rad_s;
    st.estimator.estimate.omega_s_rad_s = omega_rad_s;
}

static void step(void)
{
    drive_step(&cfg, &st, &sample, &in, &out);
}

/* The last bit of a word flickers, as words do. */
static void step_flickering(void)
{
    sample.i_w_counts ^= 1u;
    step();
}

void setUp(void)
{
    configure(1, DRIVE_LOST_I_F);
}

void tearDown(void)
{
}

/* What it gets is what the control law used, the resistance in use included. */
static void test_run_is_supervised_and_nothing_else_is(void)
{
    p = both_machines(1);
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    st = (drive_state_t){.estimator.observer = {.lambda_r_hat_Wb = {0.4f, 0.1f}},
                         .modes.premagnetise.Rs_delta_ohm = 0.2f};
    in = (drive_in_t){.mode = DRIVE_RUN};
    sample = words(&p, 0, 2.0, 30.0, 540.0);
    supervisor_state_t expected = {0};
    for (int k = 0; k < 32; k++) {
        step();
        const supervisor_in_t sup_in = {.i_s_A = out.meas.i_s_A,
                                        .lambda_r_hat_Wb = st.estimator.observer.lambda_r_hat_Wb,
                                        .e1_A = st.estimator.observer.e1_A,
                                        .correction_V = st.estimator.estimate.flux_correction_V,
                                        .Rs_ohm = drive_rs_ohm(&cfg, &st),
                                        .omega_e_hat_rad_s = st.estimator.estimate.omega_e_rad_s,
                                        .omega_s_hat_rad_s = st.estimator.estimate.omega_s_rad_s};
        supervisor_add(&expected, out.u_s_V, out.meas.i_s_A, sup_in.Rs_ohm);
        if (supervisor_is_due(st.slot)) {
            supervisor_step(&cfg.supervisor, &expected, &sup_in, st.slot);
        }
        TEST_ASSERT_EQUAL_FLOAT(expected.s_Wb.alpha, st.supervisor.s_Wb.alpha);
        TEST_ASSERT_EQUAL_FLOAT(expected.s_Wb.beta, st.supervisor.s_Wb.beta);
        TEST_ASSERT_EQUAL_FLOAT(expected.flux_error_bound_pu, st.supervisor.flux_error_bound_pu);
        TEST_ASSERT_EQUAL_FLOAT(expected.omega_bound_rad_s, st.supervisor.omega_bound_rad_s);
    }
    in.mode = DRIVE_PREMAGNETISE;
    step();
    TEST_ASSERT_FALSE(st.supervisor.started);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.supervisor.flux_error_bound_pu);
}

/* What a judgement finds of a field that dwells at zero under torque; the speed controller asks for
 * as much as it may, or for less. */
static bool stands(float asked_A, bool flux)
{
    st =
        (drive_state_t){.estimator.observer = {.lambda_r_hat_Wb = {0.4f, 0.1f}},
                        .estimator.adaptation = {.near_zero = true},
                        .dwell = {.active = true, .flux = flux, .share = 1.0f, .swing_rad_s = 2.0f},
                        .modes.vector.speed = {.low_A = -5.0f, .high_A = 5.0f, .pi = {asked_A}},
                        .slot = SLOT_SUPERVISOR_MEASURE - 1u};
    in = (drive_in_t){.mode = DRIVE_RUN};
    sample = words(&p, 0, 2.0, 30.0, 540.0);
    step();
    TEST_ASSERT_TRUE(st.supervisor.judged);
    return st.supervisor.found.still;
}

/* It swings where there is torque for it; where there is none left, it only stands. */
static void test_a_dwell_without_torque_to_spare_is_none(void)
{
    p = both_machines(1);
    p.supervisor.still_rad_s = 1e3f;
    p.supervisor.still_A = 1e-3f;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    TEST_ASSERT_FALSE(stands(0.0f, false));
    TEST_ASSERT_TRUE(stands(100.0f, false));
    TEST_ASSERT_TRUE(stands(-100.0f, false));
    TEST_ASSERT_FALSE(stands(100.0f, true)); /* a flux that swings takes torque away itself */
}

/* A torque that is asked for may take all of the current for as long as it likes. */
static void test_a_torque_at_its_limit_takes_no_swing_away(void)
{
    p = both_machines(1);
    p.supervisor.still_rad_s = 1e3f;
    p.supervisor.still_A = 1e-3f;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    TEST_ASSERT_TRUE(stands(100.0f, false)); /* the limits, and a swing that is none */
    in.aim = DRIVE_AIM_TORQUE;
    in.torque_ref_Nm = 1e3f;
    st.modes.vector.speed.i_q_A = 5.0f;
    st.dwell = (dwell_state_t){.active = true, .share = 1.0f, .swing_rad_s = 2.0f};
    st.slot = SLOT_SUPERVISOR_MEASURE - 1u;
    step();
    TEST_ASSERT_TRUE(speed_control_at_limit(&st.modes.vector.speed));
    TEST_ASSERT_FALSE(st.supervisor.found.still);
}

/* The same step with and without the verdict. */
static void step_both(supervisor_confidence_t verdict, drive_state_t *told, drive_out_t *told_out)
{
    run_judged(verdict);
    step();
    *told = st;
    *told_out = out;
    run_judged(SUPERVISOR_CLOSED);
    step();
}

/* A lost drive says that its speed is unknown as well. */
static void assert_same_but_the_verdict(drive_state_t *told)
{
    TEST_ASSERT_TRUE(told->guard.speed.speed_unknown);
    TEST_ASSERT_FALSE(st.guard.speed.speed_unknown);
    told->guard.speed.speed_unknown = false;
    told->supervisor = st.supervisor;
    TEST_ASSERT_EQUAL_MEMORY(&st, told, sizeof st);
}

static void test_told_only_nothing_but_the_verdict_differs(void)
{
    configure(0, DRIVE_LOST_TELL);
    drive_state_t told;
    drive_out_t told_out;
    step_both(SUPERVISOR_IMPRESSED, &told, &told_out);
    TEST_ASSERT_EQUAL(SUPERVISOR_IMPRESSED, told.supervisor.confidence);
    assert_same_but_the_verdict(&told);
    TEST_ASSERT_EQUAL_MEMORY(&out, &told_out, sizeof out);
}

static void test_stop_is_a_fault_and_nothing_else(void)
{
    configure(0, DRIVE_LOST_STOP);
    drive_state_t told;
    drive_out_t told_out;
    step_both(SUPERVISOR_IMPRESSED, &told, &told_out);
    TEST_ASSERT_EQUAL_UINT32(FAULT_ORIENTATION_LOST, told_out.faults);
    TEST_ASSERT_EQUAL_UINT32(0u, out.faults);
    assert_same_but_the_verdict(&told);
}

static void test_doubt_alone_is_acted_upon_by_nobody(void)
{
    for (int action = DRIVE_LOST_TELL; action <= DRIVE_LOST_I_F; action++) {
        configure(0, (drive_lost_action_t)action);
        drive_state_t doubted;
        drive_out_t doubted_out;
        step_both(SUPERVISOR_DEGRADED, &doubted, &doubted_out);
        doubted.supervisor = st.supervisor;
        TEST_ASSERT_EQUAL_MEMORY(&st, &doubted, sizeof st);
        TEST_ASSERT_EQUAL_MEMORY(&out, &doubted_out, sizeof out);
    }
}

/* The chain from a wrong estimate to the vector, by way of the supervisor's own judgement: more
 * flux than there can be, which without a time to confirm it is a loss. */
static void test_the_supervisor_itself_brings_the_vector(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        configure(machine, DRIVE_LOST_I_F);
        run_judged(SUPERVISOR_CLOSED);
        st.estimator.observer.lambda_r_hat_Wb = (ab_t){1.2f, 0.0f};
        for (int k = 0; k < 14; k++) {
            step_flickering();
            TEST_ASSERT_FALSE(st.modes.i_f.active);
        }
        step_flickering();
        TEST_ASSERT_TRUE(st.modes.i_f.active);
        TEST_ASSERT_EQUAL_UINT32(0u, out.faults);
    }
}

static void test_take_over_starts_from_current_nominal_flux_and_wanted_speed(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        configure(machine, DRIVE_LOST_I_F);
        run_judged(SUPERVISOR_IMPRESSED);
        st.offset_tracking.turning = 2.0f;
        step();
        const cplx i_A = of(out.meas.i_s_A);
        const cplx axis = i_A / cabs(i_A);
        TEST_ASSERT_TRUE(st.modes.i_f.active);
        ASSERT_NEAR(1e-6, 0.0, cabs(of(st.modes.i_f.axis) - axis));
        ASSERT_NEAR(1e-5, cabs(i_A), st.modes.i_f.current_A);
        ASSERT_SAME_FLOAT(25.0f, st.modes.i_f.omega_rad_s);
        TEST_ASSERT_EQUAL_MEMORY(&out.meas.i_s_A, &st.estimator.observer.i_s_hat_A, sizeof(ab_t));
        ASSERT_NEAR(1e-6, 0.0,
                    cabs(of(st.estimator.observer.lambda_r_hat_Wb) - nominal_Wb() * axis));
        ASSERT_SAME_FLOAT(0.0f, st.estimator.observer.e1_A.alpha);
        ASSERT_SAME_FLOAT(0.0f, st.estimator.observer.e1_A.beta);
        ASSERT_SAME_FLOAT(25.0f, st.estimator.adaptation.x_rad_s);
        TEST_ASSERT_FALSE(st.estimator.adaptation.near_zero);
        ASSERT_SAME_FLOAT(25.0f, st.estimator.estimate.omega_e_rad_s);
        ASSERT_SAME_FLOAT(25.0f, st.estimator.estimate.omega_s_rad_s);
        ASSERT_SAME_FLOAT(0.0f, st.modes.vector.steering.reduction_Wb);
        ASSERT_SAME_FLOAT(0.0f, st.modes.vector.steering.torque_Nm);
        TEST_ASSERT_FALSE(st.modes.vector.steering.steering);
        ASSERT_SAME_FLOAT(0.0f, st.modes.vector.steer.reduction_Wb);
        ASSERT_SAME_FLOAT(0.0f, st.rs_tracking.delta_ohm);
        ASSERT_SAME_FLOAT(0.0f, st.offset_tracking.turning);
        ASSERT_SAME_FLOAT(0.0f, st.modes.vector.torque_gain_extra_pu);
        ASSERT_SAME_FLOAT(0.0f, st.modes.vector.i_d_reduction_A);
        TEST_ASSERT_EQUAL_UINT32(0u, out.faults);
    }
}

/* The reference of the first period is the current that flows. */
static void test_take_over_asks_for_the_current_there_is(void)
{
    run_judged(SUPERVISOR_IMPRESSED);
    step();
    step();
    ASSERT_NEAR(3e-3, hypot(5.0, 3.0), out.i_ref_A.d); /* one LSB */
    ASSERT_SAME_FLOAT(0.0f, out.i_ref_A.q);
    ASSERT_NEAR(1e-5, out.i_ref_A.d, out.i_A.d);
    ASSERT_NEAR(1e-5, 0.0, out.i_A.q);
    /* From the next one it grows towards the one that was set. */
    const double before_A = (double)out.i_ref_A.d;
    step();
    ASSERT_NEAR(1e-5, before_A + 100.0 * 2e-4, out.i_ref_A.d);
}

/* The speed controller waits meanwhile, at the limit that it was lost at: 11 rad/s stand up to 14
 * at the limit, and up to 8 without. */
static void test_a_limit_from_before_the_take_over_does_not_count(void)
{
    p.supervisor.still_rad_s = 8.0f;
    p.supervisor.still_A = 1e-3f;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, NULL));
    for (int n = 0; n < 2; n++) {
        const float omega_rad_s = (n == 0) ? 11.0f : 7.0f;
        run_impressed(SUPERVISOR_DEGRADED, omega_rad_s, 1.0);
        st.mode = MODE_TAKE_OVER;
        st.modes.vector.speed = (speed_control_state_t){
            .low_A = -5.0f, .high_A = 5.0f, .i_q_A = 5.0f, .omega_ref_rad_s = omega_rad_s};
        st.supervisor.omega_s_rad_s = omega_rad_s;
        st.slot = SLOT_SUPERVISOR_MEASURE - 1u;
        step();
        TEST_ASSERT_EQUAL(MODE_TAKE_OVER, st.mode);
        TEST_ASSERT_TRUE(speed_control_at_limit(&st.modes.vector.speed));
        TEST_ASSERT_EQUAL(n == 1, st.supervisor.found.still);
    }
}

/* Below the return frequency nothing is to be seen: the rotor is taken to follow. */
static void test_slow_the_speed_is_the_imposed_one(void)
{
    estimator_list.adapt_kp = 1.5f;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, NULL));
    run_impressed(SUPERVISOR_IMPRESSED, 11.9f, 1.0);
    st.estimator.observer.e1_A = (ab_t){1.0f, -1.0f};
    st.estimator.estimate.omega_e_rad_s = 5.0f;
    st.estimator.estimate.omega_s_rad_s = 6.0f;
    st.estimator.adaptation.x_rad_s = 7.0f;
    in.omega_e_ref_rad_s = 11.0f;
    step();
    ASSERT_SAME_FLOAT(11.9f, st.estimator.estimate.omega_e_rad_s);
    ASSERT_SAME_FLOAT(11.9f, st.estimator.adaptation.x_rad_s);
    ASSERT_SAME_FLOAT(11.9f, st.estimator.estimate.omega_s_rad_s);
    ASSERT_NEAR(1e-5, 11.8, st.modes.i_f.omega_rad_s); /* for the next period */
    ASSERT_SAME_FLOAT(8.0f, out.i_ref_A.d);
    ASSERT_SAME_FLOAT(0.0f, out.i_ref_A.q);
    TEST_ASSERT_EQUAL_UINT32(0u, out.faults);
}

/* From there on the estimator looks for it, from the imposed speed on. What the speed controller
 * expected when the angle was lost is not what the shaft does now. */
static void test_fast_the_speed_is_estimated_around_the_imposed_one(void)
{
    estimator_list.adapt_kp = 1.5f;
    estimator_list.adapt_ki = 30.0f;
    estimator_list.eps1_mode = 0u;
    estimator_list.adapt_accel_share = 1.0f;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, NULL));
    run_impressed(SUPERVISOR_IMPRESSED, -40.0f, 1.0);
    st.modes.vector.speed.expected_step_rad_s = 3.0f;
    step();
    const double z =
        cimag(conj(of(st.estimator.observer.lambda_r_hat_Wb)) * of(st.estimator.observer.e1_A));
    TEST_ASSERT_TRUE(fabs(z) > 1e-3);
    ASSERT_NEAR(1e-4, -40.0 + 2e-4 * 30.0 * z, st.estimator.adaptation.x_rad_s);
    ASSERT_NEAR(1e-4, -40.0 + 2e-4 * 30.0 * z + 1.5 * z, st.estimator.estimate.omega_e_rad_s);
    ASSERT_SAME_FLOAT(-40.0f, st.estimator.estimate.omega_s_rad_s);
}

static void test_the_voltage_turns_with_the_vector(void)
{
    run_impressed(SUPERVISOR_IMPRESSED, 30.0f, 1.0);
    p.dead_time.fraction = 0.0f;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, NULL));
    voltage_angle(&cfg.voltage, &st.voltage, 30.0f);
    cplx u_V[2];
    for (int k = 0; k < 2; k++) {
        st.voltage.current.d.x = 12.0f;
        st.voltage.current.q.x = -30.0f;
        st.modes.i_f.current_A = 8.0f;
        sample = sampled(8.0 * of(st.modes.i_f.axis), 0.0);
        step();
        u_V[k] = of(st.acting.pending_V);
    }
    /* 1.5 periods ahead of the sample; 2 mA of rounding at 3.6 ohm. */
    const cplx expected_V = (12.0 - 30.0 * I) * cexp(I * (0.7 + 30.0 * 1.5 * 2e-4));
    ASSERT_NEAR(0.02, 0.0, cabs(u_V[0] - expected_V));
    ASSERT_NEAR(0.02, 0.0, cabs(u_V[1] - expected_V * cexp(I * 30.0 * 2e-4)));
}

/* 2 ms: 10 periods. */
static void test_it_gives_up_above_the_return_frequency_only(void)
{
    run_impressed(SUPERVISOR_IMPRESSED, 30.0f, 1.0);
    for (int k = 0; k < 14; k++) {
        step_flickering();
        TEST_ASSERT_EQUAL_UINT32((k < 10) ? 0u : FAULT_ORIENTATION_LOST, out.faults);
    }
    run_impressed(SUPERVISOR_IMPRESSED, 11.0f, 1.0);
    for (int k = 0; k < 14; k++) {
        step_flickering();
        TEST_ASSERT_EQUAL_UINT32(0u, out.faults);
    }
    TEST_ASSERT_TRUE(st.modes.i_f.active);
}

static void test_hand_back_takes_torque_and_speed_along(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        const double flux_pu[] = {1.0, 0.7, 1.3};
        configure(machine, DRIVE_LOST_I_F);
        for (unsigned k = 0; k < 3u; k++) {
            run_impressed(SUPERVISOR_CLOSED, 30.0f, flux_pu[k]);
            st.estimator.adaptation.x_rad_s = 27.0f; /* the estimate, with some slip */
            step();
            const cplx lambda_Wb = of(st.estimator.observer.lambda_r_hat_Wb);
            /* The torque as current at nominal flux. */
            const double i_q_A = cimag(conj(lambda_Wb) * of(out.meas.i_s_A)) / (nominal_Wb());
            ASSERT_NEAR(1e-4, i_q_A, st.modes.vector.speed.pi.x);
            TEST_ASSERT_TRUE(i_q_A > 4.0);
            ASSERT_SAME_FLOAT(30.0f, st.modes.vector.speed.omega_ref_rad_s);
            ASSERT_SAME_FLOAT(27.0f, st.modes.vector.speed.omega_filtered_rad_s);
            const i_f_state_t none = {0};
            TEST_ASSERT_EQUAL_MEMORY(&none, &st.modes.i_f, sizeof none);
            TEST_ASSERT_EQUAL_UINT32(0u, out.faults);
        }
    }
}

static void test_hand_back_limits_the_torque_to_what_the_controller_may_ask(void)
{
    run_impressed(SUPERVISOR_CLOSED, 30.0f, 2.5); /* 17 A at nominal flux */
    step();
    ASSERT_SAME_FLOAT(12.0f, st.modes.vector.speed.pi.x);
}

/* Below the return frequency the estimate is what was imposed, and proves nothing. */
static void test_no_hand_back_below_the_return_frequency(void)
{
    run_impressed(SUPERVISOR_CLOSED, 9.0f, 1.0);
    step();
    TEST_ASSERT_TRUE(st.modes.i_f.active);
    run_impressed(SUPERVISOR_CLOSED, 13.0f, 1.0);
    step();
    TEST_ASSERT_FALSE(st.modes.i_f.active);
}

/* One schedule for all modes: neither way moves it. */
static void test_the_schedule_goes_on_through_a_loss(void)
{
    const supervisor_confidence_t verdicts[] = {SUPERVISOR_IMPRESSED, SUPERVISOR_CLOSED};
    for (int n = 0; n < 2; n++) {
        if (n == 0) {
            run_judged(verdicts[n]);
        } else {
            run_impressed(verdicts[n], 30.0f, 1.0);
        }
        for (uint32_t k = 0u; k < 2u * SLOT_COUNT; k++) {
            step();
            TEST_ASSERT_EQUAL_UINT32((k + SLOT_QUARTER_SUPERVISOR) % SLOT_COUNT, st.slot);
        }
    }
}

/* Its flux goes on with the EMF of every period, or it could never find the motor again. */
static void test_while_a_current_holds_the_load_the_supervisor_goes_on(void)
{
    run_impressed(SUPERVISOR_IMPRESSED, 30.0f, 1.0);
    sample = sampled(8.0 * cexp(0.7 * I), 40.0 + 20.0 * I);
    step(); /* ties its flux */
    cplx sum_V = 0.0;
    for (int k = 0; k < 3; k++) {
        step();
        TEST_ASSERT_EQUAL(MODE_TAKE_OVER, st.mode);
        sum_V += of(out.u_s_V) - (double)drive_rs_ohm(&cfg, &st) * of(out.meas.i_s_A);
        ASSERT_NEAR(1e-3, 0.0, cabs(of(st.supervisor.emf_sum_V) - sum_V));
    }
    TEST_ASSERT_TRUE(cabs(sum_V) > 10.0);
}

/* Between two looks of the supervisor a verdict waits: three periods at most. */
static void test_a_verdict_is_asked_for_in_the_supervisors_slots(void)
{
    for (uint32_t slot = 0u; slot < SLOT_COUNT; slot++) {
        run_judged(SUPERVISOR_IMPRESSED);
        st.slot = (slot + SLOT_COUNT - 1u) % SLOT_COUNT;
        step();
        TEST_ASSERT_EQUAL(supervisor_is_due(slot), st.modes.i_f.active);
        int waited = 0;
        while (!st.modes.i_f.active) {
            step();
            waited++;
        }
        TEST_ASSERT_LESS_OR_EQUAL_INT(3, waited);
    }
}

/* An estimator that has lost its way in the saturation of a long vector: the flux that the stator
 * equation shows is what vector control goes on with, three times. */
static void test_hand_back_by_the_flux_that_the_voltage_shows(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        configure(machine, DRIVE_LOST_I_F);
        cfg.modes.i_f.timeout_periods = 30000u;
        for (uint32_t tries = 0u; tries < I_F_TRIES; tries++) {
            run_impressed(SUPERVISOR_IMPRESSED, 30.0f, -0.5);
            const cplx behind = 0.9 * nominal_Wb() * (1.0 - 0.4 * I);
            st.modes.i_f.flux_Wb = ab(behind);
            st.modes.i_f.lost_periods = cfg.modes.i_f.look_periods;
            st.modes.i_f.tries = tries;
            cfg.modes.i_f.mean_share = 0.0f;
            const cplx axis = of(st.modes.i_f.axis);
            step();
            TEST_ASSERT_EQUAL(MODE_VECTOR, st.mode);
            ASSERT_NEAR(1e-6, 0.0, cabs(of(st.estimator.estimate.lambda_r_hat_Wb) - behind * axis));
            const double slip_rad_s = 0.4 / 1.16 * 8.0 * (double)cfg.motor.M_H /
                                      (0.9 * nominal_Wb()) * (double)cfg.motor.tau_per_s;
            ASSERT_NEAR(1e-4, 30.0 - slip_rad_s, st.estimator.estimate.omega_e_rad_s);
            ASSERT_SAME_FLOAT(st.estimator.estimate.omega_e_rad_s,
                              st.modes.vector.speed.omega_filtered_rad_s);
            TEST_ASSERT_NOT_EQUAL(SUPERVISOR_IMPRESSED, st.supervisor.confidence);
            TEST_ASSERT_FALSE(st.modes.i_f.active);
            TEST_ASSERT_EQUAL_UINT32(tries + 1u, st.modes.i_f.tries);
            TEST_ASSERT_EQUAL_UINT32(0u, out.faults);
        }
    }
}

/* From the fourth look on the estimate alone starts again from there. The current holds the load
 * while the rotor is seen to follow, up to the last look, and the speed is unknown. */
static void test_a_load_that_is_seen_to_be_held_is_not_given_up_soon(void)
{
    TEST_ASSERT_EQUAL_UINT32(3u, I_F_TRIES);
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        configure(machine, DRIVE_LOST_I_F);
        cfg.modes.i_f.look_periods = 5u;
        for (int k = 0; k < 3; k++) { /* a rotor follows; no flux; the last look was taken */
            run_impressed(SUPERVISOR_IMPRESSED, 30.0f, -0.5);
            cfg.modes.i_f.mean_share = 0.0f;
            st.modes.i_f.flux_Wb = (ab_t){(k == 1) ? 0.0f : (float)nominal_Wb(), 0.0f};
            st.modes.i_f.tries = (k == 2) ? I_F_LOOKS : I_F_TRIES;
            const uint32_t tries = st.modes.i_f.tries;
            uint32_t faults = 0u;
            int again = 0;
            for (int n = 0; n < 100; n++) {
                const uint32_t before = st.modes.i_f.tries;
                step_flickering();
                if (st.modes.i_f.tries != before) {
                    again++;
                    const cplx lambda_Wb =
                        nominal_Wb() * of(st.modes.i_f.axis) * cexp(-I * 30.0 * 2e-4);
                    ASSERT_NEAR(1e-5, 0.0,
                                cabs(of(st.estimator.estimate.lambda_r_hat_Wb) - lambda_Wb));
                    ASSERT_SAME_FLOAT(30.0f, st.estimator.estimate.omega_e_rad_s);
                }
                faults |= out.faults;
            }
            TEST_ASSERT_EQUAL_UINT32((k == 0) ? 0u : FAULT_ORIENTATION_LOST, faults);
            TEST_ASSERT_TRUE((k == 0) ? (again >= 10) : (again == 0));
            TEST_ASSERT_EQUAL_UINT32(tries + (uint32_t)again, st.modes.i_f.tries);
            TEST_ASSERT_TRUE((k != 0) || st.guard.speed.speed_unknown);
            TEST_ASSERT_EQUAL(MODE_TAKE_OVER, st.mode);
            TEST_ASSERT_EQUAL(SUPERVISOR_IMPRESSED, st.supervisor.confidence);
            /* No look costs a turn of the vector. */
            ASSERT_NEAR(1e-4, remainder(0.7 + 100.0 * 30.0 * 2e-4, 2.0 * 3.14159265358979),
                        carg(of(st.modes.i_f.axis)));
        }
    }
}

/* Only above the return frequency there is an EMF to see it by. */
static void test_the_flux_is_looked_at_above_the_return_frequency(void)
{
    run_impressed(SUPERVISOR_IMPRESSED, 11.0f, 1.0);
    step();
    ASSERT_SAME_FLOAT(0.0f, st.modes.i_f.flux_Wb.alpha);
    run_impressed(SUPERVISOR_IMPRESSED, 13.0f, 1.0);
    step();
    TEST_ASSERT_TRUE(absf(st.modes.i_f.flux_Wb.alpha) > 0.0f);
}

/* Without a flux the frame has no length to divide by. */
static void test_hand_back_without_flux_leaves_numbers(void)
{
    run_impressed(SUPERVISOR_CLOSED, 30.0f, 0.0);
    st.estimator.observer.i_s_hat_A = (ab_t){0.0f, 0.0f};
    step();
    TEST_ASSERT_FALSE(st.modes.i_f.active);
    TEST_ASSERT_TRUE(is_finite(st.modes.vector.speed.pi.x) && is_finite(st.voltage.current.d.x) &&
                     is_finite(st.voltage.current.q.x));
    ASSERT_NEAR(0.1, 0.0, st.modes.vector.speed.pi.x);
}

/* Machine, current and flux in balance; the voltage asked before and after. */
static void test_hand_back_does_not_move_the_voltage(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        configure(machine, DRIVE_LOST_I_F);
        run_impressed(SUPERVISOR_CLOSED, 30.0f, 1.0);
        const cplx x_V = (12.0 - 30.0 * I) * of(st.modes.i_f.axis);
        step();
        const cplx lambda_Wb = of(st.estimator.observer.lambda_r_hat_Wb);
        const cplx kept_V = (double)st.voltage.current.d.x + I * (double)st.voltage.current.q.x;
        ASSERT_NEAR(0.02, 0.0, cabs(kept_V * lambda_Wb / cabs(lambda_Wb) - x_V));
        const cplx before_V = of(st.acting.pending_V);
        sample = sampled(8.0 * cexp(I * (0.7 + 30.0 * 2e-4)), 0.0);
        st.estimator.observer.i_s_hat_A = out.meas.i_s_A;
        step();
        /* 32 V in all. What is left is the slip, and samples whose voltage is no machine's. */
        ASSERT_NEAR(0.5, 0.0, cabs(of(st.acting.pending_V) - before_V * cexp(I * 30.0 * 2e-4)));
    }
}

static void test_nothing_is_impressed_outside_of_run(void)
{
    const drive_mode_t modes[] = {DRIVE_OFF, DRIVE_PREMAGNETISE};
    const i_f_state_t none = {0};
    const supervisor_state_t rested = {0};
    for (unsigned k = 0; k < 2u; k++) {
        run_impressed(SUPERVISOR_IMPRESSED, 30.0f, 1.0);
        st.mode = MODE_TAKE_OVER;
        in.mode = modes[k];
        step();
        TEST_ASSERT_EQUAL_MEMORY(&none, &st.modes.i_f, sizeof none);
        TEST_ASSERT_EQUAL_MEMORY(&rested, &st.supervisor, sizeof rested);
        TEST_ASSERT_EQUAL_UINT32(0u, out.faults);
    }
}

static void test_a_reference_that_is_no_number_leaves_the_vector_turning(void)
{
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        run_impressed(SUPERVISOR_IMPRESSED, 30.0f, 1.0);
        in.omega_e_ref_rad_s = not_finite(k);
        for (int n = 0; n < 10; n++) {
            step_flickering();
            TEST_ASSERT_EQUAL_UINT32(0u, out.faults);
        }
        ASSERT_SAME_FLOAT(30.0f, st.modes.i_f.omega_rad_s);
        ASSERT_NEAR(1e-5, 0.7 + 10.0 * 30.0 * 2e-4, carg(of(st.modes.i_f.axis)));
    }
}

static void test_init_refuses_what_cannot_be_done_about_a_loss(void)
{
    const drive_params_t good = p;
    p.lost_action = (drive_lost_action_t)3;
    TEST_ASSERT_FALSE(drive_init(&cfg, &p, NULL));
    p = good;
    p.i_f.slew_A_per_s = 0.0f;
    TEST_ASSERT_FALSE(drive_init(&cfg, &p, NULL));
    /* No current to impress: refused only where it is wanted. */
    p.i_f = (i_f_params_t){0};
    TEST_ASSERT_FALSE(drive_init(&cfg, &p, NULL));
    p.lost_action = DRIVE_LOST_STOP;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, NULL));
    TEST_ASSERT_EQUAL(DRIVE_LOST_STOP, cfg.lost_action);
    p.lost_action = DRIVE_LOST_TELL;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, NULL));
    TEST_ASSERT_TRUE(drive_init(&cfg, &good, NULL));
    TEST_ASSERT_EQUAL(DRIVE_LOST_I_F, cfg.lost_action);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_run_is_supervised_and_nothing_else_is);
    RUN_TEST(test_a_dwell_without_torque_to_spare_is_none);
    RUN_TEST(test_a_torque_at_its_limit_takes_no_swing_away);
    RUN_TEST(test_told_only_nothing_but_the_verdict_differs);
    RUN_TEST(test_stop_is_a_fault_and_nothing_else);
    RUN_TEST(test_doubt_alone_is_acted_upon_by_nobody);
    RUN_TEST(test_the_supervisor_itself_brings_the_vector);
    RUN_TEST(test_take_over_starts_from_current_nominal_flux_and_wanted_speed);
    RUN_TEST(test_take_over_asks_for_the_current_there_is);
    RUN_TEST(test_a_limit_from_before_the_take_over_does_not_count);
    RUN_TEST(test_slow_the_speed_is_the_imposed_one);
    RUN_TEST(test_fast_the_speed_is_estimated_around_the_imposed_one);
    RUN_TEST(test_the_voltage_turns_with_the_vector);
    RUN_TEST(test_it_gives_up_above_the_return_frequency_only);
    RUN_TEST(test_hand_back_takes_torque_and_speed_along);
    RUN_TEST(test_hand_back_limits_the_torque_to_what_the_controller_may_ask);
    RUN_TEST(test_no_hand_back_below_the_return_frequency);
    RUN_TEST(test_the_schedule_goes_on_through_a_loss);
    RUN_TEST(test_while_a_current_holds_the_load_the_supervisor_goes_on);
    RUN_TEST(test_a_verdict_is_asked_for_in_the_supervisors_slots);
    RUN_TEST(test_hand_back_by_the_flux_that_the_voltage_shows);
    RUN_TEST(test_a_load_that_is_seen_to_be_held_is_not_given_up_soon);
    RUN_TEST(test_the_flux_is_looked_at_above_the_return_frequency);
    RUN_TEST(test_hand_back_without_flux_leaves_numbers);
    RUN_TEST(test_hand_back_does_not_move_the_voltage);
    RUN_TEST(test_nothing_is_impressed_outside_of_run);
    RUN_TEST(test_a_reference_that_is_no_number_leaves_the_vector_turning);
    RUN_TEST(test_init_refuses_what_cannot_be_done_about_a_loss);
    return UNITY_END();
}
