# mypy: ignore-errors
"""The adaptive loop around a Rosenbrock step. Its source is copied into each generated module and compiled there.

The names `N`, `NU`, `NJ`, `NW`, `NQ`, `CORNER_STEP` and the functions `prepare`, `begin`, `rhs_jacobian`, `factor`,
`stage_0` ... `stage_5`, `finish`, `conclude`, `dense` are the generated module's own; the other functions here are
written out where they are called (`engine/llvm_loop.py`).
"""

# ruff: noqa: F821
import numpy as np

DONE, PAUSED, TOO_SMALL, NOT_FINITE = 0, 1, 2, 3

# places in `progress`: what a paused run carries on with
SEGMENT, TIME, STEP, REJECTED, ACCEPTED, REFUSED, SAMPLE, RECORDED, BAD_STATE = range(9)
SLOTS = 9


def integrate(
    segments, slopes, parameters, rtol, atol, max_step, y, progress, budget, sample_t, sample_y, step_t, step_y
):
    """Advance `y` through the segments until done, out of `budget` steps, or stuck; returns one of the codes above.

    segments: (n, 2 + NU) start, end and input values at the start; slopes: (n, NU); parameters: (n or 1, NP).
    sample_y (n_samples, N) is filled by interpolation at the times sample_t; step_y (capacity, N) by accepted steps.
    """
    k0, k1, k2, k3, k4, k5 = np.empty(N), np.empty(N), np.empty(N), np.empty(N), np.empty(N), np.empty(N)
    f, ft, y0, y1 = np.empty(N), np.empty(N), np.empty(N), np.empty(N)
    jac, w, q, u0 = np.empty(NJ), np.empty(NW), np.empty(NQ), np.empty(NU)
    t, t0, t1, h, c = np.empty(1), np.empty(1), np.empty(1), np.empty(1), np.empty(1)
    error, rejected, h_next = np.empty(1), np.empty(1), np.empty(1)
    relative, longest = np.full(1, rtol), np.full(1, max_step)
    capacity = step_t.shape[0]
    first = int(progress[SEGMENT])
    for s in range(first, segments.shape[0]):
        t0[0], t1[0] = segments[s, 0], segments[s, 1]
        prepare(parameters[min(s, parameters.shape[0] - 1)], q)
        t[0] = max(progress[TIME], t0[0]) if s == first else t0[0]
        rejected[0], h_next[0] = progress[REJECTED], progress[STEP]
        fresh = True
        while t[0] < t1[0]:
            if progress[ACCEPTED] + progress[REFUSED] >= budget or (capacity > 0 and progress[RECORDED] >= capacity):
                progress[SEGMENT], progress[TIME] = s, t[0]
                progress[STEP], progress[REJECTED] = h_next[0], rejected[0]
                return PAUSED
            begin(t, t0, t1, h_next, longest, segments[s, 2:], slopes[s], h, c, u0)
            if fresh or rejected[0] == 0.0:
                fresh = False
                rhs_jacobian(y, u0, slopes[s], q, f, jac, ft)
            factor(jac, c, w)
            stage_0(f, ft, h, w, k0)
            stage_1(y, u0, slopes[s], q, h, ft, w, k0, k1)
            stage_2(y, u0, slopes[s], q, h, ft, w, k0, k1, k2)
            stage_3(y, u0, slopes[s], q, h, ft, w, k0, k1, k2, k3)
            stage_4(y, u0, slopes[s], q, h, ft, w, k0, k1, k2, k3, k4)
            stage_5(y, u0, slopes[s], q, h, ft, w, k0, k1, k2, k3, k4, k5)
            finish(y, k0, k1, k2, k3, k4, k5, atol, relative, y1, error)
            before = t[0]
            for i in range(N):
                y0[i] = y[i]
            conclude(y, y1, error, h, t, t1, h_next, rejected)
            if rejected[0] == 0.0:
                sample(before, t, h, y0, y1, k0, k1, k2, k3, k4, progress, sample_t, sample_y)
                progress[ACCEPTED] += 1
                if capacity > 0:
                    record(t, y, progress, step_t, step_y)
            else:
                progress[REFUSED] += 1
                if h_next[0] < 1e-14 * max(abs(t1[0]), 1.0):
                    progress[SEGMENT], progress[TIME] = s, t[0]
                    worst, code = -1.0, TOO_SMALL
                    for i in range(N):
                        d = abs(k5[i]) / (atol[i] + rtol * max(abs(y[i]), abs(y1[i])))
                        if not np.isfinite(y1[i]):
                            d, code = np.inf, NOT_FINITE
                        if d > worst:
                            worst, progress[BAD_STATE] = d, i
                    return code
        progress[STEP], progress[REJECTED] = min(h_next[0], CORNER_STEP), 0.0
        progress[SEGMENT] = s + 1
    return DONE


def sample(before, t, h, y0, y1, k0, k1, k2, k3, k4, progress, sample_t, sample_y):
    """The samples within a step that was accepted, from `before` on."""
    share = np.empty(1)
    while progress[SAMPLE] < sample_t.shape[0] and sample_t[int(progress[SAMPLE])] <= t[0]:
        j = int(progress[SAMPLE])
        share[0] = (sample_t[j] - before) / h[0]
        dense(y0, y1, k0, k1, k2, k3, k4, share, sample_y[j])
        progress[SAMPLE] += 1


def record(t, y, progress, step_t, step_y):
    """A step that was accepted."""
    j = int(progress[RECORDED])
    step_t[j] = t[0]
    for i in range(N):
        step_y[j, i] = y[i]
    progress[RECORDED] += 1
