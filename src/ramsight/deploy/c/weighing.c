/* ${title}. Made by ramsight ${version} from the machine "${machine}"; do not edit, export it again. */
#include "${p}_weighing.h"

#include <string.h>

#if (defined __FINITE_MATH_ONLY__ && __FINITE_MATH_ONLY__) || defined _M_FP_FAST
#error "NaN is a position that is not known: compile without -ffast-math, -ffinite-math-only and /fp:fast"
#endif

${real}
#define HALF_BAND ${half} /* standard deviations */

${lift}

${tally}

void ${p}_weighing_init(${p}_weighing *w) {
  static const double lift_start[${lifts}] = {${lift_initial}};
  static const double tally_start[${tallies}] = {${tally_initial}};
  static const double described[${settings}] = {${described}};
  memset(w, 0, sizeof *w);
  memcpy(w->lift, lift_start, sizeof lift_start);
  memcpy(w->tally, tally_start, sizeof tally_start);
  memcpy(w->settings, described, sizeof described);
  w->quality = ${P}_QUALITY_NONE;
  w->mass = w->half_band = w->rated_share = w->rated_share_half_band = (double)NAN;
}

void ${p}_weighing_scale(${p}_weighing *w, const double terms[${count}], const double covariance[${pairs}]) {
  memcpy(w->settings + ${scale_at}, terms, ${count} * sizeof *terms);
  memcpy(w->settings + ${scale_at} + ${count}, covariance, ${pairs} * sizeof *covariance);
}

void ${p}_weighing_sense(${p}_weighing_inputs *at, const ${p}_inputs *in, const ${p}_outputs *out) {
  const double half = 0.5 * ((double)out->position_high - (double)out->position_low);
  at->time = in->time;
  at->${unit}_position = (int)out->status < ${invalid} ? (double)out->position : (double)NAN;
  at->${unit}_velocity = (double)out->velocity;
  at->${unit}_std = half / HALF_BAND;
  at->load = (double)out->load;
  at->load_std = (double)out->load_std;
  at->load_age = (double)out->load_age;
}

int ${p}_weighing_step(${p}_weighing *w, const ${p}_weighing_inputs *at) {
  const double u[] = {${row}};
  double complete[1], points[${points}], found[${found}] = {0.0}; /* where a block ends, the mechanism's laws are asked */
  where(w->lift, u, &w->inclination, complete, points);
  if (complete[0] > 0.0) {
${lookups}
  }
  double next[${lifts}], ended[${ended}];
  lift(w->lift, u, &w->inclination, found, next, ended);
  memcpy(w->lift, next, sizeof next);
  if (!(ended[0] > 0.0)) return 0;
  double after[${tallies}], said[${said}];
  tally(w->tally, ended + 1, w->settings, after, said);
  memcpy(w->tally, after, sizeof after);
  w->count = (int)said[${o_count}];
  w->cycles = (int)said[${o_cycles}];
  w->total = said[${o_total}];
  w->total_half_band = HALF_BAND * said[${o_total_std}];
  if (!(said[${o_new}] > 0.0)) return 0;
  w->cycle = (int)said[${o_cycle}];
  w->quality = (${p}_quality)(int)said[${o_quality}];
  w->mass = said[${o_mass}];
  w->half_band = HALF_BAND * said[${o_std}];
  w->time = said[${o_time}];
  w->duration = said[${o_duration}];
  w->rated_share = said[${o_share}];
  w->rated_share_half_band = HALF_BAND * said[${o_share_std}];
  return (int)said[${o_new}];
}

const char *${p}_quality_text(${p}_quality quality) {
  switch (quality) {
${texts}
  }
  return "";
}
