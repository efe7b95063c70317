/* What an FMU's interface and its model know of each other. All variables have one number, reals first. */
#ifndef FMU_H
#define FMU_H

#include "fmu_config.h"

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
  double real[REALS];
  int whole[WHOLES + 1]; /* enumerations; never an empty array */
  int truth[TRUTHS + 1];
  double slope[REALS]; /* of inputs through the next step, where an importer gives them */
  int sloped[REALS];
  double tolerance;
  Memory memory;
} Model;

/* 'i' input, 'p' parameter, 'o' output or time; of each variable. */
extern const char *const causality;

/* Start values. */
void model_start(Model *model);

/* What enumerations say before anything is known. */
void model_unknown(Model *model);

/* What follows from parameters and inputs at the start, outputs included; may be called again and again. Returns what is
 * wrong, or NULL. */
const char *model_initialize(Model *model);

/* Go on from `time` [s] by `step` [s]; returns what is wrong, or NULL. */
const char *model_step(Model *model, double time, double step);

#ifdef __cplusplus
}
#endif

#endif
