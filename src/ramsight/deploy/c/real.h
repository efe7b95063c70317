/* What functions made from graphs are written in: real and wide are both doubles here. */
#include <math.h>
typedef double real;
typedef double wide;
#if !defined __cplusplus
#define RESTRICT restrict
#elif defined __GNUC__ || defined _MSC_VER
#define RESTRICT __restrict
#else
#define RESTRICT
#endif
#define R(x) ((real)(x))
#define SQRT sqrt
#define EXP exp
#define LOG log
#define TANH tanh
#define POW pow
#define ABS fabs
#define SIN sin
#define COS cos
#define ATAN2 atan2
#define FLOOR floor
#define CEIL ceil
