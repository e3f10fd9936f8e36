/* The whole list of faults: every bit once, in order, said in words, and in exactly one reaction.
 */
#include "fault_reaction.h"

#include <string.h>

#include "monitor.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static void test_bits_are_in_order_and_none_is_left_out(void)
{
    TEST_ASSERT_EQUAL_UINT32(32u, fault_count()); /* as many as a word has bits */
    for (uint32_t k = 0u; k < fault_count(); k++) {
        TEST_ASSERT_EQUAL_UINT32(k, fault_info(k)->bit);
    }
}

/* What a log of an older image means may never change. */
static void test_the_numbers_of_the_first_and_last_are_what_they_were(void)
{
    TEST_ASSERT_EQUAL_STRING("OVER_CURRENT", fault_info(0u)->name);
    TEST_ASSERT_EQUAL_STRING("ORIENTATION_LOST", fault_info(13u)->name);
    TEST_ASSERT_EQUAL_STRING("UNDERLOAD", fault_info(29u)->name);
    TEST_ASSERT_EQUAL_STRING("ADC_FROZEN", fault_info(30u)->name);
    TEST_ASSERT_EQUAL_STRING("SPEED_DEVIATION", fault_info(31u)->name);
}

static void test_names_are_unique_and_every_fault_has_its_words(void)
{
    for (uint32_t k = 0u; k < fault_count(); k++) {
        const fault_info_t *f = fault_info(k);
        TEST_ASSERT_TRUE_MESSAGE(strlen(f->text) > 10u, f->name);
        TEST_ASSERT_TRUE_MESSAGE(strlen(f->cause) > 10u, f->name);
        TEST_ASSERT_TRUE_MESSAGE(strlen(f->remedy) > 10u, f->name);
        for (uint32_t m = 0u; m < k; m++) {
            TEST_ASSERT_TRUE_MESSAGE(strcmp(f->name, fault_info(m)->name) != 0, f->name);
            TEST_ASSERT_TRUE_MESSAGE(strcmp(f->text, fault_info(m)->text) != 0, f->name);
        }
    }
}

static void test_each_bit_is_in_the_masks_of_its_reaction_only(void)
{
    for (uint32_t k = 0u; k < fault_count(); k++) {
        const fault_info_t *f = fault_info(k);
        const uint32_t bit = 1u << f->bit;
        TEST_ASSERT_EQUAL_MESSAGE(f->reaction == FAULT_WARN, (fault_warn_bits & bit) != 0u,
                                  f->name);
        TEST_ASSERT_EQUAL_MESSAGE(f->reaction == FAULT_DERATE, (fault_derate_bits & bit) != 0u,
                                  f->name);
        TEST_ASSERT_EQUAL_MESSAGE(f->reaction == FAULT_RAMP_DOWN,
                                  (fault_ramp_down_bits & bit) != 0u, f->name);
        TEST_ASSERT_EQUAL_MESSAGE(f->reaction == FAULT_GATES_OFF, fault_opening(bit) == bit,
                                  f->name);
        TEST_ASSERT_EQUAL_MESSAGE(f->reaction >= FAULT_RAMP_DOWN, fault_stopping(bit) == bit,
                                  f->name);
    }
}

/* Hardware, sensors, estimate: nobody may soften these to a ramp, which needs all three. */
static void test_what_a_ramp_cannot_survive_opens_the_gates(void)
{
    const uint32_t hard = FAULT_OVER_CURRENT | FAULT_DC_OVER_VOLTAGE | FAULT_NON_FINITE |
                          FAULT_ADC_RANGE | FAULT_CURRENT_SUM | FAULT_CURRENT_SENSOR |
                          FAULT_VOLTAGE_SENSOR | FAULT_OPEN_PHASE | FAULT_EARTH_FAULT |
                          FAULT_OBSERVER | FAULT_BRAKE_INPUT | FAULT_PERIOD_OVERRUN |
                          FAULT_TABLE_CRC | FAULT_CONFIG | FAULT_ADC_FROZEN;
    TEST_ASSERT_EQUAL_HEX32(hard, fault_opening(hard));
}

static void test_a_bit_nobody_knows_opens_the_gates(void)
{
    for (uint32_t bit = fault_count(); bit < 32u; bit++) {
        TEST_ASSERT_EQUAL_HEX32(1u << bit, fault_opening(1u << bit));
    }
    TEST_ASSERT_EQUAL_PTR(fault_info(0u), fault_info(fault_count()));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_bits_are_in_order_and_none_is_left_out);
    RUN_TEST(test_the_numbers_of_the_first_and_last_are_what_they_were);
    RUN_TEST(test_names_are_unique_and_every_fault_has_its_words);
    RUN_TEST(test_each_bit_is_in_the_masks_of_its_reaction_only);
    RUN_TEST(test_what_a_ramp_cannot_survive_opens_the_gates);
    RUN_TEST(test_a_bit_nobody_knows_opens_the_gates);
    return UNITY_END();
}
