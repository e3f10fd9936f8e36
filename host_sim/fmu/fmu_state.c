/* States of a unit: to go back to, or to carry away as bytes. */
#include <stdlib.h>
#include <string.h>

#include "fmu_instance.h"

/* In memory: this head, the parameters given before the start, the drive's snapshot. */
struct fmu_state {
    size_t bytes; /* of all that */
    uint32_t parameters;
    bool with_plant;
    fmu_values_t values;
    zh_plant *plant; /* a copy; NULL in bytes that were carried away */
};

static size_t given_bytes(const fmu_t *fmu)
{
    return (size_t)fmu->parameters * sizeof *fmu->given;
}

static size_t state_bytes(const fmu_t *fmu)
{
    return sizeof(fmu_state_t) + given_bytes(fmu) + zh_sil_snapshot_bytes();
}

static char *given_of(fmu_state_t *state)
{
    return (char *)state + sizeof *state;
}

fmu_state_t *fmu_save(const fmu_t *fmu)
{
    const size_t bytes = state_bytes(fmu);
    fmu_state_t *state = calloc(1, bytes);
    if (state == NULL) {
        (void)fmu_refuse("no memory for a state");
        return NULL;
    }
    state->bytes = bytes;
    state->parameters = fmu->parameters;
    state->with_plant = fmu->plant != NULL;
    state->values = fmu->values;
    memcpy(given_of(state), fmu->given, given_bytes(fmu));
    if (zh_sil_snapshot(fmu->drive, given_of(state) + given_bytes(fmu), zh_sil_snapshot_bytes()) !=
            ZH_OK ||
        (fmu->plant != NULL && (state->plant = zh_plant_copy(fmu->plant)) == NULL)) {
        (void)fmu_refuse(zh_sil_error());
        free(state);
        return NULL;
    }
    return state;
}

static bool fits(const fmu_t *fmu, const fmu_state_t *state)
{
    return state != NULL && state->bytes == state_bytes(fmu) &&
           state->parameters == fmu->parameters && state->with_plant == fmu->settings.plant;
}

fmu_status_t fmu_restore(fmu_t *fmu, const fmu_state_t *state)
{
    if (!fits(fmu, state)) {
        return fmu_refuse("this is no state of this unit");
    }
    const char *given = (const char *)state + sizeof *state;
    /* A drive takes the state of one that was opened alike. */
    const bool alike = fmu->values.started && memcmp(fmu->given, given, given_bytes(fmu)) == 0;
    memcpy(fmu->given, given, given_bytes(fmu));
    if ((!alike || !state->values.started) && !fmu_open_parts(fmu)) {
        return FMU_ERROR;
    }
    fmu->values = state->values;
    if (state->values.started &&
        (zh_sil_restore(fmu->drive, given + given_bytes(fmu), zh_sil_snapshot_bytes()) != ZH_OK ||
         (state->plant != NULL && zh_plant_restore(fmu->plant, state->plant) != ZH_OK))) {
        return fmu_refuse(zh_sil_error());
    }
    return FMU_OK;
}

void fmu_state_free(fmu_state_t *state)
{
    if (state != NULL) {
        zh_plant_close(state->plant);
        free(state);
    }
}

size_t fmu_state_bytes(const fmu_state_t *state)
{
    return state->with_plant ? 0 : state->bytes;
}

fmu_state_t *fmu_state_of_bytes(const fmu_t *fmu, const void *bytes, size_t count)
{
    fmu_state_t *state = count == state_bytes(fmu) ? malloc(count) : NULL;
    if (state != NULL) {
        memcpy(state, bytes, count);
        state->plant = NULL;
    }
    if (state == NULL || state->with_plant || !fits(fmu, state)) {
        free(state);
        (void)fmu_refuse("these bytes are no state of this unit");
        return NULL;
    }
    return state;
}
