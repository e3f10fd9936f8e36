/* Sensors against their data sheets; derating, trip, open and short wires. */
#include "temperature.h"

#include <math.h>

#include "unity.h"

#define LOST 10u

static temperature_config_t cfg;
static temperature_state_t st;

void setUp(void)
{
    cfg = (temperature_config_t){.kind = TEMPERATURE_PT1000,
                                 .pullup_ohm = 2200.0f,
                                 .ntc_ohm = 10e3f,
                                 .ntc_beta_K = 3435.0f,
                                 .derate_degC = 80.0f,
                                 .trip_degC = 100.0f,
                                 .lost_steps = LOST};
    TEST_ASSERT_TRUE(temperature_init(&cfg));
    st = (temperature_state_t){0};
}
void tearDown(void)
{
}

static bool give_once(double ohm)
{
    const double above_ohm = (double)cfg.pullup_ohm;
    return temperature_step(&cfg, &st, (uint16_t)lround(65536.0 * ohm / (ohm + above_ohm)), 1u);
}

/* Until the filter has settled. */
static bool give_ohm(double ohm)
{
    bool lost = false;
    for (uint32_t k = 0u; k < 400u; k++) {
        lost = give_once(ohm);
    }
    return lost;
}

/* IEC 60751 above 0 degC. */
static double pt1000_ohm(double degC)
{
    return 1000.0 * (1.0 + 3.9083e-3 * degC - 5.775e-7 * degC * degC);
}

static void refused(float *number, float wrong)
{
    const float right = *number;
    *number = wrong;
    TEST_ASSERT_FALSE(temperature_init(&cfg));
    *number = right;
    TEST_ASSERT_TRUE(temperature_init(&cfg));
}

static void test_init_refuses_what_is_outside_its_range(void)
{
    refused(&cfg.pullup_ohm, 0.0f);
    refused(&cfg.derate_degC, -40.0f);
    refused(&cfg.derate_degC, 100.0f);
    refused(&cfg.derate_degC, NAN);
    refused(&cfg.trip_degC, 250.0f);
    refused(&cfg.trip_degC, NAN);
    cfg.ntc_ohm = 0.0f; /* a PT1000 has none */
    TEST_ASSERT_TRUE(temperature_init(&cfg));
    cfg.kind = TEMPERATURE_NTC;
    TEST_ASSERT_FALSE(temperature_init(&cfg));
    cfg.ntc_ohm = 10e3f;
    refused(&cfg.ntc_beta_K, -1.0f);
    cfg.kind = 4u;
    TEST_ASSERT_FALSE(temperature_init(&cfg));
    cfg.kind = TEMPERATURE_KTY84;
    TEST_ASSERT_TRUE(temperature_init(&cfg));
    cfg.lost_steps = 1u;
    TEST_ASSERT_TRUE(temperature_init(&cfg));
    cfg.lost_steps = 0u;
    TEST_ASSERT_FALSE(temperature_init(&cfg));
    cfg.kind = TEMPERATURE_OFF;
    TEST_ASSERT_TRUE(temperature_init(&cfg));
}

static void test_off_nothing_is_measured(void)
{
    cfg.kind = TEMPERATURE_OFF;
    for (uint32_t k = 0u; k < 10u * LOST; k++) {
        TEST_ASSERT_FALSE(temperature_step(&cfg, &st, 0u, 1u));
    }
    TEST_ASSERT_FALSE(temperature_step(&cfg, &st, 65000u, 1u));
    TEST_ASSERT_FALSE(st.known);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, temperature_share_pu(&cfg, &st));
}

static void test_pt1000_is_that_of_iec_60751(void)
{
    const float degC[] = {0.0f, 50.0f, 100.0f, 200.0f};
    const float ohm[] = {1000.0f, 1193.97f, 1385.06f, 1758.56f};
    for (uint32_t k = 0u; k < 4u; k++) {
        TEST_ASSERT_FLOAT_WITHIN(0.05f, degC[k], temperature_degC(&cfg, ohm[k]));
    }
    TEST_ASSERT_FLOAT_WITHIN(0.2f, -40.0f, temperature_degC(&cfg, 842.71f));
}

static void test_kty84_is_that_of_its_data_sheet(void)
{
    cfg.kind = TEMPERATURE_KTY84;
    const float degC[] = {-40.0f, 0.0f, 25.0f, 100.0f, 150.0f, 200.0f};
    const float ohm[] = {359.0f, 498.0f, 603.0f, 1000.0f, 1334.0f, 1722.0f};
    for (uint32_t k = 0u; k < 6u; k++) {
        TEST_ASSERT_FLOAT_WITHIN(0.3f, degC[k], temperature_degC(&cfg, ohm[k]));
    }
}

static void test_ntc_follows_beta_from_minus_40_to_250(void)
{
    cfg.kind = TEMPERATURE_NTC;
    for (double degC = -40.0; degC <= 250.0; degC += 5.0) {
        const double ohm = 10e3 * exp(3435.0 * (1.0 / (degC + 273.15) - 1.0 / 298.15));
        TEST_ASSERT_FLOAT_WITHIN(2e-3f, (float)degC, temperature_degC(&cfg, (float)ohm));
    }
}

static void test_counts_are_the_lower_part_of_the_divider(void)
{
    for (double degC = 0.0; degC <= 240.0; degC += 20.0) {
        TEST_ASSERT_FALSE(give_ohm(pt1000_ohm(degC)));
        TEST_ASSERT_FLOAT_WITHIN(0.1f, (float)degC, st.degC);
        TEST_ASSERT_TRUE(st.known);
    }
}

static void expect_lost(uint16_t counts)
{
    st = (temperature_state_t){0};
    (void)give_ohm(pt1000_ohm(60.0));
    for (uint32_t k = 0u; k < LOST; k++) { /* the first of them is not the median yet */
        TEST_ASSERT_FALSE(temperature_step(&cfg, &st, counts, 1u));
    }
    TEST_ASSERT_TRUE(temperature_step(&cfg, &st, counts, 1u));
    TEST_ASSERT_FLOAT_WITHIN(0.1f, 60.0f, st.degC);
    TEST_ASSERT_EQUAL(counts == 0u, st.shorted);
    TEST_ASSERT_FALSE(give_ohm(pt1000_ohm(60.0)));
}

static void test_open_and_short_wires_are_lost_with_every_sensor(void)
{
    expect_lost(0u);
    expect_lost(65535u);
    const temperature_kind_t kinds[] = {TEMPERATURE_KTY84, TEMPERATURE_NTC, TEMPERATURE_PT1000};
    const uint16_t ends[] = {0u, 1u, 65534u, 65535u};
    for (uint32_t k = 0u; k < 12u; k++) {
        cfg.kind = kinds[k % 3u];
        st = (temperature_state_t){0};
        for (uint32_t n = 0u; n < 2u + LOST; n++) {
            const bool lost = temperature_step(&cfg, &st, ends[k / 3u], 1u);
            TEST_ASSERT_EQUAL(n == 1u + LOST, lost);
        }
        TEST_ASSERT_FALSE(st.known);
        TEST_ASSERT_EQUAL(k < 6u, st.shorted);
    }
}

/* Whatever it is, wherever it comes, at the start too. */
static void test_one_bad_word_changes_nothing(void)
{
    const uint16_t words[] = {0u, 65535u, 25000u, 40000u};
    for (uint32_t k = 0u; k < 4u; k++) {
        for (uint32_t at = 0u; at < 5u; at++) {
            st = (temperature_state_t){0};
            cfg.lost_steps = 1u;
            for (uint32_t n = 0u; n < 100u; n++) {
                const bool bad = n == at;
                TEST_ASSERT_FALSE(bad ? temperature_step(&cfg, &st, words[k], 1u)
                                      : give_once(pt1000_ohm(60.0)));
                TEST_ASSERT_FALSE(st.hot);
                TEST_ASSERT_FLOAT_WITHIN(0.1f, (n < 2u) ? 0.0f : 60.0f, st.degC);
            }
        }
    }
    st = (temperature_state_t){0};
    (void)give_ohm(pt1000_ohm(110.0));
    TEST_ASSERT_TRUE(st.hot);
    (void)give_once(pt1000_ohm(20.0));
    (void)give_ohm(pt1000_ohm(110.0));
    TEST_ASSERT_TRUE(st.hot);
}

static void test_two_words_in_three_count_through_the_filter(void)
{
    (void)give_ohm(pt1000_ohm(60.0));
    (void)give_once(pt1000_ohm(90.0));
    TEST_ASSERT_FLOAT_WITHIN(0.1f, 60.0f, st.degC);
    (void)give_once(pt1000_ohm(90.0));
    TEST_ASSERT_FLOAT_WITHIN(0.1f, 60.0f + 30.0f / 21.0f, st.degC);
    for (uint32_t k = 1u; k < 20u; k++) {
        (void)give_once(pt1000_ohm(90.0));
    }
    TEST_ASSERT_FLOAT_WITHIN(0.5f, 90.0f - 30.0f * 0.377f, st.degC); /* (20/21)^20 */
    st = (temperature_state_t){0};
    (void)give_ohm(pt1000_ohm(60.0));
    (void)give_once(pt1000_ohm(90.0));
    (void)temperature_step(&cfg, &st, st.before[1], 60u); /* a late look */
    TEST_ASSERT_FLOAT_WITHIN(0.1f, 60.0f + 0.75f * 30.0f, st.degC);
}

static void test_the_median_is_that_of_any_order(void)
{
    const uint16_t word[] = {21500u, 22500u, 23500u};
    for (uint32_t k = 0u; k < 27u; k++) {
        st = (temperature_state_t){0};
        const uint16_t given[] = {word[k % 3u], word[(k / 3u) % 3u], word[k / 9u]};
        uint32_t above = 0u;
        uint32_t below = 0u;
        for (uint32_t n = 0u; n < 3u; n++) {
            (void)temperature_step(&cfg, &st, given[n], 1u);
            above += (given[n] > word[1]) ? 1u : 0u;
            below += (given[n] < word[1]) ? 1u : 0u;
        }
        const uint16_t middle = (above > 1u) ? word[2] : ((below > 1u) ? word[0] : word[1]);
        const float ohm = cfg.pullup_ohm * (float)middle / (65536.0f - (float)middle);
        TEST_ASSERT_EQUAL_FLOAT(temperature_degC(&cfg, ohm), st.degC);
    }
}

static void test_both_ends_of_the_range_are_good(void)
{
    cfg.kind = TEMPERATURE_NTC;
    const double ends_degC[] = {-39.0, 249.0, -41.0, 251.0};
    for (uint32_t k = 0u; k < 4u; k++) {
        st = (temperature_state_t){0};
        cfg.pullup_ohm = (ends_degC[k] < 0.0) ? 100e3f : 100.0f;
        (void)give_ohm(10e3 * exp(3435.0 * (1.0 / (ends_degC[k] + 273.15) - 1.0 / 298.15)));
        TEST_ASSERT_EQUAL(k < 2u, st.known);
    }
}

static void test_it_trips_and_has_to_cool_by_ten_kelvin(void)
{
    (void)give_ohm(pt1000_ohm(99.8));
    TEST_ASSERT_FALSE(st.hot);
    (void)give_ohm(pt1000_ohm(100.2));
    TEST_ASSERT_TRUE(st.hot);
    (void)give_ohm(pt1000_ohm(90.2));
    TEST_ASSERT_TRUE(st.hot);
    (void)give_ohm(pt1000_ohm(89.8));
    TEST_ASSERT_FALSE(st.hot);
    (void)give_ohm(pt1000_ohm(95.0));
    TEST_ASSERT_FALSE(st.hot);
}

static void test_the_share_falls_from_derating_to_trip(void)
{
    st.known = true;
    const float degC[] = {20.0f, 80.0f, 85.0f, 90.0f, 100.0f, 200.0f};
    const float share_pu[] = {1.0f, 1.0f, 0.875f, 0.75f, 0.5f, 0.5f};
    for (uint32_t k = 0u; k < 6u; k++) {
        st.degC = degC[k];
        TEST_ASSERT_FLOAT_WITHIN(1e-6f, share_pu[k], temperature_share_pu(&cfg, &st));
    }
    st.known = false;
    TEST_ASSERT_EQUAL_FLOAT(1.0f, temperature_share_pu(&cfg, &st));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_what_is_outside_its_range);
    RUN_TEST(test_off_nothing_is_measured);
    RUN_TEST(test_pt1000_is_that_of_iec_60751);
    RUN_TEST(test_kty84_is_that_of_its_data_sheet);
    RUN_TEST(test_ntc_follows_beta_from_minus_40_to_250);
    RUN_TEST(test_counts_are_the_lower_part_of_the_divider);
    RUN_TEST(test_open_and_short_wires_are_lost_with_every_sensor);
    RUN_TEST(test_one_bad_word_changes_nothing);
    RUN_TEST(test_two_words_in_three_count_through_the_filter);
    RUN_TEST(test_the_median_is_that_of_any_order);
    RUN_TEST(test_both_ends_of_the_range_are_good);
    RUN_TEST(test_it_trips_and_has_to_cool_by_ten_kelvin);
    RUN_TEST(test_the_share_falls_from_derating_to_trip);
    return UNITY_END();
}
