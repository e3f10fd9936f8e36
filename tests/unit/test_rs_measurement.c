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
                                             .level = {{5.0f, 0.0f, 3.0f, 8.0f}},
                                             .level_s = 1.5f,
                                             .average_s = 0.3f,
                                             .bias = 1.02f,
                                             .ratio_max = 2.0f};

/* Levels of four periods, the last two averaged. */
static const rs_measurement_config_t simple = {.level = {{2.0f, 0.3f, 1.5f, 6.0f}},
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

/* Bend begins with a window of the guard, at once. */
static rs_measurement_out_t step(float i_A, float u_V, float u_duty_V)
{
    const uint32_t periods = (cfg.level_periods > 0u) ? cfg.level_periods : 1u;
    const bool bend = cfg.curve && ((st.periods / periods) == (uint32_t)RS_LEVEL_BEND);
    const uint32_t slot = bend ? (SLOT_GUARD_CURRENT - 1u + (st.periods % periods)) : st.periods;
    const rs_measurement_in_t in = {
        .i_A = i_A, .u_V = u_V, .u_duty_V = u_duty_V, .slot = slot % SLOT_COUNT};
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
    ASSERT_SAME_FLOAT(8.0f, cfg.level.A[RS_LEVEL_HIGH]);
    ASSERT_SAME_FLOAT(5.0f, cfg.level.A[RS_LEVEL_LOW]);
    ASSERT_SAME_FLOAT(3.0f, cfg.level.A[RS_LEVEL_BEND]);
    TEST_ASSERT_FALSE(cfg.curve);
    TEST_ASSERT_FALSE(cfg.by_duty);
    ASSERT_SAME_FLOAT(0.8f, cfg.dither_A);
    ASSERT_SAME_FLOAT(4.0f / 1500.0f, cfg.dither_turns);
    TEST_ASSERT_EQUAL_UINT32(7500u, cfg.level_periods);
    TEST_ASSERT_EQUAL_UINT32(1500u, cfg.average_periods);
    ASSERT_SAME_FLOAT(1.02f, cfg.bias);
    ASSERT_SAME_FLOAT(0.5f, cfg.Rs_min_ohm);
    ASSERT_SAME_FLOAT(2.0f, cfg.Rs_max_ohm);
    rs_measurement_params_t p = good;
    p.level.A[RS_LEVEL_SMALL] = 0.5f;
    p.by_duty = true;
    TEST_ASSERT_TRUE(rs_measurement_init(&cfg, &p, RS_ohm, PERIOD_S));
    ASSERT_SAME_FLOAT(0.5f, cfg.level.A[RS_LEVEL_SMALL]);
    TEST_ASSERT_TRUE(cfg.curve);
    TEST_ASSERT_TRUE(cfg.by_duty);
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
        ASSERT_REFUSED(level.A[RS_LEVEL_HIGH], x);
        ASSERT_REFUSED(level.A[RS_LEVEL_LOW], x);
        ASSERT_REFUSED(level_s, x);
        ASSERT_REFUSED(average_s, x);
        ASSERT_REFUSED(bias, x);
        ASSERT_REFUSED(ratio_max, x);
        TEST_ASSERT_FALSE(rs_measurement_init(&cfg, &good, x, PERIOD_S));
        TEST_ASSERT_FALSE(rs_measurement_init(&cfg, &good, RS_ohm, x));
    }
    ASSERT_REFUSED(level.A[RS_LEVEL_LOW], 8.0f);
    ASSERT_REFUSED(level.A[RS_LEVEL_BEND], 5.0f);
    ASSERT_REFUSED(level.A[RS_LEVEL_BEND], NAN);
    ASSERT_REFUSED(level.A[RS_LEVEL_SMALL], 3.0f);
    ASSERT_REFUSED(level.A[RS_LEVEL_SMALL], NAN);
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
    const rs_measurement_params_t off = {.enable = false, .bias = NAN, .level_s = -1.0f};
    cfg = simple;
    TEST_ASSERT_TRUE(rs_measurement_init(&cfg, &off, NAN, 0.0f));
    TEST_ASSERT_EQUAL_MEMORY(&(rs_measurement_config_t){0}, &cfg, sizeof cfg);
    for (int k = 0; k < 3; k++) {
        const rs_measurement_out_t out = step(8.0f, 8.0f, 8.0f);
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_IDLE, out.status);
        ASSERT_SAME_FLOAT(0.0f, out.i_ref_A);
        ASSERT_SAME_FLOAT(0.0f, st.level[RS_LEVEL_HIGH].i_A);
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
    ASSERT_SAME_FLOAT(4.0f + 8.0f, st.level[RS_LEVEL_HIGH].i_A);
    ASSERT_SAME_FLOAT(4000.0f + 8000.0f, st.level[RS_LEVEL_HIGH].u_V);
    ASSERT_SAME_FLOAT(2.0f + 4.0f, st.level[RS_LEVEL_HIGH].u_duty_V);
    ASSERT_SAME_FLOAT(64.0f + 128.0f, st.level[RS_LEVEL_LOW].i_A);
    ASSERT_SAME_FLOAT(64000.0f + 128000.0f, st.level[RS_LEVEL_LOW].u_V);
    ASSERT_SAME_FLOAT(32.0f + 64.0f, st.level[RS_LEVEL_LOW].u_duty_V);
}

static void test_result_is_the_ratio_of_differences_with_bias_and_the_legs_loss(void)
{
    /* Rs 1.5 ohm, half a volt of offset; 12 V of duty for 9 V at the winding. */
    const rs_measurement_out_t out = measured((rs_measurement_in_t){6.0f, 9.5f, 12.0f, 0u},
                                              (rs_measurement_in_t){2.0f, 3.5f, 100.0f, 0u});
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_DONE, out.status);
    ASSERT_SAME_FLOAT(1.5f * 1.25f, out.Rs_ohm);
    ASSERT_NEAR(1e-5, (12.0 - 1.5 * 6.0) / LEGS, out.lost_V);
    ASSERT_SAME_FLOAT(0.0f, out.i_ref_A);
}

static void test_result_comes_once(void)
{
    (void)measured((rs_measurement_in_t){6.0f, 6.0f, 6.0f, 0u},
                   (rs_measurement_in_t){2.0f, 2.0f, 2.0f, 0u});
    for (int k = 0; k < 3; k++) {
        const rs_measurement_state_t before = st;
        const rs_measurement_out_t out = step(6.0f, 6.0f, 6.0f);
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_IDLE, out.status);
        ASSERT_SAME_FLOAT(0.0f, out.Rs_ohm);
        TEST_ASSERT_EQUAL_MEMORY(&before, &st, sizeof st);
    }
}

/* Teeth of four periods on every level but the small one. */
static void test_a_tooth_runs_to_and_fro_by_the_dither(void)
{
    const float level_A[RS_LEVELS] = {2.0f, 0.3f, 1.5f, 6.0f};
    const float tooth_A[] = {0.5f, 0.0f, -0.5f, 0.0f};
    cfg = simple;
    cfg.curve = true;
    cfg.dither_A = 0.5f;
    cfg.dither_turns = 0.25f;
    for (int k = 0; k < 16; k++) {
        const float now_A = level_A[k / 4];
        const float i_A = step(now_A, now_A, now_A).i_ref_A;
        if ((k / 4) != RS_LEVEL_SMALL) {
            ASSERT_SAME_FLOAT(level_A[k / 4] + tooth_A[k % 4], i_A);
        }
    }
}

/* It stands until the average begins. Then every tooth, here of 40 periods, reverses it, in the
 * next slot before a window of the guard: whatever the slot of the first period. */
static void test_the_small_current_is_reversed_by_every_tooth(void)
{
    cfg = simple;
    cfg.curve = true;
    cfg.level_periods = 200u;
    cfg.average_periods = 160u;
    cfg.dither_turns = 0.025f;
    for (uint32_t first = 0u; first < SLOT_COUNT; first++) {
        float before_A = 0.3f;
        uint32_t signs = 0u;
        uint32_t since = 0u; /* periods since the average began, or a reversal */
        st = (rs_measurement_state_t){.periods = 200u};
        for (uint32_t k = 0u; k < 200u; k++) {
            const rs_measurement_in_t in = {.i_A = 1.0f, .slot = (first + k) % SLOT_COUNT};
            const float i_A = rs_measurement_step(&cfg, &st, &in).i_ref_A;
            ASSERT_SAME_FLOAT(0.3f, fabsf(i_A));
            TEST_ASSERT_EQUAL(i_A * before_A < 0.0f, st.mirror);
            since = (k > 40u) ? (since + 1u) : 0u;
            if (i_A * before_A < 0.0f) {
                TEST_ASSERT_EQUAL_UINT32(SLOT_GUARD_CURRENT - 1u, in.slot);
                TEST_ASSERT_TRUE((since > 24u) && (since < 56u));
                since = 0u;
                signs++;
            }
            before_A = i_A;
        }
        TEST_ASSERT_EQUAL_UINT32(3u, signs);
        ASSERT_SAME_FLOAT(-0.3f, before_A);
        bool begun = false;
        for (uint32_t k = 0u; k < 200u; k++) { /* bend, positive again, waits for that slot, too */
            const rs_measurement_in_t in = {.i_A = 1.0f, .slot = (first + 200u + k) % SLOT_COUNT};
            const float i_A = rs_measurement_step(&cfg, &st, &in).i_ref_A;
            const bool begins = !begun && (in.slot == SLOT_GUARD_CURRENT - 1u);
            begun = begun || begins;
            ASSERT_SAME_FLOAT(begun ? 1.5f : -0.3f, i_A);
            TEST_ASSERT_EQUAL(begins, st.mirror);
        }
    }
}

/* An average of 15 periods, the shortest that parameters allow, need not end negative; one of 1500
 * has teeth of 375. */
static void test_what_flows_stays_until_bend_begins(void)
{
    static const uint32_t average[] = {15u, 1500u};
    cfg = simple;
    cfg.curve = true;
    for (uint32_t n = 0u; n < 2u * SLOT_COUNT; n++) {
        cfg.average_periods = average[n % 2u];
        cfg.level_periods = 5u * cfg.average_periods;
        cfg.dither_turns = 4.0f / (float)cfg.average_periods;
        st = (rs_measurement_state_t){.periods = cfg.level_periods};
        float before_A = 0.3f;
        for (uint32_t k = 0u; k < cfg.level_periods + SLOT_COUNT; k++) {
            const uint32_t slot = ((n / 2u) + k) % SLOT_COUNT;
            const rs_measurement_in_t in = {.i_A = 1.0f, .slot = slot};
            const float i_A = rs_measurement_step(&cfg, &st, &in).i_ref_A;
            const bool changes = absf(i_A - before_A) > 0.0f;
            if ((average[n % 2u] > 64u) || (k >= cfg.level_periods)) {
                TEST_ASSERT_TRUE(!changes || (slot == SLOT_GUARD_CURRENT - 1u) || (i_A > 1.0f));
            }
            if (k < cfg.level_periods - cfg.average_periods) {
                ASSERT_SAME_FLOAT(0.3f, i_A);
            }
            before_A = i_A;
        }
        TEST_ASSERT_TRUE(before_A > 1.0f);
    }
}

/* A sensor whose steps are .6 V, the current where its words stand still: 1 ohm comes out .81. Two
 * teeth over four steps find it. */
static void test_a_coarse_voltage_sensor_is_averaged_over_its_steps(void)
{
    const float step_V = 0.6f;
    float found_ohm[2];
    for (int dithered = 0; dithered < 2; dithered++) {
        rs_measurement_params_t p = good;
        p.level.A[RS_LEVEL_HIGH] = 8.08f;
        p.level.A[RS_LEVEL_LOW] = 5.12f;
        p.bias = 1.0f;
        TEST_ASSERT_TRUE(rs_measurement_init(&cfg, &p, RS_ohm, PERIOD_S));
        cfg.dither_A *= (float)dithered;
        st = (rs_measurement_state_t){0};
        rs_measurement_out_t out = step(0.0f, 0.0f, 0.0f);
        while (out.status == RS_MEASUREMENT_BUSY) {
            const float u_V = step_V * roundf(out.i_ref_A / step_V);
            out = step(out.i_ref_A, u_V, u_V);
        }
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_DONE, out.status);
        found_ohm[dithered] = out.Rs_ohm;
    }
    TEST_ASSERT_TRUE(found_ohm[0] < 0.85f);
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 1.0f, found_ohm[1]);
}

/* A drive of 1.5 ohm whose legs lose 2 V (1 - tail/i); at +-small_A only a share of it. Within the
 * teeth the rotor's .5 ohm is there too, and the slope of a tail of its own. */
#define CURVE_V        2.0f
#define TOOTH_A        0.5f
#define CURVE_PERIODS  48   /* the last 32 are averaged: two cycles of the small current */
#define SMALL_OFFSET_V 3.0f /* of sensor or current there: does not matter */
#define SMALL_OFFSET_A 0.1f
#define INDUCTANCE_OHM 7.0f /* over a period: does not matter either */

/* Of the slope within the teeth of the high level: saturation takes it there. */
static float saturated_ohm;

/* The small current: what is measured in this period, and the voltage since the last one. */
static void small_current(int k, float small_A, float share, float *i_A, float *duty_V)
{
    const float slope_ohm = 2.0f + share * (float)LEGS * CURVE_V / small_A;
    const float before_A = (k == 0) ? small_A : (*i_A - SMALL_OFFSET_A);
    const float now_A = (((k / 8) % 2) == 0) ? small_A : -small_A;
    *i_A = now_A + SMALL_OFFSET_A;
    *duty_V = SMALL_OFFSET_V + slope_ohm * 0.5f * (before_A + now_A) +
              INDUCTANCE_OHM * (now_A - before_A);
}

static rs_measurement_out_t with_curve(float small_A, float share, float tail_A, float teeth_A)
{
    static const float tooth_A[] = {TOOTH_A, 0.0f, -TOOTH_A, 0.0f};
    static const float mean_A[] = {0.5f * TOOTH_A, 0.5f * TOOTH_A, -0.5f * TOOTH_A,
                                   -0.5f * TOOTH_A};
    const float level_A[RS_LEVELS] = {2.0f, small_A, 1.5f, 6.0f};
    cfg.level.A[RS_LEVEL_SMALL] = small_A;
    cfg.level_periods = (uint32_t)CURVE_PERIODS;
    cfg.average_periods = 32u;
    cfg.dither_A = TOOTH_A;
    cfg.dither_turns = 0.25f;
    cfg.curve = true;
    st = (rs_measurement_state_t){0};
    float i_A = 0.0f;
    float duty_V = 0.0f;
    for (int k = 0; k < RS_LEVELS * CURVE_PERIODS; k++) {
        const int level = k / CURVE_PERIODS;
        const float at_A = level_A[level];
        if (level == RS_LEVEL_SMALL) {
            small_current(k % CURVE_PERIODS, small_A, share, &i_A, &duty_V);
        } else {
            const float rotor_ohm = 0.5f - ((level == RS_LEVEL_HIGH) ? saturated_ohm : 0.0f);
            i_A = at_A + tooth_A[k % 4];
            duty_V = 1.5f * at_A + (float)LEGS * CURVE_V - 3.0f * CURVE_V * tail_A / at_A +
                     (1.5f + rotor_ohm + 3.0f * CURVE_V * teeth_A / (at_A * at_A)) * mean_A[k % 4];
        }
        const rs_measurement_out_t busy = step(i_A, cfg.by_duty ? duty_V : (1.5f * i_A), duty_V);
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_BUSY, busy.status);
        if (level != RS_LEVEL_SMALL) {
            ASSERT_SAME_FLOAT(i_A, busy.i_ref_A);
        }
    }
    return step(2.0f, 3.0f, 3.0f);
}

/* Leg u carries sqrt(2/3) of the small current. */
static rs_measurement_out_t with_small(float small_A, float share)
{
    cfg = simple;
    const rs_measurement_out_t out = with_curve(small_A, share, 0.0f, 0.0f);
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_DONE, out.status);
    ASSERT_NEAR(1e-5, CURVE_V, out.lost_V);
    ASSERT_SAME_FLOAT(0.0f, out.tail_A);
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_IDLE, step(2.0f, 3.0f, 3.0f).status);
    return out;
}

/* Capacitance alone: a line of four times the tail, touched at twice the tail. */
static rs_measurement_out_t with_capacitance(float tail_A, bool by_duty)
{
    const float x_A = 0.3f * sqrtf(2.0f / 3.0f);
    cfg = simple;
    cfg.by_duty = by_duty;
    return with_curve(0.3f, 0.75f * x_A / (4.0f * tail_A), tail_A, tail_A);
}

/* The line that the teeth show: those of the low level, 2 A, are steeper by its tail. */
static double shown_A(double line_A, double tail_A)
{
    return 1.0 / (1.0 / line_A - 3.0 * tail_A / 4.0);
}

static void test_the_tail_of_a_capacitance_is_found_and_taken_off_the_resistance(void)
{
    for (int k = 0; k < 2; k++) {
        for (float tail_A = 0.2f; tail_A < 0.39f; tail_A += 0.05f) {
            const rs_measurement_out_t out = with_capacitance(tail_A, k == 1);
            TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_DONE, out.status);
            ASSERT_NEAR(1e-4, 1.5 * 1.25, out.Rs_ohm);
            ASSERT_NEAR(1e-4, CURVE_V, out.lost_V);
            ASSERT_NEAR(1e-4, tail_A, out.tail_A);
            const double most_A = 0.5 * sqrt(2.0 / 3.0) * 2.0;
            const double at_A = shown_A(4.0 * tail_A, tail_A) - 2.0 * (double)tail_A;
            ASSERT_NEAR(2e-4, (at_A < most_A) ? at_A : most_A, out.threshold_A);
            ASSERT_NEAR(1e-3, 0.5, out.Rr_ohm);
        }
    }
}

/* .6 of what the rotor's resistance falls from the low level to the high one. One that rises is no
 * saturation. */
static void test_what_saturation_takes_from_the_rotor_comes_back(void)
{
    static const float taken_ohm[] = {0.2f, -0.2f};
    static const double expected_ohm[] = {0.62, 0.5};
    for (int k = 0; k < 2; k++) {
        cfg = simple;
        saturated_ohm = taken_ohm[k];
        const rs_measurement_out_t out = with_curve(0.3f, 0.2f, 0.0f, 0.0f);
        saturated_ohm = 0.0f;
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_DONE, out.status);
        ASSERT_NEAR(1e-3, expected_ohm[k], out.Rr_ohm);
    }
}

/* A loss that is still rising at the lowest level: the levels show a tail, the teeth none. And a
 * saturation that lets Rr fall: the teeth show one, the levels none. Less than .0025 of the voltage
 * at the high level, here .03 A, is noise. */
static void test_a_tail_that_only_levels_or_only_teeth_show_is_none(void)
{
    const struct {
        float levels_A, teeth_A, tail_A;
    } of[] = {{0.2f, 0.0f, 0.0f},   {0.2f, -0.1f, 0.0f},  {0.0f, 0.2f, 0.0f},
              {-0.2f, 0.2f, 0.0f},  {0.2f, 0.1f, 0.1f},   {0.1f, 0.2f, 0.1f},
              {-0.2f, -0.2f, 0.0f}, {0.03f, 0.03f, 0.0f}, {0.032f, 0.032f, 0.032f}};
    for (unsigned k = 0; k < sizeof of / sizeof of[0]; k++) {
        cfg = simple;
        cfg.by_duty = true;
        const rs_measurement_out_t out = with_curve(0.3f, 0.2f, of[k].levels_A, of[k].teeth_A);
        TEST_ASSERT_EQUAL(of[k].tail_A > 0.0f, out.tail_A > 0.0f);
        /* What is not taken off over 6 A and 2 A stays in Rs. */
        const double left_A = (double)of[k].levels_A - (double)of[k].tail_A;
        ASSERT_NEAR(1e-3, (1.5 + 6.0 * left_A / 12.0) * 1.25, out.Rs_ohm);
    }
}

/* A line that is longer ends before the whole of it, one that is shorter where the tail begins. */
static void test_the_threshold_lies_where_line_and_tail_meet(void)
{
    const double x_A = 0.3 * sqrt(2.0 / 3.0);
    cfg = simple;
    rs_measurement_out_t out = with_curve(0.3f, (float)(0.75 * x_A / 0.7), 0.1f, 0.1f);
    ASSERT_NEAR(1e-4, shown_A(0.7, 0.1) - 2.0 * 0.1, out.threshold_A);
    ASSERT_NEAR(1e-4, 0.1, out.tail_A);
    cfg = simple;
    out = with_curve(0.3f, (float)(0.75 * x_A / 0.25), 0.2f, 0.2f);
    ASSERT_NEAR(1e-4, 2.0 * 0.2, out.threshold_A);
    /* The lower level bounds both. */
    cfg = simple;
    out = with_curve(0.3f, (float)(0.75 * x_A / 0.3), 0.6f, 0.6f);
    ASSERT_NEAR(1e-5, 0.5 * sqrt(2.0 / 3.0) * 2.0, out.threshold_A);
    ASSERT_SAME_FLOAT(0.5f * out.threshold_A, out.tail_A);
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

/* Hardly anything there: as at the lower level, where it is whole in every leg. Nothing or less:
 * none is found. */
static void test_a_threshold_is_at_most_the_lower_levels_leg_current(void)
{
    const double most_A = 0.5 * sqrt(2.0 / 3.0) * 2.0;
    ASSERT_NEAR(1e-5, most_A, with_small(0.3f, 0.1f).threshold_A);
    ASSERT_SAME_FLOAT(0.0f, with_small(0.3f, -0.01f).threshold_A);
    ASSERT_SAME_FLOAT(0.0f, with_small(0.3f, -0.5f).threshold_A);
    ASSERT_NEAR(1e-5, 0.75 * 0.01 * sqrt(2.0 / 3.0) / 0.1, with_small(0.01f, 0.1f).threshold_A);
}

/* Currents that stand still have no slope. */
static void test_without_teeth_no_threshold_is_found(void)
{
    cfg = simple;
    cfg.curve = true;
    cfg.average_periods = 1u;
    st = (rs_measurement_state_t){0};
    for (int k = 0; k < 16; k++) {
        const float i_A = simple.level.A[k / 4];
        (void)step(i_A, 1.5f * i_A, 1.5f * i_A + 4.0f);
    }
    const rs_measurement_out_t out = step(2.0f, 3.0f, 7.0f);
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_DONE, out.status);
    TEST_ASSERT_TRUE(out.lost_V > 0.0f);
    ASSERT_SAME_FLOAT(0.0f, out.threshold_A);
}

static void test_without_a_small_current_or_a_loss_no_threshold_is_found(void)
{
    const rs_measurement_out_t plain = measured((rs_measurement_in_t){6.0f, 9.5f, 12.0f, 0u},
                                                (rs_measurement_in_t){2.0f, 3.5f, 9.0f, 0u});
    ASSERT_SAME_FLOAT(0.0f, plain.threshold_A);
    cfg = simple;
    cfg.curve = true;
    cfg.average_periods = 4u;
    st = (rs_measurement_state_t){0};
    for (int k = 0; k < 16; k++) {
        const float tooth_A = ((k % 4) < 2) ? 0.25f : -0.25f;
        const float level_A = ((k / 4) == RS_LEVEL_SMALL) ? 0.0f : simple.level.A[k / 4];
        const float i_A = level_A + tooth_A;
        (void)step(i_A, 1.5f * i_A, i_A);
    }
    const rs_measurement_out_t out = step(2.0f, 3.0f, 3.0f);
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_DONE, out.status);
    ASSERT_SAME_FLOAT(0.0f, out.lost_V);
    ASSERT_SAME_FLOAT(0.0f, out.threshold_A);
}

static void test_offsets_of_current_and_voltage_do_not_matter(void)
{
    const rs_measurement_out_t plain = measured((rs_measurement_in_t){6.0f, 6.0f, 6.0f, 0u},
                                                (rs_measurement_in_t){2.0f, 2.0f, 2.0f, 0u});
    const rs_measurement_out_t moved = measured((rs_measurement_in_t){6.5f, 5.25f, 6.0f, 0u},
                                                (rs_measurement_in_t){2.5f, 1.25f, 2.0f, 0u});
    ASSERT_SAME_FLOAT(plain.Rs_ohm, moved.Rs_ohm);
}

static void test_twice_the_voltage_is_twice_the_resistance_and_loss(void)
{
    const rs_measurement_out_t once = measured((rs_measurement_in_t){6.0f, 4.0f, 6.0f, 0u},
                                               (rs_measurement_in_t){2.0f, 1.0f, 2.0f, 0u});
    const rs_measurement_out_t twice = measured((rs_measurement_in_t){6.0f, 8.0f, 12.0f, 0u},
                                                (rs_measurement_in_t){2.0f, 2.0f, 4.0f, 0u});
    ASSERT_SAME_FLOAT(2.0f * once.Rs_ohm, twice.Rs_ohm);
    ASSERT_SAME_FLOAT(2.0f * once.lost_V, twice.lost_V);
}

static void test_a_loss_below_zero_is_none(void)
{
    const rs_measurement_out_t out = measured((rs_measurement_in_t){6.0f, 6.0f, 5.0f, 0u},
                                              (rs_measurement_in_t){2.0f, 2.0f, 2.0f, 0u});
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_DONE, out.status);
    ASSERT_SAME_FLOAT(0.0f, out.lost_V);
}

/* Status of a measurement whose resistance comes out as given. */
static rs_measurement_out_t of_resistance(float measured_ohm)
{
    return measured((rs_measurement_in_t){6.0f, 6.0f * measured_ohm, 6.0f, 0u},
                    (rs_measurement_in_t){2.0f, 2.0f * measured_ohm, 2.0f, 0u});
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

/* What comes behind the levels below the largest, on a resistance. */
static rs_measurement_out_t before_the_high_level(float ohm, bool by_duty)
{
    static const float level_A[] = {2.0f, 0.3f, 1.5f};
    cfg = simple;
    cfg.curve = true;
    cfg.by_duty = by_duty;
    st = (rs_measurement_state_t){0};
    for (int k = 0; k < 12; k++) {
        const float i_A = level_A[k / 4];
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_BUSY, step(i_A, ohm * i_A, ohm * i_A).status);
    }
    return step(1.5f, ohm * 1.5f, ohm * 1.5f);
}

static void test_a_resistance_that_is_too_large_never_sees_the_high_level(void)
{
    for (int by_duty = 0; by_duty < 2; by_duty++) {
        rs_measurement_out_t out = before_the_high_level(2.0f, by_duty == 1);
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_BUSY, out.status);
        ASSERT_SAME_FLOAT(6.0f, out.i_ref_A);
        /* One that is too small needs the level to be sure, unless sensors see next to nothing. */
        out = before_the_high_level(0.25f, by_duty == 1);
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_BUSY, out.status);
        const int odd = (by_duty == 1) ? RS_MEASUREMENT_BUSY : RS_MEASUREMENT_REFUSED;
        out = before_the_high_level(0.2490234375f, by_duty == 1);
        TEST_ASSERT_EQUAL_INT(odd, out.status);
        out = before_the_high_level(-2.0f, by_duty == 1);
        TEST_ASSERT_EQUAL_INT(odd, out.status);
        out = before_the_high_level(NAN, by_duty == 1);
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_REFUSED, out.status);
        out = before_the_high_level(2.001953125f, by_duty == 1);
        for (int k = 0; k < 5; k++) {
            TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_REFUSED, out.status);
            ASSERT_SAME_FLOAT(0.0f, out.i_ref_A);
            out = step(2.0f, 2.0f, 2.0f);
        }
    }
}

/* With sensors from zero on, behind the duties from bend on: the other level may be off. */
static void test_the_levels_that_tell_a_resistance_before_the_high_one(void)
{
    for (int by_duty = 0; by_duty < 2; by_duty++) {
        (void)before_the_high_level(1.0f, by_duty == 1);
        st.periods = 12u;
        st.level[by_duty ? RS_LEVEL_SMALL : RS_LEVEL_BEND].u_V = -100.0f;
        st.level[by_duty ? RS_LEVEL_SMALL : RS_LEVEL_BEND].u_duty_V = -100.0f;
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_BUSY, step(1.5f, 1.5f, 1.5f).status);
        st.periods = 12u;
        st.level[by_duty ? RS_LEVEL_BEND : RS_LEVEL_SMALL].u_V = -100.0f;
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_REFUSED, step(1.5f, 1.5f, 1.5f).status);
    }
}

/* The tail adds c/(i j) = .4 ohm to the slope of the two lower levels, and .6 V/i^2 to the teeth. A
 * tail that would take something off instead is none. */
static void test_a_tail_is_no_resistance_before_the_high_level(void)
{
    cfg = simple;
    cfg.by_duty = true;
    cfg.Rs_max_ohm = 1.51f;
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_DONE, with_curve(0.3f, 0.2f, 0.2f, 0.2f).status);
    cfg = simple;
    cfg.by_duty = true;
    cfg.Rs_max_ohm = 1.51f;
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_DONE, with_curve(0.3f, 0.2f, 0.0f, -0.2f).status);
}

static void test_less_than_half_the_current_step_is_an_open_phase(void)
{
    const rs_measurement_in_t low = {2.0f, 2.0f, 2.0f, 0u};
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_DONE,
                          measured((rs_measurement_in_t){4.0f, 4.0f, 4.0f, 0u}, low).status);
    const rs_measurement_out_t out =
        measured((rs_measurement_in_t){3.9921875f, 3.9921875f, 4.0f, 0u}, low);
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_REFUSED, out.status);
    ASSERT_SAME_FLOAT(0.0f, out.Rs_ohm);
    TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_REFUSED, measured(low, low).status);
}

static void test_no_number_is_refused_or_harmless(void)
{
    const rs_measurement_in_t low = {2.0f, 2.0f, 2.0f, 0u};
    for (int i = 0; i < NOT_FINITE_COUNT; i++) {
        const float x = not_finite(i);
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_REFUSED,
                              measured((rs_measurement_in_t){x, 6.0f, 6.0f, 0u}, low).status);
        TEST_ASSERT_EQUAL_INT(RS_MEASUREMENT_REFUSED,
                              measured((rs_measurement_in_t){6.0f, x, 6.0f, 0u}, low).status);
    }
    /* The duties do not decide on Rs; a NaN there is no loss. */
    const rs_measurement_out_t out = measured((rs_measurement_in_t){6.0f, 6.0f, NAN, 0u}, low);
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

/* Rr (M/Lr)^2 */
static double seen_rotor_ohm(int machine)
{
    const motor_t *m = &reference_machine[machine];
    const double kr = (double)m->M_H / (double)m->Lr_H;
    return kr * kr * (double)m->Rr_ohm;
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
                const double Rr_ohm = seen_rotor_ohm(m);
                ASSERT_NEAR(0.02 * Rr_ohm, Rr_ohm, out.Rr_ohm);
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
    const rs_measurement_in_t in = {6.0f, 6.0f, 6.0f, 0u};
    (void)rs_measurement_step(&cfg, &other, &in);
    TEST_ASSERT_EQUAL_MEMORY(&st, &other, sizeof other);
}

/* Every sum has its own factor, and every level after it triples what is there. */
static void test_the_digest_weighs_every_sum(void)
{
    const uint32_t factor[] = {3u, 5u, 1u, 7u, 9u, 11u};
    for (size_t n = 0; n < sizeof factor / sizeof factor[0]; n++) {
        st = (rs_measurement_state_t){0};
        rs_measurement_sums_t *const sums = &st.level[2];
        float *const sum[] = {&sums->i_A, &sums->u_V,   &sums->u_duty_V,
                              &sums->x_A, &sums->xx_A2, &sums->xu_VA};
        *sum[n] = 1.5f;
        TEST_ASSERT_EQUAL_HEX32(3u * factor[n] * float_bits(1.5f), rs_measurement_digest(&st));
    }
}

static void test_the_digest_sees_every_sum(void)
{
    st = (rs_measurement_state_t){0};
    uint32_t before = rs_measurement_digest(&st);
    for (int k = 0; k < RS_LEVELS; k++) {
        rs_measurement_sums_t *const sums = &st.level[k];
        float *const sum[] = {&sums->i_A, &sums->u_V,   &sums->u_duty_V,
                              &sums->x_A, &sums->xx_A2, &sums->xu_VA};
        for (size_t n = 0; n < sizeof sum / sizeof sum[0]; n++) {
            *sum[n] = 1.0f;
            const uint32_t now = rs_measurement_digest(&st);
            TEST_ASSERT_NOT_EQUAL_UINT32(before, now);
            before = now;
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_derives_counts_and_limits);
    RUN_TEST(test_init_rounds_to_whole_periods);
    RUN_TEST(test_init_refuses_every_bad_number);
    RUN_TEST(test_init_refuses_an_average_that_a_float_cannot_sum);
    RUN_TEST(test_init_accepts_the_ends_of_the_ranges);
    RUN_TEST(test_a_tooth_runs_to_and_fro_by_the_dither);
    RUN_TEST(test_the_small_current_is_reversed_by_every_tooth);
    RUN_TEST(test_what_flows_stays_until_bend_begins);
    RUN_TEST(test_a_coarse_voltage_sensor_is_averaged_over_its_steps);
    RUN_TEST(test_switched_off_nothing_is_looked_at_and_nothing_is_asked);
    RUN_TEST(test_step_asks_for_both_levels_in_turn_and_averages_their_ends);
    RUN_TEST(test_result_is_the_ratio_of_differences_with_bias_and_the_legs_loss);
    RUN_TEST(test_result_comes_once);
    RUN_TEST(test_the_small_current_tells_from_where_on_the_loss_is_whole);
    RUN_TEST(test_the_tail_of_a_capacitance_is_found_and_taken_off_the_resistance);
    RUN_TEST(test_what_saturation_takes_from_the_rotor_comes_back);
    RUN_TEST(test_a_tail_that_only_levels_or_only_teeth_show_is_none);
    RUN_TEST(test_the_threshold_lies_where_line_and_tail_meet);
    RUN_TEST(test_a_threshold_is_at_most_the_lower_levels_leg_current);
    RUN_TEST(test_without_teeth_no_threshold_is_found);
    RUN_TEST(test_without_a_small_current_or_a_loss_no_threshold_is_found);
    RUN_TEST(test_offsets_of_current_and_voltage_do_not_matter);
    RUN_TEST(test_twice_the_voltage_is_twice_the_resistance_and_loss);
    RUN_TEST(test_a_loss_below_zero_is_none);
    RUN_TEST(test_limits_hold_for_the_measured_value_and_belong_to_the_range);
    RUN_TEST(test_a_refusal_stays_and_shows_what_was_measured);
    RUN_TEST(test_a_resistance_that_is_too_large_never_sees_the_high_level);
    RUN_TEST(test_the_levels_that_tell_a_resistance_before_the_high_one);
    RUN_TEST(test_a_tail_is_no_resistance_before_the_high_level);
    RUN_TEST(test_less_than_half_the_current_step_is_an_open_phase);
    RUN_TEST(test_no_number_is_refused_or_harmless);
    RUN_TEST(test_the_resistance_of_both_machines_is_found_behind_dead_time_and_offsets);
    RUN_TEST(test_the_digest_weighs_every_sum);
    RUN_TEST(test_the_digest_sees_every_sum);
    RUN_TEST(test_two_measurements_share_a_config_and_nothing_else);
    return UNITY_END();
}
