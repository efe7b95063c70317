"""Generalised least squares on what the circuit's replay leaves unexplained from node to node, by Gauss-Newton."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ramsight.arrays import Array, Places
from ramsight.calibration.identify_moves import Moves
from ramsight.calibration.identify_record import Record
from ramsight.calibration.identify_replay import Circuit, Deviation, Run
from ramsight.calibration.loss_uncertainty import EFFICIENCY, NO_LOAD_TORQUE
from ramsight.normal import TWO_SIDED_95

LIMITS = {"leak": 0.25, "orifice": 0.25, "displacement": 0.01, "compliance": 0.3, "delay": 0.02}
"""Half of a 95 % interval above which a log does not tell: about what machines of one kind differ by; delay in s."""
_STEPS = {"leak": 1e-2, "orifice": 1e-2, "displacement": 1e-3, "compliance": 1e-2, "delay": 1e-3}
_LOWEST = {"leak": 0.0, "orifice": 0.0, "displacement": 0.5, "compliance": 0.2, "delay": -1.0}
_UNIDENTIFIED = ("displacement", "compliance", "delay")
_NONE = ("leak", "orifice")  # at zero these say that nothing leaks so, which is a finding
_ENOUGH_RUNS = 8  # moves from which their scatter can be taken for the uncertainty
_ROUNDS = 10  # of Gauss-Newton, at most: near the solution each squares the error
_CONVERGED = 1e-2  # of a standard deviation
_TORQUE_ZERO = 1e-3  # share of the largest torque of a log, [G]
_MODEL = {"displacement": 3e-4, "compliance": 1e-2}  # [G]; what the balance itself is good for, as volumes are known
_TURN = 7e-5  # share of the stroke, [G]; what happens while a valve opens; the independent simulator's make that much
_FLOOR = 7e-6  # share of the stroke; what a node's mean is not known better than


@dataclass(frozen=True)
class BalanceFit:
    """What the volume balance tells."""

    deviation: Deviation
    free: tuple[str, ...]  # the values that were fitted
    # half of the 95 % interval of each value, and of those that are not identified what it would be
    half_width: dict[str, float]
    residual: float  # root mean square of what a move's nodes leave unexplained [m]
    # the values that are zero as far as the log tells, and held there; at most their `half_width`
    none: tuple[str, ...] = ()


class BalanceProblem:
    """The nodes of a record and how their differences follow from the factors.

    Args:
        efficiency_std: standard deviation of the pumps' hydro-mechanical efficiency [1].
    """

    def __init__(
        self,
        circuit: Circuit,
        record: Record,
        moves: Moves,
        efficiency_std: float = EFFICIENCY,
        advance: Callable[[float], object] | None = None,
    ) -> None:
        self.circuit, self.record, self.moves, self.efficiency_std = circuit, record, moves, efficiency_std
        self.joined: Places = np.flatnonzero(moves.chain[1:] == moves.chain[:-1])
        self.clusters = moves.run[1:][self.joined]
        self.inside = self.clusters == moves.run[:-1][self.joined]
        self._advance = advance or (lambda _: None)

    def tells(self, name: str) -> bool:
        """Whether a record of the circuit could tell a factor at all.

        How much oil and hoses give is identified by loads that change at rest, so only where a valve holds them there.
        """
        return name != "compliance" or self.moves.held

    def run(self, how: Deviation, record: Record | None = None) -> Run:
        """The record under a deviation."""
        self._advance(1.0)
        return self.circuit.run(record or self.record, how)

    def differences(self, run: Run) -> Array:
        """What changes between joined nodes and should not [m]."""
        return np.diff(self.moves.mean(run.content))[self.joined]

    def column(self, how: Deviation, name: str, step: float, d: Array) -> Array:
        """Derivative of the differences `d` with respect to one factor."""
        moved = self.run(replace(how, **{name: getattr(how, name) + step}))
        return np.asarray((self.differences(moved) - d) / step)

    def instrument(self, name: str, column: Array) -> Array:
        """What of a factor's column may tell it: of compliance its part from move to move, of others all.

        Within a move the mass swings on its oil, and the replay's load follows the torque some samples late, so that
        the column errs with the position there; over a whole move swings are gone.
        """
        if name != "compliance":
            return column
        between = np.zeros(len(self.moves.run) - 1)
        between[self.joined] = column
        level = np.concatenate([[0.0], np.cumsum(between)])
        run = np.unique(self.moves.run, return_inverse=True)[1]
        mean = np.bincount(run, level) / np.bincount(run)
        return np.asarray(np.diff(mean[run])[self.joined])

    def whitening(self, run: Run, how: Deviation) -> Array:
        """What makes the differences independent, of variance 1.

        Scatter of the nodes, drift under a noisy torque, valves that open and close, speeds that the drive rounds.
        """
        record, moves, joined, stroke = self.record, self.moves, self.joined, self.circuit.unit.cylinder.stroke
        node = moves.noise_of_mean(run.content) ** 2 + (_FLOOR * stroke) ** 2
        turn = np.where(self.inside, 0.0, (_TURN * stroke) ** 2)
        covariance = np.diag(node[joined] + node[joined + 1] + turn)
        neighbours = np.flatnonzero(np.diff(joined) == 1)
        shared = -node[joined[neighbours] + 1]
        covariance[neighbours, neighbours + 1] = covariance[neighbours + 1, neighbours] = shared
        limits = self.circuit.limits
        per_torque = how.leak * limits.leak_velocity / limits.torque
        drift = per_torque * moves.noise(record.motor_torque) * math.sqrt(record.period)
        middle = moves.mean(record.time)
        index = np.arange(len(joined))
        covariance[index, index] += drift**2 * (middle[joined + 1] - middle[joined])
        for error in self._rounded_speeds():
            touched = np.flatnonzero(error)
            covariance[np.ix_(touched, touched)] += np.outer(error[touched], error[touched])
        return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))

    def _rounded_speeds(self) -> list[Array]:
        """For each move what its differences get from a constant speed that is off by what it is rounded by."""
        record, moves = self.record, self.moves
        per_speed = float(self.circuit.unit.travel_per_radian) * record.speed_step / math.sqrt(12.0)
        errors = []
        for number in np.unique(moves.run):
            rows = np.flatnonzero(moves.run == number)
            span = slice(int(moves.first[rows[0]]), int(moves.last[rows[-1]]))
            level = np.median(record.motor_speed[span])
            constant = np.abs(record.motor_speed - level) < 1.5 * max(record.speed_step, 1e-9)
            near = np.zeros(len(record.time))
            near[span] = 1.0
            passed = np.cumsum(constant * near * record.step)
            errors.append(np.asarray(per_speed * np.diff(moves.mean(passed))[self.joined]))
        return errors

    def systematic(self, how: Deviation, free: Sequence[str], none: Mapping[str, float], d: Array) -> Array:
        """What errs the same way all the time, a standard deviation each, shape (differences, k).

        The zero of the torque; the pumps' friction; what happens while the valve opens and closes, for reversals up
        and down; a load that changed at rest and is seen late; what stays at the data sheet without being known to be
        what it says.
        """
        moves, stroke = self.moves, self.circuit.unit.cylinder.stroke
        offset = self.record.changed(offset=_TORQUE_ZERO * self.record.largest_torque)
        zero = self.differences(self.run(how, offset)) - d
        efficiency = self.column(how, "efficiency", -0.5 * EFFICIENCY, d) * self.efficiency_std
        no_load = self.column(how, "no_load", NO_LOAD_TORQUE, d) * NO_LOAD_TORQUE
        turns = (moves.lifting[1:].astype(float) - moves.lifting[:-1])[self.joined] * _TURN * stroke
        held = {name: LIMITS[name] for name in _UNIDENTIFIED if name not in free} | dict(none)
        unreferenced = [self.column(how, name, _STEPS[name], d) * half / TWO_SIDED_95 for name, half in held.items()]
        up, down = np.maximum(turns, 0.0), np.minimum(turns, 0.0)
        return np.column_stack([zero, efficiency, no_load, up, down, self._seen_late(how), *unreferenced])

    def _seen_late(self, how: Deviation) -> Array:
        """What a load that changed at rest costs until the torque has shown it [m].

        When the valve opens, the replay's pumps leak at the old load's pressure for a sample, more or less.
        """
        limits = self.circuit.limits
        leak = (how.leak + how.orifice) * limits.leak_velocity / limits.pressure
        change = np.diff(self.moves.mean(self.run(how).pressure))[self.joined]
        return np.where(self.inside, 0.0, leak * self.record.period * change)


def fit_balance(problem: BalanceProblem, base: Deviation, like: BalanceFit | None = None) -> BalanceFit:
    """Fit what the log tells.

    Args:
        like: an earlier fit, of which the same values are free; without it, everything, less whatever turns out too
            uncertain, worst first.
    """
    names = [n for n in LIMITS if problem.tells(n)] if like is None else list(like.free)
    wide: dict[str, float] = {}
    none = {} if like is None else {name: like.half_width[name] for name in like.none}
    while True:
        fitted = _gauss_newton(problem, base, names, none)
        excess = {name: fitted.half_width[name] / LIMITS[name] for name in names}
        worst = max(excess, key=excess.__getitem__, default=None)
        negative = [name for name in names if getattr(fitted.deviation, name) <= _LOWEST[name]]
        if worst == "leak" and "orifice" in names:
            worst = "orifice"  # one leakage, the data sheet's law, is better identified than two inseparable ones
        if like is None and worst is not None and max(excess.values()) > 1.0:
            wide[worst] = fitted.half_width[worst]
            names.remove(worst)
        elif like is None and negative:  # on its bound: the others are fitted with it there
            (none if negative[0] in _NONE else wide)[negative[0]] = fitted.half_width[negative[0]]
            names.remove(negative[0])
            if negative[0] in _NONE:
                base = replace(base, **{negative[0]: 0.0})
        else:
            half = {**dict.fromkeys(LIMITS, math.inf), **wide, **none, **fitted.half_width}
            return replace(fitted, half_width=half, none=tuple(none))


def _gauss_newton(problem: BalanceProblem, base: Deviation, names: list[str], none: Mapping[str, float]) -> BalanceFit:
    if not names or problem.joined.size <= len(names):
        return BalanceFit(base, (), dict.fromkeys(names, math.inf), math.nan)
    how, run = base, problem.run(base)
    whiten = problem.whitening(run, how)
    for _ in range(_ROUNDS):
        d = problem.differences(run)
        columns = [problem.column(how, name, _STEPS[name], d) for name in names]
        tell = [problem.instrument(name, column) for name, column in zip(names, columns, strict=True)]
        instruments, y = whiten @ np.column_stack(tell), whiten @ d
        design = _explained_by(instruments, whiten @ np.column_stack(columns))
        scale = np.maximum(np.linalg.norm(design, axis=0), 1e-300)  # a factor may do nothing at all
        change, _, rank, _ = np.linalg.lstsq(design / scale, -y, rcond=1e-7)
        if rank < len(names):
            shown = np.linalg.norm(instruments, axis=0) * np.array([LIMITS[n] for n in names])
            lost = names[int(np.argmin(shown))]
            return BalanceFit(base, tuple(names), {n: math.inf if n == lost else 0.0 for n in names}, math.nan)
        change = change / scale
        std = np.sqrt(np.diag(np.linalg.inv((design / scale).T @ (design / scale)))) / scale
        wanted = {n: max(getattr(how, n) + float(c), _LOWEST[n]) for n, c in zip(names, change, strict=True)}
        done = all(abs(wanted[n] - getattr(how, n)) < _CONVERGED * s for n, s in zip(names, std, strict=True))
        how = replace(how, **wanted)
        run = problem.run(how)
        if done:
            break
    left = np.asarray(y + design @ change, dtype=np.float64)
    half = _half_widths(problem, how, names, none, whiten, design, left)
    d = problem.differences(run)
    rms = float(np.sqrt(np.mean(d[problem.inside] ** 2))) if problem.inside.any() else math.nan
    return BalanceFit(how, tuple(names), dict(zip(names, half.tolist(), strict=True)), rms)


def _explained_by(instruments: Array, columns: Array) -> Array:
    """The columns as far as instruments explain them; least squares with these is two-stage least squares.

    Errors of the columns that the instruments have no part in leave no bias.

    Source: R. L. Basmann, Econometrica 25 (1957) 77.
    """
    scaled = instruments / np.maximum(np.linalg.norm(instruments, axis=0), 1e-300)  # a factor may do nothing at all
    return np.asarray(scaled @ np.linalg.lstsq(scaled, columns, rcond=1e-7)[0])


def _half_widths(
    problem: BalanceProblem,
    how: Deviation,
    names: list[str],
    none: Mapping[str, float],
    whiten: Array,
    design: Array,
    left: Array,
) -> Array:
    """Half of the 95 % intervals: scatter of nodes and of moves, and shifts by what errs all the time."""
    freedom = len(left) - len(names)
    std = np.sqrt(np.diag(np.linalg.inv(design.T @ design)) * max(1.0, float(left @ left) / freedom))
    runs = np.unique(problem.clusters, return_inverse=True)[1]
    count = int(runs.max()) + 1
    if count >= _ENOUGH_RUNS:
        std = np.maximum(std, np.sqrt(np.diag(sandwich(design, left, runs))))
        freedom = count - len(names)
    d = problem.differences(problem.run(how))
    effects = (whiten @ problem.systematic(how, names, none, d)).T
    shifts = np.array([np.linalg.lstsq(design, effect, rcond=None)[0] for effect in effects])
    half = np.hypot(student(freedom) * std, TWO_SIDED_95 * np.sqrt((shifts**2).sum(axis=0)))
    return np.asarray(np.hypot(half, [_MODEL.get(name, 0.0) for name in names]))


def sandwich(design: Array, residual: Array, clusters: Places) -> Array:
    """Covariance of a least-squares estimate whose rows err together within clusters; shape (k, k).

    Args:
        design: shape (n, k).
        residual: shape (n,).
        clusters: numbers from 0, shape (n,).

    Source: the sandwich of Liang and Zeger, Biometrika 73 (1986) 13, with the usual small-sample factor.
    """
    n, k = design.shape
    bread = np.linalg.inv(design.T @ design)
    scores = np.zeros((int(clusters.max()) + 1, k))
    np.add.at(scores, clusters, design * residual[:, None])
    count = scores.shape[0]
    small = count / (count - 1.0) * (n - 1.0) / (n - k)
    return np.asarray(small * bread @ (scores.T @ scores) @ bread)


def student(freedom: float) -> float:
    """Two-sided 95 % quantile of Student's t, within 0.5 % from 3 degrees of freedom on.

    Args:
        freedom: degrees of freedom, 3 or more; fewer count as 3.

    Source: Cornish-Fisher expansion, Abramowitz and Stegun 26.7.5.

    Example:
        >>> round(student(10.0), 2), round(student(float("inf")), 2)
        (2.23, 1.96)
    """
    z, n = TWO_SIDED_95, max(freedom, 3.0)
    terms = (
        (z**3 + z) / 4.0,
        (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / 96.0,
        (3.0 * z**7 + 19.0 * z**5 + 17.0 * z**3 - 15.0 * z) / 384.0,
        (79.0 * z**9 + 776.0 * z**7 + 1482.0 * z**5 - 1920.0 * z**3 - 945.0 * z) / 92160.0,
    )
    return z + sum(term / n**power for power, term in enumerate(terms, 1))
