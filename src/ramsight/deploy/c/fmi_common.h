/* An instance, whatever the FMI's version. Several live side by side; none shares anything with another. */
#include "fmu.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct Instance {
  Model model;
  char *name;
  void *environment;
  void (*logger)(void); /* cast to its own type where it is called */
  int logging;
  int phase; /* one of those below */
  double time; /* reached [s] */
  double stop; /* no step may end later [s] */
  char message[200];
} Instance;

/* Of a stop time and a step: by so much a sum of steps may be beyond the stop time by rounding alone. */
#define STOP_ROUNDING 1e-9

/* Times and steps up to here [s], 31 years: at it a double has steps of 0.1 us. */
#define LATEST 1e9

enum { INSTANTIATED, INITIALIZING, STEPPING, TERMINATED };

/* Before it is initialized an instance knows no output, and says so. */
static void blank(Instance *i) {
  memset(&i->model, 0, sizeof i->model);
  model_start(&i->model);
  model_unknown(&i->model);
  for (size_t k = HAS_TIME; k < REALS; k++)
    if (causality[k] == 'o') i->model.real[k] = (double)NAN;
  i->model.tolerance = TOLERANCE;
  i->phase = INSTANTIATED;
  i->time = 0.0;
  i->stop = (double)INFINITY;
}

static Instance *make(const char *name) {
  Instance *i = (Instance *)calloc(1, sizeof *i);
  if (i == NULL) return NULL;
  i->name = (char *)calloc(1, strlen(name) + 1);
  if (i->name == NULL) {
    free(i);
    return NULL;
  }
  memcpy(i->name, name, strlen(name));
  blank(i);
  return i;
}

static void destroy(Instance *i) {
  if (i == NULL) return;
  free(i->name);
  free(i);
}

/* Whether there is an instance, and what a call with it points to. */
static int present(Instance *i, int all) {
  if (i != NULL && !all) snprintf(i->message, sizeof i->message, "a pointer is null");
  return i != NULL && all;
}

/* Whether an array of so many is there. */
static int array(const void *first, size_t count) { return first != NULL || count == 0; }

/* Whether a call is one for this phase. */
static int only(Instance *i, int phase, const char *call) {
  static const char *const names[] = {"instantiated", "initializing", "stepping", "terminated"};
  if (i->phase == phase) return 1;
  snprintf(i->message, sizeof i->message, "%s: the instance is %s, and has to be %s", call, names[i->phase], names[phase]);
  return 0;
}

static int begin_at(Instance *i, double time, int given, double tolerance, int ends, double stop) {
  if (!only(i, INSTANTIATED, "a start time")) return 0;
  if (!(fabs(time) <= LATEST)) {
    snprintf(i->message, sizeof i->message, "the start time is no number up to 1e9 s");
    return 0;
  }
  if (ends && !(stop >= time)) {
    snprintf(i->message, sizeof i->message, "the stop time %.9g s is not after the start time %.9g s", stop, time);
    return 0;
  }
  i->time = time;
  if (ends) i->stop = stop;
  if (given && tolerance > 1e-12 && tolerance < 1e-2) i->model.tolerance = tolerance;
  return 1;
}

static int end(Instance *i) {
  if (i->phase != INITIALIZING && !only(i, STEPPING, "terminate")) return 0;
  i->phase = TERMINATED;
  return 1;
}

/* Outputs that are asked for while initializing follow from what was set until then. */
static int fresh(Instance *i) {
  const char *wrong = i->phase == INITIALIZING ? model_initialize(&i->model) : NULL;
  if (wrong != NULL) snprintf(i->message, sizeof i->message, "at the start: %s", wrong);
  return wrong == NULL;
}

/* Why a variable cannot be set now, or NULL. */
static const char *refusal(const Instance *i, size_t k) {
  if (causality[k] == 'o') return "is an output";
  if (causality[k] == 'p' && i->phase > INITIALIZING) return "is a parameter, and fixed once the simulation runs";
  return NULL;
}

static int no_number(Instance *i, size_t k, const char *kind) {
  snprintf(i->message, sizeof i->message, "there is no %s variable with the value reference %lu", kind, (unsigned long)k);
  return 0;
}

static int settable(Instance *i, size_t k, size_t first, size_t count, const char *kind) {
  if (k < first || k >= first + count) return no_number(i, k, kind);
  if (refusal(i, k) == NULL) return 1;
  snprintf(i->message, sizeof i->message, "the variable with the value reference %lu %s", (unsigned long)k, refusal(i, k));
  return 0;
}

static int gettable(Instance *i, size_t k, size_t first, size_t count, const char *kind) {
  return (k >= first && k < first + count) || no_number(i, k, kind);
}

/* A kept state: the instance's model and where it is. */
typedef struct Kept {
  char token[sizeof TOKEN];
  Model model;
  int phase;
  double time;
} Kept;

static void keep(const Instance *i, Kept *to) {
  memset(to, 0, sizeof *to);
  memcpy(to->token, TOKEN, sizeof TOKEN);
  to->model = i->model;
  to->phase = i->phase;
  to->time = i->time;
}

static void give_back(Instance *i, const Kept *from) {
  i->model = from->model;
  i->phase = from->phase;
  i->time = from->time;
}

/* States as the interfaces hand them about. Each function gives what is missing, NULL where nothing is. */
static const char *get_state(const Instance *i, Kept **state) {
  if (*state == NULL) *state = (Kept *)malloc(sizeof(Kept));
  if (*state == NULL) return "memory for a state";
  keep(i, *state);
  return NULL;
}

static void free_state(Kept **state) {
  if (state == NULL) return;
  free(*state);
  *state = NULL;
}

/* FNV-1a of 64 bits: http://www.isthe.com/chongo/tech/comp/fnv/ */
static uint64_t sum_of(const unsigned char *bytes, size_t size) {
  uint64_t sum = UINT64_C(0xcbf29ce484222325);
  for (size_t k = 0; k < size; k++) sum = (sum ^ bytes[k]) * UINT64_C(0x100000001b3);
  return sum;
}

/* As bytes a state is followed by their sum: importers keep it in files. */
#define KEPT_BYTES (sizeof(Kept) + sizeof(uint64_t))

static const char *state_to_bytes(const Kept *state, void *bytes, size_t size) {
  if (size < KEPT_BYTES) return "room for a state in so few bytes";
  memcpy(bytes, state, sizeof(Kept));
  const uint64_t sum = sum_of((const unsigned char *)bytes, sizeof(Kept));
  memcpy((unsigned char *)bytes + sizeof(Kept), &sum, sizeof sum);
  return NULL;
}

static const char *state_from_bytes(const void *bytes, size_t size, Kept **state) {
  uint64_t sum;
  Kept read;
  if (size < KEPT_BYTES || memcmp(bytes, TOKEN, sizeof TOKEN) != 0) return "the state of another FMU";
  memcpy(&sum, (const unsigned char *)bytes + sizeof(Kept), sizeof sum);
  if (sum != sum_of((const unsigned char *)bytes, sizeof(Kept))) return "a state whose bytes are damaged";
  memcpy(&read, bytes, sizeof read);
  if (read.phase < INSTANTIATED || read.phase > TERMINATED || !(fabs(read.time) <= LATEST)) return "a state that is none";
  if (*state == NULL) *state = (Kept *)malloc(sizeof(Kept));
  if (*state == NULL) return "memory for a state";
  memcpy(*state, bytes, sizeof(Kept));
  return NULL;
}

static int advance(Instance *i, double time, double step) {
  const char *wrong = NULL;
  if (i->phase != STEPPING) wrong = "the instance is not initialized";
  else if (!isfinite(time) || !isfinite(step) || !isfinite(time + step)) wrong = "time and step have to be finite numbers";
  else if (step < 0.0) wrong = "the step is negative";
  else if (fabs(time) > LATEST || step > LATEST) wrong = "time and step may be 1e9 s at most";
  else if (time + step > i->stop + STOP_ROUNDING * (fabs(i->stop) + step)) wrong = "the step ends after the stop time";
  else if (time < i->time - STOP_ROUNDING * (fabs(i->time) + step)) wrong = "the step begins before the last one has ended";
  else wrong = model_step(&i->model, time, step);
  if (wrong != NULL) {
    snprintf(i->message, sizeof i->message, "at %.6g s: %s", time, wrong);
    return 0;
  }
  i->time = time + step;
#if HAS_TIME
  i->model.real[0] = i->time;
#endif
  return 1;
}
