# mypy: ignore-errors
"""The adaptive loop for many runs, `W` of them side by side in vector registers. Copied into generated modules.

Each lane has its own time and step; a lane whose run has ended takes the next run from the queue, so that no lane waits
for a slower one. The names `N`, `NU`, `NJ`, `NW`, `NQ`, `W`, `FIRST_STEP`, `CORNER_STEP` and the functions `prepare`
and `dense` (one run) and `begin`, `rhs_jacobian`, `factor`, `stage_0` ... `finish`, `conclude`, `extremes` (all lanes)
are that module's own.
"""

# ruff: noqa: F821
import numpy as np

FINISHED, TOO_MANY, STUCK = 0, 1, 2
IDLE, EMPTY = -1, -2


def integrate_lanes(
    corners,
    values,
    slopes,
    parameters,
    segment_of,
    rtol,
    atol,
    max_steps,
    states,
    least,
    most,
    ended,
    period,
    sample_of,
    samples,
):
    """Integrate runs to their ends, keeping the final state, the extremes of every state, and samples if there is room.

    corners: (segments, 2) start and end; values, slopes: (segments, NU); parameters: (runs, NP) of one segment each
    or (segments, NP); segment_of: (runs + 1,) first segment of each run;
    states: (runs, N) first states, overwritten by the final ones; least, most: (runs, N); ended: (runs, 4) outcome,
    accepted, rejected, time. samples: (rows, N), states at multiples of the period [s] after a run's start, its rows
    those from sample_of (runs + 1,) on; no rows, no samples.
    """
    runs = states.shape[0]
    per_segment = parameters.shape[0] != runs
    k0, k1, k2 = np.zeros((N, W)), np.zeros((N, W)), np.zeros((N, W))
    k3, k4, k5 = np.zeros((N, W)), np.zeros((N, W)), np.zeros((N, W))
    f, ft, y, y1 = np.zeros((N, W)), np.zeros((N, W)), np.zeros((N, W)), np.zeros((N, W))
    low, high, tolerance = np.zeros((N, W)), np.zeros((N, W)), np.zeros((N, W))
    jac, w, q = np.zeros((NJ, W)), np.zeros((NW, W)), np.zeros((NQ, W))
    start_u, u0, slope = np.zeros((NU, W)), np.zeros((NU, W)), np.zeros((NU, W))
    c, h, error, relative, longest = (
        np.zeros((1, W)),
        np.zeros((1, W)),
        np.zeros((1, W)),
        np.full((1, W), rtol),
        np.full((1, W), np.inf),
    )
    t, t0, t1 = np.zeros((1, W)), np.zeros((1, W)), np.ones((1, W))
    h_next, rejected = np.full((1, W), CORNER_STEP), np.zeros((1, W))
    run, segment = np.full(W, EMPTY), np.zeros(W, np.int64)
    steps, refused = np.zeros(W, np.int64), np.zeros(W, np.int64)
    q1 = np.empty(NQ)
    sampling = samples.shape[0] > 0
    row, before, y0 = np.zeros(W, np.int64), np.zeros(W), np.zeros((N, W))
    a0, a1, share = np.empty(N), np.empty(N), np.empty(1)
    b0, b1, b2, b3, b4 = np.empty(N), np.empty(N), np.empty(N), np.empty(N), np.empty(N)
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
                queued += 1
                active += 1
            s = segment_of[r]
            prepare(parameters[s if per_segment else r], q1)
            for i in range(NQ):
                q[i, j] = q1[i]
            for i in range(N):
                y[i, j] = low[i, j] = high[i, j] = states[r, i]
            for i in range(NU):
                start_u[i, j], slope[i, j] = values[s, i], slopes[s, i]
            t[0, j] = t0[0, j] = corners[s, 0]
            t1[0, j], segment[j] = corners[s, 1], s
            h_next[0, j], rejected[0, j], steps[j], refused[j] = FIRST_STEP, 0.0, 0, 0
            if sampling and run[j] == r:
                row[j] = sample_of[r]
                if row[j] < sample_of[r + 1]:
                    for i in range(N):
                        samples[row[j], i] = states[r, i]
                    row[j] += 1
        empty = 0
        if active == 0:
            break
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
        if sampling:
            for j in range(W):
                before[j] = t[0, j]
            for i in range(N):
                for j in range(W):
                    y0[i, j] = y[i, j]
        conclude(y, y1, error, h, t, t1, h_next, rejected)
        extremes(y, low, high)
        for j in range(W):
            r = run[j]
            if r == IDLE:
                # An idle lane stands still.
                t[0, j], h_next[0, j] = t0[0, j], CORNER_STEP
                for i in range(N):
                    y[i, j] = states[0, i]
                continue
            steps[j] += 1
            if sampling and rejected[0, j] == 0.0 and row[j] < sample_of[r + 1]:
                begun = corners[segment_of[r], 0]
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
            if rejected[0, j] > 0.0:
                refused[j] += 1
                if h_next[0, j] >= 1e-14 * max(abs(t1[0, j]), 1.0) and steps[j] < max_steps:
                    continue
                outcome = STUCK if steps[j] < max_steps else TOO_MANY
            elif t[0, j] < t1[0, j]:
                if steps[j] < max_steps:
                    continue
                outcome = TOO_MANY
            else:
                segment[j] += 1
                s = segment[j]
                if s < segment_of[r + 1]:
                    t[0, j] = t0[0, j] = corners[s, 0]
                    t1[0, j], h_next[0, j] = corners[s, 1], min(h_next[0, j], CORNER_STEP)
                    for i in range(NU):
                        start_u[i, j], slope[i, j] = values[s, i], slopes[s, i]
                    if per_segment:
                        prepare(parameters[s], q1)
                        for i in range(NQ):
                            q[i, j] = q1[i]
                    continue
                outcome = FINISHED
            if sampling:  # a last one that rounding puts behind the end
                while row[j] < sample_of[r + 1]:
                    for i in range(N):
                        samples[row[j], i] = y[i, j]
                    row[j] += 1
            ended[r, 0], ended[r, 1], ended[r, 2], ended[r, 3] = outcome, steps[j] - refused[j], refused[j], t[0, j]
            for i in range(N):
                states[r, i], least[r, i], most[r, i] = y[i, j], low[i, j], high[i, j]
            run[j] = EMPTY
            active -= 1
            empty += 1
