/* Somebody else's program: a gain of the table, the control law, a run of the SIL library. */
#include <stdint.h>
#include <stdio.h>

#include "drive.h"
#include "hasegawa2005_recommended/l_gain.h"
#include "sim.h"

int main(void)
{
    const gain_table_t *table = &l_gain_hasegawa2005_recommended;
    const float l1_re_per_s = gain_table_at(table, 100.0f).l1_re_per_s;
    /* To be linked is all that is asked of the law here; the run below steps it. */
    const uintptr_t law = (uintptr_t)drive_step;

    const zh_sim_job job = {
        .struct_size = sizeof job,
        .max_steps = 2000,
        .scenario = ZH_DATA_DIR "/host_sim/scenarios/smoke.toml",
        .rig = ZH_DATA_DIR "/host_sim/rigs/ideal.toml",
        .board = ZH_DATA_DIR "/host_sim/boards/paper.toml",
        .motor_dir = ZH_DATA_DIR "/gain_tables/hasegawa2005",
    };
    zh_sim_result result = {.struct_size = sizeof result};
    if (zh_sim_run(&job, &result) != ZH_OK) {
        fprintf(stderr, "%s\n", zh_sil_error());
        return 1;
    }
    printf("steps %u, trip %u\n", (unsigned)result.steps, (unsigned)result.trip);
    zh_sim_free(&result);
    return ((law != 0u) && gain_table_valid(table) && (l1_re_per_s < 0.0f)) ? 0 : 1;
}
