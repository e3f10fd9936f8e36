/* FMI 3.0: functions that the standard demands of every unit, of whatever interface, and this one
 * has no use for. They have the standard's parameters, which nobody reads. */
#pragma GCC diagnostic ignored "-Wunused-parameter"

#include "fmi3_instance.h"
#include "fmu_instance.h"

fmi3Status fmi3_refuse(fmi3Instance instance, const char *text)
{
    return fmi3_status(instance, fmu_refuse(text));
}

/* Types that no variable has. */
#define ABSENT(Type)                                                                               \
    fmi3Status fmi3Get##Type(fmi3Instance instance, const fmi3ValueReference valueReferences[],    \
                             size_t nValueReferences, fmi3##Type values[], size_t nValues)         \
    {                                                                                              \
        return nValueReferences == 0 ? fmi3OK                                                      \
                                     : fmi3_refuse(instance, "no variable of type " #Type);        \
    }                                                                                              \
    fmi3Status fmi3Set##Type(fmi3Instance instance, const fmi3ValueReference valueReferences[],    \
                             size_t nValueReferences, const fmi3##Type values[], size_t nValues)   \
    {                                                                                              \
        return nValueReferences == 0 ? fmi3OK                                                      \
                                     : fmi3_refuse(instance, "no variable of type " #Type);        \
    }
ABSENT(Float32)
ABSENT(Int8)
ABSENT(UInt8)
ABSENT(Int16)
ABSENT(UInt16)
ABSENT(Int32)
ABSENT(Int64)
ABSENT(UInt64)
ABSENT(String)

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[])
{
    return fmi3OK; /* what is refused is always logged */
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible,
                                          fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage)
{
    return NULL;
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
    fmi3LockPreemptionCallback lockPreemption, fmi3UnlockPreemptionCallback unlockPreemption)
{
    return NULL;
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
    return fmi3_refuse(instance, "fmi3EnterEventMode: not provided");
}

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                         size_t nValueReferences, size_t valueSizes[], fmi3Binary values[],
                         size_t nValues)
{
    return nValueReferences == 0 ? fmi3OK
                                 : fmi3_refuse(instance, "fmi3GetBinary: no variable of this type");
}

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                        size_t nValueReferences, fmi3Clock values[])
{
    return nValueReferences == 0 ? fmi3OK
                                 : fmi3_refuse(instance, "fmi3GetClock: no variable of this type");
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                         size_t nValueReferences, const size_t valueSizes[],
                         const fmi3Binary values[], size_t nValues)
{
    return nValueReferences == 0 ? fmi3OK
                                 : fmi3_refuse(instance, "fmi3SetBinary: no variable of this type");
}

fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                        size_t nValueReferences, const fmi3Clock values[])
{
    return nValueReferences == 0 ? fmi3OK
                                 : fmi3_refuse(instance, "fmi3SetClock: no variable of this type");
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance,
                                               fmi3ValueReference valueReference,
                                               size_t *nDependencies)
{
    return fmi3_refuse(instance, "fmi3GetNumberOfVariableDependencies: not provided");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent,
                                       size_t elementIndicesOfDependent[],
                                       fmi3ValueReference independents[],
                                       size_t elementIndicesOfIndependents[],
                                       fmi3DependencyKind dependencyKinds[], size_t nDependencies)
{
    return fmi3_refuse(instance, "fmi3GetVariableDependencies: not provided");
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                        size_t nUnknowns, const fmi3ValueReference knowns[],
                                        size_t nKnowns, const fmi3Float64 seed[], size_t nSeed,
                                        fmi3Float64 sensitivity[], size_t nSensitivity)
{
    return fmi3_refuse(instance, "fmi3GetDirectionalDerivative: not provided");
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                    size_t nUnknowns, const fmi3ValueReference knowns[],
                                    size_t nKnowns, const fmi3Float64 seed[], size_t nSeed,
                                    fmi3Float64 sensitivity[], size_t nSensitivity)
{
    return fmi3_refuse(instance, "fmi3GetAdjointDerivative: not provided");
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance)
{
    return fmi3_refuse(instance, "fmi3EnterConfigurationMode: not provided");
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance)
{
    return fmi3_refuse(instance, "fmi3ExitConfigurationMode: not provided");
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                  size_t nValueReferences, fmi3Float64 intervals[],
                                  fmi3IntervalQualifier qualifiers[])
{
    return fmi3_refuse(instance, "fmi3GetIntervalDecimal: not provided");
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance instance,
                                   const fmi3ValueReference valueReferences[],
                                   size_t nValueReferences, fmi3UInt64 counters[],
                                   fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
{
    return fmi3_refuse(instance, "fmi3GetIntervalFraction: not provided");
}

fmi3Status fmi3GetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                               size_t nValueReferences, fmi3Float64 shifts[])
{
    return fmi3_refuse(instance, "fmi3GetShiftDecimal: not provided");
}

fmi3Status fmi3GetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                size_t nValueReferences, fmi3UInt64 counters[],
                                fmi3UInt64 resolutions[])
{
    return fmi3_refuse(instance, "fmi3GetShiftFraction: not provided");
}

fmi3Status fmi3SetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                  size_t nValueReferences, const fmi3Float64 intervals[])
{
    return fmi3_refuse(instance, "fmi3SetIntervalDecimal: not provided");
}

fmi3Status fmi3SetIntervalFraction(fmi3Instance instance,
                                   const fmi3ValueReference valueReferences[],
                                   size_t nValueReferences, const fmi3UInt64 counters[],
                                   const fmi3UInt64 resolutions[])
{
    return fmi3_refuse(instance, "fmi3SetIntervalFraction: not provided");
}

fmi3Status fmi3SetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                               size_t nValueReferences, const fmi3Float64 shifts[])
{
    return fmi3_refuse(instance, "fmi3SetShiftDecimal: not provided");
}

fmi3Status fmi3SetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                size_t nValueReferences, const fmi3UInt64 counters[],
                                const fmi3UInt64 resolutions[])
{
    return fmi3_refuse(instance, "fmi3SetShiftFraction: not provided");
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance)
{
    return fmi3_refuse(instance, "fmi3EvaluateDiscreteStates: not provided");
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation,
                                    fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged,
                                    fmi3Boolean *nextEventTimeDefined, fmi3Float64 *nextEventTime)
{
    return fmi3_refuse(instance, "fmi3UpdateDiscreteStates: not provided");
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance)
{
    return fmi3_refuse(instance, "fmi3EnterContinuousTimeMode: not provided");
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance,
                                       fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode,
                                       fmi3Boolean *terminateSimulation)
{
    return fmi3_refuse(instance, "fmi3CompletedIntegratorStep: not provided");
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
    return fmi3_refuse(instance, "fmi3SetTime: not provided");
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[],
                                   size_t nContinuousStates)
{
    return fmi3_refuse(instance, "fmi3SetContinuousStates: not provided");
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[],
                                             size_t nContinuousStates)
{
    return fmi3_refuse(instance, "fmi3GetContinuousStateDerivatives: not provided");
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 eventIndicators[],
                                  size_t nEventIndicators)
{
    return fmi3_refuse(instance, "fmi3GetEventIndicators: not provided");
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 continuousStates[],
                                   size_t nContinuousStates)
{
    return fmi3_refuse(instance, "fmi3GetContinuousStates: not provided");
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[],
                                             size_t nContinuousStates)
{
    return fmi3_refuse(instance, "fmi3GetNominalsOfContinuousStates: not provided");
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators)
{
    *nEventIndicators = 0;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates)
{
    *nContinuousStates = 0;
    return fmi3OK;
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance)
{
    return fmi3_refuse(instance, "fmi3EnterStepMode: not provided");
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance,
                                    const fmi3ValueReference valueReferences[],
                                    size_t nValueReferences, const fmi3Int32 orders[],
                                    fmi3Float64 values[], size_t nValues)
{
    return fmi3_refuse(instance, "fmi3GetOutputDerivatives: not provided");
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clockReference,
                                      fmi3Float64 activationTime)
{
    return fmi3_refuse(instance, "fmi3ActivateModelPartition: not provided");
}
