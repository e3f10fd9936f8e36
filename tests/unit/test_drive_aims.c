/* What the whole law is to reach: a speed by its ramp, a torque, a stop; or a current of
 * commissioning. */
#include "drive.h"

#include "drive_fixture.h"
#include "exact.h"
#include "unity.h"

static drive_config_t cfg;
static drive_params_t p;
static drive_in_t in;
static measurement_in_t sample;
static drive_out_t out;
static drive_state_t st;

static void configure(float jerk_rad_s3)
{
    p.ramp.jerk_rad_s3 = jerk_rad_s3;
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, NULL));
    st = (drive_state_t){.estimator.observer = {.lambda_r_hat_Wb = {0.4f, 0.0f}}};
    in = (drive_in_t){.mode = DRIVE_RUN};
    sample = words(&p, 0, 4.0, 0.0, 540.0);
}

void setUp(void)
{
    p = both_machines(0);
    estimator_list.observer_gain_enable = 0u;
    estimator_list.adapt_kp = 0.0f;
    estimator_list.adapt_ki = 0.0f;
    estimator_list.eps1 = 0.0f;
    configure(0.0f);
}

void tearDown(void)
{
}

static void step(void)
{
    drive_step(&cfg, &st, &sample, &in, &out);
}

/* Until references have been planned again: the next period but in every fourth. */
static void step_planned(void)
{
    do {
        step();
    } while (!slot_is_quarter(st.slot, SLOT_QUARTER_REFERENCES));
}

static void test_init_refuses_a_senseless_ramp(void)
{
    p.ramp.stop_rad_s2 = 0.0f;
    TEST_ASSERT_FALSE(drive_init(&cfg, &p, NULL));
}

/* 500 rad/s^2 of a stop; without jerk limit nothing else has a ramp but the slew limit of 4000. */
static void test_a_stop_has_its_own_rate(void)
{
    st.modes.vector.speed.omega_ref_rad_s = 100.0f;
    in.aim = DRIVE_AIM_STOP;
    step_planned();
    ASSERT_NEAR(1e-4, 99.6, st.modes.vector.speed.omega_ref_rad_s); /* 800 us */
    in.aim = DRIVE_AIM_SPEED;
    in.omega_e_ref_rad_s = 50.0f;
    step_planned();
    ASSERT_NEAR(1e-4, 98.8, st.modes.vector.speed.omega_ref_rad_s); /* 200 us */
}

/* Quanta of 50 000 x (.8 ms)^2 = 32 mrad/s, which the slew limit passes in one period. */
static void test_a_jerk_limit_starts_gently(void)
{
    configure(50000.0f);
    in.omega_e_ref_rad_s = 50.0f;
    step_planned();
    ASSERT_NEAR(1e-6, 0.032, st.modes.vector.speed.omega_ref_rad_s);
    step_planned();
    ASSERT_NEAR(1e-6, 0.096, st.modes.vector.speed.omega_ref_rad_s);
}

/* What the ramp was about is forgotten in torque mode: speed mode starts at rest again. */
static void test_after_torque_mode_the_ramp_begins_anew(void)
{
    configure(50000.0f);
    in.omega_e_ref_rad_s = 50.0f;
    for (int k = 0; k < 20; k++) {
        step_planned();
    }
    TEST_ASSERT_TRUE(st.modes.vector.ramp.steps > 10.0f);
    in.aim = DRIVE_AIM_TORQUE;
    in.torque_ref_Nm = 1.0f;
    step_planned();
    ASSERT_SAME_FLOAT(0.0f, st.modes.vector.ramp.steps);
    TEST_ASSERT_TRUE(out.i_ref_A.q > 0.0f);
}

static void test_commissioning_gives_the_current_that_is_asked(void)
{
    in.mode = DRIVE_COMMISSION;
    in.i_d_ref_A = 2.5f;
    step();
    ASSERT_SAME_FLOAT(2.5f, out.i_ref_A.d);
    ASSERT_SAME_FLOAT(0.0f, out.i_ref_A.q);
    TEST_ASSERT_TRUE(out.premagnetising);
}

/* Reference and estimate, in both directions; of impressed current, what is imposed. */
static void test_standing_is_reference_and_estimate(void)
{
    TEST_ASSERT_TRUE(drive_standing(&st, 1.0f));
    st.modes.vector.speed.omega_ref_rad_s = -1.1f;
    TEST_ASSERT_FALSE(drive_standing(&st, 1.0f));
    st.modes.i_f.active = true;
    TEST_ASSERT_TRUE(drive_standing(&st, 1.0f));
    st.modes.i_f.omega_rad_s = 1.1f;
    TEST_ASSERT_FALSE(drive_standing(&st, 1.0f));
    st.modes.i_f.omega_rad_s = -1.0f;
    st.estimator.estimate.omega_e_rad_s = -1.1f;
    TEST_ASSERT_FALSE(drive_standing(&st, 1.0f));
    st.estimator.estimate.omega_e_rad_s = 1.0f;
    TEST_ASSERT_TRUE(drive_standing(&st, 1.0f));
}

/* Impressed current cannot hold a torque: it holds the speed of then, whatever is commanded. */
static void test_a_take_over_in_torque_mode_holds_the_speed(void)
{
    p.lost_action = DRIVE_LOST_I_F;
    p.i_f = (i_f_params_t){.current_A = 8.0f,
                           .slew_A_per_s = 100.0f,
                           .slew_rad_s2 = 1000.0f,
                           .return_rad_s = 12.0f,
                           .timeout_s = 1.0f};
    const drive_aim_t aim[2] = {DRIVE_AIM_TORQUE, DRIVE_AIM_SPEED};
    const double moved_rad_s[2] = {0.0, 0.2};
    for (int k = 0; k < 2; k++) {
        configure(0.0f);
        in.aim = aim[k];
        in.omega_e_ref_rad_s = 200.0f;
        st.modes.vector.speed.omega_ref_rad_s = 5.0f;
        st.modes.i_f = (i_f_state_t){
            .active = true, .axis = {1.0f, 0.0f}, .current_A = 8.0f, .omega_rad_s = 5.0f};
        st.supervisor.confidence = SUPERVISOR_IMPRESSED;
        step();
        ASSERT_NEAR(1e-5, 5.0 + moved_rad_s[k], st.modes.i_f.omega_rad_s);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_a_senseless_ramp);
    RUN_TEST(test_a_stop_has_its_own_rate);
    RUN_TEST(test_a_jerk_limit_starts_gently);
    RUN_TEST(test_after_torque_mode_the_ramp_begins_anew);
    RUN_TEST(test_commissioning_gives_the_current_that_is_asked);
    RUN_TEST(test_standing_is_reference_and_estimate);
    RUN_TEST(test_a_take_over_in_torque_mode_holds_the_speed);
    return UNITY_END();
}
