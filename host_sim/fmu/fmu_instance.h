/* One unit, for the files of this folder alone. */
#ifndef FMU_INSTANCE_H
#define FMU_INSTANCE_H

#include "fmu.h"
#include "fmu_settings.h"
#include "fmu_variables.h"
#include "sil.h"
#include "sil_plant.h"

/* All that a state needs beside drive and plant. */
typedef struct {
    fmu_inputs_t in;
    zh_sil_out out;
    zh_plant_truth truth;
    double start_s;
    double load_Nm; /* that the plant knows of */
    uint64_t periods;
    bool started;
} fmu_values_t;

struct fmu {
    fmu_settings_t settings;
    fmu_values_t values;
    double period_s;
    zh_sil *drive;
    zh_plant *plant;
    uint32_t parameters; /* how many the firmware has */
    double *given;       /* before the start; NaN: not given */
};

/* The text of fmu_error(); returns FMU_ERROR. */
fmu_status_t fmu_refuse(const char *text);

/* Opens drive and plant with what is given. */
bool fmu_open_parts(fmu_t *fmu);

#endif
