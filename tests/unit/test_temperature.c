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

static bool give_ohm(double ohm)
{
    const double above_ohm = (double)cfg.pullup_ohm;
    return temperature_step(&cfg, &st, (uint16_t)lround(65536.0 * ohm / (ohm + above_ohm)), 1u);
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
    for (uint32_t k = 0u; k < LOST - 1u; k++) {
        TEST_ASSERT_FALSE(temperature_step(&cfg, &st, counts, 1u));
    }
    TEST_ASSERT_TRUE(temperature_step(&cfg, &st, counts, 1u));
    TEST_ASSERT_FLOAT_WITHIN(0.1f, 60.0f, st.degC);
    TEST_ASSERT_FALSE(give_ohm(pt1000_ohm(60.0)));
}

static void test_open_and_short_wires_are_lost_with_every_sensor(void)
{
    expect_lost(0u);
    expect_lost(65535u);
    cfg.kind = TEMPERATURE_KTY84;
    for (uint32_t end = 0u; end < 2u; end++) {
        st = (temperature_state_t){0};
        for (uint32_t k = 0u; k < LOST; k++) {
            TEST_ASSERT_EQUAL(k == LOST - 1u,
                              temperature_step(&cfg, &st, (uint16_t)(65535u * end), 1u));
        }
        TEST_ASSERT_FALSE(st.known);
        cfg.kind = TEMPERATURE_NTC;
    }
    st = (temperature_state_t){0};
    for (uint32_t k = 0u; k < LOST; k++) {
        TEST_ASSERT_EQUAL(k == LOST - 1u, temperature_step(&cfg, &st, 0u, 1u));
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
    RUN_TEST(test_both_ends_of_the_range_are_good);
    RUN_TEST(test_it_trips_and_has_to_cool_by_ten_kelvin);
    RUN_TEST(test_the_share_falls_from_derating_to_trip);
    return UNITY_END();
}
