"""Rodas4: a stiffly accurate Rosenbrock method of order 4 with an embedded one of order 3, in six stages.

Coefficients of E. Hairer and G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., section IV.7 (code
RODAS), in the transformed form that needs no matrix-vector product: with c = 1/(h gamma),

    (c I - J) k_i = f(t + alpha_i h, y + sum_j a_ij k_j) + sum_j (c_ij / h) k_j + gamma_i h df/dt.

The new value is y + sum m_j k_j, the error estimate is k_6.
"""

from __future__ import annotations

from typing import Any

import casadi as ca

ORDER = 4
STAGES = 6
GAMMA = 0.25
ALPHA = (0.0, 0.386, 0.21, 0.63, 1.0, 1.0)
GAMMA_SUM = (0.25, -0.1043, 0.1035, -0.0362, 0.0, 0.0)
A = (
    (),
    (1.544,),
    (0.9466785280815826, 0.2557011698983284),
    (3.314825187068521, 2.896124015972201, 0.9986419139977817),
    (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950),
    (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 1.0),
)
C = (
    (),
    (-5.6688,),
    (-2.430093356833875, -0.2063599157091915),
    (-0.1073529058151375, -9.594562251023355, -20.47028614809616),
    (7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160),
    (8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054),
)
M = (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 1.0, 1.0)
# Continuous extension of order 3: y(t + s h) = (1-s) y0 + s (y1 + (1-s) (d2 + s d3)), d = sum D_j k_j.
D2 = (10.12623508344586, -7.487995877610167, -34.80091861555747, -7.992771707568823, 1.025137723295662)
D3 = (-0.6762803392806898, 6.087714651680015, 16.43084320892478, 24.76722511418386, -6.594389125716872)

_REACH = 1.0001  # a step that would leave less than this over goes to the corner
_SAFETY = 0.9
_HUGE = 1e20  # mean squared error of a step without a usable one


def _combine(coefficients: tuple[float, ...], vectors: list[Any]) -> Any:
    """Sum of vectors, each times its coefficient; zero coefficients leave no trace."""
    terms = [c * v for c, v in zip(coefficients, vectors, strict=False) if c != 0.0]
    return sum(terms[1:], terms[0])


def step_functions(rhs: ca.Function, solve: ca.Function) -> dict[str, ca.Function]:
    """The step as SX functions, each one straight run of operations from its inputs to its outputs.

    Returns:
        `stage_0(f, ft, h, w) -> k0`; `stage_i(x, u, slope, q, h, ft, w, k0, ...) -> ki` with the right-hand side
        inside; `finish(x, k0, ..., k5, atol, rtol) -> x1, error` with the sum of the squared errors, each over its
        tolerance; `dense(x, x1, k0, ..., k4, s) -> out` at the share `s` of the step.
    """
    n = rhs.size1_in(0)
    x, u, slope, q = (ca.SX.sym(name, rhs.size1_in(i)) for i, name in enumerate(("x", "u", "slope", "q")))
    h, s, rtol = (ca.SX.sym(name) for name in ("h", "s", "rtol"))
    ft, x1, atol = (ca.SX.sym(name, n) for name in ("ft", "x1", "atol"))
    f, w = ca.SX.sym("f", n), ca.SX.sym("w", solve.size1_in(0))
    k = [ca.SX.sym(f"k{i}", n) for i in range(STAGES)]
    names = [f"k{i}" for i in range(STAGES)]
    options = {"cse": True}
    functions = {}
    for i in range(STAGES):
        slope_at = f if i == 0 else rhs(x + _combine(A[i], k), u + ALPHA[i] * h * slope, slope, q)
        right = slope_at + GAMMA_SUM[i] * h * ft if GAMMA_SUM[i] else slope_at
        if i == 0:
            inputs, labels = [f, ft, h, w], ["f", "ft", "h", "w"]
        else:
            right += _combine(C[i], k) / h
            inputs, labels = [x, u, slope, q, h, ft, w, *k[:i]], ["x", "u", "slope", "q", "h", "ft", "w", *names[:i]]
        functions[f"stage_{i}"] = ca.Function(f"stage_{i}", inputs, [solve(w, right)], labels, [names[i]], options)
    new = x + _combine(M, k)
    scale = atol + rtol * ca.fmax(ca.fabs(x), ca.fabs(new))
    finish = [new, ca.sumsqr(k[-1] / scale)]
    functions["finish"] = ca.Function(
        "finish", [x, *k, atol, rtol], finish, ["x", *names, "atol", "rtol"], ["x1", "error"], options
    )
    between = (1 - s) * x + s * (x1 + (1 - s) * (_combine(D2, k) + s * _combine(D3, k)))
    functions["dense"] = ca.Function(
        "dense", [x, x1, *k[:5], s], [between], ["x", "x1", *names[:5], "s"], ["out"], options
    )
    return functions


def control_functions(n: int, n_coupled: int, n_inputs: int) -> dict[str, ca.Function]:
    """What surrounds a step, as SX functions: how long it is, and what follows from its error.

    Returns:
        `begin(t, t0, t1, h_next, longest, u_start, slope) -> h, c, u0`: the step does not pass the corner t1;
        `conclude(x, x1, error, h, t, t1, h_next, rejected) -> x_new, t_new, h_next_new, rejected_new`: an error that
        is no number counts as a large one; `extremes(x, low, high) -> low_new, high_new`.
    """
    t, t0, t1, h, h_next, longest, error, rejected = (
        ca.SX.sym(name) for name in ("t", "t0", "t1", "h", "h_next", "longest", "error", "rejected")
    )
    u_start, slope = ca.SX.sym("u_start", n_inputs), ca.SX.sym("slope", n_inputs)
    x, x1, low, high = (ca.SX.sym(name, n) for name in ("x", "x1", "low", "high"))
    wanted = ca.fmin(h_next, longest)
    last = t + _REACH * wanted >= t1
    step = ca.if_else(last, t1 - t, wanted)
    options = {"cse": True}
    begin = ca.Function(
        "begin",
        [t, t0, t1, h_next, longest, u_start, slope],
        [step, 1.0 / (step * GAMMA), u_start + slope * (t - t0)],
        ["t", "t0", "t1", "h_next", "longest", "u_start", "slope"],
        ["h", "c", "u0"],
        options,
    )
    mean = ca.if_else(error < n_coupled * _HUGE, error / n_coupled, _HUGE)
    accepted = mean <= 1.0
    growth = ca.fmin(ca.fmax(_SAFETY * ca.exp(-0.5 / ORDER * ca.log(ca.fmax(mean, 1e-20))), 0.2), 6.0)
    growth = ca.if_else(ca.logic_and(accepted, rejected > 0.0), ca.fmin(growth, 1.0), growth)
    arrived = t + _REACH * h >= t1
    conclude = ca.Function(
        "conclude",
        [x, x1, error, h, t, t1, h_next, rejected],
        [
            ca.if_else(accepted, x1, x),
            ca.if_else(accepted, ca.if_else(arrived, t1, t + h), t),
            ca.if_else(ca.logic_and(accepted, arrived), ca.fmax(h_next, h * growth), h * growth),
            ca.if_else(accepted, 0.0, 1.0),
        ],
        ["x", "x1", "error", "h", "t", "t1", "h_next", "rejected"],
        ["x_new", "t_new", "h_next_new", "rejected_new"],
        options,
    )
    extremes = ca.Function(
        "extremes",
        [x, low, high],
        [ca.fmin(low, x), ca.fmax(high, x)],
        ["x", "low", "high"],
        ["low_new", "high_new"],
        options,
    )
    return {"begin": begin, "conclude": conclude, "extremes": extremes}
