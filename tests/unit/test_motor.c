#include "motor.h"

#include "exact.h"
#include "reference_machine.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* sigma Ls = Ls - M^2/Lr cancels all but a tenth: float keeps 2e-6 of it. */
static void assert_relative(double expected, float actual)
{
    ASSERT_NEAR(2e-6 * fabs(expected), expected, actual);
}

static void test_model_is_that_of_the_circuit(void)
{
    for (int k = 0; k < REFERENCE_MACHINES; k++) {
        const motor_t *motor = &reference_machine[k];
        const reference_model_t truth = reference_model(motor, 0.0);
        motor_model_t model;
        TEST_ASSERT_TRUE(motor_derive(&model, motor));
        ASSERT_SAME_FLOAT(motor->Rs_ohm, model.Rs_ohm);
        ASSERT_SAME_FLOAT(motor->M_H, model.M_H);
        ASSERT_SAME_FLOAT(motor->pole_pairs, model.pole_pairs);
        assert_relative(truth.sigma_Ls, model.sigma_Ls_H);
        assert_relative(truth.eps, model.eps_H);
        assert_relative(truth.tau, model.tau_per_s);
        assert_relative((double)motor->M_H / (double)motor->Lr_H, model.kr);
        assert_relative(-creal(truth.a11), model.a11_per_s);
    }
}

static void test_table_1_gives_the_numbers_of_the_paper(void)
{
    const motor_model_t model = reference_derived(0);
    ASSERT_NEAR(1e-7, 0.008, model.sigma_Ls_H);
    ASSERT_NEAR(1e-7, 0.008, model.eps_H);
    ASSERT_NEAR(1e-5, 4.901961, model.tau_per_s);
    ASSERT_NEAR(1e-3, 178.75, model.a11_per_s);
}

static void test_current_decay_follows_the_stator_resistance(void)
{
    for (int k = 0; k < REFERENCE_MACHINES; k++) {
        motor_t warm = reference_machine[k];
        warm.Rs_ohm *= 1.3f;
        const motor_model_t cold = reference_derived(k);
        assert_relative(-creal(reference_model(&warm, 0.0).a11),
                        motor_a11_per_s(&cold, warm.Rs_ohm));
    }
}

static void test_torque_is_the_cross_product_of_flux_and_current(void)
{
    for (int k = 0; k < REFERENCE_MACHINES; k++) {
        const motor_t *motor = &reference_machine[k];
        const motor_model_t model = reference_derived(k);
        const double kr = (double)motor->M_H / (double)motor->Lr_H;
        const double p = (double)motor->pole_pairs;
        ASSERT_NEAR(1e-5, p * kr * 0.5 * -7.0, motor_torque_Nm(&model, 0.5f, -7.0f));
    }
}

static void test_torque_doubles_with_the_pole_pairs(void)
{
    motor_t four_poles = reference_machine[0];
    four_poles.pole_pairs = 4.0f;
    motor_model_t model;
    TEST_ASSERT_TRUE(motor_derive(&model, &four_poles));
    const motor_model_t two = reference_derived(0);
    ASSERT_SAME_FLOAT(2.0f * motor_torque_Nm(&two, 0.5f, 7.0f),
                      motor_torque_Nm(&model, 0.5f, 7.0f));
}

static void assert_refused(const motor_t *motor)
{
    motor_model_t model;
    motor_model_t before;
    memset(&model, 0x5A, sizeof model);
    before = model;
    TEST_ASSERT_FALSE(motor_derive(&model, motor));
    TEST_ASSERT_EQUAL_MEMORY(&before, &model, sizeof model);
}

static void test_every_value_has_to_be_positive(void)
{
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        motor_t bad[6];
        for (int field = 0; field < 6; field++) {
            bad[field] = reference_machine[1];
        }
        bad[0].Rs_ohm = not_positive(k);
        bad[1].Rr_ohm = not_positive(k);
        bad[2].Ls_H = not_positive(k);
        bad[3].Lr_H = not_positive(k);
        bad[4].M_H = not_positive(k);
        bad[5].pole_pairs = not_positive(k);
        for (int field = 0; field < 6; field++) {
            assert_refused(&bad[field]);
        }
    }
}

static void test_a_machine_without_leakage_is_refused(void)
{
    motor_t motor = reference_machine[0];
    motor.Ls_H = 0.125f;
    motor.Lr_H = 0.125f;
    motor.M_H = 0.125f;
    assert_refused(&motor);
    motor.M_H = 0.126f;
    assert_refused(&motor);
}

static void test_a_vanishing_coupling_is_refused(void)
{
    const motor_t motor = {1e-30f, 1e30f, 1e-30f, 1e30f, 1e-30f, 2.0f};
    assert_refused(&motor);
}

static void test_a_vanishing_rotor_decay_is_refused(void)
{
    const motor_t motor = {1e10f, 1e-40f, 1e10f, 1e10f, 1e9f, 2.0f};
    assert_refused(&motor);
}

static void test_an_overflowing_current_decay_is_refused(void)
{
    motor_t motor = reference_machine[0];
    motor.Rs_ohm = 1e38f;
    assert_refused(&motor);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_model_is_that_of_the_circuit);
    RUN_TEST(test_table_1_gives_the_numbers_of_the_paper);
    RUN_TEST(test_current_decay_follows_the_stator_resistance);
    RUN_TEST(test_torque_is_the_cross_product_of_flux_and_current);
    RUN_TEST(test_torque_doubles_with_the_pole_pairs);
    RUN_TEST(test_every_value_has_to_be_positive);
    RUN_TEST(test_a_machine_without_leakage_is_refused);
    RUN_TEST(test_a_vanishing_coupling_is_refused);
    RUN_TEST(test_a_vanishing_rotor_decay_is_refused);
    RUN_TEST(test_an_overflowing_current_decay_is_refused);
    return UNITY_END();
}
