/* FMI 3.0 for co-simulation: the functions that do something. */
#include <stdlib.h>
#include <string.h>

#include "fmi3_instance.h"

struct instance {
    fmu_t *fmu;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
};

fmi3Status fmi3_status(fmi3Instance instance, fmu_status_t status)
{
    static const fmi3Status of[] = {fmi3OK, fmi3Warning, fmi3Error};
    const struct instance *unit = instance;
    if (status != FMU_OK && unit != NULL && unit->log != NULL) {
        unit->log(unit->environment, of[status],
                  status == FMU_ERROR ? "logStatusError" : "logStatusWarning", fmu_error());
    }
    return of[status];
}

static fmu_t *fmu_of(fmi3Instance instance)
{
    return ((struct instance *)instance)->fmu;
}

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
    fmi3Boolean earlyReturnAllowed, const fmi3ValueReference requiredIntermediateVariables[],
    size_t nRequiredIntermediateVariables, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3IntermediateUpdateCallback intermediateUpdate)
{
    (void)instanceName;
    (void)instantiationToken;
    (void)visible;
    (void)loggingOn;
    (void)eventModeUsed;
    (void)earlyReturnAllowed;
    (void)requiredIntermediateVariables;
    (void)nRequiredIntermediateVariables;
    (void)intermediateUpdate;
    struct instance *unit = resourcePath != NULL ? calloc(1, sizeof *unit) : NULL;
    if (unit == NULL) {
        return NULL;
    }
    unit->environment = instanceEnvironment;
    unit->log = logMessage;
    unit->fmu = fmu_open(resourcePath);
    if (unit->fmu == NULL) {
        (void)fmi3_status(unit, FMU_ERROR);
        free(unit);
        return NULL;
    }
    return unit;
}

void fmi3FreeInstance(fmi3Instance instance)
{
    if (instance != NULL) {
        fmu_close(fmu_of(instance));
        free(instance);
    }
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined,
                                       fmi3Float64 tolerance, fmi3Float64 startTime,
                                       fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    (void)toleranceDefined;
    (void)tolerance;
    (void)stopTimeDefined;
    (void)stopTime;
    fmu_set_start_time(fmu_of(instance), startTime);
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    return fmi3_status(instance, fmu_start(fmu_of(instance)));
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    (void)instance;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    return fmi3_status(instance, fmu_reset(fmu_of(instance)));
}

#define GET(Type, KIND)                                                                            \
    fmi3Status fmi3Get##Type(fmi3Instance instance, const fmi3ValueReference valueReferences[],    \
                             size_t nValueReferences, fmi3##Type values[], size_t nValues)         \
    {                                                                                              \
        (void)nValues; /* no variable is an array */                                               \
        fmu_status_t status = FMU_OK;                                                              \
        for (size_t k = 0; k < nValueReferences && status == FMU_OK; ++k) {                        \
            double number = 0.0;                                                                   \
            status = fmu_get(fmu_of(instance), valueReferences[k], KIND, &number);                 \
            values[k] = FROM_##Type(number);                                                       \
        }                                                                                          \
        return fmi3_status(instance, status);                                                      \
    }
#define SET(Type, KIND)                                                                            \
    fmi3Status fmi3Set##Type(fmi3Instance instance, const fmi3ValueReference valueReferences[],    \
                             size_t nValueReferences, const fmi3##Type values[], size_t nValues)   \
    {                                                                                              \
        (void)nValues;                                                                             \
        fmu_status_t status = FMU_OK;                                                              \
        for (size_t k = 0; k < nValueReferences && status == FMU_OK; ++k) {                        \
            status = fmu_set(fmu_of(instance), valueReferences[k], KIND, (double)values[k]);       \
        }                                                                                          \
        return fmi3_status(instance, status);                                                      \
    }

#define FROM_Float64(number) (number)
#define FROM_UInt32(number)  ((fmi3UInt32)(number))
#define FROM_Boolean(number) ((number) > 0.0)
GET(Float64, FMU_REAL)
GET(UInt32, FMU_WHOLE)
GET(Boolean, FMU_FLAG)
SET(Float64, FMU_REAL)
SET(UInt32, FMU_WHOLE)
SET(Boolean, FMU_FLAG)

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint,
                      fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                      fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation,
                      fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    const double until_s = currentCommunicationPoint + communicationStepSize;
    *eventHandlingNeeded = *terminateSimulation = *earlyReturn = fmi3False;
    *lastSuccessfulTime = until_s;
    return fmi3_status(instance, fmu_step(fmu_of(instance), until_s));
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    fmu_state_t *state = fmu_save(fmu_of(instance));
    if (state == NULL) {
        return fmi3_status(instance, FMU_ERROR);
    }
    fmu_state_free(*FMUState);
    *FMUState = state;
    return fmi3OK;
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState)
{
    return fmi3_status(instance, fmu_restore(fmu_of(instance), FMUState));
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    (void)instance;
    if (FMUState != NULL) {
        fmu_state_free(*FMUState);
        *FMUState = NULL;
    }
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size)
{
    *size = fmu_state_bytes(FMUState);
    return *size > 0 ? fmi3OK : fmi3_refuse(instance, "fmi3SerializedFMUStateSize: of a plant");
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState,
                                 fmi3Byte serializedState[], size_t size)
{
    if (size == 0 || size != fmu_state_bytes(FMUState)) {
        return fmi3_refuse(instance, "fmi3SerializeFMUState: size");
    }
    memcpy(serializedState, FMUState, size);
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[],
                                   size_t size, fmi3FMUState *FMUState)
{
    fmu_state_t *state = fmu_state_of_bytes(fmu_of(instance), serializedState, size);
    if (state == NULL) {
        return fmi3_status(instance, FMU_ERROR);
    }
    *FMUState = state;
    return fmi3OK;
}
