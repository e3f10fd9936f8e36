/* The hybrid of voltage and current model against the motor's equations. */
#include "estimator_fixture.h"

static const tolerance_t within = {
    .flux_pu = 2e-3, .speed_rad_s = 0.1, .held_rad_s = 0.1, .extra_slip_rad_s = 0.1};

#include "estimator_contract.h"

static void test_the_sum_tells_no_number(void)
{
    operation_t o = operation(0, 1);
    seed_as(&o, 0.0);
    float *const word[] = {&st.psi_s_Wb.alpha,
                           &st.psi_s_Wb.beta,
                           &st.i_before_A.alpha,
                           &st.i_before_A.beta,
                           &st.slow_Wb,
                           &st.omega_model_rad_s,
                           &st.estimate.lambda_r_hat_Wb.alpha,
                           &st.estimate.lambda_r_hat_Wb.beta,
                           &st.estimate.omega_e_rad_s,
                           &st.estimate.omega_s_rad_s};
    check_sum(word, sizeof word / sizeof word[0]);
}

/* No axis to take the current along. */
static void test_nothing_moves_without_flux_and_current(void)
{
    const estimator_in_t in = {.u_s_V = {0.0f, 0.0f}};
    for (int k = 0; k < 3; k++) {
        estimator_step(&cfg, &st, &in);
    }
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.estimate.lambda_Wb);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.estimate.omega_e_rad_s);
    TEST_ASSERT_TRUE(is_finite(estimator_sum(&st)));
}

int main(void)
{
    UNITY_BEGIN();
    run_contract();
    RUN_TEST(test_the_sum_tells_no_number);
    RUN_TEST(test_nothing_moves_without_flux_and_current);
    return UNITY_END();
}
