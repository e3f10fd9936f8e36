/* Flux-oriented control: frame, flux, torque current; what lowers and what replaces them. */
#include "vector.h"

#include <complex.h>

#include "drive_fixture.h"
#include "exact.h"
#include "fault.h"
#include "mode_fixture.h"

static drive_params_t p;
static drive_config_t drive; /* its parts go together: what is looked at is `cfg` */
static vector_config_t *cfg;
static vector_state_t st;
static mode_out_t out;

/* At 100 rad/s, as wanted, with nominal flux 30 degrees from alpha. */
static void configure(void)
{
    TEST_ASSERT_TRUE(drive_init(&drive, &p, NULL));
    cfg = &drive.modes.vector;
    const float lambda_Wb = cfg->flux.lambda_ref_Wb;
    out = (mode_out_t){0};
    mode_fixture_start();
    estimate = (estimate_t){.lambda_r_hat_Wb = {0.8660254f * lambda_Wb, 0.5f * lambda_Wb},
                            .lambda_Wb = lambda_Wb,
                            .omega_e_rad_s = 100.0f,
                            .omega_s_rad_s = 103.0f};
    st = (vector_state_t){
        .speed = {.omega_ref_rad_s = 100.0f, .omega_filtered_rad_s = 100.0f, .pi = {2.0f}}};
    meas.i_s_A = (ab_t){3.0f, 4.0f};
    asked.omega_e_ref_rad_s = 100.0f;
}

static void use_machine(int machine)
{
    p = both_machines(machine);
    p.observer_gain_enable = false;
    configure();
}

void setUp(void)
{
    use_machine(1);
}

void tearDown(void)
{
}

static request_t step(void)
{
    vector_step(cfg, &drive.limits, &st, &in, &out);
    return out.request;
}

static void weaken(void)
{
    p.modes.level = (flux_reference_params_t){.voltage_share = 0.9f,
                                              .bandwidth_rad_s = 20.0f,
                                              .pull_out_share = 0.8f,
                                              .economy_filter_s = 0.5f,
                                              .economy_slew_Wb_per_s = 0.4f,
                                              .lambda_nominal_Wb = 0.6888f,
                                              .lambda_min_Wb = 0.06f,
                                              .i_q_max_A = 12.0f};
    configure();
}

static void steer(void)
{
    p.steering = (flux_steering_params_t){.min_rad_s = 9.0f,
                                          .hysteresis_rad_s = 1.0f,
                                          .lambda_nominal_Wb = 0.6888f,
                                          .lambda_min_Wb = 0.3f,
                                          .torque_min_Nm = 0.1f,
                                          .torque_filter_s = 2e-3f,
                                          .slew_Wb_per_s = 5.0f,
                                          .i_q_max_A = 12.0f};
    configure();
}

static void test_the_frame_is_that_of_the_flux(void)
{
    const request_t r = step();
    TEST_ASSERT_EQUAL(REQUEST_CURRENT, r.kind);
    ASSERT_NEAR(1e-6, cos(0.5235987756), r.axis.alpha);
    ASSERT_NEAR(1e-6, sin(0.5235987756), r.axis.beta);
    TEST_ASSERT_EQUAL_HEX32(0u, out.faults);
}

/* Fixed where no flux says where; caught in turning a hundredth of that says enough. */
static void test_without_flux_the_frame_stands(void)
{
    const float least_Wb = 0.05f * cfg->flux.lambda_ref_Wb;
    ASSERT_NEAR(1e-7, least_Wb, vector_lambda_min_Wb(cfg, true));
    ASSERT_NEAR(1e-9, 0.01f * least_Wb, vector_lambda_min_Wb(cfg, false));
    for (int k = 0; k < 4; k++) {
        const bool running = k < 2;
        const bool enough = (k % 2) == 1;
        asked.mode = running ? DRIVE_RUN : DRIVE_PREMAGNETISE;
        estimate.lambda_Wb = vector_lambda_min_Wb(cfg, running) * (enough ? 1.001f : 0.999f);
        estimate.lambda_r_hat_Wb = (ab_t){0.0f, estimate.lambda_Wb};
        const request_t r = step();
        ASSERT_NEAR(1e-6, enough ? 0.0 : 1.0, r.axis.alpha);
        ASSERT_NEAR(1e-6, enough ? 1.0 : 0.0, r.axis.beta);
    }
    estimate.lambda_Wb = NAN;
    ASSERT_SAME_FLOAT(1.0f, step().axis.alpha);
}

/* Bit for bit the two controllers, at nominal flux. */
static void test_a_speed_is_wanted_of_flux_and_speed_control(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        use_machine(machine);
        speed_control_state_t speed = st.speed;
        flux_control_state_t flux = st.flux;
        for (int k = 0; k < 40; k++) {
            asked.omega_e_ref_rad_s = 120.0f;
            estimate.omega_e_rad_s = 100.0f + 0.25f * (float)k;
            const flux_control_in_t flux_in = {.lambda_hat_Wb = estimate.lambda_Wb};
            const float i_d_A = flux_control_step(&cfg->flux, &flux, &flux_in);
            const speed_control_in_t speed_in = {.omega_ref_rad_s = 120.0f,
                                                 .omega_hat_rad_s = estimate.omega_e_rad_s,
                                                 .i_d_ref_A = i_d_A,
                                                 .flux_pu = 1.0f,
                                                 .inv_flux_pu = 1.0f};
            const request_t r = step();
            ASSERT_SAME_FLOAT(i_d_A, r.i_ref_A.d);
            ASSERT_SAME_FLOAT(speed_control_step(&cfg->speed, &speed, &speed_in), r.i_ref_A.q);
            TEST_ASSERT_EQUAL_MEMORY(&speed, &st.speed, sizeof speed);
        }
    }
}

/* T = p kr lambda i_q, on its slew; the ramp is forgotten. */
static void test_a_torque_is_wanted_as_its_current(void)
{
    st.speed.pi.x = 0.0f;
    st.ramp.steps = 9.0f;
    asked.aim = DRIVE_AIM_TORQUE;
    asked.torque_ref_Nm = 3.0f;
    asked.omega_e_ref_rad_s = NAN; /* not looked at */
    for (int k = 0; k < 100; k++) {
        (void)step();
    }
    const double kr = (double)p.motor.M_H / (double)p.motor.Lr_H;
    ASSERT_NEAR(1e-5, 3.0 / (2.0 * kr * (double)p.speed.lambda_Wb), step().i_ref_A.q);
    ASSERT_SAME_FLOAT(0.0f, st.ramp.steps);
    ASSERT_NEAR(1e-3, 100.0, st.speed.omega_ref_rad_s); /* speed mode goes on from it */
}

static void test_a_stop_takes_its_own_ramp(void)
{
    asked.aim = DRIVE_AIM_STOP;
    asked.omega_e_ref_rad_s = 0.0f;
    (void)step();
    ASSERT_NEAR(1e-5, 100.0 - 500.0 * 200e-6, st.speed.omega_ref_rad_s);
    asked.aim = DRIVE_AIM_SPEED; /* no jerk limit: the slew limit alone */
    (void)step();
    ASSERT_NEAR(1e-5, 99.9 - 4000.0 * 200e-6, st.speed.omega_ref_rad_s);
}

static void test_not_running_there_is_flux_without_torque(void)
{
    asked.mode = DRIVE_PREMAGNETISE;
    st.speed.i_q_A = 5.0f;
    for (int k = 0; k < 3; k++) {
        const request_t r = step();
        ASSERT_SAME_FLOAT(0.0f, r.i_ref_A.q);
        ASSERT_SAME_FLOAT(4.0f, r.i_ref_A.d);
        ASSERT_SAME_FLOAT(0.0f, st.speed.pi.x);
        ASSERT_SAME_FLOAT(100.0f, st.speed.omega_ref_rad_s);
        ASSERT_SAME_FLOAT(100.0f, st.speed.omega_filtered_rad_s);
    }
}

/* The window of heat, link and pull-out; at full flux, where no limit acts, there is none. */
static void test_the_torque_current_stays_in_its_window(void)
{
    st.speed.pi.x = 11.0f;
    ASSERT_NEAR(0.1, 11.0, step().i_ref_A.q);
    st.speed.pi.x = 11.0f;
    limits.overload = (overload_state_t){.derating = true, .i_max_A = 5.0f};
    ASSERT_NEAR(1e-5, 3.0, step().i_ref_A.q); /* 4 of 5 A magnetise */
    limits.overload.derating = false;
    st.pull_out_near = true;
    st.reference.i_q_less_A = 4.5f;
    st.speed.pi.x = 11.0f;
    ASSERT_NEAR(1e-5, 7.5, step().i_ref_A.q);
    st.reference.i_q_less_A = 0.0f;
    st.pull_out_near = false;
    st.speed.pi.x = 11.0f;
    ASSERT_NEAR(0.1, 11.0, step().i_ref_A.q);
}

/* A quarter less flux: i_d goes with it, and the same torque takes a third more current. */
static void test_less_flux_takes_more_current_for_the_torque(void)
{
    steer();
    st.steer = (flux_steering_out_t){.below_Wb = 0.25f * cfg->flux.lambda_ref_Wb};
    vector_catch(cfg, &st, 0.0f, 540.0f); /* no weakening: steering alone */
    ASSERT_NEAR(1e-6, 0.25 * (double)cfg->flux.lambda_ref_Wb, st.flux_reduction_Wb);
    ASSERT_NEAR(1e-6, 1.0, st.i_d_reduction_A);
    ASSERT_NEAR(1e-6, 1.0 / 0.75 - 1.0, st.torque_gain_extra_pu);
    const request_t r = step();
    ASSERT_NEAR(1e-6, 3.0, r.i_ref_A.d);
    ASSERT_NEAR(1e-5, 2.0 / 0.75, r.i_ref_A.q);
}

/* The voltage of the last duties and the torque of now, in its own period alone. */
static void test_the_voltage_limit_lowers_the_flux_in_its_slot(void)
{
    weaken();
    acting.pending_V = (ab_t){300.0f, 330.0f};
    const ab_t axis = {1.0f, 0.0f};
    for (uint32_t slot = 0u; slot < VECTOR_SLOW_PERIODS; slot++) {
        st.slow_period = slot;
        st.reference = (flux_reference_state_t){0};
        vector_slow(cfg, &st, &in, axis);
        TEST_ASSERT_EQUAL(slot == VECTOR_SLOW_FLUX, st.reference.below_Wb > 0.0f);
    }
    flux_reference_state_t expected = {0};
    st.reference = expected;
    st.slow_period = VECTOR_SLOW_FLUX;
    const flux_reference_in_t reference_in = {
        .u_V = sqrtf(300.0f * 300.0f + 330.0f * 330.0f),
        .u_dc_V = 540.0f,
        .omega_s_rad_s = 103.0f,
        .torque_Nm = motor_torque_Nm(&cfg->motor, estimate.lambda_Wb, 4.0f)};
    flux_reference_step(&cfg->reference, &expected, &reference_in);
    vector_slow(cfg, &st, &in, axis);
    TEST_ASSERT_EQUAL_MEMORY(&expected, &st.reference, sizeof expected);
    ASSERT_SAME_FLOAT(expected.below_Wb, st.flux_reduction_Wb);
}

/* Switched off while it acts: the flux comes back, and then nothing is stepped any more. */
static void test_a_voltage_limit_that_is_switched_off_lets_go(void)
{
    st.reference.below_Wb = 0.2f;
    st.reference.weakened_Wb = 0.2f;
    st.slow_period = VECTOR_SLOW_FLUX;
    vector_slow(cfg, &st, &in, (ab_t){1.0f, 0.0f});
    ASSERT_SAME_FLOAT(0.0f, st.flux_reduction_Wb);
    const vector_state_t before = st;
    vector_slow(cfg, &st, &in, (ab_t){1.0f, 0.0f});
    TEST_ASSERT_EQUAL_MEMORY(&before, &st, sizeof before);
}

static void test_steering_has_a_slot_of_its_own(void)
{
    steer();
    st.speed.omega_ref_rad_s = -3.0f;
    const ab_t axis = {1.0f, 0.0f};
    for (uint32_t slot = 0u; slot < VECTOR_SLOW_PERIODS; slot++) {
        st.slow_period = slot;
        st.steering = (flux_steering_state_t){0};
        vector_slow(cfg, &st, &in, axis);
        TEST_ASSERT_EQUAL(slot == VECTOR_SLOW_STEERING, st.steering.below_Wb > 0.0f);
    }
    flux_steering_state_t expected = {0};
    st.steering = expected;
    st.slow_period = VECTOR_SLOW_STEERING;
    const flux_steering_out_t steer_out = flux_steering_step(
        &cfg->steering, &expected, -3.0f, motor_torque_Nm(&cfg->motor, estimate.lambda_Wb, 4.0f));
    vector_slow(cfg, &st, &in, axis);
    ASSERT_SAME_FLOAT(steer_out.below_Wb, st.flux_reduction_Wb);
    ASSERT_SAME_FLOAT(expected.torque_Nm, st.steering.torque_Nm);
}

static void test_the_speed_schedule_has_a_slot_of_its_own(void)
{
    p.speed.fast_bandwidth_rad_s = 40.0f;
    p.speed.slow_rad_s = 10.0f;
    p.speed.fast_rad_s = 50.0f;
    configure();
    for (uint32_t slot = 0u; slot < VECTOR_SLOW_PERIODS; slot++) {
        st.slow_period = slot;
        st.speed.more = 0.0f;
        vector_slow(cfg, &st, &in, (ab_t){1.0f, 0.0f});
        ASSERT_NEAR(1e-6, (slot == VECTOR_SLOW_SCHEDULE) ? 1.0 : 0.0, st.speed.more);
    }
}

/* The lower reference counts, with its own rate: half the rate over tau is what i_d anticipates. */
static void test_the_lower_of_both_flux_references_counts(void)
{
    weaken();
    st.steer = (flux_steering_out_t){.below_Wb = 0.1f, .rate_Wb_per_s = -0.5f};
    vector_catch(cfg, &st, 0.0f, 540.0f);
    ASSERT_SAME_FLOAT(0.1f, st.flux_reduction_Wb);
    const double M_H = (double)p.motor.M_H, tau_per_s = (double)(p.motor.Rr_ohm / p.motor.Lr_H);
    ASSERT_NEAR(1e-5, (0.1 + 0.5 / tau_per_s) / M_H, st.i_d_reduction_A);
    /* At 1000 rad/s of 540 V: .9 x .707 x 540 / 1000 Wb at once. */
    vector_catch(cfg, &st, -1000.0f, 540.0f);
    const double room_Wb = 0.9 * sqrt(0.5) * 540.0 / 1000.0;
    ASSERT_NEAR(1e-5, 0.6888 - room_Wb, st.flux_reduction_Wb);
    ASSERT_NEAR(1e-4, (0.6888 - room_Wb) / M_H, st.i_d_reduction_A);
}

static void test_a_seed_begins_with_torque_and_speed_of_then(void)
{
    st.ramp.steps = 9.0f;
    vector_seed(cfg, &st, 5.0f, 30.0f, 27.0f);
    ASSERT_SAME_FLOAT(5.0f, st.speed.pi.x);
    ASSERT_SAME_FLOAT(5.0f, st.speed.i_q_A);
    ASSERT_SAME_FLOAT(30.0f, st.speed.omega_ref_rad_s);
    ASSERT_SAME_FLOAT(27.0f, st.speed.omega_filtered_rad_s);
    ASSERT_SAME_FLOAT(0.0f, st.ramp.steps);
    vector_seed(cfg, &st, -50.0f, 30.0f, 27.0f);
    ASSERT_SAME_FLOAT(-12.0f, st.speed.pi.x);
}

/* What the voltage limit took stays taken. */
static void test_steering_that_is_stopped_leaves_the_other_reference(void)
{
    st.steering = (flux_steering_state_t){.torque_Nm = 3.0f, .below_Wb = 0.2f, .steering = true};
    st.steer = (flux_steering_out_t){.below_Wb = 0.2f, .rate_Wb_per_s = 1.0f, .moving = true};
    st.reference.below_Wb = 0.05f;
    st.flux_reduction_Wb = 0.2f;
    vector_stop_steering(cfg, &st);
    ASSERT_SAME_FLOAT(0.05f, st.flux_reduction_Wb);
    ASSERT_SAME_FLOAT(0.0f, st.steering.torque_Nm);
    ASSERT_SAME_FLOAT(0.0f, st.steering.below_Wb);
    TEST_ASSERT_FALSE(st.steering.steering);
    ASSERT_SAME_FLOAT(0.0f, st.steer.below_Wb);
    TEST_ASSERT_FALSE(st.steer.moving);
}

static void lose_mains(void)
{
    p.modes.mains = (mains_loss_params_t){.u_lost_V = 400.0f,
                                          .u_hold_V = 420.0f,
                                          .u_back_V = 460.0f,
                                          .back_s = 0.0f,
                                          .gain_W_per_V = 20.0f,
                                          .stop_rad_s = 15.0f,
                                          .lambda_Wb = 0.6888f,
                                          .i_q_max_A = 12.0f};
    configure();
}

/* 20 W per volt below 420 V, taken from the shaft; the speed controller follows. */
static void test_in_a_dip_the_shaft_holds_the_link(void)
{
    lose_mains();
    meas.u_dc_V = 401.0f; /* not lost yet */
    ASSERT_NEAR(0.01, 2.0, step().i_ref_A.q);
    TEST_ASSERT_FALSE(st.mains.active);
    meas.u_dc_V = 390.0f;
    st.ramp.steps = 9.0f;
    const request_t r = step();
    TEST_ASSERT_TRUE(st.mains.active);
    ASSERT_SAME_FLOAT(0.0f, st.ramp.steps);
    const double kr = (double)p.motor.M_H / (double)p.motor.Lr_H;
    const double i_q_A = -20.0 * 30.0 / (kr * 0.6888 * 100.0); /* P = kr lambda i_q w */
    ASSERT_NEAR(1e-4, i_q_A, r.i_ref_A.q);
    ASSERT_NEAR(1e-4, i_q_A, st.speed.pi.x);
    ASSERT_NEAR(1e-4, i_q_A, st.speed.i_q_A);
    ASSERT_SAME_FLOAT(st.speed.omega_filtered_rad_s, st.speed.omega_ref_rad_s);
    TEST_ASSERT_EQUAL_HEX32(0u, out.faults);
    meas.u_dc_V = 461.0f; /* back at once: the controller is where the shaft was */
    (void)step();
    TEST_ASSERT_FALSE(st.mains.active);
}

/* With less flux the same power takes more current, up to the drive's own limit. */
static void test_in_a_dip_the_limit_of_the_current_holds(void)
{
    lose_mains();
    meas.u_dc_V = 390.0f;
    st.torque_gain_extra_pu = 0.25f;
    const float i_q_A = step().i_ref_A.q;
    ASSERT_NEAR(1e-4, 1.25 * (double)st.mains.i_q_A, i_q_A);
    meas.u_dc_V = 300.0f;
    ASSERT_SAME_FLOAT(-12.0f, step().i_ref_A.q);
}

static void test_a_shaft_too_slow_to_feed_is_a_fault(void)
{
    lose_mains();
    meas.u_dc_V = 390.0f;
    (void)step();
    estimate.omega_e_rad_s = 14.0f;
    out.faults = FAULT_DERATED; /* of somebody else */
    TEST_ASSERT_EQUAL_FLOAT(0.0f, step().i_ref_A.q);
    TEST_ASSERT_EQUAL_HEX32(FAULT_DERATED | FAULT_MAINS_LOST, out.faults);
}

/* Too slow from the start: it goes on with what the capacitors hold, and the torque that it was. */
static void test_a_slow_shaft_changes_nothing_in_a_dip(void)
{
    lose_mains();
    estimate.omega_e_rad_s = 14.0f;
    st.speed.omega_filtered_rad_s = 100.0f;
    vector_state_t usual = st;
    meas.u_dc_V = 390.0f;
    const float i_q_A = step().i_ref_A.q;
    meas.u_dc_V = 540.0f;
    const vector_state_t dipped = st;
    st = usual;
    ASSERT_SAME_FLOAT(step().i_ref_A.q, i_q_A);
    TEST_ASSERT_EQUAL_MEMORY(&st.speed, &dipped.speed, sizeof st.speed);
    TEST_ASSERT_EQUAL_HEX32(0u, out.faults);
}

static void test_no_dip_is_ridden_through_without_torque(void)
{
    lose_mains();
    asked.mode = DRIVE_PREMAGNETISE;
    meas.u_dc_V = 390.0f;
    ASSERT_SAME_FLOAT(0.0f, step().i_ref_A.q);
    TEST_ASSERT_FALSE(st.mains.active);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_frame_is_that_of_the_flux);
    RUN_TEST(test_without_flux_the_frame_stands);
    RUN_TEST(test_a_speed_is_wanted_of_flux_and_speed_control);
    RUN_TEST(test_a_torque_is_wanted_as_its_current);
    RUN_TEST(test_a_stop_takes_its_own_ramp);
    RUN_TEST(test_not_running_there_is_flux_without_torque);
    RUN_TEST(test_the_torque_current_stays_in_its_window);
    RUN_TEST(test_less_flux_takes_more_current_for_the_torque);
    RUN_TEST(test_the_voltage_limit_lowers_the_flux_in_its_slot);
    RUN_TEST(test_a_voltage_limit_that_is_switched_off_lets_go);
    RUN_TEST(test_steering_has_a_slot_of_its_own);
    RUN_TEST(test_the_speed_schedule_has_a_slot_of_its_own);
    RUN_TEST(test_the_lower_of_both_flux_references_counts);
    RUN_TEST(test_a_seed_begins_with_torque_and_speed_of_then);
    RUN_TEST(test_steering_that_is_stopped_leaves_the_other_reference);
    RUN_TEST(test_in_a_dip_the_shaft_holds_the_link);
    RUN_TEST(test_in_a_dip_the_limit_of_the_current_holds);
    RUN_TEST(test_a_shaft_too_slow_to_feed_is_a_fault);
    RUN_TEST(test_a_slow_shaft_changes_nothing_in_a_dip);
    RUN_TEST(test_no_dip_is_ridden_through_without_torque);
    return UNITY_END();
}
