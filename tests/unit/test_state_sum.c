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

#define FAST         SLOTS_OF_QUARTER(SLOT_QUARTER_STATE)
#define BEFORE(slot) ((1u << (slot)) - 1u)
#define ANY          BEFORE(SLOT_COUNT)
#define SLOW_FLOATS  104 /* of the state, each summed once in sixteen periods */

static uint32_t slots_that_see(void)
{
    uint32_t slots = 0u;
    for (st.slot = 0u; st.slot < SLOT_COUNT; st.slot++) {
        slots |= isfinite(state_sum_of_slot(&st)) ? 0u : (1u << st.slot);
    }
    return slots;
}

static int count_of(uint32_t slots)
{
    int count = 0;
    for (uint32_t slot = 0u; slot < SLOT_COUNT; slot++) {
        count += slot_is_among(slot, slots) ? 1 : 0;
    }
    return count;
}

/* Each in so many of these slots. No slots: in every period. */
static void assert_each_is_seen(float *const value[], size_t count, uint32_t slots, int times)
{
    const float bad[] = {NAN, INFINITY, -INFINITY};
    for (size_t n = 0; n < count; n++) {
        for (size_t k = 0; k < sizeof bad / sizeof bad[0]; k++) {
            *value[n] = bad[k];
            const uint32_t seen = slots_that_see();
            TEST_ASSERT_BITS_LOW(~slots, seen);
            TEST_ASSERT_EQUAL_INT(times, count_of(seen));
            TEST_ASSERT_EQUAL_INT(slots == 0u, isfinite(state_sum_passing(&st)) == 0);
        }
        *value[n] = 1.0f;
    }
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
    const size_t count = sizeof value / sizeof value[0];
    assert_each_is_seen(value, count, 0u, 0);
    TEST_ASSERT_EQUAL_FLOAT((float)count, state_sum_passing(&st));
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
    const size_t count = sizeof value / sizeof value[0];
    assert_each_is_seen(value, count, FAST, 4);
    st.slot = SLOT_QUARTER_STATE;
    TEST_ASSERT_EQUAL_FLOAT((float)count, state_sum_of_slot(&st));
}

/* Before heat and tracking replace them. */
static void test_resistances_are_seen_once_in_sixteen(void)
{
    premagnetise_state_t *const found = &st.modes.premagnetise;
    float *const value[] = {
        &st.rs_tracking.delta_ohm, &st.m_tracking.extra_pu, &st.m_tracking.tau_extra_per_s,
        &st.heating.Rs_cold_ohm,   &st.heating.winding_pu,  &st.heating.rotor_pu,
        &st.heating.slip_rad_s,    &found->Rs_delta_ohm,    &found->Rr_extra_pu,
        &found->leg_loss_pu,       &found->leg_threshold_A, &found->leg_tail_A};
    assert_each_is_seen(value, sizeof value / sizeof value[0], BEFORE(SLOT_HEAT), 1);
}

/* Before they are used. */
static void test_dwelling_is_seen_once_in_sixteen(void)
{
    dwell_state_t *const dwell = &st.dwell;
    float *const value[] = {&st.omega_ref_before_rad_s,
                            &dwell->omega_s_rad_s,
                            &dwell->i_q_A,
                            &dwell->reference_rad_s,
                            &dwell->share,
                            &dwell->gain,
                            &dwell->turns,
                            &dwell->speed_rad_s,
                            &dwell->reduction_pu,
                            &dwell->rate_pu_per_s,
                            &dwell->swing_rad_s};
    assert_each_is_seen(value, sizeof value / sizeof value[0], BEFORE(SLOT_DWELL), 1);
}

/* Before the supervisor measures anew. */
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
                            &s->standing_pu,
                            &s->flux_error_bound_pu,
                            &s->omega_bound_rad_s,
                            &s->torque_Wb_A,
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
    assert_each_is_seen(value, sizeof value / sizeof value[0], BEFORE(SLOT_SUPERVISOR_MEASURE), 1);
}

static void test_control_and_references_are_seen_once_in_sixteen(void)
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
                            &v->torque_gain_extra_pu,
                            &v->plan.omega_ref_rad_s,
                            &v->plan.i_d_ref_A,
                            &v->plan.flux_pu,
                            &v->plan.inv_flux_pu,
                            &v->plan.torque_ref_Nm,
                            &v->ramp.steps,
                            &v->steering.torque_Nm,
                            &v->steering.omega_rad_s,
                            &v->steering.reduction_Wb,
                            &v->steer.reduction_Wb,
                            &v->steer.rate_Wb_per_s,
                            &v->reference.weakened_Wb,
                            &v->reference.economy_Wb,
                            &v->reference.reduction_Wb,
                            &v->reference.rate_Wb_per_s,
                            &v->reference.i_q_reduction_A,
                            &v->mains.i_q_A};
    assert_each_is_seen(value, sizeof value / sizeof value[0], ANY, 1);
}

static void test_modes_are_seen_once_in_sixteen(void)
{
    modes_state_t *const m = &st.modes;
    rs_measurement_sums_t *const level = m->premagnetise.measurement.level;
    rs_measurement_sums_t *const high = &level[RS_LEVEL_HIGH];
    rs_measurement_sums_t *const low = &level[RS_LEVEL_LOW];
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
                            &m->brake.omega_rad_s,
                            &high->i_A,
                            &high->u_V,
                            &high->u_duty_V,
                            &low->i_A,
                            &low->u_V,
                            &low->u_duty_V};
    assert_each_is_seen(value, sizeof value / sizeof value[0], ANY, 1);
}

/* A run of floats takes in no count or flag: of a state of ones the sum is the number of floats. */
static void test_no_other_word_is_summed(void)
{
    float *const word = (float *)(void *)&st;
    for (size_t n = 0; n < sizeof st / sizeof(float); n++) {
        word[n] = 1.0f;
    }
    float sum = 0.0f;
    for (uint32_t slot = 0u; slot < SLOT_COUNT; slot++) {
        st.slot = slot;
        const float part = state_sum_of_slot(&st);
        TEST_ASSERT_EQUAL(slot_is_among(slot, STATE_SUM_SLOTS), part > 0.0f);
        sum += slot_is_among(slot, FAST) ? 0.0f : part;
    }
    TEST_ASSERT_EQUAL_FLOAT((float)SLOW_FLOATS, sum);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_what_a_limit_would_heal_is_seen_at_once);
    RUN_TEST(test_what_else_the_voltage_rests_on_is_seen_in_a_quarter);
    RUN_TEST(test_resistances_are_seen_once_in_sixteen);
    RUN_TEST(test_dwelling_is_seen_once_in_sixteen);
    RUN_TEST(test_protection_is_seen_once_in_sixteen);
    RUN_TEST(test_control_and_references_are_seen_once_in_sixteen);
    RUN_TEST(test_modes_are_seen_once_in_sixteen);
    RUN_TEST(test_no_other_word_is_summed);
    return UNITY_END();
}
