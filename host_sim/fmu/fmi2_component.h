/* What the two files of FMI 2.0 share. */
#ifndef FMI2_COMPONENT_H
#define FMI2_COMPONENT_H

#include <fmi2Functions.h>

#include "fmu.h"

enum {
    FMU_PATH_LONGEST = 1024
};

/* The status of the standard; what is refused is logged. */
fmi2Status fmi2_status(fmi2Component c, fmu_status_t status);
fmi2Status fmi2_refuse(fmi2Component c, const char *text);

#endif
