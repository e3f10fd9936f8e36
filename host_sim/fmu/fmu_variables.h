/* The variables of fmu_variables.def as a table. */
#ifndef FMU_VARIABLES_H
#define FMU_VARIABLES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "fmu.h"

/* Inputs as they were set; words and flags too are numbers. */
typedef struct {
#define FMU_INPUT(number, name, kind, start, unit, text) double name;
#define FMU_DRIVE_INPUT                                  FMU_INPUT
#define FMU_PLANT_INPUT                                  FMU_INPUT
#define FMU_OUTPUT(number, name, kind, unit, text)
#define FMU_TRUTH(number, name, kind, unit, text)
#include "fmu_variables.def"
#undef FMU_INPUT
#undef FMU_DRIVE_INPUT
#undef FMU_PLANT_INPUT
#undef FMU_OUTPUT
#undef FMU_TRUTH
} fmu_inputs_t;

typedef enum {
    FMU_OF_INPUTS,
    FMU_OF_OUTPUTS,
    FMU_OF_TRUTH
} fmu_place_t;
typedef enum {
    FMU_WITH_ANY,
    FMU_WITHOUT_PLANT,
    FMU_WITH_PLANT
} fmu_unit_t;

typedef struct {
    uint32_t number;
    fmu_kind_t kind;
    fmu_place_t place;
    fmu_unit_t unit;
    size_t offset; /* in fmu_inputs_t, zh_sil_out or zh_plant_truth */
} fmu_variable_t;

/* NULL: none with this number, of this kind, in a unit with or without plant. */
const fmu_variable_t *fmu_variable(uint32_t number, fmu_kind_t kind, bool plant);

#endif
