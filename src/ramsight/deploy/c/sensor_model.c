/* The virtual sensor as an FMU: a step from t takes the inputs as the sample at t, and its outputs are what the sensor
 * says after it. */
#include "fmu.h"

#include <math.h>
#include <string.h>

const char *const causality = "${causality}";

void model_start(Model *m) {
${starts}
}

void model_unknown(Model *m) {
  m->whole[0] = (int)${P}_NOT_REFERENCED;
  m->whole[1] = ${unknown}; /* of what stands behind the sensor, if it has one */
}

static void say(Model *m, const ${p}_outputs *out) {
${says}
  m->whole[0] = (int)out->status;
}

const char *model_initialize(Model *m) {
  ${p} *s = &m->memory.sensor;
  ${p}_outputs out;
${machine}  memset(&out, 0, sizeof out);
  ${p}_init(s);
  if (m->truth[START_KNOWN] && !${p}_start(s, m->real[START_POSITION], m->real[START_STD]))
    return "start_position and start_std have to be finite, and from 0 to the stroke (${stroke})";
  out.position = m->truth[START_KNOWN] ? s->position : (double)NAN;
  out.position_std = m->truth[START_KNOWN] ? sqrt(s->${variance}) : (double)NAN;
  out.status = m->truth[START_KNOWN] ? ${P}_OK : ${P}_NOT_REFERENCED;
${factors}
${began}  say(m, &out);
  return NULL;
}

const char *model_step(Model *m, double time, double step) {
  ${p}_inputs in;
  ${p}_outputs out;
  (void)step;
${again}  in.time = time;
  in.motor_speed = m->real[MOTOR_SPEED];
  in.motor_torque = m->real[MOTOR_TORQUE];
  in.oil_temperature = m->real[OIL_TEMPERATURE];
${further}  ${p}_reference(&m->memory.sensor, m->truth[REFERENCE_KNOWN] ? m->real[REFERENCE] : (double)NAN);
${referred}  ${p}_step(&m->memory.sensor, &in, &out);
${driven}  say(m, &out);
  return NULL;
}
