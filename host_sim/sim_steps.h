/* A closed-loop run that is stopped on the way: to flip a bit of the drive's memory, to go on from
 * one moment more than once (a process that forks there has the run twice), or to let somebody
 * operate the rig by hand.
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

/* The same without an end; the record keeps the last `rows` rows: row k stands at k % rows. NULL as
 * well when rows is 0. */
ZH_API zh_sim_steps *zh_sim_open_endless(const zh_sim_job *job, uint64_t rows);

/* Until `steps` control periods are done in all, or the run has ended. */
ZH_API int zh_sim_advance(zh_sim_steps *run, uint64_t steps);

/* Commands, profiles and faults of another scenario from the next period on; its times count from
 * the start of the run. What it does not break is whole again, but for a jammed shaft. What only a
 * start can give ([firmware], [controller_motor], initial values, seed, duration) is ignored. */
ZH_API int zh_sim_change(zh_sim_steps *run, const char *scenario);

/* A parameter of the firmware, refused as zh_sil_set refuses it. */
ZH_API int zh_sim_set(zh_sim_steps *run, const char *name, float value);

/* What is recorded so far. Nothing of it is the caller's: the pointers hold until the next call
 * with this run, and there is nothing to free. */
ZH_API int zh_sim_look(const zh_sim_steps *run, zh_sim_result *result);

/* One bit (0..7) of one byte of the drive (unit_t of firmware/unit/unit.h), before its next
 * period. What the drive owns behind a pointer or an index may then be anywhere: the process can
 * end by a signal, where a processor with memory protection ends by its fault handler. */
ZH_API int zh_sim_flip(zh_sim_steps *run, uint32_t byte, uint32_t bit);

/* What the drive says now: its latched fault bits; 1: gates on. */
ZH_API uint32_t zh_sim_faults(const zh_sim_steps *run);
ZH_API uint32_t zh_sim_gates_on(const zh_sim_steps *run);

/* Bytes of the drive. */
ZH_API uint32_t zh_sim_unit_bytes(void);

/* What is recorded so far; the run is over. Free it with zh_sim_free. */
ZH_API int zh_sim_take(zh_sim_steps *run, zh_sim_result *result);

/* NULL is allowed. */
ZH_API void zh_sim_close(zh_sim_steps *run);

#ifdef __cplusplus
}
#endif

#endif
