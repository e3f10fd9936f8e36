/* FMI 2.0 for co-simulation: the functions that do something. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2_component.h"

enum {
    LONGEST_NAME = 128
};

struct component {
    fmu_t *fmu;
    fmi2CallbackFunctions call;
    char name[LONGEST_NAME];
};

fmi2Status fmi2_status(fmi2Component c, fmu_status_t status)
{
    static const fmi2Status of[] = {fmi2OK, fmi2Warning, fmi2Error};
    const struct component *unit = c;
    if (status != FMU_OK && unit != NULL && unit->call.logger != NULL) {
        unit->call.logger(unit->call.componentEnvironment, unit->name, of[status],
                          status == FMU_ERROR ? "logStatusError" : "logStatusWarning", "%s",
                          fmu_error());
    }
    return of[status];
}

static fmu_t *fmu_of(fmi2Component c)
{
    return ((struct component *)c)->fmu;
}

static int nibble(char digit)
{
    const char *digits = "0123456789abcdef";
    const char *found = strchr(digits, digit >= 'A' && digit <= 'F' ? digit + ('a' - 'A') : digit);
    return digit != '\0' && found != NULL ? (int)(found - digits) : -1;
}

/* The folder of a file: address, whose %20 are blanks. */
static void folder_of(const char *address, char folder[FMU_PATH_LONGEST])
{
    const char *from = strncmp(address, "file://", 7) == 0 ? address + 7 : address;
    if (strncmp(from, "localhost/", 10) == 0) {
        from += 9;
    }
    size_t n = 0;
    for (; *from != '\0' && n + 1 < FMU_PATH_LONGEST; ++n) {
        const int high = from[0] == '%' ? nibble(from[1]) : -1;
        const int low = high >= 0 ? nibble(from[2]) : -1;
        folder[n] = low >= 0 ? (char)(high * 16 + low) : *from;
        from += low >= 0 ? 3 : 1;
    }
    folder[n] = '\0';
}

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean loggingOn)
{
    (void)fmuGUID;
    (void)visible;
    (void)loggingOn;
    struct component *unit = calloc(1, sizeof *unit);
    if (unit == NULL || fmuType != fmi2CoSimulation || fmuResourceLocation == NULL) {
        free(unit);
        return NULL;
    }
    char folder[FMU_PATH_LONGEST];
    folder_of(fmuResourceLocation, folder);
    (void)snprintf(unit->name, sizeof unit->name, "%s", instanceName != NULL ? instanceName : "");
    if (functions != NULL) {
        unit->call = *functions;
    }
    unit->fmu = fmu_open(folder);
    if (unit->fmu == NULL) {
        (void)fmi2_status(unit, FMU_ERROR);
        free(unit);
        return NULL;
    }
    return unit;
}

void fmi2FreeInstance(fmi2Component c)
{
    if (c != NULL) {
        fmu_close(fmu_of(c));
        free(c);
    }
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance,
                               fmi2Real startTime, fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    (void)toleranceDefined;
    (void)tolerance;
    (void)stopTimeDefined;
    (void)stopTime;
    fmu_set_start_time(fmu_of(c), startTime);
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    return fmi2_status(c, fmu_start(fmu_of(c)));
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c)
{
    return fmi2_status(c, fmu_reset(fmu_of(c)));
}

#define GET(Type, KIND)                                                                            \
    fmi2Status fmi2Get##Type(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,           \
                             fmi2##Type value[])                                                   \
    {                                                                                              \
        fmu_status_t status = FMU_OK;                                                              \
        for (size_t k = 0; k < nvr && status == FMU_OK; ++k) {                                     \
            double number = 0.0;                                                                   \
            status = fmu_get(fmu_of(c), vr[k], KIND, &number);                                     \
            value[k] = FROM_##Type(number);                                                        \
        }                                                                                          \
        return fmi2_status(c, status);                                                             \
    }
#define SET(Type, KIND)                                                                            \
    fmi2Status fmi2Set##Type(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,           \
                             const fmi2##Type value[])                                             \
    {                                                                                              \
        fmu_status_t status = FMU_OK;                                                              \
        for (size_t k = 0; k < nvr && status == FMU_OK; ++k) {                                     \
            status = fmu_set(fmu_of(c), vr[k], KIND, (double)value[k]);                            \
        }                                                                                          \
        return fmi2_status(c, status);                                                             \
    }

/* Fault bits are 32: the highest is the sign of an integer. */
#define FROM_Real(number)    (number)
#define FROM_Integer(number) ((fmi2Integer)(uint32_t)(number))
#define FROM_Boolean(number) ((number) > 0.0 ? fmi2True : fmi2False)
GET(Real, FMU_REAL)
GET(Integer, FMU_WHOLE)
GET(Boolean, FMU_FLAG)
SET(Real, FMU_REAL)
SET(Integer, FMU_WHOLE)
SET(Boolean, FMU_FLAG)

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint,
                      fmi2Real communicationStepSize, fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    return fmi2_status(c, fmu_step(fmu_of(c), currentCommunicationPoint + communicationStepSize));
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    fmu_state_t *state = fmu_save(fmu_of(c));
    if (state == NULL) {
        return fmi2_status(c, FMU_ERROR);
    }
    fmu_state_free(*FMUstate);
    *FMUstate = state;
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate)
{
    return fmi2_status(c, fmu_restore(fmu_of(c), FMUstate));
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    (void)c;
    if (FMUstate != NULL) {
        fmu_state_free(*FMUstate);
        *FMUstate = NULL;
    }
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size)
{
    *size = fmu_state_bytes(FMUstate);
    return *size > 0 ? fmi2OK : fmi2_refuse(c, "fmi2SerializedFMUstateSize: of a plant");
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte bytes[],
                                 size_t size)
{
    if (size == 0 || size != fmu_state_bytes(FMUstate)) {
        return fmi2_refuse(c, "fmi2SerializeFMUstate: size");
    }
    memcpy(bytes, FMUstate, size);
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size,
                                   fmi2FMUstate *FMUstate)
{
    fmu_state_t *state = fmu_state_of_bytes(fmu_of(c), serializedState, size);
    if (state == NULL) {
        return fmi2_status(c, FMU_ERROR);
    }
    *FMUstate = state;
    return fmi2OK;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value)
{
    if (s != fmi2LastSuccessfulTime) {
        return fmi2_refuse(c, "fmi2GetRealStatus: only the last successful time is known");
    }
    *value = fmu_time_s(fmu_of(c));
    return fmi2OK;
}
