/* The parameter list: every entry consistent, every write range-checked. */
#include "params.h"

#include <math.h>
#include <string.h>

#include "unity.h"

void setUp(void)
{
}
void tearDown(void)
{
}

static void test_every_parameter_has_name_text_and_a_default_in_range(void)
{
    for (size_t i = 0u; i < params_count(); i++) {
        const param_info_t *info = params_info(i);
        TEST_ASSERT_NOT_NULL(info);
        const char *name = params_name(i);
        TEST_ASSERT_TRUE_MESSAGE(strlen(name) > 2u, name);
        TEST_ASSERT_TRUE_MESSAGE(strlen(params_text(i)) > 2u, name);
        TEST_ASSERT_NOT_NULL(param_unit(info));
        TEST_ASSERT_TRUE_MESSAGE(info->minimum < info->maximum, name);
        TEST_ASSERT_TRUE_MESSAGE(params_initial(i) >= info->minimum, name);
        TEST_ASSERT_TRUE_MESSAGE(params_initial(i) <= info->maximum, name);
        TEST_ASSERT_TRUE_MESSAGE(info->group < PARAM_GROUPS, name);
        TEST_ASSERT_EQUAL_size_t(i, params_find(name)); /* names are unique */
    }
    /* 100, four of the guard of the speed, one of the blend, one of the expected acceleration, two
     * of dwelling, one of the mains, two of the motor's heat, one of M, one of the offsets, three
     * of the fieldbus */
    TEST_ASSERT_TRUE(params_count() <= 116u);
    TEST_ASSERT_NULL(params_info(params_count()));
    TEST_ASSERT_EQUAL_STRING("", params_text(params_count()));
    TEST_ASSERT_EQUAL_STRING("", params_name(params_count()));
}

static void test_every_group_has_a_name_a_text_and_parameters_that_stand_together(void)
{
    size_t group = 0u;
    for (size_t i = 0u; i < params_count(); i++) {
        const size_t now = params_info(i)->group;
        TEST_ASSERT_TRUE_MESSAGE((now == group) || (now == group + 1u), params_name(i));
        group = now;
    }
    TEST_ASSERT_EQUAL_size_t(PARAM_GROUPS, group + 1u);
    for (size_t k = 0u; k < PARAM_GROUPS; k++) {
        TEST_ASSERT_TRUE(strlen(params_group_name(k)) > 2u);
        TEST_ASSERT_TRUE(strlen(params_group_text(k)) > 2u);
    }
    TEST_ASSERT_EQUAL_STRING("", params_group_name(PARAM_GROUPS));
    TEST_ASSERT_EQUAL_STRING("", params_group_text(PARAM_GROUPS));
}

static void test_a_choice_is_a_whole_number_with_a_name_for_each_value(void)
{
    size_t enumerated = 0u;
    for (size_t i = 0u; i < params_count(); i++) {
        const param_info_t *info = params_info(i);
        const char *const *choices = param_choices(info);
        if (choices == NULL) {
            TEST_ASSERT_TRUE_MESSAGE(info->type != PARAM_CHOICE, params_name(i));
            continue;
        }
        enumerated++;
        TEST_ASSERT_EQUAL_UINT8(PARAM_CHOICE, info->type);
        TEST_ASSERT_EQUAL_STRING("", param_unit(info));
        TEST_ASSERT_EQUAL_FLOAT(0.0f, info->minimum);
        for (size_t k = 0u; k <= (size_t)info->maximum; k++) {
            TEST_ASSERT_TRUE_MESSAGE(strlen(choices[k]) >= 2u, params_name(i));
            for (size_t m = 0u; m < k; m++) {
                TEST_ASSERT_TRUE_MESSAGE(strcmp(choices[k], choices[m]) != 0, params_name(i));
            }
        }
    }
    TEST_ASSERT_EQUAL_size_t(17u, enumerated);
    const param_info_t *action = params_info(params_find("lost_action"));
    TEST_ASSERT_EQUAL_FLOAT(2.0f, action->maximum);
    TEST_ASSERT_EQUAL_STRING("fault", param_choices(action)[1]);
}

static void test_defaults_are_those_of_the_list(void)
{
    params_t p;
    memset(&p, 0xA5, sizeof(p));
    params_default(&p);
    for (size_t i = 0u; i < params_count(); i++) {
        TEST_ASSERT_EQUAL_FLOAT(params_initial(i), params_get(&p, i));
    }
    TEST_ASSERT_EQUAL_FLOAT(0.93f, p.Rs_ohm);
    TEST_ASSERT_EQUAL_UINT32(14u, p.adc_bits);
}

static void test_a_parameter_beyond_the_list_has_no_default(void)
{
    TEST_ASSERT_EQUAL_FLOAT(0.0f, params_initial(params_count()));
}

static void test_set_writes_the_named_field_and_no_other(void)
{
    params_t p, before;
    params_default(&p);
    before = p;
    TEST_ASSERT_EQUAL(PARAMS_OK, params_set(&p, params_find("i_d_A"), 3.25f));
    TEST_ASSERT_EQUAL_FLOAT(3.25f, p.i_d_A);
    p.i_d_A = before.i_d_A;
    TEST_ASSERT_EQUAL_MEMORY(&before, &p, sizeof(p));
    TEST_ASSERT_EQUAL(PARAMS_OK, params_set(&p, params_find("eps1_mode"), 2.0f));
    TEST_ASSERT_EQUAL_UINT32(2u, p.eps1_mode);
    TEST_ASSERT_EQUAL_FLOAT(2.0f, params_get(&p, params_find("eps1_mode")));
}

static void test_set_refuses_and_leaves_everything_as_it_was(void)
{
    params_t p, before;
    params_default(&p);
    before = p;
    for (size_t i = 0u; i < params_count(); i++) {
        const param_info_t *info = params_info(i);
        TEST_ASSERT_EQUAL(PARAMS_NOT_FINITE, params_set(&p, i, NAN));
        TEST_ASSERT_EQUAL(PARAMS_NOT_FINITE, params_set(&p, i, INFINITY));
        TEST_ASSERT_EQUAL(PARAMS_NOT_FINITE, params_set(&p, i, -INFINITY));
        TEST_ASSERT_EQUAL(PARAMS_OUT_OF_RANGE,
                          params_set(&p, i, nextafterf(info->maximum, INFINITY)));
        TEST_ASSERT_EQUAL(PARAMS_OUT_OF_RANGE,
                          params_set(&p, i, nextafterf(info->minimum, -INFINITY)));
        if (info->type != PARAM_FLOAT) {
            TEST_ASSERT_EQUAL(PARAMS_NOT_WHOLE, params_set(&p, i, info->minimum + 0.5f));
        }
    }
    TEST_ASSERT_EQUAL(PARAMS_NO_SUCH, params_set(&p, params_count(), 1.0f));
    TEST_ASSERT_EQUAL_MEMORY(&before, &p, sizeof(p));
}

static void test_both_ends_of_every_range_are_accepted(void)
{
    params_t p;
    params_default(&p);
    for (size_t i = 0u; i < params_count(); i++) {
        TEST_ASSERT_EQUAL(PARAMS_OK, params_set(&p, i, params_info(i)->minimum));
        TEST_ASSERT_EQUAL_FLOAT(params_info(i)->minimum, params_get(&p, i));
        TEST_ASSERT_EQUAL(PARAMS_OK, params_set(&p, i, params_info(i)->maximum));
        TEST_ASSERT_EQUAL_FLOAT(params_info(i)->maximum, params_get(&p, i));
    }
}

static void test_a_name_must_match_whole(void)
{
    TEST_ASSERT_EQUAL_size_t(params_count(), params_find(""));
    TEST_ASSERT_EQUAL_size_t(params_count(), params_find("Rs"));
    TEST_ASSERT_EQUAL_size_t(params_count(), params_find("Rs_ohm2"));
    TEST_ASSERT_EQUAL_size_t(params_count(), params_find("rs_ohm"));
    const params_t p = {0};
    TEST_ASSERT_EQUAL_FLOAT(0.0f, params_get(&p, params_count()));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_parameter_has_name_text_and_a_default_in_range);
    RUN_TEST(test_every_group_has_a_name_a_text_and_parameters_that_stand_together);
    RUN_TEST(test_a_choice_is_a_whole_number_with_a_name_for_each_value);
    RUN_TEST(test_defaults_are_those_of_the_list);
    RUN_TEST(test_a_parameter_beyond_the_list_has_no_default);
    RUN_TEST(test_set_writes_the_named_field_and_no_other);
    RUN_TEST(test_set_refuses_and_leaves_everything_as_it_was);
    RUN_TEST(test_both_ends_of_every_range_are_accepted);
    RUN_TEST(test_a_name_must_match_whole);
    return UNITY_END();
}
