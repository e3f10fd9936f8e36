/* What protects motor, inverter and dc link in the whole law: each bit, and each limit of the
 * torque current, from the words of a period. */
#include "drive.h"

#include <complex.h>
#include <math.h>
#include <string.h>

#include "drive_fixture.h"
#include "exact.h"
#include "stages.h"
#include "unity.h"

#define TURN ((int)SLOT_COUNT)

static drive_config_t cfg;
static drive_params_t p;
static drive_in_t in;
static measurement_in_t sample;
static drive_out_t out;
static drive_state_t st;

/* Standing still, half a flux along the axis, 4 A of it; nothing is commanded. */
static void configure(void)
{
    TEST_ASSERT_TRUE(drive_init(&cfg, &p, NULL));
    st = (drive_state_t){
        .estimator.observer = {.i_s_hat_A = {4.0f, 0.0f}, .lambda_r_hat_Wb = {0.4f, 0.0f}}};
    in = (drive_in_t){.mode = DRIVE_RUN};
}

static measurement_in_t sampled(cplx i_A, cplx u_V, double u_dc_V)
{
    double i[3], u[3];
    phases_of(i_A, i);
    phases_of(u_V, u);
    const double fs = (double)p.measurement.line_voltage_full_scale_V;
    const double dc_fs = (double)p.measurement.dc_link_full_scale_V;
    return (measurement_in_t){.i_u_counts = counts(i[0], 25.0),
                              .i_v_counts = counts(i[1], 25.0),
                              .i_w_counts = counts(i[2], 25.0),
                              .u_uv_counts = counts(u[0] - u[1], fs),
                              .u_vw_counts = counts(u[1] - u[2], fs),
                              .u_dc_counts = (uint16_t)lrint(u_dc_V / dc_fs * 16384.0)};
}

void setUp(void)
{
    p = both_machines(0);
    estimator_list.observer_gain_enable = 0u;
    p.acting.source = ACTING_VOLTAGE_SENSORS;
    estimator_list.adapt_kp = 0.0f;
    estimator_list.adapt_ki = 0.0f;
    estimator_list.eps1 = 0.0f;
    configure();
    sample = sampled(4.0, 0.0, 540.0);
}

void tearDown(void)
{
}

/* All bits of so many periods. */
static uint32_t faults_in(int periods)
{
    uint32_t faults = 0u;
    for (int k = 0; k < periods; k++) {
        sample.i_w_counts ^= 1u; /* as words flicker */
        drive_step(&cfg, &st, &sample, &in, &out);
        faults |= out.faults;
    }
    return faults;
}

/* The period in which `bit` comes first, from 1; 0: none in so many. */
static int period_of(uint32_t bit, int periods)
{
    for (int k = 1; k <= periods; k++) {
        drive_step(&cfg, &st, &sample, &in, &out);
        if ((out.faults & bit) != 0u) {
            return k;
        }
    }
    return 0;
}

static void test_init_refuses_what_a_part_refuses(void)
{
    p.link.u_dc_max_V = 0.0f;
    TEST_ASSERT_FALSE(drive_init(&cfg, &p, NULL));
    setUp();
    p.overload.cont_A[OVERLOAD_MOTOR] = -1.0f;
    TEST_ASSERT_FALSE(drive_init(&cfg, &p, NULL));
    setUp();
    p.plausibility.e1_A = NAN;
    TEST_ASSERT_FALSE(drive_init(&cfg, &p, NULL));
}

/* A sensor that shows 60 V where the duties give next to none: eight turns later. */
static void test_a_voltage_that_the_duty_does_not_explain_is_told(void)
{
    p.plausibility.u_V = 30.0f;
    configure();
    sample = sampled(4.0, 60.0, 540.0);
    const int period = period_of(FAULT_VOLTAGE_SENSOR, 20 * TURN);
    TEST_ASSERT_GREATER_THAN_INT(7 * TURN, period);
    TEST_ASSERT_LESS_OR_EQUAL_INT(8 * TURN, period);
}

/* What the legs lose is to be found at every start, but a motor caught in turning gives no chance:
 * then the duty does not say enough. */
static void test_a_loss_that_was_not_found_is_no_broken_sensor(void)
{
    p.plausibility.u_V = 30.0f;
    p.dead_time_identify = true;
    configure();
    sample = sampled(4.0, 60.0, 540.0);
    TEST_ASSERT_EQUAL_UINT32(0u, faults_in(20 * TURN) & FAULT_VOLTAGE_SENSOR);
    st.modes.premagnetise.leg_loss_found = true;
    TEST_ASSERT_NOT_EQUAL(0, period_of(FAULT_VOLTAGE_SENSOR, 20 * TURN));
}

static void test_a_drive_that_uses_no_voltage_sensors_judges_none(void)
{
    p.plausibility.u_V = 30.0f;
    p.acting.source = ACTING_VOLTAGE_DUTY;
    configure();
    sample = sampled(4.0, 60.0, 540.0);
    TEST_ASSERT_EQUAL_UINT32(0u, faults_in(20 * TURN) & FAULT_VOLTAGE_SENSOR);
}

/* Where the sensors are what the estimator gets, they are judged: at low frequency. */
static void test_blended_voltage_sensors_are_judged(void)
{
    p.plausibility.u_V = 30.0f;
    p.acting.source = ACTING_VOLTAGE_BLEND;
    configure();
    sample = sampled(4.0, 60.0, 540.0);
    TEST_ASSERT_NOT_EQUAL(0, period_of(FAULT_VOLTAGE_SENSOR, 20 * TURN));
}

/* Phase u of a standing field carries sqrt(2/3) of it, and here nothing. */
static void test_an_open_phase_is_told(void)
{
    p.plausibility.open_A = 1.2f;
    configure();
    sample = sampled(4.0 * I, 0.0, 540.0);
    const int period = period_of(FAULT_OPEN_PHASE, 20 * TURN);
    TEST_ASSERT_GREATER_THAN_INT(5 * TURN, period);
    TEST_ASSERT_LESS_OR_EQUAL_INT(6 * TURN, period);
    configure();
    sample = sampled(4.0, 0.0, 540.0);
    TEST_ASSERT_EQUAL_UINT32(0u, faults_in(20 * TURN) & FAULT_OPEN_PHASE);
}

static void test_phases_are_judged_in_run_only(void)
{
    p.plausibility.open_A = 1.2f;
    configure();
    in.mode = DRIVE_PREMAGNETISE;
    sample = sampled(4.0 * I, 0.0, 540.0);
    TEST_ASSERT_EQUAL_UINT32(0u, faults_in(20 * TURN) & FAULT_OPEN_PHASE);
}

/* Sensors of v and w exchanged: the conjugate. Largest phase 17 A, the trip is at 20 A. */
static uint32_t faults_with_mirrored_current(drive_mode_t mode)
{
    configure();
    in.mode = mode;
    in.i_d_ref_A = 8.0f;
    sample = sampled(8.0 - 19.5 * I, 0.0, 540.0);
    uint32_t faults = 0u;
    for (int k = 0; k < 6; k++) {
        st.estimator.observer.i_s_hat_A = (ab_t){8.0f, 19.5f};
        sample.i_u_counts ^= 1u; /* as words flicker */
        drive_step(&cfg, &st, &sample, &in, &out);
        faults |= out.faults;
    }
    return faults;
}

static void test_exchanged_current_sensors_are_told_wherever_direct_current_flows(void)
{
    TEST_ASSERT_EQUAL_UINT32(FAULT_CURRENT_SENSOR,
                             faults_with_mirrored_current(DRIVE_PREMAGNETISE));
    TEST_ASSERT_EQUAL_UINT32(FAULT_CURRENT_SENSOR, faults_with_mirrored_current(DRIVE_COMMISSION));
    TEST_ASSERT_EQUAL_UINT32(0u, faults_with_mirrored_current(DRIVE_RUN));
}

/* 2 A of the 4 that are asked for, to the last bit, in any mode with the gates on; gates off, no
 * word has to move. */
static void test_words_that_stand_still_are_told_in_every_mode(void)
{
    const drive_mode_t modes[] = {DRIVE_OFF, DRIVE_PREMAGNETISE, DRIVE_RUN, DRIVE_COMMISSION};
    for (int k = 0; k < 4; k++) {
        configure();
        in.mode = modes[k];
        in.i_d_ref_A = 4.0f;
        sample = sampled(2.0, 0.0, 540.0);
        uint32_t faults = 0u;
        for (int n = 0; n < 10 * TURN; n++) {
            drive_step(&cfg, &st, &sample, &in, &out);
            faults |= out.faults;
        }
        TEST_ASSERT_EQUAL_UINT32((k == 0) ? 0u : FAULT_ADC_FROZEN, faults & FAULT_ADC_FROZEN);
    }
}

/* Words that flicker about zero: no current comes for a voltage that grows. */
static void test_a_voltage_without_current_is_told_in_every_mode(void)
{
    const drive_mode_t modes[] = {DRIVE_PREMAGNETISE, DRIVE_RUN, DRIVE_COMMISSION};
    for (int k = 0; k < 3; k++) {
        configure();
        in.mode = modes[k];
        in.i_d_ref_A = 4.0f;
        sample = sampled(0.0, 0.0, 540.0);
        TEST_ASSERT_EQUAL_UINT32(FAULT_CURRENT_SENSOR,
                                 faults_in(100 * TURN) & (FAULT_CURRENT_SENSOR | FAULT_ADC_FROZEN));
    }
}

/* The estimate is held where it is by an observer that sees 4 A of current too much. */
static void test_an_estimate_far_from_the_current_is_told(void)
{
    p.plausibility.e1_A = 0.5f;
    configure();
    sample = sampled(-9.0, 0.0, 540.0);
    const int period = period_of(FAULT_OBSERVER, 100 * TURN);
    TEST_ASSERT_GREATER_THAN_INT(59 * TURN, period);
    TEST_ASSERT_LESS_OR_EQUAL_INT(60 * TURN, period);
}

/* 60 V along 4 A are 240 W, less 15 W of heat; the estimate has no torque. */
static void test_power_that_no_torque_explains_is_told(void)
{
    p.plausibility.power_W = 150.0f;
    configure();
    sample = sampled(4.0, 60.0, 540.0);
    TEST_ASSERT_NOT_EQUAL(0, period_of(FAULT_OBSERVER, 61 * TURN));
    p.plausibility.power_W = 300.0f;
    configure();
    TEST_ASSERT_EQUAL_INT(0, period_of(FAULT_OBSERVER, 61 * TURN));
}

/* A fifth of the nominal flux: little of that, enough of half of it. */
static void test_a_lowered_flux_is_compared_with_its_own_reference(void)
{
    p.plausibility.e1_A = 0.5f;
    configure();
    const float nominal_Wb = cfg.modes.vector.flux.lambda_ref_Wb;
    const float reduction_pu[] = {0.5f, 0.0f};
    for (int n = 0; n < 2; n++) {
        st = (drive_state_t){.mode = MODE_VECTOR,
                             .slot = SLOT_GUARD_ESTIMATE,
                             .estimator.estimate = {.lambda_Wb = 0.2f * nominal_Wb},
                             .modes.vector.flux_reduction_Wb = reduction_pu[n] * nominal_Wb};
        out = (drive_out_t){0};
        uint32_t faults = 0u;
        for (int k = 0; k < 100; k++) {
            faults |= stage_guard_look(&cfg, &st, &in, &out);
        }
        TEST_ASSERT_EQUAL_UINT32((n == 0) ? 0u : FAULT_OBSERVER, faults);
    }
}

static void test_all_torque_without_speed_is_a_stall(void)
{
    p.plausibility.stall_s = 0.05f;
    configure();
    in.omega_e_ref_rad_s = 200.0f;
    TEST_ASSERT_NOT_EQUAL(0, period_of(FAULT_STALL, 200 * TURN));
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, 12.0f, out.i_ref_A.q);
    configure();
    in.omega_e_ref_rad_s = 0.0f;
    TEST_ASSERT_EQUAL_UINT32(0u, faults_in(200 * TURN) & FAULT_STALL);
}

/* Impressed current knows no estimate and no speed of its own; heat it knows. */
static void test_impressed_current_is_judged_by_its_heat_alone(void)
{
    p.plausibility.e1_A = 0.5f;
    p.plausibility.stall_s = 0.05f;
    p.lost_action = DRIVE_LOST_I_F;
    p.i_f = (i_f_params_t){.current_A = 10.0f,
                           .slew_A_per_s = 100.0f,
                           .slew_rad_s2 = 500.0f,
                           .return_rad_s = 12.0f,
                           .timeout_s = 1.0f};
    p.overload.cont_A[OVERLOAD_MOTOR] = 10.0f;
    p.overload.tau_s[OVERLOAD_MOTOR] = 1.0f;
    configure();
    in.omega_e_ref_rad_s = 200.0f;
    sample = sampled(-12.0, 0.0, 540.0);
    for (int k = 0; k < 80 * TURN; k++) {
        st.supervisor.confidence = SUPERVISOR_IMPRESSED;
        st.modes.i_f.active = true;
        drive_step(&cfg, &st, &sample, &in, &out);
        TEST_ASSERT_EQUAL_UINT32(0u, out.faults & (FAULT_OBSERVER | FAULT_STALL));
    }
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 1.44f * (1.0f - expf(-0.256f)),
                             st.limits.overload.heat_pu[OVERLOAD_MOTOR]);
}

/* Warm: derated and told, gates untouched. Hot: stopped. */
static void test_heat_derates_and_then_stops(void)
{
    p.overload.cont_A[OVERLOAD_MOTOR] = 5.0f;
    p.overload.tau_s[OVERLOAD_MOTOR] = 10.0f;
    configure();
    in.omega_e_ref_rad_s = 200.0f;
    st.limits.overload.heat_pu[OVERLOAD_MOTOR] = 1.1f;
    sample = sampled(5.0, 0.0, 540.0);
    TEST_ASSERT_EQUAL_UINT32(FAULT_DERATED, faults_in(4 * TURN));
    /* 5 A are left, 4 of them magnetise. */
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, 3.0f, out.i_ref_A.q);
    st.limits.overload.heat_pu[OVERLOAD_MOTOR] = 1.3f;
    TEST_ASSERT_NOT_EQUAL(0, period_of(FAULT_OVERLOAD, TURN));
}

static void test_a_magnetising_current_beyond_the_derated_one_leaves_no_torque(void)
{
    p.overload.cont_A[OVERLOAD_MOTOR] = 3.0f;
    p.overload.tau_s[OVERLOAD_MOTOR] = 10.0f;
    configure();
    in.omega_e_ref_rad_s = 200.0f;
    st.limits.overload =
        (overload_state_t){.heat_pu = {1.1f, 0.0f}, .derating = true, .i_max_A = 3.0f};
    (void)faults_in(8);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, out.i_ref_A.q);
}

/* Largest torque current asked for with this link, speed and speed error. */
static float i_q_at(double u_dc_V, float omega_rad_s, float ref_rad_s)
{
    configure();
    in.omega_e_ref_rad_s = ref_rad_s;
    sample = sampled(4.0, 0.0, u_dc_V);
    for (int k = 0; k < 20; k++) {
        st.estimator.estimate.omega_e_rad_s = omega_rad_s;
        st.estimator.adaptation.x_rad_s = omega_rad_s;
        st.modes.vector.speed.omega_filtered_rad_s = omega_rad_s;
        st.modes.vector.speed.omega_ref_rad_s = ref_rad_s;
        sample.i_w_counts ^= 1u; /* as words flicker */
        drive_step(&cfg, &st, &sample, &in, &out);
    }
    return out.i_ref_A.q;
}

/* From 600 V the drive says so; the braking current falls from 630 V, to none at 675 V, half of it
 * at 652.5 V. The dc word has steps of .05 V. */
static void test_a_link_that_fills_limits_braking_in_both_directions(void)
{
    p.link.regen_start_V = 600.0f;
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, -12.0f, i_q_at(590.0, 200.0f, 0.0f));
    TEST_ASSERT_EQUAL_UINT32(0u, out.faults);
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, -12.0f, i_q_at(629.0, 200.0f, 0.0f));
    TEST_ASSERT_EQUAL_UINT32(FAULT_REGENERATION, out.faults);
    TEST_ASSERT_FLOAT_WITHIN(0.03f, -6.0f, i_q_at(652.5, 200.0f, 0.0f));
    TEST_ASSERT_FLOAT_WITHIN(0.03f, 6.0f, i_q_at(652.5, -200.0f, 0.0f));
    TEST_ASSERT_FLOAT_WITHIN(0.02f, 0.0f, i_q_at(680.0, 200.0f, 0.0f));
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, 12.0f, i_q_at(652.5, 100.0f, 300.0f));
}

/* What is hot stays hot, and the brake resistor works, while the gates are off. */
static void test_gates_off_forgets_neither_heat_nor_brake_resistor(void)
{
    p.link.chopper_on_V = 600.0f;
    configure();
    in.mode = DRIVE_OFF;
    sample = sampled(0.0, 0.0, 610.0);
    st.limits.overload.heat_pu[OVERLOAD_MOTOR] = 0.9f;
    st.guard.plausibility.stall = 5u;
    TEST_ASSERT_EQUAL_UINT32(0u, faults_in(3));
    TEST_ASSERT_TRUE(st.limits.link.brake_on);
    TEST_ASSERT_EQUAL_FLOAT(0.9f, st.limits.overload.heat_pu[OVERLOAD_MOTOR]);
    TEST_ASSERT_EQUAL_UINT32(0u, st.guard.plausibility.stall);
    sample = sampled(0.0, 0.0, 580.0);
    TEST_ASSERT_EQUAL_UINT32(0u, faults_in(1));
    TEST_ASSERT_FALSE(st.limits.link.brake_on);
}

/* The image follows the current in every mode: with the gates off it cools, tells nothing, and the
 * derating ends. */
static void test_heat_goes_on_outside_run(void)
{
    p.overload.cont_A[OVERLOAD_MOTOR] = 5.0f;
    p.overload.tau_s[OVERLOAD_MOTOR] = 1.0f;
    configure();
    in.mode = DRIVE_OFF;
    sample = sampled(0.0, 0.0, 540.0);
    st.limits.overload.heat_pu[OVERLOAD_MOTOR] = 1.3f;
    TEST_ASSERT_EQUAL_UINT32(FAULT_DERATED, faults_in(TURN));
    (void)faults_in(299 * TURN); /* .96 s */
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 1.3f * expf(-0.96f),
                             st.limits.overload.heat_pu[OVERLOAD_MOTOR]);
    TEST_ASSERT_EQUAL_UINT32(0u, faults_in(1));
    const drive_mode_t modes[] = {DRIVE_PREMAGNETISE, DRIVE_COMMISSION};
    for (int n = 0; n < 2; n++) {
        configure();
        in.mode = modes[n];
        sample = sampled(8.0, 0.0, 540.0);
        TEST_ASSERT_EQUAL_UINT32(0u, faults_in(100 * TURN) & FAULT_OVERLOAD);
        TEST_ASSERT_FLOAT_WITHIN(0.01f, 2.56f * (1.0f - expf(-0.32f)),
                                 st.limits.overload.heat_pu[OVERLOAD_MOTOR]);
        TEST_ASSERT_EQUAL_UINT32(FAULT_OVERLOAD, faults_in(200 * TURN) & FAULT_OVERLOAD);
    }
}

/* Without a model of heat only the slip follows what the start found of the rotor: the estimate's
 * 8 rad/s are those of Rr and of what is added. */
static void test_a_rotor_that_the_start_found_changes_the_slip(void)
{
    configure();
    st.estimator.estimate.omega_s_rad_s = 20.0f;
    st.estimator.estimate.omega_e_rad_s = 12.0f;
    stage_heat(&cfg, &st, DRIVE_RUN, &out);
    ASSERT_SAME_FLOAT(0.0f, st.heating.slip_rad_s);
    st.modes.premagnetise.Rr_extra_pu = 0.3f;
    for (int k = 0; k < 5000; k++) {
        stage_heat(&cfg, &st, DRIVE_RUN, &out);
    }
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, 0.3f * 8.0f / 1.3f, st.heating.slip_rad_s);
    ASSERT_SAME_FLOAT(0.0f, st.heating.rotor_pu);
    ASSERT_SAME_FLOAT(0.0f, st.rs_tracking.delta_ohm);
}

/* Under current Rs in use rises, and the rotor's slip with it; while measuring and with the gates
 * off the motor's own image goes on, and nothing is told to a controller. */
static void test_a_motor_that_warms_up_changes_its_resistances(void)
{
    p.heating =
        (heating_params_t){.winding_pu = 0.5f, .rated_A = 8.0f, .i_d_A = 4.0f, .tau_s = 1.0f};
    configure();
    sample = sampled(4.0 + 4.0 * I, 0.0, 540.0);
    const float cold_ohm = drive_rs_ohm(&cfg, &st);
    (void)faults_in(TURN);
    ASSERT_SAME_FLOAT(cold_ohm, st.heating.Rs_cold_ohm);
    st.heating.rotor_pu = 0.25f;
    (void)faults_in(99 * TURN); /* .32 s of half the rated loss */
    const float winding_pu = 0.25f * (1.0f - expf(-0.32f));
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, winding_pu, st.heating.winding_pu);
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, cold_ohm * winding_pu, st.rs_tracking.delta_ohm);
    const estimate_t *e = &st.estimator.estimate;
    const float slip_rad_s = e->omega_s_rad_s - e->omega_e_rad_s - st.heating.slip_rad_s;
    TEST_ASSERT_TRUE(absf(slip_rad_s) > 0.1f);
    TEST_ASSERT_TRUE(st.heating.slip_rad_s * slip_rad_s > 0.0f);
    ASSERT_SAME_FLOAT(st.heating.slip_rad_s, stage_estimator_in(&st, &out).slip_extra_rad_s);
    in.mode = DRIVE_PREMAGNETISE;
    const heating_state_t before = st.heating;
    (void)faults_in(TURN);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, cold_ohm * before.winding_pu, st.rs_tracking.delta_ohm);
    TEST_ASSERT_FALSE(st.heating.winding_pu == before.winding_pu); /* exact: nothing moved */
    in.mode = DRIVE_OFF;
    sample = sampled(0.0, 0.0, 540.0);
    (void)faults_in(1);
    const float warm_pu = st.heating.winding_pu;
    TEST_ASSERT_TRUE(warm_pu > 0.0f);
    ASSERT_SAME_FLOAT(0.0f, st.heating.slip_rad_s);
    (void)faults_in(100 * TURN);
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, warm_pu * expf(-0.32f), st.heating.winding_pu);
    ASSERT_SAME_FLOAT(cold_ohm, st.heating.Rs_cold_ohm);
}

/* At speed M is found in its slot, used, and kept with the gates off; not while the flux is
 * lowered.
 */
static void test_the_main_inductance_is_found_at_speed_and_kept(void)
{
    p.m_tracking = (m_tracking_params_t){.on = true, .min_rad_s = 1.0f};
    configure();
    (void)faults_in(TURN);
    ASSERT_SAME_FLOAT(0.0f, st.m_tracking.extra_pu); /* standing */
    int moved = 0;
    for (int k = 0; k < TURN; k++) {
        const float before = st.m_tracking.extra_pu;
        st.estimator.estimate.omega_s_rad_s = 0.0f;
        st.estimator.estimate.omega_e_rad_s = 50.0f;
        st.estimator.adaptation.x_rad_s = 50.0f;
        (void)faults_in(1);
        if (!(absf(st.m_tracking.extra_pu - before) < 1e-9f)) {
            moved++;
            TEST_ASSERT_EQUAL_UINT32(SLOT_M_TRACKING, st.slot);
        }
    }
    TEST_ASSERT_EQUAL_INT(1, moved);
    const m_tracking_state_t found = st.m_tracking;
    ASSERT_SAME_FLOAT(found.tau_extra_per_s, stage_estimator_in(&st, &out).tau_extra_per_s);
    ASSERT_SAME_FLOAT(1.0f + found.extra_pu, stage_view(&cfg, &st, &in, &out).M_pu);
    st.heating.rotor_pu = 0.25f;
    ASSERT_SAME_FLOAT(1.25f, stage_view(&cfg, &st, &in, &out).Rr_pu);
    for (int k = 0; k < TURN; k++) {
        st.modes.vector.flux_reduction_Wb = 0.1f;
        st.estimator.adaptation.x_rad_s = 50.0f;
        (void)faults_in(1);
    }
    TEST_ASSERT_EQUAL_MEMORY(&found, &st.m_tracking, sizeof found);
    in.mode = DRIVE_OFF;
    sample = sampled(0.0, 0.0, 540.0);
    (void)faults_in(2 * TURN);
    TEST_ASSERT_EQUAL_MEMORY(&found, &st.m_tracking, sizeof found);
}

/* At speed offsets are followed in their slot, taken out of the current, and kept with the gates
 * off. */
static void test_offsets_that_move_are_followed_at_speed_and_kept(void)
{
    p.offset_tracking = (offset_tracking_params_t){.on = true, .full_scale_A = 25.0f};
    configure();
    (void)faults_in(TURN);
    TEST_ASSERT_TRUE(offset_tracking_on(&cfg.offset_tracking));
    ASSERT_SAME_FLOAT(0.0f, st.measurement.moved_A.alpha); /* standing */
    st.offset_tracking.turning = 1.5f;
    int moved = 0;
    for (int k = 0; k < TURN; k++) {
        const ab_t before_A = st.measurement.moved_A;
        st.estimator.adaptation.x_rad_s = 50.0f;
        st.estimator.estimate.omega_e_rad_s = 50.0f;
        (void)faults_in(1);
        const ab_t step_A = ab_sub(st.measurement.moved_A, before_A);
        if (!(ab_norm2(step_A) < 1e-18f)) {
            moved++;
            TEST_ASSERT_EQUAL_UINT32(SLOT_OFFSET_TRACKING, st.slot);
            const ab_t e1_A = st.estimator.estimate.i_residual_A;
            const ab_t back_per_s = {cfg.motor.tau_per_s, st.estimator.estimate.omega_e_rad_s};
            TEST_ASSERT_TRUE(ab_dot(ab_mul(back_per_s, e1_A), step_A) < 0.0f);
        }
    }
    TEST_ASSERT_EQUAL_INT(1, moved);
    TEST_ASSERT_TRUE(st.offset_tracking.turning > 1.5f); /* at 50 rad/s */
    const ab_t found_A = st.measurement.moved_A;
    in.mode = DRIVE_OFF;
    sample = sampled(0.0, 0.0, 540.0);
    (void)faults_in(2 * TURN);
    TEST_ASSERT_EQUAL_MEMORY(&found_A, &st.measurement.moved_A, sizeof found_A);
    ASSERT_SAME_FLOAT(-found_A.alpha, out.meas.i_s_A.alpha);
}

/* A turn with slip, at 50 rad/s; how often the gains found have moved, each time as one step on the
 * period's own values. */
static int gains_moved_in_a_turn(void)
{
    unbalance_tracking_config_t expected_cfg;
    unbalance_tracking_init(&expected_cfg, true, (float)TURN * p.period_s);
    int moved = 0;
    for (int k = 0; k < TURN; k++) {
        unbalance_t expected = st.measurement.unbalance;
        st.estimator.adaptation.x_rad_s = 50.0f;
        st.estimator.estimate.omega_e_rad_s = 50.0f;
        (void)faults_in(1);
        if (memcmp(&expected, &st.measurement.unbalance, sizeof expected) != 0) {
            moved++;
            TEST_ASSERT_EQUAL_UINT32(SLOT_UNBALANCE_TRACKING, st.slot);
            const estimate_t *e = &st.estimator.estimate;
            TEST_ASSERT_TRUE(absf(e->omega_s_rad_s - e->omega_e_rad_s) > 0.1f);
            TEST_ASSERT_TRUE(ab_norm2(ab_sub(st.acting.lagging_V, st.acting.ended_V)) > 0.0f);
            const uvw_t i_A = out.meas.i_A;
            const unbalance_tracking_in_t step_in = {
                .residual_V = ab_sub(out.meas.u_line_V, st.acting.lagging_V),
                .expected_V = st.acting.lagging_V,
                .i_s_A = out.meas.i_s_A,
                .i_sum_A = i_A.u + i_A.v + i_A.w,
                .omega_s_hat_rad_s = e->omega_s_rad_s};
            unbalance_tracking_step(&expected_cfg, &expected, &step_in);
            TEST_ASSERT_EQUAL_MEMORY(&expected, &st.measurement.unbalance, sizeof expected);
        }
    }
    return moved;
}

static void test_unequal_gains_are_followed_at_speed_and_kept(void)
{
    p.unbalance_tracking = true;
    configure();
    sample = sampled(4.0 + 3.0 * I, 20.0, 540.0);
    sample.i_w_counts = (uint16_t)(sample.i_w_counts + 20u);
    (void)faults_in(TURN);
    TEST_ASSERT_TRUE(unbalance_tracking_on(&cfg.unbalance_tracking));
    ASSERT_SAME_FLOAT(0.0f, st.measurement.unbalance.u.alpha); /* standing */
    TEST_ASSERT_EQUAL_INT(1, gains_moved_in_a_turn());
    const unbalance_t found = st.measurement.unbalance;
    TEST_ASSERT_TRUE((ab_norm2(found.i) > 0.0f) && (ab_norm2(found.u) > 0.0f));
    in.mode = DRIVE_OFF;
    (void)faults_in(2 * TURN);
    TEST_ASSERT_EQUAL_MEMORY(&found, &st.measurement.unbalance, sizeof found);
}

static void test_off_no_gain_is_followed(void)
{
    p.offset_tracking = (offset_tracking_params_t){.on = true, .full_scale_A = 25.0f};
    configure();
    sample = sampled(4.0 + 3.0 * I, 20.0, 540.0);
    TEST_ASSERT_EQUAL_INT(0, gains_moved_in_a_turn());
}

static void test_init_refuses_an_m_without_a_speed(void)
{
    p.m_tracking = (m_tracking_params_t){.on = true};
    TEST_ASSERT_FALSE(drive_init(&cfg, &p, NULL));
}

static void test_init_refuses_a_heat_that_is_none(void)
{
    p.heating = (heating_params_t){.winding_pu = -1.0f};
    TEST_ASSERT_FALSE(drive_init(&cfg, &p, NULL));
}

/* With the gates off a full link limits nothing that anybody asked for. */
static void test_gates_off_warns_of_no_limit(void)
{
    p.link.regen_start_V = 600.0f;
    configure();
    in.mode = DRIVE_OFF;
    sample = sampled(0.0, 0.0, 650.0);
    TEST_ASSERT_EQUAL_UINT32(0u, faults_in(3));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_what_a_part_refuses);
    RUN_TEST(test_a_voltage_that_the_duty_does_not_explain_is_told);
    RUN_TEST(test_a_loss_that_was_not_found_is_no_broken_sensor);
    RUN_TEST(test_a_drive_that_uses_no_voltage_sensors_judges_none);
    RUN_TEST(test_blended_voltage_sensors_are_judged);
    RUN_TEST(test_an_open_phase_is_told);
    RUN_TEST(test_phases_are_judged_in_run_only);
    RUN_TEST(test_exchanged_current_sensors_are_told_wherever_direct_current_flows);
    RUN_TEST(test_words_that_stand_still_are_told_in_every_mode);
    RUN_TEST(test_a_voltage_without_current_is_told_in_every_mode);
    RUN_TEST(test_an_estimate_far_from_the_current_is_told);
    RUN_TEST(test_power_that_no_torque_explains_is_told);
    RUN_TEST(test_a_lowered_flux_is_compared_with_its_own_reference);
    RUN_TEST(test_all_torque_without_speed_is_a_stall);
    RUN_TEST(test_impressed_current_is_judged_by_its_heat_alone);
    RUN_TEST(test_heat_derates_and_then_stops);
    RUN_TEST(test_a_magnetising_current_beyond_the_derated_one_leaves_no_torque);
    RUN_TEST(test_a_link_that_fills_limits_braking_in_both_directions);
    RUN_TEST(test_gates_off_forgets_neither_heat_nor_brake_resistor);
    RUN_TEST(test_heat_goes_on_outside_run);
    RUN_TEST(test_a_rotor_that_the_start_found_changes_the_slip);
    RUN_TEST(test_a_motor_that_warms_up_changes_its_resistances);
    RUN_TEST(test_init_refuses_a_heat_that_is_none);
    RUN_TEST(test_the_main_inductance_is_found_at_speed_and_kept);
    RUN_TEST(test_offsets_that_move_are_followed_at_speed_and_kept);
    RUN_TEST(test_unequal_gains_are_followed_at_speed_and_kept);
    RUN_TEST(test_off_no_gain_is_followed);
    RUN_TEST(test_init_refuses_an_m_without_a_speed);
    RUN_TEST(test_gates_off_warns_of_no_limit);
    return UNITY_END();
}
