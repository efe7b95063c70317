/* ${title}: the position of another sensor held against it; ramsight ${version}, machine ${machine}.
 *
 * Call ${p}_compare_step after each ${p}_step, with what that says and with what the other sensor shows. */
#ifndef ${P}_COMPARE_H
#define ${P}_COMPARE_H

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
${verdicts}
} ${p}_verdict;

typedef struct {
  double set[${sets}], kept[${states}];
} ${p}_compare;

/* tolerance: of the other sensor, by its data sheet and mounting [m]; time_to_alert: for which both have to be apart
 * before one of them is said to be wrong [s]. */
void ${p}_compare_init(${p}_compare *c, double tolerance, double time_to_alert);

/* time [s], increasing; position and position_bound [m] and status as the virtual sensor says them; other: position by
 * the other sensor [m], NaN where it shows none. */
${p}_verdict ${p}_compare_step(${p}_compare *c, double time, double position, double position_bound, int status, double other);

#ifdef __cplusplus
}
#endif

#endif
