/* The engine's loops in C, around functions emitted from the same graphs (model.h): the exported plant's own, and 8 lanes
 * with a queue. */
#include <math.h>
#include <string.h>
#define N_ N
#define CORNER 1e-3
#if LANES
#include <immintrin.h>
#define RESTRICT restrict
typedef double real __attribute__((vector_size(64)));
typedef long long mask __attribute__((vector_size(64)));
static inline real K(double x) { return (real){x, x, x, x, x, x, x, x}; }
static inline real bits(mask m, real a) { return (real)((mask)a & m); }
static inline real pick(mask m, real a, real b) { return (real)(((mask)a & m) | ((mask)b & ~m)); }
#define LT(a, b) bits((a) < (b), K(1.0))
#define LE(a, b) bits((a) <= (b), K(1.0))
#define NOT(a) bits((a) == K(0.0), K(1.0))
#define AND(a, b) bits(((a) != K(0.0)) & ((b) != K(0.0)), K(1.0))
#define OR(a, b) bits(((a) != K(0.0)) | ((b) != K(0.0)), K(1.0))
#define CHOOSE(c, a) bits((c) != K(0.0), a)
#define MAX(a, b) pick((a) >= (b), a, b)
#define MIN(a, b) pick((a) <= (b), a, b)
#if defined(__AVX512F__)
real _ZGVeN8v_exp(real); real _ZGVeN8v_log(real); real _ZGVeN8v_tanh(real);
#define EXP _ZGVeN8v_exp
#define LOG _ZGVeN8v_log
#define TANH _ZGVeN8v_tanh
#define SQRT(a) ((real)_mm512_sqrt_pd((__m512d)(a)))
#define ABS(a) ((real)_mm512_abs_pd((__m512d)(a)))
#else
#define EACH(name, f) static inline real name(real a) { real r; for (int l = 0; l < 8; l++) r[l] = f(a[l]); return r; }
EACH(EXP, exp) EACH(LOG, log) EACH(TANH, tanh) EACH(SQRT, sqrt) EACH(ABS, fabs)
#endif
#define POW(a, b) EXP((b) * LOG(a))
#else
#include "real.h"
#endif
#include "model.h"

#if !LANES
#include "rodas4.h"
long integrate(long n, const double *corners, const double *values, const double *slopes, const double *p, double rtol,
               const double *atol, double *y) {
  double q[NQ], h_next = FIRST_STEP;
  long steps = 0;
  prepare(p, q);
  for (long s = 0; s < n; s++) {
    long taken = rodas4(y, q, values + NU * s, slopes + NU * s, corners[2 * s], corners[2 * s + 1], &h_next, rtol, atol,
                        10000000);
    if (taken < 0) return taken;
    steps += taken;
    h_next = h_next < CORNER ? h_next : CORNER;
  }
  return steps;
}
#else
static void one_step(real *y, const real *u0, const real *slope, const real *q, real *f, real *ft, real *jac,
                     const real *h, const real *c, const real *atol, const real *rtol, real *y1, real *error, int fresh) {
  real w[NW], k0[N_], k1[N_], k2[N_], k3[N_], k4[N_], k5[N_];
  if (fresh) rhs_jacobian(y, u0, slope, q, f, jac, ft);
  factor(jac, c, w);
  stage_0(f, ft, h, w, k0);
  stage_1(y, u0, slope, q, h, ft, w, k0, k1);
  stage_2(y, u0, slope, q, h, ft, w, k0, k1, k2);
  stage_3(y, u0, slope, q, h, ft, w, k0, k1, k2, k3);
  stage_4(y, u0, slope, q, h, ft, w, k0, k1, k2, k3, k4);
  stage_5(y, u0, slope, q, h, ft, w, k0, k1, k2, k3, k4, k5);
  finish(y, k0, k1, k2, k3, k4, k5, atol, rtol, y1, error);
}

long integrate_lanes(long runs, long n, const double *corners, const double *values, const double *slopes,
                     const double *p, double rtol_, const double *atol_, double *Y) {
  real y[N_], f[N_], ft[N_], jac[NJ], y1[N_], q[NQ], h, c, u0[NU], us[NU], sl[NU], error, atol[N_], rtol = K(rtol_);
  real t, t0, t1, h_next = K(1e-4), rejected = K(0.0), longest = K(INFINITY);
  real pv[NP];
  long run[8], seg[8], queued = 0, active = 0, steps = 0;
  for (int i = 0; i < N_; i++) atol[i] = K(atol_[i]);
  for (int l = 0; l < 8; l++) run[l] = -2;
  for (;;) {
    int loaded = 0;
    for (int l = 0; l < 8; l++) if (run[l] == -2) {
      long r = queued < runs ? queued : 0;
      run[l] = queued < runs ? queued : -1;
      if (queued < runs) { queued++; active++; }
      seg[l] = 0;
      for (int i = 0; i < N_; i++) y[i][l] = Y[r * N_ + i];
      for (int i = 0; i < NP; i++) pv[i][l] = p[r * NP + i];
      for (int i = 0; i < NU; i++) { us[i][l] = values[(r * n) * NU + i]; sl[i][l] = slopes[(r * n) * NU + i]; }
      t[l] = t0[l] = corners[0]; t1[l] = corners[1]; h_next[l] = 1e-4; rejected[l] = 0.0;
      loaded = 1;
    }
    if (loaded) prepare(pv, q);
    if (!active) return steps;
    real yn[N_], tn, hn, rn;
    begin(&t, &t0, &t1, &h_next, &longest, us, sl, &h, &c, u0);
    one_step(y, u0, sl, q, f, ft, jac, &h, &c, atol, &rtol, y1, &error, 1);
    conclude(y, y1, &error, &h, &t, &t1, &h_next, &rejected, yn, &tn, &hn, &rn);
    memcpy(y, yn, sizeof yn);
    t = tn; h_next = hn; rejected = rn;
    for (int l = 0; l < 8; l++) {
      long r = run[l];
      if (r < 0) { t[l] = t0[l]; h_next[l] = CORNER; continue; }
      steps++;
      if (rejected[l] > 0.0 || t[l] < t1[l]) continue;
      if (++seg[l] < n) {
        long s = seg[l];
        t[l] = t0[l] = corners[2 * s]; t1[l] = corners[2 * s + 1];
        if (h_next[l] > CORNER) h_next[l] = CORNER;
        for (int i = 0; i < NU; i++) { us[i][l] = values[(r * n + s) * NU + i]; sl[i][l] = slopes[(r * n + s) * NU + i]; }
      } else {
        for (int i = 0; i < N_; i++) Y[r * N_ + i] = y[i][l];
        run[l] = -2;
        active--;
      }
    }
  }
}
#endif
