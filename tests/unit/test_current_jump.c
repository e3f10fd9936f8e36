/* Current words that jump to stay, and what else a current does. */
#include "current_jump.h"

#include "exact.h"

/* 50 V change the current by 1 A in a period; 1.6 A are a jump. */
#define PERIOD_S   2e-4f
#define SIGMA_LS_H 0.01f
#define TRIP_A     20.0f

static current_jump_config_t cfg;
static current_jump_state_t st;
static ab_t i_A; /* of the motor */
static ab_t e_V;
static float gain;

void setUp(void)
{
    current_jump_init(&cfg, PERIOD_S, SIGMA_LS_H, TRIP_A);
    st = (current_jump_state_t){0};
    i_A = (ab_t){8.0f, -6.0f};
    e_V = (ab_t){30.0f, 40.0f};
    gain = 1.0f;
}

void tearDown(void)
{
}

/* A motor without resistance, whose leakage is `of_told` of what is told. */
static bool period(ab_t u_V, float of_told)
{
    i_A = ab_add(i_A, ab_scale(ab_sub(u_V, e_V), PERIOD_S / (SIGMA_LS_H * of_told)));
    return current_jump_step(&cfg, &st, ab_scale(i_A, gain), u_V);
}

/* Steady, with its voltage. */
static void settle(void)
{
    for (int k = 0; k < 4; k++) {
        TEST_ASSERT_FALSE(period(e_V, 1.0f));
    }
}

static void test_a_share_of_the_trip_is_a_jump(void)
{
    ASSERT_SAME_FLOAT(PERIOD_S / SIGMA_LS_H, cfg.A_per_V);
    ASSERT_NEAR(1e-5, 2.56, cfg.jump_A2);
}

static void test_a_steady_current_is_where_it_was(void)
{
    settle();
    for (int k = 0; k < 1000; k++) {
        TEST_ASSERT_FALSE(period(e_V, 1.0f));
    }
    ASSERT_SAME_FLOAT(8.0f, st.i_A.alpha);
    ASSERT_NEAR(1e-5, -0.6, st.rest_A.alpha); /* the EMF's share */
    ASSERT_NEAR(1e-5, -0.8, st.rest_A.beta);
}

/* 10 A times the change of the gain: 1.6 A are a jump. */
static void test_a_gain_that_changes_is_told_in_the_next_period(void)
{
    const float gains[] = {0.0f, 0.5f, 0.83f, 1.17f, 2.0f, -1.0f};
    for (int k = 0; k < 6; k++) {
        setUp();
        settle();
        gain = gains[k];
        TEST_ASSERT_FALSE(period(e_V, 1.0f));
        TEST_ASSERT_TRUE(period(e_V, 1.0f));
        TEST_ASSERT_FALSE(period(e_V, 1.0f));
    }
    setUp();
    settle();
    gain = 0.85f;
    TEST_ASSERT_FALSE(period(e_V, 1.0f));
    TEST_ASSERT_FALSE(period(e_V, 1.0f));
}

static void test_one_disturbed_sample_is_none(void)
{
    settle();
    gain = 0.5f;
    TEST_ASSERT_FALSE(period(e_V, 1.0f));
    gain = 1.0f;
    for (int k = 0; k < 10; k++) {
        TEST_ASSERT_FALSE(period(e_V, 1.0f));
    }
    gain = 0.5f; /* and nothing of it is left */
    TEST_ASSERT_FALSE(period(e_V, 1.0f));
    TEST_ASSERT_TRUE(period(e_V, 1.0f));
}

/* Of the jump of 5 A half may be off in the next period. */
static void test_what_comes_half_way_back_is_none(void)
{
    const float back[] = {0.74f, 0.76f};
    for (int k = 0; k < 2; k++) {
        setUp();
        settle();
        gain = 0.5f;
        TEST_ASSERT_FALSE(period(e_V, 1.0f));
        gain = back[k];
        TEST_ASSERT_EQUAL(k == 0, period(e_V, 1.0f));
    }
}

/* A current that its voltage explains, up and down, with a leakage that is told wrong. */
static void test_a_current_may_follow_its_voltage(void)
{
    const float of_told[] = {0.42f, 1.0f, 1.57f};
    const ab_t high_V = {330.0f, 40.0f};
    for (int k = 0; k < 3; k++) {
        setUp();
        settle();
        for (int n = 0; n < 8; n++) {
            TEST_ASSERT_FALSE(period(((n % 3) == 0) ? high_V : e_V, of_told[k]));
        }
        TEST_ASSERT_FALSE(period(high_V, of_told[k]));
        TEST_ASSERT_FALSE(period(high_V, of_told[k]));
    }
}

/* 300 V for a period are 6 A; with a share of the leakage more, of which the 6 A are explained. */
static void test_a_leakage_that_is_far_off_is_no_explanation(void)
{
    const float of_told[] = {0.33f, 0.385f};
    for (int k = 0; k < 2; k++) {
        setUp();
        settle();
        TEST_ASSERT_FALSE(period((ab_t){330.0f, 40.0f}, of_told[k]));
        TEST_ASSERT_TRUE(period(e_V, of_told[k]));
    }
}

/* The place is that of the last period: an EMF that grows takes it along. */
static void test_the_place_moves_with_the_emf(void)
{
    settle();
    for (int k = 0; k < 100; k++) {
        e_V.alpha += 5.0f;
        TEST_ASSERT_FALSE(period(e_V, 1.0f));
    }
    gain = 0.5f;
    TEST_ASSERT_FALSE(period(e_V, 1.0f));
    TEST_ASSERT_TRUE(period(e_V, 1.0f));
}

/* Each limit itself is within. */
static void test_what_is_at_a_limit(void)
{
    const current_jump_config_t one = {.A_per_V = 1.0f, .jump_A2 = 4.0f};
    const ab_t two_A = {2.0f, 0.0f};
    st = (current_jump_state_t){.seen = CURRENT_JUMP_STEADY, .rest_A = {-1.0f, 0.0f}};
    TEST_ASSERT_FALSE(current_jump_step(&one, &st, two_A, (ab_t){0.0f, 0.0f}));
    TEST_ASSERT_EQUAL(CURRENT_JUMP_STEADY, st.seen);
    st = (current_jump_state_t){.seen = CURRENT_JUMP_STEADY};
    TEST_ASSERT_FALSE(current_jump_step(&one, &st, (ab_t){3.0f, 0.0f}, (ab_t){1.0f, 0.0f}));
    TEST_ASSERT_EQUAL(CURRENT_JUMP_STEADY, st.seen);
    st = (current_jump_state_t){.seen = CURRENT_JUMP_OFF, .off_A2 = 16.0f};
    TEST_ASSERT_TRUE(current_jump_step(&one, &st, two_A, (ab_t){0.0f, 0.0f}));
}

/* A change without the voltage that it takes, from a d that stands at its place. */
static void test_a_large_change_that_is_explained_moves_the_place(void)
{
    settle();
    e_V = (ab_t){-370.0f, 40.0f}; /* the EMF itself: no sensor */
    TEST_ASSERT_FALSE(period((ab_t){30.0f, 40.0f}, 1.0f));
    TEST_ASSERT_FALSE(period((ab_t){30.0f, 40.0f}, 1.0f));
    ASSERT_NEAR(1e-4, 7.4, st.rest_A.alpha);
    TEST_ASSERT_EQUAL(CURRENT_JUMP_STEADY, st.seen);
}

/* Whatever flows and turns when the gates go on: the third sample is the first that is judged. */
static void test_a_start_is_none(void)
{
    e_V = (ab_t){0.0f, 180.0f};
    for (int k = 0; k < 3; k++) {
        TEST_ASSERT_EQUAL((current_jump_seen_t)k, st.seen);
        TEST_ASSERT_FALSE(period((ab_t){0.0f, 0.0f}, 1.0f));
    }
    gain = 0.5f;
    TEST_ASSERT_FALSE(period((ab_t){0.0f, 0.0f}, 1.0f));
    TEST_ASSERT_TRUE(period((ab_t){0.0f, 0.0f}, 1.0f));
}

static void test_a_number_that_is_none_heals(void)
{
    for (int k = 0; k < NOT_FINITE_COUNT; k++) {
        setUp();
        settle();
        st.rest_A.alpha = not_finite(k);
        st.off_A2 = not_finite(k);
        st.seen = (current_jump_seen_t)(CURRENT_JUMP_OFF + k);
        for (int n = 0; n < 3; n++) {
            (void)period(e_V, 1.0f);
        }
        gain = 0.5f;
        TEST_ASSERT_FALSE(period(e_V, 1.0f));
        TEST_ASSERT_TRUE(period(e_V, 1.0f));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_share_of_the_trip_is_a_jump);
    RUN_TEST(test_a_steady_current_is_where_it_was);
    RUN_TEST(test_a_gain_that_changes_is_told_in_the_next_period);
    RUN_TEST(test_one_disturbed_sample_is_none);
    RUN_TEST(test_what_comes_half_way_back_is_none);
    RUN_TEST(test_a_current_may_follow_its_voltage);
    RUN_TEST(test_a_leakage_that_is_far_off_is_no_explanation);
    RUN_TEST(test_the_place_moves_with_the_emf);
    RUN_TEST(test_what_is_at_a_limit);
    RUN_TEST(test_a_large_change_that_is_explained_moves_the_place);
    RUN_TEST(test_a_start_is_none);
    RUN_TEST(test_a_number_that_is_none_heals);
    return UNITY_END();
}
