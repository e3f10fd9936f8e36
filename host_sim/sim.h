/* Closed-loop runs: the firmware on the simulated rig, one call per run.
 *
 * Part of the SIL library. Runs share nothing and may run in any number of threads.
 */
#ifndef ZH_SIM_H
#define ZH_SIM_H

#include <stddef.h>
#include <stdint.h>

#include "sil.h"

#ifdef __cplusplus
extern "C" {
#endif

#define ZH_SIM_STOP_AT_TRIP (1u << 0) /* end the run at the first trip of any kind */
#define ZH_SIM_TIME_SPLIT   (1u << 1) /* then time firmware and plant separately */
#define ZH_SIM_HASH_SIGNALS (1u << 2) /* hash every traced signal of the firmware */
/* The guard's speed checks (deviation, over-speed, rotor out of step) count but do not act: no
 * trip, no warning. No image has this option. */
#define ZH_SIM_GUARD_RECORDED (1u << 3)

/* Bits of trip. The run continues (except after DIVERGED and SLOW) unless ZH_SIM_STOP_AT_TRIP is
 * set. */
#define ZH_TRIP_FIRMWARE (1u << 0) /* any fault of the firmware */
#define ZH_TRIP_SPEED    (1u << 1) /* true |w| > 3000 min^-1 */
#define ZH_TRIP_CURRENT  (1u << 2) /* true |i_s| > 60 A, power invariant */
#define ZH_TRIP_DIVERGED (1u << 3) /* the plant diverged: the run ends */
#define ZH_TRIP_SLOW     (1u << 4) /* firmware: above 250 us of CPU time per period: it ends */
#define ZH_TRIP_NAN      (1u << 5) /* the estimate was not finite */

typedef struct {
    uint32_t struct_size;  /* sizeof(zh_sim_job), set by the caller */
    uint32_t flags;        /* ZH_SIM_* */
    uint32_t decimate;     /* record every n-th step; 0: every one */
    uint32_t gain_entries; /* entries of `gain`; 0: none */
    uint64_t seed;         /* of the noise; 0: the scenario's own */
    uint64_t max_steps;    /* 0: all of the scenario */

    /* Files; a text with a line break is the content itself. */
    const char *scenario;
    const char *rig;
    const char *board;
    const char *motor_dir;

    /* NULL or lines. Scenario, rig and board: "section.key=value". Firmware: "name=value"; the
     * configuration first, then the scenario's [firmware], then `firmware`; last of all the
     * factors of [controller_motor] scale the motor data that came out of that. */
    const char *scenario_overrides;
    const char *rig_overrides;
    const char *board_overrides;
    const char *firmware_config;
    const char *firmware;

    /* NULL, or a gain table to use instead of the motor's: 4 floats per entry as in l_gain.json. */
    const float *gain;

    uint64_t columns; /* bit c: column c is recorded; 0: every one */
} zh_sim_job;

typedef struct {
    uint32_t struct_size; /* sizeof(zh_sim_result), set by the caller */
    uint32_t columns;     /* recorded: those of the job, in their order */
    uint64_t rows;
    uint64_t stride;   /* column c, row r: data[c * stride + r]; stride >= rows */
    const float *data; /* belongs to the library until zh_sim_free */
    uint64_t steps;    /* control periods simulated */
    double period_s;
    uint32_t trip;                 /* ZH_TRIP_* */
    uint32_t first_fault;          /* bits of the firmware's first fault, 0: none */
    double trip_s;                 /* time of the first trip, negative: none */
    double first_fault_s;          /* negative: none */
    double loop_ns_per_step;       /* CPU time of the whole loop, recording included */
    double controller_ns_per_step; /* with ZH_SIM_TIME_SPLIT, else 0 */
    double plant_ns_per_step;
    void *owner;                   /* owned by the library; NULL after zh_sim_free */
    const uint64_t *signal_hashes; /* with ZH_SIM_HASH_SIGNALS one per traced signal, else NULL */
    zh_commissioning commissioning;
} zh_sim_result;

/* A status of sil.h; text in zh_sil_error(). */
ZH_API int zh_sim_run(const zh_sim_job *job, zh_sim_result *result);
ZH_API void zh_sim_free(zh_sim_result *result);

/* `count` runs in this thread, several at once: every result equals that of zh_sim_run bit for bit,
 * in less CPU time. loop_ns_per_step is the mean of all. results[k] belongs to jobs[k]; free each.
 * If one job is refused none runs, and the text begins with its index. */
ZH_API int zh_sim_run_batch(const zh_sim_job *jobs, zh_sim_result *results, uint32_t count);

/* The columns of a record, in order; NULL beyond the last. */
ZH_API uint32_t zh_sim_column_count(void);
ZH_API const char *zh_sim_column_name(uint32_t index);
ZH_API const char *zh_sim_column_text(uint32_t index);

/* The traced signals (firmware/unit/signal_list.def), in order; NULL beyond the last. */
ZH_API const char *zh_sim_signal_name(uint32_t index);

#ifdef __cplusplus
}
#endif

#endif
