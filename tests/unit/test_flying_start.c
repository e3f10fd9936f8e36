/* The regression alone, on the EMF that theory says: either direction, residual flux or none. */
#include "flying_start.h"

#include <complex.h>
#include <math.h>

#include "exact.h"
#include "reference_machine.h"
#include "unity.h"

#define PERIOD_S 0.0002f

static const flying_start_params_t good = {.enable = true,
                                           .current_A = 5.0f,
                                           .settle_s = 0.02f,
                                           .window_s = 0.15f,
                                           .stand_rad_s = 14.7f,
                                           .omega_max_rad_s = 628.0f};

static flying_start_config_t cfg;
static flying_start_state_t st;
static motor_model_t table1;
static uint32_t seed;

void setUp(void)
{
    table1 = reference_derived(0);
    TEST_ASSERT_TRUE(flying_start_init(&cfg, &good, &table1, PERIOD_S));
    st = (flying_start_state_t){0};
    seed = 1u;
}

void tearDown(void)
{
}

static void test_init_derives_times_and_thresholds(void)
{
    ASSERT_NEAR(1e-6, 5.0 / 40.0, cfg.step_A);
    TEST_ASSERT_EQUAL_UINT32(100u, cfg.settle_periods);
    TEST_ASSERT_EQUAL_UINT32(850u, cfg.end_periods);
    ASSERT_NEAR(1e-2, 1.0 / 0.0016, cfg.per_lag_per_s);
    ASSERT_NEAR(1e-9, 0.0004, cfg.per_turn_s);
    ASSERT_NEAR(1e-5, pow(0.1 * 0.102 * 5.0 * 14.7, 2.0), cfg.residual_V2);
    flying_start_params_t p = good;
    p.settle_s = 1e-5f;
    TEST_ASSERT_TRUE(flying_start_init(&cfg, &p, &table1, PERIOD_S));
    ASSERT_NEAR(1e-6, 5.0, cfg.step_A);
}

static bool refused(flying_start_params_t p)
{
    return !flying_start_init(&cfg, &p, &table1, PERIOD_S);
}

static void test_init_refuses_each_bad_number(void)
{
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        flying_start_params_t p = good;
        p.current_A = not_positive(k);
        TEST_ASSERT_TRUE(refused(p));
        p = good;
        p.settle_s = not_positive(k);
        TEST_ASSERT_TRUE(refused(p));
        p = good;
        p.window_s = not_positive(k);
        TEST_ASSERT_TRUE(refused(p));
        p = good;
        p.stand_rad_s = not_positive(k);
        TEST_ASSERT_TRUE(refused(p));
        p = good;
        p.omega_max_rad_s = not_positive(k);
        TEST_ASSERT_TRUE(refused(p));
        TEST_ASSERT_FALSE(flying_start_init(&cfg, &good, &table1, not_positive(k)));
        motor_model_t motor = table1;
        motor.kr = not_positive(k);
        TEST_ASSERT_FALSE(flying_start_init(&cfg, &good, &motor, PERIOD_S));
    }
    flying_start_params_t p = good;
    p.omega_max_rad_s = p.stand_rad_s;
    TEST_ASSERT_TRUE(refused(p));
    p.omega_max_rad_s = 14.0f; /* below what is standing */
    TEST_ASSERT_TRUE(refused(p));
    p.omega_max_rad_s = 2000.0f; /* more than half a turn per lag */
    TEST_ASSERT_TRUE(refused(p));
    p = good;
    p.window_s = 0.003f; /* three blocks */
    TEST_ASSERT_TRUE(refused(p));
    p.window_s = 4.01f * (float)FLYING_START_BLOCK_PERIODS * PERIOD_S;
    TEST_ASSERT_FALSE(refused(p));
    p.window_s = 1000.0f;
    TEST_ASSERT_TRUE(refused(p));
    p = good;
    p.settle_s = 1000.0f;
    TEST_ASSERT_TRUE(refused(p));
    p.enable = false;
    TEST_ASSERT_FALSE(refused(p));
    TEST_ASSERT_FALSE(cfg.enable);
}

/* Period by period: the rotor's flux under the search's own current, mean EMF of each period, what
 * Rs is wrong by, and noise. */
typedef struct {
    double complex lambda_Wb;
    double omega_rad_s;
    double complex wrong_V;
    double noise_V;
    double i_share; /* of the wanted current that flows */
} rotor_t;

static const double tau = 0.5 / 0.102;

static void run(rotor_t *r)
{
    double complex i = 0.0;
    for (int k = 0; (k < 4000) && (st.phase == FLYING_START_SEARCH); k++) {
        const double complex pole = I * r->omega_rad_s - tau;
        const double complex end = -0.102 * tau * i / pole;
        const double complex next = end + (r->lambda_Wb - end) * cexp(pole * 2e-4);
        const double complex e = (next - r->lambda_Wb) / 2e-4 + r->wrong_V;
        r->lambda_Wb = next;
        const ab_t e_V = {(float)(creal(e) + r->noise_V * (double)noise(&seed)),
                          (float)(cimag(e) + r->noise_V * (double)noise(&seed))};
        i = r->i_share * (double)st.current_A;
        flying_start_step(&cfg, &st, e_V, (ab_t){(float)i, 0.0f});
    }
}

static rotor_t rotor(double omega_rad_s, double lambda_Wb)
{
    return (rotor_t){.lambda_Wb = lambda_Wb * cexp(0.7 * I),
                     .omega_rad_s = omega_rad_s,
                     .wrong_V = 1.0 - 0.5 * I,
                     .noise_V = 0.3,
                     .i_share = 1.0};
}

/* From the third block on, three tenths of the way per block: the feed-forward of the EMF. */
static void test_the_rough_speed_follows_block_by_block(void)
{
    const double omega_rad_s = -150.0;
    double rough_rad_s = 0.0;
    for (int k = 0; k < 40; k++) {
        const double complex e = 10.0 * cexp(I * omega_rad_s * (double)k * 2e-4);
        flying_start_step(&cfg, &st, (ab_t){(float)creal(e), (float)cimag(e)}, (ab_t){0.0f, 0.0f});
        if (((k + 1) % 4 == 0) && (k > 8)) {
            rough_rad_s += 0.3 * (omega_rad_s - rough_rad_s);
        }
        /* The arctangent's 4e-7 rad over a lag of 1.6 ms. */
        ASSERT_NEAR(1e-3, rough_rad_s, st.rough_rad_s);
    }
}

static const double speeds[] = {-430.0, -120.0, -20.0, 20.0, 60.0, 200.0, 430.0};

static void test_residual_flux_tells_speed_and_flux_without_current(void)
{
    for (size_t n = 0; n < sizeof speeds / sizeof speeds[0]; n++) {
        setUp();
        rotor_t r = rotor(speeds[n], 0.3);
        run(&r);
        TEST_ASSERT_EQUAL(FLYING_START_CAUGHT, st.phase);
        TEST_ASSERT_FALSE(st.current_on);
        ASSERT_SAME_FLOAT(0.0f, st.current_A);
        ASSERT_NEAR(1.0, speeds[n], st.omega_rad_s);
        const double complex found = (double)st.lambda_Wb.alpha + I * (double)st.lambda_Wb.beta;
        /* The wrong volt over the speed is what the flux may be off by. */
        ASSERT_NEAR(0.02 + 1.6 / fabs(speeds[n]), 0.0, cabs(found - r.lambda_Wb));
    }
}

static void test_without_flux_direct_current_finds_the_speed(void)
{
    for (size_t n = 0; n < sizeof speeds / sizeof speeds[0]; n++) {
        setUp();
        rotor_t r = rotor(speeds[n], 0.0);
        run(&r);
        TEST_ASSERT_EQUAL(FLYING_START_CAUGHT, st.phase);
        TEST_ASSERT_TRUE(st.current_on);
        ASSERT_NEAR(3.0, speeds[n], st.omega_rad_s);
    }
}

static void test_what_turns_slowly_or_not_stands(void)
{
    const double slow[] = {0.0, 4.0, -8.0};
    for (int n = 0; n < 3; n++) {
        setUp();
        rotor_t r = rotor(slow[n], 0.0);
        run(&r);
        TEST_ASSERT_EQUAL(FLYING_START_STANDS, st.phase);
    }
    /* Nothing but noise stands as well. */
    setUp();
    rotor_t r = rotor(0.0, 0.0);
    r.noise_V = 20.0;
    cfg.residual_V2 = 1e6f;
    run(&r);
    TEST_ASSERT_EQUAL(FLYING_START_STANDS, st.phase);
}

/* Large but incoherent: the residual look does not believe it. */
static void test_noise_is_no_residual_flux(void)
{
    rotor_t r = rotor(200.0, 0.0);
    r.noise_V = 5.0;
    run(&r);
    TEST_ASSERT_TRUE(st.current_on);
}

static void test_no_current_is_refused(void)
{
    rotor_t r = rotor(200.0, 0.0);
    r.i_share = 0.5;
    run(&r);
    TEST_ASSERT_EQUAL(FLYING_START_REFUSED, st.phase);
    setUp();
    r = rotor(0.0, 0.0);
    r.i_share = NAN;
    run(&r);
    TEST_ASSERT_EQUAL(FLYING_START_REFUSED, st.phase);
}

/* 3.6 of 5 A are 1.4 A off, 3.4 A are 1.6. */
static void test_the_current_may_be_off_by_three_tenths(void)
{
    rotor_t r = rotor(200.0, 0.0);
    r.i_share = 0.72;
    run(&r);
    TEST_ASSERT_EQUAL(FLYING_START_CAUGHT, st.phase);
    setUp();
    r = rotor(200.0, 0.0);
    r.i_share = 0.68;
    run(&r);
    TEST_ASSERT_EQUAL(FLYING_START_REFUSED, st.phase);
}

/* Below it stands; at it, it turns. The same search again finds the same speed, bit by bit. */
static void test_the_slowest_speed_that_turns_is_caught(void)
{
    rotor_t r = rotor(-60.0, 0.0);
    run(&r);
    TEST_ASSERT_EQUAL(FLYING_START_CAUGHT, st.phase);
    const float found_rad_s = fabsf(st.omega_rad_s);
    for (int above = 0; above < 2; above++) {
        setUp();
        cfg.stand_rad_s = (above != 0) ? nextafterf(found_rad_s, INFINITY) : found_rad_s;
        r = rotor(-60.0, 0.0);
        run(&r);
        TEST_ASSERT_EQUAL((above != 0) ? FLYING_START_STANDS : FLYING_START_CAUGHT, st.phase);
    }
}

static void test_a_speed_beyond_the_largest_is_refused(void)
{
    rotor_t r = rotor(700.0, 0.3);
    run(&r);
    TEST_ASSERT_EQUAL(FLYING_START_REFUSED, st.phase);
    TEST_ASSERT_FALSE(st.current_on);
    setUp();
    r = rotor(-700.0, 0.0);
    run(&r);
    TEST_ASSERT_EQUAL(FLYING_START_REFUSED, st.phase);
    TEST_ASSERT_TRUE(st.current_on);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_derives_times_and_thresholds);
    RUN_TEST(test_init_refuses_each_bad_number);
    RUN_TEST(test_the_rough_speed_follows_block_by_block);
    RUN_TEST(test_residual_flux_tells_speed_and_flux_without_current);
    RUN_TEST(test_without_flux_direct_current_finds_the_speed);
    RUN_TEST(test_what_turns_slowly_or_not_stands);
    RUN_TEST(test_noise_is_no_residual_flux);
    RUN_TEST(test_no_current_is_refused);
    RUN_TEST(test_the_current_may_be_off_by_three_tenths);
    RUN_TEST(test_the_slowest_speed_that_turns_is_caught);
    RUN_TEST(test_a_speed_beyond_the_largest_is_refused);
    return UNITY_END();
}
