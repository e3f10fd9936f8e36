#include "speed_control.h"

#include <float.h>
#include <math.h>
#include <stddef.h>

#include "exact.h"
#include "reference_machine.h"
#include "slots.h"
#include "unity.h"

#define PERIOD_S 0.0002f

static const speed_control_params_t good = {.bandwidth_rad_s = 31.0f,
                                            .ki_factor = 0.25f,
                                            .J_kg_m2 = 0.015f,
                                            .lambda_Wb = 0.5f,
                                            .i_q_max_A = 15.0f,
                                            .i_max_A = 15.8f,
                                            .filter_s = 0.003f,
                                            .slew_rad_s2 = 1000.0f,
                                            .torque_max_rad_s = 300.0f,
                                            .torque_min_rad_s = -200.0f,
                                            .torque_slew_Nm_per_s = 100.0f};

/* Coefficients of short binary fractions: expected results are exact. */
static const speed_control_config_t simple = {
    .pi = {.kp = 0.5f, .ki_T = 0.125f, .tracking = 0.25f, .x_max = 15.0f},
    .i_q_max_A = 15.0f,
    .i_q_max2_A2 = 225.0f,
    .i_max2_A2 = 289.0f, /* 17^2 = 8^2 + 15^2 */
    .filter_gain = 0.5f,
    .slew_step_rad_s = 2.0f};

static motor_model_t table1;

/* As the drive does: limits when they are new, and here before each step. */
static float step(const speed_control_config_t *cfg, speed_control_state_t *st,
                  const speed_control_in_t *in, float omega_hat_rad_s)
{
    speed_control_limit(cfg, st, in);
    return speed_control_step(cfg, st, in, omega_hat_rad_s);
}

void setUp(void)
{
    table1 = reference_derived(0);
}

void tearDown(void)
{
}

/* Slips so little that the gain stays below its bound. */
static motor_model_t with_little_slip(int machine)
{
    motor_model_t model = reference_derived(machine);
    model.tau_per_s *= 0.1f;
    return model;
}

static void test_init_derives_the_gains_of_both_machines(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_t *motor = &reference_machine[m];
        const motor_model_t model = with_little_slip(m);
        const double kr = (double)motor->M_H / (double)motor->Lr_H;
        const double p = (double)motor->pole_pairs;
        const double kp = 0.015 * 31.0 / (p * p * kr * 0.5);
        speed_control_config_t cfg = {0};

        TEST_ASSERT_TRUE(speed_control_init(&cfg, &good, &model, PERIOD_S));
        ASSERT_NEAR(1e-6 * kp, kp, cfg.pi.kp);
        ASSERT_NEAR(1e-6, 0.25 * 31.0 * kp * 2e-4, cfg.pi.ki_T);
        ASSERT_NEAR(1e-9, 0.25 * 31.0 * 2e-4, cfg.pi.tracking);
        ASSERT_SAME_FLOAT(15.0f, cfg.pi.x_max);
        ASSERT_SAME_FLOAT(15.0f, cfg.i_q_max_A);
        ASSERT_SAME_FLOAT(225.0f, cfg.i_q_max2_A2);
        ASSERT_NEAR(1e-4, 15.8 * 15.8, cfg.i_max2_A2);
        ASSERT_NEAR(1e-8, 0.2 / 3.2, cfg.filter_gain);
        ASSERT_NEAR(1e-7, 0.2, cfg.slew_step_rad_s);
    }
}

static void test_init_takes_the_square_of_the_pole_pairs(void)
{
    speed_control_config_t two = {0};
    speed_control_config_t three = {0};
    TEST_ASSERT_TRUE(speed_control_init(&two, &good, &table1, PERIOD_S));
    table1.pole_pairs = 3.0f;
    TEST_ASSERT_TRUE(speed_control_init(&three, &good, &table1, PERIOD_S));
    ASSERT_NEAR(1e-6, 4.0 / 9.0, three.pi.kp / two.pi.kp);
}

#define ASSERT_REFUSED(field, value)                                                               \
    do {                                                                                           \
        speed_control_params_t bad = good;                                                         \
        bad.field = (value);                                                                       \
        TEST_ASSERT_FALSE_MESSAGE(speed_control_init(&untouched, &bad, &table1, PERIOD_S),         \
                                  #field);                                                         \
    } while (0)

static void test_init_refuses_every_bad_number_and_leaves_the_config(void)
{
    speed_control_config_t untouched = {.i_q_max_A = 77.0f};

    for (int i = 0; i < NOT_POSITIVE_COUNT; i++) {
        motor_model_t bad_motor = table1;
        const float x = not_positive(i);
        ASSERT_REFUSED(bandwidth_rad_s, x);
        ASSERT_REFUSED(J_kg_m2, x);
        ASSERT_REFUSED(lambda_Wb, x);
        ASSERT_REFUSED(i_q_max_A, x);
        ASSERT_REFUSED(i_max_A, x);
        ASSERT_REFUSED(slew_rad_s2, x);
        TEST_ASSERT_FALSE(speed_control_init(&untouched, &good, &table1, x));
        bad_motor.pole_pairs = x;
        TEST_ASSERT_FALSE(speed_control_init(&untouched, &good, &bad_motor, PERIOD_S));
        bad_motor = table1;
        bad_motor.kr = x;
        TEST_ASSERT_FALSE(speed_control_init(&untouched, &good, &bad_motor, PERIOD_S));
    }
    for (int i = 0; i < NOT_FINITE_COUNT; i++) {
        ASSERT_REFUSED(ki_factor, not_finite(i));
        ASSERT_REFUSED(filter_s, not_finite(i));
    }
    ASSERT_REFUSED(ki_factor, -0.1f);
    ASSERT_REFUSED(filter_s, -0.00001f);
    ASSERT_REFUSED(i_max_A, 1e20f);  /* its square is infinite */
    ASSERT_REFUSED(i_max_A, 1e-30f); /* its square is zero */
    ASSERT_SAME_FLOAT(77.0f, untouched.i_q_max_A);
}

static void test_init_refuses_wrong_signs_that_cancel(void)
{
    speed_control_config_t untouched = {0};
    table1.kr = -table1.kr;
    ASSERT_REFUSED(J_kg_m2, -0.015f);
    ASSERT_REFUSED(lambda_Wb, -0.5f);

    speed_control_params_t bad = good;
    bad.bandwidth_rad_s = -31.0f;
    bad.ki_factor = 0.0f;
    TEST_ASSERT_FALSE(speed_control_init(&untouched, &bad, &table1, PERIOD_S));
}

static void test_init_accepts_no_integral_action_and_no_filter(void)
{
    speed_control_params_t p = good;
    speed_control_config_t cfg = {0};
    p.ki_factor = 0.0f;
    p.filter_s = 0.0f;
    TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &table1, PERIOD_S));
    ASSERT_SAME_FLOAT(1.0f, cfg.filter_gain);
    ASSERT_SAME_FLOAT(0.0f, cfg.pi.ki_T);
}

/* 31 rad/s up to 30 rad/s, 124 from 60 on. */
static speed_control_params_t scheduled(void)
{
    speed_control_params_t p = good;
    p.fast_bandwidth_rad_s = 124.0f;
    p.slow_rad_s = 30.0f;
    p.fast_rad_s = 60.0f;
    return p;
}

static void test_init_derives_the_schedule(void)
{
    const speed_control_params_t p = scheduled();
    speed_control_config_t cfg = {0};
    TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &table1, PERIOD_S));
    ASSERT_NEAR(1e-6, 3.0, cfg.gain_extra_max);
    ASSERT_NEAR(1e-7, 0.1, cfg.gain_extra_per_rad_s);
    ASSERT_SAME_FLOAT(30.0f, cfg.slow_rad_s);
    ASSERT_NEAR(1e-6, 4.0 / 3.0, cfg.weakening);
    TEST_ASSERT_TRUE(cfg.slip_room > 1.0f); /* slip takes nothing */
}

/* Where slip takes gain, it falls with weakened flux as 1.25 times the square. */
static void test_bounded_by_slip_the_gain_falls_as_the_square_of_weakened_flux(void)
{
    speed_control_params_t p = scheduled();
    speed_control_config_t cfg = {0};
    speed_control_state_t st = {.omega_filtered_rad_s = 100.0f};
    TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &table1, PERIOD_S));
    while (cfg.slip_room > 1.0f) { /* up to where slip bounds it */
        p.J_kg_m2 *= 2.0f;
        TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &table1, PERIOD_S));
    }
    ASSERT_SAME_FLOAT(1.0f, cfg.slip_room);
    const struct {
        float flux_pu, weakened_pu;
        double gain;
    } expected[] = {{1.0f, 1.0f, 1.0},           {0.75f, 0.75f, 0.75 * 0.9375},
                    {0.5f, 0.5f, 0.5 * 0.625},   {0.875f, 0.875f, 0.875},
                    {0.5f, 1.0f, 0.5},           /* economy, dwelling */
                    {0.5f, 0.75f, 0.5 * 0.9375}, /* both */
                    {1.25f, 1.0f, 1.0}};
    for (unsigned k = 0; k < 7u; k++) {
        speed_control_schedule(&cfg, &st, expected[k].flux_pu, expected[k].weakened_pu);
        ASSERT_NEAR(1e-5, 4.0 * expected[k].gain - 1.0, st.gain_extra);
    }
}

/* A gain of half the bound is weakened as the flux down to .4, where 1.25 r f is 1. */
static void test_with_room_to_the_bound_the_gain_falls_as_the_flux(void)
{
    speed_control_params_t p = scheduled();
    speed_control_config_t cfg = {0};
    speed_control_state_t st = {.omega_filtered_rad_s = 100.0f};
    TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &table1, PERIOD_S));
    p.J_kg_m2 *= 0.5f * cfg.slip_room;
    TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &table1, PERIOD_S));
    ASSERT_NEAR(1e-5, 2.0, cfg.slip_room);
    speed_control_schedule(&cfg, &st, 0.5f, 0.5f);
    ASSERT_NEAR(1e-5, 4.0 * 0.5 - 1.0, st.gain_extra);
    speed_control_schedule(&cfg, &st, 0.25f, 0.25f);
    ASSERT_NEAR(1e-5, 4.0 * 0.25 * 0.625 - 1.0, st.gain_extra);
}

static void test_init_refuses_a_schedule_the_wrong_way_round(void)
{
    speed_control_config_t untouched = {.i_q_max_A = 77.0f};
    for (int i = 0; i < NOT_FINITE_COUNT; i++) {
        ASSERT_REFUSED(fast_bandwidth_rad_s, not_finite(i));
    }
    ASSERT_REFUSED(fast_bandwidth_rad_s, -1.0f);
    const float bad_rad_s[] = {NAN, INFINITY, -INFINITY, -0.1f, 60.0f, 60.1f};
    for (unsigned i = 0; i < 6u; i++) {
        speed_control_params_t bad = scheduled();
        bad.slow_rad_s = bad_rad_s[i];
        TEST_ASSERT_FALSE(speed_control_init(&untouched, &bad, &table1, PERIOD_S));
        bad = scheduled();
        bad.fast_rad_s = (i < 4u) ? bad_rad_s[i] : (60.0f - bad_rad_s[i]);
        TEST_ASSERT_FALSE(speed_control_init(&untouched, &bad, &table1, PERIOD_S));
    }
    ASSERT_SAME_FLOAT(77.0f, untouched.i_q_max_A);
}

static void test_a_fast_bandwidth_that_is_not_faster_is_no_schedule(void)
{
    const float not_faster_rad_s[] = {0.0f, 20.0f, 31.0f};
    for (unsigned i = 0; i < 3u; i++) {
        speed_control_params_t p = scheduled();
        speed_control_config_t cfg = {0};
        p.fast_bandwidth_rad_s = not_faster_rad_s[i];
        p.slow_rad_s = 60.0f; /* not looked at */
        TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &table1, PERIOD_S));
        ASSERT_SAME_FLOAT(0.0f, cfg.gain_extra_max);
        ASSERT_SAME_FLOAT(0.0f, cfg.gain_extra_per_rad_s);
        ASSERT_SAME_FLOAT(0.0f, cfg.weakening);
    }
    speed_control_params_t p = scheduled();
    speed_control_config_t cfg = {0};
    p.slow_rad_s = 0.0f;
    TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &table1, PERIOD_S));
}

/* Error 1 rad/s at a filtered speed; Kp .5, Ki T .125. Twice as fast from 12 rad/s on, once at 4.
 */
static void test_the_gains_grow_with_the_speed_either_way(void)
{
    speed_control_config_t cfg = simple;
    cfg.gain_extra_per_rad_s = 0.125f;
    cfg.gain_extra_max = 1.0f;
    cfg.slow_rad_s = 4.0f;
    const float w_rad_s[] = {0.0f, 4.0f, 8.0f, 12.0f, 100.0f};
    const float faster[] = {1.0f, 1.0f, 1.5f, 2.0f, 2.0f};
    for (int sign = -1; sign <= 1; sign += 2) {
        for (unsigned k = 0; k < 5u; k++) {
            const float w = (float)sign * w_rad_s[k];
            speed_control_state_t st = {.omega_filtered_rad_s = w, .omega_ref_rad_s = w};
            const speed_control_in_t in = {
                .flux_pu = 1.0f, .inv_flux_pu = 1.0f, .omega_ref_rad_s = w + (float)sign};
            speed_control_schedule(&cfg, &st, 1.0f, 1.0f);
            ASSERT_SAME_FLOAT((float)sign * 0.5f * faster[k], step(&cfg, &st, &in, w));
            ASSERT_SAME_FLOAT((float)sign * 0.125f * faster[k] * faster[k], st.pi.x);
        }
    }
}

/* Eight times the error beside the speed, up to half of the extra gain; nothing more is expected.
 */
static void test_the_gains_grow_with_the_error_of_the_speed(void)
{
    speed_control_config_t cfg = simple;
    cfg.gain_extra_per_rad_s = 0.125f;
    cfg.gain_extra_max = 1.0f;
    cfg.slow_rad_s = 4.0f;
    static const struct {
        float w_rad_s, error_rad_s, by_speed, extra;
    } expected[] = {
        {0.0f, 0.0f, 0.0f, 0.0f}, {0.0f, 0.5f, 0.0f, 0.0f},    {0.0f, 0.75f, 0.0f, 0.25f},
        {0.0f, 9.0f, 0.0f, 0.5f}, {2.0f, 0.5f, 0.0f, 0.25f},   {6.0f, 0.125f, 0.25f, 0.375f},
        {8.0f, 9.0f, 0.5f, 0.5f}, {10.0f, 9.0f, 0.75f, 0.75f}, {12.0f, 9.0f, 1.0f, 1.0f},
    };
    for (int signs = 0; signs < 4; signs++) {
        for (unsigned k = 0; k < sizeof expected / sizeof expected[0]; k++) {
            const float w_rad_s = ((signs & 1) != 0) ? -expected[k].w_rad_s : expected[k].w_rad_s;
            const float error_rad_s =
                ((signs & 2) != 0) ? -expected[k].error_rad_s : expected[k].error_rad_s;
            speed_control_state_t st = {.omega_filtered_rad_s = w_rad_s,
                                        .omega_ref_rad_s = w_rad_s + error_rad_s};
            speed_control_schedule(&cfg, &st, 1.0f, 1.0f);
            ASSERT_SAME_FLOAT(expected[k].by_speed, st.gain_extra);
            ASSERT_SAME_FLOAT(expected[k].extra, st.gain_change);
        }
    }
}

/* With weakened flux the error's share of the gain falls as well. */
static void test_less_flux_takes_the_gain_of_an_error_back(void)
{
    speed_control_params_t p = scheduled();
    speed_control_config_t cfg;
    TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &table1, PERIOD_S));
    speed_control_state_t st = {.omega_ref_rad_s = 50.0f};
    speed_control_schedule(&cfg, &st, 1.0f, 1.0f);
    ASSERT_NEAR(1e-5, 1.5, st.gain_change);
    speed_control_schedule(&cfg, &st, 0.75f, 1.0f);
    ASSERT_NEAR(1e-5, 1.5 * (1.0 - 4.0 / 3.0 * 0.25), st.gain_change);
    speed_control_schedule(&cfg, &st, 0.1f, 1.0f); /* steering may have lowered it */
    ASSERT_NEAR(0.0, 0.0, st.gain_change);
    st.omega_ref_rad_s = 0.0f; /* without an error neither */
    speed_control_schedule(&cfg, &st, 0.1f, 1.0f);
    ASSERT_NEAR(0.0, 0.0, st.gain_change);
}

/* From 60 rad/s on 1 + gain_extra is 4 times the flux; at 30 the flux does not count. */
static void test_less_flux_takes_the_gain_back_at_high_speed(void)
{
    speed_control_params_t p = scheduled();
    speed_control_config_t cfg;
    TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &table1, PERIOD_S));
    const float flux_pu[] = {1.2f, 1.0f, 0.8f, 0.5f, 0.25f};
    const double left[] = {1.0, 1.0, 0.8, 0.5, 0.25};
    for (unsigned k = 0; k < 5u; k++) {
        speed_control_state_t st = {.omega_filtered_rad_s = -90.0f};
        speed_control_schedule(&cfg, &st, flux_pu[k], 1.0f);
        ASSERT_NEAR(1e-5, 4.0 * left[k] - 1.0, st.gain_extra);
        TEST_ASSERT_TRUE(speed_control_expected_rad_s(&cfg, &st, 2.0f) >= 0.0f);
        st.omega_filtered_rad_s = 45.0f; /* half way */
        speed_control_schedule(&cfg, &st, flux_pu[k], 1.0f);
        ASSERT_NEAR(1e-5, 1.5 - 2.0 * (1.0 - left[k]), st.gain_extra);
        st.omega_filtered_rad_s = 30.0f; /* steering may act here */
        speed_control_schedule(&cfg, &st, flux_pu[k], 1.0f);
        ASSERT_SAME_FLOAT(0.0f, st.gain_extra);
    }
}

/* Half the flux: the same torque takes twice the current, and half of the torque is left. */
static void test_less_flux_takes_more_current_within_the_same_limit(void)
{
    speed_control_state_t st = {.omega_ref_rad_s = 4.0f};
    speed_control_in_t in = {.flux_pu = 0.5f, .inv_flux_pu = 2.0f, .omega_ref_rad_s = 4.0f};
    ASSERT_SAME_FLOAT(4.0f, step(&simple, &st, &in, 0.0f));
    ASSERT_SAME_FLOAT(0.5f, st.pi.x); /* at nominal flux: asked and allowed 2 A */
    st = (speed_control_state_t){.omega_ref_rad_s = 40.0f};
    in.omega_ref_rad_s = 40.0f;
    ASSERT_SAME_FLOAT(15.0f, step(&simple, &st, &in, 0.0f));
    ASSERT_SAME_FLOAT(0.0f, st.pi.x); /* asked 20, allowed 7.5: it waits */
    st = (speed_control_state_t){.omega_ref_rad_s = -40.0f};
    in = (speed_control_in_t){
        .flux_pu = 0.5f, .inv_flux_pu = 2.0f, .omega_ref_rad_s = -40.0f, .i_d_ref_A = 15.0f};
    ASSERT_SAME_FLOAT(-8.0f, step(&simple, &st, &in, 0.0f));
}

static void test_step_holds_the_load_at_the_reference(void)
{
    const speed_control_in_t in = {
        .flux_pu = 1.0f, .inv_flux_pu = 1.0f, .omega_ref_rad_s = 60.0f, .i_d_ref_A = 5.0f};
    speed_control_state_t st = {.pi = {.x = 7.25f},
                                .omega_filtered_rad_s = 60.0f,
                                .omega_ref_rad_s = 60.0f,
                                .i_q_A = 7.25f};
    speed_control_limit(&simple, &st, &in);
    const speed_control_state_t before = st;
    ASSERT_SAME_FLOAT(7.25f, step(&simple, &st, &in, 60.0f));
    TEST_ASSERT_EQUAL_MEMORY(&before, &st, sizeof st);
}

static void test_one_step_agrees_with_double_arithmetic_on_both_machines(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = with_little_slip(m);
        const motor_t *motor = &reference_machine[m];
        const double p = (double)motor->pole_pairs;
        const double kp = 0.015 * 31.0 / (p * p * (double)motor->M_H / (double)motor->Lr_H * 0.5);
        const speed_control_in_t in = {
            .flux_pu = 1.0f, .inv_flux_pu = 1.0f, .omega_ref_rad_s = 41.0f, .i_d_ref_A = 5.0f};
        speed_control_state_t st = {
            .pi = {.x = -1.5f}, .omega_filtered_rad_s = 36.0f, .omega_ref_rad_s = 40.9f};
        speed_control_config_t cfg;
        TEST_ASSERT_TRUE(speed_control_init(&cfg, &good, &model, PERIOD_S));

        const double filtered = 36.0 + 0.2 / 3.2 * (37.5 - 36.0);
        const double error = 41.0 - filtered; /* 40.9 + .1 is within the slew step of .2 */
        const float i_q_A = step(&cfg, &st, &in, 37.5f);
        /* 40 rad/s carries 4e-6 of rounding into the error. */
        ASSERT_NEAR(1e-5, filtered, st.omega_filtered_rad_s);
        ASSERT_NEAR(1e-5, 41.0, st.omega_ref_rad_s);
        ASSERT_NEAR(1e-5, kp * error - 1.5, i_q_A);
        ASSERT_NEAR(1e-6, -1.5 + 0.25 * 31.0 * kp * 2e-4 * error, st.pi.x);
    }
}

static void test_step_is_odd(void)
{
    speed_control_state_t plus = {
        .pi = {.x = 1.5f}, .omega_filtered_rad_s = 30.0f, .omega_ref_rad_s = 33.0f};
    speed_control_state_t minus = {
        .pi = {.x = -1.5f}, .omega_filtered_rad_s = -30.0f, .omega_ref_rad_s = -33.0f};
    speed_control_in_t in = {
        .flux_pu = 1.0f, .inv_flux_pu = 1.0f, .omega_ref_rad_s = 90.0f, .i_d_ref_A = 5.0f};
    const float forward_A = step(&simple, &plus, &in, 30.5f);
    in = (speed_control_in_t){
        .flux_pu = 1.0f, .inv_flux_pu = 1.0f, .omega_ref_rad_s = -90.0f, .i_d_ref_A = 5.0f};
    ASSERT_SAME_FLOAT(-forward_A, step(&simple, &minus, &in, -30.5f));
    ASSERT_SAME_FLOAT(-plus.pi.x, minus.pi.x);
    ASSERT_SAME_FLOAT(-plus.omega_ref_rad_s, minus.omega_ref_rad_s);
}

static void test_the_reference_moves_by_the_slew_step_both_ways(void)
{
    speed_control_state_t st = {0};
    speed_control_in_t in = {.flux_pu = 1.0f, .inv_flux_pu = 1.0f, .omega_ref_rad_s = 5.0f};
    const float up_rad_s[] = {2.0f, 4.0f, 5.0f, 5.0f};
    const float down_rad_s[] = {3.0f, 1.0f, -1.0f, -3.0f, -3.5f, -3.5f};
    for (unsigned k = 0; k < 4u; k++) {
        (void)step(&simple, &st, &in, 0.0f);
        ASSERT_SAME_FLOAT(up_rad_s[k], st.omega_ref_rad_s);
    }
    in.omega_ref_rad_s = -3.5f;
    for (unsigned k = 0; k < 6u; k++) {
        (void)step(&simple, &st, &in, 0.0f);
        ASSERT_SAME_FLOAT(down_rad_s[k], st.omega_ref_rad_s);
    }
}

static void test_the_estimate_passes_a_first_order_filter(void)
{
    speed_control_config_t cfg;
    speed_control_state_t st = {0};
    const speed_control_in_t in = {.flux_pu = 1.0f, .inv_flux_pu = 1.0f};
    TEST_ASSERT_TRUE(speed_control_init(&cfg, &good, &table1, PERIOD_S));
    for (int k = 0; k < 15; k++) {
        (void)step(&cfg, &st, &in, 10.0f);
    }
    /* 15 periods are one time constant of 3 ms, stepped implicitly. */
    ASSERT_NEAR(1e-5, 10.0 * (1.0 - pow(3.0 / 3.2, 15.0)), st.omega_filtered_rad_s);
}

/* Torque current for an error that asks for more than there is. */
static float limited_A(float i_d_ref_A, float omega_ref_rad_s)
{
    speed_control_state_t st = {.omega_ref_rad_s = omega_ref_rad_s};
    const speed_control_in_t in = {.flux_pu = 1.0f,
                                   .inv_flux_pu = 1.0f,
                                   .omega_ref_rad_s = omega_ref_rad_s,
                                   .i_d_ref_A = i_d_ref_A};
    return step(&simple, &st, &in, 0.0f);
}

static void test_the_torque_current_has_its_own_limit(void)
{
    ASSERT_SAME_FLOAT(15.0f, limited_A(0.0f, 1000.0f));
    ASSERT_SAME_FLOAT(-15.0f, limited_A(0.0f, -1000.0f));
    ASSERT_SAME_FLOAT(15.0f, limited_A(8.0f, 1000.0f));
}

static void test_the_flux_current_has_priority(void)
{
    ASSERT_SAME_FLOAT(8.0f, limited_A(15.0f, 1000.0f));
    ASSERT_SAME_FLOAT(-8.0f, limited_A(15.0f, -1000.0f));
    ASSERT_SAME_FLOAT(8.0f, limited_A(-15.0f, 1000.0f));
}

/* What the limits were set to holds until they are set again; a zeroed state allows nothing. */
static void test_limits_hold_from_one_setting_to_the_next(void)
{
    speed_control_state_t st = {.omega_ref_rad_s = 1000.0f};
    speed_control_in_t in = {.flux_pu = 1.0f, .inv_flux_pu = 1.0f, .omega_ref_rad_s = 1000.0f};
    ASSERT_SAME_FLOAT(0.0f, speed_control_step(&simple, &st, &in, 0.0f));
    speed_control_limit(&simple, &st, &in);
    ASSERT_SAME_FLOAT(-15.0f, st.low_A);
    ASSERT_SAME_FLOAT(15.0f, st.high_A);
    in.i_d_ref_A = 15.0f; /* not looked at in a step */
    for (int k = 0; k < 4; k++) {
        ASSERT_SAME_FLOAT(15.0f, speed_control_step(&simple, &st, &in, 0.0f));
    }
    speed_control_limit(&simple, &st, &in);
    ASSERT_SAME_FLOAT(8.0f, speed_control_step(&simple, &st, &in, 0.0f));
}

/* Limits are kept at nominal flux: at half the flux a window of 6 A is one of 3 A, and of what the
 * current leaves, and the window, the narrower counts on either side. */
static void test_a_window_narrows_either_limit(void)
{
    const struct {
        torque_window_t window;
        float i_d_A, flux_pu, low_A, high_A;
    } cases[] = {
        {{-4.0f, 6.0f}, 0.0f, 1.0f, -4.0f, 6.0f},     /* inside */
        {{-4.0f, 6.0f}, 0.0f, 0.5f, -2.0f, 3.0f},     /* with less flux */
        {{-40.0f, 60.0f}, 0.0f, 1.0f, -15.0f, 15.0f}, /* wider than i_q_max */
        {{-40.0f, 60.0f}, 15.0f, 0.5f, -4.0f, 4.0f},  /* than what i_d leaves */
        {{-40.0f, 6.0f}, 15.0f, 1.0f, -8.0f, 6.0f},   /* one side each */
        {{-6.0f, 40.0f}, 15.0f, 1.0f, -6.0f, 8.0f},
        {{2.0f, 6.0f}, 0.0f, 1.0f, 2.0f, 6.0f}, /* a link that must not fill: it drives */
        {{-6.0f, -2.0f}, 0.0f, 1.0f, -6.0f, -2.0f},
        {{10.0f, 12.0f}, 15.0f, 0.5f, 5.0f, 5.0f}, /* beyond what i_d leaves: its lower end */
        {{-12.0f, -10.0f}, 15.0f, 0.5f, -5.0f, -5.0f},
    };
    for (size_t n = 0u; n < sizeof cases / sizeof cases[0]; n++) {
        speed_control_state_t st = {0};
        const speed_control_in_t in = {.flux_pu = cases[n].flux_pu,
                                       .inv_flux_pu = 1.0f / cases[n].flux_pu,
                                       .i_d_ref_A = cases[n].i_d_A,
                                       .window = &cases[n].window};
        speed_control_limit(&simple, &st, &in);
        ASSERT_SAME_FLOAT(cases[n].low_A, st.low_A);
        ASSERT_SAME_FLOAT(cases[n].high_A, st.high_A);
    }
}

static void test_no_torque_current_is_left_when_the_flux_takes_it_all(void)
{
    ASSERT_NEAR(0.0, 0.0, limited_A(17.0f, 1000.0f));
    ASSERT_NEAR(0.0, 0.0, limited_A(18.0f, 1000.0f));
    ASSERT_NEAR(0.0, 0.0, limited_A(NAN, 1000.0f));
    ASSERT_NEAR(0.0, 0.0, limited_A(INFINITY, -1000.0f));
}

/* The integrator waits while more is asked than allowed, and follows an error that leads back. */
static void test_the_integrator_waits_at_a_limit(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        const float s = (float)sign;
        speed_control_state_t st = {.pi = {.x = 2.0f * s}, .omega_ref_rad_s = 40.0f * s};
        speed_control_in_t in = {
            .flux_pu = 1.0f, .inv_flux_pu = 1.0f, .omega_ref_rad_s = 40.0f * s};
        ASSERT_SAME_FLOAT(15.0f * s, step(&simple, &st, &in, 0.0f)); /* asked 22 A */
        ASSERT_SAME_FLOAT(2.0f * s, st.pi.x);

        /* 14 A of load at half the flux: asked 13, allowed 7.5; the error is -2. */
        st = (speed_control_state_t){.pi = {.x = 14.0f * s}};
        in = (speed_control_in_t){.flux_pu = 0.5f, .inv_flux_pu = 2.0f};
        st.omega_filtered_rad_s = 2.0f * s;
        ASSERT_SAME_FLOAT(15.0f * s, step(&simple, &st, &in, 2.0f * s));
        ASSERT_SAME_FLOAT(7.5f * s, st.pi.x); /* no more than is allowed */
    }
}

/* Bandwidth at slow speed that slip leaves: times an inertia it is always the same. */
static double left_rad_s(const speed_control_params_t *p, const motor_model_t *model)
{
    const double slip_rad_s_per_A = (double)model->tau_per_s * (double)model->M_H / 0.5;
    const double ratio = (double)p->fast_bandwidth_rad_s / (double)p->bandwidth_rad_s;
    const double pairs = (double)model->pole_pairs;
    return 2.0 / (slip_rad_s_per_A * ratio) * pairs * pairs * (double)model->kr * 0.5 /
           (double)p->J_kg_m2;
}

/* Inertia with which slip leaves this bandwidth. */
static float J_for(double rad_s, const speed_control_params_t *p, const motor_model_t *model)
{
    return (float)((double)p->J_kg_m2 * left_rad_s(p, model) / rad_s);
}

/* A large inertia asks for a gain whose torque would slip more than the speed is off. */
static void test_the_gain_is_bounded_by_the_slip_of_its_torque(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        speed_control_params_t p = scheduled();
        p.J_kg_m2 = J_for(0.25 * (double)model.tau_per_s, &p, &model);
        speed_control_config_t cfg;
        TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &model, PERIOD_S));
        const double slip_rad_s_per_A = (double)model.tau_per_s * (double)model.M_H / 0.5;
        const double fastest = (double)cfg.pi.kp * (1.0 + (double)cfg.gain_extra_max);
        ASSERT_NEAR(1e-5, 2.0, fastest * slip_rad_s_per_A);
        /* The integrator is nearly twice as fast as the loop that is left would have it. */
        const double pairs = (double)model.pole_pairs;
        const double bandwidth_rad_s =
            (double)cfg.pi.kp * pairs * pairs * (double)model.kr * 0.5 / (double)p.J_kg_m2;
        const double lost = 1.0 - bandwidth_rad_s / (double)p.bandwidth_rad_s;
        const double factor = (double)p.ki_factor * (1.0 + lost * lost);
        ASSERT_NEAR(1e-6 * (double)cfg.pi.ki_T,
                    factor * bandwidth_rad_s * (double)cfg.pi.kp * (double)PERIOD_S,
                    (double)cfg.pi.ki_T);
    }
}

/* Below .2 Rr/Lr the bandwidth stays there, up to twice what slip leaves. */
static void test_a_loop_slower_than_the_flux_has_up_to_twice_the_gain(void)
{
    static const double left[] = {0.21, 0.16, 0.11, 0.05};
    static const double gain[] = {2.0, 2.0 * 0.2 / 0.16, 2.0 * 0.2 / 0.11, 4.0};
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        const double slip_rad_s_per_A = (double)model.tau_per_s * (double)model.M_H / 0.5;
        for (int k = 0; k < 4; k++) {
            speed_control_params_t p = scheduled();
            speed_control_config_t cfg;
            p.J_kg_m2 = J_for(left[k] * (double)model.tau_per_s, &p, &model);
            TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &model, PERIOD_S));
            ASSERT_NEAR(2e-5, gain[k],
                        (double)cfg.pi.kp * (1.0 + (double)cfg.gain_extra_max) * slip_rad_s_per_A);
        }
    }
}

/* Nine tenths of the gain fall to the bound: the loop is ten times as slow, and the filter with it.
 */
static void test_the_filter_is_slower_where_the_gain_is_bounded(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        speed_control_params_t p = scheduled();
        speed_control_config_t cfg;
        p.J_kg_m2 = J_for(0.1 * (double)p.bandwidth_rad_s, &p, &model);
        TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &model, PERIOD_S));
        const double filter_s = 0.003 + 0.35 / 124.0 * 9.0 * 0.9;
        ASSERT_NEAR(1e-7, 0.0002 / (0.0002 + filter_s), cfg.filter_gain);
    }
}

/* Runs the schedule for time_s with a torque current of amplitude_A at 60 Hz beside the load's. */
static void swing(const speed_control_config_t *cfg, speed_control_state_t *st, double amplitude_A,
                  double time_s)
{
    const double schedule_s = (double)SLOT_COUNT * (double)PERIOD_S;
    for (int k = 0; k < (int)lrint(time_s / schedule_s); k++) {
        const double turn = 6.283185307 * 60.0 * schedule_s * (double)k;
        st->i_q_A = st->pi.x + (float)(amplitude_A * sin(turn));
        speed_control_schedule(cfg, st, 1.0f, 1.0f);
    }
}

/* A loop of table1 with 10 kg m^2, which slip bounds. */
static speed_control_params_t with_large_inertia(speed_control_config_t *cfg)
{
    speed_control_params_t p = scheduled();
    p.J_kg_m2 = 10.0f;
    TEST_ASSERT_TRUE(speed_control_init(cfg, &p, &table1, PERIOD_S));
    return p;
}

/* A swing of 20 % of the largest torque current takes .7 of the gain, one of .5 % nothing. */
static void test_the_gain_falls_while_the_torque_swings(void)
{
    speed_control_config_t cfg;
    const speed_control_params_t p = with_large_inertia(&cfg);
    speed_control_state_t st = {.pi.x = 4.0f};
    swing(&cfg, &st, 0.005 * (double)p.i_q_max_A, 3.0);
    ASSERT_SAME_FLOAT(0.0f, st.gain_change);
    swing(&cfg, &st, 0.2 * (double)p.i_q_max_A, 3.0);
    ASSERT_NEAR(1e-6, -0.7, st.gain_change);
    swing(&cfg, &st, 0.0, 1.0);
    ASSERT_SAME_FLOAT(0.0f, st.gain_change);
}

/* The torque that a load step asks for is gone after some 50 ms. */
static void test_a_load_step_is_too_short_to_be_a_swing(void)
{
    speed_control_config_t cfg;
    const speed_control_params_t p = with_large_inertia(&cfg);
    speed_control_state_t st = {0};
    for (int k = 0; k < 16; k++) {
        st.i_q_A = p.i_q_max_A * (1.0f - (float)k / 16.0f);
        speed_control_schedule(&cfg, &st, 1.0f, 1.0f);
    }
    TEST_ASSERT_TRUE(st.gain_change > -0.09f);
}

/* The torque of a reference that moves is asked for: the gain stays. */
static void test_a_moving_reference_is_no_swing(void)
{
    const double schedule_s = (double)SLOT_COUNT * (double)PERIOD_S;
    speed_control_config_t cfg;
    const speed_control_params_t p = with_large_inertia(&cfg);
    speed_control_state_t st = {0};
    for (int k = 0; k < 300; k++) {
        const double asked_rad_s = 0.2 * (double)p.i_q_max_A / (double)cfg.pi.kp *
                                   sin(6.283185307 * 40.0 * schedule_s * (double)k);
        st.omega_ref_rad_s = (float)asked_rad_s;
        st.i_q_A = cfg.pi.kp * (float)asked_rad_s;
        speed_control_schedule(&cfg, &st, 1.0f, 1.0f);
        TEST_ASSERT_TRUE(st.lost < 0.05f);
    }
}

/* What a movement of .1 rad/s may ask for is taken off; the rest counts in full. */
static void test_what_a_moving_reference_asks_for_is_taken_off(void)
{
    speed_control_config_t cfg = simple;
    cfg.asked_A_per_rad_s = 8.0f;
    cfg.swing_per_A = 1.0f;
    cfg.swing_share = 0.5f;
    cfg.lost_max = 1.0f;
    const float mean = (float)SPEED_CONTROL_SWING_MEAN * 0.5f;
    static const float i_A[] = {0.7f, -0.8f, 2.8f, -2.8f, 100.0f};
    static const float swing[] = {0.0f, 0.0f, 2.0f, 2.0f, 3.0f};
    for (int k = 0; k < 5; k++) {
        speed_control_state_t st = {.lost = 0.5f, .omega_ref_rad_s = 0.1f, .i_q_A = i_A[k]};
        speed_control_schedule(&cfg, &st, 1.0f, 1.0f);
        ASSERT_NEAR(1e-6, 0.5f + mean * (0.5f * swing[k] - 1.0f), st.lost);
    }
}

/* The highest gain times the movement in 6.4 ms; in a schedule where that is longer. */
static void test_a_moving_reference_asks_for_the_highest_gain(void)
{
    static const double period_s[] = {0.0002, 0.0005};
    static const double schedules[] = {2.0, 1.0};
    for (int k = 0; k < 2; k++) {
        speed_control_params_t p = scheduled();
        speed_control_config_t cfg;
        p.J_kg_m2 = 0.01f;
        TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &table1, (float)period_s[k]));
        const double fastest =
            (double)cfg.pi.kp * (double)p.fast_bandwidth_rad_s / (double)p.bandwidth_rad_s;
        ASSERT_NEAR(1e-5 * fastest, schedules[k] * fastest, cfg.asked_A_per_rad_s);
    }
}

/* A ramp must not hide a swing: 200 min^-1/s with two pole pairs, ten times the inertia. */
static void test_a_swing_on_a_ramp_is_found(void)
{
    const double schedule_s = (double)SLOT_COUNT * (double)PERIOD_S;
    speed_control_config_t cfg;
    const speed_control_params_t p = with_large_inertia(&cfg);
    speed_control_state_t st = {0};
    for (int k = 0; k < (int)lrint(3.0 / schedule_s); k++) {
        const double turn = 6.283185307 * 17.0 * schedule_s * (double)k;
        st.omega_ref_rad_s = (float)(42.0 * schedule_s * (double)k);
        st.i_q_A = st.pi.x + (float)((double)p.i_q_max_A * sin(turn));
        speed_control_schedule(&cfg, &st, 1.0f, 1.0f);
    }
    ASSERT_NEAR(0.01, 0.7, st.lost);
}

/* Half the gain that slip allows keeps .6 of it, a quarter all. */
static void test_a_small_gain_loses_less(void)
{
    static const double share[] = {0.5, 0.25};
    static const double left[] = {0.6, 1.0};
    speed_control_params_t p = scheduled();
    speed_control_config_t cfg;
    p.J_kg_m2 = J_for(0.5 * (double)p.bandwidth_rad_s, &p, &table1);
    TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &table1, PERIOD_S));
    const double most = (double)cfg.pi.kp;
    p.J_kg_m2 = 0.001f;
    TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &table1, PERIOD_S));
    const double per_kg_m2 = (double)cfg.pi.kp / 0.001;
    for (int k = 0; k < 2; k++) {
        speed_control_state_t st = {0};
        p.J_kg_m2 = (float)(share[k] * most / per_kg_m2);
        TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &table1, PERIOD_S));
        swing(&cfg, &st, 0.2 * (double)p.i_q_max_A, 3.0);
        ASSERT_NEAR(1e-5, left[k] - 1.0, st.gain_change);
    }
}

static void test_with_one_bandwidth_a_swing_changes_nothing(void)
{
    speed_control_config_t cfg;
    speed_control_state_t st = {0};
    TEST_ASSERT_TRUE(speed_control_init(&cfg, &good, &table1, PERIOD_S));
    swing(&cfg, &st, 10.0, 1.0);
    ASSERT_SAME_FLOAT(0.0f, st.gain_change);
    ASSERT_SAME_FLOAT(0.0f, st.slow_A);
}

/* A share that is no number, or none that there is, starts again. */
static void test_a_lost_share_out_of_range_comes_back(void)
{
    static const float wrong[] = {NAN, INFINITY, -INFINITY, -5.0f};
    speed_control_params_t p = scheduled();
    speed_control_config_t cfg;
    p.J_kg_m2 = 10.0f;
    TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &table1, PERIOD_S));
    for (int i = 0; i < 4; i++) {
        speed_control_state_t st = {.lost = wrong[i]};
        speed_control_schedule(&cfg, &st, 1.0f, 1.0f);
        ASSERT_SAME_FLOAT(0.0f, st.gain_change);
    }
    speed_control_state_t st = {.lost = 5.0f};
    speed_control_schedule(&cfg, &st, 1.0f, 1.0f);
    ASSERT_NEAR(1e-6, -0.7, st.gain_change);
}

/* So large that what it asks for is no number: the filter holds. */
static void test_an_endless_inertia_stops_the_filter(void)
{
    speed_control_params_t p = scheduled();
    speed_control_config_t cfg;
    p.J_kg_m2 = FLT_MAX;
    TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &table1, PERIOD_S));
    ASSERT_SAME_FLOAT(0.0f, cfg.filter_gain);
}

/* dw_e/dt = (p^2 kr lambda/J) i_q on the reference machine, current at once; peak and final speed.
 */
static void run_up(int machine, const speed_control_config_t *cfg, float target_rad_s, int periods,
                   double *peak_rad_s, double *last_rad_s)
{
    const double kr =
        (double)reference_machine[machine].M_H / (double)reference_machine[machine].Lr_H;
    const double p = (double)reference_machine[machine].pole_pairs;
    speed_control_state_t st = {0};
    double omega_rad_s = 0.0;

    *peak_rad_s = 0.0;
    for (int k = 0; k < periods; k++) {
        const speed_control_in_t in = {.flux_pu = 1.0f,
                                       .inv_flux_pu = 1.0f,
                                       .omega_ref_rad_s = target_rad_s,
                                       .i_d_ref_A = 5.0f};
        const float i_q_A = step(cfg, &st, &in, (float)omega_rad_s);
        omega_rad_s += (double)PERIOD_S * p * p * kr * 0.5 / 0.015 * (double)i_q_A;
        *peak_rad_s = fmax(*peak_rad_s, omega_rad_s);
    }
    *last_rad_s = omega_rad_s;
}

static void test_the_loop_has_the_bandwidth_on_both_machines(void)
{
    speed_control_params_t p = good;
    p.ki_factor = 0.0f;
    p.filter_s = 0.0f;
    p.slew_rad_s2 = 1e6f;
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = with_little_slip(m);
        speed_control_config_t cfg;
        double peak_rad_s, last_rad_s;
        TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &model, PERIOD_S));
        /* 161 periods = .998 time constants; first-order lag sampled at 200 us. */
        run_up(m, &cfg, 10.0f, 161, &peak_rad_s, &last_rad_s);
        ASSERT_NEAR(1e-3, 10.0 * (1.0 - pow(1.0 - 31.0 * 2e-4, 161.0)), last_rad_s);
    }
}

static void test_the_scheduled_loop_has_the_fast_bandwidth_at_speed(void)
{
    speed_control_params_t p = scheduled();
    p.ki_factor = 0.0f;
    p.filter_s = 0.0f;
    p.slew_rad_s2 = 1e6f;
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = with_little_slip(m);
        const motor_t *motor = &reference_machine[m];
        const double kr = (double)motor->M_H / (double)motor->Lr_H;
        const double pairs = (double)motor->pole_pairs;
        /* The same current for each: acceleration grows with the square of the pole pairs. */
        const double step_rad_s = 2.5 * pairs * pairs;
        const float ref_rad_s = (float)(100.0 + step_rad_s);
        speed_control_config_t cfg;
        speed_control_state_t st = {.omega_filtered_rad_s = 100.0f, .omega_ref_rad_s = ref_rad_s};
        double w_rad_s = 100.0;
        TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &model, PERIOD_S));
        speed_control_schedule(&cfg, &st, 1.0f, 1.0f);
        for (int k = 0; k < 40; k++) {
            const speed_control_in_t in = {
                .flux_pu = 1.0f, .inv_flux_pu = 1.0f, .omega_ref_rad_s = ref_rad_s};
            w_rad_s += (double)PERIOD_S * pairs * pairs * kr * 0.5 / 0.015 *
                       (double)step(&cfg, &st, &in, (float)w_rad_s);
        }
        ASSERT_NEAR(1e-3, 100.0 + step_rad_s - step_rad_s * pow(1.0 - 124.0 * 2e-4, 40.0), w_rad_s);
    }
}

/* The integrator has nothing to unwind: what overshoots is the filter's lag. */
static void test_a_limited_run_up_overshoots_by_little(void)
{
    speed_control_params_t p = good;
    p.slew_rad_s2 = 1e6f;
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        speed_control_config_t cfg;
        double peak_rad_s, last_rad_s;
        /* Acceleration grows with the square of the pole pairs: the same time for each. */
        const float pairs = reference_machine[m].pole_pairs;
        const float target_rad_s = 75.0f * pairs * pairs;
        const double target = (double)target_rad_s;
        TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &model, PERIOD_S));
        run_up(m, &cfg, target_rad_s, 10000, &peak_rad_s, &last_rad_s);
        ASSERT_NEAR(0.1, target, last_rad_s);
        TEST_ASSERT_TRUE(peak_rad_s - target < 0.06 * target);
    }
}

static void test_an_input_that_is_no_number_leaves_the_last_one_in_force(void)
{
    for (int i = 0; i < NOT_FINITE_COUNT; i++) {
        speed_control_state_t st = {.omega_filtered_rad_s = 58.0f, .omega_ref_rad_s = 60.0f};
        const speed_control_in_t in = {
            .flux_pu = 1.0f, .inv_flux_pu = 1.0f, .omega_ref_rad_s = not_finite(i)};
        ASSERT_SAME_FLOAT(1.0f, step(&simple, &st, &in, not_finite(i)));
        ASSERT_SAME_FLOAT(60.0f, st.omega_ref_rad_s);
        ASSERT_SAME_FLOAT(58.0f, st.omega_filtered_rad_s);
    }
}

static void test_two_controllers_share_a_config_and_nothing_else(void)
{
    speed_control_state_t a = {0};
    speed_control_state_t b = {0};
    const speed_control_in_t in = {.flux_pu = 1.0f, .inv_flux_pu = 1.0f, .omega_ref_rad_s = 1.0f};
    const float first_A = step(&simple, &a, &in, 0.0f);
    ASSERT_SAME_FLOAT(first_A, step(&simple, &b, &in, 0.0f));
}

/* 1 A a period, 2 A per Nm, between -20 and 10 rad/s. */
static speed_control_config_t torque_config(void)
{
    speed_control_config_t cfg = simple;
    cfg.A_per_Nm = 2.0f;
    cfg.torque_step_A = 1.0f;
    cfg.torque_max_rad_s = 10.0f;
    cfg.torque_min_rad_s = -20.0f;
    return cfg;
}

static float torque_after(speed_control_state_t *st, float speed_rad_s, float torque_Nm, int n)
{
    const speed_control_config_t cfg = torque_config();
    const speed_control_in_t in = {.i_d_ref_A = 5.0f,
                                   .flux_pu = 1.0f,
                                   .inv_flux_pu = 1.0f,
                                   .torque = true,
                                   .torque_ref_Nm = torque_Nm};
    float i_q_A = 0.0f;
    for (int k = 0; k < n; k++) {
        i_q_A = step(&cfg, st, &in, speed_rad_s);
    }
    return i_q_A;
}

static void test_torque_becomes_current_on_its_slew(void)
{
    speed_control_state_t st = {0};
    ASSERT_SAME_FLOAT(1.0f, torque_after(&st, 1.0f, 3.0f, 1));
    ASSERT_SAME_FLOAT(4.0f, torque_after(&st, 1.0f, 3.0f, 3));
    ASSERT_SAME_FLOAT(6.0f, torque_after(&st, 1.0f, 3.0f, 9));
    ASSERT_SAME_FLOAT(5.0f, torque_after(&st, 1.0f, -3.0f, 1));
    ASSERT_SAME_FLOAT(-6.0f, torque_after(&st, 1.0f, -3.0f, 20));
    ASSERT_SAME_FLOAT(15.0f, torque_after(&st, 1.0f, 300.0f, 99)); /* the current limit */
}

static void test_torque_gives_way_at_either_speed_limit(void)
{
    /* Filtered speed far beyond: the controller brakes with all there is, whatever was asked. */
    speed_control_state_t st = {0};
    ASSERT_SAME_FLOAT(-15.0f, torque_after(&st, 100.0f, 3.0f, 60));
    st = (speed_control_state_t){0};
    ASSERT_SAME_FLOAT(15.0f, torque_after(&st, -100.0f, -3.0f, 60));
    /* Between the limits it does not act, beyond the other's either. */
    st = (speed_control_state_t){0};
    ASSERT_SAME_FLOAT(6.0f, torque_after(&st, -15.0f, 3.0f, 60));
    /* At the limit and on: what is asked against it stays what is asked. */
    st = (speed_control_state_t){0};
    ASSERT_SAME_FLOAT(-6.0f, torque_after(&st, 9.0f, -3.0f, 60));
}

/* The controller of the limit has an integrator, which waits while the current limit cuts it. */
static void test_the_speed_limit_of_torque_mode_integrates(void)
{
    const speed_control_config_t cfg = torque_config();
    const float beyond_rad_s[3] = {2.0f, 2.0f, 100.0f};
    const float change[3] = {0.0f, 1.0f, 0.0f};
    const float x_A[3] = {-0.25f, -1.0f,
                          0.0f}; /* T K_I (-2 rad/s), by the gain squared; cut at -15 A */
    for (int n = 0; n < 3; n++) {
        const float omega_rad_s = cfg.torque_max_rad_s + beyond_rad_s[n];
        speed_control_state_t st = {.omega_filtered_rad_s = omega_rad_s, .gain_change = change[n]};
        const speed_control_in_t in = {
            .flux_pu = 1.0f, .inv_flux_pu = 1.0f, .torque = true, .torque_ref_Nm = 3.0f};
        (void)step(&cfg, &st, &in, omega_rad_s);
        ASSERT_SAME_FLOAT(x_A[n], st.pi.x);
    }
}

/* The limit that counts is that of the direction it turns in, however slowly: no way forward holds
 * back nothing while it turns backward. */
static void test_the_speed_limit_is_that_of_the_direction(void)
{
    speed_control_config_t cfg = torque_config();
    cfg.torque_max_rad_s = 0.0f;
    const float speed_rad_s[] = {-0.5f, 0.5f};
    const float expected_A[] = {1.0f, 0.0f};
    for (int n = 0; n < 2; n++) {
        speed_control_state_t st = {.omega_filtered_rad_s = speed_rad_s[n]};
        const speed_control_in_t in = {
            .flux_pu = 1.0f, .inv_flux_pu = 1.0f, .torque = true, .torque_ref_Nm = 3.0f};
        const float i_q_A = step(&cfg, &st, &in, speed_rad_s[n]);
        TEST_ASSERT_TRUE(i_q_A <= expected_A[n]);
        TEST_ASSERT_TRUE(i_q_A > expected_A[n] - 0.5f);
    }
}

/* Torque and back: neither way does the current jump. */
static void test_take_over_is_smooth_both_ways(void)
{
    const speed_control_config_t cfg = torque_config();
    speed_control_state_t st = {.omega_ref_rad_s = 4.0f, .omega_filtered_rad_s = 4.0f};
    st.pi.x = 5.0f;
    const speed_control_in_t in = {
        .omega_ref_rad_s = 4.0f, .i_d_ref_A = 5.0f, .flux_pu = 1.0f, .inv_flux_pu = 1.0f};
    ASSERT_SAME_FLOAT(5.0f, step(&cfg, &st, &in, 4.0f));
    ASSERT_SAME_FLOAT(6.0f, torque_after(&st, 4.0f, 4.0f, 1));
    (void)torque_after(&st, 4.0f, 4.0f, 200);
    ASSERT_SAME_FLOAT(4.0f, st.omega_ref_rad_s);
    ASSERT_NEAR(1e-4, 8.0, step(&cfg, &st, &in, 4.0f));
}

static void test_torque_that_is_no_number_moves_nothing(void)
{
    speed_control_state_t st = {0};
    ASSERT_SAME_FLOAT(6.0f, torque_after(&st, 1.0f, 3.0f, 9));
    ASSERT_SAME_FLOAT(6.0f, torque_after(&st, 1.0f, NAN, 3));
    ASSERT_SAME_FLOAT(6.0f, torque_after(&st, NAN, 3.0f, 3));
}

static void test_less_flux_takes_more_current_for_the_torque(void)
{
    const speed_control_config_t cfg = torque_config();
    speed_control_state_t st = {.i_q_A = 4.0f};
    const speed_control_in_t in = {.i_d_ref_A = 2.0f,
                                   .flux_pu = 0.5f,
                                   .inv_flux_pu = 2.0f,
                                   .torque = true,
                                   .torque_ref_Nm = 2.0f};
    ASSERT_SAME_FLOAT(8.0f, step(&cfg, &st, &in, 0.0f));
}

static void test_init_derives_and_refuses_torque_mode(void)
{
    speed_control_config_t cfg = {0};
    TEST_ASSERT_TRUE(speed_control_init(&cfg, &good, &table1, PERIOD_S));
    const double Nm_per_A = (double)table1.pole_pairs * (double)table1.kr * (double)good.lambda_Wb;
    ASSERT_NEAR(1e-6, 1.0 / Nm_per_A, cfg.A_per_Nm);
    ASSERT_NEAR(1e-6, 100.0 * 2e-4 / Nm_per_A, cfg.torque_step_A);
    ASSERT_SAME_FLOAT(300.0f, cfg.torque_max_rad_s);
    ASSERT_SAME_FLOAT(-200.0f, cfg.torque_min_rad_s);
    const float bad[3][3] = {{-1.0f, -1.0f, 1.0f}, {1.0f, 1.0f, 1.0f}, {1.0f, -1.0f, 0.0f}};
    for (int n = 0; n < 3; n++) {
        speed_control_params_t p = good;
        p.torque_max_rad_s = bad[n][0];
        p.torque_min_rad_s = bad[n][1];
        p.torque_slew_Nm_per_s = bad[n][2];
        TEST_ASSERT_FALSE(speed_control_init(&cfg, &p, &table1, PERIOD_S));
    }
}

static void test_at_the_limit_is_within_a_twentieth_of_it(void)
{
    const struct {
        float i_q_A;
        bool at_limit;
    } cases[] = {{0.0f, false},  {9.4f, false}, {9.6f, true}, {12.0f, true},
                 {-7.5f, false}, {-7.7f, true}, {-8.0f, true}};
    for (size_t n = 0u; n < sizeof cases / sizeof cases[0]; n++) {
        const speed_control_state_t st = {.i_q_A = cases[n].i_q_A, .low_A = -8.0f, .high_A = 10.0f};
        TEST_ASSERT_EQUAL(cases[n].at_limit, speed_control_at_limit(&st));
    }
}

static void test_one_that_is_tracked_follows_the_speed(void)
{
    speed_control_state_t st = {.omega_filtered_rad_s = 31.0f, .omega_ref_rad_s = 5.0f};
    speed_control_track(&st, 2.5f);
    TEST_ASSERT_EQUAL_FLOAT(31.0f, st.omega_ref_rad_s);
    TEST_ASSERT_EQUAL_FLOAT(2.5f, st.pi.x);
    TEST_ASSERT_EQUAL_FLOAT(2.5f, st.i_q_A);
}

/* What is left beside the load accelerates, p^2 kr lambda/J, all of it where the loop is fastest.
 */
static void test_torque_beside_the_load_changes_the_speed(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = with_little_slip(m);
        const speed_control_params_t p = scheduled();
        speed_control_config_t cfg;
        TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &model, PERIOD_S));
        const double pairs = (double)model.pole_pairs;
        const double accel_rad_s2_per_A =
            pairs * pairs * (double)model.kr * (double)p.lambda_Wb / (double)p.J_kg_m2;
        speed_control_state_t st = {.pi = {.x = -1.5f}};
        const float speeds[3] = {0.0f, 0.5f * (p.slow_rad_s + p.fast_rad_s), -2.0f * p.fast_rad_s};
        const double shares[3] = {0.0, 0.5, 1.0};
        for (int k = 0; k < 3; k++) {
            st.omega_filtered_rad_s = speeds[k];
            speed_control_schedule(&cfg, &st, 1.0f, 1.0f);
            ASSERT_NEAR(1e-5, shares[k] * accel_rad_s2_per_A * (double)PERIOD_S * 3.5,
                        speed_control_expected_rad_s(&cfg, &st, 2.0f));
        }
    }
}

/* A gain below that of low speed, as a swing leaves it: no acceleration is expected, nor the
 * opposite. */
static void test_no_change_of_speed_is_expected_of_less_gain(void)
{
    const speed_control_params_t p = scheduled();
    speed_control_config_t cfg;
    TEST_ASSERT_TRUE(speed_control_init(&cfg, &p, &table1, PERIOD_S));
    speed_control_state_t st = {.gain_extra = 0.5f};
    TEST_ASSERT_TRUE(speed_control_expected_rad_s(&cfg, &st, 2.0f) > 0.0f);
    st.gain_extra = -0.5f;
    ASSERT_SAME_FLOAT(0.0f, speed_control_expected_rad_s(&cfg, &st, 2.0f));
}

/* Whoever else sets the torque current: nobody knows what is left to accelerate. */
static void test_no_change_of_speed_is_expected_unless_the_controller_acts(void)
{
    const speed_control_state_t acted = {.i_q_A = 2.0f, .expected_step_rad_s = 0.3f};
    speed_control_state_t st = acted;
    speed_control_track(&st, 2.5f);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.expected_step_rad_s);
    st = acted;
    speed_control_wait(&st, 31.0f);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.expected_step_rad_s);
    st = acted;
    speed_control_seed(&simple, &st, 2.5f, 5.0f, 31.0f);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.expected_step_rad_s);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_at_the_limit_is_within_a_twentieth_of_it);
    RUN_TEST(test_one_that_is_tracked_follows_the_speed);
    RUN_TEST(test_torque_beside_the_load_changes_the_speed);
    RUN_TEST(test_no_change_of_speed_is_expected_of_less_gain);
    RUN_TEST(test_no_change_of_speed_is_expected_unless_the_controller_acts);
    RUN_TEST(test_init_derives_the_gains_of_both_machines);
    RUN_TEST(test_init_takes_the_square_of_the_pole_pairs);
    RUN_TEST(test_init_refuses_every_bad_number_and_leaves_the_config);
    RUN_TEST(test_init_refuses_wrong_signs_that_cancel);
    RUN_TEST(test_init_accepts_no_integral_action_and_no_filter);
    RUN_TEST(test_init_derives_the_schedule);
    RUN_TEST(test_bounded_by_slip_the_gain_falls_as_the_square_of_weakened_flux);
    RUN_TEST(test_with_room_to_the_bound_the_gain_falls_as_the_flux);
    RUN_TEST(test_init_refuses_a_schedule_the_wrong_way_round);
    RUN_TEST(test_a_fast_bandwidth_that_is_not_faster_is_no_schedule);
    RUN_TEST(test_the_gains_grow_with_the_speed_either_way);
    RUN_TEST(test_the_gains_grow_with_the_error_of_the_speed);
    RUN_TEST(test_less_flux_takes_the_gain_of_an_error_back);
    RUN_TEST(test_less_flux_takes_the_gain_back_at_high_speed);
    RUN_TEST(test_less_flux_takes_more_current_within_the_same_limit);
    RUN_TEST(test_step_holds_the_load_at_the_reference);
    RUN_TEST(test_one_step_agrees_with_double_arithmetic_on_both_machines);
    RUN_TEST(test_step_is_odd);
    RUN_TEST(test_the_reference_moves_by_the_slew_step_both_ways);
    RUN_TEST(test_the_estimate_passes_a_first_order_filter);
    RUN_TEST(test_the_torque_current_has_its_own_limit);
    RUN_TEST(test_the_flux_current_has_priority);
    RUN_TEST(test_limits_hold_from_one_setting_to_the_next);
    RUN_TEST(test_a_window_narrows_either_limit);
    RUN_TEST(test_no_torque_current_is_left_when_the_flux_takes_it_all);
    RUN_TEST(test_the_integrator_waits_at_a_limit);
    RUN_TEST(test_the_gain_is_bounded_by_the_slip_of_its_torque);
    RUN_TEST(test_a_loop_slower_than_the_flux_has_up_to_twice_the_gain);
    RUN_TEST(test_the_filter_is_slower_where_the_gain_is_bounded);
    RUN_TEST(test_the_gain_falls_while_the_torque_swings);
    RUN_TEST(test_a_load_step_is_too_short_to_be_a_swing);
    RUN_TEST(test_a_moving_reference_is_no_swing);
    RUN_TEST(test_what_a_moving_reference_asks_for_is_taken_off);
    RUN_TEST(test_a_moving_reference_asks_for_the_highest_gain);
    RUN_TEST(test_a_swing_on_a_ramp_is_found);
    RUN_TEST(test_a_small_gain_loses_less);
    RUN_TEST(test_with_one_bandwidth_a_swing_changes_nothing);
    RUN_TEST(test_a_lost_share_out_of_range_comes_back);
    RUN_TEST(test_an_endless_inertia_stops_the_filter);
    RUN_TEST(test_the_loop_has_the_bandwidth_on_both_machines);
    RUN_TEST(test_the_scheduled_loop_has_the_fast_bandwidth_at_speed);
    RUN_TEST(test_a_limited_run_up_overshoots_by_little);
    RUN_TEST(test_an_input_that_is_no_number_leaves_the_last_one_in_force);
    RUN_TEST(test_two_controllers_share_a_config_and_nothing_else);
    RUN_TEST(test_torque_becomes_current_on_its_slew);
    RUN_TEST(test_torque_gives_way_at_either_speed_limit);
    RUN_TEST(test_the_speed_limit_of_torque_mode_integrates);
    RUN_TEST(test_the_speed_limit_is_that_of_the_direction);
    RUN_TEST(test_take_over_is_smooth_both_ways);
    RUN_TEST(test_torque_that_is_no_number_moves_nothing);
    RUN_TEST(test_less_flux_takes_more_current_for_the_torque);
    RUN_TEST(test_init_derives_and_refuses_torque_mode);
    return UNITY_END();
}
