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
    RESISTANCE,
    PROTECTION,
    START,
    MODES,
    DWELL,
    CONTROL,
    REFERENCES,
    SUMS
};

static float sum_of(int which)
{
    const uint32_t slot[SUMS] = {
        [FAST] = SLOT_QUARTER_STATE,          [RESISTANCE] = SLOT_STATE_RESISTANCE,
        [PROTECTION] = SLOT_STATE_PROTECTION, [START] = SLOT_STATE_START,
        [MODES] = SLOT_STATE_MODES,           [DWELL] = SLOT_STATE_DWELL,
        [CONTROL] = SLOT_STATE_CONTROL,       [REFERENCES] = SLOT_STATE_REFERENCES};
    if (which == PASSING) {
        return state_sum_passing(&st);
    }
    st.slot = slot[which];
    return state_sum_of_slot(&st);
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
                            &st.estimator.adaptation.phi.alpha,
                            &st.estimator.adaptation.phi.beta,
                            &st.estimator.estimate.omega_e_rad_s,
                            &st.estimator.estimate.omega_s_rad_s,
                            &st.modes.vector.speed.pi.x};
    assert_each_is_seen(value, sizeof value / sizeof value[0], PASSING);
}

static void test_what_else_the_voltage_rests_on_is_seen_in_a_quarter(void)
{
    float *const value[] = {&st.voltage.current.d.x,
                            &st.voltage.current.q.x,
                            &st.voltage.ahead.alpha,
                            &st.voltage.ahead.beta,
                            &st.acting.acting_V.alpha,
                            &st.acting.acting_V.beta,
                            &st.acting.pending_V.alpha,
                            &st.acting.pending_V.beta,
                            &st.acting.lagging_V.alpha,
                            &st.acting.lagging_V.beta,
                            &st.acting.duty_share,
                            &st.measurement.offset_A.u,
                            &st.measurement.offset_A.v,
                            &st.measurement.offset_A.w,
                            &st.measurement.offset_V.alpha,
                            &st.measurement.offset_V.beta,
                            &st.modes.vector.speed.gain_change};
    assert_each_is_seen(value, sizeof value / sizeof value[0], FAST);
}

static void test_control_is_seen_once_in_sixteen(void)
{
    vector_state_t *const v = &st.modes.vector;
    float *const value[] = {&v->speed.omega_filtered_rad_s,
                            &v->speed.omega_ref_rad_s,
                            &v->speed.i_q_A,
                            &v->speed.slow_A,
                            &v->speed.low_A,
                            &v->speed.high_A,
                            &v->modulation.speed_rad_s,
                            &v->modulation.flux_pu,
                            &v->modulation.rate_pu_per_s,
                            &v->flux_reduction_Wb,
                            &v->i_d_reduction_A,
                            &v->torque_gain_extra_pu};
    assert_each_is_seen(value, sizeof value / sizeof value[0], CONTROL);
}

static void test_references_are_seen_once_in_sixteen(void)
{
    vector_state_t *const v = &st.modes.vector;
    float *const value[] = {&v->plan.omega_ref_rad_s,
                            &v->plan.i_d_ref_A,
                            &v->plan.flux_pu,
                            &v->plan.inv_flux_pu,
                            &v->plan.torque_ref_Nm,
                            &v->ramp.steps,
                            &v->steering.torque_Nm,
                            &v->steering.reduction_Wb,
                            &v->steer.reduction_Wb,
                            &v->steer.rate_Wb_per_s,
                            &v->reference.weakened_Wb,
                            &v->reference.economy_Wb,
                            &v->reference.reduction_Wb,
                            &v->reference.rate_Wb_per_s,
                            &v->reference.i_q_reduction_A,
                            &v->mains.i_q_A};
    assert_each_is_seen(value, sizeof value / sizeof value[0], REFERENCES);
}

static void test_resistance_is_seen_once_in_sixteen(void)
{
    float *const value[] = {&st.rs_tracking.delta_ohm,
                            &st.m_tracking.extra_pu,
                            &st.m_tracking.tau_extra_per_s,
                            &st.heating.Rs_cold_ohm,
                            &st.heating.winding_pu,
                            &st.heating.rotor_pu,
                            &st.heating.slip_rad_s,
                            &st.omega_ref_before_rad_s,
                            &st.modes.premagnetise.Rs_delta_ohm,
                            &st.modes.premagnetise.Rr_extra_pu};
    assert_each_is_seen(value, sizeof value / sizeof value[0], RESISTANCE);
}

static void test_what_a_start_found_is_seen_once_in_sixteen(void)
{
    rs_measurement_sums_t *const high = &st.modes.premagnetise.measurement.level[RS_LEVEL_HIGH];
    rs_measurement_sums_t *const low = &st.modes.premagnetise.measurement.level[RS_LEVEL_LOW];
    float *const value[] = {&high->i_A,
                            &high->u_V,
                            &high->u_duty_V,
                            &low->i_A,
                            &low->u_V,
                            &low->u_duty_V,
                            &st.modes.premagnetise.leg_loss_pu,
                            &st.modes.premagnetise.leg_threshold_A,
                            &st.modes.premagnetise.leg_tail_A};
    assert_each_is_seen(value, sizeof value / sizeof value[0], START);
}

static void test_dwelling_is_seen_once_in_sixteen(void)
{
    float *const value[] = {
        &st.dwell.omega_s_rad_s, &st.dwell.i_q_A,        &st.dwell.reference_rad_s,
        &st.dwell.share,         &st.dwell.gain,         &st.dwell.turns,
        &st.dwell.speed_rad_s,   &st.dwell.reduction_pu, &st.dwell.rate_pu_per_s,
        &st.dwell.swing_rad_s};
    assert_each_is_seen(value, sizeof value / sizeof value[0], DWELL);
}

static void test_protection_is_seen_once_in_sixteen(void)
{
    supervisor_state_t *const s = &st.supervisor;
    float *const value[] = {&st.limits.link.taken_pu,
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
                            &st.guard.current_fit.psi_Wb.alpha,
                            &st.guard.current_fit.psi_Wb.beta,
                            &st.guard.current_fit.b_Wb,
                            &st.guard.current_fit.emf_V.alpha,
                            &st.guard.current_fit.emf_V.beta};
    assert_each_is_seen(value, sizeof value / sizeof value[0], PROTECTION);
}

static void test_what_modes_keep_is_seen_once_in_sixteen(void)
{
    modes_state_t *const m = &st.modes;
    float *const value[] = {&m->i_f.axis.alpha,
                            &m->i_f.axis.beta,
                            &m->i_f.current_A,
                            &m->i_f.omega_rad_s,
                            &m->i_f.flux_Wb.alpha,
                            &m->i_f.flux_Wb.beta,
                            &m->flying_current.i_before_A.alpha,
                            &m->flying_current.i_before_A.beta,
                            &m->flying_current.e_V.alpha,
                            &m->flying_current.e_V.beta,
                            &m->volts.off_axis.alpha,
                            &m->volts.off_axis.beta,
                            &m->volts.omega_rad_s,
                            &m->volts.boost_V,
                            &m->brake.current.i_before_A.alpha,
                            &m->brake.current.i_before_A.beta,
                            &m->brake.current.e_V.alpha,
                            &m->brake.current.e_V.beta,
                            &m->brake.i_ref_A.alpha,
                            &m->brake.i_ref_A.beta,
                            &m->brake.omega_rad_s};
    assert_each_is_seen(value, sizeof value / sizeof value[0], MODES);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_what_a_limit_would_heal_is_seen_at_once);
    RUN_TEST(test_what_else_the_voltage_rests_on_is_seen_in_a_quarter);
    RUN_TEST(test_control_is_seen_once_in_sixteen);
    RUN_TEST(test_references_are_seen_once_in_sixteen);
    RUN_TEST(test_resistance_is_seen_once_in_sixteen);
    RUN_TEST(test_what_a_start_found_is_seen_once_in_sixteen);
    RUN_TEST(test_dwelling_is_seen_once_in_sixteen);
    RUN_TEST(test_protection_is_seen_once_in_sixteen);
    RUN_TEST(test_what_modes_keep_is_seen_once_in_sixteen);
    return UNITY_END();
}
