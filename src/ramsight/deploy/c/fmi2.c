/* The FMI 2.0 co-simulation interface around model_*. */
#include "fmi_common.h"
#include "fmi2.h"

#if defined _WIN32
#define API __declspec(dllexport)
#else
#define API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

typedef void (*Logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);

static fmi2Status wrong(Instance *i) {
  if (i != NULL && i->logging && i->logger != NULL)
    ((Logger)i->logger)(i->environment, i->name, fmi2Error, "logStatusError", "%s", i->message);
  return fmi2Error;
}

static fmi2Status missing(fmi2Component c, const char *what) {
  if (c != NULL) snprintf(c->message, sizeof c->message, "%s is not offered", what);
  return wrong(c);
}

static fmi2Status unless(fmi2Component c, const char *lacking) { return lacking == NULL ? fmi2OK : missing(c, lacking); }

API const char *fmi2GetTypesPlatform(void) { return "default"; }
API const char *fmi2GetVersion(void) { return "2.0"; }

API fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
  (void)n;
  (void)categories;
  if (!present(c, 1)) return wrong(c);
  c->logging = on;
  return fmi2OK;
}

API fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token, fmi2String resources,
                                  const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
  (void)resources;
  (void)visible;
  const char *why = NULL;
  if (type != fmi2CoSimulation) why = "this is a co-simulation FMU";
  if (token == NULL || strcmp(token, TOKEN) != 0) why = "the GUID is not that of this FMU";
  if (name == NULL || name[0] == 0) why = "an instance needs a name";
  Instance *i = why == NULL ? make(name) : NULL;
  if (i == NULL) {
    if (functions != NULL && functions->logger != NULL)
      functions->logger(functions->componentEnvironment, name ? name : "", fmi2Error, "logStatusError", "%s",
                        why ? why : "no memory");
    return NULL;
  }
  i->logging = logging;
  if (functions != NULL) {
    i->logger = (void (*)(void))functions->logger;
    i->environment = functions->componentEnvironment;
  }
  return i;
}

API void fmi2FreeInstance(fmi2Component c) { destroy(c); }

API fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean given, fmi2Real tolerance, fmi2Real start,
                                   fmi2Boolean ends, fmi2Real stop) {
  return present(c, 1) && begin_at(c, start, given, tolerance, ends, stop) ? fmi2OK : wrong(c);
}

API fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
  if (!present(c, 1) || !only(c, INSTANTIATED, "enter initialization mode")) return wrong(c);
  c->phase = INITIALIZING;
  return fmi2OK;
}

API fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
  if (!present(c, 1) || !only(c, INITIALIZING, "exit initialization mode") || !fresh(c)) return wrong(c);
  c->phase = STEPPING;
  return fmi2OK;
}

API fmi2Status fmi2Terminate(fmi2Component c) {
  return present(c, 1) && end(c) ? fmi2OK : wrong(c);
}

API fmi2Status fmi2Reset(fmi2Component c) {
  if (!present(c, 1)) return wrong(c);
  blank(c);
  return fmi2OK;
}

#define GET(Name, Type, field, first, count, kind)                                                       \
  API fmi2Status fmi2Get##Name(fmi2Component c, const fmi2ValueReference vr[], size_t n, Type value[]) { \
    Instance *i = c;                                                                                     \
    if (!present(i, array(vr, n) && array(value, n)) || !fresh(i)) return wrong(i);                      \
    for (size_t k = 0; k < n; k++) {                                                                     \
      if (!gettable(i, vr[k], first, count, kind)) return wrong(i);                                      \
      value[k] = i->model.field[vr[k] - (first)];                                                        \
    }                                                                                                    \
    return fmi2OK;                                                                                       \
  }
#define SET(Name, Type, field, first, count, kind)                                                             \
  API fmi2Status fmi2Set##Name(fmi2Component c, const fmi2ValueReference vr[], size_t n, const Type value[]) { \
    Instance *i = c;                                                                                           \
    if (!present(i, array(vr, n) && array(value, n))) return wrong(i);                                         \
    for (size_t k = 0; k < n; k++) {                                                                           \
      if (!settable(i, vr[k], first, count, kind)) return wrong(i);                                            \
      i->model.field[vr[k] - (first)] = value[k];                                                              \
    }                                                                                                          \
    return fmi2OK;                                                                                             \
  }
GET(Real, fmi2Real, real, 0, REALS, "real")
SET(Real, fmi2Real, real, 0, REALS, "real")
GET(Integer, fmi2Integer, whole, REALS, WHOLES, "integer")
SET(Integer, fmi2Integer, whole, REALS, WHOLES, "integer")
GET(Boolean, fmi2Boolean, truth, REALS + WHOLES, TRUTHS, "Boolean")
SET(Boolean, fmi2Boolean, truth, REALS + WHOLES, TRUTHS, "Boolean")

API fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2String value[]) {
  (void)vr;
  (void)value;
  return n || c == NULL ? missing(c, "a string variable") : fmi2OK;
}

API fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2String value[]) {
  (void)vr;
  (void)value;
  return n || c == NULL ? missing(c, "a string variable") : fmi2OK;
}

API fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
  return present(c, state != NULL) ? unless(c, get_state(c, state)) : wrong(c);
}

API fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
  if (!present(c, state != NULL)) return wrong(c);
  give_back(c, state);
  return fmi2OK;
}

API fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
  (void)c;
  free_state(state);
  return fmi2OK;
}

API fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
  (void)state;
  if (!present(c, size != NULL)) return wrong(c);
  *size = KEPT_BYTES;
  return fmi2OK;
}

API fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
  return present(c, state != NULL && bytes != NULL) ? unless(c, state_to_bytes(state, bytes, size)) : wrong(c);
}

API fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
  return present(c, state != NULL && bytes != NULL) ? unless(c, state_from_bytes(bytes, size, state)) : wrong(c);
}

API fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t unknowns,
                                            const fmi2ValueReference known[], size_t knowns, const fmi2Real dv[],
                                            fmi2Real du[]) {
  (void)unknown;
  (void)unknowns;
  (void)known;
  (void)knowns;
  (void)dv;
  (void)du;
  return missing(c, "a directional derivative");
}

API fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                           const fmi2Integer order[], const fmi2Real value[]) {
  Instance *i = c;
  if (!present(i, array(vr, n) && array(order, n) && array(value, n))) return wrong(i);
  for (size_t k = 0; k < n; k++) {
    if (!settable(i, vr[k], 0, REALS, "real")) return wrong(i);
    if (causality[vr[k]] != 'i' || order[k] != 1) return missing(c, "a derivative but the first of an input");
    i->model.slope[vr[k]] = value[k];
    i->model.sloped[vr[k]] = 1;
  }
  return fmi2OK;
}

API fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                            const fmi2Integer order[], fmi2Real value[]) {
  (void)vr;
  (void)order;
  (void)value;
  return n || c == NULL ? missing(c, "an output's derivative") : fmi2OK;
}

API fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean final) {
  (void)final;
  return present(c, 1) && advance(c, time, step) ? fmi2OK : wrong(c);
}

API fmi2Status fmi2CancelStep(fmi2Component c) { return missing(c, "a step that can be cancelled"); }

API fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value) {
  (void)kind;
  (void)value;
  return missing(c, "a pending status");
}

API fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
  if (kind != fmi2LastSuccessfulTime) return missing(c, "that status");
  if (!present(c, value != NULL)) return wrong(c);
  *value = c->time;
  return fmi2OK;
}

API fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value) {
  (void)kind;
  (void)value;
  return missing(c, "an integer status");
}

API fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
  if (kind != fmi2Terminated) return missing(c, "that status");
  if (!present(c, value != NULL)) return wrong(c);
  *value = 0;
  return fmi2OK;
}

API fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value) {
  (void)kind;
  (void)value;
  return missing(c, "a status as a string");
}

#ifdef __cplusplus
}
#endif
