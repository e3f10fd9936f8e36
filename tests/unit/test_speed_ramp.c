/* The reference arrives, exactly, with acceleration and jerk within their limits. */
#include "speed_ramp.h"

#include <math.h>
#include <stdlib.h>

#include "unity.h"

#define PERIOD_S 200e-6f

static const speed_ramp_params_t good = {
    .acceleration_rad_s2 = 400.0f, .jerk_rad_s3 = 4000.0f, .stop_rad_s2 = 200.0f};

static speed_ramp_config_t cfg;
static speed_ramp_state_t st;

void setUp(void)
{
    st = (speed_ramp_state_t){0};
    TEST_ASSERT_TRUE(speed_ramp_init(&cfg, &good, PERIOD_S));
}

void tearDown(void)
{
}

/* What a profile did: to be compared with the limits in double precision. */
typedef struct {
    float at_rad_s;
    double most_rad_s2;
    double most_rad_s3;
    double beyond_rad_s; /* past the target, seen from where it came */
    int periods;         /* until exactly there with no acceleration left */
} profile_t;

static profile_t go(float from_rad_s, float target_rad_s, bool stop, int limit)
{
    profile_t p = {.at_rad_s = from_rad_s};
    const double T = (double)PERIOD_S;
    double a = (double)(st.steps * cfg.quantum_rad_s) / T;
    const double way = (target_rad_s >= from_rad_s) ? 1.0 : -1.0;
    while (p.periods < limit) {
        const float next = speed_ramp_step(&cfg, &st, p.at_rad_s, target_rad_s, stop);
        const double a_next = ((double)next - (double)p.at_rad_s) / T;
        p.most_rad_s2 = fmax(p.most_rad_s2, fabs(a_next));
        p.most_rad_s3 = fmax(p.most_rad_s3, fabs(a_next - a) / T);
        p.beyond_rad_s = fmax(p.beyond_rad_s, way * ((double)next - (double)target_rad_s));
        a = a_next;
        p.at_rad_s = next;
        p.periods++;
        if ((fabs((double)next - (double)target_rad_s) <= 0.0) && (st.steps == 0.0f)) {
            return p;
        }
    }
    return p;
}

/* A float near `speed` is so coarse, and two of them make an acceleration. */
static double coarse(float speed_rad_s)
{
    return 2.0 * 6e-8 * fmax(fabs((double)speed_rad_s), 1.0) / (double)PERIOD_S;
}

static void assert_within(const profile_t *p, float most_rad_s, double a_rad_s2)
{
    const double slack_rad_s2 = coarse(most_rad_s);
    TEST_ASSERT_TRUE(p->most_rad_s2 <= a_rad_s2 + slack_rad_s2);
    TEST_ASSERT_TRUE(p->most_rad_s3 <= 4000.0 * 1.00001 + 2.0 * slack_rad_s2 / (double)PERIOD_S);
}

static void test_a_long_way_is_as_fast_as_the_limits_allow(void)
{
    const profile_t p = go(0.0f, 200.0f, false, 100000);
    TEST_ASSERT_EQUAL_FLOAT(200.0f, p.at_rad_s);
    assert_within(&p, 200.0f, 400.0);
    TEST_ASSERT_TRUE(p.most_rad_s2 > 399.0);
    TEST_ASSERT_TRUE(p.beyond_rad_s <= 0.0);
    /* dw/a + a/j = .5 s + .1 s = 3000 periods, and a few for the whole numbers. */
    TEST_ASSERT_INT_WITHIN(8, 3000, p.periods);
}

static void test_a_short_way_never_reaches_the_acceleration(void)
{
    const profile_t p = go(0.0f, 10.0f, false, 100000);
    TEST_ASSERT_EQUAL_FLOAT(10.0f, p.at_rad_s);
    TEST_ASSERT_TRUE(p.beyond_rad_s <= 0.0);
    /* 2 sqrt(dw/j) = .1 s; the peak is sqrt(dw j) = 200 rad/s^2. */
    TEST_ASSERT_INT_WITHIN(8, 500, p.periods);
    TEST_ASSERT_DOUBLE_WITHIN(2.0, 200.0, p.most_rad_s2);
}

static void test_a_reversal_passes_zero_with_full_acceleration(void)
{
    const profile_t p = go(150.0f, -150.0f, false, 100000);
    TEST_ASSERT_EQUAL_FLOAT(-150.0f, p.at_rad_s);
    assert_within(&p, 150.0f, 400.0);
    TEST_ASSERT_TRUE(p.beyond_rad_s <= 0.0);
    TEST_ASSERT_INT_WITHIN(8, 4250, p.periods); /* 300/400 + 400/4000 s */
}

static void test_both_directions_are_mirror_images(void)
{
    speed_ramp_state_t other = {0};
    float up = 0.0f;
    float down = 0.0f;
    for (int k = 0; k < 4000; k++) {
        up = speed_ramp_step(&cfg, &st, up, 123.4f, false);
        down = speed_ramp_step(&cfg, &other, down, -123.4f, false);
        TEST_ASSERT_EQUAL_FLOAT(-up, down);
    }
    TEST_ASSERT_EQUAL_FLOAT(123.4f, up);
}

static void test_arrived_it_stays(void)
{
    TEST_ASSERT_EQUAL_FLOAT(77.7f, speed_ramp_step(&cfg, &st, 77.7f, 77.7f, false));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.steps);
}

static void test_a_stop_has_its_own_acceleration(void)
{
    const profile_t p = go(100.0f, 0.0f, true, 100000);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, p.at_rad_s);
    assert_within(&p, 100.0f, 200.0);
    TEST_ASSERT_TRUE(p.most_rad_s2 > 199.0);
    TEST_ASSERT_INT_WITHIN(8, 2750, p.periods); /* 100/200 + 200/4000 s */
}

static float random_within(float most)
{
    return most * (2.0f * (float)rand() / (float)RAND_MAX - 1.0f);
}

/* Any limits, any way from rest: arrives exactly, never past it, never beyond a limit. */
static void test_any_way_from_rest(void)
{
    srand(1);
    for (int n = 0; n < 2000; n++) {
        const speed_ramp_params_t params = {.acceleration_rad_s2 = 60.0f + random_within(50.0f),
                                            .jerk_rad_s3 = 4000.0f,
                                            .stop_rad_s2 = 30.0f};
        setUp();
        TEST_ASSERT_TRUE(speed_ramp_init(&cfg, &params, PERIOD_S));
        const float from_rad_s = random_within(6.0f);
        const float target_rad_s = random_within(6.0f);
        const profile_t p = go(from_rad_s, target_rad_s, false, 20000);
        TEST_ASSERT_TRUE(p.periods < 20000);
        TEST_ASSERT_TRUE(p.beyond_rad_s <= 0.0);
        assert_within(&p, 6.0f, (double)params.acceleration_rad_s2);
    }
}

/* A target that changes on the way may be passed, by what the jerk limit makes inevitable and no
 * more; jerk and acceleration stay within their limits all the time. */
static void test_a_target_that_changes_on_the_way(void)
{
    srand(2);
    float at = 0.0f;
    for (int n = 0; n < 2000; n++) {
        const float target_rad_s = random_within(50.0f);
        const double a = (double)(st.steps * cfg.quantum_rad_s) / (double)PERIOD_S;
        const profile_t p = go(at, target_rad_s, (n % 5) == 0, rand() % 700);
        /* Ending a takes a^2/(2 j), a period more for the whole numbers. */
        const double inevitable = a * a / (2.0 * 4000.0) + 400.0 * 2.0 * (double)PERIOD_S;
        TEST_ASSERT_TRUE(p.beyond_rad_s <= inevitable);
        assert_within(&p, 60.0f, 400.0);
        at = p.at_rad_s;
    }
    const profile_t p = go(at, 12.5f, false, 100000);
    TEST_ASSERT_EQUAL_FLOAT(12.5f, p.at_rad_s);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, st.steps);
}

/* From more acceleration than a stop allows: down by one quantum a period, like everything. */
static void test_a_stop_out_of_the_full_acceleration(void)
{
    float at = 0.0f;
    for (int k = 0; k < 1000; k++) {
        at = speed_ramp_step(&cfg, &st, at, 200.0f, false);
    }
    TEST_ASSERT_EQUAL_FLOAT(500.0f, st.steps);
    (void)speed_ramp_step(&cfg, &st, at, 300.0f, true);
    TEST_ASSERT_EQUAL_FLOAT(499.0f, st.steps);
}

static void test_without_jerk_limit_only_a_stop_is_slow(void)
{
    speed_ramp_params_t params = good;
    params.jerk_rad_s3 = 0.0f;
    TEST_ASSERT_TRUE(speed_ramp_init(&cfg, &params, PERIOD_S));
    TEST_ASSERT_EQUAL_FLOAT(50.0f, speed_ramp_step(&cfg, &st, 1.0f, 50.0f, false));
    TEST_ASSERT_EQUAL_FLOAT(10.0f - 0.04f, speed_ramp_step(&cfg, &st, 10.0f, 0.0f, true));
    TEST_ASSERT_EQUAL_FLOAT(-10.0f + 0.04f, speed_ramp_step(&cfg, &st, -10.0f, 0.0f, true));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, speed_ramp_step(&cfg, &st, 0.01f, 0.0f, true));
}

static void test_a_target_that_is_no_number_moves_nothing(void)
{
    const float bad[] = {NAN, INFINITY, -INFINITY};
    for (int n = 0; n < 3; n++) {
        TEST_ASSERT_EQUAL_FLOAT(20.0f, speed_ramp_step(&cfg, &st, 20.0f, bad[n], false));
        TEST_ASSERT_EQUAL_FLOAT(20.0f, speed_ramp_step(&cfg, &st, 20.0f, bad[n], true));
        TEST_ASSERT_EQUAL_FLOAT(0.0f, st.steps);
    }
}

static void test_init_derives_whole_quanta(void)
{
    TEST_ASSERT_TRUE(cfg.on);
    TEST_ASSERT_EQUAL_FLOAT(1.6e-4f, cfg.quantum_rad_s);
    TEST_ASSERT_EQUAL_FLOAT(500.0f, cfg.steps_max);
    TEST_ASSERT_EQUAL_FLOAT(250.0f, cfg.stop_steps_max);
    TEST_ASSERT_EQUAL_FLOAT(0.04f, cfg.stop_step_rad_s);
    speed_ramp_params_t wild = good;
    wild.acceleration_rad_s2 = 1e9f; /* no slew limit: the jerk alone counts */
    TEST_ASSERT_TRUE(speed_ramp_init(&cfg, &wild, PERIOD_S));
    TEST_ASSERT_EQUAL_FLOAT(4000.0f, cfg.steps_max);
    wild.stop_rad_s2 = 1.2f; /* one quantum, .8, and a half */
    TEST_ASSERT_TRUE(speed_ramp_init(&cfg, &wild, PERIOD_S));
    TEST_ASSERT_EQUAL_FLOAT(1.0f, cfg.stop_steps_max);
}

#define ASSERT_REFUSED(field, value)                                                               \
    do {                                                                                           \
        speed_ramp_params_t bad = good;                                                            \
        bad.field = (value);                                                                       \
        TEST_ASSERT_FALSE_MESSAGE(speed_ramp_init(&c, &bad, PERIOD_S), #field " " #value);         \
        TEST_ASSERT_FALSE(c.on);                                                                   \
    } while (0)

static void test_init_refuses_senseless_limits(void)
{
    speed_ramp_config_t c = {0};
    ASSERT_REFUSED(acceleration_rad_s2, 0.0f);
    ASSERT_REFUSED(acceleration_rad_s2, NAN);
    ASSERT_REFUSED(acceleration_rad_s2, 0.7f); /* below one quantum, .8 */
    ASSERT_REFUSED(stop_rad_s2, -1.0f);
    ASSERT_REFUSED(stop_rad_s2, 0.7f);
    ASSERT_REFUSED(jerk_rad_s3, -1.0f);
    ASSERT_REFUSED(jerk_rad_s3, INFINITY);
    ASSERT_REFUSED(jerk_rad_s3, 1e-38f); /* its quantum is none */
    TEST_ASSERT_FALSE(speed_ramp_init(&c, &good, 0.0f));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_long_way_is_as_fast_as_the_limits_allow);
    RUN_TEST(test_a_short_way_never_reaches_the_acceleration);
    RUN_TEST(test_a_reversal_passes_zero_with_full_acceleration);
    RUN_TEST(test_both_directions_are_mirror_images);
    RUN_TEST(test_arrived_it_stays);
    RUN_TEST(test_a_stop_has_its_own_acceleration);
    RUN_TEST(test_any_way_from_rest);
    RUN_TEST(test_a_target_that_changes_on_the_way);
    RUN_TEST(test_a_stop_out_of_the_full_acceleration);
    RUN_TEST(test_without_jerk_limit_only_a_stop_is_slow);
    RUN_TEST(test_a_target_that_is_no_number_moves_nothing);
    RUN_TEST(test_init_derives_whole_quanta);
    RUN_TEST(test_init_refuses_senseless_limits);
    return UNITY_END();
}
