/* Runs ${p} over the golden samples, compares with what Python said, and tells how long a step takes.
 *   cc -std=c99 -O2 ${p}.c ${p}_test.c -lm -o ${p}_test && ./${p}_test
 * For a sensor of floats add -D${P}_FLOAT=1. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "${p}.h"
#include "${p}_golden.h"

#if ${P}_FLOAT
#define ALLOWED 0.05e-3 /* m */
#else
#define ALLOWED 1e-9 /* m */
#endif
#ifndef ROUNDS
#define ROUNDS 400
#endif

static void run(${p} *sensor, double *largest, int *statuses) {
  ${p}_inputs in;
  ${p}_outputs out;
  ${p}_start(sensor, (${p}_real)golden_start, (${p}_real)golden_std);
  for (int k = 0; k < GOLDEN; k++) {
    const double *sample = golden_in[k], *expected = golden_out[k];
    in.time = sample[0];
    in.motor_speed = (${p}_real)sample[1];
    in.motor_torque = (${p}_real)sample[2];
    in.oil_temperature = (${p}_real)sample[3];
    ${p}_reference(sensor, (${p}_real)sample[4]);
    ${p}_step(sensor, &in, &out);
    const double difference = fabs((double)out.position - expected[0]);
    if (!(difference <= *largest)) *largest = difference;
    *statuses += (int)out.status != (int)expected[4];
  }
}

static int slots_work(const ${p} *used) {
  static unsigned char slot[2][${P}_BYTES];
  ${p} sensor = *used, back;
  int first = ${p}_save(&sensor, slot[(sensor.saves + 1u) & 1u]);
  int second = ${p}_save(&sensor, slot[(sensor.saves + 1u) & 1u]);
  if (first == second) return 0;
  if (${p}_resume(&back, slot[0], slot[1]) != ${P}_RESUMED || back.position != sensor.position) return 0;
  slot[second][12] ^= 1u;
  if (${p}_resume(&back, slot[0], slot[1]) != ${P}_OLDER || back.leak != sensor.leak) return 0;
  slot[first][12] ^= 1u;
  return ${p}_resume(&back, slot[0], slot[1]) == ${P}_NOTHING;
}

int main(void) {
  static ${p} sensor;
  ${p}_init(&sensor);
  double largest = 0.0, unused = 0.0;
  int statuses = 0, other = 0;
  run(&sensor, &largest, &statuses);
  const int slots = slots_work(&sensor);
  const clock_t begin = clock();
  for (int k = 0; k < ROUNDS; k++) run(&sensor, &unused, &other);
  const double seconds = (double)(clock() - begin) / CLOCKS_PER_SEC;
  const int good = largest <= ALLOWED && slots;
  printf("%d samples: largest difference %.2g m (allowed %.2g m), %d other statuses, slots %s, %.0f ns a step: %s\n",
         GOLDEN, largest, ALLOWED, statuses, slots ? "good" : "BAD", 1e9 * seconds / ROUNDS / GOLDEN,
         good ? "passed" : "FAILED");
  return !good;
}
