/* The schedule of sixteen: nothing is forgotten, and nothing expensive shares a slot. */
#include "slots.h"

#include <stddef.h>

#include "unity.h"

/* What runs once in sixteen. */
static const uint32_t work[] = {SLOT_SUPERVISOR_DECIDE,
                                SLOT_SUPERVISOR_BOUND,
                                SLOT_REST,
                                SLOT_GUARD_VOLTAGE,
                                SLOT_HEAT,
                                SLOT_FLUX_REFERENCE,
                                SLOT_GUARD_PHASES,
                                SLOT_SPEED_SCHEDULE,
                                SLOT_FLUX_STEERING,
                                SLOT_GUARD_ESTIMATE,
                                SLOT_RS_TRACKING,
                                SLOT_SUPERVISOR_MEASURE,
                                SLOT_SUPERVISOR_WEIGH};
#define WORK (sizeof work / sizeof work[0])

void setUp(void)
{
}

void tearDown(void)
{
}

static void test_every_slot_comes_once_in_sixteen(void)
{
    uint32_t seen = 0u;
    uint32_t slot = 0u;
    for (uint32_t k = 0u; k < SLOT_COUNT; k++) {
        slot = slot_next(slot);
        TEST_ASSERT_LESS_THAN_UINT32(SLOT_COUNT, slot);
        seen |= 1u << slot;
    }
    TEST_ASSERT_EQUAL_HEX32(0xFFFFu, seen);
    TEST_ASSERT_EQUAL_UINT32(0u, slot);
    TEST_ASSERT_EQUAL_UINT32(0u, slot_next(SLOT_COUNT - 1u));
    TEST_ASSERT_LESS_THAN_UINT32(SLOT_COUNT, slot_next(0xFFFFFFFFu)); /* lost in memory */
    TEST_ASSERT_LESS_THAN_UINT32(SLOT_COUNT, slot_next(1000u));
}

/* What follows the motor comes in every fourth slot, and no two kinds in one. The quarter that is
 * left is that of the guard's long checks. */
static void test_every_kind_has_a_quarter_of_its_own(void)
{
    const uint32_t quarters[] = {SLOT_QUARTER_ANGLES, SLOT_QUARTER_REFERENCES,
                                 SLOT_QUARTER_SUPERVISOR};
    for (uint32_t slot = 0u; slot < SLOT_COUNT; slot++) {
        int kinds = 0;
        for (size_t n = 0u; n < sizeof quarters / sizeof quarters[0]; n++) {
            const bool now = slot_is_quarter(slot, quarters[n]);
            TEST_ASSERT_EQUAL(now,
                              slot_is_quarter((slot + SLOT_QUARTERS) % SLOT_COUNT, quarters[n]));
            kinds += now ? 1 : 0;
        }
        const bool guard = slot_is_quarter(slot, SLOT_GUARD_VOLTAGE);
        TEST_ASSERT_EQUAL_INT(guard ? 0 : 1, kinds);
    }
}

/* Beside what the quarter holds, one thing at most. */
static void test_no_slot_has_two_things_of_sixteen(void)
{
    uint32_t taken = 0u;
    for (size_t n = 0u; n < WORK; n++) {
        TEST_ASSERT_LESS_THAN_UINT32(SLOT_COUNT, work[n]);
        TEST_ASSERT_BITS_LOW(1u << work[n], taken);
        taken |= 1u << work[n];
    }
    /* Two of the slots that plan references stay free: planning is the largest part. Slot 12 is
     * that of dwelling. */
    TEST_ASSERT_EQUAL_HEX32(0xFFFFu & ~((1u << 5) | (1u << 9) | (1u << 12)), taken);
}

/* A judgement goes through its parts in four periods on end, and begins when the flux was tied. */
static void test_the_supervisor_judges_in_the_order_of_its_parts(void)
{
    TEST_ASSERT_TRUE(slot_is_quarter(SLOT_SUPERVISOR_MEASURE, SLOT_QUARTER_SUPERVISOR));
    TEST_ASSERT_EQUAL_UINT32(SLOT_SUPERVISOR_WEIGH, slot_next(SLOT_SUPERVISOR_MEASURE));
    TEST_ASSERT_EQUAL_UINT32(SLOT_SUPERVISOR_DECIDE, slot_next(SLOT_SUPERVISOR_WEIGH));
    TEST_ASSERT_EQUAL_UINT32(SLOT_SUPERVISOR_BOUND, slot_next(SLOT_SUPERVISOR_DECIDE));
}

/* The voltage path is looked at before the sines replace what it rests on. */
static void test_the_voltage_path_is_looked_at_before_the_sines(void)
{
    TEST_ASSERT_EQUAL_UINT32(SLOT_QUARTER_ANGLES, SLOT_QUARTER_STATE);
    /* In the quarter without a kind of its own. */
    TEST_ASSERT_TRUE(slot_is_quarter(SLOT_COMMAND, SLOT_GUARD_VOLTAGE));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_slot_comes_once_in_sixteen);
    RUN_TEST(test_every_kind_has_a_quarter_of_its_own);
    RUN_TEST(test_no_slot_has_two_things_of_sixteen);
    RUN_TEST(test_the_supervisor_judges_in_the_order_of_its_parts);
    RUN_TEST(test_the_voltage_path_is_looked_at_before_the_sines);
    return UNITY_END();
}
