/* Garbage at the ADC for ten seconds: duties in 0..1 or gates off, never a NaN, never a crash. */
#include <math.h>
#include <stdbool.h>

#include "sil_rig.h"

enum {
    TEN_SECONDS = 50000
};

void setUp(void)
{
}

void tearDown(void)
{
}

static bool is_duty(float x)
{
    return (x >= 0.0f) && (x <= 1.0f);
}

static void check_output(const zh_sil_out *out)
{
    const float telemetry[] = {out->speed_hat_rpm, out->lambda_Wb, out->lambda_angle_rad,
                               out->i_d_A,         out->i_q_A,     out->i_q_ref_A,
                               out->e1_alpha_A,    out->e1_beta_A, out->stator_frequency_Hz,
                               out->l1_re,         out->l1_im,     out->l2_re,
                               out->l2_im,         out->x_rad_s};
    bool fine = is_duty(out->duty_u) && is_duty(out->duty_v) && is_duty(out->duty_w) &&
                (out->gates_on <= 1u) && (out->state <= ZH_STATE_TORQUE_OFF);
    for (size_t k = 0u; k < sizeof telemetry / sizeof telemetry[0]; k++) {
        fine = fine && isfinite(telemetry[k]);
    }
    TEST_ASSERT_TRUE(fine);
}

/* 64-bit LCG, high bits. */
static uint32_t next_random(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(*seed >> 33);
}

static void fill(zh_sil_in *in, uint16_t word)
{
    in->i_u = in->i_v = in->i_w = in->u_uv = in->u_vw = in->u_dc = word;
}

/* Ten seconds of one word everywhere, the drive having been running, commands still given. */
static zh_sil_out constant_words(uint16_t word)
{
    zh_sil *drive = open_drive(NULL);
    to_premagnetise(drive);
    zh_sil_in in = quiet_input();
    fill(&in, word);
    in.speed_ref_rpm = 300.0f;
    zh_sil_out out = fresh_output();
    for (uint32_t k = 0u; k < TEN_SECONDS; k++) {
        in.command = ((k / 500u) % 2u == 0u) ? ZH_SIL_RUN : ZH_SIL_FAULT_RESET;
        TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_step(drive, &in, &out));
        check_output(&out);
    }
    zh_sil_close(drive);
    return out;
}

static void test_all_zero_words_end_with_the_gates_off(void)
{
    const zh_sil_out out = constant_words(0u);
    TEST_ASSERT_EQUAL_UINT32(0u, out.gates_on);
    TEST_ASSERT_EQUAL_UINT32(ZH_STATE_FAULT, out.state);
    TEST_ASSERT_BITS_HIGH(ZH_FAULT_DC_UNDER_VOLTAGE, out.faults);
}

static void test_all_one_words_end_with_the_gates_off(void)
{
    const zh_sil_out out = constant_words(0xffffu);
    TEST_ASSERT_EQUAL_UINT32(0u, out.gates_on);
    TEST_ASSERT_EQUAL_UINT32(ZH_STATE_FAULT, out.state);
}

/* Currents that no limit sees, whatever they are: up to 6 A in two phases, their sum is 0. */
static void plausible_currents(uint64_t *seed, zh_sil_in *in)
{
    in->i_u = (uint16_t)(MID - 2048u + (next_random(seed) & 0xfffu));
    in->i_v = (uint16_t)(MID - 2048u + (next_random(seed) & 0xfffu));
    in->i_w = (uint16_t)(3u * MID - in->i_u - in->i_v);
    in->u_dc = U_DC;
}

/* `mask` cuts the random words to the ADC's range or leaves them beyond it. */
static void random_words(uint64_t seed, uint16_t mask, const char *overrides, bool plausible)
{
    zh_sil *drive = open_drive(overrides);
    to_premagnetise(drive);
    zh_sil_out out = fresh_output();
    for (uint32_t k = 0u; k < TEN_SECONDS; k++) {
        zh_sil_in in = quiet_input();
        in.i_u = (uint16_t)(next_random(&seed) & mask);
        in.i_v = (uint16_t)(next_random(&seed) & mask);
        in.i_w = (uint16_t)(next_random(&seed) & mask);
        in.u_uv = (uint16_t)(next_random(&seed) & mask);
        in.u_vw = (uint16_t)(next_random(&seed) & mask);
        in.u_dc = (uint16_t)(next_random(&seed) & mask);
        if (plausible) {
            plausible_currents(&seed, &in);
        }
        in.command = next_random(&seed) & 0x7u;
        in.speed_ref_rpm = (float)(int32_t)(next_random(&seed) % 200000u) - 1e5f;
        TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_step(drive, &in, &out));
        check_output(&out);
    }
    zh_sil_close(drive);
}

static void test_random_words_of_16_bit(void)
{
    random_words(1u, 0xffffu, NULL, false);
}

static void test_random_words_of_14_bit(void)
{
    random_words(2u, 0x3fffu, NULL, false);
}

/* Limits as far out of the way as they can be, so that garbage reaches observer and controllers
 * while the gates are on: the worst the arithmetic can be given. */
static void test_random_words_with_the_limits_out_of_the_way(void)
{
    random_words(3u, 0x3fffu,
                 "i_trip_A=24.9\nspeed_deviation_rad_s=1600\nspeed_deviation_s=10\n"
                 "over_speed_rad_s=9e3\nspeed_max_rad_s=8e3\nomega_max_rad_s=1e4\n"
                 "weaken_share=1\n"
                 "offset_calibration_s=0\neps1_mode=1\nphi_factor=1\nadapt_ki=1e6\nadapt_kp=160",
                 true);
}

static void test_random_floats_as_reference(void)
{
    uint64_t seed = 4u;
    zh_sil *drive = open_drive(NULL);
    to_premagnetise(drive);
    for (uint32_t k = 0u; k < TEN_SECONDS; k++) {
        union {
            uint32_t bits;
            float value;
        } any = {.bits = next_random(&seed) ^ (next_random(&seed) << 8)};
        zh_sil_in in = quiet_input();
        in.speed_ref_rpm = any.value;
        in.command = (k % 700u < 5u) ? ZH_SIL_FAULT_RESET : (k % 700u < 10u) ? 0u : ZH_SIL_RUN;
        zh_sil_out out = fresh_output();
        const int status = zh_sil_step(drive, &in, &out);
        TEST_ASSERT_EQUAL_INT(isfinite(any.value) ? ZH_OK : ZH_BAD_INPUT, status);
        check_output(&out);
    }
    zh_sil_close(drive);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_all_zero_words_end_with_the_gates_off);
    RUN_TEST(test_all_one_words_end_with_the_gates_off);
    RUN_TEST(test_random_words_of_16_bit);
    RUN_TEST(test_random_words_of_14_bit);
    RUN_TEST(test_random_words_with_the_limits_out_of_the_way);
    RUN_TEST(test_random_floats_as_reference);
    return UNITY_END();
}
