/* Which mode acts, and what each of them asks for in a period. */
#include "modes.h"

#include "drive_fixture.h"
#include "exact.h"
#include "fault.h"
#include "mode_fixture.h"

static drive_params_t p;
static drive_config_t drive;
static modes_config_t *cfg;
static modes_state_t st;
static uint32_t faults;

static void configure(void)
{
    TEST_ASSERT_TRUE(drive_init(&drive, &p, NULL));
    cfg = &drive.modes;
    st = (modes_state_t){0};
    mode_fixture_start();
    estimate =
        (estimate_t){.lambda_r_hat_Wb = {0.0f, 0.5f}, .lambda_Wb = 0.5f, .omega_e_rad_s = 100.0f};
    meas.i_s_A = (ab_t){3.0f, 1.0f};
    acting.ended_V = (ab_t){20.0f, -5.0f};
    in.u_s_V = (ab_t){21.0f, -6.0f};
    asked.omega_e_ref_rad_s = 50.0f;
    asked.i_d_ref_A = 2.5f;
}

/* Everything is configured; the control is what a case makes it. */
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
        .flying = {.enable = true,
                   .current_A = 4.0f,
                   .settle_s = 0.02f,
                   .window_s = 0.1f,
                   .stand_rad_s = 14.7f,
                   .omega_max_rad_s = 600.0f},
        .volts = {.psi_Wb = 0.44f, .boost_V = 4.0f, .slew_rad_s2 = 200.0f, .i_max_A = 15.0f},
        .brake = {.current_A = 8.0f, .from_rad_s = 5.0f, .least_s = 0.3f, .slew_A_per_s = 100.0f}};
    configure();
}

void tearDown(void)
{
}

static void use_control(modes_control_t control)
{
    p.modes.control = control;
    configure();
}

static mode_id_t selected(drive_mode_t mode, mode_id_t before)
{
    asked.mode = mode;
    return modes_selected(cfg, &st, before, &in);
}

static request_t step(mode_id_t mode)
{
    faults = 0u;
    return modes_step(cfg, &st, mode, &in, &faults);
}

static void assert_request(request_kind_t kind, ab_t axis, dq_t i_ref_A, const request_t *out)
{
    TEST_ASSERT_EQUAL(kind, out->kind);
    ASSERT_SAME_FLOAT(axis.alpha, out->axis.alpha);
    ASSERT_SAME_FLOAT(axis.beta, out->axis.beta);
    ASSERT_SAME_FLOAT(i_ref_A.d, out->i_ref_A.d);
    ASSERT_SAME_FLOAT(i_ref_A.q, out->i_ref_A.q);
}

static void test_the_control_configured_acts_in_run(void)
{
    const mode_id_t expected[] = {MODE_VECTOR, MODE_VOLTS_PER_HERTZ, MODE_I_F};
    for (int control = 0; control < 3; control++) {
        use_control((modes_control_t)control);
        for (int before = MODE_OFF; before <= MODE_I_F; before++) {
            TEST_ASSERT_EQUAL(expected[control], selected(DRIVE_RUN, (mode_id_t)before));
        }
    }
}

/* A lost orientation is held in vector control alone, and no brake takes over from it. */
static void test_a_current_that_holds_the_load_goes_on(void)
{
    st.i_f.active = true;
    asked.omega_e_ref_rad_s = 0.0f;
    estimate.omega_e_rad_s = 0.0f;
    TEST_ASSERT_EQUAL(MODE_TAKE_OVER, selected(DRIVE_RUN, MODE_TAKE_OVER));
    TEST_ASSERT_EQUAL(MODE_TAKE_OVER, selected(DRIVE_RUN, MODE_DC_BRAKE));
    use_control(MODES_CONTROL_I_F);
    st.i_f.active = true;
    TEST_ASSERT_EQUAL(MODE_I_F, selected(DRIVE_RUN, MODE_I_F));
    use_control(MODES_CONTROL_VOLTS_PER_HERTZ);
    st.i_f.active = true;
    TEST_ASSERT_EQUAL(MODE_VOLTS_PER_HERTZ, selected(DRIVE_RUN, MODE_I_F));
}

/* From 5 rad/s downward; once it acts, until another speed is wanted and its time is over. */
static void test_the_brake_acts_in_vector_control_where_zero_is_wanted(void)
{
    asked.omega_e_ref_rad_s = 0.0f;
    TEST_ASSERT_EQUAL(MODE_VECTOR, selected(DRIVE_RUN, MODE_VECTOR));
    TEST_ASSERT_EQUAL(MODE_DC_BRAKE, selected(DRIVE_RUN, MODE_DC_BRAKE));
    estimate.omega_e_rad_s = -4.0f;
    TEST_ASSERT_EQUAL(MODE_DC_BRAKE, selected(DRIVE_RUN, MODE_VECTOR));
    asked.omega_e_ref_rad_s = 50.0f;
    TEST_ASSERT_EQUAL(MODE_VECTOR, selected(DRIVE_RUN, MODE_VECTOR));
    TEST_ASSERT_EQUAL(MODE_DC_BRAKE, selected(DRIVE_RUN, MODE_DC_BRAKE));
    st.brake.periods = cfg->brake.least_periods;
    TEST_ASSERT_EQUAL(MODE_VECTOR, selected(DRIVE_RUN, MODE_DC_BRAKE));
    asked.omega_e_ref_rad_s = 0.0f;
    for (int control = MODES_CONTROL_VOLTS_PER_HERTZ; control <= MODES_CONTROL_I_F; control++) {
        use_control((modes_control_t)control);
        estimate.omega_e_rad_s = 0.0f;
        asked.omega_e_ref_rad_s = 0.0f;
        TEST_ASSERT_NOT_EQUAL(MODE_DC_BRAKE, selected(DRIVE_RUN, MODE_DC_BRAKE));
    }
}

/* Before RUN: the search until it has an answer, then flux in the frame that fits it. */
static void test_before_run_the_search_says_how_flux_is_built_up(void)
{
    const mode_id_t expected[] = {MODE_FLYING_START, MODE_PREMAGNETISE, MODE_REMAGNETISE,
                                  MODE_PREMAGNETISE};
    for (int phase = FLYING_START_SEARCH; phase <= FLYING_START_REFUSED; phase++) {
        st.flying.phase = (flying_start_phase_t)phase;
        TEST_ASSERT_EQUAL(expected[phase], selected(DRIVE_PREMAGNETISE, MODE_OFF));
        TEST_ASSERT_EQUAL(MODE_COMMISSIONING, selected(DRIVE_COMMISSION, MODE_OFF));
        TEST_ASSERT_EQUAL(MODE_VECTOR, selected(DRIVE_RUN, MODE_OFF));
    }
    p.modes.flying.enable = false;
    configure();
    TEST_ASSERT_EQUAL(MODE_PREMAGNETISE, selected(DRIVE_PREMAGNETISE, MODE_OFF));
}

/* Direct current along phase u: that of nominal flux, or the one of the measurement. */
static void test_premagnetisation_asks_for_current_along_u(void)
{
    const request_t out = step(MODE_PREMAGNETISE);
    assert_request(REQUEST_CURRENT, (ab_t){1.0f, 0.0f}, (dq_t){4.0f, 0.0f}, &out);
    TEST_ASSERT_FALSE(out.busy);
    TEST_ASSERT_EQUAL_HEX32(0u, faults);
    p.rs_measurement = (rs_measurement_params_t){.enable = true,
                                                 .level = {{5.0f, 0.0f, 3.0f, 7.0f}},
                                                 .level_s = 400e-6f,
                                                 .average_s = 200e-6f,
                                                 .bias = 1.0f,
                                                 .ratio_max = 2.0f};
    configure();
    for (int k = 0; k < 4; k++) {
        const request_t measuring = step(MODE_PREMAGNETISE);
        /* A tooth begins .1 of the high level above. */
        const float level_A = (k < 2) ? 7.0f : 5.0f;
        assert_request(REQUEST_CURRENT, (ab_t){1.0f, 0.0f}, (dq_t){level_A + 0.7f, 0.0f},
                       &measuring);
        TEST_ASSERT_TRUE(measuring.busy);
    }
    /* The current never changed: no resistance, a fault, and on with the flux. */
    const request_t refused = step(MODE_PREMAGNETISE);
    assert_request(REQUEST_CURRENT, (ab_t){1.0f, 0.0f}, (dq_t){4.0f, 0.0f}, &refused);
    TEST_ASSERT_FALSE(refused.busy);
    TEST_ASSERT_EQUAL_HEX32(FAULT_STATOR_RESISTANCE, faults);
}

/* A fault is added to those of the period, none is taken away. */
static void test_faults_of_others_stay(void)
{
    faults = FAULT_DERATED;
    (void)modes_step(cfg, &st, MODE_PREMAGNETISE, &in, &faults);
    TEST_ASSERT_EQUAL_HEX32(FAULT_DERATED, faults);
    st.flying = (flying_start_state_t){.current_on = true, .current_A = 4.0f, .periods = 703u};
    meas.i_s_A.alpha = 0.0f;
    (void)modes_step(cfg, &st, MODE_FLYING_START, &in, &faults);
    TEST_ASSERT_EQUAL_HEX32(FAULT_DERATED | FAULT_FLYING_START, faults);
}

static void test_commissioning_asks_for_the_current_it_is_given(void)
{
    const request_t out = step(MODE_COMMISSIONING);
    assert_request(REQUEST_CURRENT, (ab_t){1.0f, 0.0f}, (dq_t){2.5f, 0.0f}, &out);
    TEST_ASSERT_TRUE(out.busy); /* RUN has to wait, the legs are not compensated */
}

/* The standing current's voltage; its EMF is what the search looks at. */
static void test_the_search_asks_for_the_voltage_of_a_standing_current(void)
{
    st.flying.current_A = 1.5f;
    st.flying.rough_rad_s = 90.0f;
    dc_current_state_t expected = {0};
    const dc_current_in_t current_in = {.i_ref_A = {1.5f, 0.0f},
                                        .i_A = meas.i_s_A,
                                        .u_V = acting.ended_V,
                                        .Rs_ohm = 1.5f,
                                        .omega_rad_s = 90.0f};
    const ab_t u_V = dc_current_step(&cfg->dc_current, &expected, &current_in);
    const request_t out = step(MODE_FLYING_START);
    assert_request(REQUEST_VOLTAGE, (ab_t){1.0f, 0.0f}, (dq_t){0.0f, 0.0f}, &out);
    ASSERT_SAME_FLOAT(u_V.alpha, out.u_ref_V.alpha);
    ASSERT_SAME_FLOAT(u_V.beta, out.u_ref_V.beta);
    TEST_ASSERT_TRUE(out.busy);
    TEST_ASSERT_EQUAL_UINT32(1u, st.flying.periods);
    TEST_ASSERT_EQUAL_MEMORY(&expected.e_V, &st.flying.block_V, sizeof expected.e_V);
}

/* At its end it is busy no more; a refusal is a fault. */
static void test_the_search_ends_with_an_answer_or_a_fault(void)
{
    meas.i_s_A = (ab_t){4.0f, 0.0f};
    acting.ended_V = (ab_t){6.0f, 0.0f}; /* Rs i: nothing turns */
    st.flying = (flying_start_state_t){
        .current_on = true, .current_A = 4.0f, .periods = 700u, .count = 20.0f, .square_V2 = 1.0f};
    st.flying_current.i_before_A = meas.i_s_A;
    request_t out = {.busy = true};
    for (int k = 0; (k < 4) && out.busy; k++) {
        out = step(MODE_FLYING_START);
    }
    TEST_ASSERT_FALSE(out.busy);
    TEST_ASSERT_EQUAL(FLYING_START_STANDS, st.flying.phase);
    TEST_ASSERT_EQUAL_HEX32(0u, faults);
    meas.i_s_A.alpha = 0.0f; /* no current flows */
    st.flying = (flying_start_state_t){.current_on = true, .current_A = 4.0f, .periods = 703u};
    out = step(MODE_FLYING_START);
    TEST_ASSERT_FALSE(out.busy);
    TEST_ASSERT_EQUAL_HEX32(FAULT_FLYING_START, faults);
}

/* In I-f operation and in a take-over: the vector as it is, and the speed it turns with. */
static void test_a_turning_current_asks_for_its_vector(void)
{
    const mode_id_t modes[] = {MODE_I_F, MODE_TAKE_OVER};
    for (int n = 0; n < 2; n++) {
        st.i_f = (i_f_state_t){
            .active = true, .axis = {0.6f, -0.8f}, .current_A = 5.5f, .omega_rad_s = -40.0f};
        const i_f_state_t before = st.i_f;
        const request_t out = step(modes[n]);
        assert_request(REQUEST_CURRENT, (ab_t){0.6f, -0.8f}, (dq_t){5.5f, 0.0f}, &out);
        ASSERT_SAME_FLOAT(-40.0f, out.omega_e_rad_s);
        TEST_ASSERT_FALSE(out.busy);
        TEST_ASSERT_EQUAL_MEMORY(&before, &st.i_f, sizeof before); /* transition steps it */
    }
}

/* Told the reference, or in torque mode the speed of now. */
static void test_volts_per_hertz_asks_for_its_voltage(void)
{
    use_control(MODES_CONTROL_VOLTS_PER_HERTZ);
    const drive_aim_t aims[] = {DRIVE_AIM_SPEED, DRIVE_AIM_TORQUE, DRIVE_AIM_STOP};
    const float reference_rad_s[] = {50.0f, 100.0f, 50.0f};
    for (int n = 0; n < 3; n++) {
        asked.aim = aims[n];
        ASSERT_SAME_FLOAT(reference_rad_s[n], modes_open_reference_rad_s(&in));
        st.volts = (volts_per_hertz_state_t){.omega_rad_s = 70.0f, .boost_V = 2.0f};
        volts_per_hertz_state_t expected = st.volts;
        const ab_t u_V = volts_per_hertz_step(&cfg->volts, &expected, reference_rad_s[n],
                                              meas.i_s_A, meas.u_dc_V);
        const request_t out = step(MODE_VOLTS_PER_HERTZ);
        assert_request(REQUEST_VOLTAGE, (ab_t){1.0f, 0.0f}, (dq_t){0.0f, 0.0f}, &out);
        ASSERT_SAME_FLOAT(u_V.alpha, out.u_ref_V.alpha);
        ASSERT_SAME_FLOAT(u_V.beta, out.u_ref_V.beta);
        ASSERT_SAME_FLOAT(expected.omega_rad_s, out.omega_e_rad_s);
    }
}

static void test_the_brake_asks_for_its_voltage(void)
{
    dc_brake_start(&st.brake, meas.i_s_A, 3.0f);
    dc_brake_state_t expected = st.brake;
    const ab_t u_V = dc_brake_step(&cfg->brake, &cfg->dc_current, &expected, &in);
    const request_t out = step(MODE_DC_BRAKE);
    assert_request(REQUEST_VOLTAGE, (ab_t){1.0f, 0.0f}, (dq_t){0.0f, 0.0f}, &out);
    ASSERT_SAME_FLOAT(u_V.alpha, out.u_ref_V.alpha);
    ASSERT_SAME_FLOAT(u_V.beta, out.u_ref_V.beta);
    TEST_ASSERT_FALSE(out.busy);
    ASSERT_SAME_FLOAT(0.0f, out.omega_e_rad_s);
}

/* Off, flux-oriented, or no mode at all: nothing is asked here, and no state moves. */
static void test_no_mode_asks_for_nothing(void)
{
    const mode_id_t none[] = {MODE_OFF, MODE_VECTOR, MODE_REMAGNETISE, (mode_id_t)10};
    const modes_state_t before = st;
    for (int n = 0; n < 4; n++) {
        const request_t out = step(none[n]);
        assert_request(REQUEST_CURRENT, (ab_t){0.0f, 0.0f}, (dq_t){0.0f, 0.0f}, &out);
        TEST_ASSERT_FALSE(out.busy);
        TEST_ASSERT_EQUAL_HEX32(0u, faults);
        ASSERT_SAME_FLOAT(0.0f, out.omega_e_rad_s);
        TEST_ASSERT_EQUAL_MEMORY(&before, &st, sizeof before);
    }
}

static void test_each_mode_has_its_kind_and_number(void)
{
    const struct {
        mode_id_t mode;
        bool open;
        bool oriented;
        uint32_t number;
    } expected[] = {
        {MODE_OFF, false, false, 0u},
        {MODE_PREMAGNETISE, false, false, 0u},
        {MODE_COMMISSIONING, false, false, 0u},
        {MODE_FLYING_START, true, false, 1u},
        {MODE_REMAGNETISE, false, true, 0u},
        {MODE_VECTOR, false, true, 0u},
        {MODE_TAKE_OVER, false, false, 0u},
        {MODE_I_F, true, false, 4u},
        {MODE_VOLTS_PER_HERTZ, true, false, 3u},
        {MODE_DC_BRAKE, true, false, 2u},
    };
    for (size_t n = 0u; n < sizeof expected / sizeof expected[0]; n++) {
        TEST_ASSERT_EQUAL(n, expected[n].mode);
        TEST_ASSERT_EQUAL(expected[n].open, modes_open_loop(expected[n].mode));
        TEST_ASSERT_EQUAL(expected[n].oriented, modes_oriented(expected[n].mode));
        TEST_ASSERT_EQUAL_UINT32(expected[n].number, modes_open_number(expected[n].mode));
    }
    TEST_ASSERT_EQUAL_UINT32(0u, modes_open_number((mode_id_t)10));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_control_configured_acts_in_run);
    RUN_TEST(test_a_current_that_holds_the_load_goes_on);
    RUN_TEST(test_the_brake_acts_in_vector_control_where_zero_is_wanted);
    RUN_TEST(test_before_run_the_search_says_how_flux_is_built_up);
    RUN_TEST(test_premagnetisation_asks_for_current_along_u);
    RUN_TEST(test_faults_of_others_stay);
    RUN_TEST(test_commissioning_asks_for_the_current_it_is_given);
    RUN_TEST(test_the_search_asks_for_the_voltage_of_a_standing_current);
    RUN_TEST(test_the_search_ends_with_an_answer_or_a_fault);
    RUN_TEST(test_a_turning_current_asks_for_its_vector);
    RUN_TEST(test_volts_per_hertz_asks_for_its_voltage);
    RUN_TEST(test_the_brake_asks_for_its_voltage);
    RUN_TEST(test_no_mode_asks_for_nothing);
    RUN_TEST(test_each_mode_has_its_kind_and_number);
    return UNITY_END();
}
