/* The vector alone: begins where the current is, keeps its length, and turns at the wanted speed.
 */
#include "i_f.h"

#include <complex.h>
#include <math.h>

#include "exact.h"
#include "reference_machine.h"
#include "unity.h"

#define PERIOD_S 0.0002f

static const i_f_params_t good = {.current_A = 12.0f,
                                  .slew_A_per_s = 150.0f,
                                  .slew_rad_s2 = 60.0f,
                                  .return_rad_s = 12.5f,
                                  .timeout_s = 0.1f};

/* Powers of two: steps and limits are exact. |i| w may reach 1 A rad/s per volt of dc link. */
static const i_f_config_t simple = {.current_A = 8.0f,
                                    .step_A = 0.5f,
                                    .step_rad_s = 0.25f,
                                    .return_rad_s = 4.0f,
                                    .timeout_periods = 3u,
                                    .A_rad_s_per_V = 1.0f,
                                    .period_s = 0.015625f};

static i_f_config_t cfg;
static i_f_state_t st;
static motor_model_t table1;

void setUp(void)
{
    cfg = simple;
    st = (i_f_state_t){.active = true, .axis = {1.0f, 0.0f}};
    table1 = reference_derived(0);
}

void tearDown(void)
{
}

static bool step(float omega_ref_rad_s, float u_dc_V, bool lost)
{
    const i_f_in_t in = {omega_ref_rad_s, u_dc_V, lost};
    return i_f_step(&cfg, &st, &in);
}

static double complex axis(void)
{
    return (double)st.axis.alpha + I * (double)st.axis.beta;
}

static void test_init_derives_steps_and_the_voltage_limit_of_both_machines(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        const motor_t *motor = &reference_machine[m];
        TEST_ASSERT_TRUE(i_f_init(&cfg, &good, &model, PERIOD_S));
        TEST_ASSERT_TRUE(i_f_on(&cfg));
        ASSERT_SAME_FLOAT(12.0f, cfg.current_A);
        ASSERT_NEAR(1e-8, 150.0 * 2e-4, cfg.step_A);
        ASSERT_NEAR(1e-9, 60.0 * 2e-4, cfg.step_rad_s);
        ASSERT_SAME_FLOAT(12.5f, cfg.return_rad_s);
        TEST_ASSERT_UINT32_WITHIN(1u, 500u, cfg.timeout_periods);
        ASSERT_SAME_FLOAT(PERIOD_S, cfg.period_s);
        /* The flux M I induces (M/Lr) w M I: .35 of the dc link, half of what the legs can give. */
        const double M = (double)motor->M_H;
        const double emf_V_per_A_rad_s = M * M / (double)motor->Lr_H;
        ASSERT_NEAR(1e-5, 0.35, (double)cfg.A_rad_s_per_V * emf_V_per_A_rad_s);
    }
}

static void test_switched_off_nothing_else_is_looked_at(void)
{
    const i_f_params_t off = {.current_A = 0.0f, .slew_A_per_s = NAN};
    const motor_model_t none = {0};
    TEST_ASSERT_TRUE(i_f_init(&cfg, &off, &none, NAN));
    TEST_ASSERT_FALSE(i_f_on(&cfg));
    ASSERT_SAME_FLOAT(0.0f, cfg.current_A);
    TEST_ASSERT_EQUAL_UINT32(0u, cfg.timeout_periods);
}

#define ASSERT_REFUSED(field, value)                                                               \
    do {                                                                                           \
        i_f_params_t bad = good;                                                                   \
        bad.field = (value);                                                                       \
        TEST_ASSERT_FALSE_MESSAGE(i_f_init(&cfg, &bad, &table1, PERIOD_S), #field);                \
        TEST_ASSERT_FALSE(i_f_on(&cfg));                                                           \
    } while (0)

static void test_init_refuses_every_bad_number(void)
{
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        const float x = not_positive(k);
        ASSERT_REFUSED(slew_A_per_s, x);
        ASSERT_REFUSED(slew_rad_s2, x);
        ASSERT_REFUSED(return_rad_s, x);
        float *const field[] = {&table1.M_H, &table1.kr};
        for (unsigned f = 0; f < sizeof field / sizeof field[0]; f++) {
            const float before = *field[f];
            *field[f] = x;
            TEST_ASSERT_FALSE(i_f_init(&cfg, &good, &table1, PERIOD_S));
            *field[f] = before;
        }
        TEST_ASSERT_FALSE(i_f_init(&cfg, &good, &table1, x));
    }
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        ASSERT_REFUSED(current_A, not_finite(k));
        ASSERT_REFUSED(timeout_s, not_finite(k));
    }
    ASSERT_REFUSED(current_A, -0.1f);
    ASSERT_REFUSED(timeout_s, -0.1f);
    ASSERT_REFUSED(timeout_s, 2.1e5f); /* more periods than a counter takes */
}

static void test_init_accepts_the_ends_of_the_ranges(void)
{
    i_f_params_t p = good;
    p.timeout_s = 0.0f;
    TEST_ASSERT_TRUE(i_f_init(&cfg, &p, &table1, PERIOD_S));
    TEST_ASSERT_EQUAL_UINT32(0u, cfg.timeout_periods);
    p.timeout_s = 1.9e5f;
    TEST_ASSERT_TRUE(i_f_init(&cfg, &p, &table1, PERIOD_S));
    p.current_A = 1e-3f;
    TEST_ASSERT_TRUE(i_f_init(&cfg, &p, &table1, PERIOD_S));
    TEST_ASSERT_TRUE(i_f_on(&cfg));
    p.timeout_s = 1e9f; /* periods of a second: exactly too many */
    TEST_ASSERT_FALSE(i_f_init(&cfg, &p, &table1, 1.0f));
}

static void test_it_starts_along_the_measured_current_with_its_length(void)
{
    st = (i_f_state_t){.lost_periods = 9u, .tries = 2u, .flux_Wb = {0.5f, 0.1f}};
    i_f_start(&st, (ab_t){-3.0f, 4.0f}, -17.0f);
    TEST_ASSERT_TRUE(st.active);
    ASSERT_NEAR(1e-7, -0.6, st.axis.alpha);
    ASSERT_NEAR(1e-7, 0.8, st.axis.beta);
    ASSERT_SAME_FLOAT(5.0f, st.current_A);
    ASSERT_SAME_FLOAT(-17.0f, st.omega_rad_s);
    TEST_ASSERT_EQUAL_UINT32(0u, st.lost_periods);
    TEST_ASSERT_EQUAL_UINT32(2u, st.tries); /* over the losses of a run */
    ASSERT_SAME_FLOAT(0.0f, st.flux_Wb.alpha);
}

/* No direction in what is nearly nothing, and none in what is no number. */
static void test_it_starts_along_alpha_from_nothing_when_there_is_no_current(void)
{
    const ab_t none[] = {{0.0f, 0.0f}, {0.0f, 1e-3f}, {NAN, 1.0f}, {1.0f, NAN}};
    for (unsigned k = 0; k < sizeof none / sizeof none[0]; k++) {
        i_f_start(&st, none[k], 3.0f);
        ASSERT_SAME_FLOAT(1.0f, st.axis.alpha);
        ASSERT_SAME_FLOAT(0.0f, st.axis.beta);
        ASSERT_SAME_FLOAT(0.0f, st.current_A);
    }
    i_f_start(&st, (ab_t){0.0f, 1.1e-3f}, 3.0f);
    ASSERT_NEAR(1e-6, 1.0, st.axis.beta);
    ASSERT_NEAR(1e-9, 1.1e-3, st.current_A);
}

static void test_a_speed_that_is_no_number_starts_at_rest(void)
{
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        i_f_start(&st, (ab_t){1.0f, 0.0f}, not_finite(k));
        ASSERT_SAME_FLOAT(0.0f, st.omega_rad_s);
    }
}

/* At rest at its length: nothing moves. */
static void test_step_holds_a_standing_vector(void)
{
    st.axis = (ab_t){0.6f, 0.8f};
    st.current_A = 8.0f;
    for (int k = 0; k < 1000; k++) {
        TEST_ASSERT_FALSE(step(0.0f, 300.0f, true));
    }
    ASSERT_NEAR(1e-6, 0.6, st.axis.alpha);
    ASSERT_NEAR(1e-6, 0.8, st.axis.beta);
    ASSERT_SAME_FLOAT(8.0f, st.current_A);
    ASSERT_SAME_FLOAT(0.0f, st.omega_rad_s);
}

static void test_one_step_agrees_with_double_arithmetic_on_both_machines(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        TEST_ASSERT_TRUE(i_f_init(&cfg, &good, &model, PERIOD_S));
        i_f_start(&st, (ab_t){3.0f, -2.0f}, 300.0f);
        const double complex before = axis();
        TEST_ASSERT_FALSE(step(-100.0f, 540.0f, false));
        const double omega = 300.0 - 60.0 * 2e-4;
        const double complex after = before * cexp(I * omega * 2e-4);
        ASSERT_NEAR(1e-6, creal(after), st.axis.alpha);
        ASSERT_NEAR(1e-6, cimag(after), st.axis.beta);
        ASSERT_NEAR(1e-4, omega, st.omega_rad_s);
        ASSERT_NEAR(1e-6, hypot(3.0, 2.0) + 150.0 * 2e-4, st.current_A);
    }
}

/* 200 s of turning: no rounding may add up. */
static void test_the_axis_keeps_its_length(void)
{
    const float omega_rad_s[] = {0.0f, 0.3f, -20.0f, 300.0f, -3000.0f};
    TEST_ASSERT_TRUE(i_f_init(&cfg, &good, &table1, PERIOD_S));
    for (unsigned w = 0; w < sizeof omega_rad_s / sizeof omega_rad_s[0]; w++) {
        i_f_start(&st, (ab_t){3.0f, 4.0f}, omega_rad_s[w]);
        double worst = 0.0;
        for (int k = 0; k < 1000000; k++) {
            (void)step(omega_rad_s[w], 540.0f, true);
            worst = fmax(worst, fabs(cabs(axis()) - 1.0));
        }
        /* Some roundings of 6e-8. */
        ASSERT_NEAR(5e-7, 0.0, worst);
    }
}

/* What a disturbed bit would leave of the length is gone after a few turns of the screw. */
static void test_a_wrong_length_heals(void)
{
    st.axis = (ab_t){0.9f, 0.0f};
    for (int k = 0; k < 8; k++) {
        (void)step(1.0f, 300.0f, true);
    }
    ASSERT_NEAR(1e-6, 1.0, cabs(axis()));
}

/* A frequency that no drive has must not spin the vector by more than an eighth of a turn. */
static void test_the_angle_of_one_period_is_limited(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        st.axis = (ab_t){1.0f, 0.0f};
        st.omega_rad_s = (float)sign * 1e4f;
        (void)step((float)sign * 1e4f, 300.0f, true);
        ASSERT_NEAR(1e-6, sign * 0.785, carg(axis()));
    }
}

static void test_the_frequency_follows_by_its_slew_step(void)
{
    const float expected_rad_s[] = {0.25f, 0.5f, 0.75f, 0.8125f, 0.8125f};
    for (unsigned k = 0; k < 5u; k++) {
        (void)step(0.8125f, 300.0f, true);
        ASSERT_SAME_FLOAT(expected_rad_s[k], st.omega_rad_s);
    }
    (void)step(-10.0f, 300.0f, true);
    ASSERT_SAME_FLOAT(0.5625f, st.omega_rad_s);
}

/* The axis turns with the frequency of this period, not with the one before. */
static void test_the_axis_turns_with_the_new_frequency(void)
{
    (void)step(10.0f, 300.0f, true);
    ASSERT_NEAR(1e-7, 0.25 * 0.015625, carg(axis()));
}

static void test_the_current_slews_up_and_down(void)
{
    const float up_A[] = {0.5f, 1.0f, 1.5f};
    for (unsigned k = 0; k < 3u; k++) {
        (void)step(0.0f, 300.0f, true);
        ASSERT_SAME_FLOAT(up_A[k], st.current_A);
    }
    st.current_A = 8.75f; /* longer than asked, as after an overload */
    (void)step(0.0f, 300.0f, true);
    ASSERT_SAME_FLOAT(8.25f, st.current_A);
    (void)step(0.0f, 300.0f, true);
    ASSERT_SAME_FLOAT(8.0f, st.current_A);
}

/* |i| w = 1 A rad/s per volt here: 256 V are 8 A up to 32 rad/s, and 4 A at 64. */
static void test_the_voltage_limit_shortens_the_vector_with_speed(void)
{
    const struct {
        float omega_rad_s;
        float u_dc_V;
        float length_A;
    } point[] = {{32.0f, 256.0f, 8.0f},  {64.0f, 256.0f, 4.0f}, {-64.0f, 256.0f, 4.0f},
                 {128.0f, 256.0f, 2.0f}, {64.0f, 512.0f, 8.0f}, {64.0f, 128.0f, 2.0f},
                 {0.0f, 0.0f, 8.0f},     {64.0f, 0.0f, 0.0f},   {64.0f, -100.0f, 0.0f}};
    for (unsigned k = 0; k < sizeof point / sizeof point[0]; k++) {
        st.omega_rad_s = point[k].omega_rad_s;
        for (int n = 0; n < 40; n++) {
            (void)step(point[k].omega_rad_s, point[k].u_dc_V, true);
        }
        ASSERT_SAME_FLOAT(point[k].length_A, st.current_A);
    }
}

static void test_what_is_no_number_changes_nothing_bad(void)
{
    st.omega_rad_s = 8.0f;
    st.current_A = 8.0f;
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        TEST_ASSERT_FALSE(step(not_finite(k), 300.0f, false));
        ASSERT_SAME_FLOAT(8.0f, st.omega_rad_s);
        ASSERT_SAME_FLOAT(8.0f, st.current_A);
    }
    ASSERT_NEAR(1e-6, 3.0 * 8.0 * 0.015625, carg(axis())); /* it went on turning */
    /* A dc link that is not known gives no voltage; the vector shrinks by its slew step. */
    (void)step(8.0f, NAN, false);
    ASSERT_SAME_FLOAT(7.5f, st.current_A);
    (void)step(8.0f, -INFINITY, false);
    ASSERT_SAME_FLOAT(7.0f, st.current_A);
    (void)step(8.0f, INFINITY, false);
    ASSERT_SAME_FLOAT(7.5f, st.current_A);
    ASSERT_NEAR(1e-6, 1.0, cabs(axis()));
}

static void test_fast_enough_is_from_the_return_frequency_on_either_way(void)
{
    const float below_rad_s[] = {0.0f, 3.99f, -3.99f};
    const float above_rad_s[] = {4.0f, -4.0f, 300.0f};
    for (unsigned k = 0; k < 3u; k++) {
        st.omega_rad_s = below_rad_s[k];
        TEST_ASSERT_FALSE(i_f_observable(&cfg, &st));
        st.omega_rad_s = above_rad_s[k];
        TEST_ASSERT_TRUE(i_f_observable(&cfg, &st));
    }
}

static void test_it_is_given_up_when_lost_and_fast_for_the_whole_time(void)
{
    const bool given_up[] = {false, false, false, true, true};
    for (unsigned k = 0; k < 5u; k++) {
        st.omega_rad_s = -5.0f;
        TEST_ASSERT_EQUAL(given_up[k], step(-5.0f, 300.0f, true));
    }
    TEST_ASSERT_EQUAL_UINT32(3u, st.lost_periods); /* and cannot wrap */
}

static void test_the_time_is_counted_on_end(void)
{
    for (int round = 0; round < 3; round++) {
        st.omega_rad_s = 5.0f;
        for (int k = 0; k < 3; k++) {
            TEST_ASSERT_FALSE(step(5.0f, 300.0f, true));
        }
        /* Found again, or too slow to see, for one period. */
        st.omega_rad_s = (round == 1) ? 3.0f : 5.0f;
        TEST_ASSERT_FALSE(step(st.omega_rad_s, 300.0f, round == 1));
        TEST_ASSERT_EQUAL_UINT32(0u, st.lost_periods);
    }
}

static void test_below_the_return_frequency_it_holds_for_ever(void)
{
    for (int k = 0; k < 100; k++) {
        st.omega_rad_s = 3.5f;
        TEST_ASSERT_FALSE(step(3.5f, 300.0f, true));
    }
}

static void test_without_a_time_it_is_given_up_at_once(void)
{
    cfg.timeout_periods = 0u;
    TEST_ASSERT_FALSE(step(0.0f, 300.0f, true));
    st.omega_rad_s = 5.0f;
    TEST_ASSERT_FALSE(step(5.0f, 300.0f, false));
    TEST_ASSERT_TRUE(step(5.0f, 300.0f, true));
}

/* The mirror image turns the other way; a turned one turns alike. */
static void test_it_knows_no_direction(void)
{
    TEST_ASSERT_TRUE(i_f_init(&cfg, &good, &table1, PERIOD_S));
    i_f_state_t plain, mirrored, turned;
    i_f_start(&plain, (ab_t){3.0f, 4.0f}, 20.0f);
    i_f_start(&mirrored, (ab_t){3.0f, -4.0f}, -20.0f);
    i_f_start(&turned, (ab_t){-4.0f, 3.0f}, 20.0f);
    for (int k = 0; k < 500; k++) {
        const i_f_in_t in = {300.0f, 100.0f, true};
        const i_f_in_t reversed = {-300.0f, 100.0f, true};
        const bool up = i_f_step(&cfg, &plain, &in);
        TEST_ASSERT_EQUAL(up, i_f_step(&cfg, &mirrored, &reversed));
        TEST_ASSERT_EQUAL(up, i_f_step(&cfg, &turned, &in));
        ASSERT_SAME_FLOAT(plain.axis.alpha, mirrored.axis.alpha);
        ASSERT_SAME_FLOAT(plain.axis.beta, -mirrored.axis.beta);
        ASSERT_NEAR(1e-6, plain.axis.alpha, turned.axis.beta);
        ASSERT_NEAR(1e-6, plain.axis.beta, -turned.axis.alpha);
        ASSERT_SAME_FLOAT(plain.current_A, mirrored.current_A);
        ASSERT_SAME_FLOAT(plain.omega_rad_s, -mirrored.omega_rad_s);
    }
}

/* What the stator equation says of both machines, at both directions, from any flux before. */
static void test_the_flux_of_the_stator_equation_is_found(void)
{
    const double omega_rad_s[] = {12.0, -30.0, 200.0};
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        TEST_ASSERT_TRUE(i_f_init(&cfg, &good, &model, PERIOD_S));
        TEST_ASSERT_EQUAL_UINT32(3000u, cfg.look_periods);
        for (int k = 0; k < 3; k++) {
            const double complex along = cexp(0.7 * I);
            const double complex i_A = 8.0 * along;
            const double complex flux_Wb = (0.6 - 0.2 * I) * along;
            const double complex u_V =
                (double)model.Rs_ohm * i_A +
                I * omega_rad_s[k] * ((double)model.sigma_Ls_H * i_A + (double)model.kr * flux_Wb);
            const ab_t u = {(float)creal(u_V), (float)cimag(u_V)};
            const ab_t i = {(float)creal(i_A), (float)cimag(i_A)};
            st = (i_f_state_t){.axis = {(float)creal(along), (float)cimag(along)},
                               .omega_rad_s = (float)omega_rad_s[k]};
            i_f_see_flux(&cfg, &st, u, i);
            ASSERT_NEAR(1e-6, 0.6 * 2e-4 / 0.1002, st.flux_Wb.alpha);
            ASSERT_NEAR(1e-6, -0.2 * 2e-4 / 0.1002, st.flux_Wb.beta);
            for (int n = 0; n < 10000; n++) {
                i_f_see_flux(&cfg, &st, u, i);
            }
            ASSERT_NEAR(1e-4, 0.6, st.flux_Wb.alpha);
            ASSERT_NEAR(1e-4, -0.2, st.flux_Wb.beta);
        }
    }
}

static void test_a_voltage_that_is_no_number_leaves_the_flux(void)
{
    TEST_ASSERT_TRUE(i_f_init(&cfg, &good, &table1, PERIOD_S));
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        st.omega_rad_s = 30.0f;
        st.flux_Wb = (ab_t){0.5f, 0.1f};
        i_f_see_flux(&cfg, &st, (ab_t){not_finite(k), 0.0f}, (ab_t){1.0f, 0.0f});
        ASSERT_SAME_FLOAT(0.5f, st.flux_Wb.alpha);
        ASSERT_SAME_FLOAT(0.1f, st.flux_Wb.beta);
    }
}

static bool found(ab_t flux_Wb, uint32_t lost_periods)
{
    ab_t found_Wb = {NAN, NAN};
    float omega_e_rad_s = NAN;
    st.flux_Wb = flux_Wb;
    st.lost_periods = lost_periods;
    return i_f_found(&cfg, &st, 0.5f, &found_Wb, &omega_e_rad_s);
}

static void test_a_rotor_that_follows_is_found_after_a_time(void)
{
    TEST_ASSERT_TRUE(i_f_init(&cfg, &good, &table1, PERIOD_S));
    const ab_t fine_Wb = {0.5f, 0.1f};
    TEST_ASSERT_TRUE(found(fine_Wb, 3000u));
    TEST_ASSERT_FALSE(found(fine_Wb, 2999u));
    st.tries = I_F_LOOKS - 1u;
    TEST_ASSERT_TRUE(found(fine_Wb, 3000u));
    st.tries = I_F_LOOKS;
    TEST_ASSERT_FALSE(found(fine_Wb, 3000u));
    st.tries = 0u;
    TEST_ASSERT_TRUE(found((ab_t){0.25f, 0.0f}, 3000u));
    TEST_ASSERT_FALSE(found((ab_t){0.249f, 0.0f}, 3000u)); /* hardly any flux */
    TEST_ASSERT_TRUE(found((ab_t){0.5f, -0.5f}, 3000u));
    TEST_ASSERT_FALSE(found((ab_t){0.5f, -0.51f}, 3000u)); /* beyond its pull-out */
    TEST_ASSERT_FALSE(found((ab_t){0.5f, 0.51f}, 3000u));
    TEST_ASSERT_FALSE(found((ab_t){-0.5f, 0.0f}, 3000u));
}

/* A rotor behind by x of 1/Tr has the flux M i/(1 + jx), whatever M has become. */
static void test_flux_and_speed_of_the_rotor(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        TEST_ASSERT_TRUE(i_f_init(&cfg, &good, &model, PERIOD_S));
        const double complex along = cexp(-2.1 * I);
        for (double x = -0.9; x < 1.0; x += 0.3) {
            const double complex flux_Wb = (double)model.M_H * 8.0 / (1.0 + I * x);
            st = (i_f_state_t){.axis = {(float)creal(along), (float)cimag(along)},
                               .current_A = 8.0f,
                               .omega_rad_s = 30.0f,
                               .flux_Wb = {(float)creal(flux_Wb), (float)cimag(flux_Wb)},
                               .lost_periods = 3000u};
            ab_t found_Wb = {NAN, NAN};
            float omega_e_rad_s = NAN;
            TEST_ASSERT_TRUE(i_f_found(&cfg, &st, 0.2f, &found_Wb, &omega_e_rad_s));
            ASSERT_NEAR(1e-5, creal(flux_Wb * along), found_Wb.alpha);
            ASSERT_NEAR(1e-5, cimag(flux_Wb * along), found_Wb.beta);
            ASSERT_NEAR(1e-4, 30.0 - x * (double)model.tau_per_s, omega_e_rad_s);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_derives_steps_and_the_voltage_limit_of_both_machines);
    RUN_TEST(test_switched_off_nothing_else_is_looked_at);
    RUN_TEST(test_init_refuses_every_bad_number);
    RUN_TEST(test_init_accepts_the_ends_of_the_ranges);
    RUN_TEST(test_it_starts_along_the_measured_current_with_its_length);
    RUN_TEST(test_it_starts_along_alpha_from_nothing_when_there_is_no_current);
    RUN_TEST(test_a_speed_that_is_no_number_starts_at_rest);
    RUN_TEST(test_step_holds_a_standing_vector);
    RUN_TEST(test_one_step_agrees_with_double_arithmetic_on_both_machines);
    RUN_TEST(test_the_axis_keeps_its_length);
    RUN_TEST(test_a_wrong_length_heals);
    RUN_TEST(test_the_angle_of_one_period_is_limited);
    RUN_TEST(test_the_frequency_follows_by_its_slew_step);
    RUN_TEST(test_the_axis_turns_with_the_new_frequency);
    RUN_TEST(test_the_current_slews_up_and_down);
    RUN_TEST(test_the_voltage_limit_shortens_the_vector_with_speed);
    RUN_TEST(test_what_is_no_number_changes_nothing_bad);
    RUN_TEST(test_fast_enough_is_from_the_return_frequency_on_either_way);
    RUN_TEST(test_it_is_given_up_when_lost_and_fast_for_the_whole_time);
    RUN_TEST(test_the_time_is_counted_on_end);
    RUN_TEST(test_below_the_return_frequency_it_holds_for_ever);
    RUN_TEST(test_without_a_time_it_is_given_up_at_once);
    RUN_TEST(test_it_knows_no_direction);
    RUN_TEST(test_the_flux_of_the_stator_equation_is_found);
    RUN_TEST(test_a_voltage_that_is_no_number_leaves_the_flux);
    RUN_TEST(test_a_rotor_that_follows_is_found_after_a_time);
    RUN_TEST(test_flux_and_speed_of_the_rotor);
    return UNITY_END();
}
