/* What the files of FMI 3.0 share. */
#ifndef FMI3_INSTANCE_H
#define FMI3_INSTANCE_H

#include <fmi3Functions.h>

#include "fmu.h"

/* The status of the standard; what is refused is logged. */
fmi3Status fmi3_status(fmi3Instance instance, fmu_status_t status);
fmi3Status fmi3_refuse(fmi3Instance instance, const char *text);

#endif
