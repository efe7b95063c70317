/* Reciprocal throughput of vector operations on doubles: time of one on LANES numbers, operations that do not wait for
   each other. Each kernel has 12 chains, more than latency times units of any processor; an empty asm keeps the
   compiler from leaving any of them out. */

#include <time.h>

#ifdef __AVX512F__
#define LANES 8
#else
#define LANES 4
#endif

typedef double real __attribute__((vector_size(8 * LANES)));
typedef long bits __attribute__((vector_size(8 * LANES)));

#define KEEP(x) __asm__ volatile("" : "+v"(x))
#define EACH(what) { what(0) what(1) what(2) what(3) what(4) what(5) what(6) what(7) what(8) what(9) what(10) what(11) }

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

#define START(i) x[i] = (real){0} + 1.0 + 1e-3 * i; KEEP(x[i]);
#define DONE(i) KEEP(x[i]);
#define KERNEL(name, what)                                                                                             \
    double name(long rounds)                                                                                           \
    {                                                                                                                  \
        real x[12], a = (real){0} + 1.0 + 1e-9, b = (real){0} + 1e-12;                                                 \
        EACH(START)                                                                                                    \
        KEEP(a);                                                                                                       \
        KEEP(b);                                                                                                       \
        double begun = now();                                                                                          \
        for (long k = 0; k < rounds; k++)                                                                              \
            EACH(what)                                                                                                 \
        double spent = now() - begun;                                                                                  \
        EACH(DONE)                                                                                                     \
        return spent / (12.0 * rounds);                                                                                \
    }

#define ADD(i) x[i] = x[i] + b; KEEP(x[i]);
#define MULTIPLY(i) x[i] = x[i] * a; KEEP(x[i]);
#define FUSED(i) x[i] = x[i] * a + b; KEEP(x[i]);
#define DIVIDE(i) x[i] = a / x[i]; KEEP(x[i]);
#define ROOT(i) for (int j = 0; j < LANES; j++) x[i][j] = __builtin_sqrt(x[i][j]); KEEP(x[i]);
#define EITHER(i) if (i % 2) { ADD(i) } else { MULTIPLY(i) }
#define CHOOSE(i) { bits larger = x[i] > a; x[i] = (real)((larger & (bits)b) | (~larger & (bits)x[i])); KEEP(x[i]); }

KERNEL(add, ADD)
KERNEL(multiply, MULTIPLY)
KERNEL(fused, FUSED)
KERNEL(divide, DIVIDE)
KERNEL(root, ROOT)
KERNEL(choose, CHOOSE)
KERNEL(either, EITHER)

int lanes(void) { return LANES; }
