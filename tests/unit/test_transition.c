/* What one mode leaves to the next: who is told what, and who is left alone. What follows from a
 * lost orientation is in test_drive_lost. */
#include "transition.h"

#include <complex.h>

#include "drive_fixture.h"
#include "exact.h"
#include "fault.h"
#include "mode_fixture.h"

static drive_params_t p;
static drive_config_t cfg;
static drive_state_t st;
static drive_out_t out;
static request_t request;

static void configure(modes_control_t control)
{
    p.modes.control = control;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, NULL));
    st = (drive_state_t){
        .mode = MODE_PREMAGNETISE,
        .estimator = {.estimate = {.lambda_r_hat_Wb = {0.3f, 0.4f},
                                   .lambda_Wb = 0.5f,
                                   .omega_e_rad_s = 60.0f,
                                   .omega_s_rad_s = 62.0f}},
        .modes.vector.speed = {.omega_ref_rad_s = 55.0f, .omega_filtered_rad_s = 60.0f}};
    mode_fixture_start();
    in.estimate = &st.estimator.estimate;
    meas.i_s_A = (ab_t){3.0f, 4.0f};
    asked.omega_e_ref_rad_s = 50.0f;
    out = (drive_out_t){.meas = meas};
    request = (request_t){.omega_e_rad_s = -20.0f, .axis = {1.0f, 0.0f}};
}

void setUp(void)
{
    p = both_machines(1);
    estimator_list.observer_gain_enable = 0u;
    p.i_f = (i_f_params_t){.current_A = 6.0f,
                           .slew_A_per_s = 100.0f,
                           .slew_rad_s2 = 40.0f,
                           .return_rad_s = 10.0f,
                           .timeout_s = 1.0f};
    p.modes = (modes_params_t){
        .dc_bandwidth_rad_s = 400.0f,
        .volts = {.psi_Wb = 0.44f, .boost_V = 4.0f, .slew_rad_s2 = 200.0f, .i_max_A = 15.0f},
        .brake = {
            .current_A = 8.0f, .from_rad_s = 1000.0f, .least_s = 0.3f, .slew_A_per_s = 100.0f}};
    configure(MODES_CONTROL_VECTOR);
}

void tearDown(void)
{
}

static void choose(void)
{
    transition_choose(&cfg, &st, &asked, &out);
}

static void assert_at_rest_with_flux_along_alpha(float i_A)
{
    const estimate_t *e = &st.estimator.estimate;
    ASSERT_SAME_FLOAT(i_A, st.estimator.observer.i_s_hat_A.alpha);
    ASSERT_SAME_FLOAT(0.0f, st.estimator.observer.i_s_hat_A.beta);
    ASSERT_NEAR(1e-6, p.motor.M_H * i_A, e->lambda_r_hat_Wb.alpha);
    ASSERT_SAME_FLOAT(0.0f, e->lambda_r_hat_Wb.beta);
    ASSERT_SAME_FLOAT(0.0f, e->omega_e_rad_s);
    ASSERT_SAME_FLOAT(0.0f, e->omega_s_rad_s);
    ASSERT_SAME_FLOAT(0.0f, st.modes.vector.speed.omega_ref_rad_s);
    ASSERT_SAME_FLOAT(0.0f, st.modes.vector.speed.omega_filtered_rad_s);
}

/* From flux build-up to torque: all goes on as it is. */
static void test_into_vector_control_nothing_changes_but_the_mode(void)
{
    drive_state_t expected = st;
    choose();
    expected.mode = MODE_VECTOR;
    expected.asked = DRIVE_RUN;
    TEST_ASSERT_EQUAL_MEMORY(&expected, &st, sizeof st);
    choose();
    TEST_ASSERT_EQUAL_MEMORY(&expected, &st, sizeof st);
}

static void test_a_mode_that_goes_on_is_not_begun_again(void)
{
    asked.omega_e_ref_rad_s = 0.0f;
    st.mode = MODE_DC_BRAKE;
    st.asked = DRIVE_RUN;
    st.modes.brake.periods = 7u;
    const drive_state_t before = st;
    choose();
    TEST_ASSERT_EQUAL_MEMORY(&before, &st, sizeof st);
}

static void test_a_brake_begins_with_current_and_speed_of_then(void)
{
    asked.omega_e_ref_rad_s = 0.0f;
    st.mode = MODE_VECTOR;
    st.modes.brake.periods = 7u;
    drive_state_t expected = st;
    choose();
    expected.mode = MODE_DC_BRAKE;
    expected.asked = DRIVE_RUN;
    dc_brake_start(&expected.modes.brake, meas.i_s_A, 60.0f);
    TEST_ASSERT_EQUAL_MEMORY(&expected, &st, sizeof st);
}

/* The direct current goes on as magnetising current of a motor that stands. */
static void test_after_a_brake_the_flux_is_along_its_current(void)
{
    st.mode = MODE_DC_BRAKE;
    st.modes.brake.periods = cfg.modes.brake.least_periods;
    choose();
    TEST_ASSERT_EQUAL(MODE_VECTOR, st.mode);
    assert_at_rest_with_flux_along_alpha(3.0f);
}

/* From the measured current and the speed found; the integrator takes over the EMF that the
 * decoupling knew. */
static void test_i_f_begins_where_the_motor_is(void)
{
    configure(MODES_CONTROL_I_F);
    st.voltage.current.q.x = 5.0f;
    choose();
    TEST_ASSERT_EQUAL(MODE_I_F, st.mode);
    TEST_ASSERT_TRUE(st.modes.i_f.active);
    ASSERT_NEAR(1e-6, 0.6, st.modes.i_f.axis.alpha);
    ASSERT_NEAR(1e-6, 0.8, st.modes.i_f.axis.beta);
    ASSERT_NEAR(1e-6, 5.0, st.modes.i_f.current_A);
    ASSERT_SAME_FLOAT(60.0f, st.modes.i_f.omega_rad_s);
    const double kr = (double)p.motor.M_H / (double)p.motor.Lr_H;
    ASSERT_NEAR(1e-5, 5.0 + 0.9 * kr * 60.0 * 0.5, st.voltage.current.q.x);
    ASSERT_SAME_FLOAT(0.0f, st.voltage.current.d.x);
}

/* V/f goes on from the flux and speed of a motor that was caught, and begins at rest else. */
static void test_volts_per_hertz_goes_on_with_a_motor_that_was_caught(void)
{
    for (int phase = FLYING_START_SEARCH; phase <= FLYING_START_REFUSED; phase++) {
        configure(MODES_CONTROL_VOLTS_PER_HERTZ);
        st.modes.flying.phase = (flying_start_phase_t)phase;
        volts_per_hertz_state_t expected = {0};
        if (phase == FLYING_START_CAUGHT) {
            volts_per_hertz_start(&cfg.modes.volts, &expected, (ab_t){0.3f, 0.4f}, 60.0f);
        }
        choose();
        TEST_ASSERT_EQUAL(MODE_VOLTS_PER_HERTZ, st.mode);
        TEST_ASSERT_EQUAL_MEMORY(&expected, &st.modes.volts, sizeof expected);
    }
}

static void after(mode_id_t mode)
{
    st.mode = mode;
    transition_after_open_loop(&cfg, &st, &in, &request);
}

/* No flux, the current there is, and the speed the mode tells. */
static void assert_nothing_estimated(float omega_rad_s)
{
    estimator_state_t expected = {0};
    estimator_off(&expected, meas.i_s_A, omega_rad_s);
    TEST_ASSERT_EQUAL_MEMORY(&expected, &st.estimator, sizeof expected);
}

static void test_after_volts_per_hertz_the_reference_is_its_speed(void)
{
    after(MODE_VOLTS_PER_HERTZ);
    assert_nothing_estimated(-20.0f);
    ASSERT_SAME_FLOAT(-20.0f, st.modes.vector.speed.omega_ref_rad_s);
}

/* The vector is stepped after it has acted; a torque holds the speed of now. */
static void test_after_i_f_the_vector_moves_on(void)
{
    const drive_aim_t aims[] = {DRIVE_AIM_SPEED, DRIVE_AIM_TORQUE};
    const float reference_rad_s[] = {50.0f, -20.0f};
    for (int n = 0; n < 2; n++) {
        configure(MODES_CONTROL_I_F);
        asked.aim = aims[n];
        st.modes.i_f = (i_f_state_t){
            .active = true, .axis = {0.6f, 0.8f}, .current_A = 5.0f, .omega_rad_s = -20.0f};
        i_f_state_t expected = st.modes.i_f;
        const i_f_in_t i_f_in = {.omega_ref_rad_s = reference_rad_s[n], .u_dc_V = 540.0f};
        TEST_ASSERT_FALSE(i_f_step(&cfg.modes.i_f, &expected, &i_f_in));
        after(MODE_I_F);
        TEST_ASSERT_EQUAL_MEMORY(&expected, &st.modes.i_f, sizeof expected);
        assert_nothing_estimated(-20.0f);
        ASSERT_SAME_FLOAT(55.0f, st.modes.vector.speed.omega_ref_rad_s);
    }
}

/* For the end of a stop: the speed of the beginning until the brake has had its time. */
static void test_after_a_brake_the_reference_waits_for_its_time(void)
{
    st.modes.brake.omega_rad_s = 31.0f;
    request.omega_e_rad_s = 0.0f;
    after(MODE_DC_BRAKE);
    ASSERT_SAME_FLOAT(31.0f, st.modes.vector.speed.omega_ref_rad_s);
    st.modes.brake.periods = cfg.modes.brake.least_periods;
    after(MODE_DC_BRAKE);
    ASSERT_SAME_FLOAT(0.0f, st.modes.vector.speed.omega_ref_rad_s);
    assert_nothing_estimated(0.0f);
}

static void test_a_search_that_goes_on_or_fails_leaves_nothing(void)
{
    const flying_start_phase_t phases[] = {FLYING_START_SEARCH, FLYING_START_REFUSED};
    request.omega_e_rad_s = 0.0f;
    for (int n = 0; n < 2; n++) {
        st.modes.flying.phase = phases[n];
        st.modes.flying.lambda_Wb = (ab_t){0.3f, 0.0f};
        after(MODE_FLYING_START);
        assert_nothing_estimated(0.0f);
    }
}

static void test_a_motor_that_stands_is_magnetised_on(void)
{
    st.modes.flying = (flying_start_state_t){.phase = FLYING_START_STANDS, .current_A = 4.0f};
    after(MODE_FLYING_START);
    assert_at_rest_with_flux_along_alpha(4.0f);
}

/* What the search had found counts in the mode it was found in, not in those that follow. */
static void test_other_modes_do_not_look_at_the_search(void)
{
    st.modes.flying = (flying_start_state_t){.phase = FLYING_START_STANDS, .current_A = 4.0f};
    after(MODE_VOLTS_PER_HERTZ);
    assert_nothing_estimated(-20.0f);
}

/* Flux and speed of the search; the frame turns with the flux from this period on. */
static void test_a_motor_that_turns_is_caught(void)
{
    asked.mode = DRIVE_PREMAGNETISE;
    st.modes.flying = (flying_start_state_t){
        .phase = FLYING_START_CAUGHT, .omega_rad_s = 200.0f, .lambda_Wb = {-0.03f, 0.04f}};
    after(MODE_FLYING_START);
    const estimate_t *e = &st.estimator.estimate;
    ASSERT_SAME_FLOAT(-0.03f, e->lambda_r_hat_Wb.alpha);
    ASSERT_SAME_FLOAT(0.04f, e->lambda_r_hat_Wb.beta);
    ASSERT_SAME_FLOAT(200.0f, e->omega_e_rad_s);
    ASSERT_SAME_FLOAT(200.0f, e->omega_s_rad_s);
    ASSERT_SAME_FLOAT(200.0f, st.estimator.adaptation.x_rad_s);
    TEST_ASSERT_EQUAL_MEMORY(&meas.i_s_A, &st.estimator.observer.i_s_hat_A, sizeof meas.i_s_A);
    ASSERT_NEAR(1e-6, -0.6, request.axis.alpha);
    ASSERT_NEAR(1e-6, 0.8, request.axis.beta);
}

/* At a speed whose EMF the dc link cannot give, with the flux that it can. */
static void test_a_fast_motor_is_caught_with_a_weakened_field(void)
{
    p.modes.flux = (flux_reference_params_t){.voltage_share = 0.9f,
                                             .bandwidth_rad_s = 20.0f,
                                             .pull_out_share = 0.8f,
                                             .economy_filter_s = 0.5f,
                                             .economy_slew_Wb_per_s = 0.4f,
                                             .lambda_nominal_Wb = 0.6888f,
                                             .lambda_min_Wb = 0.06f,
                                             .i_q_max_A = 12.0f};
    configure(MODES_CONTROL_VECTOR);
    st.modes.flying = (flying_start_state_t){
        .phase = FLYING_START_CAUGHT, .omega_rad_s = 900.0f, .lambda_Wb = {0.03f, 0.0f}};
    after(MODE_FLYING_START);
    ASSERT_NEAR(1e-5, 0.6888 - 0.9 * sqrt(0.5) * 540.0 / 900.0, st.modes.vector.flux_reduction_Wb);
}

/* No flux to speak of: nothing says where it is. */
static void test_caught_without_flux_the_frame_stands(void)
{
    st.modes.flying = (flying_start_state_t){
        .phase = FLYING_START_CAUGHT, .omega_rad_s = 200.0f, .lambda_Wb = {0.0f, 1e-5f}};
    asked.mode = DRIVE_PREMAGNETISE;
    after(MODE_FLYING_START);
    ASSERT_SAME_FLOAT(1.0f, request.axis.alpha);
    ASSERT_SAME_FLOAT(0.0f, request.axis.beta);
}

/* The verdict alone does nothing in a mode that is not oriented by the estimate; told, stopped or
 * taken over, as configured. */
static void test_a_lost_orientation_has_its_configured_consequence(void)
{
    const drive_lost_action_t actions[] = {DRIVE_LOST_TELL, DRIVE_LOST_STOP, DRIVE_LOST_I_F};
    for (int n = 0; n < 6; n++) {
        const bool lost = n < 3;
        p.lost_action = actions[n % 3];
        configure(MODES_CONTROL_VECTOR);
        st.mode = MODE_VECTOR;
        st.supervisor.confidence = lost ? SUPERVISOR_IMPRESSED : SUPERVISOR_DEGRADED;
        out.faults = FAULT_DERATED;
        transition_by_confidence(&cfg, &st, &asked, &out);
        TEST_ASSERT_EQUAL_HEX32(FAULT_DERATED | ((n == 1) ? FAULT_ORIENTATION_LOST : 0u),
                                out.faults);
        TEST_ASSERT_EQUAL(n == 2, st.modes.i_f.active);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_into_vector_control_nothing_changes_but_the_mode);
    RUN_TEST(test_a_mode_that_goes_on_is_not_begun_again);
    RUN_TEST(test_a_brake_begins_with_current_and_speed_of_then);
    RUN_TEST(test_after_a_brake_the_flux_is_along_its_current);
    RUN_TEST(test_i_f_begins_where_the_motor_is);
    RUN_TEST(test_volts_per_hertz_goes_on_with_a_motor_that_was_caught);
    RUN_TEST(test_after_volts_per_hertz_the_reference_is_its_speed);
    RUN_TEST(test_after_i_f_the_vector_moves_on);
    RUN_TEST(test_after_a_brake_the_reference_waits_for_its_time);
    RUN_TEST(test_a_search_that_goes_on_or_fails_leaves_nothing);
    RUN_TEST(test_a_motor_that_stands_is_magnetised_on);
    RUN_TEST(test_other_modes_do_not_look_at_the_search);
    RUN_TEST(test_a_motor_that_turns_is_caught);
    RUN_TEST(test_a_fast_motor_is_caught_with_a_weakened_field);
    RUN_TEST(test_caught_without_flux_the_frame_stands);
    RUN_TEST(test_a_lost_orientation_has_its_configured_consequence);
    return UNITY_END();
}
