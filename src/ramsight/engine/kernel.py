# mypy: ignore-errors
"""The adaptive loop around a Rosenbrock step. Its source is copied into each generated module and compiled there.

The names `N`, `NU`, `NJ`, `NW`, `NQ`, `STAGES`, `ORDER`, `GAMMA` and the functions `prepare`, `rhs`, `rhs_jacobian`,
`factor`, `solve`, `stages`, `dense` are the generated module's own.
"""

# ruff: noqa: F821
import numpy as np

DONE, PAUSED, TOO_SMALL, NOT_FINITE = 0, 1, 2, 3

# places in `progress`: what a paused run carries on with
SEGMENT, TIME, STEP, REJECTED, ACCEPTED, REFUSED, SAMPLE, RECORDED, BAD_STATE = range(9)


def integrate(
    segments,
    slopes,
    parameters,
    rtol,
    atol,
    max_step,
    y,
    progress,
    budget,
    sample_t,
    sample_y,
    step_t,
    step_y,
):
    """Advance `y` through the segments until done, out of `budget` steps, or stuck; returns one of the codes above.

    segments: (n, 2 + NU) start, end and input values at the start; slopes: (n, NU); parameters: (n or 1, NP).
    sample_y (n_samples, N) is filled by interpolation at the times sample_t; step_y (capacity, N) by accepted steps.
    """
    k = np.zeros((STAGES, N))
    f, ft, g, v, y1 = np.empty(N), np.empty(N), np.empty(N), np.empty(N), np.empty(N)
    jac, w, q = np.empty(NJ), np.empty(NW), np.empty(NQ)
    u0, u, slope = np.empty(NU), np.empty(NU), np.empty(NU)
    c = np.empty(1)
    n_samples, capacity = sample_t.shape[0], step_t.shape[0]
    first = int(progress[SEGMENT])
    for s in range(first, segments.shape[0]):
        start, end = segments[s, 0], segments[s, 1]
        slope[:] = slopes[s]
        prepare(parameters[min(s, parameters.shape[0] - 1)], q)
        if progress[TIME] < start or s > first:
            progress[TIME] = start
        t = progress[TIME]
        rejected = progress[REJECTED] > 0.0
        h_next = min(progress[STEP], max_step)
        span = max(abs(start), abs(end))
        fresh = True
        while t < end:
            if progress[ACCEPTED] + progress[REFUSED] >= budget or (capacity > 0 and progress[RECORDED] >= capacity):
                progress[SEGMENT], progress[TIME], progress[STEP] = s, t, h_next
                progress[REJECTED] = 1.0 if rejected else 0.0
                return PAUSED
            if fresh:
                for i in range(NU):
                    u0[i] = segments[s, 2 + i] + slope[i] * (t - start)
                rhs_jacobian(y, u0, slope, q, f, jac, ft)
                fresh = False
            h, last = h_next, False
            if t + 1.0001 * h >= end:
                h, last = end - t, True
            c[0] = 1.0 / (h * GAMMA)
            factor(jac, c, w)
            stages(y, u0, slope, q, h, f, ft, w, k, v, u, g, y1)
            error, bad = 0.0, -1
            for i in range(N):
                d = k[STAGES - 1, i] / (atol[i] + rtol * max(abs(y[i]), abs(y1[i])))
                if atol[i] < np.inf:
                    error += d * d
                if not np.isfinite(y1[i]) and bad < 0:
                    bad = i
            error = np.sqrt(error / NC)
            if bad >= 0 or not error < 1e10:
                error = 1e10
            factor_h = min(6.0, max(0.2, 0.9 * max(error, 1e-10) ** (-1.0 / ORDER)))
            if error <= 1.0:
                t1 = end if last else t + h
                while progress[SAMPLE] < n_samples and sample_t[int(progress[SAMPLE])] <= t1:
                    j = int(progress[SAMPLE])
                    dense(y, y1, k, (sample_t[j] - t) / h, sample_y[j])
                    progress[SAMPLE] += 1
                y[:] = y1
                t = t1
                progress[ACCEPTED] += 1
                if capacity > 0:
                    j = int(progress[RECORDED])
                    step_t[j] = t
                    step_y[j] = y
                    progress[RECORDED] += 1
                if rejected:
                    factor_h = min(factor_h, 1.0)
                rejected = False
                h_next = min(max(h_next, h * factor_h) if last else h * factor_h, max_step)
                fresh = True
            else:
                progress[REFUSED] += 1
                rejected = True
                h_next = h * factor_h
                if h_next < 1e-14 * max(span, 1.0):
                    progress[SEGMENT], progress[TIME], progress[BAD_STATE] = s, t, bad
                    if bad < 0:
                        worst = 0.0
                        for i in range(N):
                            d = abs(k[STAGES - 1, i]) / (atol[i] + rtol * max(abs(y[i]), abs(y1[i])))
                            if d > worst:
                                worst, progress[BAD_STATE] = d, i
                        return TOO_SMALL
                    return NOT_FINITE
        progress[STEP] = min(h_next, CORNER_STEP)
        progress[REJECTED] = 0.0
        progress[SEGMENT] = s + 1
    return DONE
