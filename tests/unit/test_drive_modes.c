/* What the whole law does beside orientation, on a motor: starts at speed, brakes, runs open loop,
 * weakens its field, rides through.
 */
#include "drive.h"

#include <complex.h>
#include <float.h>
#include <math.h>

#include "exact.h"
#include "plant_fixture.h"
#include "transition.h"
#include "unity.h"

#define PERIOD_S 2e-4

static drive_params_t p;
static drive_config_t cfg;
static drive_state_t st;
static drive_in_t in;
static measurement_in_t sample;
static drive_out_t out;
static plant_t plant;

void setUp(void)
{
    p = every_mode();
    p.current.decoupling = 1.0f;
    st = (drive_state_t){0};
    in = (drive_in_t){.mode = DRIVE_PREMAGNETISE};
    plant = plant_of(p.motor, 0.0, 0.0);
}

void tearDown(void)
{
}

static void start(void)
{
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, NULL));
}

static uint32_t run(double time_s)
{
    uint32_t faults = 0u;
    for (int k = 0; k < (int)(time_s / PERIOD_S); k++) {
        sample = plant_words(&plant, &p);
        drive_step(&cfg, &st, &sample, &in, &out);
        faults |= out.faults;
        plant_advance(&plant, out.duty, PERIOD_S);
    }
    return faults;
}

static double flux_error(void)
{
    const ab_t hat = st.estimator.observer.lambda_r_hat_Wb;
    return cabs((double)hat.alpha + I * (double)hat.beta - plant.psi_r_Wb);
}

static bool refused(void)
{
    return !drive_init(&cfg, &p, NULL);
}

static void test_init_refuses_what_a_mode_cannot_do(void)
{
    p.modes.control = (modes_control_t)3;
    TEST_ASSERT_TRUE(refused());
    p.modes.control = MODES_CONTROL_I_F; /* without a current to impress */
    TEST_ASSERT_TRUE(refused());
    setUp();
    p.modes.control = MODES_CONTROL_VOLTS_PER_HERTZ;
    p.modes.volts.psi_Wb = 0.0f;
    TEST_ASSERT_TRUE(refused());
    setUp();
    p.modes.flying.enable = true;
    p.modes.flying.window_s = 0.0f;
    TEST_ASSERT_TRUE(refused());
    setUp();
    p.modes.flying.enable = true;
    p.modes.dc_bandwidth_rad_s = 0.0f;
    TEST_ASSERT_TRUE(refused());
    setUp();
    p.modes.flux.voltage_share = 2.0f;
    estimator_list.weaken_share = 0.95f;
    TEST_ASSERT_TRUE(refused());
    setUp();
    p.modes.mains.u_lost_V = 100.0f;
    TEST_ASSERT_TRUE(refused());
}

static void test_init_refuses_a_brake_that_is_none(void)
{
    const float bad_A[] = {NAN, -1.0f, INFINITY};
    for (int n = 0; n < 3; n++) {
        p.modes.brake.current_A = bad_A[n];
        TEST_ASSERT_TRUE(refused());
    }
    setUp();
    p.modes.brake.current_A = 5.0f;
    TEST_ASSERT_FALSE(refused());
    p.modes.brake.from_rad_s = -1.0f;
    TEST_ASSERT_TRUE(refused());
    setUp();
    p.modes.brake.current_A = 0.5f;
    p.modes.dc_bandwidth_rad_s = 0.0f;
    TEST_ASSERT_TRUE(refused());
    setUp();
    p.modes.brake.current_A = 5.0f;
    p.modes.brake.least_s = -1.0f;
    TEST_ASSERT_TRUE(refused());
    p.modes.brake.least_s = 1e9f;
    TEST_ASSERT_TRUE(refused());
    p.modes.brake.least_s = 1.0f;
    p.modes.brake.slew_A_per_s = 0.0f;
    TEST_ASSERT_TRUE(refused());
}

static void test_all_off_asks_nothing(void)
{
    start();
    TEST_ASSERT_TRUE(cfg.modes.fixed);
    run(0.01);
    TEST_ASSERT_EQUAL(MODE_PREMAGNETISE, st.mode);
    TEST_ASSERT_FALSE(out.premagnetising);
}

/* Both directions, residual flux and none: caught, oriented, and torque at once. */
static void test_a_turning_motor_is_caught(void)
{
    const double speeds[] = {-300.0, -60.0, 60.0, 300.0};
    for (int n = 0; n < 8; n++) {
        setUp();
        p.modes.flying.enable = true;
        plant = plant_of(p.motor, speeds[n % 4], (n < 4) ? 0.0 : 0.35);
        start();
        in.omega_e_ref_rad_s = (float)speeds[n % 4];
        TEST_ASSERT_EQUAL_HEX32(0u, run(0.1));
        TEST_ASSERT_EQUAL(MODE_FLYING_START, st.mode);
        TEST_ASSERT_TRUE(out.premagnetising);
        TEST_ASSERT_EQUAL_HEX32(0u, run(1.2));
        TEST_ASSERT_EQUAL(FLYING_START_CAUGHT, st.modes.flying.phase);
        ASSERT_SAME_FLOAT(0.0f, st.modes.vector.speed.pi.x); /* no torque yet */
        TEST_ASSERT_EQUAL(MODE_REMAGNETISE, st.mode);
        TEST_ASSERT_FALSE(out.premagnetising);
        ASSERT_NEAR(2.0, speeds[n % 4], st.estimator.estimate.omega_e_rad_s);
        /* 2nd order leaves w^3 T^2/6 of angle, the ADC an LSB in volts over w: 7 % of .41 Wb. */
        ASSERT_NEAR(0.03, 0.0, flux_error());
        ASSERT_NEAR(0.3, 0.0, out.i_A.q);
        ASSERT_SAME_FLOAT(st.estimator.estimate.omega_e_rad_s,
                          st.modes.vector.speed.omega_ref_rad_s);
        in.mode = DRIVE_RUN;
        in.omega_e_ref_rad_s += 20.0f;
        TEST_ASSERT_EQUAL_HEX32(0u, run(0.02));
        TEST_ASSERT_TRUE(plant_torque(&plant) > 3.0);
        TEST_ASSERT_TRUE(cabs(plant_current(&plant)) < 15.5);
    }
}

static void test_a_standing_motor_is_magnetised_as_ever(void)
{
    p.modes.flying.enable = true;
    start();
    TEST_ASSERT_EQUAL_HEX32(0u, run(0.5));
    TEST_ASSERT_EQUAL(FLYING_START_STANDS, st.modes.flying.phase);
    TEST_ASSERT_EQUAL(MODE_PREMAGNETISE, st.mode);
    run(1.0);
    ASSERT_NEAR(0.1, 4.0, creal(plant_current(&plant)));
    ASSERT_NEAR(0.02, 0.0, flux_error());
    ASSERT_SAME_FLOAT(0.0f, st.estimator.estimate.omega_e_rad_s);
}

/* No phase conducts: no current, no speed, noise of one count. The voltage without a current is
 * told first. */
static void test_no_current_is_a_fault(void)
{
    p.modes.flying.enable = true;
    start();
    const measurement_in_t none = plant_words(&plant, &p);
    uint32_t faults = 0u;
    for (int k = 0; (k < 3000) && ((faults & FAULT_FLYING_START) == 0u); k++) {
        sample = none;
        sample.i_u_counts ^= (uint16_t)(k % 2);
        drive_step(&cfg, &st, &sample, &in, &out);
        faults |= out.faults;
    }
    TEST_ASSERT_EQUAL_HEX32(FAULT_CURRENT_SENSOR | FAULT_FLYING_START, faults);
}

/* Magnetised and turning; the reference goes to zero: the current stands, at least for its time. */
static void magnetised_run(float omega_rad_s)
{
    start();
    TEST_ASSERT_EQUAL_HEX32(0u, run(1.0));
    in.mode = DRIVE_RUN;
    plant.J_kg_m2 = 0.02;
    in.omega_e_ref_rad_s = omega_rad_s;
    TEST_ASSERT_EQUAL_HEX32(0u, run(1.5));
    ASSERT_NEAR(3.0, omega_rad_s, plant.omega_e_rad_s);
}

static void test_the_reference_at_zero_brakes_by_direct_current(void)
{
    p.modes.brake.current_A = 8.0f;
    magnetised_run(100.0f);
    TEST_ASSERT_EQUAL(MODE_VECTOR, st.mode);
    in.omega_e_ref_rad_s = 0.0f;
    TEST_ASSERT_EQUAL_HEX32(0u, run(0.15));
    TEST_ASSERT_EQUAL(MODE_DC_BRAKE, st.mode);
    TEST_ASSERT_EQUAL(SUPERVISOR_CLOSED, st.supervisor.confidence);
    ASSERT_NEAR(0.3, 8.0, creal(plant_current(&plant)));
    ASSERT_NEAR(0.3, 0.0, cimag(plant_current(&plant)));
    TEST_ASSERT_TRUE(plant.omega_e_rad_s < 100.0);
    in.omega_e_ref_rad_s = 50.0f;
    run(0.1);
    TEST_ASSERT_EQUAL(MODE_DC_BRAKE, st.mode); /* its time is not over */
    in.omega_e_ref_rad_s = 0.0f;
    TEST_ASSERT_EQUAL_HEX32(0u, run(4.0));
    ASSERT_NEAR(1.0, 0.0, plant.omega_e_rad_s);
    TEST_ASSERT_EQUAL(MODE_DC_BRAKE, st.mode);
    /* Lets go: flux along alpha is where the estimate begins, and the speed follows again. */
    in.omega_e_ref_rad_s = 50.0f;
    run(PERIOD_S * 1.5);
    TEST_ASSERT_EQUAL(MODE_VECTOR, st.mode);
    ASSERT_NEAR(0.05, 0.0, flux_error());
    TEST_ASSERT_EQUAL_HEX32(0u, run(2.0));
    ASSERT_NEAR(3.0, 50.0, plant.omega_e_rad_s);
}

static void test_a_small_threshold_only_holds(void)
{
    p.modes.brake.current_A = 8.0f;
    p.modes.brake.from_rad_s = 5.0f;
    magnetised_run(100.0f);
    in.omega_e_ref_rad_s = 0.0f;
    run(0.01);
    TEST_ASSERT_EQUAL(MODE_VECTOR, st.mode);
}

static void test_volts_per_hertz_turns_the_motor(void)
{
    p.modes.control = MODES_CONTROL_VOLTS_PER_HERTZ;
    start();
    run(1.0);
    in.mode = DRIVE_RUN;
    in.omega_e_ref_rad_s = -150.0f;
    plant.J_kg_m2 = 0.03;
    TEST_ASSERT_EQUAL_HEX32(0u, run(4.0));
    TEST_ASSERT_EQUAL(MODE_VOLTS_PER_HERTZ, st.mode);
    ASSERT_NEAR(4.0, -150.0, plant.omega_e_rad_s);
    ASSERT_NEAR(1e-3, -150.0, st.estimator.estimate.omega_e_rad_s);
    ASSERT_SAME_FLOAT(0.0f, st.estimator.observer.lambda_r_hat_Wb.alpha);
}

/* Nothing is estimated: there is nothing to judge, and nothing of an earlier judgement stays. */
static void test_open_loop_is_not_judged(void)
{
    p.modes.control = MODES_CONTROL_VOLTS_PER_HERTZ;
    start();
    in.mode = DRIVE_RUN;
    st.mode = MODE_VECTOR;
    st.supervisor = (supervisor_state_t){
        .judged = true, .flux_error_bound_pu = 0.5f, .confidence = SUPERVISOR_IMPRESSED};
    TEST_ASSERT_EQUAL_HEX32(0u, run(1.5 * PERIOD_S));
    const supervisor_state_t rested = {0};
    TEST_ASSERT_EQUAL_MEMORY(&rested, &st.supervisor, sizeof rested);
}

static void test_impressed_control_turns_the_motor(void)
{
    p.modes.control = MODES_CONTROL_I_F;
    p.i_f = (i_f_params_t){.current_A = 6.0f,
                           .slew_A_per_s = 100.0f,
                           .slew_rad_s2 = 40.0f,
                           .return_rad_s = 10.0f,
                           .timeout_s = 0.0f};
    start();
    run(1.0);
    in.mode = DRIVE_RUN;
    in.omega_e_ref_rad_s = 60.0f;
    plant.J_kg_m2 = 0.03;
    TEST_ASSERT_EQUAL_HEX32(0u, run(4.0));
    TEST_ASSERT_EQUAL(MODE_I_F, st.mode);
    TEST_ASSERT_TRUE(st.modes.i_f.active);
    ASSERT_NEAR(3.0, 60.0, plant.omega_e_rad_s);
    ASSERT_NEAR(0.2, 6.0, cabs(plant_current(&plant)));
    ASSERT_SAME_FLOAT(60.0f, st.estimator.estimate.omega_e_rad_s); /* what is told */
    ASSERT_SAME_FLOAT(0.0f, st.estimator.gain.l1_re_per_s);
    ASSERT_SAME_FLOAT(0.0f, st.estimator.gain.l1_im_per_s);
    ASSERT_SAME_FLOAT(0.0f, st.estimator.gain.l2_re_ohm);
    ASSERT_SAME_FLOAT(0.0f, st.estimator.gain.l2_im_ohm);
}

static void test_a_brake_begins_with_the_current_of_then(void)
{
    p.modes.brake.current_A = 8.0f;
    start();
    const drive_in_t run_asked = {.mode = DRIVE_RUN};
    const drive_out_t begins = {.meas = {.i_s_A = {1.0f, 2.0f}}};
    st.modes.brake.periods = 7u;
    transition_choose(&cfg, &st, &run_asked, &begins);
    TEST_ASSERT_EQUAL(MODE_DC_BRAKE, st.mode);
    TEST_ASSERT_EQUAL_UINT32(0u, st.modes.brake.periods);
    ASSERT_SAME_FLOAT(1.0f, st.modes.brake.i_ref_A.alpha);
    ASSERT_SAME_FLOAT(2.0f, st.modes.brake.i_ref_A.beta);
}

/* A torque mode's reference of zero is no stop. */
static void test_no_brake_while_a_torque_is_asked_for(void)
{
    p.modes.brake.current_A = 8.0f;
    magnetised_run(100.0f);
    in.aim = DRIVE_AIM_TORQUE;
    in.omega_e_ref_rad_s = 0.0f;
    run(0.01);
    TEST_ASSERT_EQUAL(MODE_VECTOR, st.mode);
    in.aim = DRIVE_AIM_SPEED;
    run(0.01);
    TEST_ASSERT_EQUAL(MODE_DC_BRAKE, st.mode);
}

/* Lost orientation: its current stands in for the brake, and goes to the reference by itself. */
static void test_no_brake_takes_over_from_impressed_current(void)
{
    p.modes.brake.current_A = 8.0f;
    p.lost_action = DRIVE_LOST_I_F;
    p.i_f = (i_f_params_t){.current_A = 6.0f,
                           .slew_A_per_s = 100.0f,
                           .slew_rad_s2 = 40.0f,
                           .return_rad_s = 10.0f,
                           .timeout_s = 5.0f};
    magnetised_run(8.0f);
    i_f_start(&st.modes.i_f, out.meas.i_s_A, 8.0f);
    in.omega_e_ref_rad_s = 0.0f;
    TEST_ASSERT_EQUAL_HEX32(0u, run(1.0));
    TEST_ASSERT_EQUAL(MODE_TAKE_OVER, st.mode);
    TEST_ASSERT_TRUE(st.modes.i_f.active);
    ASSERT_SAME_FLOAT(0.0f, st.modes.i_f.omega_rad_s);
    ASSERT_NEAR(0.2, 6.0, cabs(plant_current(&plant)));
}

/* Without the observer a motor that was caught goes on at the speed it turns with. */
static void test_open_loop_goes_on_with_a_motor_that_was_caught(void)
{
    const modes_control_t controls[] = {MODES_CONTROL_VOLTS_PER_HERTZ, MODES_CONTROL_I_F};
    for (int n = 0; n < 4; n++) {
        setUp();
        const float omega_rad_s = (n < 2) ? 200.0f : -200.0f;
        p.modes.flying.enable = true;
        p.modes.control = controls[n % 2];
        p.i_f = (i_f_params_t){.current_A = 6.0f,
                               .slew_A_per_s = 100.0f,
                               .slew_rad_s2 = 40.0f,
                               .return_rad_s = 10.0f,
                               .timeout_s = 0.0f};
        plant = plant_of(p.motor, (double)omega_rad_s, 0.35);
        start();
        TEST_ASSERT_EQUAL_HEX32(0u, run(1.2));
        TEST_ASSERT_EQUAL(FLYING_START_CAUGHT, st.modes.flying.phase);
        plant.J_kg_m2 = 0.03;
        in.mode = DRIVE_RUN;
        in.omega_e_ref_rad_s = omega_rad_s;
        double most_A = 0.0;
        for (int k = 0; k < 2500; k++) {
            TEST_ASSERT_EQUAL_HEX32(0u, run(PERIOD_S));
            most_A = fmax(most_A, cabs(plant_current(&plant)));
        }
        TEST_ASSERT_TRUE(most_A < 8.0);
        ASSERT_NEAR(10.0, (double)omega_rad_s, plant.omega_e_rad_s);
    }
}

/* Nobody knows the speed meanwhile: the gates may go when the brake has had its time. */
static void test_a_stop_is_over_when_the_brake_has_had_its_time(void)
{
    p.modes.brake.current_A = 8.0f;
    magnetised_run(100.0f);
    in.aim = DRIVE_AIM_STOP;
    in.omega_e_ref_rad_s = 0.0f;
    run(0.2);
    TEST_ASSERT_EQUAL(MODE_DC_BRAKE, st.mode);
    TEST_ASSERT_FALSE(drive_standing(&st, 5.0f));
    run(0.2);
    TEST_ASSERT_EQUAL(MODE_DC_BRAKE, st.mode);
    TEST_ASSERT_TRUE(drive_standing(&st, 5.0f));
}

static void test_a_stop_by_volts_per_hertz_ends_at_standstill(void)
{
    p.modes.control = MODES_CONTROL_VOLTS_PER_HERTZ;
    start();
    run(1.0);
    in.mode = DRIVE_RUN;
    in.omega_e_ref_rad_s = 100.0f;
    plant.J_kg_m2 = 0.03;
    run(1.0);
    in.aim = DRIVE_AIM_STOP;
    in.omega_e_ref_rad_s = 0.0f;
    run(0.2);
    TEST_ASSERT_FALSE(drive_standing(&st, 5.0f));
    run(1.0);
    TEST_ASSERT_TRUE(drive_standing(&st, 5.0f));
}

/* Holding by direct current can go on for ever: the temperatures are looked at all the same. */
static void test_a_brake_that_is_too_much_for_the_motor_ends(void)
{
    p.modes.brake.current_A = 8.0f;
    p.overload.cont_A[OVERLOAD_MOTOR] = 6.0f;
    p.overload.tau_s[OVERLOAD_MOTOR] = 2.0f;
    magnetised_run(100.0f);
    in.omega_e_ref_rad_s = 0.0f;
    TEST_ASSERT_EQUAL_HEX32(0u, run(0.3) & FAULT_OVERLOAD);
    TEST_ASSERT_EQUAL(MODE_DC_BRAKE, st.mode);
    TEST_ASSERT_EQUAL_HEX32(FAULT_OVERLOAD, run(4.0) & FAULT_OVERLOAD);
}

static void test_commissioning_searches_for_nothing(void)
{
    p.modes.flying.enable = true;
    start();
    in.mode = DRIVE_COMMISSION;
    in.i_d_ref_A = 2.0f;
    run(0.3);
    TEST_ASSERT_EQUAL(MODE_COMMISSIONING, st.mode);
    TEST_ASSERT_EQUAL(FLYING_START_SEARCH, st.modes.flying.phase);
    ASSERT_NEAR(0.1, 2.0, creal(plant_current(&plant)));
}

static void level_on(void)
{
    p.modes.flux = (flux_reference_params_t){.voltage_share = 0.9f,
                                             .bandwidth_rad_s = 20.0f,
                                             .pull_out_share = 0.8f,
                                             .economy_filter_s = 0.5f,
                                             .economy_slew_Wb_per_s = 0.4f,
                                             .lambda_nominal_Wb = 0.408f,
                                             .lambda_min_Wb = 0.04f,
                                             .i_q_max_A = 12.0f};
}

/* Beyond the speed whose EMF is the dc link: the voltage stays at its share, no fault. */
static void test_the_field_is_weakened_at_speed(void)
{
    level_on();
    plant.u_dc_V = 150.0;
    magnetised_run(420.0f);
    run(1.5);
    const double share = sqrt((double)ab_norm2(st.acting.legs_V)) / (150.0 / sqrt(2.0));
    ASSERT_NEAR(0.04, 0.9, share);
    TEST_ASSERT_TRUE(cabs(plant.psi_r_Wb) < 0.3);
    ASSERT_NEAR(0.02, 0.0, flux_error());
    TEST_ASSERT_EQUAL(st.modes.vector.reference.i_q_reduction_A > 0.0f,
                      st.modes.vector.pull_out_near);
    ASSERT_SAME_FLOAT(st.modes.vector.reference.reduction_Wb, st.modes.vector.flux_reduction_Wb);
}

/* With weakening the motor may run beyond the table's end (test_estimator). */
static void test_weakening_extends_the_gain_table(void)
{
    estimator_list.observer_gain_enable = 1u;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    ASSERT_SAME_FLOAT(FLT_MAX, cfg.estimator.table_end_rad_s);
    estimator_list.weaken_share = 0.95f;
    level_on();
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    ASSERT_SAME_FLOAT(3.0f * test_table.step_rad_s, cfg.estimator.table_end_rad_s);
}

/* Switched off while it acts: nominal flux is asked for again. */
static void test_weakening_may_be_switched_off_while_it_acts(void)
{
    level_on();
    plant.u_dc_V = 150.0;
    magnetised_run(420.0f);
    run(1.5);
    TEST_ASSERT_TRUE(st.modes.vector.flux_reduction_Wb > 0.1f);
    p.modes.flux.voltage_share = 0.0f;
    estimator_list.weaken_share = 0.95f;
    start();
    while (plant.u_dc_V < 283.0) {
        plant.u_dc_V += 7.0; /* no capacitor jumps */
        TEST_ASSERT_EQUAL_HEX32(0u, run(PERIOD_S));
    }
    TEST_ASSERT_EQUAL_HEX32(0u, run(1.0));
    ASSERT_SAME_FLOAT(0.0f, st.modes.vector.flux_reduction_Wb);
    TEST_ASSERT_FALSE(st.modes.vector.pull_out_near);
    ASSERT_NEAR(0.05, 0.408, cabs(plant.psi_r_Wb));
}

/* Steering takes more near zero frequency: then its flux counts. */
static void test_the_lower_of_steering_and_level_counts(void)
{
    level_on();
    p.steering = (flux_steering_params_t){.min_rad_s = 4.2f,
                                          .hysteresis_rad_s = 1.0f,
                                          .lambda_nominal_Wb = 0.408f,
                                          .lambda_min_Wb = 0.2f,
                                          .torque_min_Nm = 0.5f,
                                          .torque_filter_s = 0.01f,
                                          .slew_Wb_per_s = 0.4f,
                                          .i_q_max_A = 12.0f};
    magnetised_run(50.0f);
    ASSERT_SAME_FLOAT(0.0f, st.modes.vector.flux_reduction_Wb);
    st.modes.vector.steer.reduction_Wb = 0.1f;
    st.modes.vector.steering.reduction_Wb = 0.1f;
    run(16.0 * PERIOD_S);
    TEST_ASSERT_TRUE(st.modes.vector.flux_reduction_Wb > 0.05f);
    ASSERT_SAME_FLOAT(st.modes.vector.steer.reduction_Wb, st.modes.vector.flux_reduction_Wb);
}

static void ride_through(void)
{
    p.modes.mains = (mains_loss_params_t){.u_lost_V = 220.0f,
                                          .u_hold_V = 230.0f,
                                          .u_back_V = 260.0f,
                                          .back_s = 0.01f,
                                          .gain_W_per_V = 20.0f,
                                          .stop_rad_s = 15.0f,
                                          .lambda_Wb = 0.408f,
                                          .i_q_max_A = 12.0f};
}

static void test_a_dc_link_that_falls_is_held_by_the_shaft(void)
{
    ride_through();
    magnetised_run(150.0f);
    plant.u_dc_V = 215.0;
    TEST_ASSERT_EQUAL_HEX32(0u, run(0.05));
    TEST_ASSERT_TRUE(st.modes.vector.mains.active);
    ASSERT_NEAR(40.0, -300.0, plant_torque(&plant) * plant.omega_e_rad_s / 2.0);
    /* The mains is back: speed and torque go on from there. */
    const double slowed = plant.omega_e_rad_s;
    plant.u_dc_V = 283.0;
    run(0.02);
    TEST_ASSERT_FALSE(st.modes.vector.mains.active);
    ASSERT_NEAR(20.0, slowed, plant.omega_e_rad_s);
    run(1.5);
    ASSERT_NEAR(3.0, 150.0, plant.omega_e_rad_s);
    /* Gone for good: the shaft gives all it has, then it is a fault. */
    plant.u_dc_V = 215.0;
    TEST_ASSERT_EQUAL_HEX32(FAULT_MAINS_LOST, run(4.0));
    TEST_ASSERT_TRUE(fabs(plant.omega_e_rad_s) < 20.0);
}

/* Slow: a dip that the capacitors bridge is no end. */
static void test_a_dip_at_low_speed_costs_nothing(void)
{
    ride_through();
    magnetised_run(10.0f);
    plant.u_dc_V = 200.0;
    TEST_ASSERT_EQUAL_HEX32(0u, run(0.5));
    ASSERT_NEAR(2.0, 10.0, plant.omega_e_rad_s);
}

/* Caught in turning, before RUN: there is no torque that could hold the link. */
static void test_no_dip_is_ridden_through_without_torque(void)
{
    p.modes.flying.enable = true;
    ride_through();
    plant = plant_of(p.motor, 300.0, 0.35);
    start();
    TEST_ASSERT_EQUAL_HEX32(0u, run(1.3));
    TEST_ASSERT_EQUAL(MODE_REMAGNETISE, st.mode);
    plant.u_dc_V = 215.0;
    TEST_ASSERT_EQUAL_HEX32(0u, run(0.05));
    TEST_ASSERT_FALSE(st.modes.vector.mains.active);
    ASSERT_SAME_FLOAT(0.0f, out.i_ref_A.q);
}

/* Torque mode: the torque that was wanted comes back on its slew, not at once. */
static void test_torque_mode_slews_back_from_a_dip(void)
{
    p.speed.torque_slew_Nm_per_s = 20.0f;
    ride_through();
    magnetised_run(150.0f);
    in.aim = DRIVE_AIM_TORQUE;
    in.torque_ref_Nm = 5.0f;
    run(0.3);
    plant.u_dc_V = 215.0;
    run(0.1);
    plant.u_dc_V = 283.0;
    while (st.modes.vector.mains.active) {
        run(PERIOD_S);
    }
    TEST_ASSERT_TRUE(plant_torque(&plant) < 0.5);
    run(0.1);
    ASSERT_NEAR(0.5, 2.0, plant_torque(&plant));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_what_a_mode_cannot_do);
    RUN_TEST(test_init_refuses_a_brake_that_is_none);
    RUN_TEST(test_all_off_asks_nothing);
    RUN_TEST(test_a_turning_motor_is_caught);
    RUN_TEST(test_a_standing_motor_is_magnetised_as_ever);
    RUN_TEST(test_no_current_is_a_fault);
    RUN_TEST(test_the_reference_at_zero_brakes_by_direct_current);
    RUN_TEST(test_a_small_threshold_only_holds);
    RUN_TEST(test_volts_per_hertz_turns_the_motor);
    RUN_TEST(test_open_loop_is_not_judged);
    RUN_TEST(test_impressed_control_turns_the_motor);
    RUN_TEST(test_a_brake_begins_with_the_current_of_then);
    RUN_TEST(test_no_brake_while_a_torque_is_asked_for);
    RUN_TEST(test_a_stop_is_over_when_the_brake_has_had_its_time);
    RUN_TEST(test_a_stop_by_volts_per_hertz_ends_at_standstill);
    RUN_TEST(test_a_brake_that_is_too_much_for_the_motor_ends);
    RUN_TEST(test_commissioning_searches_for_nothing);
    RUN_TEST(test_the_field_is_weakened_at_speed);
    RUN_TEST(test_the_lower_of_steering_and_level_counts);
    RUN_TEST(test_a_dc_link_that_falls_is_held_by_the_shaft);
    RUN_TEST(test_no_brake_takes_over_from_impressed_current);
    RUN_TEST(test_open_loop_goes_on_with_a_motor_that_was_caught);
    RUN_TEST(test_weakening_extends_the_gain_table);
    RUN_TEST(test_weakening_may_be_switched_off_while_it_acts);
    RUN_TEST(test_a_dip_at_low_speed_costs_nothing);
    RUN_TEST(test_no_dip_is_ridden_through_without_torque);
    RUN_TEST(test_torque_mode_slews_back_from_a_dip);
    return UNITY_END();
}
