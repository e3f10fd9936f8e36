/* A closed-loop run that can be paused: to flip a bit of the drive's memory, to continue several
 * times from one moment, or to operate the rig by hand. A process that forks at a pause has the run
 * twice.
 *
 * Part of the SIL library. One handle belongs to one thread at a time.
 */
#ifndef ZH_SIM_STEPS_H
#define ZH_SIM_STEPS_H

#include "sim.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct zh_sim_steps zh_sim_steps;

/* NULL when the job is refused: see zh_sil_error(). One run at a time: no ZH_SIM_TIME_SPLIT. */
ZH_API zh_sim_steps *zh_sim_open(const zh_sim_job *job);

/* The same without an end; the record keeps the last `rows` rows, row k at k % rows. Also NULL when
 * rows is 0. */
ZH_API zh_sim_steps *zh_sim_open_endless(const zh_sim_job *job, uint64_t rows);

/* Runs until `steps` control periods are done in total, or the run has ended. */
ZH_API int zh_sim_advance(zh_sim_steps *run, uint64_t steps);

/* Commands, profiles and faults of another scenario, from the next period; its times count from the
 * start of the run. Parts that it does not break are whole again, except a jammed shaft. Settings
 * that act only at a start ([firmware], [controller_motor], initial values, seed, duration) are
 * ignored. */
ZH_API int zh_sim_change(zh_sim_steps *run, const char *scenario);

/* A parameter of the firmware, refused as zh_sil_set refuses it. */
ZH_API int zh_sim_set(zh_sim_steps *run, const char *name, float value);

/* The record so far. The library owns it: the pointers hold until the next call with this run, and
 * nothing has to be freed. */
ZH_API int zh_sim_look(const zh_sim_steps *run, zh_sim_result *result);

/* Flips one bit (0..7) of one byte of the drive (unit_t of firmware/unit/unit.h) before its next
 * period. A pointer or index of the drive may then point anywhere: the process can end by a signal,
 * where a processor with memory protection would end in its fault handler. */
ZH_API int zh_sim_flip(zh_sim_steps *run, uint32_t byte, uint32_t bit);

/* State of the drive: its latched fault bits; 1: gates on. */
ZH_API uint32_t zh_sim_faults(const zh_sim_steps *run);
ZH_API uint32_t zh_sim_gates_on(const zh_sim_steps *run);

/* Size of the drive in bytes. */
ZH_API uint32_t zh_sim_unit_bytes(void);

/* The record so far; the run is over. Free it with zh_sim_free. */
ZH_API int zh_sim_take(zh_sim_steps *run, zh_sim_result *result);

/* NULL is allowed. */
ZH_API void zh_sim_close(zh_sim_steps *run);

#ifdef __cplusplus
}
#endif

#endif
