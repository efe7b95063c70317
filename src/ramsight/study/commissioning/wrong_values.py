"""The likeliest wrong value of a description, where ends, leak test, torque at relief and position contradict it.

Explanations are compared as `tracking.mistakes` compares readings of a log: the description as it is against the same
with one value changed, each with a prior, each averaged over what it leaves open. What machines of one type differ by
(`assumptions.machine`) is in the covariance of the observations, so a machine within its tolerances is no mistake.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array
from ramsight.calibration.leakage import LeakTest
from ramsight.errors import DescriptionError
from ramsight.machine.base import walk
from ramsight.machine.declare import Quantity
from ramsight.machine.description import Unit
from ramsight.plant.build import build
from ramsight.plant.directional import metered
from ramsight.plant.unit import HydraulicUnit
from ramsight.signals import Dataset
from ramsight.study.commissioning.finding import Finding, Verdict
from ramsight.study.commissioning.observed import LEAK, RELIEF, STROKE, TRAVEL, TURN, Observation, observed, predicted
from ramsight.tracking.mistakes import SURE, WORTH, log_mean, probabilities

_PRIOR_AS_DESCRIBED = 0.9
PRIORS = {
    "displacement": 1.0, "bore": 1.0, "stroke": 1.0, "setting": 1.0, "belt": 0.5, "rod": 0.5,
    "volumetric_efficiency": 0.5,
}  # fmt: skip
"""Keys whose values are compared, and how often each is the wrong one, relative to the others [G]."""
_FARTHEST = 0.3  # of the logarithm of a wrong value over the true one
_FINE = np.arange(-_FARTHEST, _FARTHEST + 1e-9, 0.0025)
_COARSE = np.linspace(-_FARTHEST, _FARTHEST, 7)


@dataclass(frozen=True)
class WrongValue:
    """A value of a description that is likely wrong."""

    path: str  # of the value, below its unit
    described: float  # the value as it stands [SI]
    fits: float  # the value that fits [SI]
    # low, high: its 95 % interval [SI]
    low: float
    high: float
    probability: float  # of this explanation, among all that were compared [1]
    declared: Quantity  # how the value is declared
    misfit: float = 0.0  # by how many standard deviations the observations are off with the value that fits [1]
    others: tuple[str, ...] = ()  # paths of explanations that are less likely, and not much so

    @property
    def text(self) -> str:
        """The value that fits, with its interval, and what is described, in a line."""
        shown = [self.declared.show(value, 4) for value in (self.fits, self.low, self.high, self.described)]
        also = f" (or, less likely: {', '.join(self.others)})" if self.others else ""
        return f"{self.path}: {shown[0]} would fit ({shown[1]} to {shown[2]}), described is {shown[3]}{also}"


@dataclass(frozen=True)
class Judgement:
    """A description against what a log says."""

    off: dict[str, float]  # by how much each observation is off what is described, relative [1]
    wrong: WrongValue | None  # the likeliest wrong value; None where the description as it stands is likely enough
    probability: float  # of the description as it stands [1]


def judge(name: str, described: Unit, unit: HydraulicUnit, seen: Mapping[str, Observation]) -> Judgement:
    """Compare a description with the same with one value changed."""
    base = predicted(unit)
    names = [one for one in seen if one in base]
    if not names:
        return Judgement({}, None, 1.0)
    off = np.array([seen[one].value - base[one] for one in names])
    weight: Array = np.asarray(np.linalg.inv(_covariance(unit, names, seen)), dtype=np.float64)
    candidates = list(_candidates(name, described, names, base))
    total = sum(PRIORS[path.rpartition(".")[2]] for path, _, _, _ in candidates)
    scores = [math.log(_PRIOR_AS_DESCRIBED) + _density(off, weight)]
    spread, largest = [], []
    for path, _, _, moves in candidates:
        each = [_density(off - move, weight) for move in moves]
        prior = (1.0 - _PRIOR_AS_DESCRIBED) * PRIORS[path.rpartition(".")[2]] / total
        scores.append(math.log(prior) + log_mean(each))
        spread.append(np.exp(np.array(each) - max(each)))
        largest.append(max(each))
    chances = probabilities(scores)
    shown = dict(zip(names, np.expm1(off).tolist(), strict=True))
    if chances[0] >= SURE or not candidates:
        return Judgement(shown, None, chances[0])
    order = sorted(range(len(candidates)), key=lambda k: -scores[k + 1])
    best = order[0]
    path, value, declared, _ = candidates[best]
    others = tuple(candidates[k][0] for k in order[1:] if scores[k + 1] > scores[best + 1] + WORTH)
    low, fits, high = (value * math.exp(x) for x in np.interp([0.025, 0.5, 0.975], _cumulated(spread[best]), _FINE))
    misfit = math.sqrt(-2.0 * largest[best])
    wrong = WrongValue(path, value, fits, low, high, chances[best + 1], declared, misfit, others)
    return Judgement(shown, wrong, chances[0])


def _candidates(
    name: str, described: Unit, names: list[str], base: Mapping[str, float]
) -> Iterator[tuple[str, float, Quantity, Array]]:
    """Path, value and declaration of each, and what changing it by `_FINE` makes of the observations."""
    for one in walk(described):
        if one.path.rpartition(".")[2] not in PRIORS or one.declared is None or not one.value:
            continue
        shares, rows = [], []
        for share in _COARSE:
            try:
                other = predicted(build(described.replace({one.path: one.value * math.exp(share)}), name))
            except DescriptionError:
                continue
            if all(key in other for key in names):
                shares.append(share)
                rows.append([other[key] - base[key] for key in names])
        if len(shares) > 2 and np.abs(rows).max() > 0.0:
            moves = np.column_stack([np.interp(_FINE, shares, column) for column in np.array(rows).T])
            yield one.path, float(one.value), one.declared, moves


def _covariance(unit: HydraulicUnit, names: list[str], seen: Mapping[str, Observation]) -> Array:
    """Of the observations of machines as described: what the log leaves open, and what machines differ by."""
    machine, drive = unit.assumptions.machine, unit.assumptions.drive
    common = (
        (machine.displacement, {TRAVEL: -1.0, TURN: 1.0, LEAK: -1.0, RELIEF[1]: 1.0, RELIEF[-1]: 1.0}),
        (drive.torque_gain, {LEAK: -1.0, RELIEF[1]: 1.0, RELIEF[-1]: 1.0}),
        (machine.leak, {LEAK: 1.0}),
        (machine.relief, {RELIEF[1]: 1.0}),
        (machine.relief, {RELIEF[-1]: 1.0}),
        (unit.assumptions.stops.std, {TRAVEL: 1.0, STROKE: 1.0}),
    )
    found = np.diag([seen[one].std ** 2 for one in names])
    for std, loads in common:
        column = std * np.array([loads.get(one, 0.0) for one in names])
        found += np.outer(column, column)
    return np.asarray(found)


def _density(off: Array, weight: Array) -> float:
    return -0.5 * float(off @ weight @ off)


def _cumulated(density: Array) -> Array:
    """Distribution function over `_FINE`, strictly increasing."""
    total = np.cumsum(density + 1e-12)
    return np.asarray(total / total[-1])


CHECK = "description"
_STROKE = "cylinder.stroke"
_WEAR = "volumetric_efficiency"  # what a worn pump has less of


def description(
    described: Unit | None,
    unit: HydraulicUnit,
    log: Dataset,
    track: Dataset,
    leak_test: LeakTest | None,
    truth: Dataset | None,
) -> tuple[Finding, WrongValue | None]:
    """A finding on the description, and the value that is likely wrong, if one is.

    Args:
        described: the description of the unit; None where it was built of something else.
        truth: measured position [m] over time [s], if there is one.
    """
    if described is None:
        return Finding(CHECK, Verdict.OPEN, "the unit was built without one"), None
    if metered(unit.parts()):
        return Finding(CHECK, Verdict.OPEN, "a valve meters the rod: the motor's angle is not the rod's travel"), None
    found = judge(unit.name, described, unit, observed(unit, log, track, leak_test, truth))
    if not found.off:
        return Finding(CHECK, Verdict.OPEN, "the log shows nothing to compare it with: ends, torque at relief"), None
    shown = ", ".join(f"{name} {100 * off:+.1f} %" for name, off in found.off.items())
    if found.wrong is None:
        return Finding(CHECK, Verdict.PASSED, f"beside what is described: {shown}"), None
    stopped = ", or something stopped the rod before its end" if found.wrong.path == _STROKE and truth is None else ""
    remedy = f"likeliest wrong value: {found.wrong.text}{stopped}; check and correct it, then commission again"
    worn = found.wrong.path.endswith(_WEAR)
    return Finding(CHECK, Verdict.LOOK_TWICE if worn else Verdict.FAILED, f"contradicted: {shown}", remedy), found.wrong
