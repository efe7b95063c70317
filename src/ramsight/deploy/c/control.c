/* ${title}. Made by ramsight ${version} from the machine "${machine}"; do not edit, export it again. */
#include "${p}_control.h"

#include <string.h>

#if (defined __FINITE_MATH_ONLY__ && __FINITE_MATH_ONLY__) || defined _M_FP_FAST
#error "NaN is a target that is none: compile without -ffast-math, -ffinite-math-only and /fp:fast"
#endif

${real}
${advance}

void ${p}_control_init(${p}_control *control) {
  static const double start[${states}] = {${initial}};
  memcpy(control->x, start, sizeof start);
  control->activity = ${P}_RESTING;
  control->reason = ${P}_REASON_NONE;
  control->reference = (double)NAN;
}

void ${p}_control_refer(const ${p}_control *control, ${p} *sensor) {
  if (control->reference >= 0.0) sensor->reference = (${p}_real)control->reference;
}

void ${p}_control_sense(${p}_control_inputs *order, const ${p} *sensor, const ${p}_inputs *in, const ${p}_outputs *out) {
  order->position = (double)out->position;
  order->position_std = (double)out->position_std;
  order->velocity = (double)out->velocity;
  order->load = (double)out->load;
  order->status = (double)out->status;
  order->oil_temperature = (double)in->oil_temperature;
  order->leak = (double)sensor->${leak};
  order->displacement = (double)sensor->${displacement};
  order->reported = 1.0;
  order->reported_speed = (double)in->motor_speed;
  order->reported_torque = (double)in->motor_torque;
}

double ${p}_control_step(${p}_control *control, const ${p}_control_inputs *order) {
  const double u[] = {${inputs}};
  double out[4];
  double next[${states}];
  advance(control->x, u, next, out);
  memcpy(control->x, next, sizeof next);
  control->activity = (${p}_activity)(int)out[1];
  control->reason = (${p}_reason)(int)out[2];
  control->reference = out[3] >= 0.0 ? out[3] : (double)NAN;
  return out[0];
}

const char *${p}_reason_text(${p}_reason reason) {
  switch (reason) {
${texts}
  }
  return "";
}
