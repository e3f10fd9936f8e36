/* Charging of the dc link: level, contactor with and without auxiliary contact, every failure. */
#include "precharge.h"

#include "unity.h"

static precharge_config_t cfg;
static precharge_state_t st;
static precharge_in_t in;
static uint32_t faults;

void setUp(void)
{
    cfg = (precharge_config_t){.on = true,
                               .feedback = true,
                               .ready_V = 100.0f,
                               .charge_steps = 500u,
                               .contactor_steps = 40u};
    TEST_ASSERT_TRUE(precharge_init(&cfg));
    st = (precharge_state_t){0};
    in = (precharge_in_t){.steps = 1u};
}
void tearDown(void)
{
}

static void steps(uint32_t n)
{
    for (uint32_t k = 0u; k < n; k++) {
        faults = precharge_step(&cfg, &st, &in);
    }
}

static void expect(precharge_id_t id, uint32_t fault)
{
    TEST_ASSERT_EQUAL(id, st.id);
    TEST_ASSERT_EQUAL_UINT32(fault, faults);
    TEST_ASSERT_EQUAL((id == PRECHARGE_CLOSING) || (id == PRECHARGE_CLOSED) ||
                          (id == PRECHARGE_OPENING),
                      precharge_close(&st));
    TEST_ASSERT_EQUAL(id == PRECHARGE_CLOSED, precharge_ready(&cfg, &st));
}

static void to_closing(void)
{
    in.u_dc_V = 120.0f;
    steps(1u);
    expect(PRECHARGE_CHARGING, 0u);
    steps(99u);
    expect(PRECHARGE_CHARGING, 0u);
    steps(1u);
    expect(PRECHARGE_CLOSING, 0u);
}

static void to_closed(void)
{
    to_closing();
    in.closed = true;
    steps(1u);
    expect(PRECHARGE_CLOSED, 0u);
}

static void test_init_wants_positive_numbers(void)
{
    cfg.ready_V = 0.0f;
    TEST_ASSERT_FALSE(precharge_init(&cfg));
    cfg.ready_V = 1.0f;
    cfg.charge_steps = 0u;
    TEST_ASSERT_FALSE(precharge_init(&cfg));
    cfg.charge_steps = 1u;
    cfg.contactor_steps = 0u;
    TEST_ASSERT_FALSE(precharge_init(&cfg));
    cfg.contactor_steps = 1u;
    TEST_ASSERT_TRUE(precharge_init(&cfg));
    cfg = (precharge_config_t){0};
    TEST_ASSERT_TRUE(precharge_init(&cfg));
}

static void test_off_it_is_ready_and_closes_nothing(void)
{
    cfg.on = false;
    in.u_dc_V = 120.0f;
    steps(1000u);
    TEST_ASSERT_EQUAL_UINT32(0u, faults);
    TEST_ASSERT_TRUE(precharge_ready(&cfg, &st));
    TEST_ASSERT_FALSE(precharge_close(&st));
}

static void test_it_waits_for_the_supply(void)
{
    in.u_dc_V = 9.9f;
    steps(1u);
    expect(PRECHARGE_WAITING, 0u);
    steps(10000u);
    expect(PRECHARGE_WAITING, 0u);
    in.u_dc_V = 10.1f;
    steps(1u);
    expect(PRECHARGE_CHARGING, 0u);
    in.u_dc_V = 9.9f;
    steps(1u);
    expect(PRECHARGE_WAITING, 0u);
}

static void test_it_closes_once_the_link_is_level(void)
{
    in.u_dc_V = 10.0f;
    steps(1u);
    for (uint32_t k = 0u; k < 400u; k++) { /* 2 % in 50 steps, from 100 V on */
        in.u_dc_V = 100.0f + 0.05f * (float)k;
        steps(1u);
        expect(PRECHARGE_CHARGING, 0u);
    }
    steps(50u);
    expect(PRECHARGE_CLOSING, 0u);
}

static void test_a_level_link_below_the_voltage_is_too_slow(void)
{
    in.u_dc_V = 99.9f;
    steps(1u);
    steps(499u);
    expect(PRECHARGE_CHARGING, 0u);
    steps(1u);
    expect(PRECHARGE_FAILED, PRECHARGE_TOO_SLOW);
    steps(1u);
    expect(PRECHARGE_FAILED, 0u);
}

static void test_the_voltage_itself_is_enough(void)
{
    in.u_dc_V = 100.0f;
    steps(101u);
    expect(PRECHARGE_CLOSING, 0u);
}

static void test_a_rise_of_one_percent_is_level(void)
{
    in.u_dc_V = 200.0f;
    steps(1u + 50u);
    in.u_dc_V = 202.1f;
    steps(50u);
    expect(PRECHARGE_CHARGING, 0u);
    in.u_dc_V = 204.0f;
    steps(50u);
    expect(PRECHARGE_CLOSING, 0u);
}

static void test_the_auxiliary_contact_ends_the_closing(void)
{
    to_closing();
    steps(38u);
    expect(PRECHARGE_CLOSING, 0u);
    in.closed = true;
    steps(1u);
    expect(PRECHARGE_CLOSED, 0u);
}

static void test_a_contactor_that_does_not_close_fails(void)
{
    to_closing();
    steps(39u);
    expect(PRECHARGE_CLOSING, 0u);
    steps(1u);
    expect(PRECHARGE_FAILED, PRECHARGE_CONTACTOR);
}

static void test_without_auxiliary_contact_the_time_ends_the_closing(void)
{
    cfg.feedback = false;
    to_closing();
    steps(39u);
    expect(PRECHARGE_CLOSING, 0u);
    steps(1u);
    expect(PRECHARGE_CLOSED, 0u);
    steps(1000u);
    expect(PRECHARGE_CLOSED, 0u);
}

static void test_a_contactor_that_falls_off_fails(void)
{
    to_closed();
    in.closed = false;
    steps(19u);
    expect(PRECHARGE_CLOSED, 0u);
    in.closed = true;
    steps(1u);
    in.closed = false;
    steps(19u);
    expect(PRECHARGE_CLOSED, 0u);
    steps(1u);
    expect(PRECHARGE_FAILED, PRECHARGE_CONTACTOR);
}

static void test_a_contactor_that_sticks_is_seen_before_charging(void)
{
    in.closed = true;
    steps(19u);
    expect(PRECHARGE_WAITING, 0u);
    steps(1u);
    expect(PRECHARGE_FAILED, PRECHARGE_CONTACTOR);
}

static void test_a_contactor_that_sticks_is_seen_while_charging(void)
{
    in.closed = true;
    steps(10u);
    in.u_dc_V = 50.0f;
    steps(1u);
    expect(PRECHARGE_CHARGING, 0u);
    steps(8u);
    expect(PRECHARGE_CHARGING, 0u);
    steps(1u);
    expect(PRECHARGE_FAILED, PRECHARGE_CONTACTOR);
}

static void test_a_link_that_falls_is_charged_anew(void)
{
    to_closed();
    in.u_dc_V = 70.1f;
    steps(10u);
    expect(PRECHARGE_CLOSED, 0u);
    in.u_dc_V = 69.9f;
    steps(4u);
    expect(PRECHARGE_CLOSED, 0u);
    in.u_dc_V = 70.1f;
    steps(1u);
    in.u_dc_V = 69.9f;
    steps(4u);
    expect(PRECHARGE_CLOSED, 0u);
    steps(1u);
    expect(PRECHARGE_WAITING, 0u);
}

/* Whatever asks for it: the coil stays on until the gates are off and the current is gone. */
static void test_it_never_opens_under_load(void)
{
    const struct {
        float u_dc_V;
        bool closed;
        bool open;
        uint32_t steps;
        uint32_t fault;
        uint32_t standing;
        precharge_id_t then;
    } rows[] = {{69.9f, true, false, 5u, PRECHARGE_LINK_LOW, PRECHARGE_LINK_LOW, PRECHARGE_WAITING},
                {120.0f, false, false, 20u, PRECHARGE_CONTACTOR, 0u, PRECHARGE_FAILED},
                {120.0f, true, true, 1u, 0u, 0u, PRECHARGE_FAILED}};
    for (uint32_t k = 0u; k < sizeof rows / sizeof rows[0]; k++) {
        setUp();
        to_closed();
        in.gates_on = true;
        in.current = true;
        in.u_dc_V = rows[k].u_dc_V;
        in.closed = rows[k].closed;
        in.open = rows[k].open;
        steps(rows[k].steps);
        expect(PRECHARGE_OPENING, rows[k].fault);
        steps(1000u);
        expect(PRECHARGE_OPENING, rows[k].standing);
        in.gates_on = false;
        steps(499u);
        expect(PRECHARGE_OPENING, 0u);
        in.current = false;
        steps(1u);
        expect(rows[k].then, 0u);
    }
}

static void test_a_current_that_never_ends_is_not_waited_for(void)
{
    to_closed();
    in.current = true;
    in.u_dc_V = 69.9f;
    steps(4u + 499u);
    expect(PRECHARGE_OPENING, 0u);
    in.gates_on = true;
    steps(1u);
    in.gates_on = false;
    steps(499u);
    expect(PRECHARGE_OPENING, 0u);
    steps(1u);
    expect(PRECHARGE_WAITING, 0u);
}

static void test_a_chopper_that_fails_meanwhile_keeps_it_open(void)
{
    to_closed();
    in.gates_on = true;
    in.u_dc_V = 69.9f;
    steps(5u);
    expect(PRECHARGE_OPENING, PRECHARGE_LINK_LOW);
    in.open = true;
    steps(1u);
    expect(PRECHARGE_OPENING, 0u);
    in.gates_on = false;
    steps(1u);
    expect(PRECHARGE_FAILED, 0u);
}

static void test_a_reset_begins_anew(void)
{
    in.closed = true;
    steps(20u);
    in.closed = false;
    steps(100u);
    expect(PRECHARGE_FAILED, 0u);
    in.reset = true;
    steps(1u);
    expect(PRECHARGE_WAITING, 0u);
    in.reset = false;
    to_closed();
}

static void test_open_opens_the_contactor_and_holds_against_a_reset(void)
{
    to_closed();
    in.open = true;
    steps(1u);
    expect(PRECHARGE_FAILED, 0u);
    in.reset = true;
    steps(1u);
    expect(PRECHARGE_FAILED, 0u);
    in.open = false;
    steps(1u);
    expect(PRECHARGE_WAITING, 0u);
}

static void test_a_state_that_is_none_waits(void)
{
    st.id = (precharge_id_t)9;
    in.u_dc_V = 50.0f;
    TEST_ASSERT_FALSE(precharge_close(&st));
    steps(1u);
    expect(PRECHARGE_CHARGING, 0u);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_wants_positive_numbers);
    RUN_TEST(test_off_it_is_ready_and_closes_nothing);
    RUN_TEST(test_it_waits_for_the_supply);
    RUN_TEST(test_it_closes_once_the_link_is_level);
    RUN_TEST(test_a_level_link_below_the_voltage_is_too_slow);
    RUN_TEST(test_the_voltage_itself_is_enough);
    RUN_TEST(test_a_rise_of_one_percent_is_level);
    RUN_TEST(test_the_auxiliary_contact_ends_the_closing);
    RUN_TEST(test_a_contactor_that_does_not_close_fails);
    RUN_TEST(test_without_auxiliary_contact_the_time_ends_the_closing);
    RUN_TEST(test_a_contactor_that_falls_off_fails);
    RUN_TEST(test_a_contactor_that_sticks_is_seen_before_charging);
    RUN_TEST(test_a_contactor_that_sticks_is_seen_while_charging);
    RUN_TEST(test_a_link_that_falls_is_charged_anew);
    RUN_TEST(test_it_never_opens_under_load);
    RUN_TEST(test_a_current_that_never_ends_is_not_waited_for);
    RUN_TEST(test_a_chopper_that_fails_meanwhile_keeps_it_open);
    RUN_TEST(test_a_reset_begins_anew);
    RUN_TEST(test_open_opens_the_contactor_and_holds_against_a_reset);
    RUN_TEST(test_a_state_that_is_none_waits);
    return UNITY_END();
}
