/* The state machine of CiA 402: every transition, legal and not, and those that the drive imposes.
 */
#include "cia402.h"

#include "unity.h"

#define STATES 8u

void setUp(void)
{
}
void tearDown(void)
{
}

static const cia402_drive_t rests = {.ready = true};
static const cia402_drive_t runs = {.ready = true, .gates_on = true, .runs = true};

enum {
    SHUTDOWN = 0x06,
    SWITCH_ON = 0x07,
    ENABLE = 0x0F,
    NO_VOLTAGE = 0x00,
    QUICK_STOP = 0x02
};

/* Where a control word leads from each state, in the order of the states. */
static void check(uint32_t control, const cia402_state_id_t to[STATES])
{
    for (uint32_t from = 0u; from < STATES; from++) {
        cia402_state_t st = {.id = (cia402_state_id_t)from};
        TEST_ASSERT_FALSE(cia402_control(&st, control));
        TEST_ASSERT_EQUAL_UINT32(to[from], st.id);
        TEST_ASSERT_EQUAL_HEX32(control, st.control);
    }
}

#define N  CIA402_NOT_READY
#define D  CIA402_SWITCH_ON_DISABLED
#define R  CIA402_READY_TO_SWITCH_ON
#define S  CIA402_SWITCHED_ON
#define E  CIA402_OPERATION_ENABLED
#define Q  CIA402_QUICK_STOP_ACTIVE
#define FR CIA402_FAULT_REACTION_ACTIVE
#define F  CIA402_FAULT

static void test_each_control_word_from_each_state(void)
{
    check(SHUTDOWN, (const cia402_state_id_t[]){N, R, R, R, R, Q, FR, F});
    check(SWITCH_ON, (const cia402_state_id_t[]){N, D, S, S, S, Q, FR, F});
    check(ENABLE, (const cia402_state_id_t[]){N, D, E, E, E, Q, FR, F});
    check(NO_VOLTAGE, (const cia402_state_id_t[]){N, D, D, D, D, D, FR, F});
    check(QUICK_STOP, (const cia402_state_id_t[]){N, D, D, D, Q, Q, FR, F});
}

static void test_bits_beyond_the_pattern_do_not_matter(void)
{
    check(0xFF70u | SHUTDOWN, (const cia402_state_id_t[]){N, R, R, R, R, Q, FR, F});
    check(0x08u | SHUTDOWN, (const cia402_state_id_t[]){N, R, R, R, R, Q, FR, F});
    check(0x0Du, (const cia402_state_id_t[]){N, D, D, D, D, D, FR, F});
    check(0x0Bu, (const cia402_state_id_t[]){N, D, D, D, Q, Q, FR, F});
}

static void test_a_reset_is_asked_for_on_the_rising_edge_in_fault_alone(void)
{
    cia402_state_t st = {.id = F};
    TEST_ASSERT_TRUE(cia402_control(&st, CIA402_RESET));
    TEST_ASSERT_FALSE(cia402_control(&st, CIA402_RESET));
    TEST_ASSERT_FALSE(cia402_control(&st, 0u));
    TEST_ASSERT_TRUE(cia402_control(&st, CIA402_RESET));
    TEST_ASSERT_EQUAL(F, st.id); /* until the drive has left its fault */
    st = (cia402_state_t){.id = D};
    TEST_ASSERT_FALSE(cia402_control(&st, CIA402_RESET));
}

static void test_the_drive_imposes_its_states(void)
{
    for (uint32_t from = 0u; from < STATES; from++) {
        cia402_state_t st = {.id = (cia402_state_id_t)from};
        cia402_follow(&st, &(cia402_drive_t){.ready = true, .fault = true, .reacting = true});
        TEST_ASSERT_EQUAL(F, st.id);
        st.id = (cia402_state_id_t)from;
        cia402_follow(&st, &(cia402_drive_t){.ready = true, .reacting = true, .runs = true});
        TEST_ASSERT_EQUAL(FR, st.id);
        st.id = (cia402_state_id_t)from;
        cia402_follow(&st, &(cia402_drive_t){.ready = false});
        TEST_ASSERT_EQUAL(N, st.id);
    }
}

static void test_behind_self_test_and_fault_it_is_switch_on_disabled(void)
{
    static const cia402_state_id_t from[] = {N, F, FR};
    for (uint32_t k = 0u; k < 3u; k++) {
        cia402_state_t st = {.id = from[k]};
        cia402_follow(&st, &runs);
        TEST_ASSERT_EQUAL(D, st.id);
    }
}

static void test_operation_ends_with_the_run_command(void)
{
    cia402_state_t st = {.id = E};
    cia402_follow(&st, &runs);
    TEST_ASSERT_EQUAL(E, st.id);
    cia402_follow(&st, &(cia402_drive_t){.ready = true, .gates_on = true});
    TEST_ASSERT_EQUAL(Q, st.id);
    cia402_follow(&st, &(cia402_drive_t){.ready = true, .gates_on = true});
    TEST_ASSERT_EQUAL(Q, st.id);
    cia402_follow(&st, &rests);
    TEST_ASSERT_EQUAL(D, st.id);
    st.id = S;
    cia402_follow(&st, &rests);
    TEST_ASSERT_EQUAL(S, st.id);
}

static void test_status_bits_are_those_of_the_standard(void)
{
    static const uint32_t bits[STATES] = {0x00u, 0x40u, 0x21u, 0x23u, 0x27u, 0x07u, 0x0Fu, 0x08u};
    for (uint32_t id = 0u; id < STATES; id++) {
        TEST_ASSERT_EQUAL_HEX32(bits[id], cia402_status((cia402_state_id_t)id));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_each_control_word_from_each_state);
    RUN_TEST(test_bits_beyond_the_pattern_do_not_matter);
    RUN_TEST(test_a_reset_is_asked_for_on_the_rising_edge_in_fault_alone);
    RUN_TEST(test_the_drive_imposes_its_states);
    RUN_TEST(test_behind_self_test_and_fault_it_is_switch_on_disabled);
    RUN_TEST(test_operation_ends_with_the_run_command);
    RUN_TEST(test_status_bits_are_those_of_the_standard);
    return UNITY_END();
}
