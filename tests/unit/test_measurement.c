#include "measurement.h"

#include <complex.h>

#include "exact.h"

/* One ampere, one volt and half a volt per count: all sums are exact. */
static const measurement_params_t exact_params = {
    .adc_bits = 14u,
    .current_full_scale_A = 8192.0f,
    .line_voltage_full_scale_V = 8192.0f,
    .dc_link_full_scale_V = 8192.0f,
    .current_sum_max_A = 3.0f,
    .swap_vw = false,
};

/* The rig of the paper. */
static const measurement_params_t paper_params = {
    .adc_bits = 14u,
    .current_full_scale_A = 25.0f,
    .line_voltage_full_scale_V = 400.0f,
    .dc_link_full_scale_V = 400.0f,
    .current_sum_max_A = 2.0f,
    .swap_vw = false,
};

static const measurement_in_t centre = {8192u, 8192u, 8192u, 8192u, 8192u, 8192u, 0u, 0u};
static const measurement_state_t no_offset = {.offset_A = {0.0f, 0.0f, 0.0f}};

static measured_t step(const measurement_params_t *params, const measurement_state_t *st,
                       measurement_in_t in)
{
    measurement_config_t cfg;
    measured_t out;
    TEST_ASSERT_TRUE(measurement_init(&cfg, params));
    memset(&out, 0xFF, sizeof out);
    measurement_step(&cfg, st, &in, &out);
    return out;
}

void setUp(void)
{
}

void tearDown(void)
{
}

static void test_centre_words_are_zero(void)
{
    const measured_t out = step(&paper_params, &no_offset, centre);
    ASSERT_SAME_FLOAT(0.0f, out.i_A.u);
    ASSERT_SAME_FLOAT(0.0f, out.i_A.v);
    ASSERT_SAME_FLOAT(0.0f, out.i_A.w);
    ASSERT_SAME_FLOAT(0.0f, out.i_s_A.alpha);
    ASSERT_SAME_FLOAT(0.0f, out.i_s_A.beta);
    ASSERT_SAME_FLOAT(0.0f, out.u_line_V.alpha);
    ASSERT_SAME_FLOAT(0.0f, out.u_line_V.beta);
    ASSERT_SAME_FLOAT(200.0f, out.u_dc_V);
    TEST_ASSERT_EQUAL_UINT32(0u, out.flags);
}

static void test_every_word_length_spans_the_full_scale(void)
{
    for (uint32_t bits = 8u; bits <= 16u; bits++) {
        measurement_params_t params = paper_params;
        params.adc_bits = bits;
        const uint32_t codes = 1u << bits;
        measurement_in_t in = {0};
        in.i_v_counts = (uint16_t)(codes - 1u);
        in.u_dc_counts = (uint16_t)(codes - 1u);
        const measured_t out = step(&params, &no_offset, in);
        ASSERT_SAME_FLOAT(-25.0f, out.i_A.u);
        ASSERT_NEAR(2e-6, 25.0 - 50.0 / codes, out.i_A.v);
        ASSERT_NEAR(5e-5, 400.0 - 400.0 / codes, out.u_dc_V);
        TEST_ASSERT_EQUAL_UINT32(MEASUREMENT_SATURATED | MEASUREMENT_CURRENT_SUM, out.flags);
    }
}

static void test_step_is_the_scaling_in_double_precision(void)
{
    uint32_t seed = 3u;
    for (int k = 0; k < 200; k++) {
        uint16_t word[6];
        double value[6];
        for (int c = 0; c < 6; c++) {
            word[c] = (uint16_t)(8192.0f + 8000.0f * noise(&seed));
            value[c] = (word[c] - 8192.0) / 8192.0;
        }
        const measurement_state_t st = {.offset_A = {0.125f, -0.25f, 0.0625f}};
        const measurement_in_t in = {word[0], word[1], word[2], word[3], word[4], word[5], 0u, 0u};
        const measured_t out = step(&paper_params, &st, in);
        const double i_u = 25.0 * value[0] - 0.125;
        const double i_v = 25.0 * value[1] + 0.25;
        const double i_w = 25.0 * value[2] - 0.0625;
        const uvw_t raw_A = measurement_raw_A(&st, out.i_A);
        ASSERT_NEAR(1e-5, i_u + 0.125, raw_A.u);
        ASSERT_NEAR(1e-5, i_v - 0.25, raw_A.v);
        ASSERT_NEAR(1e-5, i_w + 0.0625, raw_A.w);
        ASSERT_NEAR(1e-5, i_u, out.i_A.u);
        ASSERT_NEAR(1e-5, i_v, out.i_A.v);
        ASSERT_NEAR(1e-5, i_w, out.i_A.w);
        ASSERT_NEAR(1e-5, sqrt(2.0 / 3.0) * (i_u - 0.5 * (i_v + i_w)), out.i_s_A.alpha);
        ASSERT_NEAR(1e-5, sqrt(0.5) * (i_v - i_w), out.i_s_A.beta);
        /* u_u - (u_v + u_w)/2 = u_uv + u_vw/2 */
        const double u_uv = 400.0 * value[3];
        const double u_vw = 400.0 * value[4];
        ASSERT_NEAR(1e-4, sqrt(2.0 / 3.0) * (u_uv + 0.5 * u_vw), out.u_line_V.alpha);
        ASSERT_NEAR(1e-4, sqrt(0.5) * u_vw, out.u_line_V.beta);
        ASSERT_NEAR(1e-4, 400.0 * word[5] / 16384.0, out.u_dc_V);
    }
}

/* Line voltages of u_uv 100, u_vw 10 V: alpha sqrt(2/3) 105, beta sqrt(1/2) 10. */
static void test_the_voltage_offset_is_taken_off_the_line_voltage_only(void)
{
    const measurement_in_t in = {8202u, 8188u, 8186u, 8292u, 8202u, 300u, 0u, 0u};
    const measurement_state_t st = {.offset_V = {1.5f, -0.25f}};
    const measured_t plain = step(&exact_params, &no_offset, in);
    const measured_t out = step(&exact_params, &st, in);
    ASSERT_NEAR(1e-5, sqrt(2.0 / 3.0) * 105.0, plain.u_line_V.alpha);
    ASSERT_NEAR(1e-5, sqrt(0.5) * 10.0, plain.u_line_V.beta);
    ASSERT_SAME_FLOAT(plain.u_line_V.alpha - 1.5f, out.u_line_V.alpha);
    ASSERT_SAME_FLOAT(plain.u_line_V.beta + 0.25f, out.u_line_V.beta);
    TEST_ASSERT_EQUAL_MEMORY(&plain.i_A, &out.i_A, sizeof out.i_A);
    ASSERT_SAME_FLOAT(plain.u_dc_V, out.u_dc_V);
    TEST_ASSERT_EQUAL_UINT32(0u, out.flags);
}

/* What the offsets took comes back: the state machine averages what the sensors show. */
static void test_offsets_that_are_set_are_taken_off_and_put_back(void)
{
    measurement_state_t st = {0};
    const uvw_t offset_A = {1.5f, -2.0f, 0.5f};
    measurement_set_offsets(&st, offset_A, (ab_t){3.0f, -4.0f});
    const measurement_in_t in = {8202u, 8188u, 8186u, 8292u, 8202u, 300u, 0u, 0u};
    const measured_t plain = step(&exact_params, &no_offset, in);
    const measured_t out = step(&exact_params, &st, in);
    const uvw_t raw_A = measurement_raw_A(&st, out.i_A);
    ASSERT_SAME_FLOAT(8.5f, out.i_A.u);
    ASSERT_SAME_FLOAT(-2.0f, out.i_A.v);
    ASSERT_SAME_FLOAT(-6.5f, out.i_A.w);
    TEST_ASSERT_EQUAL_MEMORY(&plain.i_A, &raw_A, sizeof raw_A);
    ASSERT_SAME_FLOAT(plain.u_line_V.alpha - 3.0f, out.u_line_V.alpha);
    ASSERT_SAME_FLOAT(plain.u_line_V.beta + 4.0f, out.u_line_V.beta);
}

static double complex complex_of(ab_t x)
{
    return (double)x.alpha + I * (double)x.beta;
}

static void test_next_phase_is_120_degrees_ahead(void)
{
    const measurement_in_t in = {9000u, 8500u, 7076u, 8192u, 8192u, 100u, 0u, 0u};
    const measurement_in_t moved = {7076u, 9000u, 8500u, 8192u, 8192u, 100u, 0u, 0u};
    const double complex before = complex_of(step(&paper_params, &no_offset, in).i_s_A);
    const double complex after = complex_of(step(&paper_params, &no_offset, moved).i_s_A);
    ASSERT_NEAR(1e-6, 0.0, cabs(after - before * cexp(I * 2.0943951023931953)));
}

static void test_double_full_scale_doubles_the_values(void)
{
    const measurement_in_t in = {9000u, 8500u, 7076u, 8300u, 8000u, 100u, 0u, 0u};
    measurement_params_t twice = paper_params;
    twice.current_full_scale_A *= 2.0f;
    twice.line_voltage_full_scale_V *= 2.0f;
    twice.dc_link_full_scale_V *= 2.0f;
    const measured_t one = step(&paper_params, &no_offset, in);
    const measured_t two = step(&twice, &no_offset, in);
    ASSERT_SAME_FLOAT(2.0f * one.i_s_A.alpha, two.i_s_A.alpha);
    ASSERT_SAME_FLOAT(2.0f * one.i_s_A.beta, two.i_s_A.beta);
    ASSERT_SAME_FLOAT(2.0f * one.u_line_V.alpha, two.u_line_V.alpha);
    ASSERT_SAME_FLOAT(2.0f * one.u_line_V.beta, two.u_line_V.beta);
    ASSERT_SAME_FLOAT(2.0f * one.u_dc_V, two.u_dc_V);
}

/* Motor wired u-w-v: the inverter's leg v feeds the motor's phase w. Phase voltages of the motor
 * u 70, v -30, w -40 V; currents u 10, v -4, w -6 A. */
static void test_swapped_wiring_gives_the_motors_own_order(void)
{
    const measurement_in_t straight = {8202u, 8188u, 8186u, 8292u, 8202u, 300u, 0u, 0u};
    const measurement_in_t wired = {8202u, 8186u, 8188u, 8302u, 8182u, 300u, 0u, 0u};
    measurement_params_t swapped = exact_params;
    swapped.swap_vw = true;
    const measurement_state_t st = {.offset_A = {0.0f, 1.0f, -1.0f}};
    const measured_t expected = step(&exact_params, &st, straight);
    const measured_t actual = step(&swapped, &st, wired);
    ASSERT_SAME_FLOAT(10.0f, expected.i_A.u);
    ASSERT_SAME_FLOAT(-5.0f, expected.i_A.v);
    ASSERT_SAME_FLOAT(-5.0f, expected.i_A.w);
    TEST_ASSERT_EQUAL_MEMORY(&expected, &actual, sizeof expected);
}

static uint32_t flags_of(int channel, uint32_t word, uint32_t bits)
{
    measurement_params_t params = exact_params;
    params.adc_bits = bits;
    params.current_sum_max_A = 1e9f;
    const uint16_t mid = (uint16_t)(1u << (bits - 1u));
    measurement_in_t in = {mid, mid, mid, mid, mid, mid, 0u, 0u};
    uint16_t *const words[6] = {&in.i_u_counts,  &in.i_v_counts,  &in.i_w_counts,
                                &in.u_uv_counts, &in.u_vw_counts, &in.u_dc_counts};
    *words[channel] = (uint16_t)word;
    return step(&params, &no_offset, in).flags;
}

static void test_word_at_the_upper_end_is_saturated(void)
{
    for (int channel = 0; channel < 6; channel++) {
        TEST_ASSERT_EQUAL_UINT32(0u, flags_of(channel, 16382u, 14u));
        TEST_ASSERT_EQUAL_UINT32(MEASUREMENT_SATURATED, flags_of(channel, 16383u, 14u));
        TEST_ASSERT_EQUAL_UINT32(MEASUREMENT_SATURATED, flags_of(channel, 65535u, 16u));
    }
}

static void test_word_at_the_lower_end_is_saturated(void)
{
    for (int channel = 0; channel < 5; channel++) {
        TEST_ASSERT_EQUAL_UINT32(0u, flags_of(channel, 1u, 14u));
        TEST_ASSERT_EQUAL_UINT32(MEASUREMENT_SATURATED, flags_of(channel, 0u, 14u));
    }
}

static void test_dc_link_of_zero_is_not_saturated(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, flags_of(5, 0u, 14u));
}

static void test_word_above_the_range_did_not_come_from_the_adc(void)
{
    for (int channel = 0; channel < 6; channel++) {
        const uint32_t both = MEASUREMENT_OUT_OF_RANGE | MEASUREMENT_SATURATED;
        TEST_ASSERT_EQUAL_UINT32(both, flags_of(channel, 16384u, 14u));
        TEST_ASSERT_EQUAL_UINT32(both, flags_of(channel, 65535u, 14u));
    }
}

static void test_every_flag_has_a_bit_of_its_own(void)
{
    TEST_ASSERT_BITS_LOW(MEASUREMENT_SATURATED, MEASUREMENT_OUT_OF_RANGE);
    TEST_ASSERT_BITS_LOW(MEASUREMENT_SATURATED | MEASUREMENT_OUT_OF_RANGE, MEASUREMENT_CURRENT_SUM);
}

static void test_flags_of_several_channels_add_up(void)
{
    measurement_in_t in = centre;
    in.i_u_counts = 0u;
    in.i_v_counts = 16384u;
    in.i_w_counts = 0u;
    const measured_t out = step(&exact_params, &no_offset, in);
    TEST_ASSERT_EQUAL_UINT32(
        MEASUREMENT_SATURATED | MEASUREMENT_OUT_OF_RANGE | MEASUREMENT_CURRENT_SUM, out.flags);
}

static uint32_t flags_of_currents(uint16_t u, uint16_t v, uint16_t w, measurement_state_t st)
{
    measurement_in_t in = centre;
    in.i_u_counts = u;
    in.i_v_counts = v;
    in.i_w_counts = w;
    return step(&exact_params, &st, in).flags;
}

static void test_current_sum_at_the_limit_is_allowed(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, flags_of_currents(8202u, 8187u, 8190u, no_offset)); /* 10-5-2 */
    TEST_ASSERT_EQUAL_UINT32(0u, flags_of_currents(8182u, 8197u, 8194u, no_offset));
}

static void test_current_sum_beyond_the_limit_is_flagged(void)
{
    TEST_ASSERT_EQUAL_UINT32(MEASUREMENT_CURRENT_SUM,
                             flags_of_currents(8202u, 8187u, 8191u, no_offset)); /* 10-5-1 */
    TEST_ASSERT_EQUAL_UINT32(MEASUREMENT_CURRENT_SUM,
                             flags_of_currents(8182u, 8197u, 8193u, no_offset));
}

static void test_current_sum_is_judged_without_the_offsets(void)
{
    const measurement_state_t st = {.offset_A = {1.5f, 1.5f, 1.5f}};
    TEST_ASSERT_EQUAL_UINT32(0u, flags_of_currents(8194u, 8193u, 8193u, st));
    TEST_ASSERT_EQUAL_UINT32(MEASUREMENT_CURRENT_SUM, flags_of_currents(8192u, 8192u, 8192u, st));
}

static void test_nan_offset_is_flagged(void)
{
    const measurement_state_t st = {.offset_A = {0.0f, NAN, 0.0f}};
    TEST_ASSERT_EQUAL_UINT32(MEASUREMENT_CURRENT_SUM, flags_of_currents(8192u, 8192u, 8192u, st));
}

static void assert_refused(const measurement_params_t *params)
{
    measurement_config_t cfg;
    TEST_ASSERT_FALSE(measurement_init(&cfg, params));
}

static void test_init_refuses_senseless_word_lengths(void)
{
    const uint32_t bad[4] = {0u, 7u, 17u, 0xFFFFFFFFu};
    for (int k = 0; k < 4; k++) {
        measurement_params_t params = paper_params;
        params.adc_bits = bad[k];
        assert_refused(&params);
    }
}

static void assert_scale_judged(float scale, bool accepted)
{
    for (int field = 0; field < 3; field++) {
        measurement_params_t params = paper_params;
        float *const scales[3] = {&params.current_full_scale_A, &params.line_voltage_full_scale_V,
                                  &params.dc_link_full_scale_V};
        *scales[field] = scale;
        measurement_config_t cfg;
        TEST_ASSERT_EQUAL(accepted, measurement_init(&cfg, &params));
    }
}

static void test_init_refuses_senseless_full_scales(void)
{
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        assert_scale_judged(not_positive(k), false);
    }
    assert_scale_judged(0.999e-3f, false);
    assert_scale_judged(1e-3f, true);
    assert_scale_judged(1e6f, true);
    assert_scale_judged(1.001e6f, false);
}

static void test_init_refuses_a_senseless_current_sum_limit(void)
{
    for (int k = 0; k < NOT_POSITIVE_COUNT; k++) {
        measurement_params_t params = paper_params;
        params.current_sum_max_A = not_positive(k);
        assert_refused(&params);
    }
}

static void test_offsets_that_moved_are_taken_out_of_the_vector_alone(void)
{
    measurement_state_t st = {0};
    const uvw_t offset_A = {1.0f, 2.0f, 3.0f};
    measurement_set_offsets(&st, offset_A, (ab_t){0.0f, 0.0f});
    const measured_t before = step(&paper_params, &st, centre);
    st.moved_A = (ab_t){0.25f, -0.5f};
    const measured_t after = step(&paper_params, &st, centre);
    ASSERT_SAME_FLOAT(before.i_s_A.alpha - 0.25f, after.i_s_A.alpha);
    ASSERT_SAME_FLOAT(before.i_s_A.beta + 0.5f, after.i_s_A.beta);
    TEST_ASSERT_EQUAL_MEMORY(&before.i_A, &after.i_A, sizeof before.i_A);
    measurement_set_offsets(&st, offset_A, (ab_t){0.0f, 0.0f});
    ASSERT_SAME_FLOAT(before.i_s_A.alpha, step(&paper_params, &st, centre).i_s_A.alpha);
}

/* Of the vectors, whose offsets are gone by then; the phases stay as they are. */
static void test_an_unbalance_is_taken_out_of_the_vectors_alone(void)
{
    measurement_state_t st = {0};
    measurement_set_offsets(&st, (uvw_t){1.0f, 2.0f, 3.0f}, (ab_t){5.0f, -4.0f});
    const measured_t before = step(&paper_params, &st, centre);
    st.unbalance = (unbalance_t){{0.25f, -0.5f}, {0.125f, 0.0625f}};
    const measured_t after = step(&paper_params, &st, centre);
    const double i[] = {(double)before.i_s_A.alpha, (double)before.i_s_A.beta};
    const double u[] = {(double)before.u_line_V.alpha, (double)before.u_line_V.beta};
    ASSERT_NEAR(1e-6, i[0] - (0.25 * i[0] - 0.5 * i[1]), after.i_s_A.alpha);
    ASSERT_NEAR(1e-6, i[1] - (-0.5 * i[0] - 0.25 * i[1]), after.i_s_A.beta);
    ASSERT_NEAR(1e-6, u[0] - (0.125 * u[0] + 2.0 * 0.0625 * u[1]), after.u_line_V.alpha);
    ASSERT_NEAR(1e-6, u[1] + 0.125 * u[1], after.u_line_V.beta);
    TEST_ASSERT_EQUAL_MEMORY(&before.i_A, &after.i_A, sizeof before.i_A);
    /* After a fault that may have spoiled it, it begins again with the offsets. */
    measurement_set_offsets(&st, (uvw_t){1.0f, 2.0f, 3.0f}, (ab_t){5.0f, -4.0f});
    const measured_t again = step(&paper_params, &st, centre);
    TEST_ASSERT_EQUAL_MEMORY(&before.i_s_A, &again.i_s_A, sizeof before.i_s_A);
    TEST_ASSERT_EQUAL_MEMORY(&before.u_line_V, &again.u_line_V, sizeof before.u_line_V);
}

static measurement_in_t voltages(double uv_counts, double vw_counts)
{
    measurement_in_t in = centre;
    in.u_uv_counts = (uint16_t)(centre.u_uv_counts + lrint(uv_counts));
    in.u_vw_counts = (uint16_t)(centre.u_vw_counts + lrint(vw_counts));
    return in;
}

/* Lines with gains of 1.01 and .99: with their n the vector is that of equal gains again, the
 * direction included. With v and w swapped n is conjugated. */
static void test_two_lines_of_unequal_gains_show_the_vector_of_equal_ones(void)
{
    const double d = 0.99 - 1.01;
    for (int swap = 0; swap < 2; swap++) {
        measurement_params_t params = paper_params;
        params.swap_vw = swap != 0;
        measurement_state_t st = {0};
        const measured_t equal = step(&params, &st, voltages(3000.0, -5000.0));
        st.unbalance.u =
            (ab_t){(float)(-0.5 * d), (float)(((swap != 0) ? -0.5 : 0.5) * d / sqrt(3.0))};
        const measured_t seen = step(&params, &st, voltages(1.01 * 3000.0, 0.99 * -5000.0));
        const double size_V = sqrt((double)ab_norm2(equal.u_line_V));
        ASSERT_NEAR(4e-4 * size_V, (double)equal.u_line_V.alpha, seen.u_line_V.alpha);
        ASSERT_NEAR(4e-4 * size_V, (double)equal.u_line_V.beta, seen.u_line_V.beta);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_offsets_that_moved_are_taken_out_of_the_vector_alone);
    RUN_TEST(test_two_lines_of_unequal_gains_show_the_vector_of_equal_ones);
    RUN_TEST(test_an_unbalance_is_taken_out_of_the_vectors_alone);
    RUN_TEST(test_centre_words_are_zero);
    RUN_TEST(test_every_word_length_spans_the_full_scale);
    RUN_TEST(test_step_is_the_scaling_in_double_precision);
    RUN_TEST(test_the_voltage_offset_is_taken_off_the_line_voltage_only);
    RUN_TEST(test_offsets_that_are_set_are_taken_off_and_put_back);
    RUN_TEST(test_next_phase_is_120_degrees_ahead);
    RUN_TEST(test_double_full_scale_doubles_the_values);
    RUN_TEST(test_swapped_wiring_gives_the_motors_own_order);
    RUN_TEST(test_word_at_the_upper_end_is_saturated);
    RUN_TEST(test_word_at_the_lower_end_is_saturated);
    RUN_TEST(test_dc_link_of_zero_is_not_saturated);
    RUN_TEST(test_word_above_the_range_did_not_come_from_the_adc);
    RUN_TEST(test_every_flag_has_a_bit_of_its_own);
    RUN_TEST(test_flags_of_several_channels_add_up);
    RUN_TEST(test_current_sum_at_the_limit_is_allowed);
    RUN_TEST(test_current_sum_beyond_the_limit_is_flagged);
    RUN_TEST(test_current_sum_is_judged_without_the_offsets);
    RUN_TEST(test_nan_offset_is_flagged);
    RUN_TEST(test_init_refuses_senseless_word_lengths);
    RUN_TEST(test_init_refuses_senseless_full_scales);
    RUN_TEST(test_init_refuses_a_senseless_current_sum_limit);
    return UNITY_END();
}
