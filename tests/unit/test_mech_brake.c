/* The sequence of a mechanical brake: every transition, every fault, with a switch and without. */
#include "mech_brake.h"

#include <math.h>

#include "unity.h"

static mech_brake_config_t cfg;
static mech_brake_state_t st;
static mech_brake_in_t in;
static mech_brake_out_t out;

void setUp(void)
{
    cfg = (mech_brake_config_t){.on = true,
                                .feedback = true,
                                .torque_Nm = 10.0f,
                                .close_rad_s = 2.0f,
                                .prove_steps = 100u,
                                .release_steps = 50u,
                                .close_steps = 60u,
                                .stop_steps = 200u};
    TEST_ASSERT_TRUE(mech_brake_init(&cfg));
    st = (mech_brake_state_t){0};
    in = (mech_brake_in_t){.steps = 1u, .omega_ref_rad_s = 30.0f};
}
void tearDown(void)
{
}

/* The last step's faults are those that count. */
static void steps(uint32_t n)
{
    for (uint32_t k = 0u; k < n; k++) {
        out = mech_brake_step(&cfg, &st, &in);
    }
}

static void expect(mech_brake_id_t id, bool release, bool run, uint32_t faults)
{
    TEST_ASSERT_EQUAL(id, st.id);
    TEST_ASSERT_EQUAL(release, out.release);
    TEST_ASSERT_EQUAL(run, out.run);
    TEST_ASSERT_EQUAL_UINT32(faults, out.faults);
}

static void prove(void)
{
    in.run = true;
    steps(1u);
    in.gates_on = true;
    in.running = true;
    in.torque_Nm = 10.0f;
}

static void to_releasing(void)
{
    prove();
    steps(20u);
    expect(MECH_BRAKE_RELEASING, true, true, 0u);
}

static void to_released(void)
{
    to_releasing();
    in.released = true;
    steps(5u);
    in.omega_hat_rad_s = 30.0f;
    expect(MECH_BRAKE_RELEASED, true, true, 0u);
}

static void to_closing(void)
{
    to_released();
    in.run = false;
    in.omega_hat_rad_s = 1.0f;
    steps(1u);
    expect(MECH_BRAKE_CLOSING, false, true, 0u);
}

static void test_init_wants_positive_numbers(void)
{
    float *const floats[] = {&cfg.torque_Nm, &cfg.close_rad_s};
    uint32_t *const times[] = {&cfg.prove_steps, &cfg.release_steps, &cfg.close_steps,
                               &cfg.stop_steps};
    for (uint32_t k = 0u; k < 2u; k++) {
        const float right = *floats[k];
        *floats[k] = 0.0f;
        TEST_ASSERT_FALSE(mech_brake_init(&cfg));
        *floats[k] = right;
    }
    for (uint32_t k = 0u; k < 4u; k++) {
        const uint32_t right = *times[k];
        *times[k] = 0u;
        TEST_ASSERT_FALSE(mech_brake_init(&cfg));
        *times[k] = 1u;
        TEST_ASSERT_TRUE(mech_brake_init(&cfg));
        *times[k] = right;
    }
    cfg = (mech_brake_config_t){0};
    TEST_ASSERT_TRUE(mech_brake_init(&cfg));
}

static void test_off_it_passes_run_and_reference(void)
{
    cfg.on = false;
    in.run = true;
    steps(1u);
    expect(MECH_BRAKE_CLOSED, false, true, 0u);
    TEST_ASSERT_EQUAL_FLOAT(30.0f, out.omega_ref_rad_s);
    TEST_ASSERT_FALSE(out.torque_mode);
    in.run = false;
    steps(1u);
    TEST_ASSERT_FALSE(out.run);
}

static void test_it_stays_closed_without_run(void)
{
    steps(100u);
    expect(MECH_BRAKE_CLOSED, false, false, 0u);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, out.omega_ref_rad_s);
}

static void test_it_stays_closed_without_a_reference(void)
{
    in.run = true;
    in.omega_ref_rad_s = -2.0f;
    steps(100u);
    expect(MECH_BRAKE_CLOSED, false, false, 0u);
    in.omega_ref_rad_s = -2.1f;
    steps(1u);
    expect(MECH_BRAKE_PROVING, false, true, 0u);
}

static void test_it_proves_the_torque_before_it_releases(void)
{
    prove();
    TEST_ASSERT_TRUE(out.torque_mode);
    TEST_ASSERT_EQUAL_FLOAT(10.0f, out.torque_Nm);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, out.omega_ref_rad_s);
    steps(19u);
    expect(MECH_BRAKE_PROVING, false, true, 0u);
    steps(1u);
    expect(MECH_BRAKE_RELEASING, true, true, 0u);
    TEST_ASSERT_FALSE(out.torque_mode);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, out.torque_Nm);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, out.omega_ref_rad_s);
}

static void test_the_torque_has_to_stand(void)
{
    prove();
    in.torque_Nm = 9.01f;
    steps(19u);
    in.torque_Nm = 8.99f;
    steps(1u);
    in.torque_Nm = 9.01f;
    steps(19u);
    expect(MECH_BRAKE_PROVING, false, true, 0u);
    steps(1u);
    expect(MECH_BRAKE_RELEASING, true, true, 0u);
}

static void test_the_torque_may_be_just_enough(void)
{
    prove();
    in.torque_Nm = 0.9f * 10.0f;
    steps(20u);
    expect(MECH_BRAKE_RELEASING, true, true, 0u);
}

static void test_a_second_lift_is_as_the_first(void)
{
    to_closing();
    in.released = false;
    steps(5u);
    in.running = false;
    steps(5u);
    in.gates_on = false;
    steps(5u);
    in.run = true;
    steps(5u); /* no gates yet */
    expect(MECH_BRAKE_PROVING, false, true, 0u);
    in.gates_on = true;
    in.running = true;
    steps(19u);
    expect(MECH_BRAKE_PROVING, false, true, 0u);
    steps(1u);
    expect(MECH_BRAKE_RELEASING, true, true, 0u);
}

static void test_a_switch_that_bounces_is_no_fault(void)
{
    to_released();
    in.omega_hat_rad_s = 0.0f;
    for (uint32_t k = 0u; k < 10u; k++) {
        in.released = false;
        steps(4u);
        in.released = true;
        steps(1u);
        expect(MECH_BRAKE_RELEASED, true, true, 0u);
    }
    in.run = false;
    in.released = false;
    steps(4u);
    expect(MECH_BRAKE_CLOSING, false, true, 0u);
    steps(1u);
    expect(MECH_BRAKE_CLOSED, false, false, 0u);
    in.run = true;
    in.released = true;
    steps(4u);
    expect(MECH_BRAKE_CLOSED, false, false, 0u); /* it may open just now: nothing starts */
    in.released = false;
    steps(1u);
    expect(MECH_BRAKE_PROVING, false, true, 0u);
}

static void test_torque_of_a_drive_that_does_not_run_yet_proves_nothing(void)
{
    prove();
    in.running = false;
    steps(1000u);
    expect(MECH_BRAKE_PROVING, false, true, 0u);
    TEST_ASSERT_EQUAL_UINT32(0u, st.steps);
}

static void test_without_torque_it_gives_up_and_stays_closed(void)
{
    prove();
    in.torque_Nm = 5.0f;
    steps(99u);
    expect(MECH_BRAKE_PROVING, false, true, 0u);
    steps(1u);
    expect(MECH_BRAKE_CLOSED, false, false, MECH_BRAKE_NO_TORQUE);
    in.gates_on = false;
    in.running = false;
    steps(100u);
    expect(MECH_BRAKE_CLOSED, false, false, 0u);
    in.run = false;
    steps(1u);
    in.run = true;
    steps(1u);
    expect(MECH_BRAKE_PROVING, false, true, 0u);
}

static void test_run_that_drops_while_proving_leaves_it_closed(void)
{
    prove();
    in.run = false;
    steps(1u);
    expect(MECH_BRAKE_CLOSED, false, false, 0u);
    in.run = true;
    steps(1u);
    expect(MECH_BRAKE_PROVING, false, true, 0u);
}

static void test_the_switch_ends_the_release(void)
{
    to_releasing();
    steps(44u);
    in.released = true;
    steps(4u);
    expect(MECH_BRAKE_RELEASING, true, true, 0u);
    steps(1u);
    expect(MECH_BRAKE_RELEASED, true, true, 0u);
    TEST_ASSERT_EQUAL_FLOAT(30.0f, out.omega_ref_rad_s);
}

static void test_a_brake_that_does_not_release_ends_it(void)
{
    to_releasing();
    steps(49u);
    expect(MECH_BRAKE_RELEASING, true, true, 0u);
    steps(1u);
    expect(MECH_BRAKE_CLOSED, false, false, MECH_BRAKE_NOT_RELEASED);
    TEST_ASSERT_TRUE(st.blocked);
}

static void test_without_a_switch_the_time_ends_the_release(void)
{
    cfg.feedback = false;
    to_releasing();
    steps(49u);
    expect(MECH_BRAKE_RELEASING, true, true, 0u);
    steps(1u);
    expect(MECH_BRAKE_RELEASED, true, true, 0u);
}

static void test_run_that_drops_while_releasing_closes_it(void)
{
    to_releasing();
    in.run = false;
    steps(1u);
    expect(MECH_BRAKE_CLOSING, false, true, 0u);
}

/* RAMP_DOWN after a fault ends at standstill, which is here. */
static void test_a_drive_that_stops_by_itself_is_not_given_the_load(void)
{
    to_releasing();
    in.running = false;
    steps(1u);
    expect(MECH_BRAKE_CLOSING, false, true, 0u);
}

static void test_released_it_follows_the_reference(void)
{
    to_released();
    in.omega_ref_rad_s = -12.0f;
    in.omega_hat_rad_s = 0.0f; /* through zero, not at it */
    steps(1000u);
    expect(MECH_BRAKE_RELEASED, true, true, 0u);
    TEST_ASSERT_EQUAL_FLOAT(-12.0f, out.omega_ref_rad_s);
}

static void test_a_low_reference_closes_it_at_low_speed(void)
{
    to_released();
    in.omega_ref_rad_s = 2.0f;
    in.omega_hat_rad_s = -2.1f;
    steps(1000u);
    expect(MECH_BRAKE_RELEASED, true, true, 0u);
    in.omega_hat_rad_s = -2.0f;
    steps(1u);
    expect(MECH_BRAKE_CLOSING, false, true, 0u);
}

static void test_a_stop_asks_for_zero_and_closes_at_low_speed(void)
{
    to_released();
    in.run = false;
    steps(199u);
    expect(MECH_BRAKE_RELEASED, true, true, 0u);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, out.omega_ref_rad_s);
    in.omega_hat_rad_s = 1.9f;
    steps(1u);
    expect(MECH_BRAKE_CLOSING, false, true, 0u);
}

static void test_a_stop_that_lasts_too_long_closes_it_at_any_speed(void)
{
    to_released();
    in.run = false;
    in.omega_hat_rad_s = NAN;
    steps(199u);
    expect(MECH_BRAKE_RELEASED, true, true, 0u);
    steps(1u);
    expect(MECH_BRAKE_CLOSING, false, true, 0u);
}

static void test_a_stop_that_was_taken_back_counts_anew(void)
{
    to_released();
    in.run = false;
    steps(199u);
    in.run = true;
    steps(1u);
    TEST_ASSERT_EQUAL_FLOAT(30.0f, out.omega_ref_rad_s);
    in.run = false;
    steps(199u);
    expect(MECH_BRAKE_RELEASED, true, true, 0u);
}

static void test_a_drive_that_stops_by_itself_closes_it_at_low_speed(void)
{
    to_released();
    in.running = false; /* RAMP_DOWN after a fault */
    steps(10u);
    expect(MECH_BRAKE_RELEASED, true, true, 0u);
    in.omega_hat_rad_s = 0.0f;
    steps(1u);
    expect(MECH_BRAKE_CLOSING, false, true, 0u);
}

static void test_the_switch_of_a_released_brake_that_opens_closes_it(void)
{
    to_released();
    in.released = false;
    steps(4u);
    expect(MECH_BRAKE_RELEASED, true, true, 0u);
    in.released = true;
    steps(1u);
    in.released = false;
    steps(4u);
    expect(MECH_BRAKE_RELEASED, true, true, 0u);
    steps(1u);
    expect(MECH_BRAKE_CLOSED, false, false, MECH_BRAKE_LOST);
    TEST_ASSERT_TRUE(st.blocked);
}

static void test_closing_holds_zero_until_the_switch_says_closed(void)
{
    to_closing();
    in.run = true; /* waits until it has closed */
    steps(54u);
    in.released = false;
    steps(4u);
    expect(MECH_BRAKE_CLOSING, false, true, 0u);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, out.omega_ref_rad_s);
    steps(1u);
    expect(MECH_BRAKE_CLOSED, false, false, 0u);
}

static void test_a_brake_that_does_not_close_leaves_the_load_to_the_motor(void)
{
    to_closing();
    steps(59u);
    expect(MECH_BRAKE_CLOSING, false, true, 0u);
    steps(1u);
    expect(MECH_BRAKE_CLOSING, false, true, MECH_BRAKE_NOT_CLOSED);
    steps(1000u);
    expect(MECH_BRAKE_CLOSING, false, true, MECH_BRAKE_NOT_CLOSED);
    TEST_ASSERT_EQUAL_UINT32(60u, st.steps);
    in.released = false;
    steps(4u);
    expect(MECH_BRAKE_CLOSING, false, true, MECH_BRAKE_NOT_CLOSED);
    steps(1u);
    expect(MECH_BRAKE_CLOSED, false, false, 0u);
}

static void test_without_a_switch_the_time_ends_the_closing(void)
{
    cfg.feedback = false;
    to_releasing();
    steps(50u);
    in.run = false;
    steps(1u);
    expect(MECH_BRAKE_CLOSING, false, true, 0u);
    steps(59u);
    expect(MECH_BRAKE_CLOSING, false, true, 0u);
    steps(1u);
    expect(MECH_BRAKE_CLOSED, false, false, 0u);
}

/* It has the time that it takes to close before it is told. */
static void test_a_brake_that_is_released_at_rest_lets_nothing_start(void)
{
    in.run = true;
    in.released = true;
    steps(60u);
    expect(MECH_BRAKE_CLOSED, false, false, 0u);
    steps(1u);
    expect(MECH_BRAKE_CLOSED, false, false, MECH_BRAKE_NOT_CLOSED);
    steps(1000u);
    expect(MECH_BRAKE_CLOSED, false, false, MECH_BRAKE_NOT_CLOSED);
    TEST_ASSERT_EQUAL_UINT32(60u, st.steps);
    in.released = false;
    steps(4u);
    expect(MECH_BRAKE_CLOSED, false, false, MECH_BRAKE_NOT_CLOSED);
    steps(1u);
    expect(MECH_BRAKE_PROVING, false, true, 0u);
}

static void test_a_brake_that_lets_go_while_proving_leaves_the_load_to_the_motor(void)
{
    prove();
    steps(5u);
    in.released = true;
    steps(4u);
    expect(MECH_BRAKE_PROVING, false, true, 0u);
    steps(1u);
    expect(MECH_BRAKE_CLOSING, false, true, MECH_BRAKE_NOT_CLOSED);
    TEST_ASSERT_FALSE(out.torque_mode);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, out.omega_ref_rad_s);
    in.released = false;
    steps(5u);
    expect(MECH_BRAKE_CLOSED, false, false, 0u);
    steps(100u);
    expect(MECH_BRAKE_CLOSED, false, false, 0u); /* run has to drop */
    in.run = false;
    in.gates_on = false;
    steps(1u);
    in.run = true; /* and before the gates are on there is nothing to hold with */
    in.released = true;
    steps(1u);
    expect(MECH_BRAKE_CLOSED, false, false, 0u);
    in.released = false;
    steps(1u);
    expect(MECH_BRAKE_PROVING, false, true, 0u);
    in.released = true;
    steps(5u);
    expect(MECH_BRAKE_CLOSED, false, false, MECH_BRAKE_NOT_CLOSED);
}

/* As after a fault of the drive: the magnet takes its time, and that is no contradiction. */
static void test_a_brake_that_is_still_closing_is_no_fault(void)
{
    to_released();
    in.gates_on = false;
    steps(59u);
    expect(MECH_BRAKE_CLOSED, false, false, 0u);
    in.released = false;
    steps(10u);
    expect(MECH_BRAKE_CLOSED, false, false, 0u);
}

static void test_without_gates_it_closes_at_once(void)
{
    for (uint32_t k = 0u; k < 4u; k++) {
        setUp();
        if (k == 0u) {
            prove();
            steps(1u);
        } else if (k == 1u) {
            to_releasing();
        } else if (k == 2u) {
            to_released();
        } else {
            to_closing();
            in.run = true;
        }
        in.gates_on = false;
        steps(1u);
        expect(MECH_BRAKE_CLOSED, false, false, 0u);
        in.released = false;
        steps(100u);
        expect(MECH_BRAKE_CLOSED, false, false, 0u);
        in.run = false;
        steps(1u);
        in.run = true;
        steps(1u);
        expect(MECH_BRAKE_PROVING, false, true, 0u);
    }
}

static void test_an_off_closes_it_at_once(void)
{
    to_released();
    in.off = true;
    steps(1u);
    expect(MECH_BRAKE_CLOSED, false, false, 0u);
    TEST_ASSERT_TRUE(st.blocked);
}

static void test_gates_that_were_never_on_are_waited_for(void)
{
    in.run = true;
    steps(500u);
    expect(MECH_BRAKE_PROVING, false, true, 0u);
}

static void test_a_state_that_is_none_is_closed(void)
{
    st.id = (mech_brake_id_t)7;
    in.run = false;
    steps(1u);
    TEST_ASSERT_FALSE(out.release);
    in.run = true;
    steps(1u);
    expect(MECH_BRAKE_PROVING, false, true, 0u);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_wants_positive_numbers);
    RUN_TEST(test_off_it_passes_run_and_reference);
    RUN_TEST(test_it_stays_closed_without_run);
    RUN_TEST(test_it_stays_closed_without_a_reference);
    RUN_TEST(test_it_proves_the_torque_before_it_releases);
    RUN_TEST(test_the_torque_has_to_stand);
    RUN_TEST(test_the_torque_may_be_just_enough);
    RUN_TEST(test_a_second_lift_is_as_the_first);
    RUN_TEST(test_a_switch_that_bounces_is_no_fault);
    RUN_TEST(test_torque_of_a_drive_that_does_not_run_yet_proves_nothing);
    RUN_TEST(test_without_torque_it_gives_up_and_stays_closed);
    RUN_TEST(test_run_that_drops_while_proving_leaves_it_closed);
    RUN_TEST(test_the_switch_ends_the_release);
    RUN_TEST(test_a_brake_that_does_not_release_ends_it);
    RUN_TEST(test_without_a_switch_the_time_ends_the_release);
    RUN_TEST(test_run_that_drops_while_releasing_closes_it);
    RUN_TEST(test_a_drive_that_stops_by_itself_is_not_given_the_load);
    RUN_TEST(test_released_it_follows_the_reference);
    RUN_TEST(test_a_low_reference_closes_it_at_low_speed);
    RUN_TEST(test_a_stop_asks_for_zero_and_closes_at_low_speed);
    RUN_TEST(test_a_stop_that_lasts_too_long_closes_it_at_any_speed);
    RUN_TEST(test_a_stop_that_was_taken_back_counts_anew);
    RUN_TEST(test_a_drive_that_stops_by_itself_closes_it_at_low_speed);
    RUN_TEST(test_the_switch_of_a_released_brake_that_opens_closes_it);
    RUN_TEST(test_closing_holds_zero_until_the_switch_says_closed);
    RUN_TEST(test_a_brake_that_does_not_close_leaves_the_load_to_the_motor);
    RUN_TEST(test_without_a_switch_the_time_ends_the_closing);
    RUN_TEST(test_a_brake_that_is_released_at_rest_lets_nothing_start);
    RUN_TEST(test_a_brake_that_lets_go_while_proving_leaves_the_load_to_the_motor);
    RUN_TEST(test_a_brake_that_is_still_closing_is_no_fault);
    RUN_TEST(test_without_gates_it_closes_at_once);
    RUN_TEST(test_an_off_closes_it_at_once);
    RUN_TEST(test_gates_that_were_never_on_are_waited_for);
    RUN_TEST(test_a_state_that_is_none_is_closed);
    return UNITY_END();
}
