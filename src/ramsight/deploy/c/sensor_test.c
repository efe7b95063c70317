/* Runs ${p} over the golden samples, compares with what Python said, and tells how long a step takes.
 *   cc -std=c99 -O2 ${p}.c ${p}_step_?*.c ${p}_test.c -lm -o ${p}_test && ./${p}_test
 * For a sensor of floats add -D${P}_FLOAT=1. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "${p}.h"
#include "${p}_golden.h"

#if ${P}_FLOAT
#define ALLOWED 0.05e-3   /* m, of position and standard deviation */
#define OTHER_STATUSES ${other} /* a pressure at a threshold is judged a sample early or late */
#else
#define ALLOWED 1e-9
#define OTHER_STATUSES 0
#endif
#ifndef ROUNDS
#define ROUNDS 400
#endif

/* How the sensor compares with the golden samples. */
typedef struct {
  double largest; /* difference of position or standard deviation [m] */
  int missing;    /* values that are no finite numbers where there should be one, or the other way round */
  int statuses;   /* that are others */
} findings;

static void compare(findings *found, double said, double expected, int exact) {
  if (!(fabs(said) <= 1e30) != !(fabs(expected) <= 1e30)) found->missing++;
  else if (exact && fabs(said - expected) > found->largest) found->largest = fabs(said - expected);
}

static findings run(${p} *sensor) {
  ${p}_inputs in;
  ${p}_outputs out;
  findings found = {0.0, 0, 0};
  found.missing += !${p}_start(sensor, (${p}_real)golden_start, (${p}_real)golden_std);
  for (int k = 0; k < GOLDEN; k++) {
    const double *sample = golden_in[k], *expected = golden_out[k];
    in.time = sample[0];
    in.motor_speed = (${p}_real)sample[1];
    in.motor_torque = (${p}_real)sample[2];
    in.oil_temperature = (${p}_real)sample[3];
${further}    ${p}_reference(sensor, (${p}_real)sample[4]);
    ${p}_step(sensor, &in, &out);
    compare(&found, (double)out.position, expected[0], 1);
    compare(&found, (double)out.position_std, expected[1], 1);
    compare(&found, (double)out.velocity, expected[2], 0);
    compare(&found, (double)out.load, expected[3], 0);
    found.statuses += (int)out.status != (int)expected[4];
  }
  return found;
}

#define INSTANCE UINT32_C(7)
static unsigned char slots[2][${P}_BYTES];

static int kept(${p} *sensor, int starts) {
  static unsigned char bytes[${P}_BYTES];
  const int slot = ${p}_keep(sensor, starts, bytes);
  if (slot >= 0) memcpy(slots[slot], bytes, sizeof bytes);
  return slot;
}

/* Rest at the middle of the stroke for two seconds, as the golden samples begin; returns the newest slot. */
static int rest(${p} *sensor) {
  ${p}_inputs in;
  ${p}_outputs out;
  int newest = -1;
  if (!${p}_start(sensor, (${p}_real)(0.5 * ${P}_STROKE), (${p}_real)0.001)) return -1;
  in.motor_speed = 0;
  in.motor_torque = (${p}_real)golden_in[0][2];
  in.oil_temperature = (${p}_real)golden_in[0][3];
${resting}  for (int k = 0; k < 100; k++) {
    in.time = 0.02 * k;
    ${p}_step(sensor, &in, &out);
    const int slot = kept(sensor, 0);
    if (slot >= 0) newest = slot;
  }
  return newest;
}

static int slots_work(const ${p} *used) {
  static ${p} sensor, back;
  sensor = *used;
  sensor.slots.instance = INSTANCE;
  if (kept(&sensor, 1) == kept(&sensor, 1) || kept(&sensor, 1) >= 0) return 0; /* two at first, then none */
  if (${p}_resume(&back, INSTANCE, slots[0], slots[1]) != ${P}_MOVED || back.position_known != 0) return 0;
  const int newest = rest(&sensor);
  if (newest < 0) /* a piston that the pump holds up does not rest while the motor stands */
    return ${p}_resume(&back, INSTANCE, slots[0], slots[1]) == ${P}_MOVED && back.position_known == 0;
  if (kept(&sensor, 0) >= 0) return 0;
  if (${p}_resume(&back, INSTANCE, slots[0], slots[1]) != ${P}_RESUMED || !(fabs((double)(back.position - sensor.position)) < 1e-6)) return 0;
  if (sensor.referenced_since_power_up != 1 || back.referenced_since_power_up != 0) return 0;
  if (${p}_resume(&back, INSTANCE + 1u, slots[0], slots[1]) != ${P}_NOTHING || back.position_known != 0) return 0;
  slots[newest][16] ^= 1u;
  if (${p}_resume(&back, INSTANCE, slots[0], slots[1]) != ${P}_OLDER || back.position_known != 0) return 0;
  slots[1 - newest][16] ^= 1u;
  return ${p}_resume(&back, INSTANCE, slots[0], slots[1]) == ${P}_NOTHING;
}

int main(void) {
  static ${p} sensor;
  ${p}_init(&sensor);
  const findings found = run(&sensor);
  const int work = slots_work(&sensor);
  const clock_t begin = clock();
  for (int k = 0; k < ROUNDS; k++) run(&sensor);
  const double seconds = (double)(clock() - begin) / CLOCKS_PER_SEC;
  const int good = found.largest <= ALLOWED && !found.missing && found.statuses <= OTHER_STATUSES && work;
  printf("%d samples: largest difference %.2g m (allowed %.2g m), %d missing, %d other statuses (allowed %d), "
         "slots %s, %.0f ns a step: %s\n",
         GOLDEN, found.largest, ALLOWED, found.missing, found.statuses, OTHER_STATUSES, work ? "good" : "BAD",
         1e9 * seconds / ROUNDS / GOLDEN, good ? "passed" : "FAILED");
  return !good;
}
