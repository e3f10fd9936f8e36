#include "plausibility.h"

#include <math.h>

#include "debounce.h"
#include "unity.h"

#define TURN_S 3.2e-3f

static const plausibility_params_t all = {.u_V = 3.0f,
                                          .open_A = 1.2f,
                                          .e1_A = 5.0f,
                                          .rate_rad_s2 = 1000.0f,
                                          .power_W = 200.0f,
                                          .stall_s = 0.32f};
static plausibility_config_t cfg;
static plausibility_state_t st;

void setUp(void)
{
    TEST_ASSERT_TRUE(plausibility_init(&cfg, &all, TURN_S));
    st = (plausibility_state_t){0};
}

void tearDown(void)
{
}

#define ASSERT_REFUSED(field, value)                                                               \
    do {                                                                                           \
        plausibility_params_t bad = all;                                                           \
        bad.field = (value);                                                                       \
        TEST_ASSERT_FALSE_MESSAGE(plausibility_init(&cfg, &bad, TURN_S), #field " = " #value);     \
    } while (0)

static void test_init_refuses_what_is_no_limit(void)
{
    ASSERT_REFUSED(u_V, -1.0f);
    ASSERT_REFUSED(open_A, INFINITY);
    ASSERT_REFUSED(e1_A, -1e-6f);
    ASSERT_REFUSED(rate_rad_s2, -1.0f);
    ASSERT_REFUSED(power_W, NAN);
    ASSERT_REFUSED(stall_s, -1.0f);
    ASSERT_REFUSED(stall_s, 3201.0f);
    TEST_ASSERT_FALSE(plausibility_init(&cfg, &all, 0.0f));
}

static void test_a_stall_time_is_whole_looks_to_the_nearest(void)
{
    plausibility_params_t p = all;
    p.stall_s = 99.52f * TURN_S;
    TEST_ASSERT_TRUE(plausibility_init(&cfg, &p, TURN_S));
    TEST_ASSERT_EQUAL_UINT32(100u, cfg.stall_schedules);
    p.stall_s = 99.48f * TURN_S;
    TEST_ASSERT_TRUE(plausibility_init(&cfg, &p, TURN_S));
    TEST_ASSERT_EQUAL_UINT32(99u, cfg.stall_schedules);
}

static void test_other_periods_keep_the_times(void)
{
    TEST_ASSERT_EQUAL_UINT32(8u, cfg.voltage_schedules);
    TEST_ASSERT_EQUAL_UINT32(6u, cfg.phase_schedules);
    TEST_ASSERT_EQUAL_UINT32(60u, cfg.estimate_schedules);
    TEST_ASSERT_TRUE(plausibility_init(&cfg, &all, 1e-3f)); /* 16 periods of 62.5 us */
    TEST_ASSERT_EQUAL_UINT32(26u, cfg.voltage_schedules);
    TEST_ASSERT_EQUAL_UINT32(19u, cfg.phase_schedules);
    TEST_ASSERT_EQUAL_UINT32(192u, cfg.estimate_schedules);
    TEST_ASSERT_EQUAL_UINT32(320u, cfg.stall_schedules);
}

/* How many times on end until the answer is yes; 1000: never. */
static int times_until_wrong_voltage_at(ab_t sensed_V, ab_t duty_V, uvw_t i_A)
{
    int n = 1;
    while (!plausibility_voltage_wrong(&cfg, &st, sensed_V, duty_V, i_A) && (n < 1000)) {
        n++;
    }
    return n;
}

static int times_until_wrong_voltage(ab_t sensed_V, ab_t duty_V)
{
    return times_until_wrong_voltage_at(sensed_V, duty_V, (uvw_t){-4.0f, 0.31f, 3.69f});
}

/* 3 V and a tenth of 50 V: up to 8 V in any direction. */
static void test_a_voltage_may_differ_by_volts_and_a_share(void)
{
    const ab_t duty_V = {30.0f, 40.0f};
    TEST_ASSERT_EQUAL_INT(1000, times_until_wrong_voltage((ab_t){37.9f, 40.0f}, duty_V));
    TEST_ASSERT_EQUAL_INT(1000, times_until_wrong_voltage((ab_t){30.0f, 32.1f}, duty_V));
    TEST_ASSERT_EQUAL_INT(8, times_until_wrong_voltage((ab_t){38.1f, 40.0f}, duty_V));
    st = (plausibility_state_t){0};
    TEST_ASSERT_EQUAL_INT(8, times_until_wrong_voltage((ab_t){30.0f, 31.9f}, duty_V));
    st = (plausibility_state_t){0};
    TEST_ASSERT_EQUAL_INT(8, times_until_wrong_voltage((ab_t){NAN, 40.0f}, duty_V));
}

/* A leg without current: nobody knows which way it loses its voltage. */
static void test_a_voltage_may_differ_twice_as_much_beside_a_leg_without_current(void)
{
    const uvw_t legs[3] = {{0.29f, 3.0f, -3.29f}, {3.0f, -0.29f, -2.71f}, {3.0f, -3.29f, 0.29f}};
    for (int x = 0; x < 3; x++) {
        st = (plausibility_state_t){0};
        const ab_t duty_V = {30.0f, 40.0f};
        TEST_ASSERT_EQUAL_INT(1000,
                              times_until_wrong_voltage_at((ab_t){45.9f, 40.0f}, duty_V, legs[x]));
        TEST_ASSERT_EQUAL_INT(8,
                              times_until_wrong_voltage_at((ab_t){46.1f, 40.0f}, duty_V, legs[x]));
    }
    cfg.p.open_A = 0.8f; /* a quarter of it counts */
    st = (plausibility_state_t){0};
    TEST_ASSERT_EQUAL_INT(
        8, times_until_wrong_voltage_at((ab_t){45.9f, 40.0f}, (ab_t){30.0f, 40.0f}, legs[0]));
    st = (plausibility_state_t){0};
    TEST_ASSERT_EQUAL_INT(
        8, times_until_wrong_voltage_at((ab_t){NAN, 40.0f}, (ab_t){30.0f, 40.0f}, legs[0]));
}

static int times_until_open(uvw_t i_A, ab_t i_ref_A)
{
    int n = 1;
    while (!plausibility_phase_open(&cfg, &st, i_A, i_ref_A) && (n < 1000)) {
        n++;
    }
    return n;
}

/* Each phase by itself: 4 A asked for along its axis, in the other two half of it, backwards. */
static void test_a_phase_without_the_current_asked_for_is_open(void)
{
    const uvw_t axis[3] = {{4.0f, -2.0f, -2.0f}, {-2.0f, 4.0f, -2.0f}, {-2.0f, -2.0f, 4.0f}};
    for (int x = 0; x < 3; x++) {
        const ab_t ref_A = ab_from_uvw(axis[x]);
        uvw_t i_A = axis[x];
        TEST_ASSERT_EQUAL_INT(1000, times_until_open(i_A, ref_A));
        float *const phase[3] = {&i_A.u, &i_A.v, &i_A.w};
        *phase[x] = 0.31f;
        TEST_ASSERT_EQUAL_INT(1000, times_until_open(i_A, ref_A));
        st = (plausibility_state_t){0};
        *phase[x] = -0.29f;
        TEST_ASSERT_EQUAL_INT(6, times_until_open(i_A, ref_A));
        TEST_ASSERT_EQUAL_UINT32(6u * DEBOUNCE_WEIGHT, st.phase[x]);
        *phase[x] = NAN;
        st = (plausibility_state_t){0};
        TEST_ASSERT_EQUAL_INT(6, times_until_open(i_A, ref_A));
        st = (plausibility_state_t){0};
    }
}

static void test_a_phase_of_which_little_is_asked_may_be_without_current(void)
{
    const uvw_t none = {0.0f, 0.0f, 0.0f};
    TEST_ASSERT_EQUAL_INT(1000, times_until_open(none, ab_from_uvw((uvw_t){1.1f, -0.6f, -0.5f})));
    TEST_ASSERT_EQUAL_INT(6, times_until_open(none, ab_from_uvw((uvw_t){1.3f, -0.7f, -0.6f})));
}

/* Each of three phases wrong in one turn of nine: together often, no phase open. */
static void test_phases_do_not_count_for_each_other(void)
{
    const ab_t ref_A = ab_from_uvw((uvw_t){4.0f, 4.0f, -8.0f});
    for (int k = 0; k < 3000; k++) {
        uvw_t i_A = {4.0f, 4.0f, -8.0f};
        i_A.u = ((k % 9) == 0) ? 0.0f : i_A.u;
        i_A.v = ((k % 9) == 3) ? 0.0f : i_A.v;
        i_A.w = ((k % 9) == 6) ? 0.0f : i_A.w;
        TEST_ASSERT_FALSE(plausibility_phase_open(&cfg, &st, i_A, ref_A));
    }
}

/* A frequency of a third of the checks' rate: every third one meets the same phase at zero. */
static void test_a_phase_that_often_passes_zero_is_not_open(void)
{
    const ab_t ref_A = ab_from_uvw((uvw_t){4.0f, 4.0f, -8.0f});
    for (int k = 0; k < 3000; k++) {
        const uvw_t i_A = {((k % 3) == 0) ? 0.0f : 4.0f, 4.0f, -8.0f};
        TEST_ASSERT_FALSE(plausibility_phase_open(&cfg, &st, i_A, ref_A));
    }
}

/* All in order. */
static const plausibility_estimate_t fine = {.e1_A = {0.1f, 0.0f},
                                             .lambda_Wb = 0.4f,
                                             .lambda_ref_Wb = 0.5f,
                                             .omega_rad_s = 50.0f,
                                             .air_gap_W = 900.0f,
                                             .torque_power_W = 800.0f};

static int times_until_wrong(const plausibility_estimate_t *in)
{
    st = (plausibility_state_t){.omega_before_rad_s = in->omega_rad_s};
    int n = 1;
    while (!plausibility_estimate_wrong(&cfg, &st, in) && (n < 1000)) {
        n++;
    }
    return n;
}

static int times_until_wrong_estimate(ab_t e1_A)
{
    plausibility_estimate_t in = fine;
    in.e1_A = e1_A;
    return times_until_wrong(&in);
}

static void test_an_estimate_that_stays_away_from_the_current_is_wrong(void)
{
    TEST_ASSERT_EQUAL_INT(1000, times_until_wrong_estimate((ab_t){2.9f, 4.0f}));
    TEST_ASSERT_EQUAL_INT(60, times_until_wrong_estimate((ab_t){-3.1f, -4.0f}));
    TEST_ASSERT_EQUAL_INT(60, times_until_wrong_estimate((ab_t){0.0f, NAN}));
}

/* A quarter of the reference that is in force. */
static void test_a_flux_far_below_its_reference_is_wrong(void)
{
    plausibility_estimate_t in = fine;
    in.lambda_Wb = 0.126f;
    TEST_ASSERT_EQUAL_INT(1000, times_until_wrong(&in));
    in.lambda_Wb = 0.124f;
    TEST_ASSERT_EQUAL_INT(60, times_until_wrong(&in));
    in.lambda_ref_Wb = 0.3f;
    TEST_ASSERT_EQUAL_INT(1000, times_until_wrong(&in));
    in.lambda_Wb = NAN;
    TEST_ASSERT_EQUAL_INT(60, times_until_wrong(&in));
}

/* At speed half of it. */
static void test_at_speed_half_the_flux_is_wrong(void)
{
    plausibility_estimate_t in = fine;
    in.lambda_Wb = 0.249f;
    in.omega_rad_s = -59.9f;
    TEST_ASSERT_EQUAL_INT(1000, times_until_wrong(&in));
    in.omega_rad_s = -60.1f;
    TEST_ASSERT_EQUAL_INT(60, times_until_wrong(&in));
    in.lambda_Wb = 0.251f;
    TEST_ASSERT_EQUAL_INT(1000, times_until_wrong(&in));
}

/* 200 W either way. */
static void test_a_power_that_does_not_fit_torque_and_speed_is_wrong(void)
{
    plausibility_estimate_t in = fine;
    in.air_gap_W = 999.0f;
    TEST_ASSERT_EQUAL_INT(1000, times_until_wrong(&in));
    in.air_gap_W = 1001.0f;
    TEST_ASSERT_EQUAL_INT(60, times_until_wrong(&in));
    in.air_gap_W = 599.0f;
    TEST_ASSERT_EQUAL_INT(60, times_until_wrong(&in));
    in.air_gap_W = NAN;
    TEST_ASSERT_EQUAL_INT(60, times_until_wrong(&in));
}

/* Turns until it is told, the speed changing by so much in each. */
static int times_until_wrong_rate(float change_rad_s, bool to_and_fro)
{
    st = (plausibility_state_t){.omega_before_rad_s = fine.omega_rad_s};
    plausibility_estimate_t in = fine;
    for (int n = 1; n < 200; n++) {
        in.omega_rad_s += (to_and_fro && (n % 2 == 0)) ? -change_rad_s : change_rad_s;
        if (plausibility_estimate_wrong(&cfg, &st, &in)) {
            return n;
        }
    }
    return 1000;
}

/* 1000 rad/s^2 are 3.2 rad/s in a turn. */
static void test_a_speed_that_changes_as_none_can_is_wrong(void)
{
    TEST_ASSERT_EQUAL_INT(1000, times_until_wrong_rate(3.1f, false));
    TEST_ASSERT_EQUAL_INT(60, times_until_wrong_rate(3.3f, false));
    TEST_ASSERT_EQUAL_INT(60, times_until_wrong_rate(-3.3f, false));
    TEST_ASSERT_EQUAL_INT(60, times_until_wrong_rate(3.3f, true));
    TEST_ASSERT_EQUAL_INT(60, times_until_wrong_rate(NAN, false));
}

static int times_until_stalled(bool at_limit, float omega_rad_s, float ref_rad_s)
{
    int n = 1;
    while (!plausibility_stalled(&cfg, &st, at_limit, omega_rad_s, ref_rad_s) && (n < 1000)) {
        n++;
    }
    return n;
}

static void test_all_torque_and_no_speed_is_a_stall(void)
{
    TEST_ASSERT_EQUAL_INT(100, times_until_stalled(true, -2.9f, 6.1f));
    st = (plausibility_state_t){0};
    TEST_ASSERT_EQUAL_INT(100, times_until_stalled(true, 0.0f, -6.1f));
    st = (plausibility_state_t){0};
    TEST_ASSERT_EQUAL_INT(1000, times_until_stalled(false, 0.0f, 20.0f)); /* it need not try */
    TEST_ASSERT_EQUAL_INT(1000, times_until_stalled(true, 3.1f, 20.0f));  /* it moves */
    TEST_ASSERT_EQUAL_INT(1000, times_until_stalled(true, 0.0f, 0.49f));  /* it is to stand still */
    TEST_ASSERT_EQUAL_INT(1000, times_until_stalled(true, 0.0f, 0.5f));   /* the limit included */
}

static void test_a_slow_shaft_that_does_not_turn_is_a_stall(void)
{
    TEST_ASSERT_EQUAL_INT(100, times_until_stalled(true, 0.0f, 0.51f));
    st = (plausibility_state_t){0};
    TEST_ASSERT_EQUAL_INT(100, times_until_stalled(true, -0.6f, 2.0f)); /* the wrong way */
    st = (plausibility_state_t){0};
    TEST_ASSERT_EQUAL_INT(100, times_until_stalled(true, 0.6f, -2.0f));
    st = (plausibility_state_t){0};
    TEST_ASSERT_EQUAL_INT(100, times_until_stalled(true, -0.99f, -2.0f));
    st = (plausibility_state_t){0};
    TEST_ASSERT_EQUAL_INT(1000, times_until_stalled(true, -1.01f, -2.0f));
    TEST_ASSERT_EQUAL_INT(1000, times_until_stalled(true, 1.01f, 2.0f));
    TEST_ASSERT_EQUAL_INT(1000, times_until_stalled(true, 1.0f, 2.0f)); /* half is not below it */
}

static void test_a_limit_of_zero_asks_nothing(void)
{
    const plausibility_params_t none = {0};
    TEST_ASSERT_TRUE(plausibility_init(&cfg, &none, TURN_S));
    TEST_ASSERT_EQUAL_INT(1000, times_until_wrong_voltage((ab_t){200.0f, 0.0f}, (ab_t){0}));
    TEST_ASSERT_EQUAL_INT(1000, times_until_open((uvw_t){0}, (ab_t){10.0f, 0.0f}));
    plausibility_estimate_t in = fine;
    in.e1_A.beta = 50.0f;
    in.lambda_Wb = 0.0f;
    in.air_gap_W = 5000.0f;
    TEST_ASSERT_EQUAL_INT(1000, times_until_wrong(&in));
    TEST_ASSERT_EQUAL_INT(1000, times_until_wrong_rate(100.0f, false));
    TEST_ASSERT_EQUAL_INT(1000, times_until_stalled(true, 0.0f, 100.0f));
}

/* The current x as three sensors show it of which `a` and the next are exchanged. */
static ab_t exchanged(ab_t x_A, int a)
{
    const uvw_t i_A = uvw_from_ab(x_A);
    float word_A[3] = {i_A.u, i_A.v, i_A.w};
    const int b = (a + 1) % 3;
    const float kept_A = word_A[a];
    word_A[a] = word_A[b];
    word_A[b] = kept_A;
    return ab_from_uvw((uvw_t){word_A[0], word_A[1], word_A[2]});
}

static int times_until_mirrored(ab_t i_A, ab_t i_hat_A)
{
    st = (plausibility_state_t){0};
    int n = 1;
    while (!plausibility_current_mirrored(&st, i_A, i_hat_A, 20.0f) && (n < 1000)) {
        n++;
    }
    return n;
}

/* In any direction but those that a mirror leaves where they are; the model may be .1 off. */
static void test_two_exchanged_sensors_show_a_mirror_image(void)
{
    for (int a = 0; a < 3; a++) {
        for (int k = 0; k < 12; k++) {
            const float angle_rad = 0.05f + 0.52f * (float)k;
            const ab_t x_A = {21.0f * cosf(angle_rad), 21.0f * sinf(angle_rad)};
            const ab_t i_A = exchanged(x_A, a);
            TEST_ASSERT_TRUE(ab_norm2(ab_sub(x_A, i_A)) > 0.1f);
            TEST_ASSERT_EQUAL_INT(5, times_until_mirrored(i_A, x_A));
            TEST_ASSERT_EQUAL_INT(1000, times_until_mirrored(x_A, x_A));
        }
        const ab_t across_A = {-3.0f, 20.5f};
        const ab_t i_A = exchanged(across_A, a);
        const float error_A = sqrtf(ab_norm2(ab_sub(across_A, i_A)));
        const ab_t near_A = {across_A.alpha, across_A.beta + 0.09f * error_A};
        const ab_t far_A = {across_A.alpha, across_A.beta + 0.13f * error_A};
        TEST_ASSERT_EQUAL_INT(5, times_until_mirrored(i_A, near_A));
        TEST_ASSERT_GREATER_THAN_INT(5, times_until_mirrored(i_A, far_A));
    }
}

/* Along the mirror the image moves as the current does: off by d, and sqrt(error^2 + d^2) without
 * the mirror. .098 of the error is less than a tenth of that, .103 is more. */
static void test_a_mirror_image_fits_within_a_tenth(void)
{
    for (int a = 0; a < 3; a++) {
        const ab_t x_A = {-3.0f, 20.5f};
        const ab_t i_A = exchanged(x_A, a);
        const ab_t error_A = ab_sub(x_A, i_A);
        const ab_t along_A = {-error_A.beta, error_A.alpha};
        const ab_t near_A = ab_add(x_A, ab_scale(along_A, 0.098f));
        const ab_t far_A = ab_add(x_A, ab_scale(along_A, 0.103f));
        TEST_ASSERT_EQUAL_INT(5, times_until_mirrored(i_A, near_A));
        TEST_ASSERT_EQUAL_INT(1000, times_until_mirrored(i_A, far_A));
    }
}

static void test_no_other_error_is_a_mirror_image(void)
{
    const ab_t i_A = {3.0f, 21.0f};
    TEST_ASSERT_EQUAL_INT(1000, times_until_mirrored(i_A, (ab_t){0.0f, 0.0f}));
    TEST_ASSERT_EQUAL_INT(1000, times_until_mirrored(i_A, ab_scale(i_A, -1.0f)));
    TEST_ASSERT_EQUAL_INT(1000, times_until_mirrored(i_A, ab_scale(i_A, 0.5f)));
    TEST_ASSERT_EQUAL_INT(1000, times_until_mirrored(i_A, (ab_t){-21.0f, 3.0f}));
    TEST_ASSERT_EQUAL_INT(1000, times_until_mirrored((ab_t){NAN, 21.0f}, i_A));
    TEST_ASSERT_EQUAL_INT(1000, times_until_mirrored(i_A, (ab_t){INFINITY, 21.0f}));
}

/* Small it may be anything; once it does not fit, the count begins anew. */
static void test_a_mirror_image_is_told_when_it_lasts_and_is_large(void)
{
    const ab_t small_A = {2.0f, 19.7f};
    const ab_t large_A = {2.0f, 20.0f};
    TEST_ASSERT_EQUAL_INT(1000, times_until_mirrored(exchanged(small_A, 1), small_A));
    /* All that time it was one: told as soon as it is large. */
    TEST_ASSERT_TRUE(plausibility_current_mirrored(&st, exchanged(large_A, 1), large_A, 20.0f));
    TEST_ASSERT_FALSE(plausibility_current_mirrored(&st, large_A, large_A, 20.0f));
    TEST_ASSERT_FALSE(plausibility_current_mirrored(&st, exchanged(large_A, 1), large_A, 20.0f));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_what_is_no_limit);
    RUN_TEST(test_a_stall_time_is_whole_looks_to_the_nearest);
    RUN_TEST(test_other_periods_keep_the_times);
    RUN_TEST(test_a_voltage_may_differ_by_volts_and_a_share);
    RUN_TEST(test_a_voltage_may_differ_twice_as_much_beside_a_leg_without_current);
    RUN_TEST(test_a_phase_without_the_current_asked_for_is_open);
    RUN_TEST(test_a_phase_of_which_little_is_asked_may_be_without_current);
    RUN_TEST(test_phases_do_not_count_for_each_other);
    RUN_TEST(test_a_phase_that_often_passes_zero_is_not_open);
    RUN_TEST(test_an_estimate_that_stays_away_from_the_current_is_wrong);
    RUN_TEST(test_a_flux_far_below_its_reference_is_wrong);
    RUN_TEST(test_at_speed_half_the_flux_is_wrong);
    RUN_TEST(test_a_power_that_does_not_fit_torque_and_speed_is_wrong);
    RUN_TEST(test_a_speed_that_changes_as_none_can_is_wrong);
    RUN_TEST(test_all_torque_and_no_speed_is_a_stall);
    RUN_TEST(test_a_slow_shaft_that_does_not_turn_is_a_stall);
    RUN_TEST(test_a_limit_of_zero_asks_nothing);
    RUN_TEST(test_two_exchanged_sensors_show_a_mirror_image);
    RUN_TEST(test_a_mirror_image_fits_within_a_tenth);
    RUN_TEST(test_no_other_error_is_a_mirror_image);
    RUN_TEST(test_a_mirror_image_is_told_when_it_lasts_and_is_large);
    return UNITY_END();
}
