/* Hinkkanen's full-order observer against the motor's equations. */
#include "estimator_fixture.h"

static const tolerance_t within = {
    .flux_pu = 2e-3, .speed_rad_s = 0.2, .held_rad_s = 0.1, .extra_slip_rad_s = 0.1};

#include "estimator_contract.h"

static void test_the_sum_tells_no_number(void)
{
    operation_t o = operation(0, 1);
    seed_as(&o, 0.0);
    float *const word[] = {&st.psi_Wb.s.alpha,
                           &st.psi_Wb.s.beta,
                           &st.psi_Wb.r.alpha,
                           &st.psi_Wb.r.beta,
                           &st.estimate.i_residual_A.alpha,
                           &st.estimate.i_residual_A.beta,
                           &st.x_rad_s,
                           &st.phi_rad,
                           &st.estimate.omega_e_rad_s,
                           &st.estimate.omega_s_rad_s};
    check_sum(word, sizeof word / sizeof word[0]);
}

/* One period by hand: series of the exact solution to the second order, and the paper's gain. */
static void test_one_step_by_hand(void)
{
    for (int machine = 0; machine < REFERENCE_MACHINES; machine++) {
        for (int k = 0; k < OPERATIONS; k++) {
            configure(machine);
            operation_t o = operation(machine, k);
            seed_as(&o, 4.0);
            run_steps(&o, 3);
            const reference_model_t m =
                reference_model(&reference_machine[machine], (double)st.estimate.omega_e_rad_s);
            const double w = (double)st.estimate.omega_e_rad_s;
            const double kr = m.sigma_Ls / m.eps;
            const double Rs = (double)reference_machine[machine].Rs_ohm;
            const double complex pole = m.tau - I * w;
            double complex s = of(st.psi_Wb.s);
            double complex r = of(st.psi_Wb.r);
            const double complex e = -of(st.estimate.i_residual_A);
            const estimator_in_t in = sample_of(&o);
            double complex ds = of(in.u_s_V) - Rs * (s - r) / m.sigma_Ls;
            double complex dr = kr * m.a21 * (s - r) / m.sigma_Ls - pole * r;
            const double complex d2s = -Rs * (ds - dr) / m.sigma_Ls;
            const double complex d2r = kr * m.a21 * (ds - dr) / m.sigma_Ls - pole * dr;
            const double gain = 478.0 * m.sigma_Ls * fmin(fabs(w) / 314.15927, 1.0);
            const double sign = (w < 0.0) ? -1.0 : 1.0;
            ds += 0.5 * PERIOD_S * d2s + gain * (1.0 + I * sign) * e;
            dr += 0.5 * PERIOD_S * d2r + gain * (-1.0 + I * sign) * e;
            s += PERIOD_S * ds;
            r += PERIOD_S * dr;
            estimator_step(&cfg, &st, &in);
            assert_ab(3e-7, s, st.psi_Wb.s);
            assert_ab(3e-7, r, st.psi_Wb.r);
            const double complex e1 = (s - r) / m.sigma_Ls - of(in.i_s_A);
            assert_ab(1e-4, e1, st.estimate.i_residual_A);
            assert_ab(3e-3, -gain * (-1.0 + I * sign) * e1 / kr, st.estimate.flux_correction_V);
        }
    }
}

/* 80 degrees at w_s = 0, less with its distance, nothing from 126 rad/s on and while motoring. */
static void test_the_adaptation_is_rotated_while_generating(void)
{
    static const double speed_slip_phi[][3] = {{45.0, -5.0, 1.3962634 * (1.0 - 40.0 / 125.66371)},
                                               {-45.0, 5.0, -1.3962634 * (1.0 - 40.0 / 125.66371)},
                                               {45.0, 5.0, 0.0},
                                               {140.0, -5.0, 0.0},
                                               {-140.0, 5.0, 0.0}};
    for (int k = 0; k < 5; k++) {
        operation_t o = {.omega_e_rad_s = speed_slip_phi[k][0],
                         .slip_rad_s = speed_slip_phi[k][1],
                         .lambda_Wb = 0.5};
        configure(0);
        seed_as(&o, 0.0);
        run_steps(&o, 50);
        ASSERT_NEAR(2e-3, speed_slip_phi[k][2], st.phi_rad);
    }
}

int main(void)
{
    UNITY_BEGIN();
    run_contract();
    RUN_TEST(test_the_sum_tells_no_number);
    RUN_TEST(test_one_step_by_hand);
    RUN_TEST(test_the_adaptation_is_rotated_while_generating);
    return UNITY_END();
}
