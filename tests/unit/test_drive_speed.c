/* What the guard of the speed is given in each mode, with a motor that turns. */
#include "drive.h"

#include "exact.h"
#include "fault.h"
#include "plant_fixture.h"
#include "stages.h"
#include "unity.h"

#define PERIOD_S 200e-6

static drive_params_t p;
static drive_config_t cfg;
static drive_state_t st;
static drive_in_t in;
static drive_out_t out;
static plant_t plant;

void setUp(void)
{
    p = every_mode();
    p.speed_guard = (speed_guard_params_t){.deviation_rad_s = 18.0f,
                                           .deviation_s = 2.0f,
                                           .unknown_s = 60.0f,
                                           .over_speed_rad_s = 400.0f,
                                           .lambda_nominal_Wb = 0.45f};
    p.i_f = (i_f_params_t){
        .current_A = 6.0f, .slew_A_per_s = 100.0f, .slew_rad_s2 = 40.0f, .return_rad_s = 10.0f};
    st = (drive_state_t){0};
    in = (drive_in_t){.mode = DRIVE_PREMAGNETISE};
    plant = plant_of(p.motor, 0.0, 0.0);
}

void tearDown(void)
{
}

static uint32_t run(double time_s)
{
    uint32_t faults = 0u;
    for (int k = 0; k < (int)(time_s / PERIOD_S); k++) {
        const measurement_in_t sample = plant_words(&plant, &p);
        drive_step(&cfg, &st, &sample, &in, &out);
        faults |= out.faults;
        plant_advance(&plant, out.duty, PERIOD_S);
    }
    return faults;
}

static void to_run(float omega_rad_s)
{
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, NULL));
    TEST_ASSERT_EQUAL_HEX32(0u, run(1.0));
    TEST_ASSERT_EQUAL(SPEED_BASIS_STANDING, st.guard.speed.basis);
    in.mode = DRIVE_RUN;
    plant.J_kg_m2 = 0.03;
    in.omega_e_ref_rad_s = omega_rad_s;
    TEST_ASSERT_EQUAL_HEX32(0u, run(2.0));
}

static void test_vector_control_is_compared_with_its_ramped_reference(void)
{
    to_run(100.0f);
    TEST_ASSERT_EQUAL(SPEED_BASIS_ESTIMATE, st.guard.speed.basis);
    TEST_ASSERT_FALSE(st.guard.speed.speed_unknown);
    plant.J_kg_m2 = 1e6; /* a shaft that nothing moves */
    in.omega_e_ref_rad_s = 140.0f;
    TEST_ASSERT_BITS_HIGH(FAULT_DERATED, run(0.3));
    TEST_ASSERT_BITS_HIGH(FAULT_SPEED_DEVIATION, run(1.5));
    in.mode = DRIVE_OFF;
    (void)run(32 * PERIOD_S);
    TEST_ASSERT_EQUAL(SPEED_BASIS_NONE, st.guard.speed.basis);
    ASSERT_SAME_FLOAT(0.0f, st.guard.speed.deviation_s);
}

static void test_an_estimate_in_doubt_beside_a_standing_field_is_unknown(void)
{
    p.supervisor.return_s = 1.0f;
    to_run(100.0f);
    st.supervisor.confidence = SUPERVISOR_DEGRADED;
    st.supervisor.quiet_schedules = 0u;
    TEST_ASSERT_EQUAL_HEX32(0u, run(32 * PERIOD_S));
    TEST_ASSERT_FALSE(st.guard.speed.speed_unknown);
    st.supervisor.standing_pu = 0.9f;
    TEST_ASSERT_EQUAL_HEX32(0u, run(32 * PERIOD_S));
    TEST_ASSERT_TRUE(st.guard.speed.speed_unknown);
}

static void test_an_estimate_in_doubt_that_leaves_its_reference_is_unknown(void)
{
    p.supervisor.return_s = 1.0f;
    to_run(100.0f);
    st.guard.speed.deviation_s = 0.1f;
    TEST_ASSERT_EQUAL_HEX32(0u, run(16 * PERIOD_S));
    TEST_ASSERT_FALSE(st.guard.speed.speed_unknown); /* sure of itself */
    st.supervisor.confidence = SUPERVISOR_DEGRADED;
    st.supervisor.quiet_schedules = 0u;
    TEST_ASSERT_EQUAL_HEX32(0u, run(16 * PERIOD_S));
    TEST_ASSERT_TRUE(st.guard.speed.speed_unknown);
    st.guard.speed.deviation_s = 0.0f;
    TEST_ASSERT_EQUAL_HEX32(0u, run(16 * PERIOD_S));
    TEST_ASSERT_FALSE(st.guard.speed.speed_unknown);
}

/* Torque mode may run anywhere between its speeds, -200 and 300 rad/s, and no further. */
static void test_torque_mode_is_compared_with_its_speeds(void)
{
    to_run(100.0f);
    in.aim = DRIVE_AIM_TORQUE;
    plant.J_kg_m2 = 1e6;
    for (double omega = -200.0; omega <= 300.0; omega += 100.0) {
        plant.omega_e_rad_s = omega;
        st.estimator.adaptation.x_rad_s = (float)omega;
        st.estimator.estimate.omega_e_rad_s = (float)omega;
        (void)run(0.05);
        TEST_ASSERT_EQUAL_HEX32(0u, out.faults & FAULT_SPEED_DEVIATION);
    }
    plant.omega_e_rad_s = 350.0;
    TEST_ASSERT_BITS_HIGH(FAULT_SPEED_DEVIATION, run(2.5));
}

static void test_v_f_and_i_f_are_known_while_the_rotor_follows(void)
{
    for (modes_control_t c = MODES_CONTROL_VOLTS_PER_HERTZ; c <= MODES_CONTROL_I_F; c++) {
        setUp();
        p.modes.control = c;
        to_run(60.0f);
        TEST_ASSERT_EQUAL((c == MODES_CONTROL_I_F) ? SPEED_BASIS_CURRENT : SPEED_BASIS_VOLTAGE,
                          st.guard.speed.basis);
        TEST_ASSERT_FALSE(st.guard.speed.speed_unknown);
        in.aim = DRIVE_AIM_TORQUE; /* cannot be held: the speed of now is */
        TEST_ASSERT_EQUAL_HEX32(0u, run(0.2));
        ASSERT_SAME_FLOAT(0.0f, st.guard.speed.deviation_s);
        in.aim = DRIVE_AIM_SPEED;
        plant.J_kg_m2 = 1e6; /* held fast at speed 0 */
        plant.omega_e_rad_s = 0.0;
        TEST_ASSERT_BITS_HIGH(FAULT_SPEED_DEVIATION, run(2.0));
        TEST_ASSERT_TRUE(st.guard.speed.speed_unknown);
    }
}

/* Between the frequency that a current vector asks for and the one of a voltage vector, four times
 * as far up and more, the rotor is seen under I/f alone. */
static void test_a_current_vector_shows_the_rotor_from_a_lower_frequency(void)
{
    const mode_id_t mode[] = {MODE_I_F, MODE_TAKE_OVER, MODE_VOLTS_PER_HERTZ};
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, NULL));
    const rotor_check_config_t *rotor = &cfg.guard.speed.rotor;
    const float between_rad_s = 0.5f * (rotor->current_rad_s + rotor->voltage_rad_s);
    out = (drive_out_t){0};
    in.omega_e_ref_rad_s = between_rad_s;
    for (int n = 0; n < 3; n++) {
        st = (drive_state_t){.mode = mode[n], .slot = SLOT_GUARD_SPEED};
        st.modes.i_f.omega_rad_s = between_rad_s;
        st.modes.volts.omega_rad_s = between_rad_s;
        TEST_ASSERT_EQUAL_HEX32(0u, stage_guard_look(&cfg, &st, &in, &out));
        TEST_ASSERT_EQUAL(mode[n] == MODE_VOLTS_PER_HERTZ, st.guard.speed.speed_unknown);
    }
}

static void test_a_direct_current_knows_nothing(void)
{
    p.modes.brake.current_A = 8.0f;
    to_run(100.0f);
    in.omega_e_ref_rad_s = 0.0f;
    TEST_ASSERT_EQUAL_HEX32(0u, run(0.15));
    TEST_ASSERT_EQUAL(SPEED_BASIS_NOBODY, st.guard.speed.basis);
    TEST_ASSERT_TRUE(st.guard.speed.speed_unknown);
    setUp();
    p.modes.flying.enable = true;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, NULL));
    TEST_ASSERT_EQUAL_HEX32(0u, run(0.05));
    TEST_ASSERT_EQUAL(SPEED_BASIS_NOBODY, st.guard.speed.basis);
    TEST_ASSERT_TRUE(st.guard.speed.speed_unknown);
}

static void test_a_start_on_a_turning_shaft_is_refused(void)
{
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, NULL));
    plant = plant_of(p.motor, 125.0, 0.0);
    TEST_ASSERT_BITS_HIGH(FAULT_FLYING_START, run(0.3));
    setUp();
    plant = plant_of(p.motor, 125.0, 0.0);
    p.modes.flying.enable =
        true; /* then it is caught, and with torque or without its speed known */
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, NULL));
    TEST_ASSERT_EQUAL_HEX32(0u, run(1.0));
    TEST_ASSERT_EQUAL(MODE_REMAGNETISE, st.mode);
    TEST_ASSERT_EQUAL(SPEED_BASIS_ESTIMATE, st.guard.speed.basis);
}

/* A mode that a lost bit made: nobody knows what it imposes. */
static void test_in_no_mode_there_is_the_speed_is_unknown(void)
{
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, &test_table));
    st.mode = (mode_id_t)(MODE_DC_BRAKE + 1);
    st.slot = SLOT_GUARD_SPEED;
    TEST_ASSERT_EQUAL_HEX32(0u, stage_guard_look(&cfg, &st, &in, &out));
    TEST_ASSERT_TRUE(st.guard.speed.speed_unknown);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_in_no_mode_there_is_the_speed_is_unknown);
    RUN_TEST(test_vector_control_is_compared_with_its_ramped_reference);
    RUN_TEST(test_an_estimate_in_doubt_beside_a_standing_field_is_unknown);
    RUN_TEST(test_an_estimate_in_doubt_that_leaves_its_reference_is_unknown);
    RUN_TEST(test_torque_mode_is_compared_with_its_speeds);
    RUN_TEST(test_v_f_and_i_f_are_known_while_the_rotor_follows);
    RUN_TEST(test_a_current_vector_shows_the_rotor_from_a_lower_frequency);
    RUN_TEST(test_a_direct_current_knows_nothing);
    RUN_TEST(test_a_start_on_a_turning_shaft_is_refused);
    return UNITY_END();
}
