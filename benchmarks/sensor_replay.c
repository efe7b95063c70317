/* A whole log at once, for comparisons: rows of time, speed, torque, temperature, reference and what else the sensor takes in; all outputs out. */
#include "${p}.h"

void replay(long count, const double *in, double *out, double start, double std) {
  ${p} sensor;
  ${p}_inputs sample;
  ${p}_outputs said;
  ${p}_init(&sensor);
  ${p}_start(&sensor, (${p}_real)start, (${p}_real)std);
  for (long k = 0; k < count; k++, in += ${columns}) {
    sample.time = in[0];
    sample.motor_speed = (${p}_real)in[1];
    sample.motor_torque = (${p}_real)in[2];
    sample.oil_temperature = (${p}_real)in[3];
${further}    ${p}_reference(&sensor, (${p}_real)in[4]);
    ${p}_step(&sensor, &sample, &said);
${copies}
  }
}
