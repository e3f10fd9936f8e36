/* The reduced-order observer against the motor's equations, and against the paper's polynomial. */
#include "estimator_fixture.h"

static const tolerance_t within = {
    .flux_pu = 1e-3, .speed_rad_s = 0.05, .held_rad_s = 0.3, .extra_slip_rad_s = 0.05};

#include "estimator_contract.h"

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
    float *const word[] = {&st.psi_Wb.alpha,          &st.psi_Wb.beta, &st.i_before_A.alpha,
                           &st.i_before_A.beta,       &st.omega_rad_s, &st.estimate.omega_e_rad_s,
                           &st.estimate.omega_s_rad_s};
    check_sum(word, sizeof word / sizeof word[0]);
}

/* One period in complex arithmetic, straight from the equations. */
static void test_one_step_by_hand(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        configure(machine);
        operation_t o = operation(machine, 5);
        seed_as(&o, 8.0);
        const double complex i_before = of(st.i_before_A);
        const double complex psi_before = of(st.psi_Wb);
        const double omega = (double)st.omega_rad_s;
        estimator_in_t in = sample_of(&o);
        in.u_s_V.alpha += 3.0f;
        in.i_s_A.beta += 0.05f;
        in.tau_extra_per_s = -0.4f;
        estimator_step(&cfg, &st, &in);

        const reference_model_t m = reference_model(&reference_machine[machine], 0.0);
        const double kr = m.sigma_Ls / m.eps;
        const double tau = m.tau - 0.4;
        const double complex i = 0.5 * (of(in.i_s_A) + i_before);
        const double Rs = (double)reference_machine[machine].Rs_ohm;
        const double complex v =
            of(in.u_s_V) - Rs * i - m.sigma_Ls * (of(in.i_s_A) - i_before) / PERIOD_S;
        const double complex middle = psi_before + 0.5 * PERIOD_S * v;
        const double complex d = middle / cabs(middle);
        const double r_d = creal(conj(d) * kr * m.a21 * i) - tau * cabs(middle);
        const double complex k = (0.5 * tau + 0.2 * fabs(omega)) / (tau - I * omega);
        const double complex psi =
            psi_before + PERIOD_S * (v + 2.0 * k * (r_d - creal(conj(d) * v)) * d);
        assert_ab(5e-7, psi, st.psi_Wb);
        assert_ab(5e-7, psi / kr, st.estimate.lambda_r_hat_Wb);
        const double turned = carg(psi / psi_before);
        const double slip =
            creal(kr * m.a21) * cimag(conj(psi) * of(in.i_s_A)) / (cabs(psi) * cabs(psi));
        const double share = 2.0 * 3.14159265358979 * 40.0 * PERIOD_S;
        const double expected = omega + share * (turned / PERIOD_S - slip - omega);
        ASSERT_NEAR(1e-3, expected, st.estimate.omega_e_rad_s);
        ASSERT_NEAR(1e-3, expected + slip, st.estimate.omega_s_rad_s);
    }
}

/* Hinkkanen, Harnefors, Luomi (2010): the error of the flux obeys s^2 + b s + w_s^2, b = a + .4
 * |w|, whatever the load. Seeded 1 % too long, its free decay is compared. */
static void test_a_flux_error_decays_as_published(void)
{
    for (int k = 0; k < OPERATIONS; k++) {
        configure(1);
        operation_t o = operation(1, k);
        seed_as(&o, 0.0);
        st.psi_Wb = ab_scale(st.psi_Wb, 1.01f);
        const double w_s = o.omega_e_rad_s + o.slip_rad_s;
        const double a = (double)motor.tau_per_s;
        const double b = a + 0.4 * fabs(o.omega_e_rad_s);
        const double two_k_re = b * a / (a * a + o.omega_e_rad_s * o.omega_e_rad_s);
        /* y'' + b y' + w_s^2 y = 0, y(0) = 1 %, y'(0) = -2 Re(k) a y(0). */
        const double complex root = csqrt(0.25 * b * b - w_s * w_s);
        const double complex s1 = -0.5 * b + root;
        const double complex s2 = -0.5 * b - root;
        const double slope = -two_k_re * a;
        for (int step = 1; step <= 400; step++) {
            run_steps(&o, 1);
            const double t = step * PERIOD_S;
            const double complex y =
                ((slope - s2) * cexp(s1 * t) + (s1 - slope) * cexp(s2 * t)) / (s1 - s2);
            const double complex e = of(st.estimate.lambda_r_hat_Wb) / true_flux(&o, o.t_s) - 1.0;
            ASSERT_NEAR(3e-4, 0.01 * creal(y), creal(e));
        }
    }
}

/* Without flux there is no direction to correct along: the voltage builds it up. */
static void test_it_magnetises_from_zeros_while_estimating(void)
{
    configure(0);
    operation_t o = {.machine = 0, .omega_e_rad_s = 100.0, .lambda_Wb = 0.5};
    run_steps(&o, 20000);
    assert_estimate(&o, 2e-3, 0.1);
}

int main(void)
{
    UNITY_BEGIN();
    run_contract();
    RUN_TEST(test_off_forgets_its_own_states);
    RUN_TEST(test_a_long_period_is_refused);
    RUN_TEST(test_the_sum_tells_no_number);
    RUN_TEST(test_one_step_by_hand);
    RUN_TEST(test_a_flux_error_decays_as_published);
    RUN_TEST(test_it_magnetises_from_zeros_while_estimating);
    return UNITY_END();
}
