/* Variables of a unit by number. */
#include <math.h>
#include <string.h>

#include "fmu_instance.h"

static fmu_status_t no_such(void)
{
    return fmu_refuse("no variable of this type has this value reference");
}

/* A parameter of the firmware by its reference; its kind is that of its numbers. */
static bool is_parameter(const fmu_t *fmu, uint32_t reference, fmu_kind_t kind)
{
    return kind == FMU_REAL && reference >= FMU_PARAMETER_FIRST &&
           reference - FMU_PARAMETER_FIRST < fmu->parameters;
}

static fmu_status_t get_parameter(const fmu_t *fmu, uint32_t index, double *value)
{
    float now = 0.0F;
    if (!fmu->values.started && !isnan(fmu->given[index])) {
        *value = fmu->given[index];
        return FMU_OK;
    }
    if (zh_sil_get(fmu->drive, zh_sil_name(index), &now) != ZH_OK) {
        return fmu_refuse(zh_sil_error());
    }
    *value = (double)now;
    return FMU_OK;
}

static fmu_status_t set_parameter(fmu_t *fmu, uint32_t index, double value)
{
    if (!fmu->values.started) {
        fmu->given[index] = value;
        return FMU_OK;
    }
    if (zh_sil_set(fmu->drive, zh_sil_name(index), (float)value) != ZH_OK) {
        return fmu_refuse(zh_sil_error());
    }
    return FMU_OK;
}

/* A number at an address, as wide as its place and kind say. */
static double number_at(const fmu_values_t *values, const fmu_variable_t *v)
{
    const char *base = v->place == FMU_OF_INPUTS    ? (const char *)&values->in
                       : v->place == FMU_OF_OUTPUTS ? (const char *)&values->out
                                                    : (const char *)&values->truth;
    double wide = 0.0;
    float narrow = 0.0F;
    uint32_t whole = 0;
    if (v->place != FMU_OF_INPUTS && v->kind != FMU_REAL) {
        memcpy(&whole, base + v->offset, sizeof whole);
        return (double)whole;
    }
    if (v->place == FMU_OF_OUTPUTS) {
        memcpy(&narrow, base + v->offset, sizeof narrow);
        return (double)narrow;
    }
    memcpy(&wide, base + v->offset, sizeof wide);
    return wide;
}

fmu_status_t fmu_get(const fmu_t *fmu, uint32_t reference, fmu_kind_t kind, double *value)
{
    if (fmu->drive == NULL) {
        return fmu_refuse("the drive is not open; reset the unit");
    }
    if (reference == FMU_TIME && kind == FMU_REAL) {
        *value = fmu_time_s(fmu);
        return FMU_OK;
    }
    if (is_parameter(fmu, reference, kind)) {
        return get_parameter(fmu, reference - FMU_PARAMETER_FIRST, value);
    }
    const fmu_variable_t *v = fmu_variable(reference, kind, fmu->settings.plant);
    if (v == NULL) {
        return no_such();
    }
    *value = number_at(&fmu->values, v);
    return FMU_OK;
}

fmu_status_t fmu_set(fmu_t *fmu, uint32_t reference, fmu_kind_t kind, double value)
{
    if (fmu->drive == NULL) {
        return fmu_refuse("the drive is not open; reset the unit");
    }
    if (is_parameter(fmu, reference, kind)) {
        return set_parameter(fmu, reference - FMU_PARAMETER_FIRST, value);
    }
    const fmu_variable_t *v = fmu_variable(reference, kind, fmu->settings.plant);
    if (v == NULL) {
        return no_such();
    }
    if (v->place != FMU_OF_INPUTS) {
        return fmu_refuse("an output cannot be set");
    }
    memcpy((char *)&fmu->values.in + v->offset, &value, sizeof value);
    return FMU_OK;
}
