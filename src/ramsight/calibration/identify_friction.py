"""The cylinder's friction, from what lifting and lowering the same load takes."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ramsight.calibration.flow_law import sandwich, student
from ramsight.calibration.identify_balance import scatter
from ramsight.calibration.identify_hydraulics import Balance, Hydraulics
from ramsight.calibration.identify_moves import Moves

Array = NDArray[np.float64]
Places = NDArray[np.int64]

_ENOUGH_RUNS = 8  # moves from which their scatter can be taken for the uncertainty
_MOST = 3.0  # factor up to which a difference of force between moves may be friction
_ALIKE = 0.15  # by which friction from one reversal may be off that of most others, and
_SCATTER = 5.0  # by how many median deviations


def fit_friction(hydraulics: Hydraulics, moves: Moves, balance: Balance, groups: Places) -> tuple[float, float]:
    """Friction over the data sheet's and half of its 95 % interval [1]; NaN and infinity if no load moves both ways.

    Args:
        hydraulics: of the record.
        moves: its nodes.
        balance: with the fitted deviation.
        groups: as `same_loads` gives them.
    """
    force, sheet = moves.mean(balance.force), _sheet(hydraulics, moves, balance)
    both = np.zeros(len(force), dtype=bool)
    for number in np.unique(groups):
        rows = groups == number
        both |= rows & (moves.lifting[rows].any() and not moves.lifting[rows].all())
    if both.sum() < 4:
        return math.nan, math.inf
    y, f, group, run = force[both], sheet[both], groups[both], moves.run[both]
    noise = scatter(balance.force, moves) / np.sqrt(moves.samples()[both])
    covariance = np.diag(noise**2)
    between = 0.0
    for _ in range(3):
        factor = np.linalg.cholesky(covariance + between**2 * (run[:, None] == run[None, :]))
        dummies = (group[:, None] == np.unique(group)[None, :]).astype(np.float64)
        white = np.linalg.solve(factor, np.column_stack([f, dummies, y]))
        design, target = white[:, :-1], white[:, -1]
        value, *_ = np.linalg.lstsq(design, target, rcond=None)
        rest = y - np.column_stack([f, dummies]) @ value
        runs = np.unique(run, return_inverse=True)[1]
        means = np.bincount(runs, rest) / np.bincount(runs)
        expected = np.bincount(runs, noise**2) / np.bincount(runs) ** 2
        spare = len(means) - 1 - dummies.shape[1]
        between = math.sqrt(max(0.0, float(np.sum(means**2 - expected)) / spare)) if spare > 0 else 0.0
    left = target - design @ value
    covariance_value = np.linalg.inv(design.T @ design)
    freedom = len(y) - design.shape[1]
    std = math.sqrt(covariance_value[0, 0] * max(1.0, float(left @ left) / max(freedom, 1)))
    count = int(runs.max()) + 1
    if count >= _ENOUGH_RUNS:
        # The loads take up degrees of freedom of the moves, not of their nodes.
        robust = sandwich(design, left, runs)[0, 0] * count / max(count - dummies.shape[1], 1)
        std = max(std, math.sqrt(robust))
        freedom = max(count - design.shape[1], 1)
    return float(value[0]), student(freedom) * std


def _sheet(hydraulics: Hydraulics, moves: Moves, balance: Balance) -> Array:
    """The data sheet's friction at each node [N], in the direction of lifting."""
    velocity = ca.DM(moves.mean(balance.velocity))
    return np.asarray(hydraulics.unit.cylinder.friction(velocity), dtype=np.float64).ravel()


def same_loads(hydraulics: Hydraulics, moves: Moves, balance: Balance) -> Places:
    """Number the nodes by loads: the same number, the same load, as far as can be told; shape (n,).

    A rod that moved at rest by more than friction can hold says that the load changed. Where it touched a stop that
    cannot be seen; then a difference that friction could make is taken for friction, if most other reversals agree.

    Args:
        hydraulics: of the record.
        moves: its nodes.
        balance: with the fitted deviation.
    """
    force, sheet = moves.mean(balance.force), _sheet(hydraulics, moves, balance)
    runs = np.unique(moves.run)
    rows = [moves.run == number for number in runs]
    mean_force, mean_sheet = (np.array([values[r].mean() for r in rows]) for values in (force, sheet))
    starts = np.array([int(np.argmax(r)) for r in rows])
    give = hydraulics.capacity()[moves.first[starts]] / hydraulics.area**2
    holds = 2.0 * hydraulics.unit.cylinder.breakaway_friction
    with np.errstate(invalid="ignore"):
        changed = moves.moved[starts] > holds * give
    change, expected = np.diff(mean_force), np.diff(mean_sheet)
    reverses = np.diff(np.sign(mean_sheet)) != 0.0
    factor = change / np.where(reverses, expected, 1.0)
    same = np.where(reverses, (factor > 0.0) & (factor < _MOST), np.abs(change) < 0.25 * holds) & ~changed[1:]
    pairs = factor[same & reverses]
    if pairs.size >= 3:
        middle = np.median(pairs)
        reach = max(_ALIKE, _SCATTER * float(np.median(np.abs(pairs - middle))))
        same &= ~reverses | (np.abs(factor - middle) < reach)
    number = np.concatenate([[0], np.cumsum(~same)])
    return np.asarray(number[np.searchsorted(runs, moves.run)], dtype=np.int64)
