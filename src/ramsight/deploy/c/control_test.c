/* Runs ${p}_control over a recorded run and compares with what Python's control asked for.
 *   cc -std=c99 -O2 ${p}_control.c ${p}_control_test.c -lm -o ${p}_control_test && ./${p}_control_test */
#include <math.h>
#include <stdio.h>
#include <time.h>

#include "${p}_control.h"
#include "${p}_control_golden.h"

#define ALLOWED 1e-9 /* of the largest motor speed */
#ifndef ROUNDS
#define ROUNDS 400
#endif

typedef struct {
  double largest; /* difference, over the largest motor speed */
  int missing;    /* speeds that are no finite numbers */
  int activities; /* that are others, or other stops that were pressed */
} findings;

static findings run(${p}_control *control) {
  findings found = {0.0, 0, 0};
  ${p}_control_init(control);
  for (int k = 0; k < GOLDEN; k++) {
    const double *row = golden_in[k];
    const ${p}_control_inputs order = {${row}};
    const double speed = ${p}_control_step(control, &order);
    const double off = fabs(speed - golden_out[k][0]) / FASTEST;
    if (!(off <= 1e30)) found.missing++;
    else if (off > found.largest) found.largest = off;
    found.activities += (int)control->activity != (int)golden_out[k][1];
    found.activities += (control->reference >= 0.0) != (golden_out[k][2] >= 0.0);
    found.activities += control->reference < golden_out[k][2] || control->reference > golden_out[k][2];
  }
  return found;
}

int main(void) {
  static ${p}_control control;
  const findings found = run(&control);
  const clock_t begin = clock();
  for (int k = 0; k < ROUNDS; k++) run(&control);
  const double seconds = (double)(clock() - begin) / CLOCKS_PER_SEC;
  const int good = found.largest <= ALLOWED && !found.missing && !found.activities;
  printf("%d samples of the control: largest difference %.2g (allowed %.2g), %d missing, %d other activities, "
         "%.0f ns a step: %s\n",
         GOLDEN, found.largest, ALLOWED, found.missing, found.activities, 1e9 * seconds / ROUNDS / GOLDEN,
         good ? "passed" : "FAILED");
  return !good;
}
