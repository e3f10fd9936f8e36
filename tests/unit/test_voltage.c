/* Request -> duty: the voltage that is wanted arrives at the motor, and the current controllers
 * know what arrived. */
#include "voltage.h"

#include <complex.h>

#include "drive_fixture.h"
#include "exact.h"

static voltage_config_t cfg;
static voltage_state_t st;
static voltage_in_t in;
static drive_params_t p;

static void configure(int machine)
{
    p = both_machines(machine);
    const motor_model_t motor = reference_derived(machine);
    cfg = (voltage_config_t){.delay_comp_s = p.delay_comp_periods * p.period_s};
    TEST_ASSERT_TRUE(current_control_init(&cfg.current, &p.current, &motor, p.period_s));
    TEST_ASSERT_TRUE(inverter_error_init(&cfg.error, &p.dead_time, p.period_s));
    TEST_ASSERT_TRUE(svpwm_init(&cfg.svpwm, &p.svpwm, p.period_s));
    st = (voltage_state_t){.current = {.d = {12.0f}, .q = {-30.0f}}};
    in = (voltage_in_t){.axis = {0.6f, 0.8f},
                        .i_ref_A = {4.5f, -3.0f},
                        .i_A = {4.0f, -2.0f},
                        .i_s_A = {4.0f, 2.0f}, /* i_A in the stationary frame */
                        .omega_s_rad_s = 90.0f,
                        .omega_e_rad_s = 80.0f,
                        .lambda_Wb = 0.4f,
                        .u_dc_V = 540.0f};
}

void setUp(void)
{
    configure(1);
}

void tearDown(void)
{
}

/* As the drive does every fourth period, and here before each one. */
static voltage_out_t step(voltage_state_t *state)
{
    voltage_angle(&cfg, state, in.omega_s_rad_s);
    return voltage_step(&cfg, state, &in);
}

static cplx of(ab_t x)
{
    return (double)x.alpha + I * (double)x.beta;
}

/* What the legs give. */
static cplx of_duties(uvw_t duty)
{
    return sqrt(2.0 / 3.0) * (double)in.u_dc_V *
           ((double)duty.u + (double)duty.v * cexp(I * THIRD_TURN) +
            (double)duty.w * cexp(-I * THIRD_TURN));
}

static void test_a_current_is_controlled_in_the_frame_of_then(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        for (int sign = -1; sign <= 1; sign += 2) {
            configure(machine);
            in.omega_s_rad_s *= (float)sign;
            in.omega_e_rad_s *= (float)sign;
            const double sigma_Ls_H = reference_model(&p.motor, 0.0).sigma_Ls;
            const double kp_ohm = (double)p.current.bandwidth_rad_s * sigma_Ls_H;
            const double kr = (double)p.motor.M_H / (double)p.motor.Lr_H;
            const cplx i_A = 4.0 - 2.0 * I;
            const cplx decoupling_V = I * (double)in.omega_s_rad_s * sigma_Ls_H * i_A +
                                      I * kr * (double)in.omega_e_rad_s * (double)in.lambda_Wb;
            const cplx asked_V = kp_ohm * (0.5 - 1.0 * I) + 12.0 - 30.0 * I + 0.9 * decoupling_V;
            const cplx ahead = cexp(I * (double)in.omega_s_rad_s * 1.5 * 200e-6);
            const voltage_out_t out = step(&st);
            /* 100 V, some roundings. */
            ASSERT_NEAR(1e-4, 0.0, cabs(of(out.u_V) - asked_V * (0.6 + 0.8 * I) * ahead));
            ASSERT_NEAR(1e-3, 0.0, cabs(of(out.u_V) - of_duties(out.duty)));
            /* All of it arrived: the integrators move by the error alone. */
            const double step_ohm = 200e-6 * 0.3 * 400.0 * kp_ohm;
            ASSERT_NEAR(2e-4, 12.0 + 0.5 * step_ohm, st.current.d.x);
            ASSERT_NEAR(2e-4, -30.0 - 1.0 * step_ohm, st.current.q.x);
        }
    }
}

/* Without a loss to make up for, the duties are the voltage: the current makes no difference. */
static void test_no_loss_adds_nothing(void)
{
    voltage_state_t other = st;
    const voltage_out_t out = step(&st);
    in.i_s_A = (ab_t){-4.0f, -2.0f};
    const voltage_out_t opposite = step(&other);
    TEST_ASSERT_EQUAL_MEMORY(&out, &opposite, sizeof out);
}

/* Three legs at their full loss: 10 V each, sign of each leg's current. */
static void test_the_duties_give_what_the_legs_lose_on_top(void)
{
    in.omega_s_rad_s = 0.0f;
    voltage_state_t other = st;
    const voltage_out_t without = step(&other);
    in.leg_loss = (leg_loss_t){.whole_V = 10.0f, .threshold_A = 0.25f};
    const voltage_out_t out = step(&st);
    ASSERT_NEAR(1e-4, 0.0, cabs(of(out.u_V) - of(without.u_V)));
    double legs_A[3];
    phases_of(4.0 + 2.0 * I, legs_A);
    cplx lost_V = 0.0;
    for (int n = 0; n < 3; n++) {
        const double share = fmax(-1.0, fmin(1.0, legs_A[n] / 0.25));
        lost_V += sqrt(2.0 / 3.0) * 10.0 * share * cexp(I * THIRD_TURN * n);
    }
    ASSERT_NEAR(1e-3, 0.0, cabs(of_duties(out.duty) - of(out.u_V) - lost_V));
    ASSERT_NEAR(1e-3, 0.0, cabs(of_duties(out.duty) - of(out.u_legs_V)));
}

/* The loss is that of the current when the duties act. */
static void test_the_legs_current_is_turned_ahead_too(void)
{
    in.leg_loss = (leg_loss_t){.whole_V = 10.0f, .threshold_A = 0.25f};
    in.i_s_A = (ab_t){0.0f, -0.1f}; /* linear: below the threshold in every leg */
    in.omega_s_rad_s = 2000.0f;
    const voltage_out_t out = step(&st);
    const cplx ahead = cexp(I * 2000.0 * 1.5 * 200e-6);
    ASSERT_NEAR(2e-3, 0.0,
                cabs(of_duties(out.duty) - of(out.u_V) - 10.0 / 0.25 * -0.1 * I * ahead));
}

static void test_a_voltage_that_is_asked_for_arrives_as_it_is(void)
{
    in.follow = true;
    in.u_ref_V = (ab_t){-70.0f, 110.0f};
    in.i_ref_A = in.i_A;
    const voltage_out_t out = step(&st);
    ASSERT_NEAR(1e-4, 0.0, cabs(of(out.u_V) - (-70.0 + 110.0 * I)));
    ASSERT_NEAR(1e-3, 0.0, cabs(of(out.u_V) - of_duties(out.duty)));
}

/* From following a voltage to controlling a current, in the same frame: no step. */
static void test_the_current_controllers_take_over_without_a_step(void)
{
    in.follow = true;
    in.u_ref_V = (ab_t){-70.0f, 110.0f};
    in.i_ref_A = in.i_A;
    for (int k = 0; k < 3; k++) {
        (void)step(&st);
    }
    in.follow = false;
    in.u_ref_V = (ab_t){0.0f, 0.0f};
    const voltage_out_t out = step(&st);
    ASSERT_NEAR(5e-4, 0.0, cabs(of(out.u_V) - (-70.0 + 110.0 * I)));
}

/* Back-calculation: what the dc link refuses goes into the integrators, so that the voltage asked
 * for stays a step of the proportional part beyond what there is, and leaves when the error does.
 */
static void test_integrators_do_not_wind_up_where_the_voltage_ends(void)
{
    in.u_dc_V = 100.0f;
    in.i_ref_A.q = 10.0f;
    voltage_out_t out = {0};
    for (int k = 0; k < 5000; k++) {
        out = step(&st);
    }
    const double most_V = 100.0 * sqrt(2.0 / 3.0);
    TEST_ASSERT_TRUE(cabs(of(out.u_V)) <= most_V + 1e-3);
    ASSERT_NEAR(1e-3, 0.0, cabs(of_duties(out.duty) - of(out.u_legs_V)));
    TEST_ASSERT_TRUE(cabs(of(out.u_V)) >= 100.0 / sqrt(2.0) - 1e-3);
    const current_control_state_t wound = st.current;
    TEST_ASSERT_TRUE(fabs((double)wound.d.x) < 2.0 * most_V);
    TEST_ASSERT_TRUE(fabs((double)wound.q.x) < 2.0 * most_V);
    (void)step(&st);
    ASSERT_NEAR(1e-3, wound.d.x, st.current.d.x); /* at rest */
    ASSERT_NEAR(1e-3, wound.q.x, st.current.q.x);
    /* The error turns round: the voltage leaves its end in that period, by Kp e. */
    const cplx axis_ahead = (0.6 + 0.8 * I) * cexp(I * 90.0 * 1.5 * 200e-6);
    const double before_V = cimag(of(out.u_V) * conj(axis_ahead));
    in.i_ref_A.q = in.i_A.q - 2.0f;
    in.i_ref_A.d = in.i_A.d;
    out = step(&st);
    ASSERT_NEAR(0.01, before_V - 2.0 * (double)cfg.current.pi.kp,
                cimag(of(out.u_V) * conj(axis_ahead)));
}

/* The vector that is added to the axis is the turned one less the axis: (1, 0) where it is zero. */
static void test_a_zeroed_state_turns_nothing(void)
{
    const voltage_out_t zeroed = voltage_step(&cfg, &st, &in);
    configure(1);
    voltage_angle(&cfg, &st, 0.0f);
    ASSERT_SAME_FLOAT(0.0f, st.ahead.alpha);
    ASSERT_SAME_FLOAT(0.0f, st.ahead.beta);
    const voltage_out_t standing = voltage_step(&cfg, &st, &in);
    TEST_ASSERT_EQUAL_MEMORY(&zeroed, &standing, sizeof zeroed);
}

static void test_the_angle_is_the_delays_and_holds(void)
{
    const float speeds[] = {90.0f, -90.0f, 2000.0f, 1e6f, -1e6f};
    for (int n = 0; n < 5; n++) {
        const double most = (double)TRIG_SMALL_MAX_RAD;
        const double angle_rad = fmax(-most, fmin(most, (double)speeds[n] * 1.5 * 200e-6));
        voltage_angle(&cfg, &st, speeds[n]);
        ASSERT_NEAR(2e-7, 0.0, cabs(1.0 + of(st.ahead) - cexp(I * angle_rad)));
        const ab_t ahead = st.ahead;
        (void)voltage_step(&cfg, &st, &in);
        TEST_ASSERT_EQUAL_MEMORY(&ahead, &st.ahead, sizeof ahead);
    }
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        voltage_angle(&cfg, &st, not_finite(k));
        TEST_ASSERT_TRUE(ab_finite(st.ahead));
    }
}

static void test_no_number_and_no_link_give_no_voltage(void)
{
    in.i_ref_A.d = NAN;
    voltage_out_t out = step(&st);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, out.duty.u);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, out.duty.v);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, out.duty.w);
    configure(0);
    in.u_dc_V = 0.0f;
    out = step(&st);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, out.duty.u);
    ASSERT_SAME_FLOAT(0.0f, out.u_V.alpha);
    ASSERT_SAME_FLOAT(0.0f, out.u_V.beta);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_current_is_controlled_in_the_frame_of_then);
    RUN_TEST(test_no_loss_adds_nothing);
    RUN_TEST(test_the_duties_give_what_the_legs_lose_on_top);
    RUN_TEST(test_the_legs_current_is_turned_ahead_too);
    RUN_TEST(test_a_voltage_that_is_asked_for_arrives_as_it_is);
    RUN_TEST(test_the_current_controllers_take_over_without_a_step);
    RUN_TEST(test_integrators_do_not_wind_up_where_the_voltage_ends);
    RUN_TEST(test_a_zeroed_state_turns_nothing);
    RUN_TEST(test_the_angle_is_the_delays_and_holds);
    RUN_TEST(test_no_number_and_no_link_give_no_voltage);
    return UNITY_END();
}
