/* The dc link's controller alone, and on a capacitor with losses and a shaft. */
#include "mains_loss.h"

#include <math.h>

#include "exact.h"
#include "reference_machine.h"
#include "unity.h"

static const mains_loss_params_t good = {.u_lost_V = 220.0f,
                                         .u_hold_V = 230.0f,
                                         .u_back_V = 260.0f,
                                         .back_s = 0.002f,
                                         .gain_W_per_V = 20.0f,
                                         .stop_rad_s = 15.0f,
                                         .lambda_Wb = 0.5f,
                                         .i_q_max_A = 15.0f};

static mains_loss_config_t cfg;
static mains_loss_state_t st;
static motor_model_t table1;

void setUp(void)
{
    table1 = reference_derived(0);
    TEST_ASSERT_TRUE(mains_loss_init(&cfg, &good, &table1, 0.0002f));
    st = (mains_loss_state_t){0};
}

void tearDown(void)
{
}

static bool refused(mains_loss_params_t p)
{
    return !mains_loss_init(&cfg, &p, &table1, 0.0002f);
}

static void test_init_refuses_each_bad_number(void)
{
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        mains_loss_params_t p = good;
        p.gain_W_per_V = not_positive(k);
        TEST_ASSERT_TRUE(refused(p));
        p = good;
        p.lambda_Wb = not_positive(k);
        TEST_ASSERT_TRUE(refused(p));
        p = good;
        p.stop_rad_s = not_positive(k);
        TEST_ASSERT_TRUE(refused(p));
        p = good;
        p.i_q_max_A = not_positive(k);
        TEST_ASSERT_TRUE(refused(p));
    }
    mains_loss_params_t p = good;
    p.u_lost_V = NAN;
    TEST_ASSERT_TRUE(refused(p));
    p.u_lost_V = -1.0f;
    TEST_ASSERT_TRUE(refused(p));
    p.u_lost_V = INFINITY;
    TEST_ASSERT_TRUE(refused(p));
    p = good;
    p.u_hold_V = 220.0f;
    TEST_ASSERT_TRUE(refused(p));
    p = good;
    p.u_back_V = 230.0f;
    TEST_ASSERT_TRUE(refused(p));
    p.u_back_V = INFINITY;
    TEST_ASSERT_TRUE(refused(p));
    p = good;
    p.back_s = -1.0f;
    TEST_ASSERT_TRUE(refused(p));
    p.back_s = 1e9f;
    TEST_ASSERT_TRUE(refused(p));
    const motor_model_t motor = reference_derived(0);
    TEST_ASSERT_FALSE(mains_loss_init(&cfg, &p, &motor, 1.0f)); /* so many periods exactly */
}

static void test_off_is_idle_at_any_dc_link(void)
{
    mains_loss_params_t p = good;
    p.u_lost_V = 0.0f;
    TEST_ASSERT_FALSE(refused(p));
    TEST_ASSERT_TRUE(mains_loss_idle(&cfg, &st, 0.0f));
}

static void test_begins_below_and_lasts_until_the_mains_is_back(void)
{
    TEST_ASSERT_TRUE(mains_loss_idle(&cfg, &st, 220.0f));
    TEST_ASSERT_FALSE(mains_loss_idle(&cfg, &st, 219.9f));
    TEST_ASSERT_FALSE(mains_loss_idle(&cfg, &st, NAN));
    mains_loss_step(&cfg, &st, 219.0f, 300.0f);
    TEST_ASSERT_FALSE(mains_loss_idle(&cfg, &st, 300.0f));
    for (int k = 0; k < 9; k++) {
        mains_loss_step(&cfg, &st, 270.0f, 300.0f);
    }
    mains_loss_step(&cfg, &st, 255.0f, 300.0f); /* once more away: the count begins anew */
    for (int k = 0; k < 10; k++) {
        mains_loss_step(&cfg, &st, 270.0f, 300.0f);
        TEST_ASSERT_TRUE(st.active);
        ASSERT_NEAR(0.0, 0.0, st.i_q_A);
    }
    mains_loss_step(&cfg, &st, 270.0f, 300.0f);
    TEST_ASSERT_TRUE(mains_loss_idle(&cfg, &st, 270.0f));
}

/* P = 20 W/V times 10 V at 300 rad/s electrical, .5 Wb: i_q = P/(kr lambda w), against the
 * rotation; both machines. */
static void test_power_is_taken_from_the_shaft(void)
{
    for (int m = 0; m < REFERENCE_MACHINES; m++) {
        const motor_model_t model = reference_derived(m);
        TEST_ASSERT_TRUE(mains_loss_init(&cfg, &good, &model, 0.0002f));
        const double kr = (double)reference_machine[m].M_H / (double)reference_machine[m].Lr_H;
        mains_loss_step(&cfg, &st, 220.0f, 300.0f);
        ASSERT_NEAR(1e-5, -200.0 / (kr * 0.5 * 300.0), st.i_q_A);
        mains_loss_step(&cfg, &st, 220.0f, -300.0f);
        ASSERT_NEAR(1e-5, 200.0 / (kr * 0.5 * 300.0), st.i_q_A);
        mains_loss_step(&cfg, &st, 20.0f, 20.0f);
        ASSERT_SAME_FLOAT(-15.0f, st.i_q_A);
    }
}

static void test_too_slow_is_the_end(void)
{
    mains_loss_step(&cfg, &st, 220.0f, 20.0f);
    TEST_ASSERT_FALSE(st.over);
    mains_loss_step(&cfg, &st, 220.0f, -14.0f);
    TEST_ASSERT_TRUE(st.over);
    ASSERT_SAME_FLOAT(0.0f, st.i_q_A);
    st = (mains_loss_state_t){.active = true};
    mains_loss_step(&cfg, &st, 220.0f, NAN);
    TEST_ASSERT_TRUE(st.over);
}

static void test_slow_from_the_start_it_does_nothing(void)
{
    mains_loss_step(&cfg, &st, 210.0f, 14.0f);
    mains_loss_step(&cfg, &st, 210.0f, NAN);
    TEST_ASSERT_FALSE(st.active);
    TEST_ASSERT_FALSE(st.over);
    TEST_ASSERT_FALSE(mains_loss_idle(&cfg, &st, 210.0f)); /* but keeps looking */
    mains_loss_step(&cfg, &st, 210.0f, 16.0f);
    TEST_ASSERT_TRUE(st.active);
}

/* 1 mF, 100 W of losses, .035 kg m2: the dc link stays near u_hold until the shaft has given all.
 */
static void test_holds_up_a_dc_link_while_the_shaft_turns(void)
{
    double u = 283.0, w = 179.0, least = u;
    while (!st.over) {
        double P = 0.0;
        if (!mains_loss_idle(&cfg, &st, (float)u)) {
            mains_loss_step(&cfg, &st, (float)u, (float)(2.0 * w));
            P = -2.0 * 0.5 * (double)st.i_q_A * w; /* p kr lambda i_q w */
        }
        w -= P / (0.035 * w) * 2e-4;
        u += (0.95 * P - 100.0) / (1e-3 * u) * 2e-4;
        least = fmin(least, u);
    }
    TEST_ASSERT_TRUE(least > 210.0);
    TEST_ASSERT_TRUE(w < 8.0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_each_bad_number);
    RUN_TEST(test_off_is_idle_at_any_dc_link);
    RUN_TEST(test_begins_below_and_lasts_until_the_mains_is_back);
    RUN_TEST(test_power_is_taken_from_the_shaft);
    RUN_TEST(test_too_slow_is_the_end);
    RUN_TEST(test_slow_from_the_start_it_does_nothing);
    RUN_TEST(test_holds_up_a_dc_link_while_the_shaft_turns);
    return UNITY_END();
}
