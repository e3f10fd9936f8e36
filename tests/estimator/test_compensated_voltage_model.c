/* The compensated voltage model against the motor's equations, and its own linear model. */
#include "estimator_fixture.h"

static const tolerance_t within = {
    .flux_pu = 1e-3, .speed_rad_s = 0.05, .held_rad_s = 0.3, .extra_slip_rad_s = 0.05};

#include "estimator_contract.h"

#define LAMBDA 1.0

static void test_off_forgets_its_own_states(void)
{
    check_off_forgets_the_flux();
    TEST_ASSERT_EQUAL_FLOAT(12.0f, st.omega_rad_s);
    TEST_ASSERT_EQUAL_FLOAT(3.0f, st.i_before_A.alpha);
}

/* 40 Hz is then no low-pass. */
static void test_a_long_period_is_refused(void)
{
    list.period_s = 4e-3f;
    TEST_ASSERT_FALSE(estimator_init(&cfg, &list, &motor, NULL));
}

static void test_the_sum_tells_no_number(void)
{
    operation_t o = operation(0, 1);
    seed_as(&o, 0.0);
    float *const word[] = {
        &st.psi_Wb.alpha,           &st.psi_Wb.beta,           &st.i_before_A.alpha,
        &st.i_before_A.beta,        &st.omega_rad_s,           &st.omega_1_rad_s,
        &st.estimate.omega_e_rad_s, &st.estimate.omega_s_rad_s};
    check_sum(word, sizeof word / sizeof word[0]);
}

/* One period in complex arithmetic, straight from the equations. */
static void test_one_step_by_hand(void)
{
    for (int k = 0; k < OPERATIONS; k++) {
        configure(1);
        operation_t o = operation(1, k);
        seed_as(&o, 8.0);
        const double complex i_before = of(st.i_before_A);
        const double complex psi_before = of(st.psi_Wb);
        const double w_1 = (double)st.omega_1_rad_s;
        const double omega = (double)st.omega_rad_s;
        estimator_in_t in = sample_of(&o);
        in.u_s_V.alpha += 3.0f;
        in.i_s_A.beta += 0.05f;
        estimator_step(&cfg, &st, &in);

        const reference_model_t m = reference_model(&reference_machine[1], 0.0);
        const double kr = m.sigma_Ls / m.eps;
        const double complex i = 0.5 * (of(in.i_s_A) + i_before);
        const double Rs = (double)reference_machine[1].Rs_ohm;
        const double complex v =
            of(in.u_s_V) - Rs * i - m.sigma_Ls * (of(in.i_s_A) - i_before) / PERIOD_S;
        const double complex middle = psi_before + 0.5 * PERIOD_S * v;
        const double sign = (w_1 < 0.0) ? -1.0 : 1.0;
        const double complex psi =
            psi_before + PERIOD_S * ((1.0 - I * LAMBDA * sign) * v - LAMBDA * fabs(w_1) * middle);
        assert_ab(5e-7, psi, st.psi_Wb);
        assert_ab(5e-7, psi / kr, st.estimate.lambda_r_hat_Wb);
        const double turned = carg(psi / psi_before);
        const double slip =
            creal(kr * m.a21) * cimag(conj(psi) * of(in.i_s_A)) / (cabs(psi) * cabs(psi));
        const double share = 2.0 * 3.14159265358979 * 40.0 * PERIOD_S;
        const double expected = omega + share * (turned / PERIOD_S - slip - omega);
        ASSERT_NEAR(1e-3, expected, st.estimate.omega_e_rad_s);
        ASSERT_NEAR(1e-3, expected + slip, st.omega_1_rad_s);
    }
}

/* The model, linear around an operating point: y and d are the flux error's parts along and across
 * the flux over its length, and dw and d1 the errors of speed and w_1. Seeded 1 % too long. */
static void test_a_flux_error_decays_as_the_model_says(void)
{
    for (int k = 0; k < OPERATIONS; k++) {
        configure(1);
        operation_t o = operation(1, k);
        seed_as(&o, 0.0);
        run_steps(&o, 2000);
        st.psi_Wb = ab_scale(st.psi_Wb, 1.01f);
        const double w_s = o.omega_e_rad_s + o.slip_rad_s;
        const double sign = (w_s < 0.0) ? -1.0 : 1.0;
        const double a = (double)motor.tau_per_s;
        const double alpha_o = 2.0 * 3.14159265358979 * 40.0;
        double y = 0.01;
        double d = 0.0;
        double dw = 0.0;
        for (int step = 1; step <= 400; step++) {
            run_steps(&o, 1);
            for (int n = 0; n < 100; n++) {
                const double h = PERIOD_S / 100.0;
                const double d1 = dw - a * d - o.slip_rad_s * y;
                const double d_rate = -LAMBDA * fabs(w_s) * d - w_s * y;
                y += h * (-LAMBDA * fabs(w_s) * y + w_s * d - LAMBDA * sign * d1);
                dw += h * alpha_o * (d_rate + a * d + o.slip_rad_s * y - dw);
                d += h * d_rate;
            }
            const double complex e = of(st.estimate.lambda_r_hat_Wb) / true_flux(&o, o.t_s) - 1.0;
            ASSERT_NEAR(6e-4, y, creal(e));
            ASSERT_NEAR(6e-4, d, cimag(e));
        }
    }
}

/* An integrator would have run 4 Wb away. The low-pass alone gives |1 - j lambda| dU/(lambda w_s) =
 * 7 mWb; the ripple that this makes of w_1 adds 5. */
static void test_an_offset_of_the_voltage_does_not_add_up(void)
{
    configure(0);
    operation_t o = {.machine = 0, .omega_e_rad_s = 100.0, .lambda_Wb = 0.5};
    seed_as(&o, 0.0);
    double complex mean = 0.0;
    const int turns = 10;
    for (int k = 0; k < 40000; k++) {
        estimator_in_t in = sample_of(&o);
        in.u_s_V.alpha += 0.5f;
        estimator_step(&cfg, &st, &in);
        if (k >= 40000 - turns * 314) {
            mean += (of(st.psi_Wb) - true_flux(&o, o.t_s)) / (turns * 314.0);
        }
    }
    ASSERT_NEAR(1e-3, 12.3e-3, cabs(mean));
}

int main(void)
{
    UNITY_BEGIN();
    run_contract();
    RUN_TEST(test_off_forgets_its_own_states);
    RUN_TEST(test_a_long_period_is_refused);
    RUN_TEST(test_the_sum_tells_no_number);
    RUN_TEST(test_one_step_by_hand);
    RUN_TEST(test_a_flux_error_decays_as_the_model_says);
    RUN_TEST(test_an_offset_of_the_voltage_does_not_add_up);
    return UNITY_END();
}
