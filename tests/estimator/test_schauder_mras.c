/* Schauder's MRAS against the motor's equations, and against the paper's transfer function. */
#include "estimator_fixture.h"

static const tolerance_t within = {
    .flux_pu = 2e-3, .speed_rad_s = 0.1, .held_rad_s = 0.1, .extra_slip_rad_s = 0.1};

#include "estimator_contract.h"

static void test_the_sum_tells_no_number(void)
{
    operation_t o = operation(0, 1);
    seed_as(&o, 0.0);
    float *const word[] = {&st.y_Wb.alpha,
                           &st.y_Wb.beta,
                           &st.adjustable_Wb.alpha,
                           &st.adjustable_Wb.beta,
                           &st.slow_Wb.alpha,
                           &st.slow_Wb.beta,
                           &st.i_before_A.alpha,
                           &st.i_before_A.beta,
                           &st.x_rad_s,
                           &st.estimate.lambda_r_hat_Wb.alpha,
                           &st.estimate.lambda_r_hat_Wb.beta,
                           &st.estimate.omega_e_rad_s,
                           &st.estimate.omega_s_rad_s};
    check_sum(word, sizeof word / sizeof word[0]);
}

/* M was found larger: the adjustable model forgets more slowly. By hand, one period. */
static void test_another_rotor_time_constant(void)
{
    operation_t o = operation(0, 0);
    seed_as(&o, 0.0);
    const double complex before = of(st.adjustable_Wb);
    const double complex i_before = of(st.i_before_A);
    estimator_in_t in = sample_of(&o);
    in.tau_extra_per_s = -0.6f;
    estimator_step(&cfg, &st, &in);
    const reference_model_t m = reference_model(&reference_machine[0], o.omega_e_rad_s);
    const double complex turn = cexp((-(m.tau - 0.6) + I * o.omega_e_rad_s) * PERIOD_S);
    const double half = 0.5 * PERIOD_S * m.a21;
    assert_ab(2e-7, turn * (before + half * i_before) + half * of(in.i_s_A), st.adjustable_Wb);
}

/* Error of the flux over its length in the frame of the flux, and what the high-pass takes of it:
 * d' = -(1/Tr + j slip) d + j dw; z = -Im(d - g) |lambda|^2; dw = x + K2 z, x' = K1 z. */
typedef struct {
    double complex d;
    double complex g;
    double x_rad_s;
    double dw_rad_s;
} linear_t;

static void advance_linear(linear_t *l, const operation_t *o)
{
    const int fine = 100;
    const double h = PERIOD_S / fine;
    const double lambda2 = o->lambda_Wb * o->lambda_Wb;
    const double omega_s_rad_s = o->omega_e_rad_s + o->slip_rad_s;
    for (int n = 0; n < fine; n++) {
        const double z = -cimag(l->d - l->g) * lambda2;
        l->dw_rad_s = l->x_rad_s + (double)cfg.kp_rad_per_s_Wb2 * z;
        l->x_rad_s += (double)cfg.ki_T_rad_per_s_Wb2 * z / fine;
        l->g +=
            h * ((double)cfg.high_pass_gain / PERIOD_S * (l->d - l->g) - I * omega_s_rad_s * l->g);
        l->d += h * (-((double)motor.tau_per_s + I * o->slip_rad_s) * l->d + I * l->dw_rad_s);
    }
}

/* A small error of speed decays as the paper's transfer function says, within 3 %. */
static void test_small_errors_decay_as_the_paper_says(void)
{
    const double slip_rad_s[] = {0.0, 5.0, -5.0};
    for (int k = 0; k < 3; k++) {
        operation_t o = {.omega_e_rad_s = 300.0, .slip_rad_s = slip_rad_s[k], .lambda_Wb = 0.5};
        linear_t linear = {.x_rad_s = 1.0};
        seed_as(&o, 0.0);
        run_steps(&o, 5000);
        st.x_rad_s += 1.0f;
        st.estimate.omega_e_rad_s += 1.0f;
        for (int step = 1; step <= 1000; step++) {
            run_steps(&o, 1);
            advance_linear(&linear, &o);
            if (step % 25 == 0) {
                ASSERT_NEAR(0.03, linear.dw_rad_s,
                            (double)st.estimate.omega_e_rad_s - o.omega_e_rad_s);
            }
        }
        ASSERT_NEAR(0.03, 0.0, linear.dw_rad_s);
    }
}

int main(void)
{
    UNITY_BEGIN();
    run_contract();
    RUN_TEST(test_the_sum_tells_no_number);
    RUN_TEST(test_another_rotor_time_constant);
    RUN_TEST(test_small_errors_decay_as_the_paper_says);
    return UNITY_END();
}
