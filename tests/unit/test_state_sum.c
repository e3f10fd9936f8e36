#include "state_sum.h"

#include <math.h>

#include "unity.h"

static drive_state_t st;

void setUp(void)
{
    st = (drive_state_t){0};
}

void tearDown(void)
{
}

static void assert_each_is_seen(float *const value[], size_t count, bool fast)
{
    const float bad[] = {NAN, INFINITY, -INFINITY};
    for (size_t n = 0; n < count; n++) {
        for (size_t k = 0; k < sizeof bad / sizeof bad[0]; k++) {
            *value[n] = bad[k];
            TEST_ASSERT_EQUAL_INT(!fast, isfinite(state_sum_fast(&st)) != 0);
            TEST_ASSERT_EQUAL_INT(fast, isfinite(state_sum_slow(&st)) != 0);
        }
        *value[n] = 1.0f;
    }
    TEST_ASSERT_EQUAL_FLOAT((float)count, fast ? state_sum_fast(&st) : state_sum_slow(&st));
}

static void test_what_the_estimate_and_the_voltage_rest_on_is_seen_at_once(void)
{
    observer_state_t *const o = &st.observer;
    float *const value[] = {
        &o->i_s_hat_A.alpha,      &o->i_s_hat_A.beta,    &o->lambda_r_hat_Wb.alpha,
        &o->lambda_r_hat_Wb.beta, &o->e1_A.alpha,        &o->e1_A.beta,
        &st.adaptation.x_rad_s,   &st.omega_e_hat_rad_s, &st.omega_s_hat_rad_s,
        &st.current.d.x,          &st.current.q.x,       &st.speed.pi.x,
        &st.u_acting_V.alpha,     &st.u_acting_V.beta,   &st.u_pending_V.alpha,
        &st.u_pending_V.beta};
    assert_each_is_seen(value, sizeof value / sizeof value[0], true);
}

static void test_control_and_resistance_are_seen_once_per_turn(void)
{
    rs_measurement_sums_t *const high = &st.rs_measurement.high;
    rs_measurement_sums_t *const low = &st.rs_measurement.low;
    float *const value[] = {&st.speed.omega_filtered_rad_s,
                            &st.speed.omega_ref_rad_s,
                            &st.speed.more,
                            &st.speed.i_q_A,
                            &st.ramp.steps,
                            &st.flux.pi.x,
                            &st.flux_below_Wb,
                            &st.i_d_less_A,
                            &st.torque_more_pu,
                            &st.steering.torque_Nm,
                            &st.steering.below_Wb,
                            &st.steer.below_Wb,
                            &st.steer.rate_Wb_per_s,
                            &st.impressed.axis.alpha,
                            &st.impressed.axis.beta,
                            &st.impressed.current_A,
                            &st.impressed.omega_rad_s,
                            &high->i_A,
                            &high->u_V,
                            &high->u_duty_V,
                            &low->i_A,
                            &low->u_V,
                            &low->u_duty_V,
                            &st.rs_tracking.delta_ohm,
                            &st.omega_ref_before_rad_s,
                            &st.rs_start_delta_ohm,
                            &st.dead_time_pu};
    assert_each_is_seen(value, sizeof value / sizeof value[0], false);
}

static void test_protection_and_modes_are_seen_once_per_turn(void)
{
    supervisor_state_t *const s = &st.supervisor;
    drive_modes_state_t *const m = &st.modes;
    float *const value[] = {&st.link.braking_pu,
                            &st.link.motoring_pu,
                            &st.overload.image_pu[OVERLOAD_MOTOR],
                            &st.overload.image_pu[OVERLOAD_INVERTER],
                            &st.overload.i_max_A,
                            &s->s_Wb.alpha,
                            &s->s_Wb.beta,
                            &s->found.residual_pu,
                            &s->found.lambda_Wb,
                            &s->found.i_s_A,
                            &s->found.excess_pu,
                            &s->omega_s_rad_s,
                            &s->flux_error_bound_pu,
                            &s->omega_bound_rad_s,
                            &st.plausibility.omega_before_rad_s,
                            &m->u_V.alpha,
                            &m->u_V.beta,
                            &m->level.weakened_Wb,
                            &m->level.economy_Wb,
                            &m->level.below_Wb,
                            &m->level.rate_Wb_per_s,
                            &m->level.i_q_less_A,
                            &m->standing.i_before_A.alpha,
                            &m->standing.i_before_A.beta,
                            &m->standing.e_V.alpha,
                            &m->standing.e_V.beta,
                            &m->volts.off_axis.alpha,
                            &m->volts.off_axis.beta,
                            &m->volts.omega_rad_s,
                            &m->volts.boost_V,
                            &m->mains.i_q_A,
                            &m->brake_i_ref_A.alpha,
                            &m->brake_i_ref_A.beta,
                            &m->brake_omega_rad_s};
    assert_each_is_seen(value, sizeof value / sizeof value[0], false);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_what_the_estimate_and_the_voltage_rest_on_is_seen_at_once);
    RUN_TEST(test_control_and_resistance_are_seen_once_per_turn);
    RUN_TEST(test_protection_and_modes_are_seen_once_per_turn);
    return UNITY_END();
}
