# mypy: ignore-errors
"""The adaptive loop for many runs, `W` of them side by side in vector registers. Copied into generated modules.

Each lane has its own time and step; a lane whose run has ended takes the next run from the queue, so that no lane waits
for a slower one. The names `N`, `NU`, `NJ`, `NW`, `NQ`, `W`, `FIRST_STEP`, `CORNER_STEP` and the functions `prepare`
and `dense` (one run) and `begin`, `rhs_jacobian`, `factor`, `stage_0` ... `finish`, `conclude`, `extremes` (all lanes)
are that module's own; the other functions here are written out where they are called (`engine/llvm_loop.py`).
"""

# ruff: noqa: F821
import numpy as np

FINISHED, TOO_MANY, STUCK, GOES_ON, NEXT_SEGMENT = 0, 1, 2, 3, 4
IDLE, EMPTY = -1, -2


def integrate_lanes(
    corners, values, slopes, parameters, segment_of, rtol, atol, max_steps, states, least, most, ended, period,
    sample_of, samples,
):  # fmt: skip
    """Integrate runs to their ends, keeping the final state, the extremes of every state, and samples if there is room.

    corners: (segments, 2) start and end; values, slopes: (segments, NU); parameters: (runs, NP) of one segment each
    or (segments, NP); segment_of: (runs + 1,) first segment of each run;
    states: (runs, N) first states, overwritten by the final ones; least, most: (runs, N); ended: (runs, 4) outcome,
    accepted, rejected, time. samples: (rows, N), states at multiples of the period [s] after a run's start, its rows
    those from sample_of (runs + 1,) on; no rows, no samples.
    """
    runs, sampling = states.shape[0], samples.shape[0] > 0
    per_segment = parameters.shape[0] != runs
    k0, k1, k2, k3, k4 = np.zeros((N, W)), np.zeros((N, W)), np.zeros((N, W)), np.zeros((N, W)), np.zeros((N, W))
    y0, y, y1, low, high = np.zeros((N, W)), np.zeros((N, W)), np.zeros((N, W)), np.zeros((N, W)), np.zeros((N, W))
    q, start_u, slope, tolerance = np.zeros((NQ, W)), np.zeros((NU, W)), np.zeros((NU, W)), np.zeros((N, W))
    t, t0, t1, h, error = np.zeros((1, W)), np.zeros((1, W)), np.ones((1, W)), np.zeros((1, W)), np.zeros((1, W))
    h_next, rejected, relative = np.full((1, W), CORNER_STEP), np.zeros((1, W)), np.full((1, W), rtol)
    run, segment, outcome = np.full(W, EMPTY), np.zeros(W, np.int64), np.zeros(W, np.int64)
    steps, refused, row, before = np.zeros(W, np.int64), np.zeros(W, np.int64), np.zeros(W, np.int64), np.zeros(W)
    for i in range(N):
        for j in range(W):
            tolerance[i, j] = atol[i]
    queued, active, empty = 0, 0, W
    while True:
        # A lane that is empty takes the next run; with none left it copies the first, whose numbers stay harmless.
        for j in range(W if empty > 0 else 0):
            if run[j] != EMPTY:
                continue
            r, run[j] = 0, IDLE
            if queued < runs:
                r, run[j] = queued, queued
                queued, active = queued + 1, active + 1
            segment[j], steps[j], refused[j] = segment_of[r], 0, 0
            h_next[0, j], rejected[0, j] = FIRST_STEP, 0.0
            enter(j, segment[j], corners, values, slopes, t, t0, t1, start_u, slope)
            know(j, segment[j] if per_segment else r, parameters, q)
            stand(j, r, states, y, low, high)
            if sampling and run[j] == r:
                keep_first(j, r, states, sample_of, row, samples)
        empty = 0
        if active == 0:
            break
        attempt(t, t0, t1, h_next, start_u, slope, q, tolerance, relative, y, h, k0, k1, k2, k3, k4, y1, error)
        if sampling:
            remember(t, y, before, y0)
        conclude(y, y1, error, h, t, t1, h_next, rejected)
        extremes(y, low, high)
        for j in range(W):
            r = run[j]
            if r == IDLE:
                t[0, j], h_next[0, j] = t0[0, j], CORNER_STEP
                stand(j, 0, states, y, low, high)
                continue
            if sampling and rejected[0, j] == 0.0 and row[j] < sample_of[r + 1]:
                begun = corners[segment_of[r], 0]
                sample(j, r, begun, period, sample_of, t, before, h, y0, y1, k0, k1, k2, k3, k4, row, samples)
            judge(j, segment_of[r + 1], max_steps, t, t1, h_next, rejected, steps, refused, segment, outcome)
            if outcome[j] == NEXT_SEGMENT:
                segment[j] += 1
                h_next[0, j] = min(h_next[0, j], CORNER_STEP)
                enter(j, segment[j], corners, values, slopes, t, t0, t1, start_u, slope)
                if per_segment:
                    know(j, segment[j], parameters, q)
            elif outcome[j] != GOES_ON:
                if sampling:
                    keep_last(j, r, y, sample_of, row, samples)
                end(j, r, outcome, steps, refused, t, y, low, high, ended, states, least, most)
                run[j], active, empty = EMPTY, active - 1, empty + 1


def enter(j, s, corners, values, slopes, t, t0, t1, start_u, slope):
    """A lane begins a segment."""
    t[0, j] = t0[0, j] = corners[s, 0]
    t1[0, j] = corners[s, 1]
    for i in range(NU):
        start_u[i, j], slope[i, j] = values[s, i], slopes[s, i]


def know(j, place, parameters, q):
    """What a lane's parameters say of all its steps."""
    q1 = np.empty(NQ)
    prepare(parameters[place], q1)
    for i in range(NQ):
        q[i, j] = q1[i]


def stand(j, r, states, y, low, high):
    """A lane is where its run begins."""
    for i in range(N):
        y[i, j] = low[i, j] = high[i, j] = states[r, i]


def attempt(t, t0, t1, h_next, start_u, slope, q, tolerance, relative, y, h, k0, k1, k2, k3, k4, y1, error):
    """A step of all lanes, that is not yet accepted."""
    f, ft, k5, u0, c = np.empty((N, W)), np.empty((N, W)), np.empty((N, W)), np.empty((NU, W)), np.empty((1, W))
    jac, w, longest = np.empty((NJ, W)), np.empty((NW, W)), np.full((1, W), np.inf)
    begin(t, t0, t1, h_next, longest, start_u, slope, h, c, u0)
    rhs_jacobian(y, u0, slope, q, f, jac, ft)
    factor(jac, c, w)
    stage_0(f, ft, h, w, k0)
    stage_1(y, u0, slope, q, h, ft, w, k0, k1)
    stage_2(y, u0, slope, q, h, ft, w, k0, k1, k2)
    stage_3(y, u0, slope, q, h, ft, w, k0, k1, k2, k3)
    stage_4(y, u0, slope, q, h, ft, w, k0, k1, k2, k3, k4)
    stage_5(y, u0, slope, q, h, ft, w, k0, k1, k2, k3, k4, k5)
    finish(y, k0, k1, k2, k3, k4, k5, tolerance, relative, y1, error)


def judge(j, end_of, max_steps, t, t1, h_next, rejected, steps, refused, segment, outcome):
    """What becomes of a lane's run after a step; `end_of` is the segment behind its last one."""
    steps[j] += 1
    outcome[j] = GOES_ON if steps[j] < max_steps else TOO_MANY
    if rejected[0, j] > 0.0:
        refused[j] += 1
        if h_next[0, j] < 1e-14 * max(abs(t1[0, j]), 1.0) and steps[j] < max_steps:
            outcome[j] = STUCK
    elif t[0, j] >= t1[0, j]:
        outcome[j] = NEXT_SEGMENT if segment[j] + 1 < end_of else FINISHED


def end(j, r, outcome, steps, refused, t, y, low, high, ended, states, least, most):
    """What is kept of a lane's run."""
    ended[r, 0], ended[r, 1], ended[r, 2], ended[r, 3] = outcome[j], steps[j] - refused[j], refused[j], t[0, j]
    for i in range(N):
        states[r, i], least[r, i], most[r, i] = y[i, j], low[i, j], high[i, j]


def remember(t, y, before, y0):
    """Where the lanes are before a step, for samples within it."""
    for j in range(W):
        before[j] = t[0, j]
    for i in range(N):
        for j in range(W):
            y0[i, j] = y[i, j]


def keep_first(j, r, states, sample_of, row, samples):
    """The sample at a run's beginning."""
    row[j] = sample_of[r]
    if row[j] < sample_of[r + 1]:
        for i in range(N):
            samples[row[j], i] = states[r, i]
        row[j] += 1


def sample(j, r, begun, period, sample_of, t, before, h, y0, y1, k0, k1, k2, k3, k4, row, samples):
    """The samples within a step that was accepted."""
    a0, a1, share = np.empty(N), np.empty(N), np.empty(1)
    b0, b1, b2, b3, b4 = np.empty(N), np.empty(N), np.empty(N), np.empty(N), np.empty(N)
    if begun + (row[j] - sample_of[r]) * period <= t[0, j]:
        for i in range(N):
            a0[i], a1[i] = y0[i, j], y1[i, j]
            b0[i], b1[i], b2[i], b3[i], b4[i] = k0[i, j], k1[i, j], k2[i, j], k3[i, j], k4[i, j]
    while row[j] < sample_of[r + 1]:
        at = begun + (row[j] - sample_of[r]) * period
        if at > t[0, j]:
            break
        share[0] = (at - before[j]) / h[0, j]
        dense(a0, a1, b0, b1, b2, b3, b4, share, samples[row[j]])
        row[j] += 1


def keep_last(j, r, y, sample_of, row, samples):
    """A last sample that rounding puts behind the end."""
    while row[j] < sample_of[r + 1]:
        for i in range(N):
            samples[row[j], i] = y[i, j]
        row[j] += 1
