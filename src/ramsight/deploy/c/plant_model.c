/* The plant as an FMU with its own solver. Inputs go straight on by their slopes from t through the step. */
#include "fmu.h"
#include "real.h"

${functions}

#include "rodas4.h"

#define MOST_STEPS 10000000L

const char *const causality = "${causality}";
static const double tolerances[N] = {${tolerances}};
static const char is_pressure[N] = {${pressures}}; /* a state of one counts vapour below 0 */
static const int shown[] = {${shown}};

void model_start(Model *m) {
${starts}
}

void model_unknown(Model *m) { (void)m; }

static void say(Model *m, const double *u, const double *slope) {
  double y[NY];
  outputs(m->memory.x, u, slope, m->memory.q, y);
  for (int k = 0; k < N; k++) {
    const double x = m->memory.x[k];
    m->real[FIRST_STATE + k] = is_pressure[k] && x < 0.0 ? 0.0 : x;
  }
  for (size_t k = 0; k < sizeof shown / sizeof shown[0]; k++) m->real[FIRST_OUTPUT + k] = y[shown[k]];
${reached}}

/* The oil's temperature is one of the parameters, and an input here. */
static void warm(Model *m, double p[NP]) {
  const double *from = &m->real[FIRST_PARAMETER];
  for (int k = 0; k < NP; k++) p[k] = k == TEMPERATURE_AMONG ? m->real[OIL_TEMPERATURE] : *from++;
  prepare(p, m->memory.q);
  m->memory.temperature = m->real[OIL_TEMPERATURE];
}

const char *model_initialize(Model *m) {
  double p[NP];
  const double u[NU] = {m->real[MOTOR_SPEED], m->real[LOAD]};
  const double slope[NU] = {m->real[MOTOR_ACCELERATION], m->real[LOAD_RATE]};
  warm(m, p);
  rest(p, &m->real[START_POSITION], u, m->memory.x);
  m->memory.next = FIRST_STEP;
  for (int k = 0; k < NU; k++) m->memory.end[k] = u[k];
  for (int k = 0; k < NU; k++) m->memory.before[k] = slope[k];
  say(m, u, slope);
  for (int k = 0; k < N; k++)
    if (!isfinite(m->memory.x[k])) return "a state at the start is no finite number: see parameters and inputs";
  return NULL;
}

const char *model_step(Model *m, double time, double step) {
  static const int input[NU] = {MOTOR_SPEED, LOAD}, rate[NU] = {MOTOR_ACCELERATION, LOAD_RATE};
  double p[NP], u[NU], slope[NU];
  for (int k = 0; k < NU; k++) {
    u[k] = m->real[input[k]];
    slope[k] = m->sloped[input[k]] ? m->slope[input[k]] : m->real[rate[k]];
    m->sloped[input[k]] = 0;
    if (!isfinite(u[k]) || !isfinite(slope[k])) return "an input is not a finite number";
    /* An input that bends or jumps is a corner. */
    if (fabs(slope[k] - m->memory.before[k]) > 1e-9 * (1.0 + fabs(slope[k])) ||
        fabs(u[k] - m->memory.end[k]) > 1e-9 * (1.0 + fabs(u[k])))
      if (m->memory.next > CORNER_STEP) m->memory.next = CORNER_STEP;
    m->memory.before[k] = slope[k];
  }
  if (!(m->real[OIL_TEMPERATURE] > 0.0)) return "oil_temperature is not above 0 K";
  if (m->real[OIL_TEMPERATURE] != m->memory.temperature) warm(m, p);
  if (!(step > 0.0)) return step == 0.0 ? NULL : "the step is not positive";
  /* Steps begin at 0, so that no resolution is lost late in a run. */
  (void)time;
  const long steps = rodas4(m->memory.x, m->memory.q, u, slope, 0.0, step, &m->memory.next, m->tolerance, tolerances, MOST_STEPS);
  if (steps == TOO_MANY) return "too many steps";
  if (steps < 0) return "the solver's step became too small, or a state is no finite number";
  for (int k = 0; k < NU; k++) m->memory.end[k] = u[k] += slope[k] * step;
  say(m, u, slope);
  return NULL;
}
