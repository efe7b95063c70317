/* The adaptive Rodas4 loop, as in the engine, around functions made from the plant's graph. */
#include <string.h>

#define FIRST_STEP 1e-4  /* s; of a run */
#define CORNER_STEP 1e-3 /* s; the first after a corner of the inputs */

enum { TOO_SMALL = -1, TOO_MANY = -2 };

/* Advance y from t0 to t1 with inputs that begin at `value` and go straight on by `slope` [1/s]; parameters are in q.
 * Returns the number of steps, or one of the codes above; h_next [s] is the step to begin and to go on with. */
static long rodas4(real *y, const real *q, const real *value, const real *slope, real t0, real t1, real *h_next,
                   real rtol, const real *atol, long most) {
  real f[N] = {0}, ft[N] = {0}, jac[NJ] = {0}, w[NW], y1[N], yn[N], u[NU], k0[N], k1[N], k2[N], k3[N], k4[N], k5[N];
  real h, c, error, rejected = 0.0, tn, hn, rn, t = t0;
  const real longest = INFINITY;
  int fresh = 1;
  long steps = 0;
  while (t < t1) {
    begin(&t, &t0, &t1, h_next, &longest, value, slope, &h, &c, u);
    if (fresh || rejected == 0.0) rhs_jacobian(y, u, slope, q, f, jac, ft);
    fresh = 0;
    factor(jac, &c, w);
    stage_0(f, ft, &h, w, k0);
    stage_1(y, u, slope, q, &h, ft, w, k0, k1);
    stage_2(y, u, slope, q, &h, ft, w, k0, k1, k2);
    stage_3(y, u, slope, q, &h, ft, w, k0, k1, k2, k3);
    stage_4(y, u, slope, q, &h, ft, w, k0, k1, k2, k3, k4);
    stage_5(y, u, slope, q, &h, ft, w, k0, k1, k2, k3, k4, k5);
    finish(y, k0, k1, k2, k3, k4, k5, atol, &rtol, y1, &error);
    conclude(y, y1, &error, &h, &t, &t1, h_next, &rejected, yn, &tn, &hn, &rn);
    memcpy(y, yn, sizeof yn);
    t = tn;
    *h_next = hn;
    rejected = rn;
    if (++steps > most) return TOO_MANY;
    if (!(*h_next >= 1e-14 * (t1 > 1.0 ? t1 : 1.0))) return TOO_SMALL;
  }
  return steps;
}
