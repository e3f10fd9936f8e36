/* Version 4 of the SIL interface, as a foreign caller meets it: telemetry, signals, many periods
 * per call, reset, snapshots, commissioning on the plant of sil_plant.h. */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "sil_plant.h"
#include "sil_rig.h"

#define RIG ZH_ROOT "/host_sim/rigs/ideal.toml"

enum {
    PERIODS = 1500
};

static zh_sil_in in[PERIODS];
static zh_sil_out out[PERIODS];
static zh_sil_out other[PERIODS];

void setUp(void)
{
    for (uint32_t k = 0u; k < PERIODS; k++) {
        in[k] = quiet_input();
        in[k].command = (k > 600u) ? ZH_SIL_RUN : 0u;
        in[k].speed_ref_rpm = 60.0f;
        in[k].i_u = (uint16_t)(MID + (k * 37u) % 29u);
        out[k] = fresh_output();
        other[k] = fresh_output();
    }
}

void tearDown(void)
{
}

static zh_plant *open_plant(void)
{
    zh_plant *plant = zh_plant_open(RIG, BOARD, NULL, NULL, 1u);
    TEST_ASSERT_NOT_NULL_MESSAGE(plant, zh_sil_error());
    return plant;
}

/* So many times the 800 periods in which `in` asks to run. */
static void go_on(zh_plant *plant, zh_sil *drive, zh_sil_out *to, int times)
{
    for (int k = 0; k < times; k++) {
        TEST_ASSERT_EQUAL_INT(ZH_OK,
                              zh_plant_run(plant, drive, &in[700], to, NULL, PERIODS - 700u, NULL));
    }
}

/* A drive that turns a motor, and that motor. */
static void turning(zh_sil **drive, zh_plant **plant)
{
    *drive = open_drive(NULL);
    *plant = open_plant();
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_plant_run(*plant, *drive, in, NULL, NULL, PERIODS, NULL));
    go_on(*plant, *drive, NULL, 8);
}

/* What a program of version 1 (and 2), of 3 and of today gives as struct_size. */
static void test_callers_of_every_version_get_what_they_know(void)
{
    const size_t size[] = {offsetof(zh_sil_out, speed_unknown), offsetof(zh_sil_out, confidence),
                           sizeof(zh_sil_out)};
    TEST_ASSERT_EQUAL_UINT(84u, size[0]); /* as those headers had it */
    TEST_ASSERT_EQUAL_UINT(88u, size[1]);
    zh_sil_out first = fresh_output();
    for (size_t k = 0u; k < 3u; k++) {
        zh_sil *drive = open_drive(NULL);
        zh_sil_out now;
        memset(&now, 0x5a, sizeof now);
        now.struct_size = (uint32_t)size[k];
        for (uint32_t step = 0u; step < PERIODS; step++) {
            TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_step(drive, &in[step], &now));
        }
        first = (k == 0u) ? now : first;
        TEST_ASSERT_EQUAL_MEMORY(&first.duty_u, &now.duty_u,
                                 size[0] - offsetof(zh_sil_out, duty_u));
        const unsigned char *byte = (const unsigned char *)&now;
        for (size_t at = size[k]; at < sizeof now; at++) {
            TEST_ASSERT_EQUAL_HEX8(0x5a, byte[at]);
        }
        zh_sil_close(drive);
    }
}

static void test_telemetry_shows_references_flux_and_resistance(void)
{
    zh_sil *drive = NULL;
    zh_plant *plant = NULL;
    turning(&drive, &plant);
    go_on(plant, drive, out, 12);
    const zh_sil_out now = out[PERIODS - 701];
    zh_plant_truth truth = {.struct_size = sizeof truth};
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_plant_look(plant, &truth));
    TEST_ASSERT_EQUAL_UINT32(ZH_STATE_RUN, now.state);
    TEST_ASSERT_EQUAL_UINT32(ZH_CONFIDENCE_CLOSED, now.confidence);
    TEST_ASSERT_EQUAL_UINT32(ZH_COMMISSIONING_NONE, now.commissioning);
    TEST_ASSERT_EQUAL_FLOAT(60.0f, now.speed_ref_rpm);
    TEST_ASSERT_FLOAT_WITHIN(2.0f, 60.0f, (float)truth.speed_rpm);
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, 4.5f, now.i_d_ref_A);
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, 0.102f * 4.5f, now.lambda_ref_Wb);
    TEST_ASSERT_FLOAT_WITHIN(0.01f, now.lambda_ref_Wb, now.lambda_Wb);
    TEST_ASSERT_EQUAL_FLOAT(0.93f, now.Rs_hat_ohm);
    TEST_ASSERT_FLOAT_WITHIN(0.2f, 283.0f, now.u_dc_V);
    TEST_ASSERT_FLOAT_WITHIN(0.2f, (float)hypot(truth.i_s_alpha_A, truth.i_s_beta_A),
                             hypotf(now.i_s_alpha_A, now.i_s_beta_A));
    zh_sil_out looked = fresh_output();
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_look(drive, &looked));
    TEST_ASSERT_EQUAL_MEMORY(&now, &looked, sizeof now);
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_look(drive, NULL));
    zh_sil_close(drive);
    zh_plant_close(plant);
}

static void test_signals_are_described_and_read(void)
{
    zh_sil *drive = open_drive(NULL);
    TEST_ASSERT_GREATER_THAN_UINT32(100u, zh_sil_signal_count());
    for (uint32_t k = 0u; k < zh_sil_signal_count(); k++) {
        zh_sil_signal_info info = {.struct_size = sizeof info};
        TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_signal_describe(k, &info));
        TEST_ASSERT_EQUAL_UINT32(k, zh_sil_signal_find(info.name));
        TEST_ASSERT_TRUE(strlen(info.text) > 2u);
    }
    zh_sil_signal_info info = {.struct_size = sizeof info};
    TEST_ASSERT_EQUAL_INT(ZH_OK,
                          zh_sil_signal_describe(zh_sil_signal_find("omega_e_hat_rad_s"), &info));
    TEST_ASSERT_EQUAL_STRING("rad/s", info.unit);
    TEST_ASSERT_EQUAL_UINT32(0u, info.whole);
    TEST_ASSERT_EQUAL_UINT32(zh_sil_signal_count(), zh_sil_signal_find("no_such"));
    TEST_ASSERT_EQUAL_UINT32(zh_sil_signal_count(), zh_sil_signal_find(NULL));
    TEST_ASSERT_EQUAL_INT(ZH_NO_SUCH_NAME, zh_sil_signal_describe(zh_sil_signal_count(), &info));
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_signal_describe(0u, NULL));

    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_run(drive, in, out, 620u, NULL));
    const uint32_t index[] = {zh_sil_signal_find("duty_u"), zh_sil_signal_find("gates_on"),
                              zh_sil_signal_find("i_d_A"), zh_sil_signal_find("state")};
    double value[4] = {0.0};
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_signals(drive, index, 4u, value));
    const zh_sil_out last = out[619];
    TEST_ASSERT_TRUE(value[0] == (double)last.duty_u);
    TEST_ASSERT_TRUE(value[1] == 1.0 && last.gates_on == 1u);
    TEST_ASSERT_TRUE(value[2] == (double)last.i_d_A);
    TEST_ASSERT_TRUE(value[3] == (double)last.state);
    const uint32_t beyond = zh_sil_signal_count();
    TEST_ASSERT_EQUAL_INT(ZH_NO_SUCH_NAME, zh_sil_signals(drive, &beyond, 1u, value));
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_signals(drive, NULL, 1u, value));
    zh_sil_close(drive);
}

static void test_many_periods_equal_single_steps(void)
{
    zh_sil *run = open_drive(NULL);
    zh_sil *stepped = open_drive(NULL);
    const uint32_t index[] = {zh_sil_signal_find("x_rad_s"), zh_sil_signal_find("duty_v")};
    static double value[PERIODS][2];
    const zh_sil_record record = {
        .struct_size = sizeof record, .count = 2u, .index = index, .value = &value[0][0]};
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_run(run, in, out, PERIODS, &record));
    for (uint32_t k = 0u; k < PERIODS; k++) {
        TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_step(stepped, &in[k], &other[k]));
        TEST_ASSERT_TRUE(value[k][0] == (double)other[k].x_rad_s);
        TEST_ASSERT_TRUE(value[k][1] == (double)other[k].duty_v);
    }
    TEST_ASSERT_EQUAL_MEMORY(other, out, sizeof out);
    zh_sil_close(run);
    zh_sil_close(stepped);
}

static void test_many_drives_equal_single_steps(void)
{
    enum {
        DRIVES = 3
    };
    zh_sil *many[DRIVES];
    zh_sil *single[DRIVES];
    for (int k = 0; k < DRIVES; k++) {
        many[k] = open_drive(NULL);
        single[k] = open_drive(NULL);
    }
    for (uint32_t step = 0u; step + DRIVES <= PERIODS; step++) {
        TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_step_many(many, &in[step], out, DRIVES));
        for (uint32_t k = 0u; k < DRIVES; k++) {
            TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_step(single[k], &in[step + k], &other[k]));
        }
        TEST_ASSERT_EQUAL_MEMORY(other, out, DRIVES * sizeof out[0]);
    }
    for (int k = 0; k < DRIVES; k++) {
        zh_sil_close(many[k]);
        zh_sil_close(single[k]);
    }
}

/* The other elements run all the same, and the text names the one. */
static void test_a_refused_element_is_named(void)
{
    zh_sil *drive = open_drive(NULL);
    in[700].speed_ref_rpm = NAN;
    in[900].speed_ref_rpm = NAN;
    TEST_ASSERT_EQUAL_INT(ZH_BAD_INPUT, zh_sil_run(drive, in, out, PERIODS, NULL));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(zh_sil_error(), "element 700: "), zh_sil_error());
    TEST_ASSERT_EQUAL_UINT32(ZH_STATE_FAULT, out[PERIODS - 1].state);
    zh_sil *handles[] = {drive, NULL};
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_step_many(handles, in, out, 2u));
    TEST_ASSERT_NOT_NULL(strstr(zh_sil_error(), "element 1: "));
    in[5].struct_size--;
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_run(drive, in, out, 10u, NULL));
    TEST_ASSERT_NOT_NULL(strstr(zh_sil_error(), "element 5"));
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_run(NULL, in, out, 2u, NULL));
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_run(drive, NULL, out, 2u, NULL));
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_step_many(NULL, in, out, 2u));
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_run(drive, NULL, NULL, 0u, NULL));
    in[0].struct_size = 3u;
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_run(drive, in, out, 2u, NULL));
    in[0].struct_size = sizeof in[0];
    const uint32_t beyond = zh_sil_signal_count();
    double value[2];
    zh_sil_record record = {
        .struct_size = sizeof record, .count = 1u, .index = &beyond, .value = value};
    TEST_ASSERT_EQUAL_INT(ZH_NO_SUCH_NAME, zh_sil_run(drive, in, out, 2u, &record));
    record.index = NULL;
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_run(drive, in, out, 2u, &record));
    zh_sil_close(drive);
}

static void test_reset_gives_the_drive_as_opened(void)
{
    zh_sil *drive = open_drive(NULL);
    zh_sil *fresh = open_drive(NULL);
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_run(drive, in, out, PERIODS, NULL));
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_set(drive, "i_d_A", 3.0f));
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_reset(drive));
    float i_d_A = 0.0f;
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_get(drive, "i_d_A", &i_d_A));
    TEST_ASSERT_EQUAL_FLOAT(4.5f, i_d_A);
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_run(drive, in, out, PERIODS, NULL));
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_run(fresh, in, other, PERIODS, NULL));
    TEST_ASSERT_EQUAL_MEMORY(other, out, sizeof out);
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_reset(NULL));
    zh_sil_close(drive);
    zh_sil_close(fresh);
}

static void take(const zh_sil *drive, unsigned char *snapshot)
{
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_snapshot(drive, snapshot, zh_sil_snapshot_bytes()));
}

/* Every number of periods leads the background elsewhere: its checks of memory go on as well, and
 * a live change may be on its way. */
static void test_a_restored_drive_continues_bit_for_bit(void)
{
    unsigned char *snapshot = malloc(zh_sil_snapshot_bytes());
    unsigned char *again = malloc(zh_sil_snapshot_bytes());
    for (uint32_t live = 0u; live < 3u; live++) {
        zh_sil *drive = NULL;
        zh_plant *plant = NULL;
        turning(&drive, &plant);
        TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_set(drive, "i_d_A", 4.0f));
        TEST_ASSERT_EQUAL_INT(ZH_OK,
                              zh_plant_run(plant, drive, &in[800], out, NULL, live * 173u, NULL));
        if (live == 2u) {
            TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_set(drive, "i_d_A", 3.5f));
            TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_set(drive, "adapt_kp", 6.0f));
        }
        take(drive, snapshot);
        zh_plant *kept = zh_plant_copy(plant);
        zh_sil *heir = open_drive(NULL);
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            ZH_OK, zh_sil_restore(heir, snapshot, zh_sil_snapshot_bytes()), zh_sil_error());
        take(heir, again);
        TEST_ASSERT_EQUAL_MEMORY(snapshot, again, zh_sil_snapshot_bytes());
        go_on(plant, drive, out, 5); /* past several runs of the background */
        zh_sil_close(drive);         /* the heir owns all it needs */
        TEST_ASSERT_EQUAL_INT(ZH_OK, zh_plant_restore(plant, kept));
        go_on(plant, heir, other, 5);
        TEST_ASSERT_EQUAL_UINT32(ZH_STATE_RUN, other[0].state);
        TEST_ASSERT_EQUAL_MEMORY(out, other, (PERIODS - 700u) * sizeof out[0]);
        zh_sil_close(heir);
        zh_plant_close(plant);
        zh_plant_close(kept);
    }
    free(snapshot);
    free(again);
}

static void refused(zh_sil *drive, const unsigned char *snapshot, size_t bytes, const char *word)
{
    zh_sil_out before = fresh_output();
    zh_sil_out after = fresh_output();
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_look(drive, &before));
    TEST_ASSERT_EQUAL_INT(ZH_REFUSED, zh_sil_restore(drive, snapshot, bytes));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(zh_sil_error(), word), zh_sil_error());
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_look(drive, &after));
    TEST_ASSERT_EQUAL_MEMORY(&before, &after, sizeof before);
}

static void test_other_snapshots_are_refused(void)
{
    const size_t bytes = zh_sil_snapshot_bytes();
    unsigned char *snapshot = malloc(bytes);
    zh_sil *drive = open_drive(NULL);
    zh_sil *tuned = open_drive("adapt_kp=5");
    zh_sil *motor = zh_sil_open(ZH_ROOT "/gain_tables/hasegawa2005_recommended", BOARD, NULL);
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_run(drive, in, out, PERIODS, NULL));
    take(drive, snapshot);
    refused(tuned, snapshot, bytes, "motor, board or overrides");
    refused(motor, snapshot, bytes, "motor, board or overrides");
    refused(drive, snapshot, bytes - 1u, "bytes");
    refused(drive, snapshot, bytes + 1u, "bytes");
    for (size_t at = 0u; at < bytes; at += 41u) {
        snapshot[at] ^= 0x10u;
        refused(drive, snapshot, bytes, "buffer");
        snapshot[at] ^= 0x10u;
    }
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_snapshot(drive, snapshot, bytes - 1u));
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_snapshot(drive, NULL, bytes));
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_restore(NULL, snapshot, bytes));
    zh_sil_close(drive);
    zh_sil_close(tuned);
    zh_sil_close(motor);
    free(snapshot);
}

static void test_commissioning_finds_the_motor(void)
{
    zh_sil *drive = open_drive(NULL);
    zh_plant *plant = open_plant();
    zh_commissioning found = {.done = 1u};
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_commissioned(drive, &found));
    TEST_ASSERT_EQUAL_UINT32(0u, found.done);
    for (uint32_t k = 0u; k < PERIODS; k++) {
        in[k].command = ZH_SIL_COMMISSION;
    }
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_plant_run(plant, drive, in, out, NULL, PERIODS, NULL));
    TEST_ASSERT_EQUAL_UINT32(ZH_STATE_COMMISSIONING, out[PERIODS - 1].state);
    TEST_ASSERT_EQUAL_UINT32(ZH_COMMISSIONING_BUSY, out[PERIODS - 1].commissioning);
    for (int k = 0; k < 100 && out[PERIODS - 1].commissioning == ZH_COMMISSIONING_BUSY; k++) {
        TEST_ASSERT_EQUAL_INT(ZH_OK, zh_plant_run(plant, drive, in, out, NULL, PERIODS, NULL));
    }
    TEST_ASSERT_EQUAL_UINT32(ZH_COMMISSIONING_DONE, out[PERIODS - 1].commissioning);
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_commissioned(drive, &found));
    TEST_ASSERT_EQUAL_UINT32(1u, found.done);
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 0.93f, found.Rs_ohm);
    TEST_ASSERT_FLOAT_WITHIN(0.001f, 0.102f, found.M_gamma_H);
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 0.5f, found.Rr_gamma_ohm);
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_sil_commissioned(drive, NULL));
    zh_sil_close(drive);
    zh_plant_close(plant);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_callers_of_every_version_get_what_they_know);
    RUN_TEST(test_telemetry_shows_references_flux_and_resistance);
    RUN_TEST(test_signals_are_described_and_read);
    RUN_TEST(test_many_periods_equal_single_steps);
    RUN_TEST(test_many_drives_equal_single_steps);
    RUN_TEST(test_a_refused_element_is_named);
    RUN_TEST(test_reset_gives_the_drive_as_opened);
    RUN_TEST(test_a_restored_drive_continues_bit_for_bit);
    RUN_TEST(test_other_snapshots_are_refused);
    RUN_TEST(test_commissioning_finds_the_motor);
    return UNITY_END();
}
