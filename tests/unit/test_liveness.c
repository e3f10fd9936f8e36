/* Current words that stand still: when that is a fault, and when it is right. */
#include "liveness.h"

#include <math.h>

#include "exact.h"

/* A tenth of 20 A and 8 counts may stay unseen: 2.08 A. A volt asks for .02 A in a period, and for
 * 1/1.5 A for good: x(n) = v/1.5 (1 - .97^n). 7 repeats count. */
static const liveness_params_t params = {.period_s = 2e-4f,
                                         .Rs_ohm = 1.5f,
                                         .sigma_Ls_H = 0.01f,
                                         .i_trip_A = 20.0f,
                                         .A_per_count = 0.01f};
static liveness_config_t cfg;
static liveness_state_t st;
static uvw_t i_A;
static liveness_in_t in;

static bool step(void)
{
    return liveness_repeats(&st, &i_A) && liveness_frozen(&cfg, &st, &in);
}

/* 4 A of direct current along u; the voltage is what 1.5 ohm take. */
void setUp(void)
{
    TEST_ASSERT_TRUE(liveness_init(&cfg, &params));
    st = (liveness_state_t){0};
    i_A = (uvw_t){3.266f, -1.633f, -1.633f};
    in = (liveness_in_t){.i_s_A = {4.0f, 0.0f}, .u_V = {6.0f, 0.0f}};
    TEST_ASSERT_FALSE(step());
}

void tearDown(void)
{
}

/* Periods until it is told; 0: not within `most`. */
static int told_after(int most)
{
    for (int k = 1; k <= most; k++) {
        if (step()) {
            return k;
        }
    }
    return 0;
}

/* With the gates off: noise of the given size about zero, in each phase that `phases` names. */
static void rest(int looks, float noise_A, unsigned phases)
{
    for (int k = 0; k < looks; k++) {
        const float now_A = ((k % 2) == 0) ? noise_A : 0.0f;
        liveness_look(&cfg, &st.noise,
                      (uvw_t){((phases & 1u) != 0u) ? now_A : 0.0f,
                              ((phases & 2u) != 0u) ? now_A : 0.0f,
                              ((phases & 4u) != 0u) ? now_A : 0.0f});
    }
}

static void test_init_refuses_what_is_no_positive_number(void)
{
    for (int k = 0; k < 5; k++) {
        liveness_params_t p = params;
        float *const number[] = {&p.period_s, &p.Rs_ohm, &p.sigma_Ls_H, &p.i_trip_A,
                                 &p.A_per_count};
        *number[k] = 0.0f;
        TEST_ASSERT_FALSE(liveness_init(&cfg, &p));
        *number[k] = NAN;
        TEST_ASSERT_FALSE(liveness_init(&cfg, &p));
    }
}

static void test_init_refuses_a_current_that_decays_within_a_period(void)
{
    liveness_params_t p = params;
    p.period_s = 6.6e-3f;
    TEST_ASSERT_TRUE(liveness_init(&cfg, &p));
    p.period_s = 6.7e-3f;
    TEST_ASSERT_FALSE(liveness_init(&cfg, &p));
}

static void test_direct_current_of_a_quiet_converter_may_stand_still(void)
{
    TEST_ASSERT_EQUAL_INT(0, told_after(100000));
    TEST_ASSERT_EQUAL_UINT32(100000u, st.repeats);
}

/* 12 V in excess: 8 A (1 - .97^n), of which .4 of the 4 A is allowed, 1.6 A (1 - .97^n), and
 * 2.08 A. With 6.4 A (1 - .97^n) that is the 13th period. */
static void test_a_voltage_that_asks_for_a_change_that_does_not_come_is_told(void)
{
    in.u_V.alpha = 18.0f;
    TEST_ASSERT_EQUAL_INT(13, told_after(100));
    setUp();
    in.u_V.beta = -12.0f;
    TEST_ASSERT_EQUAL_INT(13, told_after(100));
}

/* For good: 3.68 A times 1.5 ohm. */
static void test_a_small_voltage_asks_for_a_small_change(void)
{
    in.u_V.beta = 5.45f;
    TEST_ASSERT_EQUAL_INT(0, told_after(10000));
    setUp();
    in.u_V.beta = 5.6f;
    TEST_ASSERT_NOT_EQUAL(0, told_after(10000));
}

static void test_a_turning_point_of_a_current_is_no_spell(void)
{
    in.u_V.alpha = 200.0f;
    TEST_ASSERT_EQUAL_INT(7, told_after(100));
}

static void test_coarse_words_stand_still_for_longer(void)
{
    liveness_params_t p = params;
    p.A_per_count = 0.2f; /* 2 + 20 repeats */
    TEST_ASSERT_TRUE(liveness_init(&cfg, &p));
    in.u_V.alpha = 200.0f;
    TEST_ASSERT_EQUAL_INT(23, told_after(100));
}

static void test_a_change_that_is_taken_back_is_no_demand(void)
{
    for (int k = 0; k < 10; k++) {
        in.u_V.alpha = 18.0f;
        TEST_ASSERT_EQUAL_INT(0, told_after(12));
        in.u_V.alpha = -6.0f;
        TEST_ASSERT_EQUAL_INT(0, told_after(12));
    }
}

static void test_each_of_the_words_that_moves_ends_a_spell(void)
{
    float *const word[] = {&i_A.u, &i_A.v, &i_A.w};
    in.u_V.alpha = 18.0f;
    for (int k = 0; k < 3; k++) {
        TEST_ASSERT_EQUAL_INT(0, told_after(12));
        *word[k] += 0.01f;
        TEST_ASSERT_FALSE(step());
        TEST_ASSERT_EQUAL_UINT32(0u, st.repeats);
    }
    TEST_ASSERT_EQUAL_INT(13, told_after(100));
}

/* What the EMF was before the spell explains the voltage: 20 V of it, and .4 of it that may
 * have changed. For good: 2.08 A and (2.4 + 8) V/1.5 ohm are 13.5 V. */
static void test_the_emf_of_before_explains_and_may_change_by_two_fifths(void)
{
    const float u_V[] = {20.0f, 33.3f, 6.7f, 33.8f, 6.2f};
    for (int k = 0; k < 5; k++) {
        setUp();
        in.emf_V = (ab_t){0.0f, 20.0f};
        in.u_V.beta = u_V[k];
        TEST_ASSERT_EQUAL(k >= 3, told_after(10000) != 0);
    }
}

static void test_a_spell_keeps_the_emf_of_its_beginning(void)
{
    in.u_V.beta = 12.0f;
    TEST_ASSERT_EQUAL_INT(0, told_after(1));
    in.emf_V = (ab_t){0.0f, 12.0f};
    TEST_ASSERT_EQUAL_INT(12, told_after(1000));
}

/* Below 1 A the field may have any direction: the EMF may have turned round. */
static void test_a_small_current_says_nothing_of_the_field(void)
{
    in.i_s_A.alpha = 0.9f;
    in.emf_V = (ab_t){0.0f, 100.0f};
    in.u_V = (ab_t){1.35f, -99.0f};
    TEST_ASSERT_EQUAL_INT(0, told_after(1000));
    setUp();
    in.i_s_A.alpha = 1.1f;
    in.emf_V = (ab_t){0.0f, 100.0f};
    in.u_V = (ab_t){1.65f, -100.0f};
    TEST_ASSERT_EQUAL_INT(7, told_after(1000));
    setUp();
    liveness_params_t p = params;
    p.A_per_count = 0.1f; /* 16 counts are 1.6 A */
    TEST_ASSERT_TRUE(liveness_init(&cfg, &p));
    in.i_s_A.alpha = 1.1f;
    in.emf_V = (ab_t){0.0f, 100.0f};
    in.u_V = (ab_t){1.65f, -100.0f};
    TEST_ASSERT_EQUAL_INT(0, told_after(1000));
}

/* Of 540 V the legs may lose 10.8 V more: for good 2.08 A and 10.8 V/1.5 ohm are 13.9 V. */
static void test_beside_a_small_current_the_legs_may_lose_more(void)
{
    const float u_V[] = {13.8f, 14.1f, 3.0f, 3.2f};
    for (int k = 0; k < 4; k++) {
        setUp();
        in.i_s_A.alpha = 0.0f;
        in.u_dc_V = (k < 2) ? 540.0f : 0.0f;
        in.u_V.alpha = u_V[k];
        TEST_ASSERT_EQUAL((k % 2) == 1, told_after(10000) != 0);
    }
    setUp();
    in.u_dc_V = 540.0f;
    in.u_V.alpha = 20.0f; /* 4 A are not small: 3.68 A more are 11.5 V */
    TEST_ASSERT_TRUE(told_after(10000) != 0);
}

static void test_words_that_flickered_may_not_stand_still(void)
{
    rest(40, 0.02f, 7u);
    TEST_ASSERT_EQUAL_INT(40, told_after(1000));
    TEST_ASSERT_TRUE(step());
}

static void test_all_three_words_have_to_flicker(void)
{
    const unsigned phases[] = {3u, 5u, 6u, 0u};
    for (int k = 0; k < 4; k++) {
        setUp();
        rest(20, 0.02f, phases[k]);
        TEST_ASSERT_EQUAL_INT(0, told_after(1000));
    }
}

/* 4 A of direct current in one word, noise in the other two. */
static void test_a_word_that_stands_away_from_zero_does_not_flicker(void)
{
    for (int k = 0; k < 3; k++) {
        setUp();
        for (int look = 0; look < 20; look++) {
            const float now_A = ((look % 2) == 0) ? 0.02f : 0.0f;
            uvw_t words_A = {now_A, now_A, now_A};
            float *const word[] = {&words_A.u, &words_A.v, &words_A.w};
            *word[k] = 4.0f;
            liveness_look(&cfg, &st.noise, words_A);
        }
        TEST_ASSERT_EQUAL_INT(0, told_after(1000));
    }
}

/* One count, as at the edge of a code, is no noise. Thirteen jumps make it known; 26 are as many as
 * count, and 67 looks without one forget them. */
static void test_noise_is_learnt_from_jumps_of_two_counts(void)
{
    rest(1000, 0.01f, 7u);
    TEST_ASSERT_EQUAL_INT(0, told_after(1000));
    setUp();
    rest(13, 0.02f, 7u);
    TEST_ASSERT_EQUAL_INT(40, told_after(1000));
    setUp();
    rest(12, 0.02f, 7u);
    TEST_ASSERT_EQUAL_INT(0, told_after(1000));
    for (int quiet = 66; quiet <= 67; quiet++) {
        setUp();
        rest(1000, 0.02f, 7u); /* the last is 0 */
        rest(quiet, 0.0f, 7u);
        TEST_ASSERT_EQUAL_UINT32(130u - (uint32_t)quiet, st.noise.jumps[1]);
        TEST_ASSERT_EQUAL_INT((quiet == 66) ? 40 : 0, told_after(1000));
    }
}

/* One sample in seven: no. In five: known, and never more than is counted. */
static void test_noise_takes_a_sixth_of_the_samples(void)
{
    for (int k = 0; k < 1000; k++) {
        rest(1, ((k % 14) < 7) ? 0.02f : 0.0f, 7u);
    }
    TEST_ASSERT_EQUAL_INT(0, told_after(1000));
    setUp();
    for (int k = 0; k < 1000; k++) {
        rest(1, ((k % 10) < 5) ? 0.02f : 0.0f, 7u);
    }
    TEST_ASSERT_EQUAL_INT(40, told_after(1000));
}

/* Looks with the gates on until it is told; the words of `live` phases move. 0: not within most. */
static int word_told_after(int most, unsigned live)
{
    for (int k = 1; k <= most; k++) {
        const float moved_A = ((k % 2) == 0) ? 0.01f : 0.0f;
        const uvw_t words_A = {i_A.u + (((live & 1u) != 0u) ? moved_A : 0.0f),
                               i_A.v + (((live & 2u) != 0u) ? moved_A : 0.0f),
                               i_A.w + (((live & 4u) != 0u) ? moved_A : 0.0f)};
        if (liveness_word_frozen(&st, words_A)) {
            return k;
        }
    }
    return 0;
}

/* The first look only sees it. */
static void test_one_word_that_flickered_may_not_stand_still(void)
{
    for (unsigned x = 0u; x < 3u; x++) {
        const unsigned word = 1u << x;
        setUp();
        rest(40, 0.02f, word);
        TEST_ASSERT_EQUAL_INT(81, word_told_after(1000, 7u & ~word));
        TEST_ASSERT_EQUAL_INT(1, word_told_after(1, 7u & ~word)); /* and goes on */
        setUp();
        rest(40, 0.02f, word);
        TEST_ASSERT_EQUAL_INT(0, word_told_after(1000, word)); /* the others never flickered */
    }
    setUp();
    TEST_ASSERT_EQUAL_INT(0, word_told_after(1000, 0u));
}

static void test_a_word_that_moves_once_starts_its_count_again(void)
{
    rest(40, 0.02f, 7u);
    TEST_ASSERT_EQUAL_INT(0, word_told_after(80, 0u));
    i_A.v += 0.01f;
    i_A.w += 0.01f;
    TEST_ASSERT_EQUAL_INT(1, word_told_after(1, 0u)); /* of u, which stood */
    i_A.u += 0.01f;
    TEST_ASSERT_EQUAL_INT(80, word_told_after(1000, 0u));
}

static void test_no_number_is_beyond_every_limit(void)
{
    in.u_V.alpha = NAN;
    TEST_ASSERT_EQUAL_INT(7, told_after(10));
    setUp();
    TEST_ASSERT_EQUAL_INT(0, told_after(1));
    st.demand_A.beta = INFINITY;
    TEST_ASSERT_EQUAL_INT(6, told_after(10));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_what_is_no_positive_number);
    RUN_TEST(test_init_refuses_a_current_that_decays_within_a_period);
    RUN_TEST(test_direct_current_of_a_quiet_converter_may_stand_still);
    RUN_TEST(test_a_voltage_that_asks_for_a_change_that_does_not_come_is_told);
    RUN_TEST(test_a_small_voltage_asks_for_a_small_change);
    RUN_TEST(test_a_turning_point_of_a_current_is_no_spell);
    RUN_TEST(test_coarse_words_stand_still_for_longer);
    RUN_TEST(test_a_change_that_is_taken_back_is_no_demand);
    RUN_TEST(test_each_of_the_words_that_moves_ends_a_spell);
    RUN_TEST(test_the_emf_of_before_explains_and_may_change_by_two_fifths);
    RUN_TEST(test_a_spell_keeps_the_emf_of_its_beginning);
    RUN_TEST(test_a_small_current_says_nothing_of_the_field);
    RUN_TEST(test_beside_a_small_current_the_legs_may_lose_more);
    RUN_TEST(test_words_that_flickered_may_not_stand_still);
    RUN_TEST(test_all_three_words_have_to_flicker);
    RUN_TEST(test_a_word_that_stands_away_from_zero_does_not_flicker);
    RUN_TEST(test_noise_is_learnt_from_jumps_of_two_counts);
    RUN_TEST(test_noise_takes_a_sixth_of_the_samples);
    RUN_TEST(test_one_word_that_flickered_may_not_stand_still);
    RUN_TEST(test_a_word_that_moves_once_starts_its_count_again);
    RUN_TEST(test_no_number_is_beyond_every_limit);
    return UNITY_END();
}
