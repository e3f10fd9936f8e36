/* Drives on the simulated rig for a given number of control periods, and nothing else: what
 * callgrind counts instructions on (tools/zerohertz/bench). */
#include <stdio.h>
#include <stdlib.h>

#include "sim.h"

#define MOST_DRIVES 64u

int main(int argc, char **argv)
{
    if (argc < 6) {
        (void)fprintf(stderr,
                      "usage: %s SCENARIO RIG BOARD MOTOR_DIR STEPS [DRIVES [RIG_KEY=VALUE]]\n",
                      argv[0]);
        return 2;
    }
    static zh_sim_job jobs[MOST_DRIVES];
    static zh_sim_result results[MOST_DRIVES];
    const unsigned long asked = argc > 6 ? strtoul(argv[6], NULL, 10) : 1u;
    const uint32_t drives = asked < MOST_DRIVES ? (uint32_t)asked : MOST_DRIVES;
    for (uint32_t k = 0; k < drives; k++) {
        jobs[k] = (zh_sim_job){
            .struct_size = sizeof jobs[k],
            .decimate = 1000000U, /* the record is of no interest */
            .seed = k,            /* 0: the scenario's own */
            .max_steps = strtoull(argv[5], NULL, 10),
            .scenario = argv[1],
            .rig = argv[2],
            .board = argv[3],
            .motor_dir = argv[4],
            .rig_overrides = argc > 7 ? argv[7] : NULL,
        };
        results[k].struct_size = sizeof results[k];
    }
    if (zh_sim_run_batch(jobs, results, drives) != ZH_OK) {
        (void)fprintf(stderr, "error: %s\n", zh_sil_error());
        return 2;
    }
    unsigned trip = 0;
    for (uint32_t k = 0; k < drives; k++) {
        trip |= results[k].trip;
    }
    printf("%llu %u\n", drives > 0u ? (unsigned long long)results[0].steps : 0u, trip);
    for (uint32_t k = 0; k < drives; k++) {
        zh_sim_free(&results[k]);
    }
    return 0;
}
