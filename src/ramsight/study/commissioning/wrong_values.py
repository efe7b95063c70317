"""The likeliest wrong value of a description, where ends, leak test, torque at relief and position contradict it.

Explanations are compared as `tracking.mistakes` compares readings of a log: the description as it is against the same
with one value changed, each with a prior, each averaged over what it leaves open. What machines of one type differ by
(`assumptions.machine`) is in the covariance of the observations, so a machine within its tolerances is no mistake.

Each observation of a log is a logarithm with a standard deviation, and `predicted` gives what a unit would show in its
place. The travel from end to end needs no position sensor; with one, the travel of a turn and the stroke are known
apart.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from statistics import median

import numpy as np

from ramsight.arrays import Array, Bools
from ramsight.calibration.leakage import LeakTest
from ramsight.errors import DescriptionError
from ramsight.machine.base import walk
from ramsight.machine.declare import Quantity
from ramsight.machine.description import Unit
from ramsight.plant.build import build
from ramsight.plant.directional import metered
from ramsight.plant.oil import T40
from ramsight.plant.unit import HydraulicUnit
from ramsight.signals import Dataset
from ramsight.study.commissioning.finding import Finding, Verdict
from ramsight.tracking.end_visits import visits
from ramsight.tracking.mistakes import SURE, WORTH, log_mean, probabilities
from ramsight.tracking.pressed import Pressed, Side, pressing_sides

RELIEF = {1: "relief torque extending", -1: "relief torque retracting"}
TRAVEL, LEAK, TURN, STROKE = "motor angle from end to end", "leak test", "travel of a turn", "stroke"
_LEVEL = 0.93  # of the highest plateau of a way, from which on a plateau is at the relief valve, too
_PRESS_STD = 0.02  # relative, of a plateau: override of the valve, friction of the pumps
_TRAVEL_STD = 0.008  # relative, of the angle from end to end: oil that is compressed, contacts that are seen late
_TURN_STD = 0.004  # relative, of the travel of a turn by a position sensor
_STROKE_STD = 0.003  # relative, of the stroke between stops by a position sensor
_MARGIN, _SPAN = 0.05, 0.1  # of the stroke: what is left out at either end; of a move that counts
_HELD = 0.5  # of the motor speed of a move, below which it is beginning or ending
_AT_RELIEF = 0.9  # of the torque at relief, beyond which oil goes over the valve


@dataclass(frozen=True)
class Observation:
    """One thing that a log says."""

    value: float  # natural logarithm of it, in SI
    std: float  # of that logarithm, from the log alone


def predicted(unit: HydraulicUnit) -> dict[str, float]:
    """What a unit would show: natural logarithms of the observations, in SI.

    Example:
        >>> import ramsight
        >>> round(math.exp(predicted(ramsight.build("mining-loader", "boom"))[STROKE]), 3)
        0.7
    """
    stops, per_radian, sides = unit.assumptions.stops, abs(unit.travel_per_radian), pressing_sides(unit)
    stroke = float(unit.cylinder.stroke) - stops.retracted - stops.extended
    found = {TRAVEL: math.log(stroke / per_radian), STROKE: math.log(stroke), TURN: math.log(per_radian)}
    found |= {RELIEF[way]: math.log(side.torque) for way, side in sides.items()}
    lifting = _lifting(unit, sides)
    if lifting is not None and lifting.leaking > 0.0:
        found[LEAK] = math.log(lifting.leaking / lifting.torque)
    return found


def observed(
    unit: HydraulicUnit, log: Dataset, track: Dataset, leak_test: LeakTest | None, truth: Dataset | None
) -> dict[str, Observation]:
    """What a log says of the machine; observations that it does not hold are left out.

    Args:
        unit: as described: where a stop is met, and how much leaks where there is no leak test.
        log: motor_speed [rad/s], motor_torque [N m], oil_temperature [K] over time [s], without gaps.
        truth: measured position [m] over time [s], if there is one.
    """
    sides = pressing_sides(unit)
    found = _relief_torques(unit, log, sides)
    lifting, leak = _lifting(unit, sides), 0.0
    if lifting is not None and lifting.leaking > 0.0:
        leak = lifting.leaking / lifting.torque * (1.0 if leak_test is None else leak_test.factor)
        if leak_test is not None:
            found[LEAK] = Observation(math.log(leak), leak_test.std / leak_test.factor)
    leaking = leak * _thinness(unit, log["oil_temperature"].values) * log["motor_torque"].values
    travel = _travel(log, track, leaking, unit.cylinder.stroke)
    if travel is not None:
        relative = unit.assumptions.machine.leak if leak_test is None else 0.1
        found[TRAVEL] = Observation(math.log(travel[0]), math.hypot(_TRAVEL_STD, relative * travel[1]))
    if truth is not None:
        found |= _measured(unit, log, truth, leaking, sides, LEAK in found)
    return found


def _lifting(unit: HydraulicUnit, sides: Mapping[int, Side]) -> Side | None:
    return sides.get(int(unit.lift_sign))


def _thinness(unit: HydraulicUnit, temperature: Array) -> Array:
    """How much thinner the oil is than at 40 degC [1]."""
    warm = np.clip(np.nan_to_num(temperature, nan=T40), *unit.oil.temperatures)
    kinds, which = np.unique(np.round(warm), return_inverse=True)  # whole kelvins
    thin = [float(unit.oil.viscosity(T40)) / float(unit.oil.viscosity(kelvin)) for kelvin in kinds]
    return np.asarray(np.array(thin)[which])


def _relief_torques(unit: HydraulicUnit, log: Dataset, sides: Mapping[int, Side]) -> dict[str, Observation]:
    """Torque of the highest plateaus of each way."""
    pressed = Pressed(unit)
    pressed.take(*(log[name].values for name in ("time", "motor_speed", "motor_torque", "oil_temperature")))
    found = {}
    for way, side in sides.items():
        levels = [press.level for press in pressed.presses if press.way == way]
        if levels:
            at = median(level for level in levels if level >= _LEVEL * max(levels))
            found[RELIEF[way]] = Observation(math.log(at * side.torque), _PRESS_STD)
    return found


def _travel(log: Dataset, track: Dataset, leaking: Array, stroke: float) -> tuple[float, float] | None:
    """Motor angle from one end to the other [rad], and what share of it leakage was; None without such a travel."""
    time, speed = log["time"].values, log["motor_speed"].values
    steps = np.diff(time, prepend=time[0])
    net, leaked = np.cumsum((speed - leaking) * steps), np.cumsum(np.abs(leaking) * steps)
    angles = []
    for a, b in pairwise(visits(track, stroke)):
        if a.way != b.way:
            first, last = np.searchsorted(time, [a.ends, b.begins])
            angle = abs(float(net[last] - net[first]))
            angles.append((angle, float(leaked[last] - leaked[first]) / max(angle, 1e-9)))
    usable = [one for one in angles if one[0] > 0.5 * max(angles)[0]]
    if not usable:
        return None
    return median(angle for angle, _ in usable), median(share for _, share in usable)


def _measured(
    unit: HydraulicUnit, log: Dataset, truth: Dataset, leaking: Array, sides: Mapping[int, Side], is_leak_known: bool
) -> dict[str, Observation]:
    """Travel of a turn and stroke by the measured position."""
    time, speed, torque = (log[name].values for name in ("time", "motor_speed", "motor_torque"))
    place = np.interp(time, truth["time"].values, truth["position"].values, left=np.nan, right=np.nan)
    low, high = float(np.nanmin(place)), float(np.nanmax(place))
    found = {}
    if high - low > 0.5 * unit.cylinder.stroke:
        found[STROKE] = Observation(math.log(high - low), _STROKE_STD)
    margin = _MARGIN * (high - low)
    free = (place > low + margin) & (place < high - margin)
    for way, side in sides.items():
        free &= (np.sign(speed) != way) | (way * torque < _AT_RELIEF * side.torque)
    steps = np.diff(time, prepend=time[0])
    angle, leaked = np.cumsum(speed * steps), np.cumsum(leaking * steps)
    rows = []
    for first, last in _steady_moves(speed, free):
        gone = float(place[last] - place[first])
        if abs(gone) > _SPAN * (high - low):
            rows.append((gone, float(angle[last] - angle[first]), -float(leaked[last] - leaked[first])))
    if len(rows) < 2:
        return found
    gone, turned, lost = np.array(rows).T
    if is_leak_known:
        per_turn = float((turned + lost) @ gone / ((turned + lost) @ (turned + lost)))
    else:
        per_turn = float(np.linalg.lstsq(np.column_stack([turned, lost]), gone, rcond=None)[0][0])
    if per_turn > 0.0:
        found[TURN] = Observation(math.log(per_turn), _TURN_STD)
    return found


def _steady_moves(speed: Array, free: Bools) -> list[tuple[int, int]]:
    """First and last sample of each stretch in which the motor turns steadily one way and the piston is free."""
    edges = np.flatnonzero(np.diff(np.sign(speed).astype(int), prepend=9, append=9))
    found = []
    for first, after in pairwise(edges):
        here = np.abs(speed[first:after])
        steady = np.flatnonzero((here > _HELD * here.max()) & free[first:after]) if here.max() > 0.0 else np.array([])
        if steady.size > 2:
            found.append((int(first + steady[0]), int(first + steady[-1])))
    return found


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
