/* The drive of sil.h, alone or with the plant of sil_plant.h, as one functional mock-up unit: what
 * the interfaces of FMI 2.0 (fmi2.c) and FMI 3.0 (fmi3.c) share.
 *
 * Time: control period k samples at t_k = start + k T. A step from t to t + h runs all periods with
 * t_k in [t, t + h), with the inputs as they are; h may be any number of periods. Its outputs are
 * those of the last period. What the unit is made of stands in the folder `resources`:
 *
 *     settings.txt     name=value: plant (0 or 1), seed, adc_bits and the full scales of the board
 *     overrides.txt    parameters of the firmware, as for zh_sil_open
 *     motor/, board.toml, rig.toml
 */
#ifndef FMU_H
#define FMU_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define FMU_TIME            0u
#define FMU_PARAMETER_FIRST 1000u /* and on: in the order of zh_sil_name */

typedef enum {
    FMU_REAL,
    FMU_WHOLE,
    FMU_FLAG
} fmu_kind_t;

/* FMU_WARNING: the drive goes on, but has refused an input (it tripped). */
typedef enum {
    FMU_OK,
    FMU_WARNING,
    FMU_ERROR
} fmu_status_t;

typedef struct fmu fmu_t;

/* NULL: see fmu_error(). */
fmu_t *fmu_open(const char *resources);
void fmu_close(fmu_t *fmu);

/* As after fmu_open. */
fmu_status_t fmu_reset(fmu_t *fmu);

/* The end of the initialization: opens drive and plant with the parameters given until now. */
fmu_status_t fmu_start(fmu_t *fmu);
void fmu_set_start_time(fmu_t *fmu, double start_s);
double fmu_time_s(const fmu_t *fmu);
fmu_status_t fmu_step(fmu_t *fmu, double until_s);

/* Refused: no variable of this kind with this reference, and to set an output. */
fmu_status_t fmu_get(const fmu_t *fmu, uint32_t reference, fmu_kind_t kind, double *value);
fmu_status_t fmu_set(fmu_t *fmu, uint32_t reference, fmu_kind_t kind, double value);

/* A state is a copy of everything, as one block of memory; one with a plant cannot leave it. */
typedef struct fmu_state fmu_state_t;
fmu_state_t *fmu_save(const fmu_t *fmu);
fmu_status_t fmu_restore(fmu_t *fmu, const fmu_state_t *state);
void fmu_state_free(fmu_state_t *state);
/* 0: a state with a plant. */
size_t fmu_state_bytes(const fmu_state_t *state);
/* NULL when the bytes are no state of this unit. */
fmu_state_t *fmu_state_of_bytes(const fmu_t *fmu, const void *bytes, size_t count);

/* Text of the last refusal on this thread. */
const char *fmu_error(void);

#endif
