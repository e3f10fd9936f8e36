/* Three low-side shunts: which leg can be read, and what stands for one that cannot. The truth
 * comes from a bridge that switches as TIM1 does: in each half period a lower switch conducts while
 * the counter is above the compare value. */
#include "g431_shunts.h"

#include "unity.h"

#define TOP    17000u
#define SETTLE 400u
#define HOLD   306u
#define IDLE   2500u

static g431_shunts_t shunts;
static stm32_tim_t tim;
static stm32_adc_t adc1;
static stm32_adc_t adc2;
static stm32_adc_common_t common;
static const g431_channels_t channels = {.u = 3u, .w = 12u, .v = 3u, .dc = 1u};
static const g431_adcs_t adcs = {&adc1, &adc2, &common, &channels};

void setUp(void)
{
    shunts = (g431_shunts_t){
        .settle_counts = SETTLE, .hold_counts = HOLD, .idle = {IDLE, IDLE + 20u, IDLE - 20u}};
    tim = (stm32_tim_t){.ARR = TOP};
    adc1 = (stm32_adc_t){.ISR = ADC_ISR_JEOS};
    adc2 = (stm32_adc_t){0};
    common = (stm32_adc_common_t){0};
}

void tearDown(void)
{
}

/* Duties in counts, as two control interrupts wrote them. */
static void write(uint32_t u, uint32_t v, uint32_t w)
{
    tim.CCR1 = u;
    tim.CCR2 = v;
    tim.CCR3 = w;
    g431_shunts_written(&shunts, &tim);
}

/* What the converters see of three currents (counts): nothing of a leg whose lower switch is off.
 */
static g431_words_t seen(const int32_t i[3])
{
    const uint32_t before[3] = {shunts.before[0], shunts.before[1], shunts.before[2]};
    int32_t word[3];
    for (int leg = 0; leg < 3; leg++) {
        const bool conducts = (TOP - before[leg] >= SETTLE) && (TOP - shunts.behind[leg] >= HOLD);
        word[leg] = (int32_t)shunts.idle[leg] - (conducts ? i[leg] : 0);
    }
    return (g431_words_t){(uint16_t)word[0], (uint16_t)word[1], (uint16_t)word[2], 1234u};
}

static hal_sample_t sampled(const int32_t i[3])
{
    const g431_words_t words = seen(i);
    hal_sample_t sample = {.late_periods = 7u, .inputs = 1u};
    g431_shunts_words(&shunts, TOP, &words, &sample);
    return sample;
}

static void assert_currents(const int32_t i[3], const hal_sample_t *sample)
{
    TEST_ASSERT_EQUAL_INT(2048 + i[0], sample->i_u_counts);
    TEST_ASSERT_EQUAL_INT(2048 + i[1], sample->i_v_counts);
    TEST_ASSERT_EQUAL_INT(2048 + i[2], sample->i_w_counts);
}

static void test_current_into_the_motor_is_positive_around_mid_scale(void)
{
    const int32_t i[3] = {300, -100, -200};
    write(8000u, 8500u, 9000u);
    write(8000u, 8500u, 9000u);
    const hal_sample_t sample = sampled(i);
    assert_currents(i, &sample);
    TEST_ASSERT_EQUAL_UINT16(1234u, sample.u_dc_counts);
    TEST_ASSERT_EQUAL_UINT16(2048u, sample.u_uv_counts); /* no sensors */
    TEST_ASSERT_EQUAL_UINT16(2048u, sample.u_vw_counts);
    TEST_ASSERT_EQUAL_UINT16(7u, sample.late_periods);
    TEST_ASSERT_EQUAL_UINT16(1u, sample.inputs);
}

/* All directions of a voltage up to the largest that still leaves two legs to read. */
static void test_one_hidden_leg_of_any_duty_is_what_the_others_leave(void)
{
    const int32_t i[3] = {300, -100, -200};
    for (uint32_t leg = 0u; leg < 3u; leg++) {
        for (uint32_t counts = 0u; counts <= TOP; counts += 10u) {
            uint32_t duty[3] = {8000u, 8000u, 8000u};
            duty[leg] = counts;
            write(duty[0], duty[1], duty[2]);
            write(duty[0], duty[1], duty[2]);
            const hal_sample_t sample = sampled(i);
            assert_currents(i, &sample);
        }
    }
}

/* The first half of the low time has the old duty, the second the new one. */
static void test_each_half_has_its_own_duty_and_its_own_need(void)
{
    const int32_t i[3] = {300, -100, -200};
    const uint32_t edge[] = {TOP - SETTLE, TOP - SETTLE + 1u, TOP - HOLD, TOP - HOLD + 1u, TOP};
    for (uint32_t first = 0u; first < 5u; first++) {
        for (uint32_t second = 0u; second < 5u; second++) {
            write(8000u, edge[first], 8000u);
            write(8000u, edge[second], 8000u);
            const hal_sample_t sample = sampled(i);
            assert_currents(i, &sample);
        }
    }
}

/* Exactly at the edges a leg is read: its own word shows, though the sum is not zero. */
static void test_a_leg_that_conducts_just_long_enough_is_read(void)
{
    const int32_t i[3] = {300, -100, -150};
    write(TOP - SETTLE, 8000u, 8000u);
    write(TOP - HOLD, 8000u, 8000u);
    hal_sample_t sample = sampled(i);
    TEST_ASSERT_EQUAL_INT(2048 + 300, sample.i_u_counts);
    write(TOP - SETTLE + 1u, 8000u, 8000u);
    write(TOP - HOLD, 8000u, 8000u);
    sample = sampled(i);
    TEST_ASSERT_EQUAL_INT(2048 + 250, sample.i_u_counts);
    write(TOP - SETTLE, 8000u, 8000u);
    write(TOP - HOLD + 1u, 8000u, 8000u);
    sample = sampled(i);
    TEST_ASSERT_EQUAL_INT(2048 + 250, sample.i_u_counts);
}

/* Of two that are too short, the shorter one is calculated. */
static void test_of_two_hidden_legs_the_worse_one_is_calculated(void)
{
    for (uint32_t worse = 0u; worse < 3u; worse++) {
        uint32_t duty[3] = {8000u, 8000u, 8000u};
        duty[worse] = TOP;
        duty[(worse + 1u) % 3u] = TOP - 10u;
        write(duty[0], duty[1], duty[2]);
        write(duty[0], duty[1], duty[2]);
        const g431_words_t words = {IDLE - 50u, IDLE + 20u - 50u, IDLE - 20u - 50u, 0u};
        hal_sample_t sample;
        g431_shunts_words(&shunts, TOP, &words, &sample);
        const uint16_t found[3] = {sample.i_u_counts, sample.i_v_counts, sample.i_w_counts};
        for (uint32_t leg = 0u; leg < 3u; leg++) {
            TEST_ASSERT_EQUAL_UINT16((leg == worse) ? 1948u : 2098u, found[leg]);
        }
    }
}

/* Beyond the converter's range no current is known: the word is out of range as well. */
static void test_a_word_at_the_end_of_the_range_stays_there(void)
{
    const g431_words_t low = {0u, 0u, 0u, 0u};
    const g431_words_t high = {4095u, 4095u, 4095u, 0u};
    hal_sample_t sample;
    g431_shunts_words(&shunts, TOP, &low, &sample);
    TEST_ASSERT_EQUAL_UINT16(4095u, sample.i_u_counts);
    TEST_ASSERT_EQUAL_UINT16(4095u, sample.i_v_counts);
    TEST_ASSERT_EQUAL_UINT16(4095u, sample.i_w_counts);
    g431_shunts_words(&shunts, TOP, &high, &sample);
    TEST_ASSERT_EQUAL_UINT16(0u, sample.i_u_counts);
    TEST_ASSERT_EQUAL_UINT16(0u, sample.i_v_counts);
    TEST_ASSERT_EQUAL_UINT16(0u, sample.i_w_counts);
}

/* The largest of the words that are none of the two ends, and what runs over by calculation. */
static void test_words_never_wrap(void)
{
    const g431_words_t words = {1u, 4094u, 1u, 0u};
    hal_sample_t sample;
    g431_shunts_words(&shunts, TOP, &words, &sample);
    TEST_ASSERT_EQUAL_UINT16(4095u, sample.i_u_counts); /* 2048 + 2499 */
    TEST_ASSERT_EQUAL_INT(2048 + (int)IDLE + 20 - 4094, sample.i_v_counts);
    write(8000u, TOP, 8000u);
    write(8000u, TOP, 8000u);
    g431_shunts_words(&shunts, TOP, &words, &sample);
    TEST_ASSERT_EQUAL_UINT16(0u, sample.i_v_counts); /* 2048 - 2499 - 2479 */
}

static void convert_to(uint32_t u, uint32_t v, uint32_t w)
{
    adc1.JDR1 = u;
    adc2.JDR1 = v;
    adc1.JDR2 = w;
}

static void test_the_level_without_current_is_measured(void)
{
    convert_to(2300u, 2500u, 2800u);
    TEST_ASSERT_TRUE(g431_shunts_measure(&shunts, &adcs, 2542u, 10u));
    TEST_ASSERT_EQUAL_UINT16(2300u, shunts.idle[0]);
    TEST_ASSERT_EQUAL_UINT16(2500u, shunts.idle[1]);
    TEST_ASSERT_EQUAL_UINT16(2800u, shunts.idle[2]);
}

static void test_a_level_that_cannot_be_is_not_taken(void)
{
    convert_to(2542u + G431_SHUNTS_OFF_MAX, 2542u - G431_SHUNTS_OFF_MAX, 2542u);
    TEST_ASSERT_TRUE(g431_shunts_measure(&shunts, &adcs, 2542u, 10u));
    convert_to(2542u + G431_SHUNTS_OFF_MAX + 1u, 2500u, 2542u - G431_SHUNTS_OFF_MAX - 1u);
    TEST_ASSERT_FALSE(g431_shunts_measure(&shunts, &adcs, 2542u, 10u));
    TEST_ASSERT_EQUAL_UINT16(2542u, shunts.idle[0]);
    TEST_ASSERT_EQUAL_UINT16(2542u, shunts.idle[2]);
}

/* The flag is cleared by writing 1, which RAM keeps: without it no conversion ends. */
static void test_a_converter_that_does_not_answer_is_told(void)
{
    convert_to(2542u, 2542u, 2542u);
    TEST_ASSERT_FALSE(g431_shunts_measure(&shunts, &adcs, 2542u, 0u));
    TEST_ASSERT_EQUAL_UINT16(2542u, shunts.idle[0]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_current_into_the_motor_is_positive_around_mid_scale);
    RUN_TEST(test_one_hidden_leg_of_any_duty_is_what_the_others_leave);
    RUN_TEST(test_each_half_has_its_own_duty_and_its_own_need);
    RUN_TEST(test_a_leg_that_conducts_just_long_enough_is_read);
    RUN_TEST(test_of_two_hidden_legs_the_worse_one_is_calculated);
    RUN_TEST(test_a_word_at_the_end_of_the_range_stays_there);
    RUN_TEST(test_words_never_wrap);
    RUN_TEST(test_the_level_without_current_is_measured);
    RUN_TEST(test_a_level_that_cannot_be_is_not_taken);
    RUN_TEST(test_a_converter_that_does_not_answer_is_told);
    return UNITY_END();
}
