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
static uint32_t faults;

/* At 100 rad/s, as wanted, with nominal flux 30 degrees from alpha. */
static void configure(void)
{
    TEST_ASSERT_TRUE(drive_init(&drive, &p, NULL));
    cfg = &drive.modes.vector;
    const float lambda_Wb = cfg->flux.lambda_ref_Wb;
    faults = 0u;
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
    estimator_list.observer_gain_enable = 0u;
    configure();
}

void setUp(void)
{
    use_machine(1);
}

void tearDown(void)
{
}

/* As the drive does: slow work where it is due, then the current wanted. */
static dq_t step(void)
{
    in.slot = slot_next(in.slot);
    if (vector_slow_is_due(&st, slot_is_among(in.slot, VECTOR_SLOW_SLOTS))) {
        vector_slow(cfg, &drive.limits, &st, &in);
    }
    if (!mode_running(&in)) {
        return vector_wait(&st, estimate.omega_e_rad_s);
    }
    dq_t i_ref_A = vector_step(cfg, &st, estimate.omega_e_rad_s);
    if (vector_rides_through(cfg, &st, meas.u_dc_V)) {
        i_ref_A.q = vector_ride_through(cfg, &st, &in, i_ref_A.q, &faults);
    }
    return i_ref_A;
}

/* A period that plans the next four. */
static dq_t step_planned(void)
{
    in.slot = SLOT_QUARTER_REFERENCES - 1u;
    return step();
}

static ab_t axis(void)
{
    return mode_flux_axis(&estimate, vector_lambda_min_Wb(cfg, mode_running(&in)));
}

static void weaken(void)
{
    p.modes.flux = (flux_reference_params_t){.voltage_share = 0.9f,
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
    ASSERT_NEAR(1e-6, cos(0.5235987756), axis().alpha);
    ASSERT_NEAR(1e-6, sin(0.5235987756), axis().beta);
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
        ASSERT_NEAR(1e-6, enough ? 0.0 : 1.0, axis().alpha);
        ASSERT_NEAR(1e-6, enough ? 1.0 : 0.0, axis().beta);
    }
    estimate.lambda_Wb = NAN;
    ASSERT_SAME_FLOAT(1.0f, axis().alpha);
}

/* Bit for bit the speed controller, at nominal flux: flux and limits of every fourth period, the
 * speed of each. The first period plans wherever it falls. */
static void test_a_speed_is_wanted_of_flux_and_speed_control(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        use_machine(machine);
        speed_control_state_t speed = st.speed;
        speed_control_in_t speed_in = {.flux_pu = 1.0f, .inv_flux_pu = 1.0f};
        in.slot = 6u;
        for (int k = 0; k < 40; k++) {
            asked.omega_e_ref_rad_s = 120.0f + (float)k;
            estimate.omega_e_rad_s = 100.0f + 0.25f * (float)k;
            if ((k == 0) || (slot_next(in.slot) % 4u == 1u)) {
                speed_in.omega_ref_rad_s = asked.omega_e_ref_rad_s;
                speed_in.i_d_ref_A = cfg->flux.i_d_A;
                speed_control_limit(&cfg->speed, &speed, &speed_in);
                TEST_ASSERT_FALSE(speed_control_expects(&cfg->speed));
                speed.expected_step_rad_s = 0.0f; /* one bandwidth: nothing is expected */
            }
            const dq_t i_ref_A = step();
            ASSERT_SAME_FLOAT(speed_in.i_d_ref_A, i_ref_A.d);
            ASSERT_SAME_FLOAT(
                speed_control_step(&cfg->speed, &speed, &speed_in, estimate.omega_e_rad_s),
                i_ref_A.q);
            speed.ref_before_rad_s = st.speed.ref_before_rad_s; /* the schedule's */
            TEST_ASSERT_EQUAL_MEMORY(&speed, &st.speed, sizeof speed);
        }
    }
}

/* While the torque grows near zero frequency, no less than .7 of the torque current. */
static void test_a_torque_that_grows_keeps_the_flux(void)
{
    use_machine(0);
    for (int k = 0; k < 4; k++) {
        st.speed.i_q_A = ((k % 2) == 0) ? 20.0f : -20.0f;
        in.torque_surges = k < 2;
        st.planned = false;
        in.slot = 6u;
        vector_slow(cfg, &drive.limits, &st, &in);
        ASSERT_SAME_FLOAT(in.torque_surges ? 14.0f : cfg->flux.i_d_A, st.plan.i_d_ref_A);
    }
    in.torque_surges = true;
    st.speed.i_q_A = cfg->flux.i_d_A;
    st.planned = false;
    vector_slow(cfg, &drive.limits, &st, &in);
    ASSERT_SAME_FLOAT(cfg->flux.i_d_A, st.plan.i_d_ref_A);
}

/* By the number of the slot; without a plan of this run in any of them. */
static void test_slow_work_is_due_in_its_slots(void)
{
    for (uint32_t slot = 0u; slot < SLOT_COUNT; slot++) {
        st.planned = true;
        const bool due = (slot % 4u == 1u) || (slot == SLOT_FLUX_REFERENCE) ||
                         (slot == SLOT_FLUX_STEERING) || (slot == SLOT_SPEED_SCHEDULE);
        TEST_ASSERT_EQUAL(due, vector_slow_is_due(&st, slot_is_among(slot, VECTOR_SLOW_SLOTS)));
        st.planned = false;
        TEST_ASSERT_TRUE(vector_slow_is_due(&st, slot_is_among(slot, VECTOR_SLOW_SLOTS)));
        in.slot = slot;
        vector_slow(cfg, &drive.limits, &st, &in);
        TEST_ASSERT_TRUE(st.planned);
        TEST_ASSERT_NULL(st.plan.window); /* nothing of a period that is over is pointed at */
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
    ASSERT_NEAR(1e-5, 3.0 / (2.0 * kr * (double)p.speed.lambda_Wb), step().q);
    ASSERT_SAME_FLOAT(0.0f, st.ramp.steps);
    ASSERT_NEAR(1e-3, 100.0, st.speed.omega_ref_rad_s); /* speed mode goes on from it */
}

/* The estimator is told what torque beside the load's does, unless the flux is weakened or a lost
 * mains takes the torque: then nobody knows the load. */
static void test_a_change_of_speed_is_expected_where_the_load_is_known(void)
{
    in.slot = SLOT_QUARTER_REFERENCES - 1u;
    st.speed.gain_extra = 0.5f;
    vector_config_t told = *cfg;
    told.speed.step_rad_s_per_A = 0.25f;
    st.speed.pi.x = 1.0f;
    st.speed.i_q_A = 3.0f;
    for (int k = 0; k < 3; k++) {
        st.mains.active = k == 1;
        st.reference.reduction_Wb = (k == 2) ? 0.01f : 0.0f;
        st.planned = false;
        st.speed.expected_step_rad_s = 7.0f;
        vector_slow(&told, &drive.limits, &st, &in);
        ASSERT_SAME_FLOAT((k == 0) ? 0.25f : 0.0f, st.speed.expected_step_rad_s);
    }
}

/* The estimate knows of an M that is not what was told; of no flux at all it says nothing. */
static void test_torque_mode_makes_up_for_the_flux_that_is_there(void)
{
    const double there[4] = {0.85, 1.15, 0.1, 3.0};
    const double made_up_for[4] = {0.85, 1.15, (double)0.67f, 1.5};
    const double kr = (double)p.motor.M_H / (double)p.motor.Lr_H;
    asked.aim = DRIVE_AIM_TORQUE;
    asked.torque_ref_Nm = -3.0f;
    for (int n = 0; n < 4; n++) {
        estimate.lambda_Wb = (float)there[n] * cfg->flux.lambda_ref_Wb;
        for (int k = 0; k < 100; k++) {
            (void)step();
        }
        ASSERT_NEAR(2e-5, -3.0 / (2.0 * kr * (double)p.speed.lambda_Wb) / made_up_for[n], step().q);
    }
}

static void test_a_stop_takes_its_own_ramp(void)
{
    asked.aim = DRIVE_AIM_STOP;
    asked.omega_e_ref_rad_s = 0.0f;
    in.slot = SLOT_QUARTER_REFERENCES - 1u;
    for (int k = 0; k < 4; k++) {
        (void)step();
        ASSERT_NEAR(1e-5, 100.0 - 500.0 * 800e-6, st.speed.omega_ref_rad_s);
    }
    asked.aim = DRIVE_AIM_SPEED; /* no jerk limit: the slew limit alone */
    for (int k = 1; k <= 4; k++) {
        (void)step();
        ASSERT_NEAR(2e-5, 99.6 - k * 4000.0 * 200e-6, st.speed.omega_ref_rad_s);
    }
}

static void test_not_running_there_is_flux_without_torque(void)
{
    asked.mode = DRIVE_PREMAGNETISE;
    st.speed.i_q_A = 5.0f;
    for (int k = 0; k < 3; k++) {
        const dq_t i_ref_A = step();
        ASSERT_SAME_FLOAT(0.0f, i_ref_A.q);
        ASSERT_SAME_FLOAT(4.0f, i_ref_A.d);
        ASSERT_SAME_FLOAT(0.0f, st.speed.pi.x);
        ASSERT_SAME_FLOAT(100.0f, st.speed.omega_ref_rad_s);
        ASSERT_SAME_FLOAT(100.0f, st.speed.omega_filtered_rad_s);
    }
}

/* The window of heat, link and pull-out; at full flux, where no limit acts, there is none. */
static void test_the_torque_current_stays_in_its_window(void)
{
    st.speed.pi.x = 11.0f;
    ASSERT_NEAR(0.1, 11.0, step_planned().q);
    st.speed.pi.x = 11.0f;
    limits.overload = (overload_state_t){.derating = true, .i_max_A = 5.0f};
    ASSERT_NEAR(1e-5, 3.0, step_planned().q); /* 4 of 5 A magnetise */
    limits.overload.derating = false;
    st.pull_out_near = true;
    st.reference.i_q_reduction_A = 4.5f;
    st.speed.pi.x = 11.0f;
    ASSERT_NEAR(1e-5, 7.5, step_planned().q);
    st.reference.i_q_reduction_A = 0.0f;
    st.pull_out_near = false;
    st.speed.pi.x = 11.0f;
    ASSERT_NEAR(0.1, 11.0, step_planned().q);
}

/* A quarter less flux: i_d goes with it, and the same torque takes a third more current. */
static void test_less_flux_takes_more_current_for_the_torque(void)
{
    steer();
    st.steer = (flux_steering_out_t){.reduction_Wb = 0.25f * cfg->flux.lambda_ref_Wb};
    vector_catch(cfg, &st, 0.0f, 540.0f); /* no weakening: steering alone */
    ASSERT_NEAR(1e-6, 0.25 * (double)cfg->flux.lambda_ref_Wb, st.flux_reduction_Wb);
    ASSERT_NEAR(1e-6, 1.0, st.i_d_reduction_A);
    ASSERT_NEAR(1e-6, 1.0 / 0.75 - 1.0, st.torque_gain_extra_pu);
    const dq_t i_ref_A = step();
    ASSERT_NEAR(1e-6, 3.0, i_ref_A.d);
    ASSERT_NEAR(1e-5, 2.0 / 0.75, i_ref_A.q);
}

/* The voltage of the last duties and the torque of now, in its own period alone. */
static void test_the_voltage_limit_lowers_the_flux_in_its_slot(void)
{
    weaken();
    acting.legs_V = (ab_t){300.0f, 330.0f};
    for (in.slot = 0u; in.slot < SLOT_COUNT; in.slot++) {
        st.reference = (flux_reference_state_t){0};
        vector_slow(cfg, &drive.limits, &st, &in);
        TEST_ASSERT_EQUAL(in.slot == SLOT_FLUX_REFERENCE, st.reference.reduction_Wb > 0.0f);
    }
    /* Weakened below the flux that is there: the estimate decides about pull-out. */
    flux_reference_state_t expected = {.weakened_Wb = 0.9f * cfg->reference.lambda_nominal_Wb};
    st.reference = expected;
    in.slot = SLOT_FLUX_REFERENCE;
    const flux_reference_in_t reference_in = {
        .u_V = sqrtf(300.0f * 300.0f + 330.0f * 330.0f),
        .u_dc_V = 540.0f,
        .omega_s_rad_s = 103.0f,
        .lambda_Wb = estimate.lambda_Wb,
        .torque_Nm =
            motor_torque_Nm(&cfg->motor, estimate.lambda_Wb, ab_cross(axis(), meas.i_s_A))};
    flux_reference_step(&cfg->reference, &expected, &reference_in);
    vector_slow(cfg, &drive.limits, &st, &in);
    TEST_ASSERT_EQUAL_MEMORY(&expected, &st.reference, sizeof expected);
    ASSERT_SAME_FLOAT(expected.reduction_Wb, st.flux_reduction_Wb);
}

/* As if there were less voltage, by the share that the link takes from braking; half at the most.
 */
static void test_a_full_link_lowers_the_flux(void)
{
    const float taken_pu[] = {0.0f, 0.25f, 0.5f, 1.0f};
    const float u_dc_V[] = {540.0f, 405.0f, 270.0f, 270.0f};
    weaken();
    acting.legs_V = (ab_t){200.0f, 220.0f};
    in.slot = SLOT_FLUX_REFERENCE;
    for (int k = 0; k < 4; k++) {
        flux_reference_state_t expected = {.weakened_Wb = 0.1f};
        st.reference = expected;
        limits.link.taken_pu = taken_pu[k];
        const flux_reference_in_t reference_in = {.u_V = sqrtf(200.0f * 200.0f + 220.0f * 220.0f),
                                                  .u_dc_V = u_dc_V[k],
                                                  .omega_s_rad_s = 103.0f,
                                                  .lambda_Wb = estimate.lambda_Wb};
        flux_reference_step(&cfg->reference, &expected, &reference_in);
        vector_slow(cfg, &drive.limits, &st, &in);
        ASSERT_SAME_FLOAT(expected.weakened_Wb, st.reference.weakened_Wb);
        TEST_ASSERT_EQUAL(k > 0, st.reference.weakened_Wb > 0.1f);
    }
}

/* Switched off while it acts: the flux comes back, and then nothing is stepped any more. */
static void test_a_voltage_limit_that_is_switched_off_lets_go(void)
{
    st.reference.reduction_Wb = 0.2f;
    st.reference.weakened_Wb = 0.2f;
    st.planned = true;
    in.slot = SLOT_FLUX_REFERENCE;
    vector_slow(cfg, &drive.limits, &st, &in);
    ASSERT_SAME_FLOAT(0.0f, st.flux_reduction_Wb);
    const vector_state_t before = st;
    vector_slow(cfg, &drive.limits, &st, &in);
    TEST_ASSERT_EQUAL_MEMORY(&before, &st, sizeof before);
}

static void test_steering_has_a_slot_of_its_own(void)
{
    steer();
    st.speed.omega_ref_rad_s = -3.0f;
    st.speed.omega_filtered_rad_s = -5.0f;
    for (in.slot = 0u; in.slot < SLOT_COUNT; in.slot++) {
        st.steering = (flux_steering_state_t){0};
        st.speed.omega_ref_rad_s = -3.0f;
        vector_slow(cfg, &drive.limits, &st, &in);
        TEST_ASSERT_EQUAL(in.slot == SLOT_FLUX_STEERING, st.steering.reduction_Wb > 0.0f);
    }
    flux_steering_state_t expected = {0};
    st.steering = expected;
    in.slot = SLOT_FLUX_STEERING;
    const float torque_Nm =
        motor_torque_Nm(&cfg->motor, estimate.lambda_Wb, ab_cross(axis(), meas.i_s_A));
    const flux_steering_out_t steer_out =
        flux_steering_step(&cfg->steering, &expected, -3.0f, -5.0f, torque_Nm);
    vector_slow(cfg, &drive.limits, &st, &in);
    ASSERT_SAME_FLOAT(steer_out.reduction_Wb, st.flux_reduction_Wb);
    ASSERT_SAME_FLOAT(expected.torque_Nm, st.steering.torque_Nm);
    /* Asked to stand, a modulation on top: the estimate does not count. */
    expected = (flux_steering_state_t){0};
    st.steering = expected;
    st.modulation.speed_rad_s = -3.0f;
    (void)flux_steering_step(&cfg->steering, &expected, -3.0f, -3.0f, torque_Nm);
    vector_slow(cfg, &drive.limits, &st, &in);
    ASSERT_SAME_FLOAT(expected.reduction_Wb, st.steering.reduction_Wb);
    st.modulation.speed_rad_s = 0.0f;
    /* Torque mode: the reference is the filtered estimate of the step before. */
    expected = (flux_steering_state_t){.omega_rad_s = -4.0f};
    st.steering = expected;
    asked.aim = DRIVE_AIM_TORQUE;
    (void)flux_steering_step(&cfg->steering, &expected, -4.0f, -5.0f, torque_Nm);
    vector_slow(cfg, &drive.limits, &st, &in);
    ASSERT_SAME_FLOAT(expected.omega_rad_s, st.steering.omega_rad_s);
    ASSERT_SAME_FLOAT(expected.reduction_Wb, st.steering.reduction_Wb);
    asked.aim = DRIVE_AIM_SPEED;
    /* The slip of a warm rotor with more M: 1.5/1.25^2 of it. */
    expected = (flux_steering_state_t){0};
    st.steering = expected;
    in.Rr_pu = 1.5f;
    in.M_pu = 1.25f;
    (void)flux_steering_step(&cfg->steering, &expected, -3.0f, -5.0f, torque_Nm * 1.5f / 1.5625f);
    vector_slow(cfg, &drive.limits, &st, &in);
    ASSERT_SAME_FLOAT(expected.torque_Nm, st.steering.torque_Nm);
}

static void test_the_speed_schedule_has_a_slot_of_its_own(void)
{
    p.speed.fast_bandwidth_rad_s = 40.0f;
    p.speed.slow_rad_s = 10.0f;
    p.speed.fast_rad_s = 50.0f;
    configure();
    for (in.slot = 0u; in.slot < SLOT_COUNT; in.slot++) {
        st.speed.gain_extra = 0.0f;
        vector_slow(cfg, &drive.limits, &st, &in);
        ASSERT_NEAR(1e-6, (in.slot == SLOT_SPEED_SCHEDULE) ? 1.0 : 0.0, st.speed.gain_extra);
    }
    /* It sees the flux reference: at half of nominal flux half of the doubled bandwidth is left.
     * And what the voltage limit leaves: then slip takes of it. */
    in.slot = SLOT_SPEED_SCHEDULE;
    st.plan.flux_pu = 0.5f;
    vector_slow(cfg, &drive.limits, &st, &in);
    ASSERT_NEAR(1e-6, 0.0, st.speed.gain_extra);
    st.reference.weakened_Wb = 0.75f * cfg->flux.lambda_ref_Wb;
    st.plan.flux_pu = 0.25f;
    vector_slow(cfg, &drive.limits, &st, &in);
    const double bound = fmin(1.25 * (double)cfg->speed.slip_room * 0.25, 1.0);
    TEST_ASSERT_TRUE(bound < 1.0);
    ASSERT_NEAR(1e-5, 2.0 * 0.25 * bound - 1.0, st.speed.gain_extra);
}

/* The lower reference counts, with its own rate: half the rate over tau is what i_d anticipates. */
static void test_the_lower_of_both_flux_references_counts(void)
{
    weaken();
    st.steer = (flux_steering_out_t){.reduction_Wb = 0.1f, .rate_Wb_per_s = -0.5f};
    vector_catch(cfg, &st, 0.0f, 540.0f);
    TEST_ASSERT_FALSE(st.pull_out_near);
    ASSERT_SAME_FLOAT(0.1f, st.flux_reduction_Wb);
    const double M_H = (double)p.motor.M_H, tau_per_s = (double)(p.motor.Rr_ohm / p.motor.Lr_H);
    ASSERT_NEAR(1e-5, (0.1 + 0.5 / tau_per_s) / M_H, st.i_d_reduction_A);
    /* At 1000 rad/s of 540 V: .9 x .707 x 540 / 1000 Wb at once. */
    vector_catch(cfg, &st, -1000.0f, 540.0f);
    const double room_Wb = 0.9 * sqrt(0.5) * 540.0 / 1000.0;
    ASSERT_NEAR(1e-5, 0.6888 - room_Wb, st.flux_reduction_Wb);
    ASSERT_NEAR(1e-4, (0.6888 - room_Wb) / M_H, st.i_d_reduction_A);
}

/* Any torque current that the flux reference takes away needs the window. */
static void test_half_an_ampere_less_is_near_the_pull_out(void)
{
    const float reduction_A[] = {0.0f, 0.5f};
    for (int n = 0; n < 2; n++) {
        st.reference.i_q_reduction_A = reduction_A[n];
        vector_stop_steering(cfg, &st); /* chooses anew */
        TEST_ASSERT_EQUAL(n == 1, st.pull_out_near);
    }
}

static void test_a_seed_begins_with_torque_and_speed_of_then(void)
{
    st.ramp.steps = 9.0f;
    st.planned = true;
    vector_seed(cfg, &st, 5.0f, 30.0f, 27.0f);
    TEST_ASSERT_FALSE(st.planned); /* what was planned was of then */
    ASSERT_SAME_FLOAT(5.0f, st.speed.pi.x);
    ASSERT_SAME_FLOAT(5.0f, st.speed.i_q_A);
    ASSERT_SAME_FLOAT(30.0f, st.speed.omega_ref_rad_s);
    ASSERT_SAME_FLOAT(27.0f, st.speed.omega_filtered_rad_s);
    ASSERT_SAME_FLOAT(0.0f, st.ramp.steps);
    vector_seed(cfg, &st, -50.0f, 30.0f, 27.0f);
    ASSERT_SAME_FLOAT(-12.0f, st.speed.pi.x);
}

static void test_at_rest_the_speed_controller_begins_again(void)
{
    st.planned = true;
    vector_rest(&st);
    const speed_control_state_t rested = {0};
    TEST_ASSERT_EQUAL_MEMORY(&rested, &st.speed, sizeof rested);
    TEST_ASSERT_FALSE(st.planned);
}

/* What the voltage limit took stays taken. */
static void test_steering_that_is_stopped_leaves_the_other_reference(void)
{
    st.steering =
        (flux_steering_state_t){.torque_Nm = 3.0f, .reduction_Wb = 0.2f, .steering = true};
    st.steer = (flux_steering_out_t){.reduction_Wb = 0.2f, .rate_Wb_per_s = 1.0f, .moving = true};
    st.reference.reduction_Wb = 0.05f;
    st.flux_reduction_Wb = 0.2f;
    vector_stop_steering(cfg, &st);
    ASSERT_SAME_FLOAT(0.05f, st.flux_reduction_Wb);
    ASSERT_SAME_FLOAT(0.0f, st.steering.torque_Nm);
    ASSERT_SAME_FLOAT(0.0f, st.steering.reduction_Wb);
    TEST_ASSERT_FALSE(st.steering.steering);
    ASSERT_SAME_FLOAT(0.0f, st.steer.reduction_Wb);
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
    ASSERT_NEAR(0.01, 2.0, step().q);
    TEST_ASSERT_FALSE(st.mains.active);
    meas.u_dc_V = 390.0f;
    st.ramp.steps = 9.0f;
    const dq_t i_ref_A = step();
    TEST_ASSERT_TRUE(st.mains.active);
    ASSERT_SAME_FLOAT(0.0f, st.ramp.steps);
    const double kr = (double)p.motor.M_H / (double)p.motor.Lr_H;
    const double i_q_A = -20.0 * 30.0 / (kr * 0.6888 * 100.0); /* P = kr lambda i_q w */
    ASSERT_NEAR(1e-4, i_q_A, i_ref_A.q);
    ASSERT_NEAR(1e-4, i_q_A, st.speed.pi.x);
    ASSERT_NEAR(1e-4, i_q_A, st.speed.i_q_A);
    ASSERT_SAME_FLOAT(st.speed.omega_filtered_rad_s, st.speed.omega_ref_rad_s);
    TEST_ASSERT_EQUAL_HEX32(0u, faults);
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
    const float i_q_A = step().q;
    ASSERT_NEAR(1e-4, 1.25 * (double)st.mains.i_q_A, i_q_A);
    meas.u_dc_V = 300.0f;
    ASSERT_SAME_FLOAT(-12.0f, step().q);
}

static void test_a_shaft_too_slow_to_feed_is_a_fault(void)
{
    lose_mains();
    meas.u_dc_V = 390.0f;
    (void)step();
    estimate.omega_e_rad_s = 14.0f;
    faults = FAULT_DERATED; /* of somebody else */
    TEST_ASSERT_EQUAL_FLOAT(0.0f, step().q);
    TEST_ASSERT_EQUAL_HEX32(FAULT_DERATED | FAULT_MAINS_LOST, faults);
}

/* Too slow from the start: it goes on with what the capacitors hold, and the torque that it was. */
static void test_a_slow_shaft_changes_nothing_in_a_dip(void)
{
    lose_mains();
    estimate.omega_e_rad_s = 14.0f;
    st.speed.omega_filtered_rad_s = 100.0f;
    vector_state_t usual = st;
    in.slot = 0u;
    meas.u_dc_V = 390.0f;
    const float i_q_A = step().q;
    meas.u_dc_V = 540.0f;
    const vector_state_t dipped = st;
    st = usual;
    in.slot = 0u;
    ASSERT_SAME_FLOAT(step().q, i_q_A);
    TEST_ASSERT_EQUAL_MEMORY(&st.speed, &dipped.speed, sizeof st.speed);
    TEST_ASSERT_EQUAL_HEX32(0u, faults);
}

/* On top of the reference, and not in what the ramp goes on from. */
static void test_a_modulation_is_on_top_of_the_speed_reference(void)
{
    vector_modulate(cfg, &st, (vector_modulation_t){.speed_rad_s = 1.5f});
    step_planned();
    TEST_ASSERT_EQUAL_FLOAT(101.5f, st.plan.omega_ref_rad_s);
    st.speed.omega_ref_rad_s = 101.5f; /* behind the slew */
    TEST_ASSERT_EQUAL_FLOAT(100.0f, vector_unmodulated_rad_s(&st));
    asked.aim = DRIVE_AIM_STOP;
    asked.omega_e_ref_rad_s = 0.0f;
    step_planned();
    const float ramp_rad_s = st.plan.omega_ref_rad_s - 1.5f;
    TEST_ASSERT_TRUE((ramp_rad_s < 100.0f) && (ramp_rad_s > 99.0f));
}

/* On what steering leaves; the current is that of the flux and of its rate, and what is asked of
 * i_q makes up for the flux. */
static void test_a_modulated_flux_takes_its_current_along(void)
{
    const double lambda_Wb = (double)cfg->flux.lambda_ref_Wb;
    st.steer = (flux_steering_out_t){.reduction_Wb = 0.25f * cfg->flux.lambda_ref_Wb};
    vector_modulate(cfg, &st, (vector_modulation_t){.flux_pu = 0.2f, .rate_pu_per_s = 0.5f});
    const double flux_Wb = 0.75 * 0.8 * lambda_Wb;
    const double rate_Wb_per_s = -0.75 * 0.5 * lambda_Wb;
    const double i_d_A =
        (flux_Wb + rate_Wb_per_s / (double)cfg->motor.tau_per_s) / (double)cfg->motor.M_H;
    ASSERT_NEAR(1e-5, i_d_A, cfg->flux.i_d_A - st.i_d_reduction_A);
    ASSERT_NEAR(1e-5, 1.0 / 0.6 - 1.0, st.torque_gain_extra_pu);
    vector_modulate(cfg, &st, (vector_modulation_t){0});
    ASSERT_NEAR(1e-6, 0.25 * lambda_Wb, st.flux_reduction_Wb);
    ASSERT_NEAR(1e-5, 0.75 * (double)cfg->flux.i_d_A, cfg->flux.i_d_A - st.i_d_reduction_A);
}

static void test_it_steers_while_the_flux_is_lowered_and_the_shaft_is_to_turn(void)
{
    vector_state_t state = {.steering = {.steering = true}};
    state.speed.omega_ref_rad_s = -3.0f;
    TEST_ASSERT_TRUE(vector_steers(&state));
    state.modulation.speed_rad_s = -3.0f; /* of a shaft that is asked to stand */
    TEST_ASSERT_FALSE(vector_steers(&state));
    state.modulation.speed_rad_s = 0.0f;
    state.steering.steering = false;
    TEST_ASSERT_FALSE(vector_steers(&state));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_frame_is_that_of_the_flux);
    RUN_TEST(test_without_flux_the_frame_stands);
    RUN_TEST(test_a_speed_is_wanted_of_flux_and_speed_control);
    RUN_TEST(test_a_torque_that_grows_keeps_the_flux);
    RUN_TEST(test_slow_work_is_due_in_its_slots);
    RUN_TEST(test_a_torque_is_wanted_as_its_current);
    RUN_TEST(test_a_change_of_speed_is_expected_where_the_load_is_known);
    RUN_TEST(test_torque_mode_makes_up_for_the_flux_that_is_there);
    RUN_TEST(test_a_stop_takes_its_own_ramp);
    RUN_TEST(test_not_running_there_is_flux_without_torque);
    RUN_TEST(test_the_torque_current_stays_in_its_window);
    RUN_TEST(test_less_flux_takes_more_current_for_the_torque);
    RUN_TEST(test_the_voltage_limit_lowers_the_flux_in_its_slot);
    RUN_TEST(test_a_full_link_lowers_the_flux);
    RUN_TEST(test_a_voltage_limit_that_is_switched_off_lets_go);
    RUN_TEST(test_steering_has_a_slot_of_its_own);
    RUN_TEST(test_the_speed_schedule_has_a_slot_of_its_own);
    RUN_TEST(test_the_lower_of_both_flux_references_counts);
    RUN_TEST(test_half_an_ampere_less_is_near_the_pull_out);
    RUN_TEST(test_a_seed_begins_with_torque_and_speed_of_then);
    RUN_TEST(test_at_rest_the_speed_controller_begins_again);
    RUN_TEST(test_steering_that_is_stopped_leaves_the_other_reference);
    RUN_TEST(test_it_steers_while_the_flux_is_lowered_and_the_shaft_is_to_turn);
    RUN_TEST(test_in_a_dip_the_shaft_holds_the_link);
    RUN_TEST(test_in_a_dip_the_limit_of_the_current_holds);
    RUN_TEST(test_a_shaft_too_slow_to_feed_is_a_fault);
    RUN_TEST(test_a_slow_shaft_changes_nothing_in_a_dip);
    RUN_TEST(test_a_modulation_is_on_top_of_the_speed_reference);
    RUN_TEST(test_a_modulated_flux_takes_its_current_along);
    return UNITY_END();
}
