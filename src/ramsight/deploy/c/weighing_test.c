/* Weighs the lifts of a simulated run with ${p}_weighing and compares with what Python weighs.
 *   cc -std=c99 -O2 ${p}_weighing.c ${p}_weighing_test.c -lm -o ${p}_weighing_test && ./${p}_weighing_test */
#include <math.h>
#include <stdio.h>
#include <time.h>

#include "${p}_weighing.h"
#include "${p}_weighing_golden.h"

#define ALLOWED 1e-6 /* kg */
#ifndef ROUNDS
#define ROUNDS 400
#endif

typedef struct {
  double largest; /* difference of a mass, a total or half a band [kg] */
  int missing;    /* masses that are none where there should be one, or the other way round */
  int others;     /* weighings at other samples, of another quality, or counted otherwise */
} findings;

static void compare(findings *found, double said, double expected) {
  if (!(fabs(said) <= 1e30) != !(fabs(expected) <= 1e30)) found->missing++;
  else if (fabs(said - expected) > found->largest) found->largest = fabs(said - expected);
}

static findings run(${p}_weighing *w) {
  findings found = {0.0, 0, 0};
  int weighed = 0;
  ${p}_weighing_init(w);
  for (int k = 0; k < GOLDEN; k++) {
    const double *row = golden_in[k];
    const ${p}_weighing_inputs at = {${row}};
    const int is_new = ${p}_weighing_step(w, &at);
    if (!is_new) continue;
    if (weighed == WEIGHED) return found.others++, found;
    const double *expected = golden_weighed[weighed++];
    found.others += k != (int)expected[0] || is_new != (int)expected[1] || (int)w->quality != (int)expected[2];
    found.others += w->count != (int)expected[3] || w->cycle != (int)expected[4] || w->cycles != (int)expected[5];
    compare(&found, w->mass, expected[6]);
    compare(&found, w->half_band, expected[7]);
    compare(&found, w->total, expected[8]);
    compare(&found, w->total_half_band, expected[9]);
    compare(&found, w->rated_share, expected[10]);
  }
  found.others += weighed != WEIGHED;
  return found;
}

int main(void) {
  static ${p}_weighing w;
  const findings found = run(&w);
  const clock_t begin = clock();
  for (int k = 0; k < ROUNDS; k++) run(&w);
  const double seconds = (double)(clock() - begin) / CLOCKS_PER_SEC;
  const int good = found.largest <= ALLOWED && !found.missing && !found.others;
  printf("%d weighings in %d samples: largest difference %.2g kg (allowed %.2g kg), %d missing, %d others, "
         "%.0f ns a step: %s\n",
         WEIGHED, GOLDEN, found.largest, ALLOWED, found.missing, found.others, 1e9 * seconds / ROUNDS / GOLDEN,
         good ? "passed" : "FAILED");
  return !good;
}
