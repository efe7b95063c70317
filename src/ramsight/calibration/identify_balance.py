"""Generalised least squares on the volume balance from node to node, by Gauss-Newton."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ramsight.calibration.flow_law import sandwich, student
from ramsight.calibration.identify_hydraulics import Balance, Deviation, Hydraulics
from ramsight.calibration.identify_moves import Moves

Array = NDArray[np.float64]

LIMITS = {"leak": 0.25, "orifice": 0.25, "displacement": 0.01, "compliance": 0.3, "delay": 0.02}
"""Half of a 95 % interval above which a log does not tell: about what machines of one kind differ by; delay in s."""
_STEPS = {"leak": 1e-2, "orifice": 1e-2, "displacement": 1e-3, "compliance": 1e-2, "delay": 1e-3}
_LOWEST = {"leak": 0.0, "orifice": 0.0, "displacement": 0.5, "compliance": 0.2, "delay": -1.0}
_UNTOLD = {"displacement", "compliance", "delay"}
_ENOUGH_RUNS = 8  # moves from which their scatter can be taken for the uncertainty
_ROUNDS = 10
_CONVERGED = 1e-2  # of a standard deviation


@dataclass(frozen=True)
class BalanceFit:
    """What the volume balance tells.

    Attributes:
        deviation: the machine's.
        free: the values that were fitted.
        half_width: half of the 95 % interval of each value, and of those that could not be told what it would be.
        residual: root mean square of what a move's nodes leave unexplained [m3].
    """

    deviation: Deviation
    free: tuple[str, ...]
    half_width: dict[str, float]
    residual: float


def fit_balance(
    hydraulics: Hydraulics,
    moves: Moves,
    base: Deviation,
    free: Sequence[str] | None = None,
    advance: Callable[[float], object] | None = None,
) -> BalanceFit:
    """Fit what the log tells.

    Args:
        hydraulics: of the record.
        moves: its nodes.
        base: values of what is not fitted, and where to begin.
        free: what to fit; without it, everything, less whatever turns out too uncertain, worst first.
        advance: called with 1 after each evaluation of the balance.
    """
    step = advance or (lambda _: None)
    names = list(LIMITS) if free is None else list(free)
    wide: dict[str, float] = {}
    while True:
        fitted = _gauss_newton(hydraulics, moves, base, names, step)
        excess = {name: fitted.half_width[name] / LIMITS[name] for name in names}
        worst = max(excess, key=excess.__getitem__, default=None)
        negative = [name for name in names if getattr(fitted.deviation, name) <= _LOWEST[name]]
        if worst == "leak" and "orifice" in names:
            worst = "orifice"  # one leakage is the data sheet's law, and better told than two that cannot be told apart
        if free is None and worst is not None and max(excess.values()) > 1.0:
            wide[worst] = fitted.half_width[worst]
            names.remove(worst)
        elif free is None and negative:  # on its bound: the others are fitted with it there
            wide[negative[0]] = fitted.half_width[negative[0]]
            names.remove(negative[0])
            if negative[0] == "orifice":
                base = replace(base, orifice=0.0)
        else:
            return replace(fitted, half_width={**dict.fromkeys(LIMITS, math.inf), **wide, **fitted.half_width})


def _gauss_newton(
    hydraulics: Hydraulics, moves: Moves, base: Deviation, names: list[str], advance: Callable[[float], object]
) -> BalanceFit:
    joined = np.flatnonzero(moves.chain[1:] == moves.chain[:-1])

    def residual(how: Deviation) -> tuple[Array, Balance]:
        balance = hydraulics.balance(how)
        advance(1.0)
        return np.diff(moves.mean(balance.content))[joined], balance

    how, clusters = base, moves.run[1:][joined]
    inside = moves.run[1:][joined] == moves.run[:-1][joined]
    if not names or joined.size <= len(names):
        return BalanceFit(base, (), dict.fromkeys(LIMITS, math.inf), math.nan)
    for _ in range(_ROUNDS):
        d, balance = residual(how)
        columns = []
        for name in names:
            moved, _ = residual(replace(how, **{name: getattr(how, name) + _STEPS[name]}))
            columns.append((moved - d) / _STEPS[name])
        factor = _whitening(hydraulics, moves, joined, balance, how)
        white = np.linalg.solve(factor, np.column_stack([*columns, d]))
        design, y = np.asarray(white[:, :-1], dtype=np.float64), white[:, -1]
        scale = np.linalg.norm(design, axis=0)
        change, _, rank, _ = np.linalg.lstsq(design / scale, -y, rcond=1e-7)
        if rank < len(names):
            lost = names[int(np.argmin(scale * np.array([LIMITS[n] for n in names])))]
            return BalanceFit(base, tuple(names), {n: math.inf if n == lost else 0.0 for n in names}, math.nan)
        change = change / scale
        covariance = np.linalg.inv((design / scale).T @ (design / scale)) / np.outer(scale, scale)
        std = np.sqrt(np.diag(covariance))
        wanted = {n: max(getattr(how, n) + float(c), _LOWEST[n]) for n, c in zip(names, change, strict=True)}
        done = all(abs(wanted[n] - getattr(how, n)) < _CONVERGED * s for n, s in zip(names, std, strict=True))
        how = replace(how, **wanted)
        if done:
            break
    left: Array = np.array(y + design @ change, dtype=np.float64)
    freedom = len(y) - len(names)
    std = std * math.sqrt(max(1.0, float(left @ left) / freedom))
    runs = np.unique(clusters, return_inverse=True)[1]
    count = int(runs.max()) + 1
    if count >= _ENOUGH_RUNS:
        robust = np.sqrt(np.diag(sandwich(design, left, runs)))
        std, freedom = np.maximum(std, robust), count - len(names)
    systematic = [_systematic(hydraulics, moves, joined, how)]
    for name in _UNTOLD - set(names):  # left at the data sheet, but not known to be what it says
        moved, _ = residual(replace(how, **{name: getattr(how, name) + _STEPS[name]}))
        systematic.append(((moved - d) * (LIMITS[name] / 1.96 / _STEPS[name]))[:, None])
    effects = np.linalg.solve(factor, np.hstack(systematic)).T
    shifts = np.array([np.linalg.lstsq(design, effect, rcond=None)[0] for effect in effects])
    half = np.hypot(student(freedom) * std, 1.96 * np.sqrt((shifts**2).sum(axis=0)))
    half = np.hypot(half, [_MODEL.get(name, 0.0) for name in names])
    d, _ = residual(how)
    rms = float(np.sqrt(np.mean(d[inside] ** 2))) if inside.any() else math.nan
    return BalanceFit(how, tuple(names), dict(zip(names, half.tolist(), strict=True)), rms)


def _whitening(
    hydraulics: Hydraulics, moves: Moves, joined: NDArray[np.int64], balance: Balance, how: Deviation
) -> Array:
    """Cholesky factor of the differences' covariance: scatter of the nodes, drift, and speeds rounded by the drive."""
    record = hydraulics.record
    node = scatter(balance.content, moves) ** 2 / moves.samples() + (_FLOOR * hydraulics.area) ** 2
    count = len(joined)
    covariance = np.zeros((count, count))
    index = np.arange(count)
    covariance[index, index] = node[joined] + node[joined + 1]
    neighbours = np.flatnonzero(np.diff(joined) == 1)
    covariance[neighbours, neighbours + 1] = covariance[neighbours + 1, neighbours] = -node[joined[neighbours] + 1]
    leak = how.law(hydraulics.held).laminar / hydraulics.viscosity.mean()
    drift = leak * scatter(balance.pressure, moves) * math.sqrt(record.period)
    middle = moves.mean(record.time)
    covariance[index, index] += drift**2 * (middle[joined + 1] - middle[joined])
    # A constant speed is off by up to half a step all the time it lasts.
    per_speed = hydraulics.held.pump.geared_displacement * record.speed_step / math.sqrt(12.0)
    for run in np.unique(moves.run):
        rows = np.flatnonzero(moves.run == run)
        span = slice(int(moves.first[rows[0]]), int(moves.last[rows[-1]]))
        level = np.median(record.motor_speed[span])
        constant = np.abs(record.motor_speed - level) < 1.5 * max(record.speed_step, 1e-9)
        near = np.zeros(len(record.time))
        near[span] = 1.0
        passed = np.cumsum(constant * near * hydraulics.step)
        error = per_speed * np.diff(moves.mean(passed))[joined]
        touched = np.flatnonzero(error)
        covariance[np.ix_(touched, touched)] += np.outer(error[touched], error[touched])
    return np.asarray(np.linalg.cholesky(covariance))


def _systematic(hydraulics: Hydraulics, moves: Moves, joined: NDArray[np.int64], how: Deviation) -> Array:
    """What errs the same way all the time, one standard deviation each: shape (differences, 3).

    The zero of the torque; what happens while the valve opens and closes, for reversals up and down.
    """
    offset = _TORQUE_ZERO * hydraulics.record.largest_torque
    shifted = Hydraulics(hydraulics.unit, hydraulics.record.changed(offset=offset)).balance(how).content
    zero = np.diff(moves.mean(shifted - hydraulics.balance(how).content))[joined]
    turns = (moves.lifting[1:].astype(float) - moves.lifting[:-1])[joined] * _TURN * hydraulics.area
    return np.column_stack([zero, np.maximum(turns, 0.0), np.minimum(turns, 0.0)])


_TORQUE_ZERO = 1e-3  # share of the largest torque of a log, [G]
_MODEL = {"displacement": 3e-4, "compliance": 1e-2}  # [G]; what the balance itself is good for, as volumes are known
_TURN = 5e-5  # m, [G]; the independent simulator's valves make about that much
_FLOOR = 5e-6  # m; what a node's mean is not known better than


def scatter(values: Array, moves: Moves) -> float:
    """Standard deviation of a column's white noise in the moves, from second differences."""
    second = np.diff(values, 2) ** 2
    inside = np.concatenate([np.arange(a, b - 2) for a, b in zip(moves.first, moves.last, strict=True)])
    return float(np.sqrt(np.median(second[inside]) / (6.0 * 0.4549)))
