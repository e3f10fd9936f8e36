/* The measurement alone, and on a winding with dead time and sensor offsets in double precision. */
#include "rs_measurement.h"

#include <float.h>
#include <math.h>

#include "exact.h"
#include "reference_machine.h"
#include "unity.h"

#define PERIOD_S   0.0002f
#define RS_ohm     1.0f    /* nameplate */
#define LEGS       1.63299 /* Clarke of the legs' signs + - -: 2 sqrt(2/3) */
#define REF_LOST_V 2.74

static const rs_measurement_params_t good = {.enable = true,
                                             .high_A = 8.0f,
                                             .low_A = 5.0f,
                                             .level_s = 1.5f,
                                             .average_s = 0.3f,
                                             .bias = 1.02f,
                                             .ratio_max = 2.0f};

/* Levels of four periods, the last two averaged. */
static const rs_measurement_config_t simple = {.high_A = 6.0f,
                                               .low_A = 2.0f,
                                               .level_periods = 4u,
                                               .average_periods = 2u,
                                               .bias = 1.25f,
                                               .Rs_min_ohm = 0.5f,
                                               .Rs_max_ohm = 2.0f};

static rs_measurement_config_t cfg;
static rs_measurement_state_t st;

void setUp(void)
{
    cfg = (rs_measurement_config_t){0};
    st = (rs_measurement_state_t){0};
}

void tearDown(void)
{
}

static rs_measurement_out_t step(float i_A, float u_V, float u_duty_V)
{
    const rs_measurement_in_t in = {.i_A = i_A, .u_V = u_V, .u_duty_V = u_duty_V};
    return rs_measurement_step(&cfg, &st, &in);
}

/* The two levels of `simple` at constant values, and what comes of them. */
static rs_measurement_out_t measured(rs_measurement_in_t high, rs_measurement_in_t low)
{
    cfg = simple;
    st = (rs_measurement_state_t){0};
    for (int k = 0; k < 8; k++) {
        const rs_measurement_in_t *in = (k < 4) ? &high : &low;
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_BUSY, rs_measurement_step(&cfg, &st, in).status);
    }
    return rs_measurement_step(&cfg, &st, &low);
}

static void test_init_derives_counts_and_limits(void)
{
    TEST_ASSERT_TRUE(rs_measurement_init(&cfg, &good, RS_ohm, PERIOD_S));
    ASSERT_SAME_FLOAT(8.0f, cfg.high_A);
    ASSERT_SAME_FLOAT(5.0f, cfg.low_A);
    TEST_ASSERT_EQUAL_UINT32(7500u, cfg.level_periods);
    TEST_ASSERT_EQUAL_UINT32(1500u, cfg.average_periods);
    ASSERT_SAME_FLOAT(1.02f, cfg.bias);
    ASSERT_SAME_FLOAT(0.5f, cfg.Rs_min_ohm);
    ASSERT_SAME_FLOAT(2.0f, cfg.Rs_max_ohm);
}

static void test_init_rounds_to_whole_periods(void)
{
    rs_measurement_params_t p = good;
    p.level_s = 1.0f;
    p.average_s = 0.625f;
    TEST_ASSERT_TRUE(rs_measurement_init(&cfg, &p, RS_ohm, 0.25f));
    TEST_ASSERT_EQUAL_UINT32(4u, cfg.level_periods);
    TEST_ASSERT_EQUAL_UINT32(3u, cfg.average_periods);
    p.level_s = 0.625f; /* 2.5 */
    p.average_s = 0.3675f;
    TEST_ASSERT_TRUE(rs_measurement_init(&cfg, &p, RS_ohm, 0.25f));
    TEST_ASSERT_EQUAL_UINT32(3u, cfg.level_periods);
    TEST_ASSERT_EQUAL_UINT32(1u, cfg.average_periods); /* 1.47 */
    p.level_s = 0.6175f;
    TEST_ASSERT_TRUE(rs_measurement_init(&cfg, &p, RS_ohm, 0.25f));
    TEST_ASSERT_EQUAL_UINT32(2u, cfg.level_periods); /* 2.47 */
}

#define ASSERT_REFUSED(field, value)                                                               \
    do {                                                                                           \
        rs_measurement_params_t bad = good;                                                        \
        bad.field = (value);                                                                       \
        TEST_ASSERT_FALSE_MESSAGE(rs_measurement_init(&cfg, &bad, RS_ohm, PERIOD_S), #field);      \
    } while (0)

static void test_init_refuses_every_bad_number(void)
{
    for (int i = 0; i < NOT_POSITIVE_COUNT; i++) {
        const float x = not_positive(i);
        ASSERT_REFUSED(high_A, x);
        ASSERT_REFUSED(low_A, x);
        ASSERT_REFUSED(level_s, x);
        ASSERT_REFUSED(average_s, x);
        ASSERT_REFUSED(bias, x);
        ASSERT_REFUSED(ratio_max, x);
        TEST_ASSERT_FALSE(rs_measurement_init(&cfg, &good, x, PERIOD_S));
        TEST_ASSERT_FALSE(rs_measurement_init(&cfg, &good, RS_ohm, x));
    }
    ASSERT_REFUSED(low_A, 8.0f);
    ASSERT_REFUSED(small_A, 5.0f);
    ASSERT_REFUSED(small_A, NAN);
    ASSERT_REFUSED(ratio_max, 1.0f);
    ASSERT_REFUSED(average_s, 0.00019f);
    ASSERT_REFUSED(average_s, 1.51f);
    ASSERT_REFUSED(level_s, 0.29f);
    ASSERT_REFUSED(level_s, 200.1f); /* more than a million periods */
}

/* 8192 periods sum to some 2^16 A and V, where a float still has steps of 2^-8: .1 % of Rs. */
static void test_init_refuses_an_average_that_a_float_cannot_sum(void)
{
    rs_measurement_params_t p = good;
    p.level_s = 4.0f;
    p.average_s = 2.0f;
    TEST_ASSERT_TRUE(rs_measurement_init(&cfg, &p, RS_ohm, 1.0f / 4096.0f));
    p.average_s = 2.001f;
    TEST_ASSERT_FALSE(rs_measurement_init(&cfg, &p, RS_ohm, 1.0f / 4096.0f));
}

static void test_init_accepts_the_ends_of_the_ranges(void)
{
    rs_measurement_params_t p = good;
    p.level_s = 1000000.0f / 4096.0f;
    TEST_ASSERT_TRUE(rs_measurement_init(&cfg, &p, RS_ohm, 1.0f / 4096.0f));
    TEST_ASSERT_EQUAL_UINT32(1000000u, cfg.level_periods);
    p.level_s = PERIOD_S;
    p.average_s = PERIOD_S;
    p.ratio_max = nextafterf(1.0f, 2.0f);
    TEST_ASSERT_TRUE(rs_measurement_init(&cfg, &p, RS_ohm, PERIOD_S));
    TEST_ASSERT_EQUAL_UINT32(1u, cfg.level_periods);
    TEST_ASSERT_EQUAL_UINT32(1u, cfg.average_periods);
}

static void test_switched_off_nothing_is_looked_at_and_nothing_is_asked(void)
{
    const rs_measurement_params_t off = {.enable = false, .high_A = NAN, .level_s = -1.0f};
    cfg = simple;
    TEST_ASSERT_TRUE(rs_measurement_init(&cfg, &off, NAN, 0.0f));
    TEST_ASSERT_EQUAL_MEMORY(&(rs_measurement_config_t){0}, &cfg, sizeof cfg);
    for (int k = 0; k < 3; k++) {
        const rs_measurement_out_t out = step(8.0f, 8.0f, 8.0f);
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_IDLE, out.status);
        ASSERT_SAME_FLOAT(0.0f, out.i_ref_A);
        ASSERT_SAME_FLOAT(0.0f, st.high.i_A);
    }
}

static void test_step_asks_for_both_levels_in_turn_and_averages_their_ends(void)
{
    cfg = simple;
    for (int k = 0; k < 8; k++) {
        const float x = (float)(1 << k);
        const rs_measurement_out_t out = step(x, 1000.0f * x, 0.5f * x);
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_BUSY, out.status);
        ASSERT_SAME_FLOAT((k < 4) ? 6.0f : 2.0f, out.i_ref_A);
    }
    ASSERT_SAME_FLOAT(4.0f + 8.0f, st.high.i_A);
    ASSERT_SAME_FLOAT(4000.0f + 8000.0f, st.high.u_V);
    ASSERT_SAME_FLOAT(2.0f + 4.0f, st.high.u_duty_V);
    ASSERT_SAME_FLOAT(64.0f + 128.0f, st.low.i_A);
    ASSERT_SAME_FLOAT(64000.0f + 128000.0f, st.low.u_V);
    ASSERT_SAME_FLOAT(32.0f + 64.0f, st.low.u_duty_V);
}

static void test_result_is_the_ratio_of_differences_with_bias_and_the_legs_loss(void)
{
    /* Rs 1.5 ohm, half a volt of offset; 12 V of duty for 9 V at the winding. */
    const rs_measurement_out_t out = measured((rs_measurement_in_t){6.0f, 9.5f, 12.0f},
                                              (rs_measurement_in_t){2.0f, 3.5f, 100.0f});
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_DONE, out.status);
    ASSERT_SAME_FLOAT(1.5f * 1.25f, out.Rs_ohm);
    ASSERT_NEAR(1e-5, (12.0 - 1.5 * 6.0) / LEGS, out.lost_V);
    ASSERT_SAME_FLOAT(0.0f, out.i_ref_A);
}

static void test_result_comes_once(void)
{
    (void)measured((rs_measurement_in_t){6.0f, 6.0f, 6.0f},
                   (rs_measurement_in_t){2.0f, 2.0f, 2.0f});
    for (int k = 0; k < 3; k++) {
        const rs_measurement_state_t before = st;
        const rs_measurement_out_t out = step(6.0f, 6.0f, 6.0f);
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_IDLE, out.status);
        ASSERT_SAME_FLOAT(0.0f, out.Rs_ohm);
        TEST_ASSERT_EQUAL_MEMORY(&before, &st, sizeof st);
    }
}

/* The small current is the second of three; leg u carries sqrt(2/3) of it. */
static rs_measurement_out_t with_small(float small_A, float share)
{
    const float lost_V = 2.0f;
    const float lost_alpha_V = (float)LEGS * lost_V;
    cfg = simple;
    cfg.small_A = small_A;
    st = (rs_measurement_state_t){0};
    const float level_A[3] = {6.0f, small_A, 2.0f};
    for (int k = 0; k < 12; k++) {
        const float i_A = level_A[k / 4];
        const float here_V = ((k / 4) == 1) ? (share * lost_alpha_V) : lost_alpha_V;
        const rs_measurement_out_t busy = step(i_A, 1.5f * i_A, 1.5f * i_A + here_V);
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_BUSY, busy.status);
        ASSERT_SAME_FLOAT(i_A, busy.i_ref_A);
    }
    const rs_measurement_out_t out = step(2.0f, 3.0f, 3.0f);
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_DONE, out.status);
    ASSERT_NEAR(1e-5, lost_V, out.lost_V);
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_IDLE, step(2.0f, 3.0f, 3.0f).status);
    return out;
}

static void test_the_small_current_tells_from_where_on_the_loss_is_whole(void)
{
    const double leg_A = 0.3 * sqrt(2.0 / 3.0);
    for (int k = 1; k <= 7; k++) { /* thresholds from x on: share .75 x/threshold */
        const double threshold_A = leg_A * (1.0 + 0.3 * k);
        if (threshold_A < 0.5 * sqrt(2.0 / 3.0) * 2.0) {
            const rs_measurement_out_t out = with_small(0.3f, (float)(0.75 * leg_A / threshold_A));
            ASSERT_NEAR(1e-5, threshold_A, out.threshold_A);
        }
    }
    /* All of it is there: below x/2, and .75 x is what comes out. */
    ASSERT_NEAR(1e-5, 0.75 * leg_A, with_small(0.3f, 1.0f).threshold_A);
}

/* Nothing there, less than nothing: as at the lower level, where it is whole in every leg. */
static void test_a_threshold_is_at_most_the_lower_levels_leg_current(void)
{
    const double most_A = 0.5 * sqrt(2.0 / 3.0) * 2.0;
    ASSERT_NEAR(1e-5, most_A, with_small(0.3f, 0.0f).threshold_A);
    ASSERT_NEAR(1e-5, most_A, with_small(0.3f, -0.5f).threshold_A);
    /* Twice the least share that is believed. */
    ASSERT_NEAR(1e-5, 0.75 * 0.01 * sqrt(2.0 / 3.0) / 0.1, with_small(0.01f, 0.1f).threshold_A);
    ASSERT_NEAR(1e-5, 0.75 * 0.01 * sqrt(2.0 / 3.0) / 0.05, with_small(0.01f, 0.0f).threshold_A);
}

static void test_without_a_small_current_or_a_loss_no_threshold_is_found(void)
{
    const rs_measurement_out_t plain =
        measured((rs_measurement_in_t){6.0f, 9.5f, 12.0f}, (rs_measurement_in_t){2.0f, 3.5f, 9.0f});
    ASSERT_SAME_FLOAT(0.0f, plain.threshold_A);
    cfg = simple;
    cfg.small_A = 0.3f;
    st = (rs_measurement_state_t){0};
    for (int k = 0; k < 12; k++) {
        const float i_A = (k < 4) ? 6.0f : ((k < 8) ? 0.3f : 2.0f);
        (void)step(i_A, 1.5f * i_A, i_A);
    }
    const rs_measurement_out_t out = step(2.0f, 3.0f, 3.0f);
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_DONE, out.status);
    ASSERT_SAME_FLOAT(0.0f, out.lost_V);
    ASSERT_SAME_FLOAT(0.0f, out.threshold_A);
}

static void test_offsets_of_current_and_voltage_do_not_matter(void)
{
    const rs_measurement_out_t plain =
        measured((rs_measurement_in_t){6.0f, 6.0f, 6.0f}, (rs_measurement_in_t){2.0f, 2.0f, 2.0f});
    const rs_measurement_out_t moved = measured((rs_measurement_in_t){6.5f, 5.25f, 6.0f},
                                                (rs_measurement_in_t){2.5f, 1.25f, 2.0f});
    ASSERT_SAME_FLOAT(plain.Rs_ohm, moved.Rs_ohm);
}

static void test_twice_the_voltage_is_twice_the_resistance_and_loss(void)
{
    const rs_measurement_out_t once =
        measured((rs_measurement_in_t){6.0f, 4.0f, 6.0f}, (rs_measurement_in_t){2.0f, 1.0f, 2.0f});
    const rs_measurement_out_t twice =
        measured((rs_measurement_in_t){6.0f, 8.0f, 12.0f}, (rs_measurement_in_t){2.0f, 2.0f, 4.0f});
    ASSERT_SAME_FLOAT(2.0f * once.Rs_ohm, twice.Rs_ohm);
    ASSERT_SAME_FLOAT(2.0f * once.lost_V, twice.lost_V);
}

static void test_a_loss_below_zero_is_none(void)
{
    const rs_measurement_out_t out =
        measured((rs_measurement_in_t){6.0f, 6.0f, 5.0f}, (rs_measurement_in_t){2.0f, 2.0f, 2.0f});
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_DONE, out.status);
    ASSERT_SAME_FLOAT(0.0f, out.lost_V);
}

/* Status of a measurement whose resistance comes out as given. */
static rs_measurement_out_t of_resistance(float measured_ohm)
{
    return measured((rs_measurement_in_t){6.0f, 6.0f * measured_ohm, 6.0f},
                    (rs_measurement_in_t){2.0f, 2.0f * measured_ohm, 2.0f});
}

static void test_limits_hold_for_the_measured_value_and_belong_to_the_range(void)
{
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_DONE, of_resistance(0.5f).status);
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_DONE, of_resistance(2.0f).status);
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_REFUSED, of_resistance(0.498046875f).status);
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_REFUSED, of_resistance(2.001953125f).status);
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_REFUSED, of_resistance(-1.0f).status);
}

static void test_a_refusal_stays_and_shows_what_was_measured(void)
{
    rs_measurement_out_t out = of_resistance(2.25f);
    for (int k = 0; k < 5; k++) {
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_REFUSED, out.status);
        ASSERT_SAME_FLOAT(2.25f, out.Rs_ohm);
        ASSERT_SAME_FLOAT(0.0f, out.lost_V);
        ASSERT_SAME_FLOAT(0.0f, out.i_ref_A);
        out = step(6.0f, 6.0f, 6.0f);
    }
}

static void test_less_than_half_the_current_step_is_an_open_phase(void)
{
    const rs_measurement_in_t low = {2.0f, 2.0f, 2.0f};
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_DONE,
                          measured((rs_measurement_in_t){4.0f, 4.0f, 4.0f}, low).status);
    const rs_measurement_out_t out =
        measured((rs_measurement_in_t){3.9921875f, 3.9921875f, 4.0f}, low);
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_REFUSED, out.status);
    ASSERT_SAME_FLOAT(0.0f, out.Rs_ohm);
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_REFUSED, measured(low, low).status);
}

static void test_no_number_is_refused_or_harmless(void)
{
    const rs_measurement_in_t low = {2.0f, 2.0f, 2.0f};
    for (int i = 0; i < NOT_FINITE_COUNT; i++) {
        const float x = not_finite(i);
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_REFUSED,
                              measured((rs_measurement_in_t){x, 6.0f, 6.0f}, low).status);
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_REFUSED,
                              measured((rs_measurement_in_t){6.0f, x, 6.0f}, low).status);
    }
    /* The duties do not decide on Rs; a NaN there is no loss. */
    const rs_measurement_out_t out = measured((rs_measurement_in_t){6.0f, 6.0f, NAN}, low);
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_DONE, out.status);
    ASSERT_SAME_FLOAT(0.0f, out.lost_V);
}

/* Winding with rotor flux behind an inverter that loses REF_LOST_V per leg, current controlled
 * with a lag of 2 ms; sensors with offsets. What the duties give is u plus the loss. */
static rs_measurement_out_t on_a_motor(int machine, double Rs_true_ohm, bool u_from_duty)
{
    const reference_model_t exact = reference_model(&reference_machine[machine], 0.0);
    const double M_H = (double)reference_machine[machine].M_H;
    const double kr = M_H / (double)reference_machine[machine].Lr_H;
    const double T = (double)PERIOD_S, lag_s = 2e-3;
    double i_A = 0.0, lambda_Wb = 0.0, i_ref_A = 0.0;
    TEST_ASSERT_TRUE(rs_measurement_init(&cfg, &good, reference_machine[machine].Rs_ohm, PERIOD_S));
    st = (rs_measurement_state_t){0};
    for (int k = 0; k < 15000; k++) {
        const double di_A_per_s = (i_ref_A - i_A) / lag_s;
        const double dl_V = exact.tau * (M_H * i_A - lambda_Wb);
        const double u_V = Rs_true_ohm * i_A + exact.sigma_Ls * di_A_per_s + kr * dl_V;
        const double duty_V = u_V + LEGS * REF_LOST_V * fmax(-1.0, fmin(1.0, i_A / 0.5));
        i_A += T * di_A_per_s;
        lambda_Wb += T * dl_V;
        const rs_measurement_out_t out =
            step((float)(i_A + 0.03), (float)(u_from_duty ? duty_V : (u_V - 0.05)), (float)duty_V);
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_BUSY, out.status);
        i_ref_A = (double)out.i_ref_A;
    }
    return step(0.0f, 0.0f, 0.0f);
}

/* What the flux, still moving while it is averaged, adds: kr tau M i e^{-tau t} after steps of 8
 * and -3 A, both upwards, over 3 A. */
static double unsettled_ohm(int machine)
{
    const double tau = reference_model(&reference_machine[machine], 0.0).tau;
    const double M_H = (double)reference_machine[machine].M_H;
    const double kr = M_H / (double)reference_machine[machine].Lr_H;
    const double mean = (exp(-1.2 * tau) - exp(-1.5 * tau)) / (0.3 * tau);
    return kr * tau * M_H * mean * (8.0 + 3.0) / 3.0;
}

static void test_the_resistance_of_both_machines_is_found_behind_dead_time_and_offsets(void)
{
    const double ratio[] = {0.67, 0.8, 1.0, 1.25, 1.5};
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        for (unsigned k = 0; k < 5u; k++) {
            for (int from_duty = 0; from_duty < 2; from_duty++) {
                const double Rs_ohm = ratio[k] * (double)reference_machine[m].Rs_ohm;
                const rs_measurement_out_t out = on_a_motor(m, Rs_ohm, from_duty != 0);
                TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_DONE, out.status);
                /* To a few roundings of sums of 12 000 A and V, but for the flux. */
                ASSERT_NEAR(3e-4 * Rs_ohm, 1.02 * (Rs_ohm + unsettled_ohm(m)), out.Rs_ohm);
                TEST_ASSERT_TRUE(unsettled_ohm(m) < 0.005 * Rs_ohm);
                /* 30 mA and .1 % of Rs at 8 A. */
                ASSERT_NEAR(0.04, REF_LOST_V, out.lost_V);
            }
        }
    }
}

static void test_two_measurements_share_a_config_and_nothing_else(void)
{
    cfg = simple;
    rs_measurement_state_t other = {0};
    const rs_measurement_state_t untouched = other;
    (void)step(6.0f, 6.0f, 6.0f);
    TEST_ASSERT_EQUAL_MEMORY(&untouched, &other, sizeof other);
    const rs_measurement_in_t in = {6.0f, 6.0f, 6.0f};
    (void)rs_measurement_step(&cfg, &other, &in);
    TEST_ASSERT_EQUAL_MEMORY(&st, &other, sizeof other);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_derives_counts_and_limits);
    RUN_TEST(test_init_rounds_to_whole_periods);
    RUN_TEST(test_init_refuses_every_bad_number);
    RUN_TEST(test_init_refuses_an_average_that_a_float_cannot_sum);
    RUN_TEST(test_init_accepts_the_ends_of_the_ranges);
    RUN_TEST(test_switched_off_nothing_is_looked_at_and_nothing_is_asked);
    RUN_TEST(test_step_asks_for_both_levels_in_turn_and_averages_their_ends);
    RUN_TEST(test_result_is_the_ratio_of_differences_with_bias_and_the_legs_loss);
    RUN_TEST(test_result_comes_once);
    RUN_TEST(test_the_small_current_tells_from_where_on_the_loss_is_whole);
    RUN_TEST(test_a_threshold_is_at_most_the_lower_levels_leg_current);
    RUN_TEST(test_without_a_small_current_or_a_loss_no_threshold_is_found);
    RUN_TEST(test_offsets_of_current_and_voltage_do_not_matter);
    RUN_TEST(test_twice_the_voltage_is_twice_the_resistance_and_loss);
    RUN_TEST(test_a_loss_below_zero_is_none);
    RUN_TEST(test_limits_hold_for_the_measured_value_and_belong_to_the_range);
    RUN_TEST(test_a_refusal_stays_and_shows_what_was_measured);
    RUN_TEST(test_less_than_half_the_current_step_is_an_open_phase);
    RUN_TEST(test_no_number_is_refused_or_harmless);
    RUN_TEST(test_the_resistance_of_both_machines_is_found_behind_dead_time_and_offsets);
    RUN_TEST(test_two_measurements_share_a_config_and_nothing_else);
    return UNITY_END();
}
