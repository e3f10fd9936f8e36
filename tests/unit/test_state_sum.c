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

enum {
    PASSING,
    FAST,
    SLOW,
    SUMS
};

static float sum_of(int which)
{
    const float sums[SUMS] = {state_sum_passing(&st), state_sum_fast(&st), state_sum_slow(&st)};
    return sums[which];
}

/* By one of the sums, and by no other. */
static void assert_each_is_seen(float *const value[], size_t count, int by)
{
    const float bad[] = {NAN, INFINITY, -INFINITY};
    for (size_t n = 0; n < count; n++) {
        for (size_t k = 0; k < sizeof bad / sizeof bad[0]; k++) {
            *value[n] = bad[k];
            for (int which = 0; which < SUMS; which++) {
                TEST_ASSERT_EQUAL_INT(which != by, isfinite(sum_of(which)) != 0);
            }
        }
        *value[n] = 1.0f;
    }
    TEST_ASSERT_EQUAL_FLOAT((float)count, sum_of(by));
}

/* Poked, a limit makes a wrong number of it in the next period: test_poked_state. */
static void test_what_a_limit_would_heal_is_seen_at_once(void)
{
    observer_state_t *const o = &st.estimator.observer;
    float *const value[] = {&o->i_s_hat_A.alpha,
                            &o->i_s_hat_A.beta,
                            &o->lambda_r_hat_Wb.alpha,
                            &o->lambda_r_hat_Wb.beta,
                            &o->e1_A.alpha,
                            &o->e1_A.beta,
                            &st.estimator.adaptation.x_rad_s,
                            &st.estimator.estimate.omega_e_rad_s,
                            &st.estimator.estimate.omega_s_rad_s,
                            &st.modes.vector.speed.pi.x};
    assert_each_is_seen(value, sizeof value / sizeof value[0], PASSING);
}

static void test_what_else_the_voltage_rests_on_is_seen_in_a_quarter(void)
{
    float *const value[] = {&st.voltage.current.d.x,       &st.voltage.current.q.x,
                            &st.voltage.ahead.alpha,       &st.voltage.ahead.beta,
                            &st.acting.acting_V.alpha,     &st.acting.acting_V.beta,
                            &st.acting.pending_V.alpha,    &st.acting.pending_V.beta,
                            &st.acting.lag.alpha,          &st.acting.lag.beta,
                            &st.measurement.offset_A.u,    &st.measurement.offset_A.v,
                            &st.measurement.offset_A.w,    &st.measurement.offset_V.alpha,
                            &st.measurement.offset_V.beta, &st.modes.vector.speed.gain_extra};
    assert_each_is_seen(value, sizeof value / sizeof value[0], FAST);
}

static void test_control_and_resistance_are_seen_once_per_turn(void)
{
    rs_measurement_sums_t *const high = &st.modes.premagnetise.measurement.high;
    rs_measurement_sums_t *const low = &st.modes.premagnetise.measurement.low;
    float *const value[] = {&st.modes.vector.speed.omega_filtered_rad_s,
                            &st.modes.vector.speed.omega_ref_rad_s,
                            &st.modes.vector.speed.i_q_A,
                            &st.modes.vector.speed.low_A,
                            &st.modes.vector.speed.high_A,
                            &st.modes.vector.plan.omega_ref_rad_s,
                            &st.modes.vector.plan.i_d_ref_A,
                            &st.modes.vector.plan.flux_pu,
                            &st.modes.vector.plan.inv_flux_pu,
                            &st.modes.vector.plan.torque_ref_Nm,
                            &st.modes.vector.ramp.steps,
                            &st.modes.vector.flux.pi.x,
                            &st.modes.vector.flux_reduction_Wb,
                            &st.modes.vector.i_d_reduction_A,
                            &st.modes.vector.torque_gain_extra_pu,
                            &st.modes.vector.steering.torque_Nm,
                            &st.modes.vector.steering.reduction_Wb,
                            &st.modes.vector.steer.reduction_Wb,
                            &st.modes.vector.steer.rate_Wb_per_s,
                            &st.modes.i_f.axis.alpha,
                            &st.modes.i_f.axis.beta,
                            &st.modes.i_f.current_A,
                            &st.modes.i_f.omega_rad_s,
                            &high->i_A,
                            &high->u_V,
                            &high->u_duty_V,
                            &low->i_A,
                            &low->u_V,
                            &low->u_duty_V,
                            &st.rs_tracking.delta_ohm,
                            &st.omega_ref_before_rad_s,
                            &st.modes.premagnetise.Rs_delta_ohm,
                            &st.modes.premagnetise.leg_loss_pu};
    assert_each_is_seen(value, sizeof value / sizeof value[0], SLOW);
}

static void test_protection_and_modes_are_seen_once_per_turn(void)
{
    supervisor_state_t *const s = &st.supervisor;
    modes_state_t *const m = &st.modes;
    float *const value[] = {&st.limits.link.braking_pu,
                            &st.limits.overload.heat_pu[OVERLOAD_MOTOR],
                            &st.limits.overload.heat_pu[OVERLOAD_INVERTER],
                            &st.limits.overload.i_max_A,
                            &s->s_Wb.alpha,
                            &s->s_Wb.beta,
                            &s->found.residual_pu,
                            &s->found.lambda_Wb,
                            &s->found.i_s_A,
                            &s->found.excess_pu,
                            &s->omega_s_rad_s,
                            &s->flux_error_bound_pu,
                            &s->omega_bound_rad_s,
                            &s->emf_sum_V.alpha,
                            &s->emf_sum_V.beta,
                            &s->d_Wb.alpha,
                            &s->d_Wb.beta,
                            &st.guard.plausibility.omega_before_rad_s,
                            &m->vector.reference.weakened_Wb,
                            &m->vector.reference.economy_Wb,
                            &m->vector.reference.reduction_Wb,
                            &m->vector.reference.rate_Wb_per_s,
                            &m->vector.reference.i_q_reduction_A,
                            &m->flying_current.i_before_A.alpha,
                            &m->flying_current.i_before_A.beta,
                            &m->flying_current.e_V.alpha,
                            &m->flying_current.e_V.beta,
                            &m->volts.off_axis.alpha,
                            &m->volts.off_axis.beta,
                            &m->volts.omega_rad_s,
                            &m->volts.boost_V,
                            &m->vector.mains.i_q_A,
                            &m->brake.current.i_before_A.alpha,
                            &m->brake.current.i_before_A.beta,
                            &m->brake.current.e_V.alpha,
                            &m->brake.current.e_V.beta,
                            &m->brake.i_ref_A.alpha,
                            &m->brake.i_ref_A.beta,
                            &m->brake.omega_rad_s};
    assert_each_is_seen(value, sizeof value / sizeof value[0], SLOW);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_what_a_limit_would_heal_is_seen_at_once);
    RUN_TEST(test_what_else_the_voltage_rests_on_is_seen_in_a_quarter);
    RUN_TEST(test_control_and_resistance_are_seen_once_per_turn);
    RUN_TEST(test_protection_and_modes_are_seen_once_per_turn);
    return UNITY_END();
}
