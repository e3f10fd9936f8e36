/* The SIL library as a foreign caller meets it: opening, stepping, parameters, threads. */
#include <math.h>
#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "sil_estimator.h"
#include "sil_rig.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static void test_version_is_that_of_the_header(void)
{
    TEST_ASSERT_EQUAL_UINT32(ZH_SIL_VERSION, zh_sil_version());
}

static void test_open_takes_machine_and_board_from_the_files(void)
{
    zh_sil *drive = open_drive(NULL);
    float value = 0.0f;
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_get(drive, "Rs_ohm", &value));
    TEST_ASSERT_EQUAL_FLOAT(0.93f, value);
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_get(drive, "adc_bits", &value));
    TEST_ASSERT_EQUAL_FLOAT(14.0f, value);
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_get(drive, "period_s", &value));
    TEST_ASSERT_EQUAL_FLOAT(200e-6f, value);
    zh_sil_close(drive);
}

/* Table 1 and the paper's board keep every default of the firmware to the last bit. */
static void test_papers_motor_and_board_keep_the_defaults(void)
{
    zh_sil *drive = open_drive("");
    for (uint32_t k = 0u; k < zh_sil_name_count(); k++) {
        zh_sil_name_info info = {.struct_size = sizeof info};
        float value = -1.0f;
        TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_describe(k, &info));
        TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_get(drive, zh_sil_name(k), &value));
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&info.initial, &value, sizeof value, zh_sil_name(k));
    }
    zh_sil_close(drive);
}

static void test_second_motor_and_board_start_without_overrides(void)
{
    zh_sil *drive = zh_sil_open(ZH_ROOT "/gain_tables/im_4kw_400v",
                                ZH_ROOT "/host_sim/boards/board_540V.toml", NULL);
    TEST_ASSERT_NOT_NULL_MESSAGE(drive, zh_sil_error());
    zh_sil_in in = quiet_input();
    in.u_dc = 11059u; /* 540 V of 800 V */
    const zh_sil_out ready = step_n(drive, &in, 600u);
    TEST_ASSERT_EQUAL_UINT32(0u, ready.faults);
    TEST_ASSERT_EQUAL_UINT32(ZH_STATE_READY, ready.state);
    zh_sil_close(drive);
}

static void test_names_are_listed_with_unit_limits_and_text(void)
{
    TEST_ASSERT_GREATER_THAN_UINT32(40u, zh_sil_name_count());
    for (uint32_t k = 0u; k < zh_sil_name_count(); k++) {
        zh_sil_name_info info = {.struct_size = sizeof info};
        TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_describe(k, &info));
        TEST_ASSERT_TRUE(info.minimum <= info.initial && info.initial <= info.maximum);
        TEST_ASSERT_TRUE(strlen(info.text) > 2u && info.unit != NULL);
        TEST_ASSERT_TRUE(strlen(info.group) > 2u);
    }
    TEST_ASSERT_NULL(zh_sil_name(zh_sil_name_count()));
    zh_sil_name_info beyond = {.struct_size = sizeof beyond};
    TEST_ASSERT_EQUAL_INT(ZH_NO_SUCH_NAME, zh_sil_describe(zh_sil_name_count(), &beyond));
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_describe(0u, NULL));
    /* A caller that knows nothing of groups and choices gets none. */
    zh_sil_name_info short_info = {.struct_size = offsetof(zh_sil_name_info, group)};
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_describe(0u, &short_info));
    TEST_ASSERT_NULL(short_info.group);
}

static void test_overrides_are_lines_with_comments(void)
{
    zh_sil *drive = open_drive("# tuning\n\n adapt_kp = 5.5 # louder\r\neps1_mode=2\nswap_vw=true");
    float value = 0.0f;
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_get(drive, "adapt_kp", &value));
    TEST_ASSERT_EQUAL_FLOAT(5.5f, value);
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_get(drive, "eps1_mode", &value));
    TEST_ASSERT_EQUAL_FLOAT(2.0f, value);
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_get(drive, "swap_vw", &value));
    TEST_ASSERT_EQUAL_FLOAT(1.0f, value);
    zh_sil_close(drive);
}

static void refused_with(const char *overrides, const char *word)
{
    zh_sil *drive = zh_sil_open(MOTOR_DIR, BOARD, overrides);
    TEST_ASSERT_NULL_MESSAGE(drive, overrides);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(zh_sil_error(), word), zh_sil_error());
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(zh_sil_error(), "; "), zh_sil_error());
}

static void test_open_names_the_override_it_refuses(void)
{
    refused_with("no_such=1", "no_such");
    refused_with("impressed_A=12", "is called i_f_A now");
    refused_with("rs_track_low=0.9", "is a constant now, 0.98");
    refused_with("rs_low_A=4", "0.625 rs_high_A");
    refused_with("lost_action=trip", "warn, fault, i_f");
    refused_with("lost_action=3", "warn, fault, i_f");
    refused_with("adapt_kp=1e9", "out of range");
    refused_with("adapt_kp=nan", "finite");
    refused_with("adapt_kp=inf", "finite");
    refused_with("adapt_kp=", "not a number");
    refused_with("adapt_kp=3x", "not a number");
    refused_with("eps1_mode=1.5", "whole");
    refused_with("adapt_kp", "name=value");
    refused_with("=4", "name=value");
    refused_with("\x01\xff\xfe", "name=value");
    refused_with("M_H=0.2", "below 0.1059245 H with Ls_H = 0.11 H");
    refused_with("period_s=2e-3\ncurrent_bandwidth_rad_s=600", "current_bandwidth_rad_s");
    refused_with("eps1_on_Hz=5", "eps1_off_Hz: is 2.5 Hz; it must be at least 5 Hz");
    refused_with("i_d_A=9", "i_d_A: is 9 A; it must be at most 8 A with i_d_max_A = 8 A");
    refused_with("u_dc_min_V=395", "u_dc_max_V = 390 V");
    refused_with("economy_flux_min=0.05", "economy_flux_min: is 0.05; it must be at least 0.1");
    refused_with("lost_action=i_f\ni_f_A=0", "above 0 A with lost_action = i_f");
}

static void test_open_refuses_missing_paths(void)
{
    TEST_ASSERT_NULL(zh_sil_open(NULL, BOARD, NULL));
    TEST_ASSERT_NULL(zh_sil_open(MOTOR_DIR, NULL, NULL));
    TEST_ASSERT_NULL(zh_sil_open("/nowhere", BOARD, NULL));
    TEST_ASSERT_NOT_NULL(strstr(zh_sil_error(), "/nowhere"));
    TEST_ASSERT_NULL(zh_sil_open(MOTOR_DIR, "/nowhere.toml", NULL));
    TEST_ASSERT_NOT_NULL(strstr(zh_sil_error(), "/nowhere.toml"));
    TEST_ASSERT_NULL(zh_sil_open(MOTOR_DIR, MOTOR_DIR, NULL));
    zh_sil_close(NULL);
}

static void test_drive_reaches_ready_and_premagnetises_on_run(void)
{
    zh_sil *drive = open_drive(NULL);
    const zh_sil_out out = to_premagnetise(drive);
    TEST_ASSERT_EQUAL_UINT32(0u, out.faults);
    zh_sil_close(drive);
}

/* The step that sees the run command turns the gates on; its duties are still one half, and those
 * of the next step already push i_d: what acts is the caller's to delay. */
static void test_torque_off_and_run_low_open_the_gates_at_once(void)
{
    zh_sil *drive = open_drive(NULL);
    to_premagnetise(drive);
    zh_sil_in in = quiet_input();
    in.command = ZH_SIL_RUN | ZH_SIL_TORQUE_OFF;
    TEST_ASSERT_EQUAL_UINT32(0u, step_n(drive, &in, 1u).gates_on);
    in.command = ZH_SIL_RUN;
    TEST_ASSERT_EQUAL_UINT32(0u, step_n(drive, &in, 10u).gates_on); /* run was not seen low */
    in.command = 0u;
    step_n(drive, &in, 1u);
    in.command = ZH_SIL_RUN;
    TEST_ASSERT_EQUAL_UINT32(1u, step_n(drive, &in, 1u).gates_on);
    in.command = 0u;
    TEST_ASSERT_EQUAL_UINT32(0u, step_n(drive, &in, 1u).gates_on);
    zh_sil_close(drive);
}

static void test_step_refuses_bad_pointers_and_sizes_safely(void)
{
    zh_sil *drive = open_drive(NULL);
    to_premagnetise(drive);
    zh_sil_in in = quiet_input();
    in.command = ZH_SIL_RUN;
    zh_sil_out out = fresh_output();
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_step(drive, &in, NULL));
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_step(NULL, &in, &out));
    out.gates_on = 1u;
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_step(drive, NULL, &out));
    TEST_ASSERT_EQUAL_UINT32(0u, out.gates_on);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, out.duty_u);
    in.struct_size--;
    out.gates_on = 1u;
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_step(drive, &in, &out));
    TEST_ASSERT_EQUAL_UINT32(0u, out.gates_on);
    in.struct_size++;
    out.struct_size = offsetof(zh_sil_out, speed_unknown) - 1u;
    out.gates_on = 77u;
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_step(drive, &in, &out));
    TEST_ASSERT_EQUAL_UINT32(77u, out.gates_on); /* a struct of unknown size is not written */
    zh_sil_close(drive);
}

/* A caller built against version 2: what came after it is not written. */
static void test_step_serves_a_caller_without_speed_unknown(void)
{
    zh_sil *drive = open_drive(NULL);
    const zh_sil_in in = quiet_input();
    zh_sil_out out = fresh_output();
    out.struct_size = offsetof(zh_sil_out, speed_unknown);
    out.speed_unknown = 77u;
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_step(drive, &in, &out));
    TEST_ASSERT_EQUAL_UINT32(77u, out.speed_unknown);
    zh_sil_close(drive);
}

/* A caller built against a later, larger struct: what lies beyond ours stays. */
static void test_step_writes_only_what_it_knows(void)
{
    struct {
        zh_sil_out out;
        uint32_t later;
    } larger = {.later = 0x5a5a5a5au};
    zh_sil *drive = open_drive(NULL);
    const zh_sil_in in = quiet_input();
    larger.out.struct_size = sizeof larger;
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_step(drive, &in, &larger.out));
    TEST_ASSERT_EQUAL_HEX32(0x5a5a5a5au, larger.later);
    TEST_ASSERT_EQUAL_UINT32(sizeof larger, larger.out.struct_size);
    zh_sil_close(drive);
}

static void test_nan_reference_is_an_error_and_trips_the_drive(void)
{
    const float bad[] = {NAN, INFINITY, -INFINITY};
    for (size_t k = 0u; k < sizeof bad / sizeof bad[0]; k++) {
        zh_sil *drive = open_drive(NULL);
        to_premagnetise(drive);
        zh_sil_in in = quiet_input();
        zh_sil_out out = fresh_output();
        in.command = ZH_SIL_RUN;
        in.speed_ref_rpm = bad[k];
        TEST_ASSERT_EQUAL_INT(ZH_BAD_INPUT, zh_sil_step(drive, &in, &out));
        TEST_ASSERT_EQUAL_UINT32(0u, out.gates_on);
        TEST_ASSERT_EQUAL_UINT32(ZH_STATE_FAULT, out.state);
        TEST_ASSERT_BITS_HIGH(ZH_FAULT_NON_FINITE, out.faults);
        in.speed_ref_rpm = 0.0f;
        TEST_ASSERT_EQUAL_UINT32(0u, step_n(drive, &in, 10u).gates_on); /* latched */
        in.command = ZH_SIL_FAULT_RESET;
        step_n(drive, &in, 600u);
        in.command = ZH_SIL_RUN;
        TEST_ASSERT_EQUAL_UINT32(1u, step_n(drive, &in, 1u).gates_on);
        zh_sil_close(drive);
    }
}

static void test_unknown_mode_is_an_error_without_torque(void)
{
    zh_sil *drive = open_drive(NULL);
    to_premagnetise(drive);
    zh_sil_in in = quiet_input();
    zh_sil_out out = fresh_output();
    in.command = ZH_SIL_RUN;
    in.mode = 2u;
    in.torque_ref_Nm = 1.0f;
    TEST_ASSERT_EQUAL_INT(ZH_BAD_INPUT, zh_sil_step(drive, &in, &out));
    TEST_ASSERT_EQUAL_UINT32(0u, out.gates_on);
    TEST_ASSERT_EQUAL_UINT32(ZH_STATE_TORQUE_OFF, out.state);
    TEST_ASSERT_NOT_NULL(strstr(zh_sil_error(), "mode"));
    zh_sil_close(drive);
}

static void test_torque_reference_is_not_read_in_mode_0(void)
{
    zh_sil *drive = open_drive(NULL);
    zh_sil_in in = quiet_input();
    in.torque_ref_Nm = NAN;
    TEST_ASSERT_EQUAL_UINT32(ZH_STATE_READY, step_n(drive, &in, 600u).state);
    zh_sil_close(drive);
}

static void test_torque_mode_trips_on_a_torque_that_is_no_number(void)
{
    zh_sil *drive = open_drive(NULL);
    to_premagnetise(drive);
    zh_sil_in in = quiet_input();
    zh_sil_out out = fresh_output();
    in.command = ZH_SIL_RUN;
    in.mode = ZH_SIL_TORQUE;
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_step(drive, &in, &out));
    TEST_ASSERT_EQUAL_UINT32(1u, out.gates_on);
    in.torque_ref_Nm = INFINITY;
    TEST_ASSERT_EQUAL_INT(ZH_BAD_INPUT, zh_sil_step(drive, &in, &out));
    TEST_ASSERT_NOT_NULL(strstr(zh_sil_error(), "torque_ref_Nm"));
    TEST_ASSERT_EQUAL_UINT32(0u, out.gates_on);
    zh_sil_close(drive);
}

static void test_set_takes_run_parameters_live(void)
{
    zh_sil *drive = open_drive(NULL);
    to_premagnetise(drive);
    float value = 0.0f;
    TEST_ASSERT_EQUAL_INT_MESSAGE(ZH_OK, zh_sil_set(drive, "i_d_A", 3.0f), zh_sil_error());
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_get(drive, "i_d_A", &value));
    TEST_ASSERT_EQUAL_FLOAT(3.0f, value);
    /* And the firmware uses it: less current asked, less duty. */
    zh_sil *other = open_drive(NULL);
    to_premagnetise(other);
    zh_sil_in in = quiet_input();
    in.command = ZH_SIL_RUN;
    const zh_sil_out low = step_n(drive, &in, 1u);
    const zh_sil_out high = step_n(other, &in, 1u);
    TEST_ASSERT_TRUE(low.duty_u < high.duty_u);
    zh_sil_close(drive);
    zh_sil_close(other);
}

static void test_set_says_why_not(void)
{
    zh_sil *drive = open_drive(NULL);
    float value = 0.0f;
    TEST_ASSERT_EQUAL_INT(ZH_NO_SUCH_NAME, zh_sil_set(drive, "nothing", 1.0f));
    TEST_ASSERT_EQUAL_INT(ZH_NO_SUCH_NAME, zh_sil_get(drive, "nothing", &value));
    TEST_ASSERT_EQUAL_INT(ZH_OUT_OF_RANGE, zh_sil_set(drive, "adapt_kp", 1e9f));
    TEST_ASSERT_EQUAL_INT(ZH_OUT_OF_RANGE, zh_sil_set(drive, "adapt_kp", NAN));
    TEST_ASSERT_EQUAL_INT(ZH_OUT_OF_RANGE, zh_sil_set(drive, "eps1_mode", 0.5f));
    TEST_ASSERT_EQUAL_INT(ZH_PROTECTED, zh_sil_set(drive, "Rs_ohm", 1.0f));
    TEST_ASSERT_NOT_NULL(strstr(zh_sil_error(), "overrides"));
    TEST_ASSERT_EQUAL_INT(ZH_REFUSED, zh_sil_set(drive, "eps1_off_Hz", 1.0f));
    TEST_ASSERT_NOT_NULL(strstr(zh_sil_error(), "eps1_off_Hz"));
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_get(drive, "eps1_off_Hz", &value));
    TEST_ASSERT_EQUAL_FLOAT(2.5f, value); /* a refused value leaves no trace */
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_set(NULL, "adapt_kp", 1.0f));
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_set(drive, NULL, 1.0f));
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_get(drive, "adapt_kp", NULL));
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_set(drive, "i_q_max_A", 10.0f)); /* READY: gates are off */
    to_premagnetise(drive);
    TEST_ASSERT_EQUAL_INT(ZH_NOT_NOW, zh_sil_set(drive, "i_q_max_A", 5.0f));
    TEST_ASSERT_NOT_NULL(strstr(zh_sil_error(), "gates off"));
    zh_sil_close(drive);
}

/* A reproducible, lively input: words that wander around the middle. */
static zh_sil_in lively_input(uint32_t *seed, uint32_t k)
{
    zh_sil_in in = quiet_input();
    *seed = *seed * 1664525u + 1013904223u;
    const int32_t wander = (int32_t)(*seed >> 24) - 128;
    in.i_u = (uint16_t)((int32_t)MID + wander);
    in.i_v = (uint16_t)((int32_t)MID - wander);
    in.u_uv = (uint16_t)((int32_t)MID + 3 * wander);
    in.command = (k > 600u) ? ZH_SIL_RUN : 0u;
    in.speed_ref_rpm = 100.0f;
    return in;
}

enum {
    LIVELY_STEPS = 8000,
    THREAD_DRIVES = 40
};

static uint64_t hash_of(uint64_t hash, const zh_sil_out *out)
{
    const unsigned char *byte = (const unsigned char *)out;
    for (size_t k = 0u; k < sizeof *out; k++) {
        hash = (hash ^ byte[k]) * 1099511628211u; /* FNV-1a */
    }
    return hash;
}

static uint64_t lively_run(zh_sil *drive, uint32_t seed)
{
    uint64_t hash = 14695981039346656037u;
    zh_sil_out out = fresh_output();
    for (uint32_t k = 0u; k < LIVELY_STEPS; k++) {
        const zh_sil_in in = lively_input(&seed, k);
        if (zh_sil_step(drive, &in, &out) != ZH_OK) {
            return 0u;
        }
        hash = hash_of(hash, &out);
    }
    return hash;
}

/* Two drives stepped in turn give what each gives alone. */
static void test_two_drives_in_one_process_do_not_meet(void)
{
    zh_sil *alone = open_drive(NULL);
    const uint64_t expected = lively_run(alone, 1u);
    zh_sil_close(alone);

    zh_sil *a = open_drive(NULL);
    zh_sil *b = open_drive("adapt_kp=30\ni_d_A=3");
    uint32_t seed_a = 1u;
    uint32_t seed_b = 99u;
    uint64_t hash_a = 14695981039346656037u;
    uint64_t hash_b = hash_a;
    zh_sil_out out = fresh_output();
    for (uint32_t k = 0u; k < LIVELY_STEPS; k++) {
        const zh_sil_in in_a = lively_input(&seed_a, k);
        TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_step(a, &in_a, &out));
        hash_a = hash_of(hash_a, &out);
        const zh_sil_in in_b = lively_input(&seed_b, k);
        TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_step(b, &in_b, &out));
        hash_b = hash_of(hash_b, &out);
    }
    TEST_ASSERT_EQUAL_HEX64(expected, hash_a);
    TEST_ASSERT_TRUE(hash_a != hash_b);
    zh_sil_close(a);
    zh_sil_close(b);
}

typedef struct {
    uint32_t first_seed;
    uint64_t hash[THREAD_DRIVES];
} batch_t;

/* Opens, runs and closes many drives, errors in between. No assertion: not this thread's right. */
static void *run_batch(void *context)
{
    batch_t *batch = (batch_t *)context;
    for (uint32_t k = 0u; k < THREAD_DRIVES; k++) {
        zh_sil *refused = zh_sil_open(MOTOR_DIR, BOARD, "no_such=1");
        zh_sil *drive = zh_sil_open(MOTOR_DIR, BOARD, NULL);
        const bool text = strstr(zh_sil_error(), "no_such") != NULL;
        batch->hash[k] = ((refused == NULL) && (drive != NULL) && text)
                             ? lively_run(drive, batch->first_seed + k)
                             : 0u;
        zh_sil_close(drive);
    }
    return NULL;
}

static void test_two_threads_give_what_one_gives(void)
{
    static batch_t serial[2] = {{.first_seed = 10u}, {.first_seed = 1000u}};
    static batch_t parallel[2] = {{.first_seed = 10u}, {.first_seed = 1000u}};
    run_batch(&serial[0]);
    run_batch(&serial[1]);
    pthread_t thread[2];
    for (int k = 0; k < 2; k++) {
        TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread[k], NULL, run_batch, &parallel[k]));
    }
    for (int k = 0; k < 2; k++) {
        TEST_ASSERT_EQUAL_INT(0, pthread_join(thread[k], NULL));
        TEST_ASSERT_TRUE(serial[k].hash[0] != 0u);
        TEST_ASSERT_EQUAL_HEX64_ARRAY(serial[k].hash, parallel[k].hash, THREAD_DRIVES);
    }
}

static void test_a_thousand_drives_share_the_table(void)
{
    static zh_sil *drive[1000];
    for (size_t k = 0u; k < 1000u; k++) {
        drive[k] = open_drive(NULL);
    }
    const uint64_t first = lively_run(drive[0], 3u);
    TEST_ASSERT_EQUAL_HEX64(first, lively_run(drive[999], 3u));
    for (size_t k = 0u; k < 1000u; k++) {
        zh_sil_close(drive[k]);
    }
}

/* At rest the estimator holds the dc equilibrium: lambda = M i with u = Rs i. */
static void test_estimator_finds_the_dc_equilibrium(void)
{
    zh_estimator *core = zh_estimator_open(MOTOR_DIR, "adapt_kp=0\nadapt_ki=0", 200e-6f);
    TEST_ASSERT_NOT_NULL_MESSAGE(core, zh_estimator_error());
    const zh_estimator_event event = {
        .verb = ZH_ESTIMATOR_STEP, .u_alpha_V = 0.93f * 4.0f, .i_alpha_A = 4.0f};
    zh_estimate out;
    for (int k = 0; k < 20000; k++) {
        TEST_ASSERT_EQUAL_INT(ZH_OK, zh_estimator_run(core, 1u, &event, &out));
    }
    /* float32 Euler over 4 s: a few parts in 1e5. */
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, 0.102f * 4.0f, out.lambda_alpha_Wb);
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, 0.0f, out.lambda_beta_Wb);
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, 0.0f, out.residual_alpha_A);
    zh_estimator_close(core);
}

static void test_estimator_runs_in_rows_as_in_steps(void)
{
    enum {
        ROWS = 500
    };
    static zh_estimator_event in[ROWS];
    static zh_estimate out[ROWS];
    zh_estimator *stepped = zh_estimator_open(MOTOR_DIR, NULL, 200e-6f);
    zh_estimator *run = zh_estimator_open(MOTOR_DIR, NULL, 200e-6f);
    in[0] = (zh_estimator_event){.verb = ZH_ESTIMATOR_SEED, .omega_e_rad_s = 60.0f};
    for (int k = 1; k < ROWS; k++) {
        const float angle = 0.02f * (float)k;
        in[k] = (zh_estimator_event){.u_alpha_V = 40.0f * cosf(angle),
                                     .u_beta_V = 40.0f * sinf(angle),
                                     .i_alpha_A = 5.0f * sinf(angle),
                                     .i_beta_A = -5.0f * cosf(angle)};
    }
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_estimator_run(run, ROWS, in, out));
    zh_estimate one = {0};
    for (int k = 0; k < ROWS; k++) {
        TEST_ASSERT_EQUAL_INT(ZH_OK, zh_estimator_run(stepped, 1u, &in[k], &one));
        TEST_ASSERT_EQUAL_MEMORY(&out[k], &one, sizeof one);
    }
    TEST_ASSERT_TRUE(fabsf(one.omega_e_rad_s - 60.0f) > 0.1f); /* it did adapt */
    zh_estimator_close(stepped);
    zh_estimator_close(run);
}

static void test_estimator_refuses_what_is_no_number(void)
{
    TEST_ASSERT_NULL(zh_estimator_open(NULL, NULL, 200e-6f));
    TEST_ASSERT_NULL(zh_estimator_open(MOTOR_DIR, NULL, NAN));
    TEST_ASSERT_NULL(zh_estimator_open(MOTOR_DIR, "no_such=1", 200e-6f));
    zh_estimator *core = zh_estimator_open(MOTOR_DIR, NULL, 200e-6f);
    const zh_estimator_event rows[2] = {{.u_alpha_V = 1.0f}, {.i_alpha_A = NAN}};
    const zh_estimator_event unknown = {.verb = ZH_ESTIMATOR_VERBS};
    zh_estimate out[2];
    TEST_ASSERT_EQUAL_INT(ZH_BAD_INPUT, zh_estimator_run(core, 1u, &rows[1], out));
    TEST_ASSERT_EQUAL_INT(ZH_BAD_INPUT, zh_estimator_run(core, 1u, &unknown, out));
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_estimator_run(core, 1u, rows, out));
    TEST_ASSERT_TRUE(isfinite(out[0].lambda_alpha_Wb));
    TEST_ASSERT_EQUAL_INT(ZH_BAD_INPUT, zh_estimator_run(core, 2u, rows, out));
    TEST_ASSERT_NOT_NULL(strstr(zh_estimator_error(), "row 1"));
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_estimator_run(core, 2u, NULL, out));
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_estimator_run(NULL, 2u, rows, out));
    TEST_ASSERT_EQUAL_STRING("l1_re_per_s", zh_estimator_signal_name(0u));
    TEST_ASSERT_TRUE(zh_estimator_signal(core, 0u) < 0.0f);
    TEST_ASSERT_NULL(zh_estimator_signal_name(1000u));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, zh_estimator_signal(core, 1000u));
    zh_estimator_close(core);
    zh_estimator_close(NULL);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_version_is_that_of_the_header);
    RUN_TEST(test_open_takes_machine_and_board_from_the_files);
    RUN_TEST(test_papers_motor_and_board_keep_the_defaults);
    RUN_TEST(test_second_motor_and_board_start_without_overrides);
    RUN_TEST(test_names_are_listed_with_unit_limits_and_text);
    RUN_TEST(test_overrides_are_lines_with_comments);
    RUN_TEST(test_open_names_the_override_it_refuses);
    RUN_TEST(test_open_refuses_missing_paths);
    RUN_TEST(test_drive_reaches_ready_and_premagnetises_on_run);
    RUN_TEST(test_torque_off_and_run_low_open_the_gates_at_once);
    RUN_TEST(test_step_refuses_bad_pointers_and_sizes_safely);
    RUN_TEST(test_step_serves_a_caller_without_speed_unknown);
    RUN_TEST(test_step_writes_only_what_it_knows);
    RUN_TEST(test_nan_reference_is_an_error_and_trips_the_drive);
    RUN_TEST(test_unknown_mode_is_an_error_without_torque);
    RUN_TEST(test_torque_reference_is_not_read_in_mode_0);
    RUN_TEST(test_torque_mode_trips_on_a_torque_that_is_no_number);
    RUN_TEST(test_set_takes_run_parameters_live);
    RUN_TEST(test_set_says_why_not);
    RUN_TEST(test_two_drives_in_one_process_do_not_meet);
    RUN_TEST(test_two_threads_give_what_one_gives);
    RUN_TEST(test_a_thousand_drives_share_the_table);
    RUN_TEST(test_estimator_finds_the_dc_equilibrium);
    RUN_TEST(test_estimator_runs_in_rows_as_in_steps);
    RUN_TEST(test_estimator_refuses_what_is_no_number);
    return UNITY_END();
}
