#include "fmu_variables.h"

#include "sil_plant.h"

static const fmu_variable_t variables[] = {
#define ROW(number, kind, place, unit, type, name)                                                 \
    {number, FMU_##kind, place, unit, offsetof(type, name)},
#define FMU_INPUT(number, name, kind, start, unit, text)                                           \
    ROW(number, kind, FMU_OF_INPUTS, FMU_WITH_ANY, fmu_inputs_t, name)
#define FMU_DRIVE_INPUT(number, name, kind, start, unit, text)                                     \
    ROW(number, kind, FMU_OF_INPUTS, FMU_WITHOUT_PLANT, fmu_inputs_t, name)
#define FMU_PLANT_INPUT(number, name, kind, start, unit, text)                                     \
    ROW(number, kind, FMU_OF_INPUTS, FMU_WITH_PLANT, fmu_inputs_t, name)
#define FMU_OUTPUT(number, name, kind, unit, text)                                                 \
    ROW(number, kind, FMU_OF_OUTPUTS, FMU_WITH_ANY, zh_sil_out, name)
#define FMU_TRUTH(number, name, kind, unit, text)                                                  \
    ROW(number, kind, FMU_OF_TRUTH, FMU_WITH_PLANT, zh_plant_truth, name)
#include "fmu_variables.def"
};

const fmu_variable_t *fmu_variable(uint32_t number, fmu_kind_t kind, bool plant)
{
    const fmu_unit_t other = plant ? FMU_WITHOUT_PLANT : FMU_WITH_PLANT;
    for (size_t k = 0; k < sizeof variables / sizeof variables[0]; ++k) {
        const fmu_variable_t *v = &variables[k];
        if (v->number == number && v->kind == kind && v->unit != other) {
            return v;
        }
    }
    return NULL;
}
