"""Friction, from what lifting takes more than lowering the same load: the cylinder's apart from the pumps'.

The force that the circuit finds under the reported torque is that of the load and the cylinder's friction, if the
pumps' own friction is what is described. Where it is not,

    F = F_load + f F_sheet - dF/deta (eta - eta_0) - dF/dtau (tau - tau_0)

for each load, with f the cylinder's friction over the data sheet's. The pumps' efficiency costs in proportion to the
pressure, so three loads tell it from the cylinder; with fewer it stays as described, and the interval of f gets as much
wider as the description may be off. The pumps' no-load torque costs the same under any load, as the cylinder's Coulomb
friction does: no log tells one from the other, and the interval of f always holds what that may be off.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from ramsight.arrays import Array, Places
from ramsight.calibration.identify_balance import BalanceProblem, sandwich, student
from ramsight.calibration.identify_moves import Moves, moved_at_rest
from ramsight.calibration.identify_record import Record
from ramsight.calibration.identify_replay import Deviation, Run
from ramsight.calibration.loss_uncertainty import EFFICIENCY, NO_LOAD_TORQUE
from ramsight.normal import TWO_SIDED_95
from ramsight.plant.unit import HydraulicUnit

LIMITS = {"friction": 0.5, "efficiency": 0.01}
"""Half of a 95 % interval, the no-load torque taken as described, above which a log does not tell; of the efficiency
half of what a description may be off."""
FEWEST_LOADS = 3
"""Loads, each lifted and lowered, from which the pumps' efficiency can be separated from the cylinder's friction."""
_STEPS = {"efficiency": -0.01, "no_load": 0.1}
_DESCRIBED = {"efficiency": EFFICIENCY, "no_load": NO_LOAD_TORQUE}
_ENOUGH_RUNS = 8  # moves from which their scatter can be taken for the uncertainty
_MOST = 3.0  # factor up to which a difference of force between moves may be friction
_ALIKE = 0.15  # by which friction from one reversal may be off that of most others, and
_APART = 0.1  # share of the largest load by which two have to differ to give a slope
_SCATTER = 5.0  # by how many median deviations


@dataclass(frozen=True)
class FrictionFit:
    """What lifting and lowering tell."""

    # friction of the cylinder over the data sheet's; hydro-mechanical efficiency of the pumps less the described one.
    # The data sheet's where the log does not tell.
    value: dict[str, float]
    half_width: dict[str, float]  # half of each 95 % interval; of a value that is not identified what it would be
    identified: frozenset[str]  # which of the two the log identifies
    loads: int  # how many loads were lifted and lowered
    per_no_load: float  # change of the friction factor if the pumps' no-load torque is a quarter larger than described
    as_described: float  # half of the friction's 95 % interval if the no-load torque is what is described


@dataclass(frozen=True)
class _Forces:
    """Nodes whose load went both ways: forces, their explanations, and which belong together."""

    force: Array
    sheet: Array
    by_pumps: dict[str, Array]
    group: Places
    run: Places
    noise: Array

    @property
    def loads(self) -> Places:
        return np.unique(self.group)


@dataclass(frozen=True)
class _Solved:
    """A least squares fit: friction, and the efficiency if it was free."""

    value: dict[str, float]
    half: dict[str, float]  # of their 95 % intervals by scatter alone
    shift: dict[str, float]  # of the friction, a standard deviation each, by what is taken as described


def fit_friction(problem: BalanceProblem, how: Deviation, groups: Places, separate: bool | None = None) -> FrictionFit:
    """Fit the cylinder's friction, and the pumps' efficiency if the two can be separated.

    Args:
        groups: of nodes under the same load, as `same_loads` gives them.
        separate: whether efficiency and friction are to be separated; by default if the log can.
    """
    forces = _forces(problem, how, groups)
    loads, inf = len(forces.loads), math.inf
    as_described = {"friction": 1.0, "efficiency": 0.0}
    if len(forces.force) < 4:
        return FrictionFit(as_described, dict.fromkeys(LIMITS, inf), frozenset(), loads, 0.0, inf)
    both = _solve(forces, ["efficiency"])
    if separate is None:
        separate = loads >= FEWEST_LOADS and both.half["efficiency"] <= LIMITS["efficiency"]
    solved = both if separate else _solve(forces, [])
    half, no_load = solved.half["friction"], solved.shift["no_load"]
    half = math.hypot(half, TWO_SIDED_95 * solved.shift.get("efficiency", 0.0))
    identified = {"efficiency"} if separate else set()
    if half < LIMITS["friction"] and solved.value["friction"] > 0.0:
        identified.add("friction")
    found = {name: value for name, value in solved.value.items() if name in identified}
    if separate:
        found["efficiency"] += how.efficiency
    width = {"friction": math.hypot(half, TWO_SIDED_95 * no_load), "efficiency": both.half["efficiency"]}
    if loads < FEWEST_LOADS:
        width["efficiency"] = inf
    return FrictionFit(as_described | found, width, frozenset(identified), loads, no_load, half)


def _forces(problem: BalanceProblem, how: Deviation, groups: Places) -> _Forces:
    moves, run = problem.moves, problem.run(how)
    both = np.zeros(len(groups), dtype=bool)
    for number in np.unique(groups):
        rows = groups == number
        both |= rows & (moves.lifting[rows].any() and not moves.lifting[rows].all())
    force = moves.mean(run.force)
    by_pumps = {}
    for name, step in _STEPS.items():
        other = problem.run(replace(how, **{name: getattr(how, name) + step}))
        by_pumps[name] = ((moves.mean(other.force) - force) / step)[both]
    sheet = sheet_friction(problem.circuit.unit, moves, run)
    noise = moves.noise_of_mean(run.force)[both]
    return _Forces(force[both], sheet[both], by_pumps, groups[both], moves.run[both], noise)


def _solve(forces: _Forces, free: list[str]) -> _Solved:
    """Least squares with nodes of a move erring together."""
    y, names = forces.force, ["friction", *free]
    dummies = (forces.group[:, None] == forces.loads[None, :]).astype(np.float64)
    plain = np.column_stack([forces.sheet, *(-forces.by_pumps[n] for n in free), dummies])
    fixed = [name for name in _DESCRIBED if name not in free]
    effects = [forces.by_pumps[name] * _DESCRIBED[name] for name in fixed]
    runs = np.unique(forces.run, return_inverse=True)[1]
    count, k = int(runs.max()) + 1, plain.shape[1]
    if np.linalg.matrix_rank(plain / np.linalg.norm(plain, axis=0), tol=1e-9) < k:
        return _Solved(dict.fromkeys(names, 0.0), dict.fromkeys(names, math.inf), dict.fromkeys(_DESCRIBED, 0.0))
    between = 0.0
    for _ in range(3):
        white = _whitened(np.column_stack([plain, *effects, y]), runs, forces.noise, between)
        design, target = white[:, :k], white[:, -1]
        value = np.linalg.lstsq(design, target, rcond=None)[0]
        between = _between_moves(y - plain @ value, runs, forces.noise, count - k)
    left = target - design @ value
    freedom = max(len(y) - k, 1)
    std = np.sqrt(np.diag(np.linalg.inv(design.T @ design)) * max(1.0, float(left @ left) / freedom))
    if count >= _ENOUGH_RUNS:
        # The loads take up degrees of freedom of the moves, not of their nodes.
        spare = max(count - dummies.shape[1], 1)
        std = np.maximum(std, np.sqrt(np.diag(sandwich(design, left, runs)) * count / spare))
        freedom = max(count - k, 1)
    shifts = np.linalg.lstsq(design, white[:, k:-1], rcond=None)[0][0]
    half = student(freedom) * std
    return _Solved(
        dict(zip(names, value.tolist(), strict=False)),
        dict(zip(names, half.tolist(), strict=False)),
        dict(zip(fixed, shifts.tolist(), strict=True)),
    )


def _whitened(rows: Array, runs: Places, noise: Array, between: float) -> Array:
    """Rows of which those of a move share an error with standard deviation `between`, made independent."""
    result = np.empty_like(rows)
    for number in range(int(runs.max()) + 1):
        own = np.flatnonzero(runs == number)
        factor = np.linalg.cholesky(np.diag(noise[own] ** 2) + between**2)
        result[own] = np.linalg.solve(factor, rows[own])
    return result


def _between_moves(rest: Array, runs: Places, noise: Array, spare: int) -> float:
    """Standard deviation of what moves differ by beyond the noise of their nodes [N]."""
    means = np.bincount(runs, rest) / np.bincount(runs)
    expected = np.bincount(runs, noise**2) / np.bincount(runs) ** 2
    return math.sqrt(max(0.0, float(np.sum(means**2 - expected)) / spare)) if spare > 0 else 0.0


def sheet_friction(unit: HydraulicUnit, moves: Moves, run: Run) -> Array:
    """The data sheet's friction of the cylinder at each node [N], in the direction of lifting."""
    velocity, force = (ca.DM(moves.mean(column)) for column in (run.velocity, run.force))
    return np.asarray(unit.cylinder.friction(velocity, force), dtype=np.float64).ravel()


def _line(x: Array, y: Array, at: Array) -> Array:
    """Values at some places of the line that most points agree on, level if they lie too close.

    Source: P. K. Sen, J. Amer. Statist. Assoc. 63 (1968) 1379: the median of the slopes of all pairs.
    """
    dx, dy = x[:, None] - x[None, :], y[:, None] - y[None, :]
    apart = dx > _APART * np.abs(x).max()
    slope = float(np.median(dy[apart] / dx[apart])) if apart.sum() >= 3 else 0.0
    return np.asarray(np.median(y - slope * x) + slope * at)


def same_loads(unit: HydraulicUnit, moves: Moves, record: Record, run: Run) -> Places:
    """Number the nodes by loads: the same number, the same load, as far as can be distinguished; shape (n,).

    A rod that moved at rest by more than friction can hold shows that the load changed. Where it touched a stop, or the
    pump holds it, that cannot be seen; then a difference that friction could make is taken for friction, if most other
    reversals agree.
    """
    force, sheet = moves.mean(run.force), sheet_friction(unit, moves, run)
    runs = np.unique(moves.run)
    rows = [moves.run == number for number in runs]
    mean_force, mean_sheet = (np.array([values[r].mean() for r in rows]) for values in (force, sheet))
    starts = np.array([int(np.argmax(r)) for r in rows])
    pressed = (unit.cylinder.pressure_friction or 0.0) * np.abs(mean_force)
    holds = 2.0 * (unit.cylinder.breakaway_friction + pressed)
    with np.errstate(invalid="ignore"):
        changed = moved_at_rest(moves, record, run)[starts] > holds * run.give[moves.first[starts]]
    change, expected = np.diff(mean_force), np.diff(mean_sheet)
    reverses = np.diff(np.sign(mean_sheet)) != 0.0
    factor = change / np.where(reverses, expected, 1.0)
    same = np.where(reverses, (factor > 0.0) & (factor < _MOST), np.abs(change) < 0.25 * holds[1:]) & ~changed[1:]
    pairs = same & reverses
    if pairs.sum() >= 3:
        # Pumps rougher than described add what goes with the load, so most agree on a line.
        load = 0.5 * (mean_force[1:] + mean_force[:-1])
        off = np.abs(factor - _line(load[pairs], factor[pairs], load))
        reach = max(_ALIKE, _SCATTER * float(np.median(off[pairs])))
        same &= ~reverses | (off < reach)
    number = np.concatenate([[0], np.cumsum(~same)])
    return np.asarray(number[np.searchsorted(runs, moves.run)], dtype=np.int64)
