/* ${title}: what the machine lifts, weighed from what its sensors say.
 *
 * Made by ramsight ${version} from the machine "${machine}"; do not edit, export it again.
 * In doubles in either precision of the sensor. C99, libm alone: no memory is taken, nothing is global.
 * It is no scale for trade, and no safety function.
 *
 *   static ${p}_weighing weighing;
 *   ${p}_weighing_inputs at;
 *   ${p}_weighing_init(&weighing);             // at power-up: level, and the scale of the description
 *   for (;;) {                                 // every sample of the drive
 *     ${p}_step(&sensor, &in, &out);
 *     ${p}_weighing_sense(&at, &in, &out);
${example} *     if (${p}_weighing_step(&weighing, &at)) ...   // weighing.mass, .half_band, .quality, .total
 *   }
 */
#ifndef ${P}_WEIGHING_H
#define ${P}_WEIGHING_H

#include "${p}.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Whether a mass may be used, and if not why. */
typedef enum {
${qualities}
} ${p}_quality;

/* What sensors say at a sample. */
typedef struct {
${inputs}
} ${p}_weighing_inputs;

/* All that is known of lifts. */
typedef struct {
  double lift[${lifts}], tally[${tallies}], settings[${settings}];
  double inclination;          /* of the machine, its front up [rad]; yours to set */
  int count;                   /* weighings since power-up; the rest is of the last one */
  int cycle;                   /* which cycle it is of; one begins with the first lift after lowering */
  ${p}_quality quality;
  double mass, half_band;      /* mass and half its 95 % band [kg]; NaN where there is none */
  double time, duration;       /* middle and length of steady motion [s] */
  double rated_share, rated_share_half_band; /* load moment over the rated one [1]; NaN where it is unknown */
  int cycles;                  /* cycles in the total */
  double total, total_half_band; /* mass of the cycles, one good weighing of each, and half its 95 % band [kg] */
} ${p}_weighing;

/* Make a weighing of a struct: on level ground, with the scale of the description. */
void ${p}_weighing_init(${p}_weighing *w);

/* Take a scale that known masses have taught (`ramsight weigh --json`): ${terms},
 * and the upper triangle of their covariance, row by row. */
void ${p}_weighing_scale(${p}_weighing *w, const double terms[${count}], const double covariance[${pairs}]);

/* Take over what the sensor of this unit said of a sample. */
void ${p}_weighing_sense(${p}_weighing_inputs *at, const ${p}_inputs *in, const ${p}_outputs *out);

/* A sample: 1 where a lift has just been weighed, 2 where lowering the same load made the last weighing better, else 0. */
int ${p}_weighing_step(${p}_weighing *w, const ${p}_weighing_inputs *at);

/* English words for a quality. */
const char *${p}_quality_text(${p}_quality quality);

#ifdef __cplusplus
}
#endif

#endif
