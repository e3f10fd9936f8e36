/* The firmware on the simulated rig for a given number of control periods, and nothing else: what
 * callgrind counts instructions on (tools/zerohertz/bench). */
#include <stdio.h>
#include <stdlib.h>

#include "sim.h"

int main(int argc, char **argv)
{
    if (argc != 6) {
        (void)fprintf(stderr, "usage: %s SCENARIO RIG BOARD MOTOR_DIR STEPS\n", argv[0]);
        return 2;
    }
    const zh_sim_job job = {
        .struct_size = sizeof job,
        .decimate = 1000000U, /* the record is of no interest */
        .max_steps = strtoull(argv[5], NULL, 10),
        .scenario = argv[1],
        .rig = argv[2],
        .board = argv[3],
        .motor_dir = argv[4],
    };
    zh_sim_result result = {.struct_size = sizeof result};
    if (zh_sim_run(&job, &result) != ZH_OK) {
        (void)fprintf(stderr, "error: %s\n", zh_sil_error());
        return 2;
    }
    printf("%llu %u\n", (unsigned long long)result.steps, (unsigned)result.trip);
    zh_sim_free(&result);
    return 0;
}
