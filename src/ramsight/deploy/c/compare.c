/* ${title}: the position of another sensor held against it; ramsight ${version}, machine ${machine}. */
#include "${p}_compare.h"

#include <string.h>
${real}
${function}

void ${p}_compare_init(${p}_compare *c, double tolerance, double time_to_alert) {
  memset(c, 0, sizeof *c);
  c->set[0] = ${stroke};
  c->set[1] = ${fastest};
  c->set[2] = tolerance;
  c->set[3] = time_to_alert;
}

${p}_verdict ${p}_compare_step(${p}_compare *c, double time, double position, double position_bound, int status, double other) {
  const double u[] = {time, position, position_bound, (double)status, other};
  double kept[${states}], verdict[1];
  advance(c->kept, u, c->set, kept, verdict);
  memcpy(c->kept, kept, sizeof kept);
  return (${p}_verdict)verdict[0];
}
