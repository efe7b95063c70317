/* The FMI 3.0 co-simulation interface around model_*. */
#include "fmi_common.h"
#include "fmi3.h"

#if defined _WIN32
#define API __declspec(dllexport)
#else
#define API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

static fmi3Status wrong(Instance *i) {
  if (i != NULL && i->logging && i->logger != NULL)
    ((fmi3LogMessageCallback)i->logger)(i->environment, fmi3Error, "logStatusError", i->message);
  return fmi3Error;
}

static fmi3Status missing(fmi3Instance c, const char *what) {
  if (c != NULL) snprintf(c->message, sizeof c->message, "%s is not offered", what);
  return wrong(c);
}

static fmi3Status unless(fmi3Instance c, const char *lacking) { return lacking == NULL ? fmi3OK : missing(c, lacking); }

API const char *fmi3GetVersion(void) { return "3.0"; }

API fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[]) {
  (void)n;
  (void)categories;
  if (!present(c, 1)) return wrong(c);
  c->logging = on;
  return fmi3OK;
}

API fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                             fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean events,
                                             fmi3Boolean early, const fmi3ValueReference required[], size_t n,
                                             fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                             fmi3IntermediateUpdateCallback update) {
  (void)resources;
  (void)visible;
  (void)events;
  (void)early;
  (void)required;
  (void)n;
  (void)update;
  const char *why = NULL;
  if (token == NULL || strcmp(token, TOKEN) != 0) why = "the instantiation token is not that of this FMU";
  if (name == NULL || name[0] == 0) why = "an instance needs a name";
  Instance *i = why == NULL ? make(name) : NULL;
  if (i == NULL) {
    if (log != NULL) log(environment, fmi3Error, "logStatusError", why ? why : "no memory");
    return NULL;
  }
  i->logging = logging;
  i->logger = (void (*)(void))log;
  i->environment = environment;
  return i;
}

API fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                              fmi3Boolean visible, fmi3Boolean logging,
                                              fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
  (void)name;
  (void)token;
  (void)resources;
  (void)visible;
  (void)logging;
  if (log != NULL) log(environment, fmi3Error, "logStatusError", "this is a co-simulation FMU");
  return NULL;
}

API fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                                   fmi3Boolean visible, fmi3Boolean logging,
                                                   fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                                   fmi3ClockUpdateCallback clocks, fmi3LockPreemptionCallback lock,
                                                   fmi3UnlockPreemptionCallback unlock) {
  (void)clocks;
  (void)lock;
  (void)unlock;
  return fmi3InstantiateModelExchange(name, token, resources, visible, logging, environment, log);
}

API void fmi3FreeInstance(fmi3Instance c) { destroy(c); }

API fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean given, fmi3Float64 tolerance, fmi3Float64 start,
                                           fmi3Boolean ends, fmi3Float64 stop) {
  if (!present(c, 1) || !begin_at(c, start, given, tolerance, ends, stop)) return wrong(c);
  c->model.real[0] = start;
  c->phase = INITIALIZING;
  return fmi3OK;
}

API fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
  if (!present(c, 1) || !only(c, INITIALIZING, "exit initialization mode") || !fresh(c)) return wrong(c);
  c->phase = STEPPING;
  return fmi3OK;
}

API fmi3Status fmi3Terminate(fmi3Instance c) {
  return present(c, 1) && end(c) ? fmi3OK : wrong(c);
}

API fmi3Status fmi3Reset(fmi3Instance c) {
  if (!present(c, 1)) return wrong(c);
  blank(c);
  return fmi3OK;
}

#define GET(Name, Type, field, first, count, kind)                                                                \
  API fmi3Status fmi3Get##Name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, Type value[], size_t m) { \
    Instance *i = c;                                                                                              \
    if (!present(i, array(vr, n) && array(value, m)) || !fresh(i)) return wrong(i);                               \
    if (m != n) return missing(c, "an array variable");                                                           \
    for (size_t k = 0; k < n; k++) {                                                                              \
      if (!gettable(i, vr[k], first, count, kind)) return wrong(i);                                               \
      value[k] = (Type)i->model.field[vr[k] - (first)];                                                           \
    }                                                                                                             \
    return fmi3OK;                                                                                                \
  }
#define SET(Name, Type, field, first, count, kind)                                                                      \
  API fmi3Status fmi3Set##Name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const Type value[], size_t m) { \
    Instance *i = c;                                                                                                    \
    if (!present(i, array(vr, n) && array(value, m))) return wrong(i);                                                  \
    if (m != n) return missing(c, "an array variable");                                                                 \
    for (size_t k = 0; k < n; k++) {                                                                                    \
      if (!settable(i, vr[k], first, count, kind)) return wrong(i);                                                     \
      i->model.field[vr[k] - (first)] = value[k];                                                                       \
    }                                                                                                                   \
    return fmi3OK;                                                                                                      \
  }
/* An enumeration is an Int64 in FMI 3.0, and an int here. */
GET(Float64, fmi3Float64, real, 0, REALS, "Float64")
SET(Float64, fmi3Float64, real, 0, REALS, "Float64")
GET(Int64, fmi3Int64, whole, REALS, WHOLES, "enumeration")
GET(Boolean, fmi3Boolean, truth, REALS + WHOLES, TRUTHS, "Boolean")
SET(Boolean, fmi3Boolean, truth, REALS + WHOLES, TRUTHS, "Boolean")

/* Kinds of variables that there are none of. */
#define NONE(Name, Type)                                                                                          \
  API fmi3Status fmi3Get##Name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, Type value[], size_t m) { \
    (void)vr;                                                                                                     \
    (void)value;                                                                                                  \
    (void)m;                                                                                                      \
    return n || c == NULL ? missing(c, "a variable of type " #Name) : fmi3OK;                                     \
  }                                                                                                               \
  NONE_SET(Name, Type)
#define NONE_SET(Name, Type)                                                                                            \
  API fmi3Status fmi3Set##Name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const Type value[], size_t m) { \
    (void)vr;                                                                                                           \
    (void)value;                                                                                                        \
    (void)m;                                                                                                            \
    return n || c == NULL ? missing(c, "setting a variable of type " #Name) : fmi3OK;                                   \
  }
NONE(Float32, fmi3Float32)
NONE(Int8, fmi3Int8)
NONE(UInt8, fmi3UInt8)
NONE(Int16, fmi3Int16)
NONE(UInt16, fmi3UInt16)
NONE(Int32, fmi3Int32)
NONE(UInt32, fmi3UInt32)
NONE_SET(Int64, fmi3Int64)
NONE(UInt64, fmi3UInt64)
NONE(String, fmi3String)

API fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) {
  return present(c, state != NULL) ? unless(c, get_state(c, state)) : wrong(c);
}

API fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) {
  if (!present(c, state != NULL)) return wrong(c);
  give_back(c, state);
  return fmi3OK;
}

API fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) {
  (void)c;
  free_state(state);
  return fmi3OK;
}

API fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size) {
  (void)state;
  if (!present(c, size != NULL)) return wrong(c);
  *size = KEPT_BYTES;
  return fmi3OK;
}

API fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size) {
  return present(c, state != NULL && bytes != NULL) ? unless(c, state_to_bytes(state, bytes, size)) : wrong(c);
}

API fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state) {
  return present(c, state != NULL && bytes != NULL) ? unless(c, state_from_bytes(bytes, size, state)) : wrong(c);
}

API fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 step, fmi3Boolean final, fmi3Boolean *event,
                          fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *reached) {
  Instance *i = c;
  (void)final;
  if (event != NULL) *event = false;
  if (terminate != NULL) *terminate = false;
  if (early != NULL) *early = false;
  if (!present(i, 1)) return wrong(i);
  const int done = advance(i, time, step);
  if (reached != NULL) *reached = i->time;
  return done ? fmi3OK : wrong(i);
}

/* What a co-simulation FMU of this kind has no use for; each has its own arguments, of which only the first counts. */
#define REFUSED(Name, ...) \
  API fmi3Status fmi3##Name(fmi3Instance c, __VA_ARGS__) { return missing(c, #Name); }
#define REFUSED_ALONE(Name) \
  API fmi3Status fmi3##Name(fmi3Instance c) { return missing(c, #Name); }
#define VRS const fmi3ValueReference *a, size_t b
#if defined __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif
REFUSED(GetBinary, VRS, size_t *d, fmi3Binary *e, size_t f)
REFUSED(SetBinary, VRS, const size_t *d, const fmi3Binary *e, size_t f)
REFUSED(GetClock, VRS, fmi3Clock *d)
REFUSED(SetClock, VRS, const fmi3Clock *d)
REFUSED(GetNumberOfVariableDependencies, fmi3ValueReference a, size_t *b)
REFUSED(GetVariableDependencies, fmi3ValueReference a, size_t *b, fmi3ValueReference *d, size_t *e, fmi3DependencyKind *f,
        size_t g)
REFUSED(GetDirectionalDerivative, VRS, const fmi3ValueReference *d, size_t e, const fmi3Float64 *f, size_t g,
        fmi3Float64 *h, size_t i)
REFUSED(GetAdjointDerivative, VRS, const fmi3ValueReference *d, size_t e, const fmi3Float64 *f, size_t g, fmi3Float64 *h,
        size_t i)
REFUSED_ALONE(EnterConfigurationMode)
REFUSED_ALONE(ExitConfigurationMode)
REFUSED_ALONE(EnterEventMode)
REFUSED_ALONE(EnterStepMode)
REFUSED_ALONE(EvaluateDiscreteStates)
REFUSED_ALONE(EnterContinuousTimeMode)
REFUSED(GetIntervalDecimal, VRS, fmi3Float64 *d, fmi3IntervalQualifier *e)
REFUSED(GetIntervalFraction, VRS, fmi3UInt64 *d, fmi3UInt64 *e, fmi3IntervalQualifier *f)
REFUSED(GetShiftDecimal, VRS, fmi3Float64 *d)
REFUSED(GetShiftFraction, VRS, fmi3UInt64 *d, fmi3UInt64 *e)
REFUSED(SetIntervalDecimal, VRS, const fmi3Float64 *d)
REFUSED(SetIntervalFraction, VRS, const fmi3UInt64 *d, const fmi3UInt64 *e)
REFUSED(SetShiftDecimal, VRS, const fmi3Float64 *d)
REFUSED(SetShiftFraction, VRS, const fmi3UInt64 *d, const fmi3UInt64 *e)
REFUSED(UpdateDiscreteStates, fmi3Boolean *a, fmi3Boolean *b, fmi3Boolean *d, fmi3Boolean *e, fmi3Boolean *f,
        fmi3Float64 *g)
REFUSED(CompletedIntegratorStep, fmi3Boolean a, fmi3Boolean *b, fmi3Boolean *d)
REFUSED(SetTime, fmi3Float64 a)
REFUSED(SetContinuousStates, const fmi3Float64 *a, size_t b)
REFUSED(GetContinuousStateDerivatives, fmi3Float64 *a, size_t b)
REFUSED(GetEventIndicators, fmi3Float64 *a, size_t b)
REFUSED(GetContinuousStates, fmi3Float64 *a, size_t b)
REFUSED(GetNominalsOfContinuousStates, fmi3Float64 *a, size_t b)
REFUSED(GetNumberOfEventIndicators, size_t *a)
REFUSED(GetNumberOfContinuousStates, size_t *a)
REFUSED(GetOutputDerivatives, VRS, const fmi3Int32 *d, fmi3Float64 *e, size_t f)
REFUSED(ActivateModelPartition, fmi3ValueReference a, fmi3Float64 b)

#ifdef __cplusplus
}
#endif
