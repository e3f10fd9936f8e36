#include "plausibility.h"

#include <math.h>

#include "lasting.h"
#include "unity.h"

#define TURN_S 3.2e-3f

static const plausibility_params_t all = {
    .u_V = 3.0f, .open_A = 1.2f, .e1_A = 5.0f, .stall_s = 0.32f};
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
    ASSERT_REFUSED(stall_s, -1.0f);
    ASSERT_REFUSED(stall_s, 3201.0f);
    TEST_ASSERT_FALSE(plausibility_init(&cfg, &all, 0.0f));
}

/* How many times on end until the answer is yes; 1000: never. */
static int times_until_wrong_voltage(ab_t sensed_V, ab_t duty_V)
{
    int n = 1;
    while (!plausibility_voltage_wrong(&cfg, &st, sensed_V, duty_V) && (n < 1000)) {
        n++;
    }
    return n;
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
        TEST_ASSERT_EQUAL_UINT32(6u * LASTING_WEIGHT, st.phase[x]);
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

static int times_until_wrong_estimate(ab_t e1_A)
{
    int n = 1;
    while (!plausibility_estimate_wrong(&cfg, &st, e1_A) && (n < 1000)) {
        n++;
    }
    return n;
}

static void test_an_estimate_that_stays_away_from_the_current_is_wrong(void)
{
    TEST_ASSERT_EQUAL_INT(1000, times_until_wrong_estimate((ab_t){2.9f, 4.0f}));
    TEST_ASSERT_EQUAL_INT(60, times_until_wrong_estimate((ab_t){-3.1f, -4.0f}));
    st = (plausibility_state_t){0};
    TEST_ASSERT_EQUAL_INT(60, times_until_wrong_estimate((ab_t){0.0f, NAN}));
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
    TEST_ASSERT_EQUAL_INT(1000, times_until_stalled(true, 0.0f, 5.9f));   /* it is to stand still */
}

static void test_a_limit_of_zero_asks_nothing(void)
{
    const plausibility_params_t none = {0};
    TEST_ASSERT_TRUE(plausibility_init(&cfg, &none, TURN_S));
    TEST_ASSERT_EQUAL_INT(1000, times_until_wrong_voltage((ab_t){200.0f, 0.0f}, (ab_t){0}));
    TEST_ASSERT_EQUAL_INT(1000, times_until_open((uvw_t){0}, (ab_t){10.0f, 0.0f}));
    TEST_ASSERT_EQUAL_INT(1000, times_until_wrong_estimate((ab_t){50.0f, 0.0f}));
    TEST_ASSERT_EQUAL_INT(1000, times_until_stalled(true, 0.0f, 100.0f));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_what_is_no_limit);
    RUN_TEST(test_a_voltage_may_differ_by_volts_and_a_share);
    RUN_TEST(test_a_phase_without_the_current_asked_for_is_open);
    RUN_TEST(test_a_phase_of_which_little_is_asked_may_be_without_current);
    RUN_TEST(test_phases_do_not_count_for_each_other);
    RUN_TEST(test_an_estimate_that_stays_away_from_the_current_is_wrong);
    RUN_TEST(test_all_torque_and_no_speed_is_a_stall);
    RUN_TEST(test_a_limit_of_zero_asks_nothing);
    return UNITY_END();
}
