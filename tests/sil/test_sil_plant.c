/* The rig alone (sil_plant.h), as a foreign caller meets it. */
#include <math.h>
#include <string.h>

#include "sil_plant.h"
#include "sil_rig.h"
#include "sim.h"

#define RIG   ZH_ROOT "/host_sim/rigs/hasegawa2005.toml"
#define SMOKE ZH_ROOT "/host_sim/scenarios/smoke.toml"

enum {
    PERIODS = 15000
};

static zh_sil_in in[PERIODS];
static zh_sil_out out[PERIODS];
static zh_plant_truth truth[PERIODS];

void setUp(void)
{
    for (uint32_t k = 0u; k < PERIODS; k++) {
        in[k] = quiet_input();
        in[k].command = (k >= 500u) ? ZH_SIL_RUN : 0u;
        out[k] = fresh_output();
        truth[k].struct_size = sizeof truth[k];
    }
}

void tearDown(void)
{
}

static zh_plant *open_plant(const char *scenario, uint64_t seed)
{
    zh_plant *plant = zh_plant_open(RIG, BOARD, scenario, NULL, seed);
    TEST_ASSERT_NOT_NULL_MESSAGE(plant, zh_sil_error());
    return plant;
}

/* The reference of the scenario, as its operator says it. */
static float smoke_ref_rpm(uint32_t k)
{
    const double t_s = 200e-6 * k;
    return (float)((t_s < 1.0) ? 0.0 : (t_s < 1.5) ? (t_s - 1.0) / 0.5 * 300.0 : 300.0);
}

static void test_drive_and_plant_together_are_the_simulation(void)
{
    const zh_sim_job job = {.struct_size = sizeof job,
                            .scenario = SMOKE,
                            .rig = RIG,
                            .board = BOARD,
                            .motor_dir = MOTOR_DIR,
                            .seed = 7u};
    zh_sim_result result = {.struct_size = sizeof result};
    TEST_ASSERT_EQUAL_INT_MESSAGE(ZH_OK, zh_sim_run(&job, &result), zh_sil_error());
    TEST_ASSERT_EQUAL_UINT64(PERIODS, result.steps);
    uint32_t speed = 0u;
    uint32_t current = 0u;
    for (uint32_t k = 0u; k < result.columns; k++) {
        speed = (strcmp(zh_sim_column_name(k), "speed_rpm") == 0) ? k : speed;
        current = (strcmp(zh_sim_column_name(k), "i_q_A") == 0) ? k : current;
    }
    zh_plant *plant = open_plant(SMOKE, 7u);
    zh_sil *drive = open_drive(NULL);
    for (uint32_t k = 0u; k < PERIODS; k++) {
        in[k].speed_ref_rpm = smoke_ref_rpm(k);
    }
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_plant_run(plant, drive, in, out, truth, PERIODS, NULL));
    for (uint32_t k = 0u; k < PERIODS; k++) {
        TEST_ASSERT_EQUAL_FLOAT(result.data[speed * result.stride + k], (float)truth[k].speed_rpm);
        TEST_ASSERT_EQUAL_FLOAT(result.data[current * result.stride + k], out[k].i_q_A);
    }
    TEST_ASSERT_TRUE(truth[PERIODS - 1].speed_rpm > 290.0);
    zh_sim_free(&result);
    zh_sil_close(drive);
    zh_plant_close(plant);
}

static void test_periods_by_hand_are_those_of_a_run(void)
{
    zh_plant *one = open_plant(NULL, 3u);
    zh_plant *two = open_plant(NULL, 3u);
    zh_sil *drive = open_drive(NULL);
    zh_sil *other = open_drive(NULL);
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_plant_run(one, drive, in, out, NULL, 3000u, NULL));
    for (uint32_t k = 0u; k < 3000u; k++) {
        uint16_t words[6];
        TEST_ASSERT_EQUAL_INT(ZH_OK, zh_plant_sample(two, words));
        zh_sil_in now = in[k];
        memcpy(&now.i_u, words, sizeof words);
        zh_sil_out done = fresh_output();
        TEST_ASSERT_EQUAL_INT(ZH_OK, zh_sil_step(other, &now, &done));
        TEST_ASSERT_EQUAL_MEMORY(&out[k], &done, sizeof done);
        const double duty[3] = {(double)done.duty_u, (double)done.duty_v, (double)done.duty_w};
        TEST_ASSERT_EQUAL_INT(ZH_OK, zh_plant_advance(two, duty, done.gates_on, done.brake_on));
    }
    zh_sil_close(drive);
    zh_sil_close(other);
    zh_plant_close(one);
    zh_plant_close(two);
}

static void test_a_restored_plant_continues_with_its_noise(void)
{
    zh_plant *plant = open_plant(NULL, 3u);
    uint16_t first[6];
    uint16_t again[6];
    zh_plant *kept = zh_plant_copy(plant);
    zh_plant_sample(plant, first);
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_plant_restore(plant, kept));
    zh_plant_sample(plant, again);
    TEST_ASSERT_EQUAL_MEMORY(first, again, sizeof first);
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_plant_restore(plant, kept));
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_plant_reseed(plant, 4u));
    zh_plant_sample(plant, again);
    TEST_ASSERT_TRUE(memcmp(first, again, sizeof first) != 0);
    zh_plant *hotter = zh_plant_open(RIG, BOARD, NULL, "motor.Rs_ohm=1.2", 3u);
    TEST_ASSERT_EQUAL_INT(ZH_REFUSED, zh_plant_restore(hotter, kept));
    TEST_ASSERT_NOT_NULL(strstr(zh_sil_error(), "overrides"));
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_plant_restore(plant, NULL));
    TEST_ASSERT_NULL(zh_plant_copy(NULL));
    zh_plant_close(plant);
    zh_plant_close(kept);
    zh_plant_close(hotter);
}

static void test_what_acts_on_the_rig_can_be_set(void)
{
    zh_plant *plant = open_plant(NULL, 1u);
    zh_sil *drive = open_drive(NULL);
    zh_plant_run(plant, drive, in, NULL, NULL, PERIODS, NULL);
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_plant_set(plant, "load_torque_Nm", 4.0));
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_plant_set(plant, "u_dc_V", 260.0));
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_plant_set(plant, "rs_factor", 1.1));
    zh_plant_run(plant, drive, &in[1000], NULL, truth, 100u, NULL);
    TEST_ASSERT_TRUE(truth[99].speed_rpm < -5.0); /* the load pulls it back */
    TEST_ASSERT_TRUE(fabs(truth[99].load_torque_Nm - 4.0) < 1e-12);
    TEST_ASSERT_TRUE(fabs(truth[99].u_dc_V - 260.0) < 1e-9);
    TEST_ASSERT_EQUAL_INT(ZH_NO_SUCH_NAME, zh_plant_set(plant, "weather", 1.0));
    TEST_ASSERT_EQUAL_INT(ZH_OUT_OF_RANGE, zh_plant_set(plant, "rs_factor", 0.0));
    TEST_ASSERT_EQUAL_INT(ZH_OUT_OF_RANGE, zh_plant_set(plant, "load_torque_Nm", NAN));
    TEST_ASSERT_NOT_NULL(strstr(zh_sil_error(), "load_torque_Nm"));
    zh_sil_close(drive);
    zh_plant_close(plant);
}

static void test_what_is_wrong_is_refused(void)
{
    TEST_ASSERT_NULL(zh_plant_open(NULL, BOARD, NULL, NULL, 1u));
    TEST_ASSERT_NULL(zh_plant_open("/nowhere.toml", BOARD, NULL, NULL, 1u));
    TEST_ASSERT_NOT_NULL(strstr(zh_sil_error(), "/nowhere.toml"));
    TEST_ASSERT_NULL(zh_plant_open(RIG, BOARD, NULL, "motor.Rs_ohm=-1", 1u));
    TEST_ASSERT_NOT_NULL(strstr(zh_sil_error(), "Rs_ohm"));
    zh_plant *plant = open_plant(NULL, 1u);
    zh_sil *drive = open_drive(NULL);
    const double bad[][3] = {{NAN, 0.5, 0.5}, {0.5, 1.001, 0.5}, {0.5, 0.5, -0.001}};
    for (size_t k = 0u; k < 3u; k++) {
        TEST_ASSERT_EQUAL_INT(ZH_OUT_OF_RANGE, zh_plant_advance(plant, bad[k], 1u, 0u));
    }
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_plant_advance(plant, NULL, 1u, 0u));
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_plant_sample(plant, NULL));
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_plant_look(plant, NULL));
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_plant_set(plant, NULL, 1.0));
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_plant_reseed(NULL, 1u));
    TEST_ASSERT_EQUAL_INT(ZH_BAD_ARGUMENT, zh_plant_run(plant, drive, NULL, out, NULL, 1u, NULL));
    in[10].speed_ref_rpm = NAN;
    TEST_ASSERT_EQUAL_INT(ZH_BAD_INPUT, zh_plant_run(plant, drive, in, NULL, truth, 100u, NULL));
    TEST_ASSERT_NOT_NULL(strstr(zh_sil_error(), "speed_ref_rpm"));
    TEST_ASSERT_EQUAL_INT(ZH_OK, zh_plant_look(plant, truth));
    TEST_ASSERT_TRUE(fabs(truth[0].t_s - 11.0 * 200e-6) < 1e-9); /* it ended there */
    zh_sil_close(drive);
    zh_plant_close(plant);
    zh_plant_close(NULL);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_drive_and_plant_together_are_the_simulation);
    RUN_TEST(test_periods_by_hand_are_those_of_a_run);
    RUN_TEST(test_a_restored_plant_continues_with_its_noise);
    RUN_TEST(test_what_acts_on_the_rig_can_be_set);
    RUN_TEST(test_what_is_wrong_is_refused);
    return UNITY_END();
}
