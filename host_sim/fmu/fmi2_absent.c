/* FMI 2.0: functions that the standard demands of every co-simulation unit and this one has no use
 * for. They have the standard's parameters, which nobody reads. */
#pragma GCC diagnostic ignored "-Wunused-parameter"

#include "fmi2_component.h"
#include "fmu_instance.h"

fmi2Status fmi2_refuse(fmi2Component c, const char *text)
{
    return fmi2_status(c, fmu_refuse(text));
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[])
{
    return fmi2OK; /* what is refused is always logged */
}

/* No variable is a text. */
fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                         fmi2String value[])
{
    return nvr == 0 ? fmi2OK : fmi2_refuse(c, "fmi2GetString: no variable is a text");
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                         const fmi2String value[])
{
    return nvr == 0 ? fmi2OK : fmi2_refuse(c, "fmi2SetString: no variable is a text");
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[],
                                        size_t nUnknown, const fmi2ValueReference vKnown_ref[],
                                        size_t nKnown, const fmi2Real dvKnown[],
                                        fmi2Real dvUnknown[])
{
    return fmi2_refuse(c, "fmi2GetDirectionalDerivative: not provided");
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    return fmi2_refuse(c, "fmi2SetRealInputDerivatives: inputs are held");
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[])
{
    return fmi2_refuse(c, "fmi2GetRealOutputDerivatives: outputs are sampled");
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    return fmi2_refuse(c, "fmi2CancelStep: steps are not asynchronous");
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value)
{
    return fmi2_refuse(c, "fmi2GetStatus: steps are not asynchronous");
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value)
{
    return fmi2_refuse(c, "fmi2GetIntegerStatus: steps are not asynchronous");
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value)
{
    return fmi2_refuse(c, "fmi2GetBooleanStatus: steps are not asynchronous");
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value)
{
    return fmi2_refuse(c, "fmi2GetStringStatus: steps are not asynchronous");
}
