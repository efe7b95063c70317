/* ${title}: what the parts of its step share. Made by ramsight ${version} from the machine "${machine}"; do not edit, export it again. */
#ifndef ${P}_STEP_H
#define ${P}_STEP_H

#include "${p}.h"

#include <math.h>

#if (defined __FINITE_MATH_ONLY__ && __FINITE_MATH_ONLY__) || defined _M_FP_FAST
#error "NaN is a value that is missing: compile without -ffast-math, -ffinite-math-only and /fp:fast"
#endif

typedef ${p}_real real;
typedef double wide;
#define R(x) ((real)(x))
#if ${P}_FLOAT
#define SQRT sqrtf
#define EXP expf
#define LOG logf
#define TANH tanhf
#define POW powf
#define SIN sinf
#define COS cosf
#define ABS fabsf
#else
#define SQRT sqrt
#define EXP exp
#define LOG log
#define TANH tanh
#define POW pow
#define SIN sin
#define COS cos
#define ABS fabs
#endif

/* What some samples alone need is kept short, and out of the way of what all need. */
#if defined __GNUC__
#define RARELY __attribute__((cold))
#else
#define RARELY
#endif

/* The machine. */
${constants}

${alike}/* What parts and functions of a step hand on. */
typedef struct {
${fields}
${each}} ${p}_work;

/* The parts of the step, in order. */
${declared}

#endif
