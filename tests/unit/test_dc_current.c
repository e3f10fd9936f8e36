/* The current stands where it is told to, whatever the rotor induces. */
#include "dc_current.h"

#include <math.h>

#include "exact.h"
#include "plant_fixture.h"
#include "unity.h"

#define PERIOD_S 0.0002f

static dc_current_config_t cfg;
static dc_current_state_t st;

void setUp(void)
{
    const motor_model_t model = reference_derived(0);
    TEST_ASSERT_TRUE(dc_current_init(&cfg, 400.0f, &model, PERIOD_S));
    st = (dc_current_state_t){0};
}

void tearDown(void)
{
}

static void test_init_derives_the_gains_of_both_machines(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        const reference_model_t ref = reference_model(&reference_machine[m], 0.0);
        TEST_ASSERT_TRUE(dc_current_init(&cfg, 400.0f, &model, PERIOD_S));
        ASSERT_NEAR(1e-5, 400.0 * ref.sigma_Ls, cfg.kp_ohm);
        ASSERT_NEAR(1e-4, ref.sigma_Ls / 2e-4, cfg.sigma_Ls_per_T_ohm);
    }
}

static void test_init_refuses_what_is_not_positive(void)
{
    const motor_model_t model = reference_derived(0);
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        motor_model_t bad = model;
        bad.sigma_Ls_H = not_positive(k);
        TEST_ASSERT_FALSE(dc_current_init(&cfg, not_positive(k), &model, PERIOD_S));
        TEST_ASSERT_FALSE(dc_current_init(&cfg, 400.0f, &model, not_positive(k)));
        TEST_ASSERT_FALSE(dc_current_init(&cfg, 400.0f, &bad, PERIOD_S));
    }
    const motor_model_t tiny = {.sigma_Ls_H = 1e-30f};
    TEST_ASSERT_FALSE(dc_current_init(&cfg, 1e20f, &tiny, 1e38f));
}

/* e = u - Rs i_mean - sigma Ls di/T, by hand; then turned, and the pull towards the reference. */
static void test_step_is_the_emf_ahead_and_the_pull(void)
{
    cfg = (dc_current_config_t){4.0f, 40.0f, 0.001f};
    st.i_before_A = (ab_t){1.0f, -1.0f};
    const dc_current_in_t in = {.i_ref_A = {3.0f, 0.0f},
                                .i_A = {2.0f, 1.0f},
                                .u_V = {60.0f, 90.0f},
                                .Rs_ohm = 2.0f,
                                .omega_rad_s = 50.0f};
    const ab_t u_V = dc_current_step(&cfg, &st, &in);
    const cplx e = 60.0 + 90.0 * I - 2.0 * (1.5 + 0.0 * I) - 40.0 * (1.0 + 2.0 * I);
    const cplx u = e * cexp(I * 0.1) + 2.0 * 3.0 + 4.0 * (1.0 - 1.0 * I);
    ASSERT_NEAR(1e-5, creal(e), st.e_V.alpha);
    ASSERT_NEAR(1e-5, cimag(e), st.e_V.beta);
    ASSERT_NEAR(1e-4, creal(u), u_V.alpha);
    ASSERT_NEAR(1e-4, cimag(u), u_V.beta);
    ASSERT_SAME_FLOAT(2.0f, st.i_before_A.alpha);
}

/* Residual flux at 120 % speed, both directions: what a controller without the feed-forward turns
 * into 30 A stays below what two periods without voltage cost. */
static void test_current_stays_small_against_a_spinning_field(void)
{
    for (int direction = -1; direction <= 1; direction += 2) {
        plant_t plant = plant_of(reference_machine[0], direction * 430.0, 0.42);
        st = (dc_current_state_t){0};
        ab_t acting_V = {0.0f, 0.0f}, next_V = {0.0f, 0.0f};
        double most_A = 0.0;
        for (int k = 0; k < 500; k++) {
            const cplx i = plant_current(&plant);
            const dc_current_in_t in = {.i_ref_A = {5.0f, 0.0f},
                                        .i_A = {(float)creal(i), (float)cimag(i)},
                                        .u_V = acting_V,
                                        .Rs_ohm = 0.93f,
                                        .omega_rad_s = (float)direction * 430.0f};
            const ab_t u_V = dc_current_step(&cfg, &st, &in);
            acting_V = next_V;
            next_V = u_V;
            const uvw_t phase_V = uvw_from_ab(acting_V);
            plant.duty = (uvw_t){0.5f + phase_V.u / 283.0f, 0.5f + phase_V.v / 283.0f,
                                 0.5f + phase_V.w / 283.0f};
            plant_advance(&plant, plant.duty, 2e-4);
            most_A = fmax(most_A, cabs(plant_current(&plant)));
        }
        TEST_ASSERT_TRUE(most_A < 12.0);
        ASSERT_NEAR(0.15, 5.0, creal(plant_current(&plant)));
        ASSERT_NEAR(0.15, 0.0, cimag(plant_current(&plant)));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_derives_the_gains_of_both_machines);
    RUN_TEST(test_init_refuses_what_is_not_positive);
    RUN_TEST(test_step_is_the_emf_ahead_and_the_pull);
    RUN_TEST(test_current_stays_small_against_a_spinning_field);
    return UNITY_END();
}
